"""Beam elements of high degree, placed so that the section is smooth within each of them.

A thousand modes would take thousands of cubic elements, and the rounding error of their stiffness, which grows with
the fourth power of their number, would spoil the lowest modes. One element of degree 32 resolves ten half waves to
rounding.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix
from skfem import ElementLineHermite, MeshLine

from .._base.remembered import gauss_rule
from .._base.rounding import EPSILON, HALVINGS, SAME
from .._base.untyped import Cells
from ..mesh.facets import powers
from .elements import numbering
from .section import Elastic
from .springs import edge_stiffness
from .theory import Domain, Frame, Held, Points, Subject, kept_unknowns, unknowns_of_cells

# [-] polynomial degree of the deflection within an element: errs by 1e-12 of a wave of 30 rad; few elements round less
DEGREE = 32
QUADRATURE = 3 * DEGREE // 2  # [-] Gauss points of an element; exact for two shapes and a section of degree 31
APART = 0.01  # [-] nodes closer than this fraction of the beam cause a rounding error of 1e-9 in the stiffness
# [-] degree of the polynomial that must fit the section within an element: well below the 31 that QUADRATURE bears
SMOOTH = 12


class _Hermite(ElementLineHermite):
    """scikit-fem's Hermite element with bubbles, used only to number the unknowns."""

    interior_dofs = DEGREE - 3


class HermiteSpace:
    """Shape functions of the elements of one line: deflection and slope at both ends, and bubbles in between.

    The bubbles are the modes of the element clamped at both ends, so they do not couple to each other.
    """

    element: type[Any] = _Hermite

    def __init__(self, mesh: Cells) -> None:
        ends = mesh.p[0, mesh.t]  # (2, n_cells)
        self.start, self.length = ends[0], ends[1] - ends[0]  # (n_cells,)
        self.origin = self.start[:, None]  # (n_cells, 1)
        # (n_cells, DEGREE - 3, DEGREE - 3) of Legendre's bubbles in each shape function
        self.bubbles = np.broadcast_to(np.eye(DEGREE - 3), (len(self.start), DEGREE - 3, DEGREE - 3))

    def decouple(self, K: np.ndarray, M: np.ndarray) -> None:
        """Turn the bubbles into modes of the clamped elements and update K and M (n_cells, n_local, n_local)."""
        # scaled to unit stiffness, because the low modes, which matter, then keep more digits than with unit mass
        back = np.linalg.inv(np.linalg.cholesky(K[:, 4:, 4:])).transpose(0, 2, 1)
        values, turn = np.linalg.eigh(back.transpose(0, 2, 1) @ M[:, 4:, 4:] @ back)
        self.bubbles = turn = back @ turn
        for matrix, diagonal in ((K, np.ones_like(values)), (M, values)):
            matrix[:, :4, 4:] = matrix[:, :4, 4:] @ turn
            matrix[:, 4:, :4] = matrix[:, :4, 4:].transpose(0, 2, 1)
            matrix[:, 4:, 4:] = diagonal[..., None] * np.eye(DEGREE - 3)

    def bending_functions(self, cells: np.ndarray, points: np.ndarray, orders: tuple[int, ...]) -> list[np.ndarray]:
        """Derivatives (n, n_q, DEGREE + 1) of order 0 to 2 of the shapes of cells (n,) at points (n, n_q, 1)."""
        h = self.length[cells][:, None]
        s = (points[..., 0] - self.start[cells][:, None]) / h
        cubic = np.array([[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]], float)
        legendre = np.polynomial.legendre.legvander(2.0 * s - 1.0, DEGREE + 1)  # (n, n_q, DEGREE + 2)
        j = np.arange(2, DEGREE - 1)
        norm = np.sqrt(j + 0.5)
        result = []
        for order in orders:
            ends = powers(s, 3, order) @ cubic.T
            ends[..., 1::2] *= h[..., None]
            bubbles = legendre[..., j]
            if order < 2:
                bubbles = (legendre[..., j + 1] - legendre[..., j - 1]) / (2 * j + 1)
            if order == 0:
                above = (legendre[..., j + 2] - legendre[..., j]) / (2 * j + 3)
                below = (legendre[..., j] - legendre[..., j - 2]) / (2 * j - 1)
                bubbles = (above - below) / (2 * j + 1)
            bubbles = (norm * bubbles * 2.0**order) @ self.bubbles[cells]
            whole = np.concatenate([ends, bubbles], axis=-1)
            result.append(whole / h[..., None] ** order)
        return result

    functions = bending_functions  # of the whole deflection, by all unknowns

    def numbering(self, mesh: Cells) -> tuple[np.ndarray, int]:
        """Numbers of the unknowns of each element (n_local, n_cells), and how many there are."""
        return numbering(mesh, self)

    def locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cell that holds each point (n, 1), or else the nearest one, and whether the point lies in it."""
        low = np.minimum(self.start, self.start + self.length)
        order = np.argsort(low)
        cell = order[np.clip(np.searchsorted(low[order], points[:, 0], side="right") - 1, 0, len(low) - 1)]
        s = (points[:, 0] - self.start[cell]) / self.length[cell]
        slack = SAME / np.abs(self.length[cell])
        return cell, (s >= -slack) & (s <= 1.0 + slack)

    def rigid_unknowns(self, element_dofs: np.ndarray, n_all: int) -> np.ndarray:
        """Unknowns (n_all, 2) of the deflections 1 and x, the rigid motions of a beam."""
        result = np.zeros((n_all, 2))
        for k in range(2):
            result[element_dofs[2 * k], 0] = 1.0
            result[element_dofs[2 * k], 1] = self.start + k * self.length
            result[element_dofs[2 * k + 1], 1] = 1.0
        return result


def nodes(points: np.ndarray, marked: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Ascending nodes of a beam: its ends, the places ``marked`` where the shear force jumps, and points of the mesh.

    Rounding in the stiffness of a short element spoils that of the others. So a mesh point close to a marked place is
    left out, and a marked place a tenth as close to an end or to another marked place gets no node: over such a short
    distance the jump matters little. Only near a held end are nodes allowed much closer.
    """
    points = np.sort(points)
    kept = [points[0], points[-1]]
    apart = min(APART * (points[-1] - points[0]), 0.5 * np.diff(points).min())
    for place in marked:
        off = np.abs(place - np.array(kept))
        if off.min() > (SAME if kept[off.argmin()] in held else 0.1 * apart):
            kept.append(place)
    between = points[np.abs(points[:, None] - kept).min(axis=1) > apart]
    return np.unique(np.append(kept, between))


def domain(make_space: Callable[[Cells], Any], body: Subject, names: tuple[str, ...]) -> Domain:
    """The elements of a beam in its frame, with shape functions and the section's fields ``names``."""
    mesh, section, bare = body.mesh, body.section, Frame.around(body.mesh)

    def fields(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        places = bare.to_metres(x)
        return section.stiffness(places), section.inertia(places)

    points, marked = (bare.local(each)[:, 0] for each in (mesh.points, body.marked))
    held = [kind in ("clamped", "hinged") for kind in body.held]
    line = divide_lines(fields, nodes(points, marked, points[mesh.facets[held, 0]]))
    space = make_space(line)
    x, dx = quadrature(space)
    return Domain.of(names, section, bare, line, space, Points(np.zeros((1, x.shape[1])), x[..., None], dx))


def support_ends(body: Subject, domain: Domain) -> Held:
    """The supports of both ends of a beam, on its deflection and its rotation by bending.

    A deflection by shear is zero at the left end, as only the sum of both counts, and takes all of it away from a held
    right end.
    """
    dofs, n_all = domain.space.numbering(domain.cells)
    shear = [] if len(dofs) == DEGREE + 1 else [int(dofs[DEGREE + 1, 0]), int(dofs[DEGREE + 2, -1])]
    fixed, tied, springs = np.zeros(n_all, bool), False, csc_matrix((n_all, n_all))
    fixed[shear[:1]] = True
    at_left = body.mesh.points[body.mesh.facets[:, 0], 0] <= body.mesh.points.min()
    for left, kind in zip(at_left.tolist(), body.held):
        bent, turned = (dofs[:2, 0] if left else dofs[2:4, -1]).tolist()
        more = [] if left else shear[1:]
        if isinstance(kind, Elastic):
            for along, stiffness in zip(([bent, *more], [turned]), edge_stiffness([kind], domain.frame)[0]):
                row = csc_matrix((np.ones(len(along)), ([0] * len(along), along)), shape=(1, n_all))
                springs = springs + stiffness * row.T @ row
        elif kind != "free":
            fixed[turned] |= kind == "clamped"
            fixed[more or bent] = True
            tied |= bool(more)
    expand, project = kept_unknowns(fixed)
    if tied:
        place = [shear[1]], [np.count_nonzero(~fixed[: dofs[2, -1]])]
        expand = (expand + csr_matrix(([-1.0], place), shape=expand.shape)).tocsr()
    return Held(expand, project, dofs, springs)


def quadrature(space: Any) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points of every element and their weights, both (n_cells, n_q)."""
    x, dx = gauss_rule(QUADRATURE)
    return space.start[:, None] + x * space.length[:, None], dx * space.length[:, None]


def divide_lines(fields: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], nodes: np.ndarray) -> Cells:
    """Line elements between nodes, with more nodes until a polynomial fits the section between any two neighbours.

    Steps and kinks of stiffness and inertia are found by halving every interval that no polynomial fits. An interval
    that still has a bad fit when it is as narrow as SAME contains a step or kink and gets a node, a step at its place.
    """
    span = nodes[-1] - nodes[0]
    breaks = _section_breaks(fields, nodes)
    breaks = breaks[np.abs(breaks[:, None] - nodes).min(axis=1, initial=np.inf) > 4.0 * SAME * span]
    every = np.sort(np.append(nodes, breaks))
    low, high, margin = every[:-1], every[1:], SAME * span  # skip the inexactly located kink at a node
    while low.size:
        # none is halved below a millionth of the beam: a jump is then pinned to that
        rough = (_section_misfit(fields, low + margin, high - margin, span) > SAME) & (high - low > 1e-6 * span)
        middle = 0.5 * (low + high)[rough]
        every = np.append(every, middle)
        low, high = np.append(low[rough], middle), np.append(middle, high[rough])
    return MeshLine(np.sort(every))


def _section_breaks(fields: Callable, nodes: np.ndarray) -> np.ndarray:
    """Places (n,) where the section jumps, to rounding, or kinks, to within SAME times the length of the beam."""
    span, low, high = nodes[-1] - nodes[0], nodes[:-1], nodes[1:]
    found: list[float] = []
    while low.size:
        # at a kink the misfit falls only in proportion to the interval; for a smooth section it falls much faster, to
        # rounding; neighbours look a little beyond their common end, so that a step there is within one of them
        over = 0.01 * SAME * span
        rough = _section_misfit(fields, low - over, high + over, span) > np.maximum(SAME * (high - low) / span, 1e-14)
        low, high = low[rough], high[rough]
        found += (0.5 * (low + high)[high - low < SAME * span]).tolist()
        low, high = low[high - low >= SAME * span], high[high - low >= SAME * span]
        if len(low) + len(found) > 2000:
            raise ValueError("section must have at most 2000 steps and kinks, got more; make it smoother")
        middle = 0.5 * (low + high)
        low, high = np.append(low, middle), np.append(middle, high)
    # a frequency moves with a step, which is halved to rounding; a kink, at which nothing jumps, ends anywhere so near:
    # that moves a frequency by the square of it
    low, high = (np.array(found) + off for off in (-SAME * span, SAME * span))
    before, after = (np.stack(fields(end)) for end in (low, high)) if found else (low, high)
    for _ in range(HALVINGS if found else 0):
        middle = 0.5 * (low + high)
        now = np.stack(fields(middle))
        beyond = (np.abs(now - before) > np.abs(now - after)).any(axis=0)
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    places = np.sort(0.5 * (low + high))
    return places[np.append(True, np.diff(places) > 4.0 * SAME * span)[: len(places)]]  # drop doubles


def _section_misfit(fields: Callable, low: np.ndarray, high: np.ndarray, span: float) -> np.ndarray:
    """Relative misfit (n,) of stiffness, its inverse and inertia to polynomials of degree SMOOTH, beyond rounding.

    With 4000 samples along the beam, saw cuts wider than pi / 2 / 4000 of it are found.
    """
    count = 2 * SMOOTH + 1 + int(4000 * (high - low).max() / span)
    node = np.cos(np.pi * np.arange(count) / (count - 1))  # Chebyshev, with both ends
    x = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * node
    stiffness, inertia = (field.reshape(x.shape) for field in fields(x.ravel()))
    vander = np.polynomial.chebyshev.chebvander(node, SMOOTH)
    every = np.stack([stiffness, 1.0 / stiffness, inertia])
    missed = np.abs(every - (every @ np.linalg.pinv(vander).T) @ vander.T).max(axis=2)
    rounded = 8.0 * EPSILON * span / (high - low) * np.ptp(every, axis=2)  # places are rounded, too
    return ((missed - rounded) / np.abs(every).max(axis=2)).max(axis=0)


def balanced_errors(
    system: Any, vectors: np.ndarray, loads: np.ndarray, forced: np.ndarray | None = None
) -> np.ndarray:
    """Errors (3, n) of the squared energy norm of solutions, from moments and shear forces in equilibrium.

    What balances a load is its double integral plus a linear moment, and its integral plus a constant. The least
    difference between what the solution has and any such bounds the error (Prager and Synge). Arguments are those of
    `residual.energy_errors`; a slender beam has no shear force of its own that could differ.
    """
    space, (x, dx) = system.space, quadrature(system.space)
    cells, at, bent = np.arange(len(x)), x[..., None], DEGREE + 1
    unknowns, pushed = (unknowns_of_cells(system, field) for field in (vectors, loads))
    fields = {name: system.frame.field(system.section, name, at)[..., None] for name in system.rules.fields}
    slope, curve = space.bending_functions(cells, at, (1, 2))
    push = -integral_along(space, fields["inertia"] * (space.functions(cells, at, (0,))[0] @ pushed))
    moment = -push
    if "rotary" in fields:
        moment = moment - fields["rotary"] * (slope @ pushed[:, :bent])
    moment = integral_along(space, moment)
    frame, hinges = system.frame, []  # places held at rest, by forces that are unknown
    forces = [] if forced is None else list(zip(frame.local(forced)[:, 0], np.eye(len(forced))))
    spring = -frame.mass * frame.rate**2
    for attached, unit, field in ((system.point_masses, frame.mass, loads), (system.point_supports, spring, vectors)):
        for point, size in attached:
            place = frame.local(point)[0]
            if np.isinf(size):
                hinges.append(place)
            else:
                forces.append((place, size / unit * np.asarray(system.interpolate(point[None]) @ field)[0]))
    for place, force in forces:
        moment, push = moment + (at - place).clip(0.0) * force, push - (at > place) * force
    one, beyond = np.ones_like(x), [(x - place).clip(0.0) for place in hinges]
    rows = [(fields["stiffness"], curve @ unknowns[:, :bent], moment, [-x, one, *beyond])]
    if "shear" in fields:
        levers = [one, 0.0 * one, *(-1.0 * (x > place) for place in hinges)]
        rows.append((fields["shear"], space.shears(cells, at, 1) @ unknowns[:, bent:], push, levers))
    missed, free = [], []
    for stiff, strain, carried, levers in rows:
        weight = np.sqrt(dx[..., None] / stiff)
        missed.append((weight * (stiff * strain - carried)).reshape(x.size, -1))
        free.append((weight * np.stack(levers, axis=-1)).reshape(x.size, -1))
    rest, constants = np.concatenate(missed), np.concatenate(free)
    rest -= constants @ np.linalg.lstsq(constants, rest, rcond=None)[0]
    return np.outer([1.0, 0.0, 0.0], (rest**2).sum(axis=0))


def integral_along(space: Any, values: np.ndarray) -> np.ndarray:
    """Integral from the left end of values (n_cells, n_q, n) at the Gauss points, at the same points."""
    each = np.einsum("eq,eqk->ek", quadrature(space)[1], values)
    before = np.concatenate([np.zeros_like(each[:1]), np.cumsum(each, axis=0)[:-1]])
    node, weight = np.polynomial.legendre.leggauss(QUADRATURE)
    legendre = np.polynomial.legendre.legvander(node, QUADRATURE)
    k = np.arange(QUADRATURE)
    parts = np.column_stack([node + 1.0, (legendre[:, 2:] - legendre[:, :-2]) / (2 * k[1:] + 1)])
    within = parts @ ((k[:, None] + 0.5) * legendre[:, :-1].T * weight)  # (n_q, n_q) of the polynomial from -1 on
    return before[:, None] + 0.5 * space.length[:, None, None] * (within @ values)
