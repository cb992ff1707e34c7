"""A struck plate as blows at several points see it: Ritz vectors started from each point, on meshes they share.

A map strikes one body again and again. Every mesh is factorised once for all its points; the vectors of each point then
cost one solution each, and are as good as those of a single blow there.
"""

from collections.abc import Callable

import numpy as np

from ..fe.assembly import System
from ..modes.modal import Modes
from ..modes.ritz import Krylov
from .vectors import Seen

# [-] points that share a mesh, to limit the work: each adds elements that shrink towards it; fewer make more meshes
TOGETHER = 8


class Krylovs(Krylov):
    """Vectors of the first point; `each` has those of all points, one after another."""

    each: list[Krylov]
    compliance: np.ndarray  # (n_points, n_points) in the frame, diagonal

    def __init__(self, system: System, points: np.ndarray, shift: float) -> None:
        super().__init__(system, points[:1], shift)
        self.each = [self, *(self.beside(point[None]) for point in points[1:])]
        self.compliance = np.diag([float(one.compliance[0, 0]) for one in self.each])


class Views(Seen):
    """`Seen` from several points (n_points, 2) [m]: with the same shift, meshes and number of vectors."""

    fine: Krylovs
    coarse: Krylovs
    kind = Krylovs

    def of(self, point: int, cutoff: Callable[[Modes, float], float]) -> Modes:
        """The target as seen from one of the points; ``cutoff`` as in `Seen.modes`."""
        return self._struck(self.fine.each[point], self.coarse.each[point], cutoff)[1]
