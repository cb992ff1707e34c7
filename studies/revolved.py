"""Solids of revolution, by NGSolve: their modes wave by wave around the axis from the section alone, and the solids.

With m waves around, ``u = (u_r cos(m t), u_t sin(m t), u_z cos(m t))``; the section (r, z) bears cubic triangles. Each
mode of m > 0 stands for two, a quarter of a wave apart.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import eigsh

import fem_impact as fi


def section(curves: Sequence[np.ndarray], size: float, held: int | None = None) -> Any:
    """The mesh of a section; ``held`` is the number of a curve that does not move.

    Parameters
    ----------
    curves : sequence of arrays (n, 2) [m]
        Radius and height of points that splines pass, of two points straight lines; each begins where the last ended.
    size : float [m]
    """
    import ngsolve as ng
    from netgen.occ import OCCGeometry

    mesh = ng.Mesh(OCCGeometry(_face(curves, held, upright=False), dim=2).GenerateMesh(maxh=size))
    mesh.Curve(3)
    return mesh


def solid(curves: Sequence[np.ndarray], held: int | None = None) -> Any:
    """A shape of OCC whose section with the plane y = 0 has these curves; all their ends are corners at y = 0."""
    from netgen.occ import Axis, Z

    return _face(curves, held, upright=True).Revolve(Axis((0, 0, 0), Z), 360)


def _face(curves: Sequence[np.ndarray], held: int | None, upright: bool) -> Any:
    from netgen.occ import Face, Pnt, Segment, SplineInterpolation, Wire

    edges = []
    for curve in curves:
        points = [Pnt(r, 0.0, z) if upright else Pnt(r, z, 0.0) for r, z in curve.tolist()]
        edges.append(Segment(*points) if len(points) == 2 else SplineInterpolation(points))
    if not upright:
        for number, edge in enumerate(edges):
            edge.name = "held" if number == held else "free"
    return Face(Wire(edges))


def frequencies(mesh: Any, material: fi.Material, waves: int, count: int) -> np.ndarray:
    """The lowest frequencies (count,) [Hz] with so many waves around; of a section of which something is held."""
    import ngsolve as ng

    ng.ngsglobals.msg_level = 0
    space = ng.FESpace([ng.H1(mesh, order=3, dirichlet="held")] * 3)
    r, m = ng.x, float(waves)

    def strains(ur: Any, ut: Any, uz: Any) -> tuple[list, list]:
        gr, gt, gz = (ng.grad(each) for each in (ur, ut, uz))
        stretched = [gr[0], (ur + m * ut) / r, gz[1]]
        return stretched, [gr[1] + gz[0], gt[0] - (ut + m * ur) / r, gt[1] - m * uz / r]

    mu = material.E / 2.0 / (1.0 + material.nu)
    lame = 2.0 * mu * material.nu / (1.0 - 2.0 * material.nu)
    trial, test = space.TnT()
    (e, g), (f, h) = strains(*trial), strains(*test)
    stiff, weigh = ng.BilinearForm(space), ng.BilinearForm(space)
    stretched = lame * sum(e) * sum(f) + sum(2.0 * mu * a * b for a, b in zip(e, f))
    stiff += (stretched + mu * sum(a * b for a, b in zip(g, h))) * r * ng.dx
    weigh += material.rho * sum(a * b for a, b in zip(trial, test)) * r * ng.dx
    free, parts = np.flatnonzero(list(space.FreeDofs())), []
    for form in (stiff, weigh):
        form.Assemble()
        rows, columns, values = (np.asarray(each) for each in form.mat.COO())
        parts.append(csr_matrix((values, (rows, columns)), shape=(space.ndof,) * 2)[free][:, free].tocsc())
    values = eigsh(parts[0], count, parts[1], sigma=0.0, v0=np.ones(len(free)), return_eigenvectors=False)
    return np.asarray(np.sqrt(np.sort(values)) / 2.0 / np.pi)
