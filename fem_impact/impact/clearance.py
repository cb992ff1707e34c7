"""Whether a striker touches a body once: the smallest gap after its first impact, and what changes it.

The bodies fly on from the first release as if they could not touch again. How near they come, or how deep they would
overlap, is smooth in all numbers, while a count of impacts jumps.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from .._base.check import SimulationError
from ..fe.variation import SectionChange
from .compiled import record
from .engine import LOOKS
from .gradient import differences
from .history import History
from .parameters import Parameters
from .response import Response

FAR = 1.0  # [-] clearance of bodies that never approach again, and the largest stated


def nearest_clearance(hit: Response) -> tuple[float, float | None]:
    """Clearance [-] and when it is smallest [s]; None if it is larger than `FAR`.

    The clearance is the smallest gap after the first impact over the way that the striker goes in the time of that
    impact at the speed of its arrival; below zero the bodies would touch again, and below -1 its logarithm is given.
    """
    if hit.n_impacts != 1 or hit.history.status == record.HORIZON:
        raise SimulationError("no clearance: the blow must end with its first impact; give max_impacts = 1")
    history = hit.history
    duration = hit.impacts[0].duration
    scale = hit.speed * duration
    free = replace(history, start_q=history.end_q, start_p=history.end_p, steps=history.steps[:0])
    flexible = history.omega > 0.0
    slowest = history.omega[flexible].min() if flexible.any() else np.inf
    span = max(duration, min(float(history.bridged(FAR * scale)[0]), 1e3 * duration + 2.0 * np.pi / slowest))
    count = int(np.clip(LOOKS[0] * span / duration, *LOOKS))
    times = np.linspace(0.0, span, count + 1)
    d, v = _approach(free, times)
    turns = np.flatnonzero((v[:-1] > 0.0) & (v[1:] <= 0.0))
    if not len(turns):
        return FAR, None
    first = int(turns[np.argmax(np.maximum(d[turns], d[turns + 1]))])
    when = float(
        brentq(lambda time: _approach(free, np.array([time]))[1][0], times[first], times[first + 1], xtol=1e-12 * span)
    )
    gap = -float(_approach(free, np.array([when]))[0][0]) / scale
    if gap >= FAR:
        return FAR, None
    return (gap if gap > -1.0 else -1.0 - np.log(-gap)), history.end_time + when


def slopes(hit: Response, names: tuple[str, ...], sections: Mapping[str, tuple[float, SectionChange]]) -> np.ndarray:
    """Derivatives (n,) of the clearance in numbers of the blow."""
    if nearest_clearance(hit)[1] is None:
        return np.zeros(len(names))
    return differences(Parameters(hit, sections), names, lambda blow: [nearest_clearance(blow)[0]])[0][0]


def _approach(free: History, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Approach [m] and its rate [m/s] of free bodies at times, (n_times,) each."""
    q, p = free.states(times)
    return free.offset[0] + q @ free.shape[0], p @ free.shape[0]
