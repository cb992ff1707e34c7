"""What a fit does not know: names, ranges, and the blow that values of them make."""

import dataclasses
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any, cast

import numpy as np
from numpy.polynomial import chebyshev

from .._base import check
from ..impact import accuracy
from ..impact.contact import NUMBERS, Contact, wall_time
from ..impact.striker import Striker
from ..modes.modal import Modes
from . import blows
from .rig import Rig

STRIKER = ("mass", "first_frequency", "mode_ratio", "damping", "tip_mass")
TARGET = ("mass", "first_frequency", "damping", "x", "y")
MODE = ("frequency", "mass", "damping", "gain")
MOST_MODES = 6  # [-] of an unknown target: a pulse determines few, and each has several unknowns
DAMPING = 0.02  # [-] of unknown modes, unless it is unknown too: takes an eighth of each swing; a choice
# [-] along each unknown coordinate of the strike point at which the compliance is computed: a quartic between
PLACES = 5
UNITS = {
    "stiffness": "N/m**exponent", "exponent": "", "loss": "s/m", "mass": "kg", "first_frequency": "Hz",
    "mode_ratio": "", "damping": "", "tip_mass": "kg", "x": "m", "y": "m", "frequency": "Hz", "gain": "", "gap": "m",
    **{name: number.unit for name, number in NUMBERS.items()},
}  # fmt: skip
TIME = "contact.time"  # the coordinate that stands for the stiffness while fitting [s]


def unit_of(name: str) -> str:
    """The unit of an unknown, for messages and tables."""
    return "m/s" if name.startswith("speed") else UNITS.get(name.rpartition(".")[2], "s" if name == TIME else "")


class Values(dict[str, float]):
    """Numbers by name for a function of the user's, which say so if it asks for another."""

    def __missing__(self, name: Any) -> float:
        here = ", ".join(map(repr, self)) or "nothing"
        raise ValueError(f"the function asks for {check.shown(name)}, but gets {here}{check.nearest(name, self)}")


@dataclass(frozen=True)
class Unknown:
    """A number to be found between two bounds; by its logarithm if both are positive."""

    name: str
    low: float
    high: float

    @property
    def log(self) -> bool:
        return self.low > 0.0

    @property
    def floor(self) -> bool:
        """Whether the lower bound is a natural limit: what is never negative may be zero."""
        return self.low == 0.0

    def inside(self, value: Any) -> Any:
        """Coordinate of a value: its logarithm, or its part of the range."""
        return np.log(value) if self.log else (np.asarray(value) - self.low) / (self.high - self.low)

    def outside(self, x: Any) -> Any:
        """Value of a coordinate."""
        return np.exp(x) if self.log else self.low + np.asarray(x) * (self.high - self.low)

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the coordinate."""
        return float(self.inside(self.low)), float(self.inside(self.high))


@dataclass(frozen=True)
class Box:
    """Unknowns, and the box that their coordinates fill."""

    unknowns: tuple[Unknown, ...]

    @classmethod
    def of(cls, label: str, value: Any) -> "Box":
        """From a mapping of names to (low, high), at least one."""
        limits = check.table(label, value)
        if not limits:
            raise ValueError(f'{label} must name at least one range, as in {{"contact.stiffness": (1e5, 1e8)}}')
        found = []
        for name, ends in limits.items():
            one = f"{label}[{name!r}]"
            if not isinstance(ends, (tuple, list)) or len(ends) != 2:
                raise ValueError(f"{one} must be a range (low, high), got {check.shown(ends)}")
            low, high = check.array(one, ends, (2,), unit_of(name)).tolist()
            if not low < high:
                raise ValueError(f"{one} must be a range (low, high), got ({low:g}, {high:g})")
            found.append(Unknown(name, low, high))
        return cls(tuple(found))

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(each.name for each in self.unknowns)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the coordinates, (n_unknowns,) each."""
        low, high = np.array([each.bounds for each in self.unknowns]).reshape(-1, 2).T
        return low, high

    def values_at(self, x: np.ndarray) -> dict[str, float]:
        """The unknowns by name at coordinates (n_unknowns,)."""
        pairs = zip(self.unknowns, x)
        return Values({each.name: float(np.clip(each.outside(z), each.low, each.high)) for each, z in pairs})

    def start_at(self, given: Any) -> np.ndarray:
        """Coordinates (n_unknowns,) of the values given by name; of others the middle of the range."""
        table, (low, high) = check.table("start", given), self.bounds
        for name in table:
            check.one_of("start", name, self.names)
        x = 0.5 * (low + high)
        for i, each in enumerate(self.unknowns):
            if each.name in table:
                x[i] = each.inside(check.between(f"start[{each.name!r}]", table[each.name], each.low, each.high))
        return x


def checked(
    unknown: Mapping[str, Any],
    target: Modes | None,
    striker: Striker,
    contact: Contact,
    known: Mapping[str, float] | None = None,
) -> tuple[Unknown, ...]:
    """The unknowns by name; ValueError for a name that nothing here has, and for ranges that make no contact."""
    found = Box.of("unknown", unknown).unknowns
    contacts = [field.name for field in dataclasses.fields(contact) if field.type in ("float", float)]
    modes = sorted({int(name[4]) for name in unknown if re.match(r"mode\d\.", str(name))})
    contains = [f"contact.{name}" for name in contacts] + [f"striker.{name}" for name in STRIKER]
    contains += [f"target.{name}" for name in TARGET if target is not None or name == "mass"]
    contains += [f"mode{i}.{name}" for i in range(1, MOST_MODES + 1) for name in MODE]
    for each in found:
        name, positive = each.name, (".stiffness", ".exponent", ".frequency", "first_frequency", "r.mass", "t.mass")
        _check_name("unknown", name, contains)
        if name.endswith((*positive, "mass")) and each.low < 0.0:
            raise ValueError(f"unknown[{name!r}] must not reach below zero, got {each.low:g} {unit_of(name)}")
        if name.endswith(positive) and not each.log:
            raise ValueError(f"unknown[{name!r}] must begin above zero, got {each.low:g} {unit_of(name)}")
    held = known or {}
    for name in held:
        _check_name("known", name, contains)
    own = [each for each in found if each.name.startswith("contact.")]
    for ends in product(*((each.low, each.high) for each in own)):
        try:
            changed_contact(contact, {**held, **{each.name: end for each, end in zip(own, ends)}})
        except ValueError as error:
            raise ValueError(f"unknown and known must make a contact within all ranges: {error}") from None
    for i in modes:
        for part in ("frequency", "mass"):
            if f"mode{i}.{part}" not in unknown:
                raise ValueError(f"unknown must hold mode{i}.{part} too: a mode needs a frequency and a modal mass")
    if modes != list(range(1, len(modes) + 1)):
        raise ValueError(f"unknown must number its modes from 1, got {modes}")
    if striker.modes.n_modes > 1:
        if "striker.mode_ratio" in unknown:
            raise ValueError("unknown striker.mode_ratio is for a rigid striker; this one has modes of its own")
    elif "striker.first_frequency" not in unknown and {"striker.mode_ratio", "striker.damping"} & set(unknown):
        raise ValueError("unknown must hold striker.first_frequency too: the striker given is rigid")
    return found


def _check_name(label: str, name: str, names: list[str]) -> None:
    """ValueError that lists the names, without all the modes."""
    if name not in names:
        check.one_of(label, name, [each for each in names if not re.match(r"mode[2-9]", each)])


def changed_contact(contact: Contact, values: Mapping[str, float]) -> Contact:
    """The contact with the values whose names begin with ``contact.``; others do not matter."""
    given: dict[str, Any] = {
        name.removeprefix("contact."): float(x) for name, x in values.items() if name.startswith("contact.")
    }
    given.pop("time", None)
    return replace(contact, **given)


def _products(rows: np.ndarray) -> np.ndarray:
    """Products of Chebyshev polynomials of coordinates (n_rows, n_axes) within -1 and 1, (n_rows, PLACES**n_axes)."""
    found = np.ones((len(rows), 1))
    for column in rows.T:
        found = (found[:, :, None] * chebyshev.chebvander(column, PLACES - 1)[:, None]).reshape(len(rows), -1)
    return found


@dataclass(frozen=True, eq=False, repr=False)
class Setting(check.Brief):
    """What is known of a blow, and what is not."""

    target: Modes | None  # None: a wall, or a target of unknown modes only
    at: Any
    striker: Striker
    contact: Contact
    rig: Rig
    unknown: tuple[Unknown, ...]
    points: Any  # (n_points, dimension) [m] where the response is measured; None without a known target
    n_points: int
    impulse: float  # [N s] of a typical tap: sets the speed at which the contact time is stated

    def records(self, values: Mapping[str, float], speeds: np.ndarray, n_times: int, lead: int) -> np.ndarray:
        """Fine records of the blows that the values make, see `blows.records`."""
        law, mass = changed_contact(self.contact, values), self.felt_mass(values)
        met = replace(law, gap=0.0) if law.gap else law  # the record begins where the bodies touch
        return blows.records(
            self.hammer(values), self.structure(values), met, speeds, lead=lead, rig=self.rig, n_times=n_times,
            duration=accuracy.contact_duration(law, mass, 0.5 * self.impulse / mass),
            tip_mass=values.get("striker.tip_mass", self.rig.tip_mass),
        )  # fmt: skip

    @cached_property
    def _hammer(self) -> blows.TappedBody:
        return blows.of_striker(self.striker)

    @cached_property
    def _structure(self) -> blows.TappedBody:
        if self.target is None:
            return blows.wall(self.n_points)
        return blows.of_target(self.target, self.at, self.points)

    def hammer(self, values: Mapping[str, float]) -> blows.TappedBody:
        """The striker with its unknowns."""
        part = {name: values.get(f"striker.{name}") for name in STRIKER}
        if self.striker.modes.n_modes > 1:
            return self._hammer.scaled(part["mass"], part["first_frequency"], part["damping"])
        body = self._hammer.scaled(part["mass"], None, None)
        if part["first_frequency"] is None:
            return body
        # without a ratio, two equal masses and a spring, as nothing is known
        ratio = 1.0 if part["mode_ratio"] is None else part["mode_ratio"]
        damping = DAMPING if part["damping"] is None else part["damping"]
        return body.with_mode(part["first_frequency"], body.felt_mass / ratio, damping, np.zeros(0))

    def structure(self, values: Mapping[str, float]) -> blows.TappedBody:
        """The struck body with its unknowns."""
        part = {name: values.get(f"target.{name}") for name in TARGET}
        body = self._structure
        if self.target is None:
            if part["mass"] is not None:
                body = body.with_mode(0.0, part["mass"], 0.0, np.ones(self.n_points))
        else:
            if part["x"] is not None or part["y"] is not None:
                moved = np.array(self.at, float).ravel()
                for i, axis in enumerate("xy"[: len(moved)]):
                    moved[i] = moved[i] if part[axis] is None else part[axis]
                body = blows.of_target(self.target, moved, self.points, self._softness(moved))
            body = body.scaled(part["mass"], part["first_frequency"], part["damping"])
        for i in range(1, MOST_MODES + 1):
            if f"mode{i}.frequency" not in values:
                break
            frequency, mass = values[f"mode{i}.frequency"], values[f"mode{i}.mass"]
            gain = np.full(self.n_points, values.get(f"mode{i}.gain", 1.0))
            body = body.with_mode(frequency, mass, values.get(f"mode{i}.damping", DAMPING), gain)
        return body

    @cached_property
    def _softness(self) -> Callable[[np.ndarray], float]:
        """Static compliance [m/N] of the target over the places (dimension,) [m] that are not known.

        Each needs a solution with finite elements, so that a few are interpolated by polynomials.
        """
        target, place = cast(Modes, self.target), np.array(self.at, float).ravel()
        ranges = {each.name: (each.low, each.high) for each in self.unknown}
        limits = np.array([ranges.get(f"target.{axis}", (x, x)) for axis, x in zip("xyz", place)])
        middle, half = limits.mean(axis=1), 0.5 * np.ptp(limits, axis=1)
        free = np.flatnonzero(half > 0.0)
        rows = np.array(list(product(chebyshev.chebpts1(PLACES), repeat=len(free))))  # (n_places, n_free)
        places = np.tile(middle, (len(rows), 1))
        places[:, free] += half[free] * rows
        values = np.diag(target.shapes.compliance(target.points("the range of target.x and target.y", places)))
        weights = np.linalg.solve(_products(rows), values)
        return lambda at: float(_products(((at - middle)[free] / half[free])[None])[0] @ weights)

    def felt_mass(self, values: Mapping[str, float]) -> float:
        """Mass of the striker at its contact point [kg]."""
        mass = values.get("striker.mass")
        return self._hammer.felt_mass * (1.0 if mass is None else mass / self._hammer.mass)

    def contact_time(self, values: Mapping[str, float]) -> float:
        """Time [s] on a wall of a blow with half the typical impulse, without loss: what stands for the stiffness."""
        mass = self.felt_mass(values)
        k = values.get("contact.stiffness", self.contact.stiffness)
        a = values.get("contact.exponent", self.contact.exponent)
        return float(wall_time(k, a, 1.0 / mass, 0.5 * self.impulse / mass))

    def stiffness(self, values: Mapping[str, float], time: float) -> float:
        """The stiffness [N/m**exponent] that `contact_time` has this contact time [s] for."""
        mass, exponent = self.felt_mass(values), values.get("contact.exponent", self.contact.exponent)
        return accuracy.lasting_stiffness(time, exponent, mass, 0.5 * self.impulse / mass)
