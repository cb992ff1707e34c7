"""References for thick plates that share no elements with the package: Navier's series, Ritz, rotations, solids."""

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh, null_space
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import eigsh
from scipy.special import j1
from skfem import Basis, BilinearForm, ElementHex2, ElementTriP4, ElementVector, MeshHex, MeshTri

from fem_impact.fe.corners import around_corners
from fem_impact.fe.section import Material

KAPPA = 5.0 / 6.0  # [-]


def navier(length, width, h, constants, n_modes, tension=0.0):
    """First omega [rad/s] of a hinged orthotropic rectangle: three unknowns for each pair of half waves.

    ``constants`` are D11, D22, D12, D66 [N m], shear stiffnesses [N/m] along x and y, and rho [kg/m^3].
    """
    D11, D22, D12, D66, S1, S2, rho = constants
    found = []
    for m in range(1, n_modes + 1):
        for n in range(1, n_modes + 1):
            a, b = m * np.pi / length, n * np.pi / width  # w sin sin, beta_x cos sin, beta_y sin cos
            K = np.array([
                [(S1 + tension) * a**2 + (S2 + tension) * b**2, -S1 * a, -S2 * b],
                [-S1 * a, D11 * a**2 + D66 * b**2 + S1, (D12 + D66) * a * b],
                [-S2 * b, (D12 + D66) * a * b, D66 * a**2 + D22 * b**2 + S2],
            ])  # fmt: skip
            found.append(np.sqrt(eigh(K, np.diag([rho * h, rho * h**3 / 12.0, rho * h**3 / 12.0]))[0][0]))
    return np.sort(found)[:n_modes]


def spread_compliance(length, width, h, E, nu, at, radius, n=3000):
    """Deflection [m/N] of a hinged rectangle, its mean over the disk on which the unit force is spread evenly."""
    D, S = E * h**3 / 12.0 / (1.0 - nu**2), KAPPA * E / 2.0 / (1.0 + nu) * h
    kx, ky = np.arange(1, n + 1)[:, None] * np.pi / length, np.arange(1, n + 1) * np.pi / width
    k = np.hypot(kx, ky)
    seen = np.sin(kx * at[0]) * np.sin(ky * at[1]) * 2.0 * j1(k * radius) / (k * radius)
    return float((4.0 / (length * width) * seen**2 * (1.0 / (D * k**4) + 1.0 / (S * k**2))).sum())


def by_rotations(mesh, h, n_modes, matrices):
    """First omega [rad/s] of a hard-hinged polygon, E = rho = 1: quartic deflection and rotations on graded triangles.

    ``matrices`` of `studies/verification/thick_elements.py` knows neither our elements nor our edges.
    """
    fine = around_corners(mesh, ["hinged"] * len(mesh.facets), Material(E=1.0, nu=0.3, rho=1.0))[1]
    plane = MeshTri(np.ascontiguousarray(fine.points.T), np.ascontiguousarray(fine.cells.T))
    deflection, rotation, K, M = matrices(plane, h, (ElementTriP4(), ElementTriP4()), False)
    n_w, across = deflection.N, {}
    for facet in plane.boundary_facets():
        a, b = plane.p[:, plane.facets[:, facet]].T
        for i in np.unique(rotation.get_dofs(facets=np.array([facet])).all())[::2]:  # y components follow those of x
            across.setdefault(int(i), []).append(np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a))
    keep = np.setdiff1d(np.arange(n_w), deflection.get_dofs().all())
    at_edge = np.array([[i, i + 1] for i in across]).ravel()
    keep = np.concatenate([keep, n_w + np.setdiff1d(np.arange(rotation.N), at_edge)])
    straight = [(i, n[0]) for i, n in across.items() if all(abs(n[0] @ other) > 0.999 for other in n)]
    rows = np.concatenate([keep, *([n_w + i, n_w + i + 1] for i, _ in straight)])
    columns = np.concatenate([np.arange(len(keep)), np.repeat(len(keep) + np.arange(len(straight)), 2)])
    values = np.concatenate([np.ones(len(keep)), *(n for _, n in straight)])
    expand = csr_matrix((values, (rows, columns)), shape=(n_w + rotation.N, len(keep) + len(straight)))
    K, M = (expand.T @ matrix @ expand for matrix in (K, M))
    even = diags(K.diagonal() ** -0.5)
    value = eigsh((even @ K @ even).tocsc(), n_modes, (even @ M @ even).tocsc(), sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(value))


def ritz(h, nu, sides, degree, n_modes):
    """First omega [rad/s] of a unit square, E = rho = 1, by Legendre polynomials in the conditions of its edges.

    ``sides`` are "clamped", "hinged", "soft hinged" or "free" for left, right, bottom, top. Liew, Xiang and
    Kitipornchai (1993), Int. J. Solids Struct. 30, 3357-3379, used the same space.
    """
    D, S = h**3 / 12.0 / (1.0 - nu**2), KAPPA * h / 2.0 / (1.0 + nu)
    node, weight = legendre.leggauss(degree + 4)
    values = legendre.legvander(node, degree)
    slopes = np.stack([legendre.legval(node, legendre.legder(c)) for c in np.eye(degree + 1)], axis=1) * 2.0
    ends = legendre.legvander(np.array([-1.0, 1.0]), degree)

    def along(first, last, keeps):
        rows = [ends[i] for i, kind in enumerate((first, last)) if kind in keeps]
        basis = null_space(np.array(rows)) if rows else np.eye(degree + 1)
        return [(values @ basis), (slopes @ basis)]

    hold, hard, clamped = ("clamped", "hinged", "soft hinged"), ("clamped", "hinged"), ("clamped",)
    left, right, bottom, top = sides
    fields = [  # w; beta_x is held tangentially on bottom and top, beta_y on left and right
        (along(left, right, hold), along(bottom, top, hold)),
        (along(left, right, clamped), along(bottom, top, hard)),
        (along(left, right, hard), along(bottom, top, clamped)),
    ]
    W = np.diag(0.5 * weight)

    def product(i, j, dxi, dyi, dxj, dyj):
        (xi, yi), (xj, yj) = fields[i], fields[j]
        return np.kron(xi[dxi].T @ W @ xj[dxj], yi[dyi].T @ W @ yj[dyj])

    G = 0.5 * (1.0 - nu) * D
    K = [[None] * 3 for _ in range(3)]
    K[0][0] = S * (product(0, 0, 1, 0, 1, 0) + product(0, 0, 0, 1, 0, 1))
    K[0][1], K[0][2] = -S * product(0, 1, 1, 0, 0, 0), -S * product(0, 2, 0, 1, 0, 0)
    K[1][1] = D * product(1, 1, 1, 0, 1, 0) + G * product(1, 1, 0, 1, 0, 1) + S * product(1, 1, 0, 0, 0, 0)
    K[2][2] = D * product(2, 2, 0, 1, 0, 1) + G * product(2, 2, 1, 0, 1, 0) + S * product(2, 2, 0, 0, 0, 0)
    K[1][2] = nu * D * product(1, 2, 1, 0, 0, 1) + G * product(1, 2, 0, 1, 1, 0)
    K[1][0], K[2][0], K[2][1] = K[0][1].T, K[0][2].T, K[1][2].T
    M = [product(i, i, 0, 0, 0, 0) * (h if i == 0 else h**3 / 12.0) for i in range(3)]
    zero = [[np.zeros((len(M[i]), len(M[j]))) if i != j else M[i] for j in range(3)] for i in range(3)]
    value = eigh(np.block(K), np.block(zero), eigvals_only=True, subset_by_index=[0, n_modes - 1])
    return np.sqrt(np.maximum(value, 0.0))


def block(sides, divisions, nu, n_modes):
    """First flexible omega [rad/s] in bending of a free block, E = rho = 1, by quadratic hexahedra.

    ``sides`` are its length, width and thickness; the upper half is computed, with no displacement within the middle
    plane. Two ``divisions`` instead of three make it a beam: half of the width, with no displacement across its middle.
    """
    narrow = len(divisions) == 2
    counts = (divisions[0], 2, divisions[1]) if narrow else divisions
    extents = (sides[0], 0.5 * sides[1] if narrow else sides[1], 0.5 * sides[2])
    mesh = MeshHex.init_tensor(*(np.linspace(0.0, side, n + 1) for side, n in zip(extents, counts)))
    basis = Basis(mesh, ElementVector(ElementHex2()))
    lame, shear = nu / (1.0 + nu) / (1.0 - 2.0 * nu), 0.5 / (1.0 + nu)

    @BilinearForm
    def stiffness(u, v, _):
        e, f = (0.5 * (g + np.swapaxes(g, 0, 1)) for g in (u.grad, v.grad))
        return lame * np.trace(e) * np.trace(f) + 2.0 * shear * np.einsum("ij...,ij...", e, f)

    @BilinearForm
    def inertia(u, v, _):
        return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]

    low = basis.get_dofs(lambda x: x[2] < 1e-9)
    held = np.concatenate([low.all(["u^1"]), low.all(["u^2"])])
    if narrow:
        held = np.concatenate([held, basis.get_dofs(lambda x: x[1] < 1e-9).all(["u^2"])])
    free = np.setdiff1d(np.arange(basis.N), held)
    K, M = (form.assemble(basis)[free][:, free].tocsc() for form in (stiffness, inertia))
    n_rigid = 2 if narrow else 3
    shift = -1e-3 * sides[2] ** 2 / sides[0] ** 4
    value = np.sort(eigsh(K, n_modes + n_rigid, M, sigma=shift, return_eigenvectors=False))
    return np.sqrt(value[n_rigid:])
