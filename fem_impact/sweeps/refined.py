"""Maps computed only where the answer changes; the other cells are interpolated between those computed."""

from collections.abc import Callable
from typing import Any

import numpy as np

from .batches import allowed_error
from .store import Texts

LINEAR = ("restitution",)  # layers whose errors are absolute; those of the others are relative
ROUGH = {"centroid": 0.1}  # [-] weight of what is missed: its lobes change it by 1e-3, which no picture shows
COUNTED = ("n_impacts", "margin", "error", "truncation")  # layers that are not interpolated

Compute = Callable[[np.ndarray, str], tuple[np.ndarray, Texts]]  # cells, name of the round: numbers, error texts
Report = Callable[[int], Any]  # takes the number of cells that are settled


def with_middles(along: np.ndarray) -> np.ndarray:
    """Nodes (n_blocks, 2, 3) along both axes of rectangles of cells, from their first and last (n_blocks, 2, 2).

    Each has 3 x 3 nodes: corners, the middles of sides and its own; two are the same in a block of two cells.
    """
    first, last = along[..., 0], along[..., 1]
    return np.stack([first, (first + last) // 2, last], axis=-1)


def cells_of(blocks: np.ndarray, width: int) -> np.ndarray:
    """Numbers (n_blocks, 3, 3) of the nodes of blocks (n_blocks, 2, 3) on a map that is ``width`` cells wide."""
    return blocks[:, 0, :, None] * width + blocks[:, 1, None, :]


def quarters_of(blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The quarters of all blocks (n_blocks, 2, 3), and the block (n_quarters,) that each is of."""
    halves = blocks[..., :2], blocks[..., 1:]
    parts = [np.stack([one[:, 0], two[:, 1]], axis=1) for one in halves for two in halves]
    along, of = np.concatenate(parts), np.tile(np.arange(len(blocks)), 4)
    wide = (along[:, :, 1] > along[:, :, 0]).all(axis=1)
    return with_middles(along[wide]), of[wide]


def first_blocks(shape: tuple[int, ...]) -> np.ndarray:
    """Blocks of about 16 cells a side that cover a map; islands narrower than a quarter of that can be missed."""
    ends = [np.unique(np.round(np.linspace(0, n - 1, max(1, round((n - 1) / 16)) + 1)).astype(int)) for n in shape]
    rows, columns = (np.column_stack([places[:-1], places[1:]]) for places in ends)
    i, j = (index.ravel() for index in np.indices((len(rows), len(columns))))
    return with_middles(np.stack([rows[i], columns[j]], axis=1))


def widest_gap(shape: tuple[int, ...]) -> float:
    """Largest distance [-] between neighbouring cells that are computed in any case, as a share of the axis."""
    gaps = np.diff(quarters_of(first_blocks(shape))[0]).max(axis=(0, 2))
    return float(np.max(gaps / (np.array(shape) - 1)))


def weights(nodes: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Weights (n, n_places, 3) of the values at nodes (n, 3) in the parabola through them, at places (n, n_places).

    Of a block of two cells, which has two different nodes only, weights of the line through them.
    """
    a, m, b = (node[:, None].astype(float) for node in nodes.T)
    narrow = m == a
    m = np.where(narrow, a + 0.5 * (b - a), m)
    parabola = [
        (places - m) * (places - b) / ((a - m) * (a - b)),
        (places - a) * (places - b) / ((m - a) * (m - b)),
        (places - a) * (places - m) / ((b - a) * (b - m)),
    ]
    share = (places - a) / (b - a)
    line = [1.0 - share, 0.0 * share, share]
    return np.stack([np.where(narrow, one, two) for one, two in zip(line, parabola)], axis=-1)


def beside_change(count: np.ndarray) -> np.ndarray:
    """Cells, in the shape of a map, beside one with another number along any axis."""
    found = np.zeros(count.shape, bool)
    for axis in range(count.ndim):
        mine, its = np.moveaxis(found, axis, 0), np.moveaxis(count, axis, 0)  # views
        change = its[:-1] != its[1:]
        mine[:-1] |= change
        mine[1:] |= change
    return found


class MapSheet:
    """The numbers of all cells of a map as far as they are known; its layers are as of `cases.LAYERS`."""

    def __init__(self, shape: tuple[int, int], layers: list[str]) -> None:
        self.width = shape[1]
        self.numbers = np.full((len(layers), shape[0] * shape[1]), np.nan)
        self.texts: Texts = {}  # failed cell: error text
        self.computed = np.zeros(shape[0] * shape[1], bool)
        self.settled = np.zeros(shape[0] * shape[1], bool)  # computed or interpolated
        self.count, self.margin, self.error, self.truncation = (layers.index(name) for name in COUNTED)
        self.smooth = np.array([i for i, name in enumerate(layers) if name not in COUNTED])
        self.weight = np.array([ROUGH.get(layers[i], 1.0) for i in self.smooth])
        self.relative = np.array([layers[i] not in LINEAR for i in self.smooth])

    def add(self, cells: np.ndarray, compute: Compute, turn: str) -> None:
        """Compute those of some cells that are not."""
        cells = np.unique(cells[~self.computed[cells]])
        if len(cells):
            self.numbers[:, cells], new = compute(cells, turn)
            self.texts |= {int(cells[i]): text for i, text in new.items()}
            self.computed[cells] = self.settled[cells] = True

    def smooth_values(self, cells: np.ndarray) -> np.ndarray:
        """What is interpolated of cells, (n_smooth, *cells.shape): logarithms of numbers with a relative error."""
        found = self.numbers[self.smooth][:, cells]
        with np.errstate(invalid="ignore", divide="ignore"):
            found[self.relative] = np.log(found[self.relative])
        return found

    def missed(self, blocks: np.ndarray, quarters: np.ndarray, of: np.ndarray) -> np.ndarray:
        """Largest error [-] of the parabolas of blocks at the nodes of their quarters, (n_quarters,).

        Infinite where a blow failed or the number of impacts differs.
        """
        coarse, fine = cells_of(blocks, self.width), cells_of(quarters, self.width)
        rows, columns = (weights(blocks[of, axis], quarters[:, axis]) for axis in (0, 1))
        expected = np.einsum("nip,njq,lnpq->lnij", rows, columns, self.smooth_values(coarse)[:, of])
        off = (self.weight[:, None] * np.abs(expected - self.smooth_values(fine)).max(axis=(2, 3))).max(axis=0)
        count = self.numbers[self.count]
        same = (count[fine] == count[coarse][of][:, :1, :1]).all(axis=(1, 2))
        return np.where(same & ~np.isnan(off), off, np.inf)

    def fill(self, blocks: np.ndarray, off: np.ndarray) -> None:
        """Interpolate the cells of blocks whose error (n_blocks,) [-] is known, between their nodes."""
        size = blocks[:, :, 2] - blocks[:, :, 0]
        for height, width in np.unique(size, axis=0):
            some = np.flatnonzero((size == (height, width)).all(axis=1))
            nodes = cells_of(blocks[some], self.width)
            places = [np.arange(n + 1) for n in (height, width)]
            first = nodes[:, 0, 0]
            cells = first[:, None, None] + (places[0][:, None] * self.width + places[1])
            rows, columns = (
                weights(np.array([[0, n // 2, n]]), place[None])[0] for n, place in zip((height, width), places)
            )
            found = np.einsum("ip,jq,lnpq->lnij", rows, columns, self.smooth_values(nodes))
            found[self.relative] = np.exp(found[self.relative])
            error = self.numbers[self.error][nodes].max(axis=(1, 2)) + off[some]
            new = ~self.computed[cells]
            self.numbers[self.smooth[:, None], cells[new]] = found[:, new]
            margin = self.numbers[self.margin][nodes].min(axis=(1, 2))
            truncation = self.numbers[self.truncation][nodes].max(axis=(1, 2))
            count = self.numbers[self.count][first]
            layers = self.error, self.margin, self.truncation, self.count
            for layer, value in zip(layers, (error, margin, truncation, count)):
                self.numbers[layer, cells[new]] = np.broadcast_to(value[:, None, None], cells.shape)[new]
            self.settled[cells] = True


def refine(
    shape: tuple[int, int], layers: list[str], tolerance: float, compute: Compute, report: Report | None = None
) -> MapSheet:
    """Compute a map (n, n) where its answer changes, and interpolate elsewhere to within the tolerance of each cell.

    ``layers`` as of `cases.LAYERS`; ``compute`` computes cells, numbered with the last axis fastest, and takes a name
    for the round, after which ``report`` receives how many cells are computed or interpolated so far.

    Each block of cells has parabolas through its 3 x 3 nodes. Its quarters are computed at theirs; where these differ
    from the parabolas by more than the time steps leave of the tolerance, have another number of impacts or failed, the
    quarters become blocks. Otherwise the parabolas of the quarters fill them. The whole difference is added to the
    layer ``error``: the parabolas of the quarters err by an eighth of it where the answer is smooth, by about all of it
    beside a kink. Last, borders between numbers of impacts are followed until no interpolated cell is beside another
    number.
    """
    sheet = MapSheet(shape, layers)
    blocks, turn = first_blocks(shape), 0
    sheet.add(cells_of(blocks, shape[1]), compute, "round-0")
    while len(blocks):
        turn += 1
        quarters, of = quarters_of(blocks)
        sheet.add(cells_of(quarters, shape[1]), compute, f"round-{turn}")
        off = sheet.missed(blocks, quarters, of)
        spent = sheet.numbers[sheet.error][cells_of(quarters, shape[1])].max(axis=(1, 2))
        spent = np.fmax(allowed_error(tolerance), np.where(spent > tolerance, 0.0, spent))  # no more cells help those
        split = np.bincount(of, off > tolerance - spent, len(blocks)) > 0.0
        sheet.fill(quarters[~split[of]], off[~split[of]])
        blocks = quarters[split[of]]
        blocks = blocks[(blocks[:, :, 2] - blocks[:, :, 0] > 1).any(axis=1)]
        if report is not None:
            report(int(sheet.settled.sum()))
    while True:
        beside = beside_change(np.nan_to_num(sheet.numbers[sheet.count], nan=-1.0).reshape(shape))
        left = np.flatnonzero(beside.ravel() & ~sheet.computed)
        if not len(left):
            return sheet
        turn += 1
        sheet.add(left, compute, f"round-{turn}")
