"""The distance between two blows: every error that the program states is one."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base.rounding import ROUNDING
from . import force_spectrum
from .history import History
from .quantities import BAND_POINTS, BANDED

if TYPE_CHECKING:
    from .response import Response

INSTANTS = ("contact_time", "force")  # quantities that depend on single instants
MARGIN = "margin"  # the name under which distances of runs hold that of their margins
REBOUND = "rebound "  # and with the index of an impact that of its restitution
Distances = dict[str, float]  # [-] by quantity


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
    return {name: _apart(name, one[name], value) for name, value in two.items()}


def _apart(name: str, one: Any, two: Any) -> Any:
    if one is None or two is None:
        return float((one is None) != (two is None))
    apart = abs(one - two)
    if name == "restitution" or name.startswith(REBOUND):
        return apart
    if name in BANDED:
        return float(apart.max() / (abs(two).max() or 1.0))
    if isinstance(two, np.ndarray):
        return apart / np.where(two == 0.0, 1.0, abs(two))
    return apart / (abs(two) or 1.0)


def of_blows(one: "Response", two: "Response", quantities: Mapping[str, float | None]) -> Distances:
    """How far one blow is from another in each quantity; the sound counts by the spectrum of the force."""
    return distance(*({name: _value(hit, name, band) for name, band in quantities.items()} for hit in (one, two)))


def _value(hit: "Response", name: str, band: float | None) -> Any:
    if band is not None:
        return hit.spectrum(np.linspace(0.0, band, BAND_POINTS))
    return getattr(hit, "peak_force" if name == "force" else name)


def of_runs(
    one: History, two: History, quantities: Mapping[str, float | None], over: tuple[float, float] = (1.0, 1.0)
) -> Distances:
    """How far one run is from another in each quantity asked for, in its margin and in the restitution of each impact.

    All are 1 if the runs ended differently. The restitution counts by the speed of every body that moves rigidly, over
    the momentum of all. ``over`` divides the distances in quantities that depend on the whole blow, and those in
    contact time and peak force, which depend on an instant; not those of impacts, as points part as fast as the bodies
    ring there, also in modes faster than the step.
    """
    if len(one.contacts) != len(two.contacts) or one.status != two.status:
        return dict.fromkeys((*quantities, MARGIN, *_rebounds(two)), 1.0)
    rigid = two.omega == 0.0  # a swinging body has much momentum, of which the striker's error is no share
    momentum = max(float(np.linalg.norm(p[rigid])) for p in (two.start_p, two.end_p))
    momentum = momentum or float(np.linalg.norm(two.start_p) or np.linalg.norm(two.end_p)) or 1.0
    speed = np.abs(one.end_p[one.omega == 0.0] - two.end_p[rigid])
    found = dict.fromkeys(quantities, ROUNDING)
    found["restitution"] = float(speed.max(initial=0.0)) / momentum
    if len(two.contacts):
        found |= distance(_totals(one), _totals(two))
    for name, band in quantities.items():
        if band is not None:
            found |= distance({name: _spectrum(one, band)}, {name: _spectrum(two, band)})
    error = {name: max(ROUNDING, found[name] / over[name in INSTANTS]) for name in quantities}
    before, after = _rebounds(one), _rebounds(two)
    return error | {MARGIN: abs(one.margin - two.margin)} | distance(before, after)


def _rebounds(history: History) -> dict[str, float | None]:
    """Restitution of every impact, in the order of `History.contacts`; None where there is none."""
    rows = history.contacts[:, 5:7].tolist()
    found = [left / met if met and left == left else None for met, left in rows]
    return {f"{REBOUND}{i}": each for i, each in enumerate(found)}


def _totals(history: History) -> dict[str, float]:
    """Impulse [N s], contact time [s] and peak force [N] of a run with impacts."""
    rows = history.contacts.tolist()
    return {
        "impulse": sum(row[3] for row in rows),
        "contact_time": sum(row[1] - row[0] for row in rows),
        "force": max(row[2] for row in rows),
    }


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


def largest(distances: Iterable[Distances]) -> Distances:
    """The largest distance in each quantity; none of no blows."""
    found: Distances = {}
    for each in distances:
        found |= {name: max(found.get(name, 0.0), value) for name, value in each.items()}
    return found


def added(one: Distances, two: Distances) -> Distances:
    """The sum of two distances in each quantity."""
    return one | {name: one.get(name, 0.0) + value for name, value in two.items()}


def scaled(distances: Distances, factor: float, parting: float = 1.0) -> Distances:
    """Distances times a factor; those in the restitutions of impacts times another."""
    return {name: (parting if name.startswith(REBOUND) else factor) * x for name, x in distances.items()}


def judged(name: str) -> bool:
    """Whether a distance is one in a quantity that a tolerance is about."""
    return name != MARGIN and not name.startswith(REBOUND)


def worst(distances: Mapping[str, float]) -> float:
    """The largest distance in any quantity [-]."""
    return max((value for name, value in distances.items() if judged(name)), default=0.0)
