"""Choosing a hammer: which mass and tip stiffness reach a wanted bandwidth without hitting twice."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from . import _check, accuracy, charts, maps
from .contact import Contact
from .integrator import strike
from .modal import Modes
from .response import Response
from .spectra import half_sine_spectrum
from .striker import Striker

TOLERANCE = 1e-2  # [-] of the blows behind a choice
TIPS = np.geomspace(0.03, 10.0, 61)  # [-] of the stiffness at which a half sine has the bandwidth: 24 for each decade
ROUNDS = 7  # [-] halvings of the span between two tips when the softest that reaches the bandwidth is sought
MASSES = (1e-6, 1e4)  # [kg] of hammers: beyond, a blow takes for ever or leaves the range of numbers
BANDWIDTHS = (1e-3, 1e9)  # [Hz] likewise
LOOKS = 400  # [-] frequencies at which a spectrum is searched for where it falls


@dataclass(frozen=True)
class Hammer:
    """What one hammer can do on a body."""

    mass: float  # [kg]
    softest: float | None  # [N/m] tip that just reaches the bandwidth; None: none does without a double hit
    hardest: float | None  # [N/m] end of the widest range of tips that all hit once; None: every tip hits twice
    reach: float | None  # [Hz] bandwidth with the hardest

    @property
    def works(self) -> bool:
        """Whether there is a tip that reaches the bandwidth and hits once."""
        return self.softest is not None


def bandwidth_of(hit: Response, drop: float) -> float:
    """Frequency [Hz] at which the force spectrum first falls ``drop`` [dB] below its start."""
    frequencies = np.linspace(0.0, 4.0 / hit.contact_time, LOOKS)
    size = np.abs(hit.spectrum(frequencies))
    level = 20.0 * np.log10(np.maximum(size, 1e-12 * size[0]) / size[0]) + drop
    first = int(np.argmax(level < 0.0))
    if level[first] >= 0.0:
        return float(frequencies[-1])
    share = level[first - 1] / (level[first - 1] - level[first])
    return float(frequencies[first - 1] + share * (frequencies[first] - frequencies[first - 1]))


@_check.typed
def highest_frequency(modes: Modes, at: Any, bandwidth: float, masses: Any, *, drop: float = 10.0) -> float:
    """Frequency [Hz] up to which modes are needed to choose a hammer; a few modes are enough to tell."""
    centre = _centre(bandwidth, drop)
    return max(
        accuracy.cutoff_frequency(
            modes, at, contact=Contact.linear(TIPS[-1] * mass * (2.0 * np.pi * centre) ** 2), mass=mass, speed=1.0,
            tolerance=TOLERANCE,
        )
        for mass in _checked(masses)
    )  # fmt: skip


def _checked(masses: Any) -> np.ndarray:
    masses = _check.array("masses", masses, (None,), "kg", lift=True)
    if not len(masses):
        raise ValueError("masses must hold at least one mass, got none")
    return np.array([_check.between("masses", mass, *MASSES, "kg") for mass in masses])


def _centre(bandwidth: float, drop: float) -> float:
    """Contact resonance [Hz] at which a half sine has a bandwidth."""
    drop = _check.between("drop", drop, 1.0, 40.0, "dB")
    return _check.between("bandwidth", bandwidth, *BANDWIDTHS, "Hz") / _half_sine_reach(drop)


@_check.typed
def choose(modes: Modes, at: Any, bandwidth: float, masses: Any, *, drop: float = 10.0) -> tuple[Hammer, ...]:
    """What each hammer can do: rigid, with a linear tip, struck with a row of tips from soft to hard.

    Parameters
    ----------
    modes : Modes
        Of the body under test, up to `highest_frequency`.
    at : point struck, (dimension,) [m]
    bandwidth : float [Hz]
        Up to which the force spectrum is to stay within ``drop`` of its start.
    masses : array_like, shape (n_masses,) [kg]
    drop : float [dB]

    Returns
    -------
    tuple of Hammer, in the order of the masses

    Notes
    -----
    The blows decide, not the kinetic-energy criterion: several impacts happen well below its threshold. Linear tips
    make the answer the same at any speed. Of several ranges of tips that hit once the widest counts: a heavy hammer
    on a soft tip may graze the swinging body once more.
    """
    masses = _checked(masses)
    centre = _centre(bandwidth, drop)
    found = []
    for mass in masses:
        striker = Striker.rigid(mass)
        tips = mass * (2.0 * np.pi * centre) ** 2 * TIPS
        table = maps.sweep(
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
    """Where the longest run of true values begins and, exclusive, ends; (0, 0) where there is none."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], true, [False]])))
    first, last = ends[::2], ends[1::2]
    if len(first) == 0:
        return 0, 0
    longest = int(np.argmax(last - first))
    return int(first[longest]), int(last[longest])


def _softest(reach: Any, low: float, high: float, bandwidth: float) -> float:
    """The softest tip between two that reaches the bandwidth; the harder one does."""
    if reach(low) >= bandwidth:
        return float(low)
    for _ in range(ROUNDS):
        middle = float(np.sqrt(low * high))
        if reach(middle) >= bandwidth:
            high = middle
        else:
            low = middle
    return float(high)


def _half_sine_reach(drop: float) -> float:
    """Frequency over contact resonance at which the half sine's spectrum is ``drop`` [dB] below its start."""
    return float(brentq(lambda x: 20.0 * np.log10(half_sine_spectrum(x, 1.0)) + drop, 1e-3, 2.999))


def draw(hammers: tuple[Hammer, ...], bandwidth: float, drop: float = 10.0) -> Any:
    """Tips that work, over the hammer's mass.

    Returns
    -------
    matplotlib.figure.Figure
    """
    mass = 1e3 * np.array([hammer.mass for hammer in hammers])
    hardest = np.array([hammer.hardest or np.nan for hammer in hammers])
    softest = np.array([hammer.softest or np.nan for hammer in hammers])
    wanted = mass / 1e3 * (2.0 * np.pi * bandwidth / _half_sine_reach(drop)) ** 2
    drawn = [
        charts.Curve(mass, hardest, "hardest tip that hits once", charts.VERMILION),
        charts.Curve(mass, softest, "softest tip that reaches the bandwidth", charts.BLUE),
        charts.Curve(mass, wanted, "the same on an unyielding body", charts.GREY, "--"),
    ]
    return charts.curves(
        drawn,
        x=charts.Axis("mass of the hammer", "g", log=True),
        y=charts.Axis("stiffness of the tip", "N/m", log=True),
        title=f"Hammers for {bandwidth:g} Hz at -{drop:g} dB without a double hit",
        between=(mass, softest, hardest),
    )
