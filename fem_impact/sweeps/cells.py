"""The cells of a map: one blow, and the parameters along which a map may vary it."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial, reduce
from typing import Any

import numpy as np

from .._base import check
from ..impact import accuracy
from ..impact.collision import strike
from ..impact.contact import MARKS, NUMBERS, Contact
from ..impact.response import Response
from ..impact.striker import Striker
from ..model.audit import with_examiner
from ..modes.modal import Modes
from ..modes.shapes import SampledShapes, compliance_errors

AXES = {  # name: unit, what it is, its name in a scene file
    "mass": ("kg", "mass of the striker", "striker.mass"),
    "striker_frequency": ("Hz", "first flexible frequency of the striker", "striker.first_frequency"),
    "stiffness": ("N/m**exponent", "stiffness of the contact", "contact.stiffness"),
    "exponent": ("", "exponent of the contact", "contact.exponent"),
    "loss": ("s/m", "loss factor of the contact", "contact.loss"),
    "gap": ("m", "distance the striker travels before contact", "contact.gap"),
    **{name: (number.unit, number.axis, f"contact.{name}") for name, number in NUMBERS.items()},
    "speed": ("m/s", "speed of the striker's contact point", "strike.speed"),
    "at": ("m", "strike point", "strike.at"),
    "target_mass": ("kg", "mass of the struck body", "target.mass"),
    "target_frequency": ("Hz", "first flexible frequency of the struck body", "target.first_frequency"),
    "damping_ratio": ("", "damping ratio of the struck body", "target.damping_ratio"),
}
LAW = ["stiffness", "exponent", "loss", "gap", *NUMBERS]  # the axes that change the contact
ALIASES = {alias: name for name, (_, _, alias) in AXES.items()}
ALONE = set(MARKS)  # axes of contacts whose cells are computed alone
RATED = "loss", *(mark for mark, law in MARKS.items() if law.rated)  # those of contacts whose force depends on the rate
LOSSY = {"loss", *(mark for mark, law in MARKS.items() if law.remembers)}  # and of those that take energy
FAMILY_AXES = ("at", "target_frequency", "striker_frequency", "damping_ratio")  # each value needs new kernels
# [-] values along an axis that has no count: 160 000 cells together take some 2 s, 10 000 alone some 20 s
SIDE = {True: 400, False: 100}
MOST_VALUES = 10**6  # [-] most values along one axis of a map
REACH = 1e30  # [SI] numbers of a blow lie between 1/REACH and REACH: beyond, the kernels never finish


def read_axis(name: str, values: Any) -> Any:
    """Values along an axis from a list or a range {from, to, count, scale}; without a count a partial that takes it."""
    if isinstance(values, list):
        return np.array(values)
    if not isinstance(values, Mapping) or not {"from", "to"} <= set(values) <= {"from", "to", "count", "scale"}:
        raise ValueError(
            f"{name} must be a list or {{ from, to, count, scale = 'linear' or 'log' }}, got {check.shown(values)}"
        )
    low, high = check.number(f"{name}.from", values["from"]), check.number(f"{name}.to", values["to"])
    log = check.one_of(f"{name}.scale", values.get("scale", "linear"), ("linear", "log")) == "log"
    if log:
        check.positive(f"{name}.from", low), check.positive(f"{name}.to", high)
    found = partial(np.geomspace if log else np.linspace, low, high)
    if "count" in values:
        return found(check.count(f"{name}.count", values["count"], high=MOST_VALUES))
    if not low < high:
        raise ValueError(f"{name}.to must be above {name}.from, got {high:g} and {low:g}")
    return found


def rescales(name: str, air: Any, damping_ratio: Any) -> bool:
    """Whether an axis that changes the body rescales its modes: not the ``air`` in them, nor damping by frequency."""
    axis = ALIASES.get(name, name)
    if air and axis in ("target_mass", "target_frequency", "damping_ratio"):
        return False
    return axis != "target_frequency" or not callable(damping_ratio)


def laid_out(
    over: Mapping[str, Any], contact: Contact, *, alone: bool = False, cells: int | None = None
) -> tuple[dict[str, Any], bool]:
    """The values along all axes of a map, from values, ranges or what `read_axis` made, and whether any are ours.

    ``alone``: all cells are computed alone, whatever the contact. ``cells`` is the number of values along an axis that
    is a range without a count; by default those of SIDE for two such axes, and as many cells in all whatever the axes.
    """
    if cells is not None:
        check.count("cells", cells, low=2, high=MOST_VALUES)
    found = {name: read_axis(name, values) if isinstance(values, Mapping) else values for name, values in over.items()}
    for name, values in found.items():
        if not isinstance(values, partial) and not np.size(values):
            raise ValueError(f"over[{name!r}] must contain at least one value")
    free = [name for name, values in found.items() if isinstance(values, partial)]
    if not free:
        return found, False
    side = SIDE[computed_together(contact, found) and not alone]
    given = math.prod(len(np.atleast_1d(values)) for values in found.values() if not isinstance(values, partial))
    most = int((side**2 / given) ** (1.0 / len(free)))
    count = max(2, min(side, most)) if cells is None else cells
    return {name: values(count) if name in free else values for name, values in found.items()}, True


def computed_together(contact: Contact, axes: Mapping[str, Any]) -> bool:
    """Whether the blows of a map with these axes are of power laws, which are computed many at once."""
    axes = {ALIASES.get(name, name): values for name, values in axes.items()}
    powers = axes.get("exponent", [contact.exponent])
    powers = powers(2) if isinstance(powers, partial) else powers
    least = check.array("over['exponent']", powers, (None,)).min()
    return bool(least >= 1.0) and not (contact.special or ALONE & set(axes))


def law_numbers(contact: Contact) -> dict[str, float]:
    """The numbers of a contact that decide how its blow is followed, by name."""
    return {name: float(getattr(contact, name)) for name in {*LAW, *ALONE}}


@dataclass(frozen=True, eq=False)
class Case:
    """One cell of a map: the arguments of `strike`."""

    modes: Modes
    striker: Striker
    contact: Contact
    at: np.ndarray  # (dimension,) [m]
    speed: float  # [m/s]
    # The body as excited at each strike point, if it is described by Ritz vectors, which differ from point to point
    views: Mapping[tuple[float, ...], Modes] = field(default_factory=dict)
    first: float | None = None  # [Hz] first flexible mode of the body, if the first of its vectors may be another

    @property
    def resonance(self) -> float:
        """Contact resonance [Hz] of the striker on a rigid wall."""
        return accuracy.contact_resonance(self.contact, self.striker.felt_mass, self.speed)

    @property
    def first_frequency(self) -> float:
        """First flexible frequency [Hz] of the struck body."""
        return self.first or float(self.modes.frequencies[self.modes.omega > 0.0][0])

    def changed(self, name: str, value: Any) -> "Case":
        """The same blow with one parameter of `AXES` replaced."""
        if name == "at":
            modes = self.views.get(tuple(np.atleast_1d(np.asarray(value, float)).tolist()), self.modes)
            return replace(self, at=modes.point("at", value)[0], modes=modes)
        if name == "speed":
            return replace(self, speed=check.positive("speed", value, "m/s", reach=REACH))
        if name in LAW:
            number: Any = {name: float(value)}
            return replace(self, contact=replace(self.contact, **number))
        if name in ("mass", "striker_frequency"):
            key = "mass" if name == "mass" else "first_frequency"
            return replace(self, striker=replace(self.striker, modes=self.striker.modes.scaled(**{key: value})))
        if name == "damping_ratio":
            return self._with(lambda modes: modes.damped(value))
        if name == "target_mass":
            return self._with(lambda modes: modes.scaled(mass=value))
        if self.first is None:
            return self._with(lambda modes: modes.scaled(first_frequency=value))
        ratio = check.positive("first_frequency", value, "Hz") / self.first
        return replace(self._with(lambda modes: modes.stretched(1.0, ratio)), first=ratio * self.first)

    def with_values(self, values: Mapping[str, Any]) -> "Case":
        """The same blow with several parameters of `AXES` replaced."""
        case = self
        for name, value in values.items():
            case = case.changed(name, value)
        return case

    def _with(self, change: Callable[[Modes], Modes]) -> "Case":
        """The same blow on a body changed alike wherever it is struck."""
        return replace(
            self, modes=change(self.modes), views={place: change(modes) for place, modes in self.views.items()}
        )

    def blow(self, **options: Any) -> Response:
        """The blow by the modal engine; ``options`` as of `strike`."""
        hit = strike(self.modes, self.striker, self.contact, at=self.at, speed=self.speed, **options)
        return with_examiner(hit)

    def lacking(self, causes: Iterable[str]) -> "Case":
        """The same blow on the body described less well in these respects (`Modes.descriptions`), where it can be."""
        return self._with(lambda modes: reduce(lambda one, cause: one.poorer.get(cause, one), sorted(causes), modes))

    def sampled(self, places: np.ndarray) -> "Case":
        """The same blow on bodies reduced to their contact points, (n_points, dimension) [m] of the one struck."""
        striker = self.striker
        if striker.modes.dimension:
            striker = replace(striker, modes=sample_modes(striker.modes, striker.at[None]))
        if self.views:
            views = {place: sample_modes(modes, np.array([place])) for place, modes in self.views.items()}
            return replace(self, modes=sample_modes(self.modes, self.at[None]), striker=striker, views=views)
        places = np.unique(np.vstack([places, self.at[None]]), axis=0)
        return replace(self, modes=sample_modes(self.modes, places), striker=striker)


def sample_modes(modes: Modes, points: np.ndarray) -> Modes:
    """Modes at the given points only; leaves out the compliance between different points, which no blow needs."""
    static = np.array([float(modes.shapes.compliance(point[None])[0, 0]) for point in points])
    poorer = {cause: sample_modes(other, points) for cause, other in modes.poorer.items()}
    rest, dents = None, modes.shapes.dent(points)
    if modes.unstated:
        error = np.concatenate([compliance_errors(modes.shapes, point[None])["compliance"] for point in points])
        rest = np.column_stack([np.zeros(len(points)), error])  # nothing between the points, as in the compliance
    known = SampledShapes(
        points, modes.shape_at(points), np.diag(static), rest=rest, rigid=modes.shapes.loose(points),
        doubt=modes.shapes.spread(points), dents=dents if dents.any() else None, sideways=modes.shapes.across(points),
    )  # fmt: skip
    return replace(modes, shapes=known, poorer=poorer)


def checked_axes(base: Case, over: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Checked values of every axis, under its name in `AXES`."""
    if not isinstance(over, Mapping) or not over:
        raise ValueError(f"over must name at least one axis, for example {{'mass': [...]}}, got {check.shown(over)}")
    axes: dict[str, np.ndarray] = {}
    for given, values in over.items():
        name = ALIASES.get(given, given)
        check.one_of("over", name, AXES)
        if name in axes:
            raise ValueError(f"over names the axis {name} twice")
        if name == "at":
            axes[name] = base.modes.points("over['at']", values)
        else:
            axes[name] = check.array(f"over[{given!r}]", values, (None,), AXES[name][0])
        if name != "at":
            for value in (axes[name].min(), axes[name].max()):  # what lies between allowed values is allowed
                if name not in (*LAW, "damping_ratio"):
                    check.positive(f"over[{given!r}]", value, AXES[name][0], reach=REACH)
                base.changed(name, value)  # raises if the body cannot change this way, too
    for mark, law in MARKS.items():
        idle = set(law.numbers) & set(axes)
        if idle and not (getattr(base.contact, mark) or np.any(axes.get(mark, 0.0))):
            raise ValueError(f"contact.{min(idle)} does nothing unless contact.{mark} is positive; give that, too")
    return axes


def is_logarithmic(values: np.ndarray) -> bool:
    """Whether values along an axis (n,) are evenly spaced in the logarithm."""
    if len(values) < 3 or not (values > 0.0).all():
        return False
    spaced = (space(values[0], values[-1], len(values)) for space in (np.geomspace, np.linspace))
    by_factors, by_steps = (float(np.abs(each / values - 1.0).max()) for each in spaced)
    return by_factors < min(1e-3, by_steps)  # of a value: what is typed with four digits
