"""What a fit found, how far the data determine it, and what it predicts."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from .._base import check, markup
from .._base.explained import lines_of_notes
from .._base.rounding import SAME
from ..impact.collision import strike
from ..impact.contact import Contact
from ..impact.measured import Comparison
from ..impact.response import Response
from ..impact.striker import Striker
from ..modes.modal import Modes, carried_compliance
from . import predictions, profiles, solver, windows
from .predictions import Prediction
from .profiles import Profile, Scatter
from .records import Taps
from .solver import Problem, Solution
from .unknowns import UNITS, Unknown, changed_contact, unit_of

Watch = Callable[[int, int], Any]


@dataclass(frozen=True, eq=False, repr=False)
class Found(check.Brief):
    """What `fit` found. Values that the data do not determine are in `unidentifiable` and not in `values`."""

    taps: Taps  # those compared, cut to the window
    used: tuple[int, ...]  # taps that the fit used
    outliers: Mapping[str, float]  # label of a tap that disagrees -> its error when predicted from the others [-]
    problem: Problem
    best: Solution
    # [-] sums of squares at the ends of all searches
    minima: tuple[float, ...]
    notes: tuple[str, ...]
    compared: Mapping[str, float]  # contact law -> root mean square of its errors at left-out taps [-]; if several
    watch: Watch | None = None
    stuck: bool = False  # its own searches ended above a smaller model inside it
    _profiles: dict[str, Profile] = field(default_factory=dict, init=False, repr=False)
    _left_out: dict[bool, tuple[Prediction, ...]] = field(default_factory=dict, init=False, repr=False)

    @property
    def _used(self) -> Taps:
        """The taps that the fit used."""
        return self.taps.pick(list(self.used))

    @cached_property
    def _noise(self) -> tuple[float, int, float]:
        whole = self.problem.residual(self.best.x).reshape(-1, self.problem.data.n_times)
        return profiles.variance(whole, self.problem.n_values)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The unknowns, in the order given."""
        return tuple(each.name for each in self.problem.setting.unknown)

    @cached_property
    def point(self) -> dict[str, float]:
        """The best values of all unknowns and speeds, determined by the data or not: one of many that fit as well.

        Of an unknown freed for each tap: the mean by its name, and each tap's by ``"contact.stiffness[0]"``.
        """
        values = self.problem.values(self.best.x)
        found = {name: values[name] for name in self.names}
        for name, each in self.spreads.items():
            found |= {f"{name}[{i}]": float(value) for i, value in enumerate(each.values)}
        return found | {f"speed[{i}]": float(v) for i, v in enumerate(self.problem.speeds(self.best.x))}

    @property
    def per_tap(self) -> tuple[str, ...]:
        """The unknowns of which every tap has a value of its own."""
        return tuple(name for name, each in zip(self.names, self.problem.free) if each.name in self.problem.own)

    @cached_property
    def spreads(self) -> dict[str, Scatter]:
        """How much the taps used differ in each unknown that was freed for them."""
        noise, freedom, _ = self._noise
        places = {name: _coordinate(self.problem, self.best.x, name) for name in self.per_tap}
        return {name: profiles.scatter(*place, noise, freedom) for name, place in places.items()}

    def profile(self, name: str) -> Profile:
        """The likelihood profile of an unknown, of a tap's own value of it, or of its speed, ``"speed[0]"``."""
        check.one_of("name", name, self.point)
        if name not in self._profiles:
            self._profiles[name] = self._follow(name)[0]
        return self._profiles[name]

    def _follow(self, name: str) -> tuple[Profile, np.ndarray, float]:
        """A profile, and coordinates and sum of squares of the best fit met on the way."""
        problem, x, j = _coordinate(self.problem, self.best.x, name)
        profile, met = profiles.follow_profile(problem, replace(self.best, x=x), j, *self._noise[:2], name)
        return profile, problem.moved(met.x, self.problem), met.cost

    @cached_property
    def profiles(self) -> dict[str, Profile]:
        """The likelihood profiles of all unknowns."""
        for i, name in enumerate(self.names):
            new = name not in self._profiles
            self.profile(name)
            if new and self.watch is not None:
                self.watch(i + 1, len(self.names))
        return {name: self._profiles[name] for name in self.names}

    def interval(self, name: str, level: float = 0.9) -> tuple[float, float]:
        """The range (low, high) that holds a value with a probability; where the data set no limit, that of the range.

        From the likelihood profile with the noise variance estimated, not from the curvature at the best fit.
        """
        return self.profile(name).interval(level)

    @cached_property
    def unidentifiable(self) -> tuple[str, ...]:
        """The unknowns that the data do not determine."""
        return tuple(name for name in self.names if self.profiles[name].kind == "open")

    @cached_property
    def limited(self) -> tuple[str, ...]:
        """The unknowns for which the data set only a lower or an upper limit."""
        return tuple(name for name in self.names if self.profiles[name].kind == "limited")

    @cached_property
    def ridges(self) -> dict[str, dict[str, float]]:
        """Of every unknown that the data do not determine: how the others go along with it, as exponents."""
        return {name: self.profiles[name].ridge for name in self.unidentifiable}

    @property
    def values(self) -> dict[str, float]:
        """The values that the data determine, in SI units; those with a limit only are among them."""
        hidden = set(self.unidentifiable) | {
            f"{name}[{i}]" for name in self.unidentifiable if name in self.per_tap for i in range(len(self.used))
        }
        if self.unidentifiable:  # a speed that moves along a ridge is not determined either
            hidden |= {name for ridge in self.ridges.values() for name in ridge if name.startswith("speed")}
        return {name: value for name, value in self.point.items() if name not in hidden}

    @cached_property
    def residual(self) -> np.ndarray:
        """Predicted less measured force of the taps used, (n_used, n_times) [N]."""
        shape = self.problem.data.values.shape
        return self.problem.residual(self.best.x).reshape(shape)[:, 0] * self.problem.data.scale[:, :1]

    @property
    def _measured(self) -> np.ndarray:
        """Force of the taps used, (n_used, n_times) [N]."""
        return self.problem.data.values[:, 0] * self.problem.data.scale[:, :1]

    @property
    def errors(self) -> np.ndarray:
        """Root mean square of the residual over that of the force, of the taps used, (n_used,) [-]."""
        return np.linalg.norm(self.residual, axis=1) / np.linalg.norm(self._measured, axis=1)

    @property
    def error(self) -> float:
        """The same of all taps used together [-]."""
        return float(np.sqrt(np.mean(self.errors**2)))

    @property
    def whiteness(self) -> float:
        """Probability that white noise has residuals as coloured as these [-]: small means that the model lacks
        something, and that the intervals were widened for it."""
        return self._noise[2]

    @property
    def freedom(self) -> int:
        """Independent samples less the values found [-]: fewer than samples if the residual is coloured."""
        return self._noise[1]

    def residual_spectrum(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Frequencies [Hz], and the amplitude spectra of residual and force, (n_used, n_frequencies) [N s]."""
        rate = self.taps.rate
        spectra = [np.abs(np.fft.rfft(rows, axis=1)) / rate for rows in (self.residual, self._measured)]
        return np.fft.rfftfreq(self.residual.shape[1], 1.0 / rate), spectra[0], spectra[1]

    def predict(self, tap: Any = 0) -> Prediction:
        """A tap as the values found have it: a number of those given, or the first of other `Taps`.

        Its speed and onset, and its own values of the unknowns freed for each tap, are fitted to it.
        """
        if isinstance(tap, Taps):
            windows.same_rate(tap, self.taps)
            span = self.problem.data.n_times / self.taps.rate
            lead = windows.BEFORE / self.taps.rate
            onset = float(tap.onset[0])
            cut = tap.pick(0).between(max(0.0, onset - lead), min(float(tap.time[-1]), onset - lead + span))
        else:
            check.count("tap", tap, low=0, high=self.taps.n_taps - 1)
            cut = self.taps.pick(int(tap))
        return predictions.predict_tap(self.problem, self.best, cut)

    @check.typed
    def left_out(self, *, rise_only: bool = False) -> tuple[Prediction, ...]:
        """Every tap used, predicted from the others.

        All unknowns are found without it, then only its speed and onset, and what was freed for each tap, from itself;
        with ``rise_only`` from its record up to the largest force, so that the fall of the pulse is predicted blindly.
        """
        if len(self.used) < 2:
            raise ValueError("taps must be two at least, to predict one from the others")
        if rise_only not in self._left_out:
            self._left_out[rise_only] = predictions.predict_left_out(self.problem, self.best.x, self._used, rise_only)
        return self._left_out[rise_only]

    @property
    def misfit(self) -> float:
        """What the model lacks: root mean square over the force, as `error`, without the noise of the taps [-]."""
        used = self._used
        noise = np.square(used.noise) / np.square(used.force).mean(axis=1)
        return float(np.sqrt(max(0.0, np.mean(self.errors**2 - noise))))

    @check.typed
    def against(self, measured: Taps | None = None, *, calibration: float = 0.0) -> Comparison:
        """Measured taps beside the bands of their predictions, and a verdict on each; `fi.figures.against` draws it.

        A band holds what the data leave open of the values, what the model lacks (`misfit`), an error of the
        computation of 0.001, and noise and calibration of the measurement. Only speed and onset of a tap, and its own
        values of unknowns freed for each tap, are found from itself.

        Parameters
        ----------
        measured : Taps, optional
            Taps that the fit did not use; by default those used, each predicted from the others.
        calibration : float [-]
            Standard deviation of the scale of a measured force over that of the taps fitted.

        Examples
        --------
        >>> wall, hammer = fi.Modes.rigid(1e4), fi.Striker.rigid(0.1)
        >>> hits = [fi.strike(wall, hammer, fi.Contact.hertz(2e8), at=None, speed=v) for v in (0.5, 1.0, 1.5)]
        >>> taps = [fi.measure(hit, rate=25600.0, noise=2e-3, rng=i) for i, hit in enumerate(hits)]
        >>> law, ranges = fi.Contact.hertz(1e8), {"contact.stiffness": (1e6, 1e10)}
        >>> found = fi.fit(taps, striker=hammer, contact=law, unknown=ranges, profiles=False)
        >>> [found.against()[f"tap {i}, width"].said for i in (1, 2, 3)]
        ['inside', 'inside', 'inside']
        """
        calibration = check.non_negative("calibration", calibration)
        if measured is None:
            return predictions.compare_taps(self._used, self.left_out(), self.misfit, calibration)
        each = tuple(self.predict(measured.pick(i)) for i in range(measured.n_taps))
        return predictions.compare_taps(measured, each, self.misfit, calibration)

    @property
    def contact(self) -> Contact:
        """The contact law found."""
        return changed_contact(self.problem.setting.contact, self.problem.values(self.best.x))

    @property
    def striker(self) -> Striker:
        """The hammer found."""
        given, values = self.problem.setting.striker, self.problem.values(self.best.x)
        body = self.problem.setting.hammer(values)
        if len(body.omega) == 1:
            return Striker.rigid(body.felt_mass)
        if given.modes.n_modes > 1:
            part = {key: values.get(f"striker.{key}") for key in ("mass", "first_frequency")}
            return Striker.flexible(given.modes.scaled(**part), at=given.at)
        modes = Modes.from_arrays(
            body.omega / (2.0 * np.pi), body.rows, points=[[0.0]], mass=body.mass, damping_ratio=body.zeta,
            complete=True,
        )  # fmt: skip
        return Striker.flexible(modes, at=[0.0])

    @property
    def target(self) -> Modes | None:
        """The struck body found, known at its strike point only; None for a wall."""
        body = self.problem.setting.structure(self.problem.values(self.best.x))
        if not len(body.omega):
            return None
        order = np.argsort(body.omega, kind="stable")
        return Modes.from_arrays(
            body.omega[order] / (2.0 * np.pi), body.rows[:, order], points=[[0.0]],
            mass=body.mass if np.isfinite(body.mass) else float(1.0 / np.square(body.rows).max()),
            compliance=carried_compliance(body.omega, body.rows, body.rows) + body.rest, damping_ratio=body.zeta[order],
            free=False,
        )  # fmt: skip

    @check.typed
    def double_hit(
        self,
        target: Modes | None = None,
        *,
        at: Any = None,
        mass: float | None = None,
        tip: float | None = None,
        speed: float | None = None,
    ) -> Response:
        """The blow with another head or tip, whose `n_impacts` says whether it hits twice.

        Parameters
        ----------
        target : Modes, optional
            The body struck; by default that of the fit.
        at : point of the target, (dimension,) [m]
        mass : float [kg], optional
            Of the hammer; by default that found.
        tip : float [-], optional
            Stiffness of the tip over that found.
        speed : float [m/s], optional
            By default the mean of the taps, at the same momentum for another mass.

        Returns
        -------
        Response
        """
        body = target if target is not None else self.target
        if body is None:
            raise ValueError("target must be given: these taps were fitted to a wall, on which no hammer hits twice")
        place = at if target is not None else [0.0]
        hammer, law = self.striker, self.contact
        if tip is not None:
            factor = check.positive("tip", tip)
            stiff = [name for name, unit in UNITS.items() if unit.startswith("N/m")]
            law = replace(law, **{name: getattr(law, name) * factor for name in stiff})
        typical = float(np.mean(self.problem.speeds(self.best.x)))
        if mass is not None:
            mass = check.positive("mass", mass, "kg")
            typical *= hammer.mass / mass
            hammer = replace(hammer, modes=hammer.modes.scaled(mass=mass))
        return strike(body, hammer, law, at=place, speed=typical if speed is None else speed, tolerance=1e-3)

    @property
    def verdict(self) -> tuple[str, ...]:
        """What stands against trusting the values: what the data do not determine, what the model lacks; else none."""
        said = [f"The data do not determine {', '.join(self.unidentifiable)}"] if self.unidentifiable else []
        if self.error > 0.5:  # sharing nothing with the taps makes it 1
            said.append("The model does not explain the taps: check the channels, their signs and units, and the rate")
        if self.whiteness < profiles.DOUBTED:
            own = "contact.stiffness" in self.names and not self.per_tap and len(self.used) > 1
            lacks = "something, such as a stiffness for each tap (per_tap)" if own else "something"
            said.append(f"The residual is not noise: the model lacks {lacks}; intervals are widened for it")
        return tuple(said)

    def summary(self) -> str:
        """What was found in a few readable lines; what the data do not determine comes first."""
        lines = [
            f"{len(self.used)} taps explained to {100.0 * self.error:.2g} % rms of their force, with "
            f"{len(self.names)} unknowns besides speed and onset of each"
        ]
        if self.outliers:
            each = ", ".join(f"{name} ({100.0 * error:.2g} %)" for name, error in self.outliers.items())
            lines.append(f"left out, because the other taps predict them badly: {each}")
        lines += self.verdict
        for name in self.unidentifiable:
            if self.ridges[name]:
                lines.append(
                    f"If {name} grows, {covariation_in_words(self.ridges[name])}, and the taps are explained as well"
                )
        rows = [(name, *stated(self.profiles[name]), unit_of(name)) for name in self.names]
        lines += markup.columns(rows, ("", "value", "90 % interval", "unit"))
        for spread in self.spreads.values():
            lines.append(f"{spread.name} is the mean of the taps, which {scatter_in_words(spread)}")
        for name in self.names:
            for end, other in zip(("below", "above"), self.profiles[name].held_by):
                if other:
                    lines.append(f"Note: {name} is limited {end} only by the range given for {other}")
        lines += lines_of_notes(self.notes)
        return "\n".join(lines)

    def data(self) -> dict[str, Any]:
        """Everything found, by name, in SI units, for a JSON file."""
        keys = ("mean", "deviation", "relative", "by_noise", "chance")
        return {
            "values": self.values,
            "unidentifiable": list(self.unidentifiable),
            "limited": list(self.limited),
            "ridges": self.ridges,
            "intervals": {name: list(self.interval(name)) for name in self.names if name not in self.unidentifiable},
            "point": self.point,
            "per_tap": {
                name: {key: getattr(each, key) for key in keys} | {"values": each.values.tolist()}
                for name, each in self.spreads.items()
            },
            "errors": self.errors.tolist(),
            "left_out": [one.error for one in self.left_out()] if len(self.used) > 1 else [],
            "outliers": dict(self.outliers),
            "whiteness": self.whiteness,
            "compared": dict(self.compared),
            "notes": list(self.notes),
        }


def stated(profile: Profile) -> tuple[str, str]:
    """A value and its 90 % interval in words, with no more digits than the interval leaves sure."""
    low, high = profile.interval()
    if profile.kind == "open":
        return "not determined", ""
    if profile.kind == "limited":
        return (f"at least {low:.2g}" if profile.open[1] else f"at most {high:.2g}"), ""
    size = max(abs(low), abs(high))
    digits = int(np.clip(1 + np.ceil(-np.log10(max((high - low) / (2.0 * size), SAME))), 1, 6)) if size else 1
    ends = max(digits, 2)
    return f"{profile.value:.{digits}g}", f"{low:.{ends}g} to {high:.{ends}g}"


def covariation_in_words(ridge: Mapping[str, float]) -> str:
    """How other values go along with one that the data do not determine, from their exponents, in words."""
    said = []
    for name, power in ridge.items():
        way = "grows" if power > 0.0 else "falls"
        if abs(power) > 10.0:  # says only that the value itself hardly moves
            said.append(f"{name} {way} far faster")
        else:
            said.append(f"{name} {way} with its power {abs(power):.2g}")
    return ", ".join(said)


def scatter_in_words(each: Scatter) -> str:
    """How much the taps differ in an unknown, in words."""
    size, noise = (
        (f"{100.0 * each.deviation:.2g} %", f"{100.0 * each.by_noise:.2g} %") if each.relative
        else (f"{each.deviation:.3g} {unit_of(each.name)}".strip(), f"{each.by_noise:.3g}")
    )  # fmt: skip
    said = f"differ by {size} (standard deviation); noise alone would make {noise}"
    return said if each.chance < 0.05 else f"{said}: one value for all would do"


def _coordinate(problem: Problem, x: np.ndarray, name: str) -> tuple[Problem, np.ndarray, int]:
    """The problem with a named value among its coordinates, the coordinates, and the number of that value."""
    shared, _, number = name.partition("[")
    i = int(number[:-1]) if number else 0
    if shared == "speed":
        other = replace(problem, momentum=False)
        return other, problem.moved(x, other), problem.n_shared + i
    j = [each.name for each in problem.setting.unknown].index(shared)
    given = problem.setting.unknown[j]
    value = problem.values(x)[shared]
    if not given.low <= value <= given.high:  # a stiffness, as its contact time is what is sought
        given = Unknown(shared, min(given.low, value / 30.0), max(given.high, 30.0 * value))
    free = tuple(given if k == j else each for k, each in enumerate(problem.free))
    own = tuple(each.name for each, before in zip(free, problem.free) if before.name in problem.own)
    other = replace(problem, free=free, own=own, centre=i if number else None)
    return other, problem.moved(x, other), j


def with_profiles(found: Found) -> Found:
    """The fit with its profiles; a better fit that a profile meets becomes the fit."""
    for _ in range(3):  # times that profiles may find a better fit and begin again; a sound fit needs none
        for i, name in enumerate(found.names):
            found._profiles[name], x, cost = found._follow(name)
            if found.watch is not None:
                found.watch(i + 1, len(found.names))
            if cost < found.best.cost - 0.05 * found._noise[0]:  # of the variance: luck makes as much
                break
        else:
            return found
        best = solver.solve(found.problem, x)
        found = replace(found, best=best if best.cost < found.best.cost else found.best)
    return found
