"""Integrals of a body's bending shapes that show how thick, how stretched and how loaded by air it is.

A mode of deflection w has the slopes grad w, the shear forces Q = div M of its bending moments, and at free edges a
twisting moment M_nt that Kirchhoff's theory leaves there and the true plate cannot carry. To first order, rotary
inertia multiplies omega**2 by 1 - int (rho h**3 / 12) |grad w|**2 / int rho h w**2, shear by
1 - int |Q|**2 / (kappa G h) / (omega**2 int rho h w**2), and a free edge by 1 - 2 int M_nt**2 l / (2 D66) ds /
(omega**2 int rho h w**2), where the twist fades over the length l = h / sqrt(12 kappa). The last is what shortens
Saint-Venant's torsion of a strip, 1 - 0.63 h / b. Where edges meet or supports change, Q may grow as r**(z - 3) with
the exponents of `corners`, but in a thick plate only down to about the same length l: nearer, |Q|**2 is left out. Many
modes are needed and few are integrated: the rest follow from those, as rotary inertia and shear go with omega and the
edge with none of it.

References
----------
Mindlin (1951), J. Appl. Mech. 18, 31-38; Cowper (1966), J. Appl. Mech. 33, 335-340; Timoshenko and Goodier, Theory of
Elasticity, art. 109 (torsion of a strip).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from .._base.remembered import gauss_rule
from ..fe import beam_elements
from ..fe.assembly import System, support_of_facets
from ..fe.corners import edge_meetings
from ..fe.elements import triangle_gauss_points
from ..fe.residual import Moments
from ..fe.section import KINDS, PLANE, SHEAR, Beam, Plate, size_at
from ..fe.springs import at_facets
from ..fe.theory import unknowns_of_cells
from ..mesh.meshes import Mesh
from ..modes.disk import DiskShapes, bessel
from ..modes.modal import Modes
from ..modes.rectangle import RectangleShapes
from ..modes.ritz import RitzShapes
from ..modes.shapes import ElementShapes, FieldShapes, unwrap_shapes
from ..modes.slender import BeamShapes
from ..modes.timoshenko import BeamlikeShapes, TimoshenkoShapes
from ..modes.unstated import lumped_mass

# [-] flexible modes that are integrated: a blow depends on few others one by one, which follow from the upper ten
LOW = 40
FIXED = {"clamped", "hinged"}  # supports of ends between which a beam cannot get shorter, and of edges of a plate
FADES = 1.0 / np.sqrt(12.0 * SHEAR)  # [-] of the thickness, fact: over this length a twist that shear undoes fades


@dataclass(frozen=True, eq=False)
class Bending:
    """Integrals of mass-normalised shapes, (n_modes,) each; zero for rigid motions."""

    wave: np.ndarray  # [rad/m] root of int |grad w|**2 / int w**2
    slope: np.ndarray  # [1/kg] int |grad w|**2, on a beam [1/(kg m)] int w'**2
    volume: np.ndarray  # [m**2 kg**-0.5] int w of a plate; zero for modes that are not integrated
    rotary: np.ndarray | None  # [-] rotary inertia over inertia; None if the thickness is not known
    shear: np.ndarray | None  # [-] energy of shear over that of bending
    edge: np.ndarray | None  # [-] energy of twist that free edges give up, over that of bending
    turning: np.ndarray | None = None  # (n_rigid, n_rigid) [-] rotary inertia of the rigid motions, see `heavier`

    @property
    def thick(self) -> np.ndarray | None:
        """Relative drop of omega**2 of a thick body to first order, (n_modes,) [-]."""
        if self.rotary is None or self.shear is None or self.edge is None:
            return None
        return self.rotary + self.shear + self.edge

    def mean_wave(self, energy: np.ndarray) -> float:
        """Wavenumber [rad/m] of modes with some energies (n_modes,), root of the mean square; zero without energy."""
        return float(np.sqrt(energy @ self.wave**2 / (energy.sum() or 1.0)))

    def heavier(self, rows: np.ndarray) -> np.ndarray:
        """Shapes (n_points, n_modes) of rigid motions whose inertia has the rotary one, too, and elastic ones as given.

        The thin theory gives a body that turns none. It is known exactly: ``int rho h**3 / 12 grad w . grad w``.
        """
        result = rows.copy()
        if self.turning is not None and self.turning.size:
            share, turn = np.linalg.eigh(self.turning)
            result[:, : len(turn)] = rows[:, : len(turn)] @ (turn / np.sqrt(1.0 + share)) @ turn.T
        return result


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of a body besides its modes."""

    modes: Modes
    section: Plate | Beam | None
    extent: float  # [m**2] area of a plate, [m] length of a beam
    held: float  # [-] share of its edge that is held in the plane, too
    perimeter: float  # [m] of a plate
    sprung: bool = False  # whether an edge is elastic, so that it is not known what holds its plane

    @property
    def plate(self) -> Plate | None:
        """Its section if it is a plate of known thickness."""
        return self.section if isinstance(self.section, Plate) else None

    @property
    def shaped(self) -> bool:
        """Whether it is curved, ribbed or unevenly layered, so that its plane answers to its linear motion."""
        return self.plate is not None and not self.plate.plain

    @property
    def per_extent(self) -> float:
        """Mean mass per area [kg/m**2] or length [kg/m]."""
        return self.modes.mass / self.extent

    @property
    def thickness(self) -> float | None:
        """Mean thickness [m] in the direction of the blow; None if it is not known."""
        if self.section is None:
            return None
        name = "thickness" if isinstance(self.section, Plate) else "height"
        size = getattr(self.section, name)
        return float(size_at(self.section, name, self.modes.shapes.grid()[0]).mean() if callable(size) else size)


def known_of(modes: Modes) -> Known | None:
    """What is known of a plate or beam by its modes; None if its shapes are known at points only, or it is rigid."""
    shapes = unwrap_shapes(modes.shapes)[0]
    if isinstance(shapes, ElementShapes):
        system = shapes.system
        return bending_around(modes, modes.section, system.mesh, system.supports, system.rules.words)
    if isinstance(shapes, RectangleShapes):
        sides = shapes.length, shapes.width
        return Known(modes, modes.section, sides[0] * sides[1], 1.0, 2.0 * sum(sides))
    if isinstance(shapes, DiskShapes):
        a = shapes.radius
        return Known(modes, modes.section, np.pi * a**2, float(shapes.edge != "free"), 2.0 * np.pi * a)
    if isinstance(shapes, BeamlikeShapes):
        return Known(modes, modes.section, shapes.length, float({*shapes.ends} <= FIXED), 0.0)
    return None


def has_quadratic_shapes(modes: Modes) -> bool:
    """Whether the shapes are those of Morley's element, whose quadratics have no shear force."""
    shapes = unwrap_shapes(modes.shapes)[0]
    return isinstance(shapes, ElementShapes) and shapes.system.element == "morley"


def bending_around(
    modes: Modes, section: Plate | Beam | None, mesh: Mesh, supports: Any, words: tuple[str, ...] = KINDS
) -> Known:
    """What is known of a body with a mesh; ``words`` are those of its theory for supports."""
    kinds = support_of_facets(mesh, dict(supports), words)
    if mesh.dimension == 1:
        return Known(modes, section, float(np.ptp(mesh.points)), float({*kinds} <= FIXED), 0.0)
    length = mesh.chords
    stated = dict(section.in_plane) if isinstance(section, Plate) else {}
    plane: Any = support_of_facets(mesh, stated, PLANE, "in_plane", kinds)  # type: ignore[arg-type]
    holds = np.array([kind in {*FIXED, "held"} for kind in plane])
    sprung = not all(isinstance(kind, str) for kind in plane)
    return Known(modes, section, mesh.area, float(length[holds].sum() / length.sum()), float(length.sum()), sprung)


def flexible_vectors(shapes: FieldShapes | RitzShapes, n_rigid: int, number: int) -> np.ndarray:
    """The first flexible shapes in the unknowns of their system, (n_dofs, number); of Ritz pairs no others are made."""
    if isinstance(shapes, FieldShapes):
        return shapes.vectors[:, n_rigid : n_rigid + number]
    return shapes.basis.T @ shapes.turn[:, :number]


def integrate_shapes(body: Known) -> Bending:
    """The integrals of a body's shapes; those of high modes follow from the low ones."""
    modes = body.modes
    shapes, amplitude, mix = unwrap_shapes(modes.shapes)
    n_rigid = modes.n_rigid
    # of four Ritz pairs the lowest one is a mode: those above are packets, whose shear is singular
    few = (modes.n_modes - n_rigid) // 4 if isinstance(shapes, RitzShapes) else LOW
    low = slice(n_rigid, min(n_rigid + max(1, min(LOW, few)), modes.n_modes))
    thick = body.section is not None and not has_quadratic_shapes(modes)
    if isinstance(shapes, (FieldShapes, RitzShapes)):
        vectors = flexible_vectors(shapes, n_rigid, low.stop - n_rigid)
        found = (_plate if modes.dimension == 2 else _beam)(shapes.system, vectors, thick)
    else:
        steep, force, volume, edge = _by_formula(shapes.part(low), body)  # type: ignore[attr-defined]
        rotary = shear = 0.0  # of a uniform, if a plate isotropic body, over its squared wavenumber [m**2]
        if body.section is not None and not modes.thick:  # both are in the frequencies of a thick body
            section, origin = body.section, np.zeros((1, modes.dimension))
            rotary = float(section.rotary(origin)[0] / section.inertia(origin)[0])
            shear = float(section.stiffness(origin).flat[0] / section.shear(origin).flat[0])
        zero = np.zeros(len(steep))
        found = np.stack([body.extent * steep, volume + zero, rotary * steep, shear * force, edge + zero])
    # air mixes modes little, and makes them heavier
    left = np.ones(low.stop - low.start) if mix is None else np.linalg.norm(mix[:, low], axis=0)
    found[:3] *= np.stack([(amplitude * left) ** 2, amplitude * left, left**2])
    every = np.zeros((5, modes.n_modes))
    every[:, low] = found
    if low.stop < modes.n_modes:
        top = slice(low.stop - max(1, (low.stop - low.start) // 4), low.stop)  # shows how those above go on
        for row in (0, 2, 3):
            every[row, low.stop :] = np.median(every[row, top] / modes.omega[top]) * modes.omega[low.stop :]
        every[4, low.stop :] = np.median(found[4])
    wave = np.sqrt(np.maximum(every[0], 0.0) * body.per_extent)
    rest: Any = every[2:] if thick else (None, None, None)
    turning = None
    if thick and n_rigid and body.section is not None:
        points, cells = modes.shapes.grid()
        if (masses := lumped_mass(points, cells)) is not None:
            pairs, weight = masses
            rotary = body.extent * float(weight @ body.section.rotary(points[pairs].mean(axis=1)))
            level = np.column_stack([np.ones(len(points)), points])
            slope = np.linalg.lstsq(level, modes.shapes.take(n_rigid).at(points), rcond=None)[0][1:]
            turning = rotary * slope.T @ slope
    return Bending(wave, every[0], every[1], rest[0], rest[1], rest[2], turning)


def _plate(system: System, vectors: np.ndarray, thick: bool) -> np.ndarray:
    """Slope, volume, rotary inertia, shear and edge (5, n) of a plate's shapes (n_dofs, n) by elements."""
    space: Any = system.space
    frame, section = system.frame, system.section
    assert isinstance(section, Plate)
    cells = np.arange(len(space.origin))
    local, share = triangle_gauss_points(3)  # slopes to 1e-3, as the wave of a mode spans several triangles
    x = space.straight(cells, local - 1.0 / 3.0)
    area = np.abs(np.linalg.det(space.jacobian))[:, None] * share  # (n_cells, n_q)
    moved, flat = unknowns_of_cells(system, vectors), frame.to_metres(x)  # (n_cells, 21, n), (n_cells n_q, 2)
    value, slope = space.functions(cells, x, (0, 1))
    steep = np.einsum("eiqk,eiqk->eqk", *(2 * [slope @ moved[:, None]]))
    result = np.zeros((5, vectors.shape[1]))
    result[0] = np.einsum("eq,eqk->k", area, steep) / frame.mass
    result[1] = np.einsum("eq,eqk->k", area, value @ moved) * frame.length**2 * frame.mass**-0.5
    if not thick:
        return result
    h = size_at(section, "thickness", flat).reshape(area.shape)
    inertia = section.inertia(flat).reshape(area.shape)
    result[2] = np.einsum("eq,eqk->k", area * inertia * h**2 / 12.0, steep) / (frame.inertia * frame.length**2)
    moments = Moments(system)
    force = moments.derivatives(cells, x, 1)  # (n_cells, 2, 3, n_q, 21)
    Q = np.stack([(q @ moved) for q in (force[:, 0, 0] + force[:, 1, 2], force[:, 0, 2] + force[:, 1, 1])])
    soft = np.linalg.inv(section.shear(flat)).reshape(*area.shape, 2, 2) * frame.stiffness / frame.length**2
    energy = (vectors * (system.K @ vectors)).sum(axis=0)
    kinds = support_of_facets(system.mesh, system.supports, system.rules.words)
    places = [vertex for vertex, *_ in edge_meetings(system.mesh, kinds)]
    away = KDTree(system.mesh.points[places]).query(flat)[0] if places else np.full(len(flat), np.inf)
    plane = np.where(away.reshape(area.shape) > h * FADES, area, 0.0)
    result[3] = np.einsum("eq,aeqk,eqab,beqk->k", plane, Q, soft, Q, optimize=True) / energy
    rim = system.rim
    free = np.flatnonzero(np.array(rim.kinds) == "free") if rim is not None else np.zeros(0, int)
    if len(free) and rim is not None:
        at, _, place, ds, normal = at_facets(space, rim.facets[free])
        nx, ny = np.moveaxis(normal, 2, 0)[..., None]  # its sign does not matter
        moment = moments.derivatives(at, place, 0)[:, 0]
        twist = ((moment[:, 1] - moment[:, 0]) * nx * ny + moment[:, 2] * (nx**2 - ny**2)) @ moved[at]
        flat = frame.to_metres(place)
        h = size_at(section, "thickness", flat).reshape(ds.shape)
        stiff = section.stiffness(flat)[:, 2, 2].reshape(ds.shape) / frame.stiffness
        result[4] = np.einsum("eq,eqk->k", ds * h * FADES / frame.length / stiff, twist**2) / energy
    return result


def _beam(system: System, vectors: np.ndarray, thick: bool) -> np.ndarray:
    """The same of a beam's shapes by elements; the shear force is the slope of the polynomial moment."""
    space: Any = system.space
    frame, section = system.frame, system.section
    assert isinstance(section, Beam)
    x, dx = beam_elements.quadrature(space)
    moved, place = unknowns_of_cells(system, vectors), frame.to_metres(x)
    slope, bend = space.functions(np.arange(len(x)), x[..., None], (1, 2))
    steep = (slope @ moved) ** 2  # (n_cells, n_q, n)
    result = np.zeros((5, vectors.shape[1]))
    result[0] = np.einsum("eq,eqk->k", dx, steep) / (frame.length * frame.mass)
    if not thick:
        return result
    stiffness, gyration = section.stiffness(place).reshape(x.shape), section.rotary(place).reshape(x.shape)
    result[2] = np.einsum("eq,eqk->k", dx * gyration, steep) / (frame.inertia * frame.length**2)
    moment = (stiffness / frame.stiffness)[..., None] * (bend @ moved)
    node = np.polynomial.legendre.leggauss(x.shape[1])[0]
    fit = np.linalg.inv(np.polynomial.legendre.legvander(node, len(node) - 1))
    turn = np.polynomial.legendre.legval(node, np.polynomial.legendre.legder(np.eye(len(node)))).T @ fit
    Q = np.einsum("pq,eqk->epk", turn, moment) * (2.0 / space.length)[:, None, None]
    soft = frame.stiffness / frame.length**2 / section.shear(place).reshape(x.shape)
    result[3] = np.einsum("eq,eqk->k", dx * soft, Q**2) / (vectors * (system.K @ vectors)).sum(axis=0)
    return result


def _by_formula(
    shapes: RectangleShapes | DiskShapes | BeamShapes | TimoshenkoShapes, body: Known
) -> tuple[np.ndarray, np.ndarray, Any, Any]:
    """Squared wavenumbers [rad**2/m**2] of slopes and of shear forces, volume and edge of closed formulas, (n_modes,).

    Those of a hinged rectangle are exact; others are by quadrature along the beam or the radius of the disk.
    """
    if isinstance(shapes, RectangleShapes):
        m, n = shapes.numbers.T
        k = np.pi**2 * ((m / shapes.length) ** 2 + (n / shapes.width) ** 2)
        odd = (1.0 - (-1.0) ** m) * (1.0 - (-1.0) ** n)
        return k, k, 2.0 * shapes.length * shapes.width * odd / (np.pi**2 * m * n), 0.0
    x, dx = gauss_rule(200)  # 20 and more for each wave of the fortieth mode
    if isinstance(shapes, DiskShapes):
        return _disk(shapes, body, x[:, None], (dx * x)[:, None])
    steep = dx @ shapes.slopes(x) ** 2 / shapes.length**2
    if isinstance(shapes, TimoshenkoShapes):
        return steep, 0.0 * steep, 0.0, 0.0
    k, (a, b, c, d), x = shapes.k, shapes.weights.T, x[:, None]
    third = k * (a * np.sin(k * x) - b * np.cos(k * x) - c * np.exp(-k * x) + d * np.exp(k * (x - 1.0)))  # over k**2
    return steep, dx @ third**2 / shapes.length**2, 0.0, 0.0


def _disk(
    shapes: DiskShapes, body: Known, r: np.ndarray, dr: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, Any]:
    """The same of a disk, from radii (n_r, 1) [-] and their weights, which are times r."""
    z, n, a = shapes.z, shapes.order, shapes.radius

    def parts(r: np.ndarray) -> tuple[np.ndarray, ...]:
        """J and I and their slopes at radii (n_r, 1)."""
        grown, (j, dj, i, di) = shapes.weight * np.exp(z * (r - 1.0)), bessel(n, z * r)
        return j, dj * z, i * grown, di * grown * z

    j, dj, i, di = parts(r)
    whole = (dr * (j + i) ** 2).sum(axis=0)
    steep = (dr * ((dj + di) ** 2 + (n * (j + i) / r) ** 2)).sum(axis=0) / whole
    force = (dr * ((di - dj) ** 2 + (n * (i - j) / r) ** 2)).sum(axis=0) / whole  # of the Laplacian, over z**4
    mean = 2.0 * np.pi * (dr * (j + i)).sum(axis=0) * shapes.scale
    edge: Any = 0.0
    if shapes.edge == "free" and body.thickness is not None:
        j, dj, i, di = (part[0] for part in parts(np.ones((1, 1))))
        edge = 2.0 * (1.0 - shapes.nu) * body.thickness * FADES / a * (n * (dj + di - j - i)) ** 2 / (z**4 * whole)
    return steep / a**2, force / a**2, np.where(n == 0, mean, 0.0) * a**2, edge
