"""The distance between two blows: every error that the program states is one."""

from collections.abc import Mapping
from dataclasses import replace
from math import sqrt
from operator import mul, sub
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base.rounding import ROUNDING
from . import force_spectrum
from .history import History
from .quantities import BAND_POINTS, BANDED

if TYPE_CHECKING:
    from .compiled.bundles import KernelSystem
    from .engine import Pace
    from .response import Response

# quantities that depend on single instants, or on modes whose period is no longer than a step
INSTANTS = ("contact_time", "force", "sound")


def distance(one: Mapping[str, Any], two: Mapping[str, Any]) -> dict[str, Any]:
    """How far one blow is from another in every number of the other [-]; also of many blows, as arrays of equal shape.

    Absolute for the restitution, relative to the second for all others; 1 if only one of the blows has a restitution.
    Of a spectrum (n_frequencies,), named as its quantity, it is the largest difference over the second's largest value;
    of a sound, what modes ring with (n_modes,), that of the root of the energy.
    """
    found: dict[str, Any] = {}
    for name, value in two.items():
        other = one[name]
        if other is None or value is None:
            found[name] = float((other is None) != (value is None))
        elif name == "restitution":
            found[name] = abs(other - value)
        elif name in BANDED:
            order = 2 if name == "sound" else np.inf
            found[name] = float(np.linalg.norm(other - value, order) / (np.linalg.norm(value, order) or 1.0))
        elif isinstance(value, np.ndarray):
            found[name] = abs(other - value) / np.where(value == 0.0, 1.0, abs(value))
        else:
            found[name] = abs(other - value) / (abs(value) or 1.0)
    return found


def of_blows(one: "Response", two: "Response", quantities: Mapping[str, float | None]) -> dict[str, float]:
    """How far one blow is from another in each quantity."""
    found = distance(*({name: value_of(hit, name, band) for name, band in quantities.items()} for hit in (one, two)))
    if band := quantities.get("sound"):
        found["sound"] = of_sounds(one.history, two.history, two.body_slice(len(two.bodies) - 1), band)
    return found


def value_of(hit: "Response", name: str, band: float | None) -> Any:
    """A quantity of a blow; of one with a band [Hz] the spectrum at BAND_POINTS frequencies."""
    if band is not None:
        return hit.spectrum(np.linspace(0.0, band, BAND_POINTS))
    return getattr(hit, "peak_force" if name == "force" else name)


def of_sounds(one: History, two: History, struck: slice, band: float) -> float:
    """How far what the struck body's modes ring with after one run is from that after another [-].

    The modes are those of the second run up to the band [Hz], with what the forces of each make of them. Without any
    the sound counts by the spectrum of the force.
    """
    if not np.array_equal(one.omega, two.omega):
        bodies = "omega", "zeta", "shape", "bias", "start_q", "start_p", "stretched"
        one = replace(one, **{name: getattr(two, name) for name in bodies})
    rings, end = heard(two, struck, band), np.array([max(one.end_time, two.end_time)])
    if not len(rings):
        return distance(*({"spectrum": _spectrum(run, band)} for run in (one, two)))["spectrum"]
    states = [[state[0, rings] for state in run.states(end)] for run in (one, two)]
    return distance(*({"sound": p + 1j * two.omega[rings] * q} for q, p in states))["sound"]


def heard(system: "History | KernelSystem", struck: slice, band: float) -> np.ndarray:
    """Numbers of the struck body's modes that ring up to a frequency [Hz]."""
    omega, zeta = system.omega[struck], system.zeta[struck]
    rings = (omega > 0.0) & (omega <= 2.0 * np.pi * band) & (zeta < 1.0)
    return np.arange(len(system.omega))[struck][rings]


def of_whole_runs(one: History, two: History, pace: "Pace | None" = None) -> dict[str, float]:
    """How far one run is from another in quantities without a band [-], whatever impacts they had; see `of_runs`."""
    rigid, other = two.omega == 0.0, one.omega == 0.0
    if pace and pace.swings:  # other bodies that swing have much momentum, of which the striker's error is no share
        rigid, other = rigid | np.isin(two.omega, pace.swings), other | np.isin(one.omega, pace.swings)
    start, end, other_end = two.start_p[rigid], two.end_p[rigid], one.end_p[other]
    n_impacts = min(len(one.contacts), len(two.contacts))
    if not n_impacts:  # bodies that constant forces part: a run ends with its first step, however long that is
        other_end = other_end + (one.omega[other] == 0.0) * one.bias[other] * (two.end_time - one.end_time)
    momentum = sqrt(max(start.dot(start), end.dot(end)))
    momentum = momentum or sqrt(two.start_p.dot(two.start_p)) or sqrt(two.end_p.dot(two.end_p)) or 1.0
    # bodies that a force holds pressed rest but for the rounding of what it gave them
    given = sum(two.contacts[:, 3].tolist()) * np.abs(two.shape[:, rigid]).max(initial=0.0)
    speeds = np.maximum(np.abs(other_end - end) - ROUNDING * given, 0.0)
    own = sum(map(abs, map(mul, pace.rebound if pace else (), speeds.tolist())))
    found: dict[str, float] = {"restitution": max(max(speeds.tolist(), default=0.0) / momentum, own)}
    totals = []
    for start, end, peak, impulse, *_ in (one.contacts.T.tolist(), two.contacts.T.tolist()) if n_impacts else ():
        totals.append({"impulse": sum(impulse), "contact_time": sum(map(sub, end, start)), "force": max(peak)})
    return found | (distance(*totals) if n_impacts else {})


def of_runs(
    one: History, two: History, quantities: Mapping[str, float | None], over: tuple[float, float] = (1.0, 1.0),
    pace: "Pace | None" = None,
) -> np.ndarray:  # fmt: skip
    """How far one run is from another [-]: in each quantity asked for, in its margin and in each impact's restitution.

    (n_quantities + 1 + n_impacts,), impacts in the order of `History.contacts`. All are 1 if the runs ended
    differently. The restitution counts by the speed of every body that moves rigidly, over the momentum of all, and by
    that of the first alone; ``pace`` states which strikers in hands move so, too, and what the first rebounds with.
    ``over`` divides the distances in quantities that depend on the whole blow, and those in contact time and peak
    force, which depend on an instant; not those of impacts, as points part as fast as the bodies ring there, also in
    modes faster than the step.
    """
    if len(one.contacts) != len(two.contacts) or one.status != two.status:
        return np.ones(len(quantities) + 1 + len(two.contacts))
    found = of_whole_runs(one, two, pace)
    apart = []
    for name, band in quantities.items():
        if band is not None and name == "sound":
            found[name] = of_sounds(one, two, pace.struck if pace else slice(None), band)
        elif band is not None:
            found |= distance(*({name: _spectrum(run, band)} for run in (one, two)))
        apart.append(max(ROUNDING, found.get(name, ROUNDING) / over[name in INSTANTS]))
    apart.append(abs(one.margin - two.margin))
    for rebound, other in zip(one.contacts[:, 7].tolist(), two.contacts[:, 7].tolist()):
        none, no_other = rebound != rebound, other != other  # NaN: no restitution
        apart.append(float(none != no_other) if none or no_other else abs(rebound - other))
    return np.array(apart)


def _spectrum(history: History, band: float) -> np.ndarray:
    pieces = force_spectrum.straight_pieces(*history.samples(1.0))
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
