"""Bodies given by their matrices, whole or reduced, in arrays and files, answer a blow as their closed forms do."""

import functools

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.sparse import csc_array, save_npz
from test_body import STEEL, struck

import fem_impact as fi
from fem_impact.modes.free_body import motions
from fem_impact.modes.matrices import whole_matrix

pytestmark = pytest.mark.usefixtures("read_here")
LENGTH, WIDTH, HEIGHT, N = 0.4, 0.03, 0.01, 20  # m, m, m, elements
MASS = STEEL.rho * LENGTH * WIDTH * HEIGHT
KEPT = 0, 5, 20  # rows of nodes of the reduction; the middle one at a quarter


def bar():
    """Mass, stiffness and nodes of a free bar of Euler's elements in space, six unknowns a node."""
    area, step = WIDTH * HEIGHT, LENGTH / N
    across = WIDTH * HEIGHT**3 / 12.0, HEIGHT * WIDTH**3 / 12.0
    K, M = np.zeros((2, 6 * (N + 1), 6 * (N + 1)))
    polar, shear = sum(across), STEEL.E / 2.0 / (1.0 + STEEL.nu)
    hat, mass = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0 * STEEL.rho * step
    a = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / step**3
    b = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420.0 * step
    for i in range(0, 6 * N, 6):
        for way, stiff, heavy in ((0, STEEL.E * area, area), (3, shear * polar, polar)):
            at = np.ix_(*2 * [[i + way, i + way + 6]])
            K[at] += stiff / step * hat
            M[at] += heavy * mass
        for way, turn, sign, second in ((2, 4, -1.0, across[0]), (1, 5, 1.0, across[1])):
            at, scale = np.ix_(*2 * [[i + way, i + turn, i + way + 6, i + turn + 6]]), np.array([1.0, sign * step] * 2)
            K[at] += STEEL.E * second * a * np.outer(scale, scale)
            M[at] += STEEL.rho * area * b * np.outer(scale, scale)
    nodes = np.zeros((N + 1, 3))
    nodes[:, 0] = np.linspace(0.0, LENGTH, N + 1)
    return M, K, nodes


def reduced(n_modes=24):
    """The bar after Craig and Bampton: mass, stiffness, what all its unknowns do by those kept, and labels of these."""
    M, K, _ = bar()
    kept = np.concatenate([6 * i + np.arange(6) for i in KEPT])
    inner = np.setdiff1d(np.arange(len(K)), kept)
    shapes = np.zeros((len(K), len(kept) + n_modes))
    shapes[kept, np.arange(len(kept))] = 1.0
    shapes[inner, : len(kept)] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, kept)])
    shapes[inner, len(kept) :] = eigh(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)])[1][:, :n_modes]
    dofs = [(i + 1, way) for i in KEPT for way in range(1, 7)] + [(1001 + k, 0) for k in range(n_modes)]
    return shapes.T @ M @ shapes, shapes.T @ K @ shapes, shapes, np.array(dofs)


SECTION = fi.Beam.rectangular(STEEL, width=WIDTH, height=HEIGHT)
OWN = fi.analytic.beam(LENGTH, ends=("free", "free"), section=SECTION, n_modes=60)


@functools.cache
def truth():
    return struck(OWN, [0.1], fi.Contact.linear(1e6)).restitution


def assert_the_same_bar(body, rtol=1e-3):
    """The same free bar: mass, first five frequencies, static compliance with inertia relief, and blow at a quarter.

    Twenty elements err by 0.1 % in the fifth bending mode; a blow of 0.3 ms is not bent by more.
    """
    assert body.mass == pytest.approx(MASS, rel=1e-9)
    assert not body.frequencies[:6].any()
    modes, at = body.modes("z"), np.array([[0.1]])
    moving = np.abs(modes.shape_at(at)[0]) > 1e-6 * MASS**-0.5
    assert_allclose(modes.frequencies[moving & (modes.frequencies > 0.0)][:5], OWN.frequencies[2:7], rtol=rtol)
    assert_allclose(modes.shapes.compliance(at), OWN.shapes.compliance(at), rtol=rtol)
    found = struck(modes, [0.1], fi.Contact.linear(1e6))
    assert found.tolerance_met and "not stated" not in found.verdict
    assert found.restitution == pytest.approx(truth(), abs=1e-4)


def test_a_whole_bar_of_matrices_is_the_beam_of_closed_form():
    M, K, nodes = bar()
    assert_the_same_bar(fi.Body.from_matrices(csc_array(M), csc_array(K), nodes))


@pytest.mark.parametrize("recovered", [True, False])
def test_a_reduced_bar_is_the_same(recovered):
    """With all nodes recovered, and with those that are kept alone."""
    M, K, shapes, dofs = reduced()
    recovery = shapes.reshape(N + 1, 6, -1)[:, :3].reshape(3 * (N + 1), -1) if recovered else None
    body = fi.Body.from_matrices(M, K, bar()[2], dofs=dofs, recovery=recovery)
    assert len(body.nodes) == (N + 1 if recovered else 3) and len(body.loads) == 9
    assert_the_same_bar(body)
    if recovered:  # without labels nothing tells which nodes are kept: loads are named, rigid motions are found
        assert_the_same_bar(fi.Body.from_matrices(M, K, bar()[2], recovery=recovery, loads=[(6, (0.0, 0.0, 2.0))]))


def test_loads_along_axes_add_up_to_one_along_any_direction():
    M, K, nodes = bar()
    body, way = fi.Body.from_matrices(M, K, nodes), np.array([0.0, 0.6, 0.8])
    alone = fi.Body.from_matrices(M, K, nodes, loads=[(6, way)])
    at = np.array([[0.1]])
    assert_allclose(body.modes(way).shapes.compliance(at), alone.modes(way).shapes.compliance(at), rtol=1e-9)


def test_a_held_bar_lacks_the_mass_of_its_support():
    """Clamped at one end, its unknowns there left out: a cantilever, 3.516 / 2 pi L**2 sqrt(E I / rho A)."""
    M, K, nodes = bar()
    free = slice(6, None)
    dofs = [(i + 1, way) for i in range(1, N + 1) for way in range(1, 7)]
    with pytest.raises(ValueError, match=r"total_mass .* must be given in kg: the matrices of a body that is held"):
        fi.Body.from_matrices(M[free, free], K[free, free], nodes, dofs=dofs)
    body = fi.Body.from_matrices(M[free, free], K[free, free], nodes, dofs=dofs, total_mass=MASS)
    first = 3.516015 / (2.0 * np.pi * LENGTH**2) * HEIGHT * np.sqrt(STEEL.E / STEEL.rho / 12.0)
    assert body.frequencies[0] == pytest.approx(first, rel=1e-6)
    tip = body.modes("z").shapes.compliance(np.array([[LENGTH]]))[0, 0]
    assert tip == pytest.approx(LENGTH**3 / (3.0 * STEEL.E * WIDTH * HEIGHT**3 / 12.0), rel=1e-9)


def test_unknowns_without_mass_make_no_modes():
    """A spring without mass between two masses: one frequency, sqrt(k / 2 (1 / m1 + 1 / m2)) / 2 pi."""
    k, dofs = 1e4, [(1, 1), (2, 1), (3, 1)]
    K = k * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    nodes = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.2, 0.0, 0.0)]
    body = fi.Body.from_matrices(np.diag([0.1, 0.0, 0.3]), K, nodes, dofs=dofs, loads=[(2, (1.0, 0.0, 0.0))])
    frequency = np.sqrt(k / 2.0 * (1.0 / 0.1 + 1.0 / 0.3)) / (2.0 * np.pi)
    assert_allclose(body.frequencies, [0.0, frequency], rtol=1e-9)
    # inertia pulls a quarter to the lighter side; then without rigid motion, by mass
    moved = np.array([-0.25 / k, 0.0, -0.75 / k])
    assert_allclose(body.static[:, 0, 0], moved - (0.1 * moved[0] + 0.3 * moved[2]) / 0.4, rtol=1e-9)


DOFS, WHOLE = [(1, 1), (2, 1), (1, 2), (2, 2)], "dofs must be whole numbers, each node and direction from 1 to 6"


@pytest.mark.parametrize(("change", "said"), [
    ({"mass": np.eye(3)}, "mass must be as large as stiffness"),
    ({"mass": np.ones((2, 3))}, "mass must be a square matrix"),
    ({"mass": np.eye(4) * 1j}, "mass must be real; give damping as damping_ratio"),
    ({"stiffness": np.triu(np.ones((4, 4)))}, "stiffness must be symmetric, but entries across its diagonal"),
    ({"stiffness": np.diag([1.0, 1.0, 1.0, -1.0])}, "stiffness must be positive, mass not negative"),
    ({"dofs": None}, "dofs must be given, node and direction"),
    ({"dofs": [*DOFS[:3], (9, 2)]}, "dofs must be of the nodes given, got node 9"),
    ({"dofs": [*DOFS[:3], (1, 2)]}, WHOLE),
    ({"dofs": [*DOFS[:3], (2, 2.5)]}, WHOLE),
    ({"dofs": [(1, 7), (2, 7), (1, 8), (2, 8)]}, WHOLE),
    ({"stiffness": np.kron(np.eye(2), [[1.0, -1.0], [-1.0, 1.0]])},
     r"total_mass \(of files: mass\) must be that of the matrices, 2 kg, got 4 kg"),
    ({"recovery": np.ones((4, 4))}, r"recovery must be \(6, 4\)"),
    ({"loads": [(7, (1.0, 0.0, 0.0))]}, "loads must be on nodes that can move, got node 7"),
    ({"modes": 3}, "fields must be one of"),
])  # fmt: skip
def test_what_is_wrong_with_matrices_is_said(change, said):
    told = {"mass": np.eye(4), "stiffness": np.eye(4), "nodes": np.eye(2, 3), "total_mass": 4.0, "dofs": DOFS}
    with pytest.raises(ValueError, match=said):
        fi.Body.from_matrices(**told | change)


def test_sparse_matrices_of_scipy_and_matrix_market(tmp_path):
    from scipy.io import mmwrite

    M, K, shapes, dofs = reduced()
    save_npz(tmp_path / "mass.npz", csc_array(M))
    mmwrite(tmp_path / "K.mtx", csc_array(K), precision=17)
    recovery = shapes.reshape(N + 1, 6, -1)[:, :3].reshape(3 * (N + 1), -1)
    mmwrite(tmp_path / "recovery.mtx", csc_array(recovery), precision=17)
    files = [tmp_path / name for name in ("mass.npz", "K.mtx", "recovery.mtx")]
    assert_the_same_bar(fi.Body.load([*files, {"nodes": bar()[2], "dofs": dofs}]))
    with pytest.raises(ValueError, match="mass must be given as a matrix, too"):
        fi.Body.load([files[1], {"nodes": bar()[2], "dofs": dofs}])
    save_npz(tmp_path / "what.npz", csc_array(M))
    with pytest.raises(ValueError, match=r"what\.npz cannot be read .*name the matrix K..."):
        fi.Body.load(tmp_path / "what.npz")


def test_a_rigid_body_is_told_by_its_recovery():
    """Of unknowns that nothing resists: no stiffness tells a scale."""
    nodes = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    shapes = np.vstack([np.eye(3)] * 3)  # shifts
    body = fi.Body.from_matrices(2.0 * np.eye(3), np.zeros((3, 3)), nodes, recovery=shapes)
    assert body.frequencies.tolist() == [0.0, 0.0, 0.0] and body.mass == pytest.approx(2.0)


@pytest.mark.parametrize(("scale", "seed"), [(1e-12, 0), (1e-8, 1), (1e-5, 2)])
def test_rounding_of_modal_matrices_resists_no_rigid_motion(scale, seed):
    """Six rigid motions and twelve modes, whose stiffness is wrong by a part of the first, of either sign."""
    rng = np.random.default_rng(seed)
    nodes = rng.uniform(-1.0, 1.0, (12, 3)) * (0.3, 0.2, 0.05)
    rigid = motions(nodes - nodes.mean(axis=0), np.eye(3)).reshape(36, 6)
    recovery = np.linalg.qr(np.column_stack([rigid, rng.normal(size=(36, 12))]))[0] / np.sqrt(0.1)
    values = np.append(np.zeros(6), (2.0 * np.pi * np.linspace(100.0, 2000.0, 12)) ** 2)
    wrong = scale * values[6] * rng.normal(size=(18, 18))
    body = fi.Body.from_matrices(np.eye(18), np.diag(values) + 0.5 * (wrong + wrong.T), nodes, recovery=recovery)
    assert_allclose(body.frequencies, np.sqrt(values) / (2.0 * np.pi), rtol=10.0 * scale + 1e-12)
    assert body.mass == pytest.approx(0.1 * 12, rel=1e-3)


def test_soft_springs_are_no_rounding(tmp_path):
    """At a thousandth of the first frequency: one eigenvalue is a millionth of the next."""
    values = (2.0 * np.pi * np.array([0.1, 100.0, 300.0])) ** 2
    nodes, recovery = np.arange(3.0)[:, None] * np.eye(1, 3), np.zeros((9, 3))
    recovery[2::3] = np.linalg.qr(np.column_stack([np.ones(3), np.eye(3)[:, :2]]))[0]
    given = {"mass_matrix": np.eye(3), "stiffness_matrix": np.diag(values), "nodes": nodes, "recovery": recovery}
    body = fi.Body.load(given, mass=3.0)
    for again in (body, fi.Body.load(body.save(tmp_path / "soft"))):
        assert_allclose(again.frequencies, [0.1, 100.0, 300.0], rtol=1e-9)


@pytest.mark.parametrize("support", [1e16, 1e36])
def test_supports_as_stiff_as_programs_write_them_hold(support):
    """A bar on two hinges, one of 1e36 N/m: other modes were hidden in the rounding of such springs."""
    M, K, nodes = bar()
    held, free = np.array([0, 1, 2, 3, 6 * N + 1, 6 * N + 2]), K.copy()
    free[held, held] += support
    kept = np.setdiff1d(np.arange(len(K)), held)
    wanted = np.sqrt(eigh(K[np.ix_(kept, kept)], M[np.ix_(kept, kept)])[0][:10]) / (2.0 * np.pi)
    body = fi.Body.from_matrices(M, free, nodes, total_mass=MASS)
    assert_allclose(body.frequencies[:10], wanted, rtol=1e-6)


@pytest.mark.parametrize("spring", [1e2, 1e5])
def test_soft_springs_under_stiff_bodies_are_none_of_their_rounding(spring):
    """A steel bar along x on a spring at one end: taken as free, a blow as soft as the spring erred by a half."""
    n = 50
    unit = np.diff(np.eye(n + 1), axis=0)
    K = STEEL.E * 0.01 * n / 0.1 * (1.0 + 1e-3 / np.pi) * unit.T @ unit
    K[0, 0] += spring
    M = STEEL.rho * 0.01 * 0.1 / n * np.diag(np.r_[0.5, np.ones(n - 1), 0.5])
    nodes, dofs = np.linspace(0.0, 0.1, n + 1)[:, None] * np.eye(1, 3), [(i + 1, 1) for i in range(n + 1)]
    body = fi.Body.from_matrices(M, K, nodes, dofs=dofs, total_mass=7.85, loads=[(n + 1, (1.0, 0.0, 0.0))])
    assert body.frequencies[0] == pytest.approx(np.sqrt(spring / M.sum()) / (2.0 * np.pi), rel=1e-4)
    K[0, 0] -= spring
    assert fi.Body.from_matrices(M, K, nodes, dofs=dofs).frequencies[0] == 0.0


def test_a_triangle_may_mix_both_sides_of_the_diagonal():
    matrix = np.array([[4.0, 1.0, 2.0], [1.0, 5.0, 3.0], [2.0, 3.0, 6.0]])
    rows, columns = np.array([0, 1, 2, 1, 0, 2]), np.array([0, 1, 2, 0, 2, 1])
    assert_allclose(whole_matrix(rows, columns, matrix[rows, columns], 3).toarray(), matrix)
