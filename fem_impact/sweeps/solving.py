"""How blows are computed: in blocks, by threads or a cluster, together where the engine of maps can, or one by one."""

import logging
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np

from .._base.check import SimulationError
from ..impact.collision import strike
from ..impact.response import Response
from ..model.audit import audited
from ..modes.modal import Modes
from .cells import Case
from .store import LARGEST_BLOCK, Texts, Watch, block_size, by_cluster, by_store

LOG = logging.getLogger(__name__)
LAYERS: dict[str, tuple[str, str]] = {  # name: unit, what it is
    "n_impacts": ("", "number of separate contacts"),
    "contact_time": ("s", "total contact time"),
    "restitution": ("", "minus the speed after the blow over the speed before, at the contact point; NaN in contact"),
    "impulse": ("N s", "total impulse of the contact force"),
    "peak_force": ("N", "largest contact force"),
    "error": ("", "estimated time-step error: absolute for restitution, relative for the others"),
    "centroid": ("Hz", "mean frequency, weighted by the magnitude of the force spectrum"),
}


def solve_all(
    grid: Any, solve: Callable[..., Any], workers: int | None, client: Any, store: Any, watch: Watch | None
) -> tuple[np.ndarray, Texts]:
    """Compute all cells of a grid or a cloud, block by block, on a cluster or in threads of this process."""
    LOG.info("%d blows at the tolerance %g", grid.n_cases, grid.tolerance)
    if client is not None:
        return by_cluster(grid, client, store, partial(solve, workers=1), watch)
    if store is not None:
        return by_store(grid, store, partial(solve, workers=workers), watch)
    numbers = np.empty((len(grid.layers), grid.n_cases))
    texts: Texts = {}
    size = block_size(grid.n_cases) if grid.lossy or grid.extra else LARGEST_BLOCK  # slow cells are counted more often
    for start in range(0, grid.n_cases, size):
        stop = min(start + size, grid.n_cases)
        numbers[:, start:stop], new = solve(grid, start, stop, workers=workers)
        texts |= new
        if watch is not None:
            watch(stop, grid.n_cases)
    return numbers, texts


def together(column: Mapping[str, np.ndarray]) -> np.ndarray:
    """Which blows (n_cells,) can be followed together, by their parameters, (n_cells,) each."""
    quick = (column["exponent"] >= 1.0) & (column["gap"] >= 0.0)
    for name in ("hard_stiffness", "yield_approach", "hysteresis"):
        quick &= column[name] == 0.0
    return quick


def alone(grid: Any, start: int, cells: np.ndarray, numbers: np.ndarray, workers: int | None) -> Texts:
    """Strike cells of a block one by one; fill ``numbers`` (n_layers, n_cells) and return the error texts."""
    texts = {}
    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        rows = [pool.submit(_row, grid, start + int(i)) for i in cells]
        try:
            for i, row in zip(cells, rows):
                numbers[:, i], text = row.result()
                if text:
                    texts[start + int(i)] = text
        finally:
            pool.shutdown(cancel_futures=True)
    return texts


def struck_alone(grid: Any, case: Case) -> Response:
    """A blow of a grid or a cloud by the modal engine."""
    hit = strike(
        case.modes, case.striker, case.contact,
        at=case.at, speed=case.speed, tolerance=grid.tolerance, residual=grid.residual, max_impacts=grid.max_impacts,
    )  # fmt: skip
    return audited(hit)


def _row(grid: Any, index: int) -> tuple[np.ndarray, str]:
    """The layers of one cell from the modal engine, and its error text ('' if it succeeded)."""
    try:
        return numbers_of(grid.blow(index), grid.band, grid.extra), ""
    except SimulationError as error:
        return np.full(len(grid.layers), np.nan), str(error)


def numbers_of(
    hit: Response, band: float | None, extra: Mapping[str, Callable[[Response], float]] | None = None
) -> np.ndarray:
    """The layers (n_layers,) of one blow."""
    row = [hit.n_impacts, hit.contact_time, hit.restitution, hit.impulse, hit.peak_force, hit.error.step]
    row += [hit.spectral_centroid(band)] if band is not None else []
    return np.array(row + [function(hit) for function in (extra or {}).values()], float)


def plain(case: Case) -> dict[str, Any]:
    """A blow as plain numbers."""
    return {
        "target": _plain(case.modes, case.at),
        "striker": _plain(case.striker.modes, case.striker.at),
        "contact": dict(vars(case.contact)),
        "speed": case.speed,
    }


def _plain(modes: Modes, at: np.ndarray) -> dict[str, Any]:
    """A body and its contact point as plain numbers."""
    place = at[None]
    return {
        "mass": modes.mass,
        "frequencies": modes.frequencies.tolist(),
        "damping_ratios": modes.damping_ratio.tolist(),
        "at": at.tolist(),
        "shape": modes.shape_at(place)[0].tolist(),
        "residual_compliance": float(modes.residual_compliance(place)[0, 0]),
    }
