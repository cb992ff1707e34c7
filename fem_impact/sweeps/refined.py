"""Maps computed only where the answer changes; the other cells are interpolated between those computed."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .batches import allowed
from .store import Texts

LINEAR = ("restitution",)  # layers whose errors are absolute; those of the others are relative
ROUGH = {"centroid": 0.1}  # [-] weight of what is missed: its lobes change it by 1e-3, which no picture shows
COUNTED = ("n_impacts", "error")  # layers that are not interpolated

Compute = Callable[[np.ndarray, str], tuple[np.ndarray, Texts]]  # cells, name of the round: numbers, error texts
Tell = Callable[[int], Any]  # takes the number of cells that are settled


@dataclass(frozen=True, eq=False)
class Blocks:
    """Rectangles of cells, each with 3 x 3 nodes: its corners, the middles of its sides and its own."""

    along: np.ndarray  # (n_blocks, 2, 2) first and last cell along both axes

    @property
    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Cells of the nodes along both axes, (n_blocks, 3) each; two are the same in a block of two cells."""
        first, last = self.along[:, :, 0], self.along[:, :, 1]
        three = np.stack([first, (first + last) // 2, last], axis=-1)
        return three[:, 0], three[:, 1]

    def cells(self, width: int) -> np.ndarray:
        """Numbers (n_blocks, 3, 3) of the nodes on a map that is ``width`` cells wide."""
        rows, columns = self.nodes
        return rows[:, :, None] * width + columns[:, None, :]

    def quarters(self) -> "tuple[Blocks, np.ndarray]":
        """The quarters of all blocks, and the block (n_quarters,) that each is of."""
        rows, columns = self.nodes
        parts = [np.stack([rows[:, i : i + 2], columns[:, j : j + 2]], axis=1) for i in (0, 1) for j in (0, 1)]
        along, of = np.concatenate(parts), np.tile(np.arange(len(rows)), 4)
        wide = (along[:, :, 1] > along[:, :, 0]).all(axis=1)
        return Blocks(along[wide]), of[wide]

    def some(self, chosen: np.ndarray) -> "Blocks":
        """The blocks of a mask or of numbers."""
        return Blocks(self.along[chosen])


def first_blocks(shape: tuple[int, ...]) -> Blocks:
    """Blocks of about 16 cells a side that cover a map; islands narrower than a quarter of that can be missed."""
    ends = [np.unique(np.round(np.linspace(0, n - 1, max(1, round((n - 1) / 16)) + 1)).astype(int)) for n in shape]
    rows, columns = (np.column_stack([places[:-1], places[1:]]) for places in ends)
    i, j = (index.ravel() for index in np.indices((len(rows), len(columns))))
    return Blocks(np.stack([rows[i], columns[j]], axis=1))


def widest_gap(shape: tuple[int, ...]) -> float:
    """Largest distance [-] between neighbouring cells that are computed in any case, as a share of the axis."""
    quarters, _ = first_blocks(shape).quarters()
    return max(float(np.diff(nodes, axis=1).max()) / (n - 1) for nodes, n in zip(quarters.nodes, shape))


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
    """Cells (n, n) beside one with another number, along rows or columns."""
    found = np.zeros(count.shape, bool)
    for axis in (0, 1):
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
        self.count, self.error = layers.index("n_impacts"), layers.index("error")
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

    def missed(self, blocks: Blocks, quarters: Blocks, of: np.ndarray) -> np.ndarray:
        """Largest error [-] of the parabolas of blocks at the nodes of their quarters, (n_quarters,).

        Infinite where a blow failed or the number of impacts differs.
        """
        coarse, fine = blocks.cells(self.width), quarters.cells(self.width)
        rows, columns = (weights(nodes[of], places) for nodes, places in zip(blocks.nodes, quarters.nodes))
        expected = np.einsum("nip,njq,lnpq->lnij", rows, columns, self.smooth_values(coarse)[:, of])
        off = (self.weight[:, None] * np.abs(expected - self.smooth_values(fine)).max(axis=(2, 3))).max(axis=0)
        count = self.numbers[self.count]
        same = (count[fine] == count[coarse][of][:, :1, :1]).all(axis=(1, 2))
        return np.where(same & ~np.isnan(off), off, np.inf)

    def fill(self, blocks: Blocks, off: np.ndarray) -> None:
        """Interpolate the cells of blocks whose error (n_blocks,) [-] is known, between their nodes."""
        size = blocks.along[:, :, 1] - blocks.along[:, :, 0]
        for height, width in np.unique(size, axis=0):
            some = np.flatnonzero((size == (height, width)).all(axis=1))
            nodes = blocks.some(some).cells(self.width)
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
            self.numbers[self.error, cells[new]] = np.broadcast_to(error[:, None, None], cells.shape)[new]
            count = self.numbers[self.count][first][:, None, None]
            self.numbers[self.count, cells[new]] = np.broadcast_to(count, cells.shape)[new]
            self.settled[cells] = True


def refine(
    shape: tuple[int, int], layers: list[str], tolerance: float, compute: Compute, tell: Tell | None = None
) -> MapSheet:
    """Compute a map (n, n) where its answer changes, and interpolate elsewhere to within the tolerance of each cell.

    ``layers`` as of `cases.LAYERS`; ``compute`` computes cells, numbered with the last axis fastest, and takes a name
    for the round, after which ``tell`` hears how many cells are computed or interpolated so far.

    Each block of cells has parabolas through its 3 x 3 nodes. Its quarters are computed at theirs; where these differ
    from the parabolas by more than the time steps leave of the tolerance, have another number of impacts or failed, the
    quarters become blocks. Otherwise the parabolas of the quarters fill them. The whole difference is added to the
    layer ``error``: the parabolas of the quarters err by an eighth of it where the answer is smooth, by about all of it
    beside a kink. Last, borders between numbers of impacts are followed until no interpolated cell is beside another
    number.
    """
    sheet = MapSheet(shape, layers)
    blocks, turn = first_blocks(shape), 0
    sheet.add(blocks.cells(shape[1]), compute, "round-0")
    while len(blocks.along):
        turn += 1
        quarters, of = blocks.quarters()
        sheet.add(quarters.cells(shape[1]), compute, f"round-{turn}")
        off = sheet.missed(blocks, quarters, of)
        spent = sheet.numbers[sheet.error][quarters.cells(shape[1])].max(axis=(1, 2))
        spent = np.fmax(allowed(tolerance), np.where(spent > tolerance, 0.0, spent))  # no more cells help those
        split = np.bincount(of, off > tolerance - spent, len(blocks.along)) > 0.0
        sheet.fill(quarters.some(~split[of]), off[~split[of]])
        blocks = quarters.some(split[of])
        blocks = blocks.some((blocks.along[:, :, 1] - blocks.along[:, :, 0] > 1).any(axis=1))
        if tell is not None:
            tell(int(sheet.settled.sum()))
    while True:
        beside = beside_change(np.nan_to_num(sheet.numbers[sheet.count], nan=-1.0).reshape(shape))
        left = np.flatnonzero(beside.ravel() & ~sheet.computed)
        if not len(left):
            return sheet
        turn += 1
        sheet.add(left, compute, f"round-{turn}")
