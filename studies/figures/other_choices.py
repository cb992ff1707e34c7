"""Checks the claims of *Euphonics* 12.1 as numbers at other strike points, damping ratios and speeds.

python studies/figures/other_choices.py [FOLDER] prints the smallest and the largest number of each claim.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import fig05
import fig06
import fig20
import fig23
import numpy as np
import source_scenes as source
from scipy.signal import find_peaks

import fem_impact as fi

NEAR = [(0.3, 0.3), (0.22, 0.34), (0.26, 0.3)]  # [-] of the sides: these give the pulses of figures 21 and 22
PLACES = [*NEAR, (0.2, 0.3), (0.45, 0.5), (0.4, 0.25)]  # [-] on and off the lines of symmetry
DAMPING = [0.0, 0.005, 0.02]  # [-]
SPEEDS = [0.3, 10.0]  # [m/s] for the linear spring; HERTZ_SPEED times as much for the Hertz spring
SHAPE = np.linspace(0.0, 1.0, 201)  # [-] of the contact time
TURNS = np.linspace(0.0, 7.0, 1401)  # [-] frequency times contact time
RIGID, MEDIUM, LIGHT = source.PLATE_MASSES.values()


@dataclass(frozen=True)
class Choice:
    """The parameters that the source does not state."""

    place: tuple[float, float] = (0.3, 0.3)  # [-] of the sides
    damping_ratio: float = 0.0  # [-]
    speed: float = source.SPEED  # [m/s]

    @property
    def at(self) -> tuple[float, float]:
        return self.place[0] * source.LENGTH, self.place[1] * source.WIDTH


@dataclass(frozen=True)
class Claim:
    """A claim of the source as a number that must lie between two bounds."""

    figures: str
    text: str
    measure: Callable[[Choice], float]
    low: float
    high: float
    places: tuple = tuple(PLACES)

    def holds(self, number: float) -> bool:
        return self.low <= number <= self.high


@lru_cache(maxsize=16)
def blow(plate_mass: float, stiffness: float, choice: Choice, hertz: bool = False) -> fi.Response:
    """The blow of the stick of 100 g on a plate."""
    target = source.plate(plate_mass, damping_ratio=choice.damping_ratio)
    law = source.HERTZ if hertz else fi.Contact.linear(stiffness)
    speed = choice.speed * (source.HERTZ_SPEED if hertz else 1.0)
    return fi.strike(target, source.stick(), law, at=choice.at, speed=speed, tolerance=1e-3)


@lru_cache(maxsize=16)
def few(plate_mass: float, choice: Choice, hertz: bool = False):
    """A map of a few blows; the contact resonance is constant along its diagonals."""
    study, ratio = (source.hertz_map, source.HERTZ_SPEED) if hertz else (source.linear_map, 1.0)
    middle = source.MARKED_HERTZ[1] if hertz else source.MARKED[1]
    return study(
        plate_mass, [0.05, 0.1, 0.2], middle * 2.0 ** np.arange(-3, 4), at=choice.at,
        damping_ratio=choice.damping_ratio, speed=choice.speed * ratio,
    )  # fmt: skip


@lru_cache(maxsize=2)
def pulses(choice):
    """Pulses of the linear and the Hertz spring on the rigid plate, relative to contact time and peak."""
    hits = (blow(RIGID, source.MARKED[1], choice), blow(RIGID, 0.0, choice, True))
    return [np.interp(SHAPE * hit.contact_time, hit.time, hit.force) / hit.peak_force for hit in hits]


@lru_cache(maxsize=2)
def lobes(choice):
    """Levels [dB] of both pulses over TURNS, and position and level of their lobes, (n, 2)."""
    hits = (blow(RIGID, source.MARKED[1], choice), blow(RIGID, 0.0, choice, True))
    levels = [source.decibels(hit.spectrum(TURNS / hit.contact_time)) for hit in hits]
    tops = [find_peaks(level)[0][:4] for level in levels]
    return levels, [np.column_stack([TURNS[top], level[top]]) for top, level in zip(tops, levels)]


def half_sine(choice):
    """Largest difference of the force from a half sine, over the peak; varies the mass too."""
    hit = fig05.compute(mass=0.02 * choice.speed, speed=choice.speed)
    return np.abs(hit.force / hit.peak_force - np.sin(np.pi * hit.time / hit.contact_time)).max()


@lru_cache(maxsize=2)
def half_sines(speed):
    """Levels of figure 6 for another mass and speed."""
    return fig06.compute(mass=0.02 * speed, speed=speed)


def band(choice, resonance, wanted, drop):
    """Frequency at which a half sine's level falls, over the frequency stated by the source."""
    return fig06.reach(half_sines(choice.speed)[resonance][0], drop) / wanted


def steeper(choice):
    """Slope of the Hertz force over that of the linear force, a quarter into the contact."""
    slopes = [np.gradient(pulse, SHAPE)[50] for pulse in pulses(choice)]  # a quarter into the contact
    return slopes[1] / slopes[0]


def wider(choice):
    """Bandwidth (10 dB) of the Hertz pulse over that of the linear pulse."""
    reach = [TURNS[np.argmax(level < -10.0)] for level in lobes(choice)[0]]
    return reach[1] / reach[0]


def falls(choice):
    """By how much more [dB] the lobes of the Hertz pulse fall from the first to the fourth."""
    first, second = (lobe[0, 1] - lobe[-1, 1] for lobe in lobes(choice)[1])
    return second - first


def off_contour(table):
    """Largest relative difference of contact times from half the period of the contact resonance."""
    return float(np.abs(2.0 * table.contact_resonance * table.contact_time - 1.0).max())


def along_contours(table):
    """Largest spread of the centroid along a contour of the contact resonance, over its step between contours."""
    log = np.log(table.centroid.values)
    lines = np.array([log[shift + np.arange(3), np.arange(3)] for shift in range(5)])  # stiffness and mass both doubled
    return np.ptp(lines, axis=1).max() / np.diff(lines.mean(axis=1)).min()


def change(plate_mass, choice, where):
    """Relative change of the contact time on a lighter plate, in part of the map."""
    times = [few(mass, choice).contact_time.values for mass in (plate_mass, RIGID)]
    return np.abs(times[0] / times[1] - 1.0)[where]


def share(choice):
    """Share of the blows beyond the threshold that are not clean."""
    grid = {"masses": source.MASSES[::4], "stiffnesses": source.STIFFNESSES[1::3], "max_frequency": None}
    table = fig20.compute(choice.at, damping_ratio=choice.damping_ratio, speed=choice.speed, **grid)
    return float(1.0 - table.clean.values[table.ratio.values >= 1.0].mean())


def shallower(choice, stiffness, masses):
    """How much deeper [dB] the first two dips of the half sine are on the first plate than on the second."""
    dips = np.linspace(1.2, 2.8, 801) / blow(RIGID, stiffness, choice).contact_time
    hits = {mass: blow(mass, stiffness, choice) for mass in masses}
    first, second = fig23.levels(hits, np.append(0.0, dips)).values()
    return second.min() - first.min()


SOFT, HARD, INF = source.MARKED[1], source.STIFF[1], math.inf
UPPER_RIGHT, LOWER_LEFT = np.s_[-1, -1], np.s_[0, 0]
CLAIMS = [
    Claim("5", "largest difference from a half sine, over the peak", half_sine, 0.0, 2e-3),
    Claim("6", "300 Hz: 20 dB band over 700 Hz", lambda c: band(c, 300.0, 700.0, 20.0), 0.85, 1.15),
    Claim("6", "the same for the 15 dB band", lambda c: band(c, 300.0, 700.0, 15.0), 0.85, 1.15),
    Claim("6", "1500 Hz: 20 dB band over 4 kHz", lambda c: band(c, 1500.0, 4e3, 20.0), 0.85, 1.15),
    Claim("6", "the same for the 15 dB band", lambda c: band(c, 1500.0, 4e3, 15.0), 0.85, 1.15),
    Claim("8", "Hertz: early force over the linear force", lambda c: pulses(c)[1][10] / pulses(c)[0][10], 0.0, 0.6),
    Claim("8", "Hertz: later slope over the linear slope", steeper, 1.1, INF),
    Claim("9", "Hertz: bandwidth over the linear bandwidth", wider, 1.02, 1.3),
    Claim("9", "Hertz: smallest upward shift of a lobe, times T",
          lambda c: (lobes(c)[1][1] - lobes(c)[1][0])[:, 0].min(), 0.01, 0.5),
    Claim("9", "Hertz: additional fall of the lobes, dB", falls, 1.0, INF),
    Claim("10", "largest deviation of contact time from contours", lambda c: off_contour(few(RIGID, c)), 0.0, 0.065),
    Claim("12", "the same for Hertz", lambda c: off_contour(few(RIGID, c, True)), 0.0, 0.065),
    Claim("11", "centroid: change along over across contours", lambda c: along_contours(few(RIGID, c)), 0.0, 0.05),
    Claim("13", "the same for Hertz", lambda c: along_contours(few(RIGID, c, True)), 0.0, 0.05),
    Claim("18", "2 kg: largest change of contact time", lambda c: change(MEDIUM, c, np.s_[:]).max(), 0.0, 0.2),
    Claim("19", "200 g: change of contact time, upper right", lambda c: change(LIGHT, c, UPPER_RIGHT), 1.0, INF),
    Claim("19", "200 g: change of contact time, lower left", lambda c: change(LIGHT, c, LOWER_LEFT), 0.0, 0.25),
    Claim("20", "share beyond the threshold that is not clean", share, 0.9, 1.0, tuple(NEAR)),
    Claim("21", "200 g: number of contacts", lambda c: blow(LIGHT, SOFT, c).n_impacts, 1, 1, tuple(NEAR)),
    Claim("21", "200 g: number of humps", lambda c: len(source.humps(blow(LIGHT, SOFT, c))), 2, 2, tuple(NEAR)),
    Claim("22", "200 g: number of contacts", lambda c: blow(LIGHT, HARD, c).n_impacts, 2, INF, tuple(NEAR)),
    Claim("23", "dips: shallower on 2 kg than on 500 t, dB", lambda c: shallower(c, SOFT, (RIGID, MEDIUM)), 5.0, INF),
    Claim("23", "dips: shallower on 200 g than on 2 kg, dB", lambda c: shallower(c, SOFT, (MEDIUM, LIGHT)), 2.0, INF),
    Claim("24", "dips: shallower on 2 kg than on 500 t, dB", lambda c: shallower(c, HARD, (RIGID, MEDIUM)), 5.0, INF),
    Claim("24", "dips: shallower on 200 g than on 500 t, dB", lambda c: shallower(c, HARD, (RIGID, LIGHT)), 5.0, INF),
]  # fmt: skip


CHOICES = [Choice(*chosen, speed) for chosen, speed in zip(itertools.product(PLACES, DAMPING), itertools.cycle(SPEEDS))]


def main():
    """Print the bounds of every claim and the numbers found."""
    print(f"{len(CHOICES)} choices: places {PLACES}, damping {DAMPING}, speeds {SPEEDS} m/s; only {NEAR} for 20 to 22")
    found: list[list[float]] = [[] for _ in CLAIMS]
    for choice in CHOICES:
        for claim, numbers in zip(CLAIMS, found):
            numbers += [claim.measure(choice)] if choice.place in claim.places else []
    for claim, numbers in zip(CLAIMS, found):
        verdict = "" if all(map(claim.holds, numbers)) else "  FAILS"
        reach = f"{min(numbers):9.3g} to {max(numbers):<9.3g} required {claim.low:g} to {claim.high:g}"
        print(f"{claim.figures:>3}  {claim.text:<48}{reach}{verdict}")


if __name__ == "__main__":
    main()
