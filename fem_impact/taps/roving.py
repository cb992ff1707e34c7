"""A plan of a test with a roving hammer: what hits once at every point and reaches the band; how well it measures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, progress
from .._base.check import SimulationError
from .._base.explained import lines_of_notes
from .._base.files import write_whole
from .._base.threads import one_thread
from ..fe.assembly import System
from ..impact import accuracy, spectra
from ..impact.collision import strike
from ..impact.contact import Contact
from ..impact.quantities import BAND_POINTS
from ..impact.striker import Striker
from ..model.target import FIRST_LOOK, Stages, Target
from ..modes.modal import Damping, Modes
from ..scenes.scene import Scene
from ..show import export, plots, sampling
from ..sweeps import bodies
from ..sweeps import hammers as chooser
from . import triggers
from .rig import Rig

RATE, FILTER = 2.56, "2.56"  # [-] sampling rate over bandwidth, as analysers have it, and their filter
# [-] tips of a hammer known by its mass, over that whose half sine has the bandwidth: each twice as stiff, to 5.5 times
TIPS = np.geomspace(1.0, 30.0, 6)
MOST_LINES = 100_000  # [-] of a record
NOISE = 1e-3  # [-] of each channel over its peak, by default: some 60 dB, a choice
MOST_BLOWS = 20_000  # [-] points times tips: some minutes
WORKS, NO_BAND, DOUBLE, UNKNOWN = "works", "no tip reaches the band", "double hit", "too hard for the modes"


@dataclass(frozen=True, eq=False, repr=False)
class Roving(check.Locked):
    """What every tip does at every point of a test, and which to take."""

    modes: Modes  # of the structure, up to beyond the band
    points: np.ndarray  # (n_points, dimension) [m] where the hammer taps
    sensor: np.ndarray  # (dimension,) [m] where the acceleration is measured
    bandwidth: float  # [Hz] to reach
    drop: float  # [dB] by which the spectrum may fall within the bandwidth
    hammers: tuple[str, ...]  # (n_blows,) hammer of each blow
    tips: tuple[str, ...]  # (n_blows,) its tip
    masses: np.ndarray  # (n_blows,) [kg]
    stiffnesses: np.ndarray  # (n_blows,) [N/m]
    n_impacts: np.ndarray  # (n_points, n_blows): 1, or 2 for several; 0 where the modes do not resolve the tip
    reach: np.ndarray  # (n_points, n_blows) [Hz] where the force spectrum has fallen by the drop; NaN unless one hit
    coherence: np.ndarray  # (n_points, n_blows) [-] mean over the band, above the first mode; NaN unless it works
    at_modes: np.ndarray  # (n_points, n_blows) [-] mean at the natural frequencies in the band
    duration: float  # [s] of a record
    notes: tuple[str, ...] = ()
    peaks: np.ndarray | None = None  # (n_points, n_blows) [N] largest force at 1 m/s, with which it grows

    @property
    def resolution(self) -> float:
        """Frequency resolution [Hz]: one over the length of a record."""
        return 1.0 / self.duration

    @property
    def lines(self) -> float | None:
        """Lines within the half-power bandwidth of the sharpest mode in the band; None without damping or modes."""
        widths = (2.0 * self.modes.damping_ratio * self.modes.frequencies)[inside_band(self.modes, self.bandwidth)]
        return float(widths.min() / self.resolution) if widths.size and widths.min() > 0.0 else None

    @property
    def works(self) -> np.ndarray:
        """Whether a tip hits once and reaches the bandwidth, (n_points, n_blows) bool."""
        return (self.n_impacts == 1) & (np.nan_to_num(self.reach) >= self.bandwidth)

    @property
    def best(self) -> np.ndarray:
        """The tip with the best expected coherence, (n_points,); -1 where none works."""
        expected = np.where(self.works, np.nan_to_num(self.coherence), -1.0)
        return np.where(self.works.any(axis=1), expected.argmax(axis=1), -1)

    @cached_property
    def verdicts(self) -> tuple[str, ...]:
        """For every point: "works", or why no tip does; "double hit" where it cannot be avoided."""
        found = []
        for works, count in zip(self.works, self.n_impacts):
            single = (count == 1).any()
            found.append(WORKS if works.any() else NO_BAND if single else DOUBLE if (count > 1).any() else UNKNOWN)
        return tuple(found)

    def table(self) -> dict[str, list[Any]]:
        """Columns of a table with a row for every point and tip."""
        n_points, n_blows = self.n_impacts.shape
        each, of = np.repeat(np.arange(n_points), n_blows), np.tile(np.arange(n_blows), n_points)
        names = ("x [m]", "y [m]")[: self.points.shape[1]]
        columns: dict[str, list[Any]] = {"point": each.tolist()}
        columns |= {name: self.points[each, i].tolist() for i, name in enumerate(names)}
        columns |= {
            "hammer": [self.hammers[i] for i in of],
            "tip": [self.tips[i] for i in of],
            "mass [kg]": self.masses[of].tolist(),
            "stiffness [N/m]": self.stiffnesses[of].tolist(),
            "impacts": [("", "1", "2 or more")[i] for i in self.n_impacts.ravel()],
            "reach [Hz]": _blank(self.reach),
            "works": ["yes" if works else "no" for works in self.works.ravel()],
            "take": ["yes" if self.best[i] == j else "" for i, j in zip(each, of)],
            "coherence": _blank(self.coherence),
            "coherence at modes": _blank(self.at_modes),
            "resolution [Hz]": [self.resolution] * len(each),
            "point's verdict": [self.verdicts[i] for i in each],
        }
        return columns

    def write_csv(self, path: str | Path) -> None:
        """Write `table` as CSV."""
        write_whole(path, export.csv_text(**{name: np.array(x, object) for name, x in self.table().items()}))

    def figure(self) -> Any:
        """Every point on the outline, in the colour of the tip to take; crosses where a double hit is unavoidable.

        Returns
        -------
        matplotlib.figure.Figure
        """
        tips = enumerate(zip(self.hammers, self.tips))
        groups = {f"{hammer}, {tip}": self.points[self.best == i] for i, (hammer, tip) in tips}
        for verdict in (NO_BAND, DOUBLE, UNKNOWN):
            groups[verdict] = self.points[[each == verdict for each in self.verdicts]]
        crossed = {DOUBLE: "x", NO_BAND: "v", UNKNOWN: "s"}
        title = f"Taps for {self.bandwidth:g} Hz at -{self.drop:g} dB; star: sensor"
        return plots.places(self.modes, {name: some for name, some in groups.items() if len(some)}, crossed,
                            self.sensor, title)  # fmt: skip

    def summary(self) -> str:
        """The plan in a few lines: how many points each tip takes, and where none works."""
        lines = [
            f"{len(self.points)} points, {len(self.tips)} tips, {self.bandwidth:g} Hz at most {self.drop:g} dB down; "
            f"{sum(each == WORKS for each in self.verdicts)} points have a tip that hits once and reaches the band"
        ]
        for i in np.unique(self.best[self.best >= 0]):
            mine = self.best == i
            lines.append(
                f"  {self.hammers[i]}, {self.tips[i]}: {mine.sum()} points, expected coherence "
                f"{self.coherence[mine, i].min():.3f} to {self.coherence[mine, i].max():.3f} "
                f"({self.at_modes[mine, i].min():.3f} or more at the natural frequencies)"
            )
        for verdict in (DOUBLE, NO_BAND, UNKNOWN):
            where = [place for place, each in zip(self.points, self.verdicts) if each == verdict]
            if where:
                listed = ", ".join(f"({', '.join(f'{x:.3g}' for x in place)})" for place in where[:8])
                lines.append(f"  {verdict} with every tip: {len(where)} points, at {listed} m"[:400])
        sharp = "" if self.lines is None else f", {self.lines:.2g} lines in the half-power width of the sharpest mode"
        lines.append(f"records of {self.duration:.3g} s resolve {self.resolution:.3g} Hz{sharp}")
        return "\n".join([*lines, *lines_of_notes(self.notes)])


def inside_band(modes: Modes, bandwidth: float) -> np.ndarray:
    """Which modes are flexible and within the bandwidth [Hz], (n_modes,) bool."""
    return (modes.omega > 0.0) & (modes.frequencies <= bandwidth)


def _blank(values: np.ndarray) -> list[Any]:
    return ["" if np.isnan(value) else float(value) for value in values.ravel()]


@check.typed
@one_thread
def plan_test(
    system: System | Modes,
    hammers: Any,
    points: Any,
    bandwidth: float,
    *,
    sensor: Any = None,
    drop: float = 10.0,
    noise: float = NOISE,
    duration: float | None = None,
    damping_ratio: Damping | None = None,
) -> Roving:
    """Plan a test with a roving hammer: which hammer and tip hit once at every point and reach the band.

    Parameters
    ----------
    system : System or Modes
        The structure under test. Of a `System` the blows get Ritz vectors at every point.
    hammers : mapping of name -> (mass [kg], mapping of tip -> stiffness [N/m]), or masses [kg]
        Hammers given by their masses get six linear tips, from the softest that reaches the band on a rigid wall.
    points : array_like, shape (n_points, dimension) [m]
        Where to tap.
    bandwidth : float [Hz]
        Frequency up to which the force spectrum must stay within ``drop`` [dB] of its value at 0 Hz.
    sensor : array_like, shape (dimension,) [m], optional
        Where the acceleration is measured; the first point by default.
    noise : float [-]
        Standard deviation of white noise over the peak of each channel, as in `fi.measure`.
    duration : float [s], optional
        Length of a record; by default until the slowest mode of the band has lost 60 dB, 0.1 to 10 s.
    damping_ratio : float or function of frequency [Hz], optional
        Damping of a system, which has none of its own.

    Returns
    -------
    Roving
        A tip to take for every point, or why there is none; expected coherence and resolution; picture and CSV.

    Notes
    -----
    Computed blows decide. The expected coherence is that of many taps at a rate of 2.56 times the bandwidth: with the
    spectra F of the force and X of the acceleration without noise and those of the noise, N and M, it is
    ``|F|**2 |X|**2 / ((|F|**2 + |N|**2) (|X|**2 + |M|**2))``. Taps beside the point, nonlinearity and windows are not
    in it.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(1.0, 0.7, mass=5.0, first_frequency=50.0, n_modes=120, damping_ratio=0.01)
    >>> kit = {"small": (0.005, {"vinyl": 1e5}), "large": (0.3, {"rubber": 1e5, "vinyl": 1e6})}
    >>> plan = fi.plan_test(plate, kit, [(0.2, 0.2), (0.5, 0.35)], 400.0)
    >>> plan.verdicts, plan.hammers[plan.best[0]]
    (('works', 'works'), 'small')
    """
    target = Target.of(system, damping_ratio)
    modes = _modes(target, bandwidth)
    return plan_on_body(
        target, modes, hammers, points, bandwidth, sensor=sensor, drop=drop, noise=noise, duration=duration
    )


def plan_on_body(
    target: Target, modes: Modes, hammers: Any, points: Any, bandwidth: float, *, sensor: Any, drop: float,
    noise: float = NOISE, duration: float | None = None,
) -> Roving:  # fmt: skip
    """As `plan_test`, on a body however it is known, and its modes up to beyond the band."""
    target = replace(target, stretching=False)  # hammers are chosen for small blows
    centre = bandwidth / chooser.half_sine_reach(check.between("drop", drop, 1.0, 40.0, "dB"))
    names, tips, masses, stiffnesses = _kit(hammers, centre)
    noise = check.between("noise", noise, 0.0, 10.0)
    places = modes.points("points", points)
    at_sensor = places[0] if sensor is None else modes.point("sensor", sensor)[0]
    if len(places) * len(masses) > MOST_BLOWS:
        raise ValueError(
            f"points must be at most {MOST_BLOWS // len(masses)} for {len(masses)} tips, got {len(places)}"
        )
    pairs, alike = np.unique(np.column_stack([masses, stiffnesses]), axis=0, return_inverse=True)
    blows = [{"mass": float(mass), "stiffness": float(tip)} for mass, tip in pairs]
    views = bodies.of_hammers(target, places, blows, blows[:2], chooser.TOLERANCE, chooser.MOST_MODES, Stages())
    if duration is None:  # lines at most 10 Hz apart, to part modes
        duration = sampling.ringing_time(modes, inside_band(modes, bandwidth), (0.1, triggers.LONGEST))
    n_times = round(check.positive("duration", duration, "s") * RATE * bandwidth)
    if not 8 <= n_times <= 2 * MOST_LINES:
        raise ValueError(
            f"duration must hold 8 to {2 * MOST_LINES} samples at {RATE:g} times the bandwidth, got {n_times}"
        )
    lines = np.fft.rfftfreq(n_times, 1.0 / (RATE * bandwidth))[1:]  # [Hz] of a record, without 0 Hz
    shape = len(places), len(masses)
    counts, reach, coherence, at_modes, peaks = np.zeros(shape, int), *(np.full(shape, np.nan) for _ in range(4))
    for i, (place, body) in enumerate(zip(places, views)):
        progress.report("points", i, len(places))
        answer = None
        for j, (mass, tip) in enumerate(pairs):
            same = np.flatnonzero(alike.reshape(-1) == j)  # hammers of one mass, with one tip
            counts[i, same], hit = _try_tip(body, place, float(mass), float(tip))
            if hit is not None:
                peaks[i, same] = hit.peak_force
            if counts[i, same[0]] != 1:
                continue
            reach[i, same] = chooser.bandwidth_of(hit, drop)
            if reach[i, same[0]] >= bandwidth:
                if answer is None:  # acceleration at the sensor per force here, (n_lines,) complex [1/kg]
                    answer = spectra.mobility(modes, place, at_sensor, lines, "accelerance")
                expected = _coherence(hit, answer, lines, n_times, noise, modes, bandwidth)
                coherence[i, same], at_modes[i, same] = np.array(expected)[:, None]
    progress.report("points", len(places), len(places))
    return Roving(
        modes, places, at_sensor, bandwidth, drop, names, tips, masses, stiffnesses, counts, reach, coherence, at_modes,
        n_times / (RATE * bandwidth), modes.notes, peaks,
    )  # fmt: skip


def _modes(target: Target, bandwidth: float) -> Modes:
    """The structure's modes up to beyond the band; ValueError if that is none of a hammer."""
    check.between("bandwidth", bandwidth, *chooser.BANDWIDTHS, "Hz")
    found = target.modes
    if found is None:
        close = 1e-3  # far below the spacing of frequencies
        found = target.find(FIRST_LOOK, tolerance=close)
        # modes up to less than that bend the top of the band, more only cost time
        reach = 1.5 * bandwidth / target.stretch  # modes are found before the body is scaled
        if found.frequencies[-1] < reach:
            found = target.find(FIRST_LOOK, reach, tolerance=close, first=found)
    return target.surrounded(found)


def _kit(hammers: Any, centre: float) -> tuple[tuple[str, ...], tuple[str, ...], np.ndarray, np.ndarray]:
    """Hammer, tip, mass [kg] and stiffness [N/m] of every blow at a point.

    ``centre`` is the contact resonance [Hz] whose half sine has the bandwidth.
    """
    rows: list[tuple[str, str, float, float]] = []
    if isinstance(hammers, Mapping):
        for name, entry in hammers.items():
            if not isinstance(entry, Sequence) or len(entry) != 2 or not isinstance(entry[1], Mapping) or not entry[1]:
                raise ValueError(
                    f"hammers[{check.shown(name)}] must be (mass in kg, tips as name -> stiffness in N/m), got "
                    f"{check.shown(entry)}"
                )
            mass = check.between(f"mass of hammers[{check.shown(name)}]", entry[0], *chooser.MASSES, "kg")
            for tip, stiffness in entry[1].items():
                where = f"stiffness of tip {check.shown(tip)} of hammers[{check.shown(name)}]"
                rows.append((str(name), str(tip), mass, check.positive(where, stiffness, "N/m")))
    else:
        for mass in check.array("hammers", hammers, (None,), "kg", lift=True):
            mass = check.between("hammers", mass, *chooser.MASSES, "kg")
            for stiffness in TIPS * accuracy.resonant_stiffness(mass, centre):
                rows.append((f"{1e3 * mass:.4g} g", f"{stiffness:.3g} N/m", mass, float(stiffness)))
    if not rows:
        raise ValueError("hammers must contain at least one hammer, got none")
    names, tips, masses, stiffnesses = zip(*rows)
    return names, tips, np.array(masses), np.array(stiffnesses)


def _try_tip(body: Modes, point: np.ndarray, mass: float, tip: float) -> tuple[int, Any]:
    """Number of impacts of one tip, 2 for several and 0 if it is too hard for the modes, and the blow."""
    try:
        hit = strike(
            body, Striker.rigid(mass), Contact.linear(tip), at=point, speed=1.0, tolerance=chooser.DECIDED,
            max_impacts=2,
        )  # fmt: skip
    except SimulationError:
        return 0, None
    sure = hit.error.resolvable and hit.error.truncation < 1.0 and hit.error.mesh < 1.0  # of all descriptions
    return (min(hit.n_impacts, 2) if sure else 0), hit


def _coherence(
    hit: Any, answer: np.ndarray, lines: np.ndarray, n_times: int, noise: float, modes: Modes, bandwidth: float
) -> tuple[float, float]:
    """Mean expected coherence of records (n_times,) over the band, from its first mode on, and at the natural
    frequencies in it; ``answer`` (n_lines,) [1/kg] is the accelerance at lines [Hz]."""
    looks = np.linspace(0.0, lines[-1], BAND_POINTS)
    middle = 0.5 * (hit.impacts[0].start + hit.impacts[0].end)
    about = hit.spectrum(looks) * np.exp(2j * np.pi * middle * looks)  # smooth: it has no delay
    force = np.interp(lines, looks, about)
    kept = np.ones(len(lines))
    passed = Rig(RATE * bandwidth, FILTER).passes(lines)
    for spectrum in (force * passed, force * answer * passed):
        record = np.fft.irfft(np.concatenate([[0.0], spectrum]), n_times) * RATE * bandwidth
        floor = (noise * np.abs(record).max()) ** 2 * n_times / (RATE * bandwidth) ** 2
        power = np.abs(spectrum) ** 2
        kept = kept * power / np.maximum(power + floor, np.finfo(float).tiny)
    own = modes.frequencies[inside_band(modes, bandwidth)]
    band = (lines <= bandwidth) & (lines >= own.min(initial=bandwidth))
    over = float(np.mean(kept[band])) if band.any() else float(np.interp(bandwidth, lines, kept))
    return over, float(np.interp(own, lines, kept).mean()) if own.size else over


def spread_points(modes: Modes, number: int) -> np.ndarray:
    """About so many points over a plate or along a beam, (n_points, dimension) [m], on a lattice, none on the rim."""
    check.between("dimension of the body", modes.dimension, 1, 2)
    low, high = (pick(modes.shapes.grid()[0], axis=0) for pick in (np.min, np.max))
    if modes.dimension == 1:
        return (low + (high - low) * (np.arange(number)[:, None] + 0.5) / number).reshape(-1, 1)
    fine = low + (high - low) * (np.stack(np.meshgrid(*[np.arange(50)] * 2), axis=-1).reshape(-1, 2) + 0.5) / 50.0
    filled = float(modes.shapes.contains(fine).mean())  # share of the box
    step = np.sqrt((high - low).prod() * filled / number)
    counts = np.maximum(1, np.round((high - low) / step)).astype(int)
    axes = [a + (b - a) * (np.arange(n) + 0.5) / n for a, b, n in zip(low, high, counts)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    return lattice[modes.shapes.contains(lattice)]


def hammers_known(
    words: str, bandwidth: float, drop: float, heaviest: float
) -> dict[str, tuple[float, dict[str, float]]]:
    """Hammers of the catalogue whose names contain some words, up to a mass [kg], with tips that may suit a bandwidth.

    Those are from the softest that could reach it, on the lightest body, to the hardest of `TIPS`, or the next one
    beyond: harder ones reach it no better and hit twice sooner.
    """
    centre = bandwidth / chooser.half_sine_reach(check.between("drop", drop, 1.0, 40.0, "dB"))
    names = chooser.catalogue.find(words)
    if not names:
        raise ValueError(f"--catalogue must name hammers, got {words!r}; `fem-impact catalogue` lists all")
    kit = {}
    for name in names:
        hammer = chooser.catalogue[name]
        soft, hard = np.array([chooser.SOFTEST, TIPS[-1]]) * accuracy.resonant_stiffness(hammer.mass, centre)
        enough = {tip: stiffness for tip, stiffness in hammer.tips.items() if stiffness >= soft}
        hard = max(hard, min(enough.values(), default=hard))
        tips = {tip: stiffness for tip, stiffness in enough.items() if stiffness <= hard}
        if tips and hammer.mass <= heaviest:
            kit[name] = (hammer.mass, tips)
    if not kit:
        raise ValueError(
            f"--catalogue has no hammer up to {heaviest:.3g} kg, the mass of the body, with a tip for {bandwidth:g} Hz "
            f"among {', '.join(names)[:200]}; name others, or ask for another bandwidth"
        )
    return kit


def of_scene(scene: Scene, hammers: Any, bandwidth: float, drop: float, number: int | None) -> Roving:
    """The plan for about so many points over the body of a scene, or for its strike point alone; the sensor sits
    there."""
    target, at = scene.built.target, scene.blow.values["at"]
    modes = _modes(target, bandwidth)
    points = [at] if number is None else spread_points(modes, number)
    return plan_on_body(target, modes, hammers, points, bandwidth, sensor=at, drop=drop)
