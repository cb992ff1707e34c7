"""Choosing a hammer: which mass and tip stiffness reach a required bandwidth without a double hit."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from .._base import check
from ..impact import accuracy
from ..impact.collision import strike
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.spectra import half_sine_spectrum
from ..impact.striker import Striker
from ..modes.modal import Modes
from . import grid

TOLERANCE = 1e-2  # [-] error limit of the blows that decide
TIPS = np.geomspace(0.03, 10.0, 61)  # [-] stiffnesses tried, over that whose half sine has the bandwidth; 24 per decade
ROUNDS = 7  # [-] bisections for the softest tip that reaches the bandwidth
MASSES = (1e-6, 1e4)  # [kg] allowed: outside, a blow takes too long to compute or overflows
BANDWIDTHS = (1e-3, 1e9)  # [Hz] allowed, for the same reason as the masses
LOOKS = 400  # [-] frequencies at which the spectrum is evaluated to find where it falls


@dataclass(frozen=True)
class Hammer:
    """What one hammer can do on a body."""

    mass: float  # [kg]
    softest: float | None  # [N/m] softest tip that reaches the bandwidth with a single hit; None: there is none
    hardest: float | None  # [N/m] hardest tip in the widest range that hits once; None: every tip hits twice
    reach: float | None  # [Hz] bandwidth with the hardest tip

    @property
    def works(self) -> bool:
        """Whether some tip reaches the bandwidth and hits once."""
        return self.softest is not None


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
    size = np.abs(hit.spectrum(frequencies))
    level = 20.0 * np.log10(np.maximum(size, 1e-12 * size[0]) / size[0]) + drop
    first = int(np.argmax(level < 0.0))
    if level[first] >= 0.0:
        return float(frequencies[-1])
    share = level[first - 1] / (level[first - 1] - level[first])
    return float(frequencies[first - 1] + share * (frequencies[first] - frequencies[first - 1]))


@check.typed
def highest_frequency(modes: Modes, at: Any, bandwidth: float, masses: Any, *, drop: float = 10.0) -> float:
    """Frequency [Hz] up to which modes are needed to choose a hammer, estimated from the first few modes."""
    centre = _centre(bandwidth, drop)
    return max(
        accuracy.cutoff_frequency(
            modes, at, contact=Contact.linear(TIPS[-1] * accuracy.resonant_stiffness(mass, centre)), mass=mass,
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
def choose(modes: Modes, at: Any, bandwidth: float, masses: Any, *, drop: float = 10.0) -> tuple[Hammer, ...]:
    """Find the tips that suit each rigid hammer, by striking with a series of linear tips from soft to hard.

    Parameters
    ----------
    modes : Modes
        Modes of the body under test, up to `highest_frequency`.
    at : strike point, (dimension,) [m]
    bandwidth : float [Hz]
        Frequency up to which the force spectrum must stay within ``drop`` of its value at 0 Hz.
    masses : array_like, shape (n_masses,) [kg]
    drop : float [dB]

    Returns
    -------
    tuple of Hammer, in the order of the masses

    Notes
    -----
    Computed blows decide, not the kinetic-energy criterion: multiple impacts happen well below its threshold. With
    linear tips the answer is the same at any speed. If several ranges of tips hit once, the widest one is used: a heavy
    hammer with a soft tip can graze the vibrating body a second time.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300)
    >>> light, heavy = fi.hammers.choose(plate, (0.45, 0.3), 500.0, masses=[2e-3, 0.2])
    >>> light.works, heavy.works
    (True, False)
    """
    masses = _checked(masses)
    centre = _centre(bandwidth, drop)
    found = []
    for mass in masses:
        striker = Striker.rigid(mass)
        tips = accuracy.resonant_stiffness(mass, centre) * TIPS
        table = grid.sweep(
            modes, striker, Contact.linear(1.0), at=at, speed=1.0, over={"stiffness": tips}, tolerance=TOLERANCE
        )
        first, last = _longest_run(table.n_impacts.values == 1)
        if first == last:
            found.append(Hammer(float(mass), None, None, None))
            continue

        def reach(tip: float, striker: Striker = striker) -> float:
            hit = strike(modes, striker, Contact.linear(tip), at=at, speed=1.0, tolerance=TOLERANCE)
            return bandwidth_of(hit, drop)

        best = reach(tips[last - 1])
        softest = _softest(reach, tips[first], tips[last - 1], bandwidth) if best >= bandwidth else None
        found.append(Hammer(float(mass), softest, float(tips[last - 1]), best))
    return tuple(found)


def _longest_run(true: np.ndarray) -> tuple[int, int]:
    """Start and stop (exclusive) of the longest run of true values; (0, 0) if there is none."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], true, [False]])))
    first, last = ends[::2], ends[1::2]
    if len(first) == 0:
        return 0, 0
    longest = int(np.argmax(last - first))
    return int(first[longest]), int(last[longest])


def _softest(reach: Any, low: float, high: float, bandwidth: float) -> float:
    """The softest tip between two that reaches the bandwidth; the harder of the two must reach it."""
    if reach(low) >= bandwidth:
        return float(low)
    for _ in range(ROUNDS):
        middle = float(np.sqrt(low * high))
        if reach(middle) >= bandwidth:
            high = middle
        else:
            low = middle
    return float(high)


def half_sine_reach(drop: float) -> float:
    """Frequency over contact resonance at which the spectrum of a half sine has fallen by ``drop`` [dB]."""
    return float(brentq(lambda x: 20.0 * np.log10(half_sine_spectrum(x, 1.0)) + drop, 1e-3, 2.999))
