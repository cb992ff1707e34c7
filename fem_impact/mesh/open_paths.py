"""Named open paths of a drawing, such as lines of ribs: separated from pieces of an outline, and flattened."""

import numpy as np
import shapely

from .._base.rounding import SAME
from .loops import Piece, divide, is_straight


def chains(pieces: list[Piece], span: float) -> list[list[int]]:
    """Numbers of pieces that follow each other under one name, from an open end or a branch to the next."""
    ends = np.array([piece.at(np.array([0.0, 1.0])) for piece in pieces]).reshape(-1, 2)
    places = shapely.points(ends)
    one, other = shapely.STRtree(places).query(places, "dwithin", SAME * span)
    place, before = np.arange(len(ends)), np.full(len(ends), -1)
    while not np.array_equal(place, before):  # ends at one place get the smallest of their numbers
        before = place.copy()
        np.minimum.at(place, one, place[other])
    node = place.reshape(-1, 2)
    at: dict[tuple[str, int], list[int]] = {}
    for i, piece in enumerate(pieces):
        for each in node[i].tolist():
            at.setdefault((piece.name, each), []).append(i)
    found: list[list[int]] = []
    free = set(range(len(pieces)))
    for (name, start), here in at.items():
        for i in here if len(here) != 2 else ():
            chain, where = [], start
            while i in free:
                free.remove(i)
                chain.append(i)
                where = int(node[i].sum()) - where
                onward = at[name, where]
                i = next((j for j in onward if j in free), i) if len(onward) == 2 else i
            found += [chain] if chain else []
    return found


def lines(pieces: list[Piece], span: float, close: float) -> list[list[int]]:
    """Those chains with a name that cannot belong to an outline: no other open one is near one of their ends."""
    open_ones = chains(pieces, span)
    ends = [flatten_chain([pieces[i] for i in chain], np.inf)[[0, -1]] for chain in open_ones]
    found: list[list[int]] = []
    left = list(range(len(open_ones)))
    while True:
        others = np.concatenate([ends[k] for k in left]) if left else np.zeros((0, 2))
        lone = [
            k for k in left
            if pieces[open_ones[k][0]].name
            and min(int((np.linalg.norm(others - end, axis=1) <= close).sum()) for end in ends[k]) == 1
        ]  # fmt: skip
        if not lone:
            return found
        found += [open_ones[k] for k in lone]
        left = [k for k in left if k not in lone]


def flatten_chain(chain: list[Piece], size: float) -> np.ndarray:
    """Points (n, 2) [m] along a chain; straight in between, at most ``size`` [m] where it is curved."""
    parts = [piece.at(np.array([0.0, 1.0]) if is_straight(piece) else divide(piece, size)) for piece in chain]
    path, rest = parts[0], parts[1:]
    if rest and min(np.linalg.norm(rest[0][[0, -1]] - path[-1], axis=1)) > min(
        np.linalg.norm(rest[0][[0, -1]] - path[0], axis=1)
    ):
        path = path[::-1]
    for part in rest:
        ahead = np.linalg.norm(part[0] - path[-1]) <= np.linalg.norm(part[-1] - path[-1])
        path = np.concatenate([path, part[1:] if ahead else part[-2::-1]])
    return path


def sag(piece: Piece, size: float) -> float:
    """Largest distance [m] of a piece from its straight parts."""
    if is_straight(piece):
        return 0.0
    t = divide(piece, size)
    beside = piece.at(0.5 * (t[1:] + t[:-1])) - 0.5 * (piece.at(t[1:]) + piece.at(t[:-1]))
    return float(np.linalg.norm(beside, axis=1).max())


def name_paths(found: list[tuple[str, np.ndarray]], taken: set[str]) -> dict[str, np.ndarray]:
    """Paths by name; where several have one name, or an edge has it, a number follows."""
    names = [name for name, _ in found]
    result: dict[str, np.ndarray] = {}
    for name, path in found:
        alone = names.count(name) == 1 and name not in taken
        number = next(i for i in range(len(found)) if f"{name}{i}" not in result)
        result[name if alone else f"{name}{number}"] = path
    return result
