"""Stiffening by stretching: a bent plate, or a beam between held ends, gets longer as it bends, and so stiffer.

Of a plate it is von Karman's cubic term: the plane stretches by ``1/2 grad w grad w`` and settles where its energy is
least (`membrane`), a quartic of the modes. Hinged and clamped edges cannot slip; free ones may move in the plane, too,
and a plate that is free all round stretches where its bent surface cannot be unrolled. Of a beam the tension
is ``N = E A s / (2 L)`` with ``s = int w'**2``, and the energy ``N s / 4``; if it is not uniform, L / (E A) becomes an
integral.

A curved, ribbed or unevenly layered plate, whose plane answers to its linear motion, has quadratic forces besides:
pressed on its top a dome softens, and may snap through, and from below it hardens.

It is the leading term: good for deflections up to about the thickness, where the frequency of a hinged square rises by
half. Only the first 40 modes of a plate stretch, and 18 or more stress fields count: half as many of both change the
restitution by 2e-4 at a deflection of one thickness (`studies/verification/is_the_model_right.py`).

References
----------
Chu and Herrmann (1956), J. Appl. Mech. 23, 532-540; Woinowsky-Krieger (1950), J. Appl. Mech. 17, 35-36 (beams).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._base import check
from .._base.remembered import gauss_rule
from .._base.threads import one_thread
from ..fe import membrane, slopes
from ..fe.assembly import System, assemble, support_of_facets
from ..fe.section import PLANE, SOFT, Beam, Plate
from ..fe.shallow import strained
from ..mesh import meshes
from .disk import DiskShapes
from .modal import Modes
from .rectangle import RectangleShapes
from .ritz import RitzShapes
from .shapes import FieldShapes, Shapes, unwrap_shapes
from .slender import BeamShapes
from .timoshenko import TimoshenkoShapes

HELD = "clamped", "hinged", SOFT  # supports that hold an edge in the plane, too
# [-] modes that stretch: entries of its forms grow with their square, and high modes swing too little to matter
MOST = 40
CANNOT = "stretching=True works for plates, held or free along their edges, and for beams held at both ends"
ELASTIC = "its edge is elastic, which does not say how its plane is held"


@dataclass(frozen=True, eq=False)
class Stretching(check.Locked):
    """The energy ``V = 1/4 sum_k ((a_k q + q' B_k q)**2 - (a_k q)**2)`` [J] that stretching adds to modes q.

    The rows a are there if the plane answers to the linear motion; q [m kg**0.5] counts along the blow, away
    from the striker.
    """

    forms: np.ndarray  # (n_forms, n_modes, n_modes) [kg**-0.5 m**-1 s**-1] the matrices B, symmetric
    linear: np.ndarray  # (n_forms, n_modes) [s**-1] the rows a, or (0, n_modes)

    def truncated(self, n_modes: int) -> "Stretching":
        """That of the first modes only."""
        forms, linear = self.forms[:, :n_modes, :n_modes], self.linear[:, :n_modes]
        return Stretching(np.ascontiguousarray(forms), np.ascontiguousarray(linear))


def stretch(modes: Modes) -> Stretching:
    """How the modes of a plate, or of a beam between held ends, stretch it; raise ValueError for other bodies.

    They remember it, as it takes longer than a blow.
    """
    found: Stretching = modes.known.recall("stretching", lambda: _stretched(modes))
    return found


@one_thread
def _stretched(modes: Modes) -> Stretching:
    section, rigid = modes.section, modes.n_rigid
    if section is None or not modes.dimension:
        why = "its section is not known" if modes.dimension else "a mass has none"
        raise ValueError(f"{CANNOT}, but {why}; leave it out")
    base, amplitude, mix = unwrap_shapes(modes.shapes)
    if isinstance(section, Plate):
        n = min(MOST + rigid, modes.n_modes)
        if n == rigid:
            raise ValueError(f"{CANNOT}, but it has no mode that bends; leave it out")
        sheet, steep, taut = _sheet(base if mix is not None else base.take(n), section)

        def mixed(values: np.ndarray) -> np.ndarray:
            values = amplitude * values
            return (values if mix is None else values @ mix[:, :n])[..., rigid:]

        found, linear = membrane.stretching_forms(
            sheet, lambda cells, x: mixed(steep(cells, x)), modes.omega[rigid:n],
            None if taut is None else lambda pieces: mixed(taut(pieces)),
        )  # fmt: skip
        still = rigid, 0  # the plane follows a plate that tilts
        found = np.pad(np.sqrt(2.0) * found, ((0, 0), still, still))
        # rises and heights in layers count towards the striker, the deflection of a blow away from it
        return Stretching(found, np.zeros((0, n)) if taut is None else np.pad(-np.sqrt(2.0) * linear, ((0, 0), still)))
    gram, soft = _tension(base, section)
    gram = amplitude**2 * (gram if mix is None else mix.T @ gram @ mix)
    return Stretching((gram / np.sqrt(2.0 * soft))[None], np.zeros((0, len(gram))))


def _check_supports(system: System) -> None:
    """Raise ValueError unless it is known what holds the plane of a body of elements, and its slopes are known."""
    kinds: Any = support_of_facets(system.mesh, dict(system.supports), system.rules.words)
    if isinstance(system.section, Plate) and not system.rules.has_plane:  # whose linear motion has the same plane
        kinds = support_of_facets(system.mesh, dict(system.section.in_plane), PLANE, "in_plane", kinds)
    if not system.rules.has_plane and not all(isinstance(kind, str) for kind in kinds):
        raise ValueError(f"{CANNOT}, but {ELASTIC}; say so with in_plane, hold it, or leave stretching out")
    if system.mesh.dimension == 1 and not set(kinds) <= set(HELD):
        raise ValueError(f"{CANNOT}, but an end is free; hold it, or leave stretching out")
    if system.element == "morley":
        raise ValueError("stretching=True does not work with element 'morley'; take 'argyris', or leave stretching out")


def _sheet(shapes: Shapes, section: Plate) -> tuple[membrane.Sheet, membrane.Steep, membrane.Taut | None]:
    """The plane of a plate, the slopes of its shapes, and the strains by their linear motion, if its plane answers."""
    if isinstance(shapes, (FieldShapes, RitzShapes)):
        system = shapes.system
        _check_supports(system)
        moved, unit = system.expand @ shapes.vectors, system.frame.mass**-0.5 / system.frame.length

        def by_elements(cells: np.ndarray, x: np.ndarray) -> np.ndarray:
            slope = system.space.functions(cells, x, (1,))[0]  # (n, 2, n_q, n_local)
            return unit * (slope @ moved[system.element_dofs.T[cells]][:, None]).transpose(0, 2, 1, 3)

        sheet = membrane.Sheet.of(system)

        def taut(pieces: np.ndarray) -> np.ndarray:
            cells = sheet.cells[pieces]
            parts = strained(system.space, cells, sheet.area[pieces], sheet.x[pieces])
            found = unit * (parts @ moved[system.element_dofs.T[cells]][:, None])  # (n, n_q, 6, n_modes)
            return np.asarray(found[:, :, :3] + sheet.neutral[pieces] @ found[:, :, 3:])

        return sheet, by_elements, taut if system.rules.has_plane else None
    coarsest = 0.25  # [-] triangles over the shorter side: 1e-4 too stiff in the first mode
    if isinstance(shapes, RectangleShapes):
        shortest = np.pi / (np.pi * shapes.numbers / (shapes.length, shapes.width)).max()
        size = min(shortest, coarsest * min(shapes.length, shapes.width))
        mesh = meshes.rectangle(shapes.length, shapes.width, size=size)
    elif isinstance(shapes, DiskShapes):
        size = shapes.radius * min(np.pi / shapes.z.max(), 2.0 * coarsest)
        mesh = meshes.disk(shapes.radius, size=size)
    else:
        raise ValueError(f"{CANNOT}, but its shapes are known at points only; leave it out")
    system = assemble(mesh, section, {} if getattr(shapes, "edge", "") == "free" else {"boundary": "clamped"})
    frame = system.frame
    return membrane.Sheet.of(system), lambda _, x: shapes.slopes(frame.centre + frame.length * x), None


def _tension(shapes: Shapes, section: Beam) -> tuple[np.ndarray, float]:
    """``int w_i' w_j'`` (n, n) of a beam, and its length over E A."""
    if isinstance(shapes, (FieldShapes, RitzShapes)):
        _check_supports(shapes.system)
        return slopes.lengthening_of_beam(shapes.system, shapes.vectors)
    if isinstance(shapes, (BeamShapes, TimoshenkoShapes)):
        if not set(shapes.ends) <= set(HELD):
            raise ValueError(f"{CANNOT}, but an end is free; hold it, or leave stretching out")
        area = float(section.inertia(np.zeros((1, 1)))[0]) / section.material.rho
        waves = shapes.k if isinstance(shapes, BeamShapes) else shapes.stoutness.waves(shapes.p)[0]
        # forty, and one more for each radian of the highest mode: six per wave
        x, dx = gauss_rule(40 + int(waves.max()))
        slope = shapes.slopes(x)
        gram = (dx[:, None] * slope).T @ slope / shapes.length
        return gram, shapes.length / (section.material.E * area)
    raise ValueError(f"{CANNOT}, but its shapes are known at points only; leave it out")
