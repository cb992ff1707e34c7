"""Choosing a hammer: which mass and tip stiffness reach a required bandwidth without a double hit."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

from .._base import check, progress
from .._base.threads import one_thread
from ..fe.assembly import System
from ..impact import accuracy
from ..impact.catalogue import hammers as listed
from ..impact.collision import strike
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.spectra import half_sine_spectrum
from ..impact.striker import Striker
from ..model.target import Stages, Target
from ..modes.modal import Damping, Modes
from . import batches, bodies

# [-] error limit of the blows that are looked at first: only to find where ranges end, which DECIDED then settles
TOLERANCE = 1e-2
DECIDED = 1e-4  # [-] error limit of the blows that decide where a range of tips ends, a tenth of its WIDTH
WIDTH = 1e-3  # [-] relative width to which the ends of a range are found: finer than any tip is known
# [-] hardest tip on a body of Ritz vectors, over that whose half sine has the bandwidth: three times its frequency
HARDEST = 10.0
# [-] modes used otherwise, whatever the bandwidth, to bound the time; residual compliance replaces the others
MOST_MODES = 300
# [-] softest tip tried, over those with the bandwidth and tuned to the first mode: a sixth of their frequency
SOFTEST = 0.03
STIFFEST = 100.0  # [-] hardest tip tried, over the one for which the modes are complete: ten times its frequency
MASSES = (1e-6, 1e4)  # [kg] allowed: outside, a blow takes too long to compute or overflows
BANDWIDTHS = (1e-3, 1e9)  # [Hz] allowed, for the same reason as the masses
# [-] frequencies where the spectrum is evaluated to find where it falls: 100 per inverse of the contact time
LOOKS = 400

catalogue = listed  # impact hammers as their data sheets describe them, by name


Ranges = tuple[tuple[float, float], ...]  # [N/m] softest and hardest tip of each


@dataclass(frozen=True)
class Hammer:
    """What one hammer can do on a body, with tips between the softest tried and the hardest that the model resolves."""

    mass: float  # [kg]
    single: Ranges  # tips that hit once; narrower gaps and ranges than 2 % may be missed
    working: Ranges  # tips that hit once and reach the bandwidth
    limit: float  # [N/m] hardest tip tried: the model of the body ends here
    reach: float | None  # [Hz] bandwidth with the hardest tip; None: no tip hits once
    error: float | None  # [-] estimated error of the blow with that tip
    notes: tuple[str, ...] = ()  # what the body assumed, and numbers that are probably a slip of a unit
    border: bool = False  # whether it is not one of those asked for, but the last that works beside one that does not

    @property
    def works(self) -> bool:
        """Whether some tip reaches the bandwidth and hits once."""
        return bool(self.working)

    @property
    def softest(self) -> float | None:
        """Softest tip [N/m] of the widest range that reaches the bandwidth and hits once; None: there is none."""
        return _widest(self.working)[0] if self.working else None

    @property
    def hardest(self) -> float | None:
        """Hardest tip [N/m] of that range, or else of the widest that hits once; None: every tip hits twice."""
        return _widest(self.working or self.single)[1] if self.single else None

    @property
    def unlimited(self) -> bool:
        """Whether tips up to `limit`, where the model ends, hit once, so that no hardest tip was found."""
        return self.hardest == self.limit

    def data(self) -> dict[str, Any]:
        """All numbers by name, in SI units."""
        names = ("softest", "hardest", "unlimited")
        return {**vars(self), **{name: getattr(self, name) for name in names}}


def _widest(ranges: Ranges) -> tuple[float, float]:
    return max(ranges, key=lambda ends: ends[1] / ends[0])


def bandwidth_of(hit: Response, drop: float) -> float:
    """Frequency [Hz] at which the force spectrum first falls ``drop`` [dB] below its value at 0 Hz.

    Examples
    --------
    >>> plate = fi.Modes.rigid(1e3)
    >>> hit = fi.strike(plate, fi.Striker.rigid(0.1), fi.Contact.linear(1e6), at=None, speed=1.0)
    >>> round(fi.hammers.bandwidth_of(hit, 10.0))  # Hz
    1026
    """
    frequencies = np.linspace(0.0, 4.0 / hit.contact_time, LOOKS)
    found = falls(frequencies, np.abs(hit.spectrum(frequencies)), drop)
    return float(frequencies[-1]) if found is None else found


def falls(frequencies: np.ndarray, size: np.ndarray, drop: float) -> float | None:
    """Frequency [Hz] at which amplitudes (n_frequencies,) first fall ``drop`` [dB] below the first; None: nowhere."""
    level = 20.0 * np.log10(np.maximum(size, 1e-12 * size[0]) / size[0]) + drop
    first = int(np.argmax(level < 0.0))
    if level[first] >= 0.0:
        return None
    share = level[first - 1] / (level[first - 1] - level[first])
    return float(frequencies[first - 1] + share * (frequencies[first] - frequencies[first - 1]))


@check.typed
def highest_frequency(modes: Modes, at: Any, bandwidth: float, masses: Any, *, drop: float = 10.0) -> float:
    """Frequency [Hz] up to which modes are needed to choose a hammer, estimated from the first few modes."""
    centre = _centre(bandwidth, drop)
    return max(
        accuracy.cutoff_frequency(
            modes, at, contact=Contact.linear(HARDEST * accuracy.resonant_stiffness(mass, centre)), mass=mass,
            speed=1.0, tolerance=TOLERANCE,
        )
        for mass in _checked(masses)
    )  # fmt: skip


def _checked(masses: Any) -> np.ndarray:
    masses = check.array("masses", masses, (None,), "kg", lift=True)
    if not len(masses):
        raise ValueError("masses must contain at least one mass in kg, got none")
    return np.array([check.between("masses", mass, *MASSES, "kg") for mass in masses])


def _centre(bandwidth: float, drop: float) -> float:
    """Contact resonance [Hz] whose half sine has the given bandwidth."""
    drop = check.between("drop", drop, 1.0, 40.0, "dB")
    return check.between("bandwidth", bandwidth, *BANDWIDTHS, "Hz") / half_sine_reach(drop)


@check.typed
@one_thread
def choose(
    modes: Modes | System,
    at: Any,
    bandwidth: float,
    masses: Any,
    *,
    drop: float = 10.0,
    damping_ratio: Damping | None = None,
    between: bool = False,
) -> tuple[Hammer, ...]:
    """Find the tips that suit each rigid hammer, by striking with linear tips from soft to hard.

    Parameters
    ----------
    modes : Modes or System
        The body under test. With modes, the search ends with the hardest tip that they resolve (`Response.error`). A
        `System` is described by what the blows need of it, and the search ends ten times above the tip whose half sine
        has the bandwidth.
    at : strike point, (dimension,) [m]
    bandwidth : float [Hz]
        Frequency up to which the force spectrum must stay within ``drop`` of its value at 0 Hz.
    masses : array_like, shape (n_masses,) [kg]
    drop : float [dB]
    damping_ratio : float or function of frequency [Hz], optional
        Damping of a system, which has none of its own.
    between : bool
        Whether masses are searched, too: where of two neighbours only one works, the last mass that does.

    Returns
    -------
    tuple of Hammer, in the order of the masses
        The ends of each range are found to the relative width WIDTH and belong to it. With ``between`` the hammers
        ascend in mass, and those found between them are a `border`, to the relative width 5e-3; neighbours that both
        work or both do not are taken to have no other hammers in between.

    Notes
    -----
    Computed blows decide, not the kinetic-energy criterion: multiple impacts happen well below its threshold. With
    linear tips the answer is the same at any speed. Which tips hit once does not depend on the bandwidth.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300)
    >>> light, border, heavy = fi.hammers.choose(plate, (0.45, 0.3), 500.0, masses=[0.02, 0.05], between=True)
    >>> light.works, heavy.works, round(border.mass, 3)  # kg
    (True, False, 0.031)
    """
    return choose_on(Target.of(modes, damping_ratio), at, bandwidth, masses, drop=drop, between=between)


def choose_on(
    target: Target, at: Any, bandwidth: float, masses: Any, *, drop: float = 10.0, stages: Stages | None = None,
    between: bool = False,
) -> tuple[Hammer, ...]:  # fmt: skip
    """As `choose`, on a body however it is known."""
    target = replace(target, stretching=False)  # hammers are chosen for small blows
    masses, centre = _checked(masses), _centre(bandwidth, drop)
    hardest = HARDEST**0.5 * centre

    def blows(*resonances: float) -> list[dict[str, float]]:
        pairs = [(mass, accuracy.resonant_stiffness(mass, f)) for mass in masses for f in resonances]
        return [{"mass": mass, "stiffness": tip} for mass, tip in pairs]

    ends, chance = blows(hardest, SOFTEST**0.5 * centre), blows(centre)
    modes, *_ = bodies.of_hammers(target, at, ends, chance, TOLERANCE, MOST_MODES, stages or Stages())
    flexible = modes.frequencies[modes.omega > 0.0]
    lowest = float(flexible[0]) if len(flexible) else centre

    def hammer(mass: float, border: bool = False) -> Hammer:
        limit = float(accuracy.resonant_stiffness(mass, hardest)) if target.kind == "fe" else np.inf
        return replace(_hammer(modes, at, mass, bandwidth, drop, (centre, lowest), limit), border=border)

    found: dict[int, Hammer] = {}
    for i in _mixed(masses):
        progress.report("hammers", len(found), len(masses))
        found[i] = hammer(float(masses[i]))
    progress.report("hammers", len(found), len(masses))
    chosen = tuple(found[i] for i in range(len(masses)))
    return _with_borders(chosen, hammer) if between else chosen


def _mixed(masses: np.ndarray) -> np.ndarray:
    """An order of the masses whose first ones have the mean of all: heavy ones take longer, and the time left is shown.

    Ranks follow each other as multiples of the golden section do round a circle, which halve the widest gap each time.
    """
    golden = 0.5 * (5.0**0.5 - 1.0)
    ranks = np.argsort(np.argsort(golden * np.arange(len(masses)) % 1.0))
    return np.argsort(masses, kind="stable")[ranks]


def _with_borders(chosen: tuple[Hammer, ...], hammer: Callable[[float, bool], Hammer]) -> tuple[Hammer, ...]:
    """Hammers in ascending mass, and of neighbours of which one works the last mass in between that does, too."""
    chosen = tuple(sorted(chosen, key=lambda one: one.mass))
    pairs = [pair for pair in pairwise(chosen) if pair[0].works != pair[1].works]
    between = cache(lambda mass: hammer(mass, True))
    for done, pair in enumerate(pairs):
        progress.report("masses between", done, len(pairs))
        good, bad = sorted(pair, key=lambda one: not one.works)
        last = _end(lambda mass: between(mass).works, good.mass, bad.mass, 5e-3)  # finer than one in a hand is known
        chosen += (between(last),) if last != good.mass else ()
    progress.report("masses between", len(pairs), len(pairs))
    return tuple(sorted(chosen, key=lambda one: one.mass))


def _hammer(
    modes: Modes, at: Any, mass: float, bandwidth: float, drop: float, tuned: tuple[float, float], limit: float
) -> Hammer:
    """What one hammer can do.

    ``tuned`` are frequencies [Hz] far above those of the contact with the softest tip; no tip is harder than ``limit``
    [N/m], nor than modes resolve, unless these are vectors.
    """
    striker, alone = Striker.rigid(mass), replace(modes, poorer={})

    @cache
    def hit(tip: float, tolerance: float = DECIDED, body: Modes = alone) -> Response:
        return strike(body, striker, Contact.linear(tip), at=at, speed=1.0, tolerance=tolerance, max_impacts=2)

    whole = partial(hit, body=modes)

    def once(tip: float) -> bool:
        """Whether a tip hits once by all descriptions of the body."""
        if not modes.poorer or hit(tip).n_impacts != 1:
            return hit(tip).n_impacts == 1
        error = whole(tip).error
        return error.truncation < 1.0 and error.mesh < 1.0

    def reaches(tip: float, tolerance: float = DECIDED) -> bool:
        """Whether the force spectrum stays within ``drop`` of its value at 0 Hz up to the bandwidth."""
        found = hit(tip, tolerance)
        looks = int(np.clip(LOOKS / 4.0 * bandwidth * found.contact_time, 16, LOOKS))
        size = np.abs(found.spectrum(np.linspace(0.0, bandwidth, looks)))
        return bool(size.min() >= size[0] * 10.0 ** (-drop / 20.0))

    low = SOFTEST * mass * (2.0 * np.pi * min(tuned)) ** 2
    high = STIFFEST * mass * (2.0 * np.pi * max(tuned)) ** 2
    if modes.omega.any() and not modes.poorer:
        high = _last_resolved(modes, at, mass)
    high = min(high, limit)
    if high <= low:
        return Hammer(float(mass), (), (), high, None, None, modes.notes)
    tips = _series(low, high, 100)  # 2 % apart
    counts = impacts_of_tips(alone, striker, modes.point("at", at)[0], tips)
    doubtful = np.flatnonzero(np.isnan(counts))
    counts[doubtful] = [hit(float(tip)).n_impacts for tip in tips[doubtful]]
    single = _ranges(tips, counts == 1, once)
    working: Ranges = ()
    for ends in single:
        tips = _series(*ends, 12)  # the bandwidth is smooth
        working += _ranges(tips, np.array([reaches(float(tip), TOLERANCE) for tip in tips]), reaches)
    last = _widest(working or single)[1] if single else None
    reach, error = (bandwidth_of(hit(last), drop), whole(last).error.total) if last else (None, None)
    return Hammer(float(mass), single, working, high, reach, error, modes.notes)


def impacts_of_tips(modes: Modes, striker: Striker, at: np.ndarray, tips: np.ndarray) -> np.ndarray:
    """Number of impacts (n_tips,) of one hammer, 2 for several; NaN where the modal engine must count."""
    if modes.stretches:
        return np.full(len(tips), np.nan)
    family, one = batches.Family.of(modes, at, striker, residual=True), np.ones(len(tips))
    blows = batches.Blows(
        {0: family}, np.zeros(len(tips), int), modes.mass * one, striker.mass * one, tips, one, one, 0.0 * one
    )
    return batches.count_impacts(blows, tolerance=DECIDED, most=2)


def _last_resolved(modes: Modes, at: Any, mass: float) -> float:
    """Hardest tip [N/m] for which the modes left out do not govern the contact, to the relative width WIDTH."""

    def complete(log: float) -> float:
        law = Contact.linear(float(np.exp(log)))
        needed = accuracy.cutoff_frequency(modes, at, contact=law, mass=mass, speed=1.0, tolerance=TOLERANCE)
        return needed - float(modes.frequencies[-1])

    def resolved(tip: float) -> bool:
        how: dict[str, Any] = {"at": at, "speed": 1.0, "tolerance": TOLERANCE, "max_impacts": 1}
        return strike(modes, Striker.rigid(mass), Contact.linear(tip), **how).error.resolvable

    centre = np.log(mass * float(modes.omega[-1]) ** 2)
    first = float(np.exp(brentq(complete, centre - 40.0, centre + 40.0)))
    return _end(resolved, first, STIFFEST * first)


def _series(low: float, high: float, per_decade: int) -> np.ndarray:
    """Tips from low to high, evenly spaced in the logarithm."""
    return np.geomspace(low, high, 2 + int(per_decade * np.log10(high / low)))


def _ranges(tips: np.ndarray, good: np.ndarray, suits: Callable[[float], bool]) -> Ranges:
    """Ranges of tips that suit, from a series of tips known to be good or not; ends are found by bisection."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]])))
    found = []
    for first, last in zip(ends[::2].tolist(), (ends[1::2] - 1).tolist()):
        # the first look was less accurate: leave out tips at the ends that do not suit after all
        first = next((i for i in range(first, last + 1) if suits(float(tips[i]))), None)
        if first is None:
            continue
        last = next(i for i in range(last, first - 1, -1) if suits(float(tips[i])))
        low, high = float(tips[first]), float(tips[last])
        low = low if first == 0 else _end(suits, low, float(tips[first - 1]))
        high = high if last == len(tips) - 1 else _end(suits, high, float(tips[last + 1]))
        found.append((low, high))
    return tuple(found)


def _end(suits: Callable[[float], bool], good: float, bad: float, width: float = WIDTH) -> float:
    """The last tip or mass that suits between a good one and a bad one, to a relative width."""
    while abs(np.log(bad / good)) > width:
        middle = float(np.sqrt(good * bad))
        good, bad = (middle, bad) if suits(middle) else (good, middle)
    return good


def half_sine_reach(drop: float) -> float:
    """Frequency over contact resonance at which the spectrum of a half sine has fallen by ``drop`` [dB]."""
    return float(brentq(lambda x: 20.0 * np.log10(half_sine_spectrum(x, 1.0)) + drop, 1e-3, 2.999))
