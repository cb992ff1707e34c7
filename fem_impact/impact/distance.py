"""The distance between two blows: every error that the program states is one."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base.rounding import ROUNDING
from . import force_spectrum
from .history import History
from .quantities import BAND_POINTS, BANDED

if TYPE_CHECKING:
    from .response import Response

INSTANTS = ("contact_time", "force")  # quantities that depend on single instants


@dataclass(eq=False)
class Distance:
    """How far one run is from another [-]."""

    quantities: dict[str, float]  # in each quantity asked for
    margin: float
    rebounds: np.ndarray  # (n_impacts,) in the restitution of each impact, in the order of `History.contacts`

    @property
    def worst(self) -> float:
        """The largest distance in any quantity."""
        return max(self.quantities.values(), default=0.0)

    def __add__(self, other: "Distance") -> "Distance":
        two = other.quantities
        found = {name: value + two[name] for name, value in self.quantities.items()}
        return Distance(found, self.margin + other.margin, self.rebounds + other.rebounds)

    def scaled(self, factor: float, parting: float) -> "Distance":
        """The same times a factor; in the restitutions of impacts times another."""
        found = {name: factor * value for name, value in self.quantities.items()}
        return Distance(found, factor * self.margin, parting * self.rebounds)

    @classmethod
    def uniform(cls, like: "Distance", size: float) -> "Distance":
        """The same distance in everything that another tells of."""
        return cls(dict.fromkeys(like.quantities, size), size, np.full(len(like.rebounds), size))


def largest(distances: Iterable[Distance]) -> Distance:
    """The largest of some distances in everything."""
    first, *others = distances
    for other in others:
        found = {name: max(value, other.quantities[name]) for name, value in first.quantities.items()}
        first = Distance(found, max(first.margin, other.margin), np.maximum(first.rebounds, other.rebounds))
    return first


def distance(one: Mapping[str, Any], two: Mapping[str, Any]) -> dict[str, Any]:
    """How far one blow is from another in every number of the other [-].

    Parameters
    ----------
    one, two : mapping of str to number, None or array
        Numbers of two blows by name, or of two times many blows as arrays of equal shape. Spectra, (n_frequencies,),
        have the names of their quantities.

    Returns
    -------
    dict of str to float or array
        Absolute for the restitution, relative to the second for all others; 1 if only one of the blows has a
        restitution. Of a spectrum it is the largest difference over the largest value of the second.
    """
    found: dict[str, Any] = {}
    for name, value in two.items():
        other = one[name]
        if other is None or value is None:
            found[name] = float((other is None) != (value is None))
        elif name == "restitution":
            found[name] = abs(other - value)
        elif name in BANDED:
            found[name] = float(abs(other - value).max() / (abs(value).max() or 1.0))
        elif isinstance(value, np.ndarray):
            found[name] = abs(other - value) / np.where(value == 0.0, 1.0, abs(value))
        else:
            found[name] = abs(other - value) / (abs(value) or 1.0)
    return found


def of_blows(one: "Response", two: "Response", quantities: Mapping[str, float | None]) -> dict[str, float]:
    """How far one blow is from another in each quantity; the sound counts by the spectrum of the force."""
    return distance(*({name: _value(hit, name, band) for name, band in quantities.items()} for hit in (one, two)))


def _value(hit: "Response", name: str, band: float | None) -> Any:
    if band is not None:
        return hit.spectrum(np.linspace(0.0, band, BAND_POINTS))
    return getattr(hit, "peak_force" if name == "force" else name)


def of_runs(
    one: History, two: History, quantities: Mapping[str, float | None], over: tuple[float, float] = (1.0, 1.0)
) -> Distance:
    """How far one run is from another in each quantity asked for, in its margin and in the restitution of each impact.

    All are 1 if the runs ended differently. The restitution counts by the speed of every body that moves rigidly, over
    the momentum of all. ``over`` divides the distances in quantities that depend on the whole blow, and those in
    contact time and peak force, which depend on an instant; not those of impacts, as points part as fast as the bodies
    ring there, also in modes faster than the step.
    """
    n_impacts = len(two.contacts)
    if len(one.contacts) != n_impacts or one.status != two.status:
        return Distance(dict.fromkeys(quantities, 1.0), 1.0, np.ones(n_impacts))
    rigid = two.omega == 0.0  # a swinging body has much momentum, of which the striker's error is no share
    start, end = two.start_p[rigid], two.end_p[rigid]
    momentum = sqrt(max(start.dot(start), end.dot(end)))
    momentum = momentum or sqrt(two.start_p.dot(two.start_p)) or sqrt(two.end_p.dot(two.end_p)) or 1.0
    speeds = np.abs(one.end_p[one.omega == 0.0] - end)
    found: dict[str, float] = {"restitution": max(speeds.tolist(), default=0.0) / momentum}
    if n_impacts:
        found |= distance(one.totals, two.totals)
    error: dict[str, float] = {}
    for name, band in quantities.items():
        if band is not None:
            found |= distance({name: _spectrum(one, band)}, {name: _spectrum(two, band)})
        error[name] = max(ROUNDING, found.get(name, ROUNDING) / over[name in INSTANTS])
    apart = np.abs(one.rebounds - two.rebounds)
    unlike = np.isnan(one.rebounds) != np.isnan(two.rebounds)  # only one of them has a restitution
    return Distance(error, abs(one.margin - two.margin), np.where(np.isnan(apart), unlike, apart))


def _spectrum(history: History, band: float) -> np.ndarray:
    pieces = force_spectrum.pieces(*history.samples(1.0))
    return np.asarray(force_spectrum.of_pieces(pieces, np.linspace(0.0, band, BAND_POINTS)))


def growth(coarse: History, fine: History) -> float:
    """Growth [-] of the difference of two runs between the end of the first and of the last impact."""
    if len(coarse.contacts) != len(fine.contacts):
        return float("inf")
    if len(fine.contacts) < 2:
        return 1.0
    one, two = (np.sort(history.contacts[:, 1]) for history in (coarse, fine))
    least = ROUNDING * two[-1]
    return max(1.0, float((abs(one[-1] - two[-1]) + least) / (abs(one[0] - two[0]) + least)))
