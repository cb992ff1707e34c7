"""`fit`: the hammer, contact and structure that explain measured taps, and how far the data tell them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .._base import check, markup
from .._base.check import SimulationError
from ..impact.collision import strike
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.striker import Striker
from ..modes.modal import Modes
from . import arguments, profiles, solver
from .profiles import Profile
from .records import Taps
from .rig import Rig
from .solver import Data, Problem, Solution
from .unknowns import TIME, Setting, Unknown, changed, checked, unit_of

STARTS = 5  # [-] searches, from the best of `solver.SCREENED` points
SAME = 1e-3  # [-] relative difference of two sums of squares that are the same minimum
QUICK = 12  # [-] iterations of every search before the best two go on
BEFORE = 12  # [samples] before the tap that are compared: the filter rings there
AFTER = 1.5  # [-] of the length from the first to the last pulse: what is compared after it, at least BEFORE samples
OUTLIER = 4.0  # [-] a tap that the others predict worse than this times the median of their own errors does not agree
MOST_OUTLIERS = 0.34  # [-] of the taps may disagree
FEWEST = 3  # [-] taps, to tell which one disagrees
REPEATS = 3  # [-] times that profiles may find a better fit and begin again

Watch = Callable[[int, int], Any]


@dataclass(frozen=True, eq=False)
class Prediction:
    """A tap as the model has it, with speed and onset fitted to it."""

    time: np.ndarray  # (n_times,) [s] of the record
    measured: np.ndarray  # (n_times,) [N]
    force: np.ndarray  # (n_times,) [N]
    speed: float  # [m/s]
    onset: float  # [s]

    __repr__ = check.brief

    @property
    def residual(self) -> np.ndarray:
        """Predicted less measured force, (n_times,) [N]."""
        return self.force - self.measured

    @property
    def error(self) -> float:
        """Root mean square of the residual over that of the measured force [-]."""
        return float(np.linalg.norm(self.residual) / np.linalg.norm(self.measured))

    @property
    def error_of_peak(self) -> float:
        """Root mean square of the residual over the record, over the measured peak [-]."""
        return float(np.sqrt(np.mean(self.residual**2)) / np.abs(self.measured).max())


@dataclass(frozen=True, eq=False)
class Found:
    """What `fit` found. Values that the data do not tell are in `unidentifiable` and not in `values`."""

    taps: Taps  # those compared, cut to the window
    used: tuple[int, ...]  # taps that the fit used
    outliers: Mapping[str, float]  # label of a tap that disagrees -> its error when predicted from the others [-]
    problem: Problem
    best: Solution
    minima: tuple[float, ...]  # [-] sums of squares at the ends of all searches
    notes: tuple[str, ...]
    compared: Mapping[str, float]  # contact law -> root mean square of its errors at left-out taps [-]; if several
    watch: Watch | None = None

    __repr__ = check.brief

    @cached_property
    def _noise(self) -> tuple[float, int, float]:
        whole = self.problem.residual(self.best.x).reshape(-1, self.problem.data.n_times)
        return profiles.variance(whole, len(self.best.x))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The unknowns, in the order given."""
        return tuple(each.name for each in self.problem.setting.unknown)

    @cached_property
    def point(self) -> dict[str, float]:
        """The best values of all unknowns and speeds, told by the data or not: one of many that fit as well."""
        values = self.problem.values(self.best.x)
        found = {name: values[name] for name in self.names}
        return found | {f"speed[{i}]": float(v) for i, v in enumerate(self.problem.speeds(self.best.x))}

    def profile(self, name: str) -> Profile:
        """The likelihood profile of an unknown or of a tap's speed, ``"speed[0]"``."""
        check.one_of("name", name, self.point)
        if name in self.profiles:
            return self.profiles[name]
        if name not in self._later:
            noise, freedom, _ = self._noise
            problem, x, j = _coordinate(self.problem, self.best.x, name)
            best = replace(self.best, x=x)
            self._later[name] = profiles.follow(problem, best, j, noise, freedom, name)[0]
        return self._later[name]

    @cached_property
    def _later(self) -> dict[str, Profile]:
        return {}

    @cached_property
    def profiles(self) -> dict[str, Profile]:
        """The likelihood profiles of all unknowns."""
        noise, freedom, _ = self._noise
        found = {}
        for i, name in enumerate(self.names):
            problem, x, j = _coordinate(self.problem, self.best.x, name)
            found[name] = profiles.follow(problem, replace(self.best, x=x), j, noise, freedom, name)[0]
            if self.watch is not None:
                self.watch(i + 1, len(self.names))
        return found

    def interval(self, name: str, level: float = 0.9) -> tuple[float, float]:
        """The range (low, high) that holds a value with a probability; where the data set no limit, that of the range.

        From the likelihood profile with the noise variance estimated, not from the curvature at the best fit.
        """
        return self.profile(name).interval(level)

    @cached_property
    def unidentifiable(self) -> tuple[str, ...]:
        """The unknowns that the data do not tell."""
        return tuple(name for name in self.names if self.profiles[name].told == "open")

    @cached_property
    def limited(self) -> tuple[str, ...]:
        """The unknowns for which the data set only a lower or an upper limit."""
        return tuple(name for name in self.names if self.profiles[name].told == "limited")

    @cached_property
    def ridges(self) -> dict[str, dict[str, float]]:
        """Of every unknown that the data do not tell: how the others go along with it, as exponents."""
        return {name: self.profiles[name].ridge for name in self.unidentifiable}

    @property
    def values(self) -> dict[str, float]:
        """The values that the data tell, in SI units; those with a limit only are among them."""
        hidden = set(self.unidentifiable)
        if hidden:  # a speed that moves along a ridge is not told either
            hidden |= {name for ridge in self.ridges.values() for name in ridge if name.startswith("speed")}
        return {name: value for name, value in self.point.items() if name not in hidden}

    @cached_property
    def residual(self) -> np.ndarray:
        """Predicted less measured force of the taps used, (n_used, n_times) [N]."""
        shape = self.problem.data.values.shape
        return self.problem.residual(self.best.x).reshape(shape)[:, 0] * self.problem.data.scale[:, :1]

    @property
    def errors(self) -> np.ndarray:
        """Root mean square of the residual over that of the force, of the taps used, (n_used,) [-]."""
        measured = self.problem.data.values[:, 0] * self.problem.data.scale[:, :1]
        return np.linalg.norm(self.residual, axis=1) / np.linalg.norm(measured, axis=1)

    @property
    def error(self) -> float:
        """The same of all taps used together [-]."""
        return float(np.sqrt(np.mean(self.errors**2)))

    @property
    def whiteness(self) -> float:
        """Probability that white noise has residuals as coloured as these [-]: small means that the model lacks
        something, and that the intervals were widened for it."""
        return self._noise[2]

    def residual_spectrum(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Frequencies [Hz], and the amplitude spectra of residual and force, (n_used, n_frequencies) [N s]."""
        rate = self.taps.rate
        measured = self.problem.data.values[:, 0] * self.problem.data.scale[:, :1]
        spectra = [np.abs(np.fft.rfft(rows, axis=1)) / rate for rows in (self.residual, measured)]
        return np.fft.rfftfreq(self.residual.shape[1], 1.0 / rate), spectra[0], spectra[1]

    def predict(self, tap: Any = 0) -> Prediction:
        """A tap as the values found have it, with speed and onset fitted: a number of those given, or other `Taps`."""
        if isinstance(tap, Taps):
            _same_rate(tap, self.taps)
            span = self.problem.data.n_times / self.taps.rate
            lead = BEFORE / self.taps.rate
            onset = float(tap.onset[0])
            cut = tap.pick(0).between(max(0.0, onset - lead), min(float(tap.time[-1]), onset - lead + span))
        else:
            check.count("tap", tap, low=0, high=self.taps.n_taps - 1)
            cut = self.taps.pick(int(tap))
        start = float(np.log(0.6 * cut.impulse[0]))
        return _predicted(self.problem, self.problem.values(self.best.x), cut, start)

    def left_out(self) -> tuple[Prediction, ...]:
        """Every tap used, predicted from the others: all unknowns without it, then its speed and onset alone."""
        if len(self.used) < 2:
            raise ValueError("taps must be two at least, to predict one from the others")
        return self._left_out

    @cached_property
    def _left_out(self) -> tuple[Prediction, ...]:
        return _left_out(self.problem, self.best.x, self.taps.pick(list(self.used)))

    @property
    def contact(self) -> Contact:
        """The contact law found."""
        return changed(self.problem.setting.contact, self.problem.values(self.best.x))

    @property
    def striker(self) -> Striker:
        """The hammer found."""
        given = self.problem.setting.striker
        body = self.problem.setting.hammer(self.problem.values(self.best.x))
        if len(body.omega) == 1 and given.modes.n_modes == 1:
            return Striker.rigid(body.felt_mass)
        if given.modes.n_modes > 1:
            values = self.problem.values(self.best.x)
            part = {key: values.get(f"striker.{key}") for key in ("mass", "first_frequency")}
            return Striker.flexible(given.modes.scaled(**part), at=given.at)
        modes = Modes.from_arrays(
            body.omega / (2.0 * np.pi), body.row[None], points=[[0.0]], mass=body.mass, damping_ratio=body.zeta
        )
        return Striker.flexible(modes, at=[0.0])

    @property
    def target(self) -> Modes | None:
        """The struck body found, known at its strike point only; None for a wall."""
        body = self.problem.setting.structure(self.problem.values(self.best.x))
        if not len(body.omega):
            return None
        order = np.argsort(body.omega, kind="stable")
        carried = float(np.square(body.row[body.omega > 0.0] / body.omega[body.omega > 0.0]).sum())
        return Modes.from_arrays(
            body.omega[order] / (2.0 * np.pi), body.row[None, order], points=[[0.0]],
            mass=body.mass if np.isfinite(body.mass) else float(1.0 / np.square(body.row).max()),
            damping_ratio=body.zeta[order], compliance=[[carried + body.rest]],
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
        place = at if target is not None else ([0.0] if self.problem.setting.target is None else None)
        if target is None:
            place = [0.0]
        hammer, law = self.striker, self.contact
        if tip is not None:
            factor = check.positive("tip", tip)
            law = replace(law, stiffness=law.stiffness * factor, hard_stiffness=law.hard_stiffness * factor)
        typical = float(np.mean(self.problem.speeds(self.best.x)))
        if mass is not None:
            mass = check.positive("mass", mass, "kg")
            typical *= hammer.mass / mass
            hammer = Striker.rigid(mass) if hammer.modes.n_modes == 1 else Striker.flexible(
                hammer.modes.scaled(mass=mass), at=hammer.at
            )  # fmt: skip
        return strike(body, hammer, law, at=place, speed=typical if speed is None else speed, tolerance=1e-3)

    def summary(self) -> str:
        """What was found in a few readable lines; what the data do not tell is said first."""
        lines = [
            f"{len(self.used)} taps explained to {100.0 * self.error:.2g} % rms of their force, with "
            f"{len(self.names)} unknowns besides speed and onset of each"
        ]
        if self.outliers:
            each = ", ".join(f"{name} ({100.0 * error:.2g} %)" for name, error in self.outliers.items())
            lines.append(f"left out, because the other taps predict them badly: {each}")
        for name in self.unidentifiable:
            along = ", ".join(f"{other}^{power:.2g}" for other, power in self.ridges[name].items())
            said = f"; along its ridge, per power of it, go {along}" if along else ""
            lines.append(f"The data do not tell {name}{said}")
        rows = []
        for name in self.names:
            profile = self.profiles[name]
            low, high = profile.interval()
            unit = unit_of(name)
            if profile.told == "open":
                rows.append((name, "not told", "", unit))
            elif profile.told == "limited":
                limit = f"at least {low:.4g}" if profile.open[1] else f"at most {high:.4g}"
                rows.append((name, limit, "", unit))
            else:
                rows.append((name, f"{profile.value:.4g}", f"{low:.4g} to {high:.4g}", unit))
        lines += markup.columns(rows, ("", "value", "90 % interval", "unit"))
        for name in self.names:
            for end, other in zip(("below", "above"), self.profiles[name].held_by):
                if other:
                    lines.append(f"Note: {name} is limited {end} only by the range given for {other}")
        if self.whiteness < profiles.DOUBTED:
            lines.append("Note: the residual is not noise: the model lacks something; intervals are widened for it")
        lines += [f"Note: {note}" for note in self.notes]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return markup.paragraphs(self.summary().splitlines())

    def data(self) -> dict[str, Any]:
        """Everything found, by name, in SI units, for a JSON file."""
        return {
            "values": self.values,
            "unidentifiable": list(self.unidentifiable),
            "limited": list(self.limited),
            "ridges": self.ridges,
            "intervals": {name: list(self.interval(name)) for name in self.names if name not in self.unidentifiable},
            "point": self.point,
            "errors": self.errors.tolist(),
            "left_out": [one.error for one in self.left_out()] if len(self.used) > 1 else [],
            "outliers": dict(self.outliers),
            "whiteness": self.whiteness,
            "compared": dict(self.compared),
            "notes": list(self.notes),
        }


def _coordinate(problem: Problem, x: np.ndarray, name: str) -> tuple[Problem, np.ndarray, int]:
    """The problem with a named value among its coordinates, the coordinates, and the number of that value."""
    x = x.copy()
    if name.startswith("speed["):
        n = problem.n_shared
        x[n : n + problem.data.n_taps] = np.log(problem.speeds(x))
        return replace(problem, momentum=False, _last={}), x, n + int(name[6:-1])
    if name == "contact.stiffness":
        i = [each.name for each in problem.free].index(TIME)
        own = next(each for each in problem.setting.unknown if each.name == name)
        x[i] = own.inside(problem.values(x)[name])
        free = tuple(own if k == i else each for k, each in enumerate(problem.free))
        return replace(problem, free=free, _last={}), x, i
    return problem, x, [each.name for each in problem.free].index(name)


def _same_rate(tap: Taps, taps: Taps) -> None:
    if abs(tap.rate / taps.rate - 1.0) > 1e-6:
        raise ValueError(f"tap must be sampled at {taps.rate:g} Hz as the taps fitted, got {tap.rate:g} Hz")


def _data(taps: Taps, n_points: int, weights: np.ndarray) -> Data:
    records = np.concatenate([taps.force[:, None], np.moveaxis(taps.response, 2, 1)[:, :n_points]], axis=1)
    scale = np.maximum(np.abs(records).max(axis=2), np.finfo(float).tiny) / weights
    lead = max(0, round(float(np.median(taps.onset)) * taps.rate) - 1)
    return Data(records / scale[:, :, None], scale, np.maximum(taps.impulse, 1e-300), lead)


def _predicted(problem: Problem, values: Mapping[str, float], tap: Taps, log_momentum: float) -> Prediction:
    """One tap with all unknowns held at ``values``."""
    n_points = problem.data.values.shape[1] - 1
    data = _data(tap, n_points, np.ones(1 + n_points))
    single = replace(problem, data=data, free=(), fixed=dict(values), _last={})
    single = replace(single, fixed={name: value for name, value in values.items() if name != TIME})
    force = replace(single, data=replace(data, values=data.values[:, :1], scale=data.scale[:, :1]))
    x = np.array([log_momentum, tap.onset[0] * tap.rate - data.lead - 1.0])
    x = solver.solve(_force_only(force), _force_only(force).aligned(x), QUICK).x
    found = _force_only(force)
    made = found.sampled(found._base(x), found.onsets(x))[0, 0] * data.scale[0, 0]
    onset = (data.lead + float(found.onsets(x)[0])) / tap.rate
    return Prediction(tap.time, tap.force[0], made, float(found.speeds(x)[0]), onset)


def _force_only(problem: Problem) -> Problem:
    """The problem without response channels: a prediction is judged by the force."""
    return replace(problem, setting=replace(problem.setting, points=None, n_points=0), _last={})


def _left_out(problem: Problem, x: np.ndarray, taps: Taps) -> tuple[Prediction, ...]:
    n, n_taps = problem.n_shared, problem.data.n_taps
    found = []
    for tap in range(n_taps):
        others = [i for i in range(n_taps) if i != tap]
        part = replace(problem, data=problem.data.pick(others), _last={})
        keep = [*range(n), *(n + i for i in others), *(n + n_taps + i for i in others)]
        without = solver.solve(part, x[keep])
        found.append(_predicted(part, part.values(without.x), taps.pick(tap), float(np.log(0.6 * taps.impulse[tap]))))
    return tuple(found)


def _window(taps: Taps, window: Any) -> Taps:
    """The taps cut to the samples compared, all with the same place of the onset."""
    if window is not None:
        before, after = check.array("window", window, (2,), "s")
        first, last = before, after
    else:
        first = BEFORE / taps.rate
        ends = []
        for row, onset in zip(taps.force, taps.onset):
            above = np.flatnonzero(row > 0.05 * row.max())
            begin = int(onset * taps.rate)
            later = above[above >= begin]
            ends.append((later[-1] - begin + 1) if later.size else 1)
        last = (1.0 + AFTER) * max(max(ends), BEFORE) / taps.rate
    starts = np.round(taps.onset * taps.rate).astype(int)
    before, after = round(float(first) * taps.rate), round(float(last) * taps.rate)
    before, after = min(before, int(starts.min())), min(after, int(len(taps.time) - starts.max()))
    if before < 0 or after < 4:
        raise ValueError(f"window must leave samples after the onset, got {after}; give longer records")
    cut = taps.table
    rows = [np.arange(s - before, s + after) for s in starts]
    force = np.stack([row[index] for row, index in zip(taps.force, rows)])
    response = np.stack([row[index] for row, index in zip(taps.response, rows)])
    made = Taps.from_arrays(
        force, response, rate=taps.rate, names=cut["channel"].values.tolist(), units=taps.units,
        overload=cut["overload"].values, labels=taps.labels, notes=taps.notes,
    )  # fmt: skip
    made.table["onset"] = ("tap", np.full(len(starts), before / taps.rate))
    return made


@check.typed
def fit(
    taps: Any,
    *,
    target: Modes | None = None,
    at: Any = None,
    striker: Striker,
    contact: Any,
    unknown: Mapping[str, Any],
    known: Mapping[str, float] | None = None,
    response_at: Any = None,
    anti_alias: Any = "delta-sigma",
    tip_mass: float = 0.0,
    resonance: float | None = None,
    window: Any = None,
    starts: int = STARTS,
    robust: bool = True,
    profiles: bool = True,
    rng: Any = 0,
    watch: Watch | None = None,
) -> Found:
    """Find the hammer, contact and structure that explain measured taps.

    Parameters
    ----------
    taps : Taps
        Of `fi.read_taps` or `fi.measure`. Speed and onset of each are found too.
    target : Modes, optional
        The struck body, from finite elements, formulas or a universal file; without it, a wall or the unknown modes.
    at : strike point on the target, (dimension,) [m]
    striker : Striker
        A hammer; a rigid one may get a mode by ``striker.first_frequency`` and ``striker.mode_ratio`` (square of its
        deflection at the tip over that of the rigid motion).
    contact : Contact or sequence of Contact
        Several laws are compared by how well they predict taps left out; the best is returned.
    unknown : mapping of name to (low, high)
        ``contact.stiffness``, ``contact.exponent``, ``contact.loss`` or any other number of a `Contact`
        (``contact.hysteresis`` and ``contact.relaxation`` of felt, ``contact.yield_approach``, ``contact.depth``, ...),
        ``striker.mass``, ``striker.first_frequency``, ``striker.mode_ratio``, ``striker.damping``,
        ``striker.tip_mass``, ``target.mass``, ``target.first_frequency``, ``target.damping``, ``target.x``,
        ``target.y`` (strike point), and for up to six modes of an unknown target ``mode1.frequency``, ``mode1.mass``
        (modal mass at the strike point), ``mode1.damping``, ``mode1.gain`` (deflection where the response is measured
        over that at the strike point). In SI units.
    known : mapping of name to value, optional
        The same names, held.
    response_at : array_like, (n_points, dimension) [m], optional
        Where the accelerations in ``taps`` were measured; with an unknown target, any value stands for its ``gain``.
        Without it, only the force is compared.
    anti_alias, tip_mass, resonance
        Of the rig, as in `fi.measure`.
    window : (before, after) [s], optional
        What is compared around each onset; by default the pulses and 1.5 times their length after them.
    starts : int
        Searches from different points of the ranges.
    robust : bool
        Whether a tap that the others predict badly is left out and named.
    profiles : bool
        Whether to follow the likelihood profiles at once; otherwise when first asked for.
    rng : seed or numpy Generator
    watch : callable, optional
        Called with the number of steps done and of all steps.

    Returns
    -------
    Found

    Raises
    ------
    ValueError
        If a name, range or tap is invalid.
    SimulationError
        If no start in the ranges makes a blow that ends.

    Examples
    --------
    >>> wall, hammer = fi.Modes.rigid(1e4), fi.Striker.rigid(0.1)
    >>> hits = [fi.strike(wall, hammer, fi.Contact.hertz(2e8), at=None, speed=v) for v in (0.5, 1.0, 1.5)]
    >>> taps = [fi.measure(hit, rate=25600.0, noise=2e-3, rng=i) for i, hit in enumerate(hits)]
    >>> law, ranges = fi.Contact.hertz(1e8), {"contact.stiffness": (1e6, 1e10)}
    >>> found = fi.fit(taps, striker=hammer, contact=law, unknown=ranges)
    >>> low, high = found.interval("contact.stiffness", 0.9)
    >>> low < 2e8 < high, round(high / low, 1)
    (True, 1.0)
    """
    striker.let_go("a fit")
    taps = joined(taps)
    laws = [contact] if isinstance(contact, Contact) else list(check.several("contact", contact, Contact))
    options = {
        "target": target, "at": at, "striker": striker, "unknown": unknown, "known": arguments.table("known", known),
        "response_at": response_at, "window": window, "starts": check.count("starts", starts), "robust": robust,
        "rig": Rig(taps.rate, anti_alias, tip_mass, resonance), "watch": watch,
        "rng": arguments.generator("rng", rng),
    }  # fmt: skip
    found = [_fit(taps, contact=law, **options) for law in laws]
    if len(found) > 1:
        scores = [float(np.sqrt(np.mean([one.error**2 for one in each.left_out()]))) for each in found]
        named = {_law_name(law): score for law, score in zip(laws, scores)}
        found = [replace(found[int(np.argmin(scores))], compared=named)]
    result = found[0]
    return _profiled(result) if profiles else result


def _law_name(law: Contact) -> str:
    kinds = {1.0: "linear", 1.5: "Hertz"}
    words = {"loss": " with loss", "hard_stiffness": " over a hard layer", "yield_approach": " that yields",
             "hysteresis": " felt"}  # fmt: skip
    return kinds.get(law.exponent, f"power {law.exponent:g}") + "".join(
        word for name, word in words.items() if getattr(law, name)
    )


def joined(taps: Any, name: str = "taps") -> Taps:
    """One table of taps from one or several."""
    if isinstance(taps, Taps):
        return taps
    several = check.several(name, taps, Taps)
    n_times = min(len(each.time) for each in several)
    for each in several:
        _same_rate(each, several[0])
        if each.units != several[0].units:
            raise ValueError(f"taps must have the same responses, got units {each.units} and {several[0].units}")
    return Taps.from_arrays(
        np.concatenate([each.force[:, :n_times] for each in several]),
        np.concatenate([each.response[:, :n_times] for each in several]),
        rate=several[0].rate,
        names=several[0].table["channel"].values.tolist(),
        units=several[0].units,
        overload=np.concatenate([each.table["overload"].values for each in several]),
        notes=[note for each in several for note in each.notes],
    )


def _fit(taps, *, target, at, striker, contact, unknown, known, response_at, window, starts, robust, rig, watch, rng):
    names = checked(unknown, target, striker, contact, known)
    notes: list[str] = []
    points, n_points = None, 0
    if response_at is not None:
        n_points = taps.response.shape[2]
        if not n_points or set(taps.units) != {"m/s^2"}:
            raise ValueError(f"response_at needs accelerations among the taps, got units {taps.units}")
        if target is not None:
            points = target.points("response_at", response_at)
            if len(points) != n_points:
                raise ValueError(f"response_at must be {n_points} points, one for each response, got {len(points)}")
    cut = _window(taps, window)
    if cut.overload.any():
        bad = np.flatnonzero(cut.overload)
        notes.append(f"left out, because their force is cut off: {', '.join(cut.labels[i] for i in bad)}")
        if len(bad) == cut.n_taps:
            raise ValueError("taps must hold one at least whose force is not cut off")
        cut = cut.pick(~cut.overload)
    place = None if target is None else target.point("at", at)[0]
    setting = Setting(
        target, place, striker, contact, rig, names, points, n_points, float(np.mean(cut.impulse))
    )  # fmt: skip
    length = solver.pulse_length(cut)
    free = tuple(
        Unknown(TIME, length / solver.TIMES, length * solver.TIMES) if each.name == "contact.stiffness" else each
        for each in names
    )
    weights = np.ones(1 + n_points)
    data = _data(cut, n_points, weights)
    if data.values.size <= len(free) + 2 * cut.n_taps:
        raise ValueError(f"taps hold {data.values.size} samples, too few for {len(free) + 2 * cut.n_taps} values")
    for name in known:
        if name in unknown:
            raise ValueError(f"known and unknown both name {name}")
    problem = Problem(setting, data, free, {name: check.number(name, value) for name, value in known.items()})
    used = list(range(cut.n_taps))
    best, minima = _search(problem, cut, length, starts, rng, watch)
    if n_points:
        part = problem.residual(best.x).reshape(data.values.shape)
        spread = np.sqrt(np.square(part).mean(axis=(0, 2)))
        weights = spread[0] / np.maximum(spread, 1e-300)
        data = _data(cut, n_points, weights)
        problem = replace(problem, data=data, _last={})
        best = solver.solve(problem, best.x)
        minima = (best.cost,)
    outliers: dict[str, float] = {}
    while robust and len(used) > max(FEWEST, (1.0 - MOST_OUTLIERS) * cut.n_taps):
        each = np.array([one.error for one in _left_out(problem, best.x, cut.pick(used))])
        worst = int(each.argmax())
        n, n_taps = problem.n_shared, len(used)
        keep = np.delete(np.arange(len(best.x)), [n + worst, n + n_taps + worst])
        fewer = [tap for i, tap in enumerate(used) if i != worst]
        without = replace(problem, data=data.pick(fewer), _last={})
        solved = solver.solve(without, best.x[keep])
        agree = Found(cut, tuple(fewer), {}, without, solved, (), (), {}).errors
        if each[worst] <= OUTLIER * float(np.median(agree)):
            break
        outliers[cut.labels[used[worst]]] = float(each[worst])
        used, problem, best, minima = fewer, without, solved, (solved.cost,)
    return Found(cut, tuple(used), outliers, problem, best, minima, tuple(notes), {}, watch)


def _search(problem: Problem, taps: Taps, length: float, starts: int, rng: Any, watch: Watch | None):
    """The best of several searches, and the sums of squares of all."""
    begun = solver.starts(problem, length, taps.impulse, starts, rng)
    found = []
    for i, x in enumerate(begun):
        try:
            found.append(solver.solve(problem, x, QUICK, 1e-5))
        except SimulationError:
            continue
        finally:
            if watch is not None:
                watch(i + 1, len(begun))
    if not found:
        raise SimulationError("no search ended: blows in the ranges of unknown do not end; narrow the ranges")
    found.sort(key=lambda one: one.cost)
    finished = [solver.solve(problem, one.x) for one in found[:2]]
    best = min(finished, key=lambda one: one.cost)
    return best, tuple(one.cost for one in [*finished, *found[2:]])


def _profiled(found: Found) -> Found:
    """The fit with its profiles; a better fit that a profile meets becomes the fit."""
    for _ in range(REPEATS):
        noise, freedom, _ = found._noise
        made, better = {}, None
        for i, name in enumerate(found.names):
            problem, x, j = _coordinate(found.problem, found.best.x, name)
            made[name], met = profiles.follow(problem, replace(found.best, x=x), j, noise, freedom, name)
            if found.watch is not None:
                found.watch(i + 1, len(found.names))
            if met.cost < found.best.cost - profiles.BETTER * noise:
                better = problem, met
                break
        if better is None:
            found.__dict__["profiles"] = made
            return found
        problem, met = better
        x = met.x.copy()
        for i, (own, other) in enumerate(zip(found.problem.free, problem.free)):
            if own.name != other.name:
                x[i] = own.inside(problem.setting.contact_time(problem.values(met.x)))
        best = solver.solve(found.problem, x)
        found = replace(found, best=best if best.cost < found.best.cost else found.best)
    return found
