"""Which elements a thick plate takes: four of them on disks and squares, from a stout to a very thin one.

For each body, support, thickness and element: unknowns, and the largest relative error of the first six flexible
frequencies. `disk_frequencies` solves the characteristic equations of the circular plate (Mindlin and Deresiewicz
1954); hinged squares follow from Kirchhoff's frequencies (`hinged_polygon`, Wang 1994). The clamped square has no
closed form; its reference is the last element of the list on a mesh half as large as the finest shown.

    python studies/verification/thick_elements.py
"""

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import block_diag, coo_matrix, csr_matrix
from scipy.sparse.linalg import eigsh
from scipy.special import ive, jv
from skfem import Basis, BilinearForm, ElementVector, MeshTri, MeshTri2
from skfem.element import ElementTriN2, ElementTriP2, ElementTriP2B, ElementTriP4
from skfem.quadrature import get_quadrature

import fem_impact as fi
from fem_impact.fe import refinement

NU = 0.3  # [-]
KAPPA = 5.0 / 6.0  # [-]
N_MODES = 6
THICKNESSES = 0.2, 0.1, 0.01, 1e-3, 1e-4  # [m] of a disk of radius 1 m and a square of side 1 m
CHOSEN = "Argyris and shear"
L_SHAPE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.0, 1.0)]  # [m] of three unit squares
# [1/m^2] squared wavenumbers of the membrane of this shape: Trefethen and Betcke (2006), Contemp. Math. 412, 297-314
L_MEMBRANE = np.array([9.6397238440219, 15.1972519264, 2.0 * np.pi**2, 29.5214811141, 31.9126359571])
REFERENCE = 0.05  # [m] triangles of the reference for the clamped square
SIZES = {"P2": (0.1,), "P4": (0.2, 0.1), "MITC7": (0.1,), "Argyris and shear": (0.2, 0.1)}  # [m]


def rigidities(h: float) -> tuple[float, float, float, float]:
    """Bending stiffness D, shear stiffness S, mass and rotary inertia per area of a plate with E = rho = 1."""
    return h**3 / 12.0 / (1.0 - NU**2), KAPPA * h / 2.0 / (1.0 + NU), h, h**3 / 12.0


def thin_rate(h: float) -> float:
    """Frequency [rad/s] of a thin plate's waves over their squared wavenumber [1/m^2]."""
    D, _, m, _ = rigidities(h)
    return float(np.sqrt(D / m))


# --- exact ---------------------------------------------------------------------------------------------------------


def hinged_polygon(kirchhoff: np.ndarray, h: float, *, E: float = 1.0, nu: float = NU, rho: float = 1.0) -> np.ndarray:
    """Angular frequencies [rad/s] of a hinged polygonal Mindlin plate from those of the Kirchhoff plate.

    References
    ----------
    Wang (1994), J. Vib. Acoust. 116, 536-540. Here in the form that keeps its digits for thin plates.
    """
    G, D = E / 2.0 / (1.0 + nu), E * h**3 / 12.0 / (1.0 - nu**2)
    a = 1.0 + kirchhoff * h**2 / 12.0 * np.sqrt(rho * h / D) * (1.0 + 2.0 / (KAPPA * (1.0 - nu)))
    c = rho * h**2 * kirchhoff**2 / (3.0 * KAPPA * G)
    return np.sqrt(6.0 * KAPPA * G / (rho * h**2) * c / (a + np.sqrt(a**2 - c)))


def _radial(square: float, n: int, r: float) -> tuple[float, float, float]:
    """The solution of Bessel's equation f'' + f'/r + (square - n^2/r^2) f = 0 regular at 0, at r: f, f', f''."""
    k = np.sqrt(abs(square))
    if square > 0.0:
        f, slope = jv(n, k * r), 0.5 * k * (jv(n - 1, k * r) - jv(n + 1, k * r))
    else:
        f, slope = ive(n, k * r), 0.5 * k * (ive(n - 1, k * r) + ive(n + 1, k * r))
    return f, slope, -slope / r + (n**2 / r**2 - square) * f


def characteristic(omega: float, n: int, h: float, edge: str, nu: float = NU) -> float:
    """Determinant of the edge conditions of a disk of radius 1 with n nodal diameters; E = rho = 1.

    References
    ----------
    Mindlin and Deresiewicz (1954), J. Appl. Phys. 25, 1329-1332. w = w1 + w2 with (lap + d_i^2) w_i = 0, rotations
    mu_i grad w_i + curl H, mu_i = 1 - omega^2 m / (S d_i^2).
    """
    D, S, m, R = h**3 / 12.0 / (1.0 - nu**2), KAPPA * h / 2.0 / (1.0 + nu), h, h**3 / 12.0
    p = omega**2
    root = np.sqrt((R / D - m / S) ** 2 * p**2 + 4.0 * m * p / D)
    high = 0.5 * ((R / D + m / S) * p + root)
    squares = high, p * (p * R * m / (D * S) - m / D) / high  # the product of both is p (p R - S) m / (D S)
    columns = []
    for square in squares:
        f, slope, bend = _radial(square, n, 1.0)
        mu = 1.0 - p * m / (S * square)
        columns.append((f, slope, mu * slope, mu * bend, -mu * n * f, -mu * n * (slope - f)))
    if n:
        f, slope, bend = _radial(2.0 * (p * R - S) / (D * (1.0 - nu)), n, 1.0)
        columns.append((0.0, 0.0, n * f, n * (slope - f), -slope, -bend))
    w, tilt, radial, radial_slope, around, around_slope = np.array(columns).T
    moment = radial_slope + nu * (radial + n * around)
    twist = -n * radial + around_slope - around
    rows = {
        "clamped": (w, radial, around), "hinged": (w, moment, around), "soft hinged": (w, moment, twist),
        "free": (moment, tilt - radial, twist),
    }[edge]  # fmt: skip
    matrix = np.array(rows[: 3 if n else 2])
    return float(np.linalg.det(matrix / np.abs(matrix).max(axis=0)))


def disk_frequencies(h: float, edge: str, n_modes: int, nu: float = NU) -> np.ndarray:
    """First flexible angular frequencies [rad/s] of a disk of radius 1 m with E = 1 Pa, rho = 1 kg/m^3."""
    scale = np.sqrt(h**2 / 12.0 / (1.0 - nu**2))
    found: list[float] = []
    for n in range(n_modes + 2):
        scan = scale * np.linspace(0.9 if edge == "free" else 2.0, 8.0 * n_modes + 20.0, 60 * n_modes)
        values = [characteristic(omega, n, h, edge, nu) for omega in scan]
        for i in np.flatnonzero(np.diff(np.sign(values))):
            root = brentq(characteristic, scan[i], scan[i + 1], args=(n, h, edge, nu), xtol=1e-15 * scale, rtol=1e-14)
            if abs(characteristic(root, n, h, edge, nu)) < 1e-3 * max(abs(values[i]), abs(values[i + 1])):  # no pole
                found += [root] * (1 if n == 0 else 2)
    return np.sort(found)[:n_modes]


# --- candidates ----------------------------------------------------------------------------------------------------


def curved(mesh: Any) -> MeshTri2:
    """Quadratic triangles whose boundary goes through the middles of the true facets."""
    plane = MeshTri2.from_mesh(MeshTri(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.cells.T)))
    places = plane.doflocs.copy()
    chords = mesh.points[mesh.facets].mean(axis=1)
    nearest = [int(np.argmin(((places.T - chord) ** 2).sum(axis=1))) for chord in chords]
    places[:, nearest] = mesh.middles.T
    return MeshTri2(places, plane.t)


def reduction(places: np.ndarray, X: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """From a field at ``places`` to its reduction at points X, (2, n_q, n_places, 2), on the reference triangle.

    The reduction lies in Nedelec's space of degree 2 and keeps the moments of the tangential part against 1 and s on
    each side, and the means over the triangle: Brezzi, Fortin and Stenberg (1991), M3AS 1, 125-151.
    """
    node, share = np.polynomial.legendre.leggauss(SIDE)
    moments = np.zeros((8, places.shape[1], 2))
    for side, (a, b) in enumerate(SIDES):
        for power in range(2):
            along = 0.5 * share * (0.5 * (node + 1.0)) ** power
            moments[2 * side + power, SIDE * side : SIDE * (side + 1)] = along[:, None] * (ENDS[b] - ENDS[a])
    moments[6, 3 * SIDE :, 0] = moments[7, 3 * SIDE :, 1] = weight
    element = ElementTriN2()
    at_places, at_points = (
        np.stack([np.broadcast_to(element.lbasis(x, i)[0], (2, x.shape[1])) for i in range(8)]) for x in (places, X)
    )
    take = np.linalg.inv(np.einsum("fpi,bip->fb", moments, at_places))
    return np.einsum("bip,bf,fqj->ipqj", at_points, take, moments)


def matrices(plane: Any, h: float, elements: tuple[Any, Any], reduced: bool) -> tuple[Any, ...]:
    """Bases of deflection and rotations, and stiffness and mass of all unknowns, deflection first."""
    D, S, m, R = rigidities(h)
    order = 2 * elements[1].maxdeg
    X, weight = get_quadrature(plane.refdom, order)
    deflection = Basis(plane, elements[0], quadrature=(X, weight))
    rotation = Basis(plane, ElementVector(elements[1]), quadrature=(X, weight))

    @BilinearForm
    def bending(b, c, _):
        (xx, xy), (yx, yy) = b.grad
        (aa, ab), (ba, bb) = c.grad
        return D * ((xx + NU * yy) * aa + (yy + NU * xx) * bb + 0.5 * (1.0 - NU) * (xy + yx) * (ab + ba))

    @BilinearForm
    def inertia(w, v, _):
        return m * w * v

    @BilinearForm
    def turning(b, c, _):
        return R * (b[0] * c[0] + b[1] * c[1])

    mapping = plane._mapping()
    if reduced:
        node = 0.5 * (np.polynomial.legendre.leggauss(SIDE)[0] + 1.0)[:, None]
        places = np.concatenate([ENDS[a] + node * (ENDS[b] - ENDS[a]) for a, b in SIDES] + [X.T]).T
        fields = Basis(plane, ElementVector(elements[1]), quadrature=(places, np.ones(places.shape[1]))).basis
        values = np.stack([np.broadcast_to(np.asarray(f[0]), (2, plane.t.shape[1], places.shape[1])) for f in fields])
        covariant = np.einsum("jicp,kjcp->kicp", mapping.DF(places), values)
        kept = np.einsum("ipqj,kjcq->kicp", reduction(places, X, weight), covariant)
        inverse = np.linalg.inv(mapping.DF(X).transpose(2, 3, 0, 1))
        turned = np.einsum("cpji,kjcp->kicp", inverse, kept)
    else:
        whole = 2, plane.t.shape[1], X.shape[1]
        turned = np.stack([np.broadcast_to(np.asarray(f[0]), whole) for f in rotation.basis])
    slope = np.stack([np.broadcast_to(f[0].grad, (2, plane.t.shape[1], X.shape[1])) for f in deflection.basis])
    dx = S * np.abs(mapping.detDF(X)) * weight
    every = np.concatenate([slope, -turned])
    dofs = np.concatenate([deflection.element_dofs, deflection.N + rotation.element_dofs])
    local = np.einsum("kicp,licp,cp->ckl", every, every, dx, optimize=True)
    rows, columns = (np.broadcast_to(x, local.shape) for x in (dofs.T[:, :, None], dofs.T[:, None, :]))
    n = deflection.N + rotation.N
    K = coo_matrix((local.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n)).tocsr()
    K = K + block_diag([csr_matrix((deflection.N, deflection.N)), bending.assemble(rotation)], format="csr")
    M = block_diag([inertia.assemble(deflection), turning.assemble(rotation)], format="csr")
    return deflection, rotation, K, M


def held(deflection: Any, rotation: Any, edge: str, round_edge: bool) -> csr_matrix:
    """Map from the unknowns that clamped edges or hard hinges leave to all."""
    n_w, n_b = deflection.N, rotation.N
    places = rotation.doflocs.T
    at_edge = np.zeros(n_b, bool)
    at_edge[rotation.get_dofs().all()] = True
    keep_w = np.setdiff1d(np.arange(n_w), deflection.get_dofs().all())
    inner = np.flatnonzero(~at_edge)
    entries = [(keep_w, np.arange(len(keep_w)), np.ones(len(keep_w)))]
    entries.append((n_w + inner, len(keep_w) + np.arange(len(inner)), np.ones(len(inner))))
    width = len(keep_w) + len(inner)
    if edge == "hinged":
        on = np.flatnonzero(at_edge)
        pairs = on.reshape(-1, 2)  # x and y components at a node follow each other
        x, y = places[pairs[:, 0]].T
        if round_edge:
            normal = np.column_stack([x, y]) / np.hypot(x, y)[:, None]
        else:
            normal = np.column_stack([np.isclose(x * (1.0 - x), 0.0), np.isclose(y * (1.0 - y), 0.0)]).astype(float)
            normal[normal.sum(axis=1) > 1.5] = 0.0
        for i in range(2):
            entries.append((n_w + pairs[:, i], width + np.arange(len(pairs)), normal[:, i]))
        width += len(pairs)
    rows, columns, values = (np.concatenate(part) for part in zip(*entries))
    whole = csr_matrix((values, (rows, columns)), shape=(n_w + n_b, width))
    return whole[:, np.flatnonzero(np.asarray(abs(whole).sum(axis=0)).ravel() > 0.0)]


ENDS, SIDES, SIDE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), ((0, 1), (1, 2), (0, 2)), 4
CANDIDATES: dict[str, Callable[[], tuple[Any, Any, bool]]] = {
    "P2": lambda: (ElementTriP2(), ElementTriP2(), False),
    "P4": lambda: (ElementTriP4(), ElementTriP4(), False),
    "MITC7": lambda: (ElementTriP2(), ElementTriP2B(), True),
}


def body(shape: str, size: float) -> Any:
    """A disk of radius 1 m or a square of side 1 m."""
    return fi.mesh.disk(1.0, size=size) if shape == "disk" else fi.mesh.rectangle(1.0, 1.0, size=size)


def frequencies(name: str, shape: str, edge: str, h: float, size: float) -> tuple[int, np.ndarray]:
    """Unknowns, and the first angular frequencies [rad/s] by one element, on triangles of a size [m]."""
    mesh = body(shape, size)
    if name not in CANDIDATES:
        section = fi.Plate(fi.Material(E=1.0, nu=NU, rho=1.0), h)
        system = fi.assemble(mesh, section, {"boundary": edge}, theory="mindlin")
        return system.n_dofs, refinement.solve_on_mesh(system, N_MODES, None).omega
    *elements, reduced = CANDIDATES[name]()
    deflection, rotation, K, M = matrices(curved(mesh), h, (elements[0], elements[1]), reduced)
    expand = held(deflection, rotation, edge, shape == "disk")
    K, M = (expand.T @ matrix @ expand for matrix in (K, M))
    value = eigsh(K.tocsc(), N_MODES, M.tocsc(), sigma=0.0, return_eigenvectors=False)
    return K.shape[0], np.sqrt(np.sort(value))


def exact(shape: str, edge: str, h: float) -> np.ndarray:
    """The first angular frequencies [rad/s]."""
    if shape == "disk":
        return disk_frequencies(h, edge, N_MODES)
    if edge == "hinged":
        m = np.arange(1, N_MODES + 1)
        D, _, mass, _ = rigidities(h)
        kirchhoff = np.sort((np.pi**2 * np.add.outer(m**2, m**2)).ravel())[:N_MODES] * np.sqrt(D / mass)
        return hinged_polygon(kirchhoff, h)
    return frequencies(CHOSEN, shape, edge, h, REFERENCE)[1]


def l_shape() -> None:
    """Print how far both hinged plates are from the membrane, from which Wang's relation starts."""
    mesh, edge = fi.mesh.polygon(L_SHAPE, size=0.2), {"boundary": "hinged"}
    print("\nhinged L-shape of three unit squares: relative distance of the first modes of the thin plate from the")
    print("membrane, and of the thick plate from Wang's relation with the membrane and with the thin plate")
    for h in (0.2, 0.05, 0.01):
        section = fi.Plate(fi.Material(E=1.0, nu=NU, rho=1.0), h)
        systems = (fi.assemble(mesh, section, edge, theory=theory) for theory in ("kirchhoff", "mindlin"))
        thin, found = (refinement.solve_on_mesh(system, len(L_MEMBRANE), None).omega for system in systems)
        membrane = L_MEMBRANE * thin_rate(h)
        for name, ratio in (
            ("thin", thin / membrane), ("membrane", found / hinged_polygon(membrane, h)),
            ("Wang", found / hinged_polygon(thin, h)),
        ):  # fmt: skip
            print(f"h = {h:<5g} {name:<9}" + "".join(f"{error:>10.1e}" for error in ratio - 1.0))


def main() -> None:
    head = f"{'element':<18}{'size':>6}{'unknowns':>9}" + "".join(f"{f'h = {h:g}':>11}" for h in THICKNESSES)
    for shape, edge in product(("disk", "square"), ("hinged", "clamped")):
        print(f"\n{edge} {shape}: largest relative error of the first {N_MODES} frequencies\n{head}")
        truth = {h: exact(shape, edge, h) for h in THICKNESSES}
        for name, sizes in SIZES.items():
            for size in sizes:
                found = [frequencies(name, shape, edge, h, size) for h in THICKNESSES]
                errors = [np.abs(omega / truth[h] - 1.0).max() for (_, omega), h in zip(found, THICKNESSES)]
                print(f"{name:<18}{size:>6g}{found[0][0]:>9}" + "".join(f"{error:>11.1e}" for error in errors))
    l_shape()


if __name__ == "__main__":
    main()
