"""Find how singular a plate and its plane are at corners, and put triangles there that shrink geometrically."""

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .._base.rounding import HALVINGS, SAME
from ..mesh.meshes import Mesh
from .material import Material, rotated_stiffness
from .section import Plate
from .splitting import Rim, split_quadrilateral

# [-] size of each ring of triangles over that of the ring around it: 0.7 takes twice the rings, 0.35 slimmer cells
SHRINK = 0.5
# [rad] triangles at a singular corner are bisected until narrower: usual angles of 45 to 60 degrees are halved once
WIDE = 0.7
# [-] share of the energy that the innermost ring may miss; twice the frequency error, far below usual tolerances
CORNER_ERROR = 1e-7
SMALLEST = 1e-10  # [-] smallest ring as a fraction of the extent; rounding of the coordinates spoils smaller ones
# [-] the same at a free corner, which moves: rounding grows with the ring's size to the -2; and in the plane
SMALLEST_FREE = 3e-3
MILD = 2.95  # [-] corners with a larger exponent get no rings: there rings cost quintic triangles more than they gain
MILD_FREE = 2.5  # [-] the same between free edges, where the singular part is small, so that rings pay off later
# [-] roots mu that lie closer, over their imaginary part, are taken apart: those of an isotropic plate are equal, and
# exponents change by 1e-7
APART = 3e-4
# [-] corners are added to the estimate above this: rings leave 1e-7, or 6e-4 in a free corner of an L, 2e-3 at a slit
SAY = 1e-3


def _rows(kind: str, z: np.ndarray, angle: float, mu: np.ndarray, D: np.ndarray) -> list[np.ndarray]:
    """Two conditions (n, 4) of a straight edge at an angle, on the functions ``(x + mu y)**z`` at distance one."""
    c, s, way = np.cos(angle), np.sin(angle), 1j * np.sign(mu.imag)
    base = c + mu * s
    log = np.log(base * np.exp(-way * angle)) + way * angle  # continuous from edge to edge
    value = np.exp(z[:, None] * log)
    if kind == "clamped":
        return [value, value * (c * mu - s) / base]
    second = value / base**2  # over z (z - 1), as are the moments; the shear force is also over z - 2
    xx, yy, xy = D @ np.stack([np.ones(4), mu**2, 2.0 * mu])
    moment = second * (s * s * xx + c * c * yy - 2.0 * c * s * xy)
    if kind == "hinged":
        return [value, moment]
    twist = c * s * (yy - xx) + (c * c - s * s) * xy
    return [moment, second * (twist + (c * (xy + mu * yy) - s * (xx + mu * xy)) / base)]


def _determinant(z: np.ndarray, angle: float, kinds: tuple[str, str], mu: np.ndarray, D: np.ndarray) -> np.ndarray:
    matrix = np.stack(_rows(kinds[0], z, 0.0, mu, D) + _rows(kinds[1], z, angle, mu, D), axis=1)
    matrix = matrix / np.abs(matrix).max(axis=2, keepdims=True)
    return np.linalg.det(matrix) / ((z - 1.0) * (z - 2.0))  # the basis alone causes these two zeros


def _four_roots(equation: list[float]) -> np.ndarray:
    """The four numbers mu (4,) for which any function of x + mu y solves an equation without load."""
    upper = sorted(np.roots(equation), key=lambda root: root.imag)[2:]  # above the real axis, which rounding may hide
    one, other = (complex(root.real, max(root.imag, SAME)) for root in upper)
    if abs(one - other) < APART * one.imag:
        middle, half = 0.5 * (one + other), 0.5j * APART * one.imag
        one, other = middle + half, middle - half
    return np.array([one, other, np.conj(one), np.conj(other)])


def _secant(
    function: Callable[[np.ndarray], np.ndarray], z: np.ndarray, most: float, least: float
) -> tuple[np.ndarray, np.ndarray]:
    """Where secant steps end that start at points z (n,) all at once, with real parts within bounds, and one before."""
    before = z + 1e-3
    value_before = function(before)
    for _ in range(40):
        value = function(z)
        change = value - value_before
        step = np.where(change == 0.0, 0.0, value * (z - before) / np.where(change == 0.0, 1.0, change))
        step = step * np.minimum(1.0, 0.3 / np.maximum(np.abs(step), 1e-300))
        before, value_before, z = z, value, z - step
        z = np.clip(z.real, least + 1e-6, most) + 1j * np.clip(z.imag, -3.0, 3.0)
        z = np.where(np.abs(z - 2.0) < 1e-12, 2.0 + 1e-7, z)
    return z, before


@lru_cache(maxsize=256)
def exponent(angle: float, kinds: tuple[str, str], stiffness: tuple[float, ...]) -> float:
    """Smallest real part above 1 of the exponents z for which r**z solves the plate equation in a corner.

    Parameters
    ----------
    angle : float [rad], interior angle of the corner
    kinds : supports of the two edges: clamped, hinged or free
    stiffness : (9,), rows of the bending stiffness on curvatures (xx, yy, 2 xy), in any unit; x is along the first edge

    References
    ----------
    Williams (1952), Proc. 1st US National Congress of Applied Mechanics, 325-329; Lekhnitskii (1968), Anisotropic
    plates, ch. 9, for the roots mu.
    """
    D = np.reshape(stiffness, (3, 3))
    mu = _four_roots([D[1, 1], 4.0 * D[1, 2], 2.0 * D[0, 1] + 4.0 * D[2, 2], 4.0 * D[0, 2], D[0, 0]])
    real, imaginary = np.meshgrid(np.arange(1.02, MILD + 0.1, 0.06), [0.0, 0.15, 0.4, 0.8])
    z = (real + 1j * imaginary).ravel()
    z, before = _secant(lambda z: _determinant(z, angle, kinds, mu, D), z, MILD + 1.0, 1.0)
    settled = (np.abs(z - before) < 1e-9) & (z.real > 1.0 + 1e-4) & (np.abs(z - 2.0) > 1e-4) & (z.real < MILD)
    return float(z.real[settled].min()) if settled.any() else MILD


@lru_cache(maxsize=256)
def plane_exponent(angle: float, words: tuple[str, str], stiffness: tuple[float, ...]) -> float:
    """Smallest real part of the exponents z, 1 at most, for which displacements r**z in the plane rest in a corner.

    Parameters
    ----------
    angle, stiffness
        As of `exponent`, the stiffness that on strains xx, yy and 2 xy.
    words : how both edges are held in the plane, of `section.PLANE`

    References
    ----------
    Williams (1952), J. Appl. Mech. 19, 526-528; Lekhnitskii (1968), Anisotropic plates, ch. 2 and 3.
    """
    S = np.linalg.inv(np.reshape(stiffness, (3, 3)))
    mu = _four_roots([S[0, 0], -2.0 * S[0, 2], 2.0 * S[0, 1] + S[2, 2], -2.0 * S[1, 2], S[1, 1]])
    u, v = S[0, 0] * mu**2 + S[0, 1] - S[0, 2] * mu, S[0, 1] * mu + S[1, 1] / mu - S[1, 2]
    u, v = u / np.abs(S).max(), v / np.abs(S).max()

    def rows(word: str, z: np.ndarray, turn: float) -> list[np.ndarray]:
        c, s, way = np.cos(turn), np.sin(turn), 1j * np.sign(mu.imag)
        log = np.log((c + mu * s) * np.exp(-way * turn)) + way * turn  # continuous from edge to edge
        along, across = c * u + s * v, c * v - s * u  # the edge; then the forces on it
        pulled, pushed = c * mu - s, s * mu + c
        held = {"held": (along, across), "sliding": (along, pushed), "across": (pulled, across)}
        return [np.exp(z[:, None] * log) * part for part in held.get(word, (pulled, pushed))]

    def determinant(z: np.ndarray) -> np.ndarray:
        matrix = np.stack(rows(words[0], z, 0.0) + rows(words[1], z, angle), axis=1)
        return np.linalg.det(matrix / np.abs(matrix).max(axis=2, keepdims=True)) / z

    real, imaginary = np.meshgrid(np.arange(0.07, 1.1, 0.06), [0.0, 0.03, 0.15, 0.4])
    z, before = _secant(determinant, (real + 1j * imaginary).ravel(), 2.0, 0.0)
    settled = (np.abs(z - before) < 1e-9) & (z.real > 1e-2) & (z.real < 1.0 - 1e-4)
    return float(z.real[settled].min()) if settled.any() else 1.0


def number_of_rings(z: float, kinds: tuple[str, str], share: float = 1.0) -> int:
    """Number of rings of triangles needed at a corner of exponent z to miss less than CORNER_ERROR of the energy.

    ``share`` is the length of the facets there divided by the extent of the body.
    """
    if z >= (MILD_FREE if kinds == ("free", "free") else MILD - 1e-3):
        return 0
    wanted = np.log(CORNER_ERROR) / (2.0 * (z - 1.0) * np.log(SHRINK))
    smallest = SMALLEST_FREE if kinds == ("free", "free") else SMALLEST
    return max(0, int(np.ceil(min(wanted, np.log(smallest / share) / np.log(SHRINK)))))


def edge_meetings(mesh: Mesh, kinds: Sequence) -> list[tuple[int, int, int]]:
    """Vertices at which edges meet at an angle or supports (n_facets,) change, and the facets before and after each."""
    into: dict[int, int] = {}
    out_of: dict[int, int] = {}
    for facet, (a, b) in enumerate(mesh.facets.tolist()):
        out_of[a], into[b] = facet, facet
    pairs = ((vertex, into[vertex], facet) for vertex, facet in out_of.items())
    return [
        (vertex, before, facet)
        for vertex, before, facet in pairs
        if kinds[before] != kinds[facet] or mesh.tangents[before, 1] @ mesh.tangents[facet, 0] <= 1.0 - 1e-12
    ]


def _corners(
    mesh: Mesh, kinds: Sequence[str], stiffness: np.ndarray
) -> Iterator[tuple[int, float, tuple[float, tuple[str, str], tuple[float, ...]]]]:
    """Vertices of `edge_meetings`, the length of their facets over the body's, and the arguments of their exponents."""
    share = mesh.chords / float(np.ptp(mesh.points, axis=0).max())
    for vertex, before, facet in edge_meetings(mesh, kinds):
        (x, y), (u, v) = mesh.tangents[before, 1], mesh.tangents[facet, 0]
        angle = round(float(np.pi - np.arctan2(x * v - y * u, x * u + y * v)), 9)
        own = rotated_stiffness(stiffness / stiffness.max(), -np.arctan2(v, u))
        corner = angle, (kinds[facet], kinds[before]), tuple(own.ravel().round(9).tolist())
        yield vertex, float(share[[before, facet]].max()), corner


class Singular(NamedTuple):
    """A corner that gets rings of triangles."""

    power: float  # [-] of the distance, with which the energy around it grows
    n_rings: int  # [-]
    left: float  # [-] share of the energy that the innermost ring may miss, if the whole of it is the corner's
    free: bool  # whether it moves: both edges are free


def around_corners(mesh: Mesh, kinds: list[str], material: Material) -> tuple[dict[int, Singular], Mesh]:
    """Put rings of shrinking triangles at every corner that the supports ``kinds`` (n_facets,) make singular.

    Returns these corners and the mesh. The worst case is two hinged edges at nearly 180 degrees: at 172.5 degrees the
    exponent is 1.04, and rounding of the coordinates leaves an error of 13 % (9 % measured on a 48-sided polygon).
    """
    found: dict[int, Singular] = {}
    for vertex, share, corner in _corners(mesh, kinds, material.plane_stress):
        z, pair = exponent(*corner), corner[1]
        n = number_of_rings(z, pair, share)
        power = 2.0 * (z - 1.0)
        if n:
            found[vertex] = Singular(power, n, float((share * SHRINK**n) ** power), pair == ("free", "free"))
    return found, graded_towards(mesh, {vertex: each.n_rings for vertex, each in found.items()})


def around_plane_corners(mesh: Mesh, words: Sequence[str], plate: Plate, coarser: float) -> Mesh:
    """The mesh with rings of triangles at every corner that makes stresses in the plane singular.

    Facets are held in the plane as ``words`` (n_facets,) say. If layers couple bending and the plane, corners between
    edges held differently count, too. Little of the energy is singular, so that rings end at a size, times ``coarser``.
    """
    rings, coupled = {}, plate.coupled
    for vertex, share, corner in _corners(mesh, words, plate.stretched):
        smallest, (one, other) = SMALLEST_FREE * coarser / share, corner[1]
        if smallest < 1.0 and ((coupled and one != other) or plane_exponent(*corner) < 1.0):
            rings[vertex] = int(np.ceil(np.log(smallest) / np.log(SHRINK)))
    return graded_towards(mesh, rings)


def graded_towards(mesh: Mesh, wanted: dict[int, int]) -> Mesh:
    """The mesh with rings of triangles that shrink towards the ``wanted`` vertices (vertex -> number of rings)."""
    if not wanted:
        return mesh
    points, rim = list(mesh.points), Rim(mesh)
    corner = mesh.points[mesh.cells]
    clockwise = np.linalg.det(corner[:, 1:] - corner[:, :1]) < 0.0
    cells = np.where(clockwise[:, None], mesh.cells[:, ::-1], mesh.cells).tolist()  # anticlockwise
    # rings do not divide the angle at a corner any finer, so that wide triangles are bisected first; the result does
    # not depend on the order of the triangles
    for _ in range(HALVINGS):
        marked = sorted({side for cell in cells for side in _wide_sides(points, cell, set(wanted))})
        if not marked:
            break
        cells = rim.halve(marked, cells, points)
    touching: dict[int, list[int]] = {vertex: [] for vertex in wanted}
    for c, cell in enumerate(cells):
        for vertex in cell:
            if vertex in touching:
                touching[vertex].append(c)
    for vertex, n in wanted.items():
        for _ in range(n):
            nearer: dict[int, int] = {}
            for c in touching[vertex]:
                k = cells[c].index(vertex)
                a, b = cells[c][k - 2], cells[c][k - 1]  # anticlockwise after the corner
                for p in (a, b):
                    if p not in nearer:
                        nearer[p] = len(points)
                        points.append(rim.split(vertex, p, len(points), points, SHRINK))
                cells[c] = [vertex, nearer[a], nearer[b]]
                cells += split_quadrilateral(points, nearer[a], a, b, nearer[b])
    return rim.finish(mesh, np.array(points), np.array(cells))


def _wide_sides(points: list[np.ndarray], cell: list[int], corners: set[int]) -> list[tuple[int, int]]:
    """Sides of a triangle to bisect: any between two corners, and any opposite a wide angle at a corner."""
    sides = []
    for k in range(3):
        corner, a, b = cell[k], cell[k - 1], cell[k - 2]
        if corner not in corners:
            continue
        sides += [(min(corner, p), max(corner, p)) for p in (a, b) if p in corners]
        u, v = points[a] - points[corner], points[b] - points[corner]
        if np.arccos(np.clip(u @ v / np.linalg.norm(u) / np.linalg.norm(v), -1.0, 1.0)) > WIDE:
            sides.append((min(a, b), max(a, b)))
    return sides
