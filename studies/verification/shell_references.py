"""Frequencies of free solids that are thin, curved, ribbed or layered: what shells, ribs and laminates are held to.

No theory of plates or shells enters: the bodies are elastic solids of finite elements of high degree, by NGSolve.
Cymbals are bodies of revolution, solved in their cross-section for each number of nodal diameters; the others consist
of bricks. Each is solved with two degrees; the difference of both, which is in the table, bounds the error of the
finer. Ribs let it fall slowly: with degree 6 the frequencies of the ribbed plate are another 1.2e-4 to 3.5e-4 lower,
so that 1e-3 is to be allowed for.

    python studies/verification/shell_references.py            # prints and writes shell_references.csv
    python studies/verification/shell_references.py cymbal     # those alone whose names begin so
"""

import csv
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import LinearOperator, eigsh

TABLE = Path(__file__).with_suffix(".csv")
N_MODES = 12  # flexible ones of each body; pairs of a cymbal count once
RIM = 8.0, 4.0, 2.0, 1.0, 0.5, 0.0  # [thicknesses] from a free rim, where twist turns into shear: lines of the mesh


@dataclass(frozen=True)
class Cymbal:
    """A free body of revolution of two heights: bow (1 - r^2 / radius^2), and cup (1 - r^2 / cup_radius^2)^2 inside.

    Slopes are continuous. Thickness is across the middle surface.
    """

    radius: float = 0.2032
    thickness: float = 1e-3
    bow: float = 0.007
    cup: float = 0.0025
    cup_radius: float = 0.05
    E: float = 110e9  # bronze
    nu: float = 0.34
    rho: float = 8700.0

    def rise(self, r: Any) -> Any:
        """Height [m] of the middle surface, zero at the rim."""
        inside = np.maximum(1.0 - (r / self.cup_radius) ** 2, 0.0)
        return self.bow * (1.0 - (r / self.radius) ** 2) + self.cup * inside**2

    def slope(self, r: Any) -> Any:
        """Its derivative."""
        inside = np.maximum(1.0 - (r / self.cup_radius) ** 2, 0.0)
        return -2.0 * self.bow * r / self.radius**2 - 4.0 * self.cup * r / self.cup_radius**2 * inside


@dataclass(frozen=True)
class Ribbed:
    """A free panel with two ribs from edge to edge under it, one along x at ``rib_y`` and one along y at ``rib_x``.

    The middle surface rises by (zxx (x - a / 2)^2 + zyy (y - b / 2)^2) / 2; thickness and ribs stand across it.
    """

    sides: tuple[float, float] = (0.45, 0.3)
    thickness: float = 2e-3
    rib_x: float = 0.27
    rib_y: float = 0.12
    rib: tuple[float, float] = (1.5e-3, 15e-3)  # width, height
    zxx: float = 0.0
    zyy: float = 0.0
    E: float = 70e9  # aluminium
    nu: float = 0.33
    rho: float = 2700.0


@dataclass(frozen=True)
class Layered:
    """A free plane plate of layers of carbon fibres at angles [degrees] from x, the lowest first."""

    sides: tuple[float, float] = (0.3, 0.2)
    layer: float = 0.5e-3
    angles: tuple[float, ...] = (0.0, 45.0, 90.0)
    E1: float = 138e9
    E2: float = 8.96e9  # and E3
    nu12: float = 0.3  # and nu13
    nu23: float = 0.4
    G12: float = 7.1e9  # and G13
    rho: float = 1600.0


BODIES: dict[str, Any] = {
    "cymbal": Cymbal(),
    "cymbal, steep cup": Cymbal(bow=0.012, cup=0.015),
    "cap": Cymbal(bow=0.01, cup=0.0),
    "ribbed": Ribbed(),
    "ribbed and domed": Ribbed(zxx=-0.3, zyy=-0.3),
    "layered": Layered(),
}


def lowest(a: Any, m: Any, space: Any, count: int, shift: float) -> np.ndarray:
    """The lowest eigenvalues of a x = value m x, of forms of NGSolve; ``shift`` is below all of them."""
    free = np.flatnonzero(np.array(list(space.FreeDofs())))
    matrices = []
    for form in (a, m):
        rows, columns, values = (np.array(x) for x in form.mat.COO())
        whole = csc_matrix((values, (rows, columns)), shape=(form.mat.height, form.mat.width))
        lower = abs(whole - whole.T).max() > 1e-9 * abs(whole).max()
        matrices.append(whole + whole.T - diags(whole.diagonal()) if lower else whole)
    M = matrices[1][free][:, free]
    a.mat.AsVector().data -= shift * m.mat.AsVector()
    inverse = a.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky")
    load, answer = a.mat.CreateColVector(), a.mat.CreateColVector()

    def solve(x: np.ndarray) -> np.ndarray:
        load.FV().NumPy()[:] = 0.0
        load.FV().NumPy()[free] = x
        answer.data = inverse * load
        return answer.FV().NumPy()[free].copy()

    size = len(free)
    operator = LinearOperator((size, size), solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)
    K = matrices[0][free][:, free]
    found = eigsh(K, count, M, sigma=shift, OPinv=operator, v0=start, return_eigenvectors=False)
    return np.sort(found)


# Bodies of revolution


def section_mesh(body: Cymbal, pieces: int) -> Any:
    """Quadrilaterals in one row from axis to rim, r = x and y from -thickness / 2 to thickness / 2."""
    import ngsolve as ng
    from netgen.meshing import Element1D, Element2D, FaceDescriptor, Mesh, MeshPoint, Pnt

    inner = max(2, round(pieces * body.cup_radius / body.radius)) if body.cup else pieces // 3
    rim = body.radius - body.thickness * np.array(RIM)
    bow = np.linspace(body.cup_radius, rim[0], pieces + 1)
    lines = np.concatenate([np.linspace(0.0, body.cup_radius, inner + 1), bow[1:], rim[1:]])
    mesh = Mesh(dim=2)
    low, high = ([mesh.Add(MeshPoint(Pnt(r, side * body.thickness / 2.0, 0.0))) for r in lines] for side in (-1.0, 1.0))
    mesh.Add(FaceDescriptor(surfnr=1, domin=1, bc=1))
    for i in range(len(low) - 1):
        mesh.Add(Element2D(1, [low[i], low[i + 1], high[i + 1], high[i]]))
        mesh.Add(Element1D([low[i], low[i + 1]], index=2))
        mesh.Add(Element1D([high[i + 1], high[i]], index=2))
    mesh.Add(Element1D([low[-1], high[-1]], index=2))
    mesh.Add(Element1D([high[0], low[0]], index=1))
    mesh.SetBCName(0, "axis")
    mesh.SetBCName(1, "free")
    return ng.Mesh(mesh)


def revolved(body: Cymbal, k: int, pieces: int, degree: int, count: int) -> tuple[int, np.ndarray]:
    """Unknowns, and the lowest squared frequencies [1/s^2] of motions U, W cos(k angle) and V sin(k angle).

    U = s + t and V = t - s; on the axis only a deflection with k = 0 and a shift s with k = 1 are regular.
    """
    import ngsolve as ng

    mesh = section_mesh(body, pieces)
    r, height = ng.x, ng.y
    inside = ng.IfPos(body.cup_radius - r, 1.0 - (r / body.cup_radius) ** 2, 0.0)
    slope = -2.0 * body.bow / body.radius**2 * r - 4.0 * body.cup / body.cup_radius**2 * r * inside
    rise = body.bow * (1.0 - (r / body.radius) ** 2) + body.cup * inside**2
    stretch = ng.sqrt(1.0 + slope**2)
    shape = ng.GridFunction(ng.VectorH1(mesh, order=degree + 2))
    shape.Set(ng.CoefficientFunction((-height * slope / stretch, rise + height / stretch - height)))
    mesh.SetDeformation(shape)
    axis = "axis"
    one = ng.H1(mesh, order=degree, dirichlet="" if k == 1 else axis)
    two = ng.H1(mesh, order=degree, dirichlet=axis)
    third = ng.H1(mesh, order=degree, dirichlet="" if k == 0 else axis)
    space = ng.FESpace([one, third]) if k == 0 else ng.FESpace([one, two, third])
    trial, test = space.TnT()

    def strain(fields: Any) -> tuple[Any, ...]:
        s, t, w = (fields[0], None, fields[1]) if k == 0 else fields
        ds, dw = ng.grad(s), ng.grad(w)
        if k == 0:  # U = s, V = 0
            return ds[0], s / r, dw[1], ds[1] + dw[0], ng.CF(0.0), ng.CF(0.0)
        dt = ng.grad(t)
        turn = (1.0 - k) * s / r
        more = (1.0 + k) * t / r
        return (
            ds[0] + dt[0], turn + more, dw[1], ds[1] + dt[1] + dw[0], dt[0] - ds[0] + turn - more,
            dt[1] - ds[1] - k * w / r,
        )  # fmt: skip

    mu = body.E / 2.0 / (1.0 + body.nu)
    lame = 2.0 * mu * body.nu / (1.0 - 2.0 * body.nu)
    e, f = strain(trial), strain(test)
    energy = lame * (e[0] + e[1] + e[2]) * (f[0] + f[1] + f[2]) + 2.0 * mu * sum(e[i] * f[i] for i in range(3))
    energy += mu * sum(e[i] * f[i] for i in range(3, 6) if k or i == 3)
    weights = (1.0, 1.0) if k == 0 else (2.0, 2.0, 1.0)  # U^2 + V^2 = 2 (s^2 + t^2)
    dx = ng.dx(bonus_intorder=4)
    a, m = ng.BilinearForm(space, symmetric=True), ng.BilinearForm(space, symmetric=True)
    a += r * energy * dx
    m += r * body.rho * sum(c * p * q for c, p, q in zip(weights, trial, test)) * dx
    a.Assemble()
    m.Assemble()
    scale = body.E / body.rho * (body.thickness / body.radius**2) ** 2
    return sum(space.FreeDofs()), lowest(a, m, space, count, -0.3 * scale)


def cymbal(body: Cymbal, fine: bool) -> tuple[int, list[tuple[str, float]]]:
    """The lowest flexible frequencies [Hz], each of k > 0 once, and their names (k, n)."""
    unknowns, found = 0, []
    limit = 1e-4 * body.E / body.rho * (body.thickness / body.radius**2) ** 2
    for k in range(N_MODES):
        size, value = revolved(body, k, 20 if fine else 14, 7 if fine else 6, 6)
        unknowns = max(unknowns, size)
        found += [(f"({k},{n})", float(np.sqrt(x) / 2.0 / np.pi)) for n, x in enumerate(value[value > limit])]
    return unknowns, sorted(found, key=lambda row: row[1])[:N_MODES]


# Bricks


def brick_mesh(x: np.ndarray, y: np.ndarray, z: np.ndarray, domain: Callable[[float, float, float], int]) -> Any:
    """Bricks between grid lines; ``domain`` tells of a brick's middle to which material it belongs (0 is outside)."""
    import ngsolve as ng
    from netgen.meshing import Element2D, Element3D, FaceDescriptor, Mesh, MeshPoint, Pnt

    mesh, points = Mesh(dim=3), {}

    def corner(i: int, j: int, k: int) -> Any:
        if (i, j, k) not in points:
            points[i, j, k] = mesh.Add(MeshPoint(Pnt(x[i], y[j], z[k])))
        return points[i, j, k]

    cells = {}
    for i, j, k in np.ndindex(len(x) - 1, len(y) - 1, len(z) - 1):
        number = domain(*(0.5 * (line[c] + line[c + 1]) for line, c in ((x, i), (y, j), (z, k))))
        if number:
            cells[i, j, k] = number
    mesh.Add(FaceDescriptor(surfnr=1, domin=1, bc=1))
    base = ((0, 0), (1, 0), (1, 1), (0, 1))
    for (i, j, k), number in cells.items():
        mesh.Add(Element3D(number, [corner(i + p, j + q, k + h) for h in (0, 1) for p, q in base]))
        for axis in range(3):
            for side in (0, 1):
                beside = [i, j, k]
                beside[axis] += 2 * side - 1
                if tuple(beside) not in cells:
                    face = []
                    for p, q in base:
                        shift = [0, 0, 0]
                        shift[axis], shift[(axis + 1) % 3], shift[(axis + 2) % 3] = side, p, q
                        face.append(corner(i + shift[0], j + shift[1], k + shift[2]))
                    mesh.Add(Element2D(1, face if side else face[::-1]))
    return ng.Mesh(mesh)


def solid(mesh: Any, degree: int, stress: Callable[[Any], Any], rho: float, size: float, thickness: float) -> Any:
    """Unknowns and the lowest flexible frequencies [Hz] of a free solid."""
    import ngsolve as ng

    space = ng.VectorH1(mesh, order=degree)
    u, v = space.TnT()
    a, m = ng.BilinearForm(space, symmetric=True), ng.BilinearForm(space, symmetric=True)
    strain = ng.Sym(ng.Grad(v))
    a += ng.InnerProduct(stress(ng.Sym(ng.Grad(u))), strain) * ng.dx
    m += rho * ng.InnerProduct(u, v) * ng.dx
    with ng.TaskManager():
        a.Assemble()
        m.Assemble()
        scale = 1e9 / rho * (thickness / size**2) ** 2
        value = lowest(a, m, space, N_MODES + 6, -10.0 * scale)
    flexible = value[6:]
    assert np.abs(value[:6]).max() < 1e-3 * flexible[0], value[:7]
    names = [str(i + 1) for i in range(N_MODES)]
    return space.ndof, list(zip(names, np.sqrt(flexible) / 2.0 / np.pi))


def grid(length: float, edge: float, pieces: tuple[int, int], rib: tuple[float, float]) -> np.ndarray:
    """Grid lines along a side, closer by ``edge`` to its ends and to the two faces of a rib."""
    faces = rib[0] - rib[1] / 2.0, rib[0] + rib[1] / 2.0
    return np.concatenate([rimmed(0.0, faces[0], edge, pieces[0]), rimmed(faces[1], length, edge, pieces[1])])


def rimmed(low: float, high: float, edge: float, pieces: int) -> np.ndarray:
    """Grid lines, even but for one beside each end."""
    return np.concatenate([[low], np.linspace(low + edge, high - edge, pieces + 1), [high]])


def ribbed(body: Ribbed, fine: bool) -> Any:
    """As `cymbal`, of a ribbed panel."""
    import ngsolve as ng

    (a, b), h, (width, height) = body.sides, body.thickness, body.rib
    x, y = grid(a, 1.5 * h, (3, 2), (body.rib_x, width)), grid(b, 1.5 * h, (2, 2), (body.rib_y, width))
    z = np.array([-h / 2.0 - height, -h / 2.0, h / 2.0])

    def domain(px: float, py: float, pz: float) -> int:
        return int(pz > -h / 2.0 or abs(px - body.rib_x) < width / 2.0 or abs(py - body.rib_y) < width / 2.0)

    mesh, degree = brick_mesh(x, y, z, domain), 5 if fine else 4
    zx, zy = body.zxx * (ng.x - a / 2.0), body.zyy * (ng.y - b / 2.0)
    rise = 0.5 * (zx * (ng.x - a / 2.0) + zy * (ng.y - b / 2.0))
    stretch = ng.sqrt(1.0 + zx**2 + zy**2)
    shape = ng.GridFunction(ng.VectorH1(mesh, order=4))
    shape.Set(ng.CF((-ng.z * zx / stretch, -ng.z * zy / stretch, rise + ng.z / stretch - ng.z)))
    mesh.SetDeformation(shape)
    mu = body.E / 2.0 / (1.0 + body.nu)
    lame = 2.0 * mu * body.nu / (1.0 - 2.0 * body.nu)
    return solid(mesh, degree, lambda e: lame * ng.Trace(e) * ng.Id(3) + 2.0 * mu * e, body.rho, a, h)


def layer_stiffness(body: Layered, degrees: float) -> np.ndarray:
    """Stiffness (3, 3, 3, 3) [Pa] of a layer in the axes of the plate."""
    nu32 = nu23 = body.nu23
    nu21 = body.nu12 * body.E2 / body.E1
    direct = np.array(
        [
            [1.0 / body.E1, -nu21 / body.E2, -nu21 / body.E2],
            [-body.nu12 / body.E1, 1.0 / body.E2, -nu32 / body.E2],
            [-body.nu12 / body.E1, -nu23 / body.E2, 1.0 / body.E2],
        ]
    )
    C = np.zeros((3, 3, 3, 3))
    for i, j in np.ndindex(3, 3):
        C[i, i, j, j] = np.linalg.inv(direct)[i, j]
    for i, j, G in ((1, 2, body.E2 / 2.0 / (1.0 + nu23)), (0, 2, body.G12), (0, 1, body.G12)):
        for p, q, r, s in ((i, j, i, j), (i, j, j, i), (j, i, i, j), (j, i, j, i)):
            C[p, q, r, s] = G
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.einsum("ia,jb,kc,ld,abcd", turn, turn, turn, turn, C)


def layered(body: Layered, fine: bool) -> Any:
    """As `cymbal`, of a laminate."""
    import ngsolve as ng

    n, h = len(body.angles), body.layer * len(body.angles)
    x, y = (rimmed(0.0, side, 1.5 * h, pieces) for side, pieces in zip(body.sides, (6, 4)))
    z = np.linspace(-h / 2.0, h / 2.0, n + 1)
    mesh = brick_mesh(x, y, z, lambda px, py, pz: 1 + int((pz + h / 2.0) / body.layer))
    C = [layer_stiffness(body, degrees) for degrees in body.angles]

    def stress(e: Any) -> Any:
        rows = []
        for i in range(3):
            for j in range(3):
                terms = [
                    ng.CF([float(layer[i, j, k, l]) for layer in C]) * e[k, l]
                    for k, l in np.ndindex(3, 3)
                    if max(abs(layer[i, j, k, l]) for layer in C) > 1.0
                ]
                rows.append(sum(terms[1:], terms[0]))
        return ng.CF(tuple(rows), dims=(3, 3))

    return solid(mesh, 5 if fine else 4, stress, body.rho, body.sides[0], h)


def run(name: str) -> list[list[Any]]:
    """Rows (body, mode, frequency, relative difference of the coarser solution, unknowns) of a body; prints them."""
    work = {Cymbal: cymbal, Ribbed: ribbed, Layered: layered}[type(BODIES[name])]
    start = time.process_time()
    _, coarse = work(BODIES[name], False)
    unknowns, fine = work(BODIES[name], True)
    print(f"\n{name}: {unknowns} unknowns, {time.process_time() - start:.0f} s of processor time", flush=True)
    rows = []
    for mode, value in fine:
        before = dict(coarse).get(mode, np.nan)
        rows.append([name, mode, f"{value:.9g}", f"{before / value - 1.0:.1e}", unknowns])
        print(f"{mode:>8}{value:>16.6f} Hz{before / value - 1.0:>10.1e}")
    return rows


def read() -> dict[str, list[tuple[str, float, float]]]:
    """The table: of each body rows (mode, frequency [Hz], relative difference of the coarser solution)."""
    table: dict[str, list[tuple[str, float, float]]] = {}
    with TABLE.open(newline="") as file:
        for row in csv.DictReader(file):
            table.setdefault(row["body"], []).append((row["mode"], float(row["frequency"]), float(row["coarser"])))
    return table


def main() -> None:
    import ngsolve as ng

    ng.ngsglobals.msg_level = 0
    ng.SetNumThreads(1)
    ng.SetHeapSize(200_000_000)
    start = sys.argv[1] if len(sys.argv) > 1 else ""
    rows = {name: run(name) for name in BODIES if name.startswith(start)}
    if TABLE.exists():
        with TABLE.open(newline="") as file:
            for row in list(csv.reader(file))[1:]:
                if row[0] in BODIES and not row[0].startswith(start):
                    rows.setdefault(row[0], []).append(row)
    with TABLE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["body", "mode", "frequency", "coarser", "unknowns"])
        writer.writerows(row for name in BODIES for row in rows.get(name, []))


if __name__ == "__main__":
    main()
