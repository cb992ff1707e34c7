"""Which hammer and tip of the catalogue suit a panel: one printable sheet for each point."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check
from .._base.explained import lines_of_notes
from ..show import plots
from ..show.figures import in_hertz
from ..sweeps.hammers import catalogue
from ..taps.roving import DOUBLE, UNKNOWN, WORKS, Roving
from .html_page import picture_uri, write_page


def tip_verdict(plan: Roving, i: int, j: int) -> str:
    """What one hammer and tip do at one point."""
    if plan.n_impacts[i, j] == 0:
        return UNKNOWN
    if plan.n_impacts[i, j] > 1:
        return DOUBLE
    return WORKS if plan.works[i, j] else f"too soft for {in_hertz(plan.bandwidth, 3)}"


def overload(plan: Roving, i: int, j: int) -> float | None:
    """Speed [m/s] from which the force is beyond the range of a hammer of the catalogue; None: neither is known."""
    force = catalogue[plan.hammers[j]].force if plan.hammers[j] in catalogue else None
    peak = None if plan.peaks is None else float(plan.peaks[i, j])
    return None if force is None or peak is None or not peak > 0.0 else force / peak


def order_of_blows(plan: Roving, i: int) -> np.ndarray:
    """The blows at one point: those that work by their coherence, then single hits by reach, then the others."""
    works, single = plan.works[i], plan.n_impacts[i] == 1
    value = np.nan_to_num(np.where(works, plan.coherence[i], plan.reach[i] / plan.bandwidth - 1.0))
    return np.lexsort((-value, np.where(works, 0, np.where(single, 1, 2))))


def _sheet(plan: Roving, i: int) -> dict[str, Any]:
    """One point: what to take, the table and the picture."""
    place = f"({', '.join(f'{x:.4g}' for x in plan.points[i])}) m"
    best, rows = int(plan.best[i]), []
    for j in order_of_blows(plan, i)[:18]:  # more do not fit a page
        limit, sure = overload(plan, i, j), plan.coherence[i, j]
        rows.append((
            plan.hammers[j], plan.tips[j], f"{1e3 * plan.masses[j]:.4g} g",
            "" if np.isnan(plan.reach[i, j]) else in_hertz(float(plan.reach[i, j]), 3),
            "" if np.isnan(sure) else f"{sure:.3f}", "" if limit is None else f"{limit:.2g} m/s",
            tip_verdict(plan, i, j),
        ))  # fmt: skip
    words = []
    if best >= 0:
        take = f"Take {plan.hammers[best]} with its {plan.tips[best]} tip"
        limit = overload(plan, i, best)
        reach, sure = in_hertz(float(plan.reach[i, best]), 3), plan.coherence[i, best]
        words.append(f"It hits once, reaches {reach} at {plan.drop:g} dB down; expected mean coherence {sure:.3f}.")
        words += [f"Its range is exceeded above {limit:.2g} m/s."] if limit is not None else []
    else:
        take = f"None of these: {plan.verdicts[i]}"
    double = sum(plan.n_impacts[i] > 1)
    words.append(f"{int(plan.works[i].sum())} of {len(plan.tips)} pairs of hammer and tip work; {double} hit twice.")
    words.append(f"Records of {plan.duration:.3g} s resolve {plan.resolution:.3g} Hz.")
    figure = plots.places(plan.modes, {"struck here": plan.points[i : i + 1]}, {}, plan.sensor, place)
    return {"at": place, "take": take, "words": words, "rows": rows, "picture": picture_uri(figure)}


@check.typed
def write_sheets(path: str | Path, plan: Roving, *, title: str, notes: tuple[str, ...] = ()) -> None:
    """Write the sheets of a plan; needs the extra ``web``. Printed, each point has a page of its own."""
    tiles: Mapping[str, str] = {
        "bandwidth": in_hertz(plan.bandwidth, 3), "drop": f"{plan.drop:g} dB", "points": str(len(plan.points)),
        "points that work": str(sum(each >= 0 for each in plan.best)), "pairs tried": str(len(plan.tips)),
    }  # fmt: skip
    write_page(
        path, "sheet.html", title=title, notes=lines_of_notes((*notes, *plan.notes)), tiles=list(tiles.items()),
        sheets=[_sheet(plan, i) for i in range(len(plan.points))],
    )  # fmt: skip
