"""A body ready to be solved: its matrices in the units of its frame, and the shape functions of its elements."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._base import check, markup
from .._base.untyped import Sparse
from ..mesh import sketch
from ..mesh.meshes import Mesh
from . import plausible
from .corners import SAY, Singular
from .interpolation import Interpolation
from .section import Beam, Plate
from .supports import SupportedRim
from .theory import Frame, Strain, Theory


@dataclass(frozen=True, eq=False, repr=False)
class System(check.Brief):
    """Stiffness and mass of a supported body in the units of its frame, and the shape functions."""

    mesh: Mesh
    section: Plate | Beam
    supports: dict[str, Any]
    rules: Theory
    mass: float  # [kg] of the whole body
    frame: Frame
    K: Sparse = field(repr=False)  # (n_dofs, n_dofs) [-] for the unknowns not fixed by supports
    M: Sparse = field(repr=False)  # (n_dofs, n_dofs) [-]
    expand: Sparse = field(repr=False)  # (n_all, n_dofs) from these unknowns to all unknowns of the elements
    element_dofs: np.ndarray = field(repr=False)  # (n_local, n_cells) unknowns of each cell, among all
    space: Any = field(repr=False)  # shape functions
    rigid: np.ndarray = field(repr=False)  # (n_dofs, n_rigid) [-] mass-normalised rigid motions
    # those that only weak springs resist, (n_dofs, n_sprung) [-] mass-normalised, and the forces of these springs
    sprung: np.ndarray = field(repr=False)
    pull: np.ndarray = field(repr=False)
    # (n_rigid + n_sprung,) unknowns that, when fixed, just prevent these motions
    held: np.ndarray = field(repr=False)
    graded: bool = True  # whether rings of shrinking triangles surround singular corners
    # boundary of the triangles used, in the frame; None on a beam
    rim: SupportedRim | None = field(default=None, repr=False)
    corners: Mapping[int, Singular] = field(default_factory=dict, repr=False)  # by vertex, those that are singular
    softness: float = 1.0  # [-] largest inertia over stiffness on the body, in the frame; sets the shortest waves
    point_masses: tuple[Any, ...] = ()  # pairs of point [m] and mass [kg]
    point_supports: tuple[Any, ...] = ()  # pairs of point [m] and stiffness [N/m], infinite if hinged
    strain: Strain | None = field(default=None, repr=False)  # where K loses digits
    near: np.ndarray | None = None  # (n_points, 2) [m] points towards which the triangles shrink
    coarseness: float = 1.0  # [-] size of the triangles there, over the usual one
    layer: float = 1.0  # [-] size of triangles along free edges of a thick plate and at bends, over the usual one

    def _repr_html_(self) -> str:
        """Notebook view: the body with its supports, and a table of its size."""
        held = ", ".join(f"{name} {kind}" for name, kind in self.supports.items())
        rows = [("theory", self.theory), ("mass", f"{self.mass:.4g} kg"), ("supports", held), ("unknowns", self.n_dofs)]
        drawn = sketch.draw_body(
            self.mesh, supports=self.supports, title=f"Outline of a body of {self.mass:.4g} kg: {held}"
        )
        return markup.side_by_side(drawn, markup.table(rows))

    @property
    def theory(self) -> str:
        """The theory: "kirchhoff" or "mindlin" of a plate, "euler" or "timoshenko" of a beam."""
        return self.rules.name

    @property
    def element(self) -> str:
        """The elements: one of those of the theory."""
        return self.rules.element

    @property
    def ribbed(self) -> bool:
        """Whether ribs stiffen it, which hang far below the middle and move along the plane as it bends."""
        return isinstance(self.section, Plate) and bool(self.section.ribs)

    @property
    def unresolved(self) -> float:
        """Approximate relative error [-] that singular corners leave on any mesh."""
        return max((corner.left for corner in self.corners.values()), default=0.0)

    @property
    def n_dofs(self) -> int:
        """Number of unknowns not fixed by supports."""
        return self.K.shape[0]

    @property
    def notes(self) -> tuple[str, ...]:
        """What mesh and theory assumed, and numbers that are probably a slip of a unit."""
        assumed: tuple[str, ...] = ()
        given = self.section.material
        if self.theory == "mindlin" and given.G is not None and given.G_yz is None:
            # softwood has 0.064 E in its plane and 0.003 E across the grain, a twentieth (Wood Handbook, table 5-1)
            assumed = (
                f"G_yz is not stated and taken as that in the plane, G = {given.G:g} Pa; the rolling shear modulus of "
                f"wood is about {given.G / 20.0:.2g}",
            )
        if self.unresolved > SAY:
            corner = f"corners leave the frequencies uncertain by {100.0 * self.unresolved:.2g} % at most"
            why = "hinged edges that meet near or beyond 180 degrees do, and free notches"
            assumed = (*assumed, f"{corner}, whatever the mesh, each by its `frequency_error`: {why}")
        return plausible.together(notes_on(self.mesh, self.section), assumed)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Whether each point (n_points, dimension) [m] lies on the body, (n_points,) bool."""
        return self.space.locate(self.frame.local(points))[1]

    def interpolate(self, points: np.ndarray, spread: bool = True) -> Sparse:
        """Matrix (n_points, n_dofs) [-] from the unknowns to the deflection at points (n_points, dimension) [m].

        On a thick plate it is the mean over the disk on which a force at the point acts, see `thick`, if ``spread``.
        """
        rows = Interpolation(self.rules, self.section, self.space, self.frame, self.element_dofs)
        return rows.rows(points, self.expand, spread) @ self.expand


def notes_on(mesh: Mesh, section: Plate | Beam) -> tuple[str, ...]:
    """What a mesh assumed, and numbers of the body that are probably a slip of a unit."""
    sides = np.ptp(mesh.points, axis=0)
    ribs = plausible.notes_on_ribs(getattr(section, "ribs", ()), sides)
    return plausible.together(mesh.notes, plausible.doubted_sizes(sides, section), tuple(ribs))
