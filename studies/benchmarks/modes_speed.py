"""Compares error and time of 200 modes of the hinged 1.55 : 1 plate with scikit-fem's Morley plate and NGSolve.

    python studies/benchmarks/modes_speed.py [--out out/] [--large]

Each row is one run from mesh to modes, including assembly, on one core; the error is the largest of the 200 relative
errors against the closed form. scikit-fem runs as in its example 2 (Morley plate, `eigsh` about zero). NGSolve, if
installed, uses Hellan-Herrmann-Johnson elements, its own sparse inverse and the same `eigsh`. With ``--large`` the
study measures instead how time and memory grow up to 100 000 unknowns.
"""

import os
import resource
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh
from skfem import Basis, BilinearForm, ElementTriMorley, MeshTri, condense
from skfem.helpers import dd, ddot, eye, trace

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

LENGTH, WIDTH, N_MODES, NU = 1.55, 1.0, 200, 0.3
PLATE = fi.Plate(fi.Material(E=12.0 * (1.0 - NU**2), nu=NU, rho=1.0), thickness=1.0)  # rigidity and mass per area 1
OURS = (8, 11, 14, 17, 20, 22, 25, 30)  # [-] elements across the plate
MORLEY = (16, 32, 64, 96, 128, 160)
HHJ = ((0.2, 2), (0.12, 2), (0.12, 3), (0.09, 3), (0.075, 3), (0.1, 4))  # element size and order
BUDGET = 45.0  # [s] limit for one run of a method


def exact():
    """Angular frequencies [rad/s] of the plate, (N_MODES,)."""
    m = np.arange(1, 100)
    return np.sort(np.pi**2 * ((m[:, None] / LENGTH) ** 2 + (m / WIDTH) ** 2), axis=None)[:N_MODES]


def ours(divisions):
    """fem_impact with a given element size: number of unknowns and angular frequencies."""
    system = fi.assemble(fi.mesh.rectangle(LENGTH, WIDTH, size=WIDTH / divisions), PLATE, {"boundary": "hinged"})
    return system.n_dofs, fi.find_modes(system, n_modes=N_MODES).omega


def morley(divisions):
    """scikit-fem's Morley plate."""
    columns = round(LENGTH * divisions)
    mesh = MeshTri.init_tensor(np.linspace(0, LENGTH, columns + 1), np.linspace(0, WIDTH, divisions + 1))
    basis = Basis(mesh, ElementTriMorley())

    @BilinearForm
    def bending(u, v, _):
        return ddot((1.0 - NU) * dd(u) + NU * eye(trace(dd(u)), 2), dd(v))

    @BilinearForm
    def inertia(u, v, _):
        return u * v

    held = basis.get_dofs().all("u")
    K, M, *_ = condense(bending.assemble(basis), inertia.assemble(basis), D=held)
    return K.shape[0], np.sqrt(np.sort(eigsh(K, k=N_MODES, M=M, sigma=0.0, which="LM")[0]))


def hhj(size, order):
    """NGSolve's Hellan-Herrmann-Johnson plate."""
    import ngsolve as ng
    from netgen.geom2d import SplineGeometry
    from scipy.sparse import csc_matrix, diags, identity

    ng.ngsglobals.msg_level = 0
    ng.SetNumThreads(1)
    geometry = SplineGeometry()
    geometry.AddRectangle((0, 0), (LENGTH, WIDTH), bcs=["rim"] * 4)
    mesh = ng.Mesh(geometry.GenerateMesh(maxh=size))
    space = ng.HDivDiv(mesh, order=order, dirichlet="rim") * ng.H1(mesh, order=order + 1, dirichlet="rim")
    (s, w), (t, v) = space.TnT()
    n = ng.specialcf.normal(2)

    def curvature(moment):
        return (moment - NU / (1.0 + NU) * ng.Trace(moment) * ng.Id(2)) / (1.0 - NU)

    a, m = ng.BilinearForm(space, symmetric=True), ng.BilinearForm(space, symmetric=True)
    a += -ng.InnerProduct(curvature(s), t) * ng.dx
    a += (ng.InnerProduct(s, v.Operator("hesse")) + ng.InnerProduct(t, w.Operator("hesse"))) * ng.dx
    jump = ((s * n) * n) * (ng.grad(v) * n) + ((t * n) * n) * (ng.grad(w) * n)
    a += -jump * ng.dx(element_boundary=True)
    m += w * v * ng.dx
    a.Assemble()
    m.Assemble()
    free = np.array(list(space.FreeDofs()))
    rows, columns, values = (np.array(x) for x in m.mat.COO())
    M = csc_matrix((values, (rows, columns)), shape=(m.mat.height, m.mat.width))
    M = M if abs(M - M.T).max() < 1e-9 * abs(M).max() else M + M.T - diags(M.diagonal())
    moving = np.flatnonzero(free & (M.diagonal() > 0.0))
    inverse = a.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky")
    load, answer = a.mat.CreateColVector(), a.mat.CreateColVector()

    def flexibility(x):
        load.FV().NumPy()[:] = 0.0
        load.FV().NumPy()[moving] = x
        answer.data = inverse * load
        return answer.FV().NumPy()[moving].copy()

    size = len(moving)
    operator = LinearOperator((size, size), flexibility, dtype=float)
    M = M[moving][:, moving].tocsc()
    values = eigsh(identity(size), k=N_MODES, M=M, sigma=0.0, OPinv=operator, ncv=int(1.3 * N_MODES))[0]
    return int(free.sum()), np.sqrt(np.sort(np.abs(values)))


def measure(work, *arguments):
    """Processor time [s], number of unknowns and largest relative error of one run."""
    seconds, (n_dofs, omega) = shared.timed(lambda: work(*arguments))
    return seconds, n_dofs, float(np.abs(omega / exact() - 1.0).max())


def compare():
    """Rows (method, setting, seconds, unknowns, error); a method stops when it comes near the budget."""
    rows = []
    methods = [("fem_impact", ours, [(n,) for n in OURS]), ("scikit-fem, Morley", morley, [(n,) for n in MORLEY])]
    try:
        import ngsolve  # noqa: F401

        methods.append(("NGSolve, HHJ", hhj, HHJ))
    except ImportError:
        print("NGSolve is not installed: pip install ngsolve")
    for name, work, settings in methods:
        for setting in settings:
            seconds, n_dofs, error = measure(work, *setting)
            rows.append((name, setting, seconds, n_dofs, error))
            print(f"| {name} | {n_dofs} | {seconds:.2f} | {error:.1e} |", flush=True)
            if seconds > 0.5 * BUDGET:
                break
    return rows


def growth():
    """Print time and memory for 20 modes up to 100 000 unknowns, and their exponents of growth."""
    sizes, times, memory = [], [], []
    start_memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    for divisions in (15, 21, 30, 42, 60, 84):
        start = time.process_time()
        system = fi.assemble(fi.mesh.rectangle(LENGTH, WIDTH, size=WIDTH / divisions), PLATE, {"boundary": "hinged"})
        fi.find_modes(system, n_modes=20)
        sizes.append(system.n_dofs)
        times.append(time.process_time() - start)
        memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
        print(f"| {sizes[-1]} | {times[-1]:.2f} | {memory[-1]:.0f} |", flush=True)
    power = np.polyfit(np.log(sizes[1:]), np.log(times[1:]), 1)[0]
    used = np.array(memory) - start_memory
    space = np.polyfit(np.log(sizes[2:]), np.log(used[2:]), 1)[0]
    print(f"time grows as unknowns**{power:.2f}, additional memory as unknowns**{space:.2f}")


def draw(rows, path):
    """Draw error against seconds, one line per method."""
    figure, axes = plt.subplots(figsize=(6.0, 4.0))
    for name, marker in zip(dict.fromkeys(row[0] for row in rows), "os^"):
        mine = np.array([(row[2], row[4]) for row in rows if row[0] == name])
        axes.loglog(mine[:, 0], mine[:, 1], marker=marker, label=name)
    axes.set(xlabel="processor time, mesh to modes [s]", ylabel="largest relative error of 200 frequencies")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.tight_layout()
    shared.save(path, figure, dpi=150)


def main():
    """Measure, print and draw the comparison."""
    parser = shared.parser(__doc__, Path("out"))
    parser.add_argument("--large", action="store_true")
    arguments = parser.parse_args()
    ours(6)  # so that imports and first calls are not timed
    if arguments.large:
        print("| unknowns | seconds | MB |\n| --- | --- | --- |")
        growth()
        return
    print("| method | unknowns | seconds | largest error |\n| --- | --- | --- | --- |")
    rows = compare()
    draw(rows, arguments.out / "modes_speed.png")


if __name__ == "__main__":
    main()
