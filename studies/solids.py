"""Elastic solids of quadratic tetrahedra, by NGSolve, and the `fi.Body` that they are: modes and static unit loads.

What any program of finite elements would hand over: mass-normalised modes, rigid ones among them if nothing holds the
body, and the static solution under a unit load on one node, of a free body with inertia relief.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import shared
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from scipy.io import wavfile
from scipy.sparse.linalg import LinearOperator, eigsh

import fem_impact as fi

SLOW = (2.0 * np.pi * 20.0) ** 2  # [1/s^2] springs on all the mass that make a free body stiff, and are taken out again
APART = 0.02  # [-] of a frequency, in which the sound is searched for it
PLACE = 1e-6  # [-] of a body's size: how far a load may be from a node


@dataclass(frozen=True)
class Solved:
    """Modes and static solutions of a solid, in all its unknowns."""

    space: Any  # of NGSolve
    frequencies: np.ndarray  # (n_modes,) [Hz]
    columns: np.ndarray  # (n_unknowns, n_modes + n_loads) modes [kg**-0.5], then deflections [m]
    mass: float  # [kg]

    @property
    def n_modes(self) -> int:
        return len(self.frequencies)


def meshed(shape: Any, size: float, near: Iterable[tuple[Sequence[float], float]] = (), grading: float = 0.5) -> Any:
    """Tetrahedra of a shape of OCC, of a size [m], smaller about corners of the shape; on curved faces, curved."""
    import ngsolve as ng
    from netgen.occ import OCCGeometry

    small = list(near)
    for corner in shape.vertices:
        for place, fine in small:
            if np.allclose([corner.p.x, corner.p.y, corner.p.z], place, atol=1e-7):
                corner.maxh = fine
    mesh = ng.Mesh(OCCGeometry(shape).GenerateMesh(maxh=size, grading=grading))
    mesh.Curve(2)
    return mesh


def solve(
    mesh: Any, material: fi.Material, n_modes: int, loads: Iterable[tuple[Any, Any]] = (), held: str = ""
) -> Solved:
    """The lowest modes, six rigid ones included, and the static solutions under loads (point, force (3,) [N]).

    With ``held``, the name of faces that do not move, there are no rigid motions.
    """
    import ngsolve as ng

    ng.ngsglobals.msg_level = 0
    space = ng.VectorH1(mesh, order=2, dirichlet=held)
    u, v = space.TnT()
    shift = 0.0 if held else SLOW
    a, m = ng.BilinearForm(space), ng.BilinearForm(space)
    a += (ng.InnerProduct(stress(ng.Grad(u), material), ng.Sym(ng.Grad(v))) + shift * material.rho * u * v) * ng.dx
    m += material.rho * u * v * ng.dx
    for form in (a, m):
        form.Assemble()
    forces = []
    for point, force in loads:
        load = ng.LinearForm(space)
        load += (ng.CF(tuple(map(float, force))) * v)(*map(float, point))
        load.Assemble()
        forces.append(load.vec.FV().NumPy().copy())
    given, answer = a.mat.CreateColVector(), a.mat.CreateColVector()

    def product(matrix: Any) -> LinearOperator:
        def through(values: np.ndarray) -> np.ndarray:
            given.FV().NumPy()[:] = values.ravel()
            answer.data = matrix * given
            return answer.FV().NumPy().copy()

        return LinearOperator((space.ndof, space.ndof), through, dtype=float)

    stiff, weigh = product(a.mat), product(m.mat)
    inverse = product(a.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky"))
    rigid = np.zeros((space.ndof, 0)) if held else _rigid(space, weigh)
    weighed = weigh @ rigid if rigid.size else rigid

    def elastic(values: np.ndarray) -> np.ndarray:  # with inertia relief, and without any rigid motion
        found = inverse @ (values - weighed @ (rigid.T @ values))
        return np.asarray(found - rigid @ (weighed.T @ found))

    start = elastic(np.random.default_rng(0).standard_normal(space.ndof))
    back = LinearOperator(stiff.shape, elastic, dtype=float)
    values, vectors = eigsh(stiff, n_modes - rigid.shape[1], weigh, sigma=0.0, OPinv=back, v0=start)
    static = []
    for force in forces:
        moved = elastic(force)
        for _ in range(0 if held else 3):
            moved = elastic(force + shift * (weigh @ moved))
        static.append(moved)
    columns = np.column_stack([rigid, vectors, *static])
    frequencies = np.concatenate([np.zeros(rigid.shape[1]), np.sqrt(values - shift) / 2.0 / np.pi])
    return Solved(space, frequencies, columns, float(material.rho * ng.Integrate(1.0, mesh)))


def stress(gradient: Any, material: fi.Material) -> Any:
    """Stress [Pa] of an isotropic solid by its displacement's gradient."""
    import ngsolve as ng

    mu = material.E / 2.0 / (1.0 + material.nu)
    lame = 2.0 * mu * material.nu / (1.0 - 2.0 * material.nu)
    strain = ng.Sym(gradient)
    return lame * ng.Trace(strain) * ng.Id(3) + 2.0 * mu * strain


def _rigid(space: Any, weigh: LinearOperator) -> np.ndarray:
    """The six rigid motions, mass-normalised, (n_unknowns, 6)."""
    import ngsolve as ng

    turns = (0, -ng.z, ng.y), (ng.z, 0, -ng.x), (-ng.y, ng.x, 0)
    field, rigid = ng.GridFunction(space), np.zeros((space.ndof, 6))
    for column, motion in zip(rigid.T, ((1, 0, 0), (0, 1, 0), (0, 0, 1), *turns)):
        field.Set(ng.CF(motion))
        column[:] = field.vec.FV().NumPy()
    return np.asarray(np.linalg.solve(np.linalg.cholesky(rigid.T @ (weigh @ rigid)), rigid.T).T)


def body(solved: Solved, loads: Sequence[tuple[Any, Any]] = (), **more: Any) -> fi.Body:
    """The body at the corners of the surface's triangles; ``loads`` as they were solved, ``more`` as `fi.Body` takes.

    Nodes are numbered as NGSolve does, from 1.
    """
    mesh = solved.space.mesh
    skin = _skin(mesh)
    kept, flat = np.unique(skin, return_inverse=True)
    points = np.array([mesh[each].point for each in mesh.vertices])[kept]
    at = solved.columns.reshape(3, -1, solved.columns.shape[1])[:, kept].transpose(1, 0, 2)
    numbers, size = kept + 1, float(np.ptp(points, axis=0).max())
    named = []
    for place, force in loads:
        row = int(np.linalg.norm(points - np.asarray(place), axis=1).argmin())
        if np.linalg.norm(points[row] - place) > PLACE * size:
            raise ValueError(f"loads must act on nodes of the surface, got one at {place} m; make it a corner there")
        named.append((int(numbers[row]), tuple(map(float, force))))
    n = solved.n_modes
    return fi.Body(
        solved.frequencies, at[:, :, :n], points, more.pop("mass", solved.mass), numbers=numbers,
        cells=flat.reshape(-1, 3), static=at[:, :, n:], loads=named, **more,
    )  # fmt: skip


def _skin(mesh: Any) -> np.ndarray:
    """Triangles (n, 3) of corners that belong to one tetrahedron only, counted so that normals point outwards."""
    tets = mesh.ngmesh.Elements3D().NumPy()["nodes"][:, :4].astype(int) - 1
    faces, others = np.vstack([np.delete(tets, i, axis=1) for i in range(4)]), tets.T.ravel()
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    faces, others = faces[first[count == 1]], others[first[count == 1]]
    corners, inside = (np.array([mesh[each].point for each in mesh.vertices])[each] for each in (faces, others))
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    turned = np.einsum("ni,ni->n", across, inside - corners[:, 0]) > 0.0
    faces[turned] = faces[turned][:, ::-1]
    return faces


def listened(
    hit: fi.Response, body: fi.Body, where: Any, way: Any, name: str, near: np.ndarray, seconds: float,
    folder: Path | None = None,
) -> tuple[Path, np.ndarray]:  # fmt: skip
    """Write the velocity of a node along a direction as a WAV file; its path, and the peaks [Hz] of its spectrum.

    Each peak is the largest within `APART` of one of ``near``, between the lines by the parabola of its logarithm.
    """
    sound = fi.sound.of_node(hit, body, where, way, duration=seconds).audible().faded()
    path = (folder or shared.folder()) / f"{name}.wav"
    path.write_bytes(sound.wav())
    rate, samples = wavfile.read(path)
    level = np.log(np.abs(np.fft.rfft(samples * np.hanning(len(samples)))) + 1e-30)
    lines = np.fft.rfftfreq(len(samples), 1.0 / rate)
    found = []
    for frequency in near:
        inside = np.flatnonzero(np.abs(lines / frequency - 1.0) < APART)
        top = inside[level[inside].argmax()]
        left, middle, right = level[top - 1 : top + 2]
        found.append(lines[top] + 0.5 * (left - right) / (left - 2.0 * middle + right) * lines[1])
    return path, np.array(found)


def drawn(
    body: fi.Body, panels: Sequence[tuple[str, np.ndarray]], title: str, view: tuple[float, float] = (12.0, -60.0),
    most: float | None = 0.12,
) -> Any:  # fmt: skip
    """A figure of the body's surface, moved (n_nodes, 3) as each panel says and coloured by how far.

    The largest motion is drawn as the part ``most`` of the body's size; None draws all motions as large as they are.
    """
    figure = plt.figure(figsize=(3.1 * len(panels), 4.0), layout="constrained")
    figure.suptitle(title)
    middle = 0.5 * (body.nodes.min(axis=0) + body.nodes.max(axis=0))
    size = float(np.ptp(body.nodes, axis=0).max())
    for i, (name, moved) in enumerate(panels, 1):
        far = np.linalg.norm(moved, axis=1)
        largest = max(float(far.max()), 1e-300)
        nodes = body.nodes + (1.0 if most is None else most * size / largest) * moved
        colours = plt.get_cmap("viridis")(far[body.cells].mean(axis=1) / largest)
        corners = nodes[body.cells]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
        colours[:, :3] *= (0.65 + 0.35 * np.abs(across @ (0.4, -0.7, 0.6)))[:, None]
        axes = figure.add_subplot(1, len(panels), i, projection="3d")
        axes.add_collection3d(Poly3DCollection(corners, facecolors=np.clip(colours, 0.0, 1.0)))
        axes.set(**{f"{x}lim": (c - 0.5 * size, c + 0.5 * size) for x, c in zip("xyz", middle)})
        axes.set_box_aspect((1, 1, 1), zoom=1.35)
        axes.view_init(*view)
        axes.set_axis_off()
        axes.set_title(name, fontsize=10)
    return figure
