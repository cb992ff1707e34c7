"""Unknowns left by supports: every motion that meets them, and no other."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.fe.supports import SIDES, SupportedRim, cells_of_facets, constrain

X, Y = Polynomial([0.0, 1.0]), Polynomial([0.0, 1.0])
BUMP = X * (1.0 - X)  # of a unit square's side: zero at both ends
FLAT = BUMP**2  # and with a slope of zero
RISE = 1.0 + 0.7 * X - 0.4 * X**2


class Product:
    """w = f(x) g(y) with all derivatives to the second at points."""

    def __init__(self, f, g):
        self.f, self.g = f, g

    def jet(self, points):
        (x, y), f, g = points.T, self.f, self.g
        f0, f1, f2 = f(x), f.deriv(1)(x), f.deriv(2)(x)
        g0, g1, g2 = g(y), g.deriv(1)(y), g.deriv(2)(y)
        return np.stack([f0 * g0, f1 * g0, f0 * g1, f2 * g0, f1 * g1, f0 * g2])


class Radial:
    """w = h(x**2 + y**2), on a disk of unit radius."""

    def __init__(self, h):
        self.h = h

    def jet(self, points):
        (x, y), r2 = points.T, (points**2).sum(axis=1)
        h0, h1, h2 = self.h(r2), self.h.deriv(1)(r2), self.h.deriv(2)(r2)
        return np.stack([h0, 2 * x * h1, 2 * y * h1, 2 * h1 + 4 * x * x * h2, 4 * x * y * h2, 2 * h1 + 4 * y * y * h2])


def unknowns(mesh, supports):
    """The unknowns of a mesh by hand, six a vertex and one a side, under the supports; and what is to be known."""
    kinds = ["free"] * len(mesh.facets)
    for name, kind in supports.items():
        for facet in mesh.edges[name]:
            kinds[facet] = kind
    rim = SupportedRim(mesh.facets, mesh.tangents, mesh.curvatures, mesh.points, kinds, np.zeros((len(mesh.facets), 2)))
    pairs = np.sort(np.stack([mesh.cells[:, side] for side in SIDES], axis=1), axis=2)
    sides, number = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    n_vertices = len(mesh.points)
    dofs = np.empty((21, len(mesh.cells)), int)
    for k in range(3):
        dofs[6 * k : 6 * k + 6] = 6 * mesh.cells[:, k] + np.arange(6)[:, None]
    dofs[18:] = 6 * n_vertices + number.reshape(-1, 3).T
    return rim, constrain(rim, mesh.cells, dofs, 6 * n_vertices + len(sides))


def left_out(mesh, supports, motion):
    """Largest part of a motion's values, slopes and curvatures at vertices that the supports do not allow."""
    _, (expand, project, dofs) = unknowns(mesh, supports)
    values, known = np.zeros(expand.shape[0]), np.zeros(expand.shape[0], bool)
    jet = motion.jet(mesh.points)
    for k in range(3):
        values[dofs[6 * k : 6 * k + 6]] = jet[:, mesh.cells[:, k]]
        known[dofs[6 * k : 6 * k + 6]] = True
    return np.abs(expand @ (project @ values) - values)[known].max()


SQUARE = fi.mesh.rectangle(1.0, 1.0, size=0.5)
DISK = fi.mesh.disk(1.0, size=0.5)
ALLOWED = {
    "clamped square": (SQUARE, {"boundary": "clamped"}, Product(FLAT, FLAT * RISE)),
    "hinged square": (SQUARE, {"boundary": "hinged"}, Product(BUMP, BUMP * RISE)),
    "free square": (SQUARE, {}, Product(RISE, RISE)),
    "clamped and free": (SQUARE, {"left": "clamped"}, Product(X**2 * RISE, RISE)),
    "hinged beside clamped": (SQUARE, {"left": "clamped", "bottom": "hinged"}, Product(X**2 * RISE, Y * RISE)),
    "hinged opposite free": (SQUARE, {"bottom": "hinged"}, Product(RISE, Y * RISE)),
    "clamped disk": (DISK, {"boundary": "clamped"}, Radial((1.0 - X) ** 2 * RISE)),
    "hinged disk": (DISK, {"boundary": "hinged"}, Radial((1.0 - X) * RISE)),  # curved: w_tt = w_n / radius
}
FORBIDDEN = {
    "deflects on a hinge": (SQUARE, {"bottom": "hinged"}, Product(RISE, RISE)),
    "slopes at a clamp": (SQUARE, {"bottom": "clamped"}, Product(RISE, Y * RISE)),
    "slopes at a round clamp": (DISK, {"boundary": "clamped"}, Radial((1.0 - X) * RISE)),
    "slopes along a hinge": (SQUARE, {"boundary": "hinged"}, Product(BUMP, RISE)),
}


@pytest.mark.parametrize("name", ALLOWED)
def test_every_motion_that_meets_the_supports_is_kept(name):
    assert left_out(*ALLOWED[name]) < 1e-12  # values of one


@pytest.mark.parametrize("name", FORBIDDEN)
def test_no_other_motion_is(name):
    assert left_out(*FORBIDDEN[name]) > 0.1


@pytest.mark.parametrize("supports", [{}, {"boundary": "hinged"}, {"left": "clamped", "top": "hinged"}], ids=str)
@pytest.mark.parametrize("mesh", [SQUARE, DISK], ids=["square", "disk"])
def test_the_left_inverse_is_one(mesh, supports):
    supports = {name: kind for name, kind in supports.items() if name in mesh.edges}
    _, (expand, project, _) = unknowns(mesh, supports)
    assert_allclose((project @ expand).toarray(), np.eye(expand.shape[1]), atol=1e-12)


def test_number_of_unknowns_left_on_smooth_edges():
    """Of six at a vertex a round hinge leaves w_n, w_nn and w_nt; a clamp w_nn, and takes the slopes across its sides.

    On a straight edge as on a round one; a free edge leaves all.
    """
    n_all = 6 * len(DISK.points) + len(
        np.unique(np.sort(DISK.cells[:, [[0, 1], [1, 2], [2, 0]]]).reshape(-1, 2), axis=0)
    )
    n = len(DISK.facets)
    for kind, fewer in (("free", 0), ("hinged", 3 * n), ("clamped", 5 * n + n)):
        _, (expand, _, _) = unknowns(DISK, {"boundary": kind})
        assert expand.shape[1] == n_all - fewer


def test_the_curvature_may_jump_at_a_corner_but_the_slope_may_not():
    """Two triangles at a free corner of a square: three shared, twice three own, less two ties on the side between."""
    mesh = SQUARE
    _, (expand, _, dofs) = unknowns(mesh, {})
    n_corner_cells = {
        corner: int((np.linalg.norm(mesh.points[mesh.cells] - corner, axis=2) < 1e-12).any(axis=1).sum())
        for corner in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    }
    plain = 6 * len(mesh.points) + int(dofs[18:].max() - 6 * len(mesh.points)) + 1
    jumps = sum((3 * n - 2 * (n - 1)) - 3 for n in n_corner_cells.values())
    assert expand.shape[1] == plain + jumps


def test_each_facet_finds_its_triangle_and_side():
    for mesh in (SQUARE, DISK):
        cell, side = cells_of_facets(mesh.facets, mesh.cells)
        found = mesh.cells[cell[:, None], np.array(SIDES)[side]]
        assert_allclose(np.sort(found, axis=1), np.sort(mesh.facets, axis=1), atol=0)
