"""A struck plate described by Ritz vectors started from the blow itself, on a mesh and in a number that the blow needs.

No mode is found. The tolerance sets the shift of the vectors and the first mesh; blows with fewer vectors and on a
coarser mesh (`Modes.poorer`) tell what either costs, and `Seen.improved` answers the larger of the two.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..fe import point_load, refinement
from ..fe.section import Plate
from ..impact.response import Error
from ..modes.modal import Modes
from ..modes.ritz import Krylov
from .target import Stages, Target

# [-] value at a tolerance of 1e-2 or more, and power of 1e-2 / tolerance with which it grows
WAVES = 1.6, 0.37  # highest frequency that the first mesh resolves, over that of the contact
SHIFT = 6.0, 1.0 / 6.0  # shift over the angular frequency of the contact
FIRST = 84, 0.22  # vectors tried first: they resolve one undisturbed contact
FOLDED = 4.0, 0.6  # what modes left out may err, over what the highest pairs may that act as a spring
EXCITED = 12.0, 0.25  # highest frequency of a mode that matters, over that of the contact
FEWEST = 30  # [-] vectors besides those that stand for modes: for the dip under the load
MORE = 1.4  # [-] factor on the number of vectors as long as they are too few
NOTCH = 4.0  # [-] divides what the highest Ritz pairs, which act as a spring, may err, each time
PATIENCE, LEAST_GAIN = 3, 0.7  # [-] more vectors are given up if so many steps do not divide the error by 1 / 0.7
TRIES = 4  # [-] smaller sizes tried until a mesh has more elements than before
SHARE = 0.45  # [-] of what the steps leave of the tolerance, for too few vectors, before the mesh is compared
COARSER = 1.5  # [-] element size of the comparison over that of the blow
MOST_VECTORS = 1000  # [-] limit on their number: beyond, rounding of the highest pairs outgrows what is gained


def usable(target: Target) -> bool:
    """Whether vectors can describe the target: a thin plate in a vacuum, not stretched, that can be meshed again."""
    if target.kind != "fe" or target.mesh is None or target.mesh.dimension != 2 or target.mesh.recipe is None:
        return False
    if target.thick or target.air or target.stretching:
        return False
    ratio = target.damping_ratio
    by_mode = not callable(ratio) and np.ndim(ratio if ratio is not None else 0.0) > 0
    return not by_mode and (target.system is None or target.system.element == "argyris")


def _strictness(tolerance: float) -> float:
    return max(1.0, 1e-2 / tolerance)


def first_count(target: Target, resonance: float, tolerance: float) -> int:
    """Number of vectors tried first; hardly more than there are modes that the contact may excite."""
    strict = _strictness(tolerance)
    modes = target.count_below(EXCITED[0] * strict ** EXCITED[1] * resonance / target.stretch)
    return round(min(FIRST[0] * strict ** FIRST[1], FEWEST + modes))


def size_for(target: Target, resonance: float, tolerance: float) -> float:
    """Element size [m] of the first mesh for a contact with this resonance [Hz]; that of the user's mesh if stated."""
    mesh, section = target.mesh, target.section
    assert mesh is not None and isinstance(section, Plate)
    if target.size_stated:
        return mesh.size
    highest = resonance * WAVES[0] * _strictness(tolerance) ** WAVES[1] / target.stretch
    size = min(mesh.size, refinement.WAVE_PER_ELEMENT["argyris"] / target.wave(highest))
    if section.tension:
        stiffness = float(section.stiffness(mesh.points[mesh.cells].mean(axis=1))[:, 0, 0].max())
        size = min(size, refinement.layer_size(stiffness, section.tension, float(np.ptp(mesh.points, axis=0).max())))
    return size


def hopeless(tried: list[float]) -> bool:
    """Whether the last PATIENCE steps towards more vectors gained nothing; takes the errors of all steps."""
    return len(tried) > PATIENCE and min(tried[-PATIENCE:]) > LEAST_GAIN * min(tried[:-PATIENCE])


class Seen:
    """A target as a blow at one point sees it.

    Parameters
    ----------
    target : Target
    at : strike point, (2,) [m]
    resonance : float [Hz]
        One over twice the duration of the contact on a rigid wall.
    tolerance : float [-]
    size : float [m]
        Element size to begin with.
    fixed : bool
        Whether the user insists on this size.
    """

    def __init__(
        self, target: Target, at: Any, resonance: float, tolerance: float, size: float, fixed: bool, stages: Stages
    ) -> None:
        self.target, self.at, self.size, self.fixed, self.stages = target, np.atleast_2d(at), size, fixed, stages
        strict = _strictness(tolerance)
        self.shift = 2.0 * np.pi * resonance * SHIFT[0] * strict ** SHIFT[1] / target.stretch
        self.count = first_count(target, resonance, tolerance)
        self.margin = FOLDED[0] * strict ** FOLDED[1]
        self.whole: Modes | None = None  # all Ritz pairs of the last `modes`
        self.tried: list[float] = []  # [-] truncation errors of the blows so far
        self.spent = False  # whether more vectors no longer help
        self.fine = self._krylov(size)
        self.coarse: Krylov | None = None

    def _stuck(self, truncation: float) -> bool:
        """Whether the last PATIENCE steps towards more vectors gained nothing."""
        self.tried.append(truncation)
        return hopeless(self.tried)

    def _krylov(self, size: float) -> Krylov:
        system = self.target.near(self.at, size, self.stages)
        with self.stages("vectors"):
            return Krylov(system, self.at, self.shift)

    @property
    def at_rest(self) -> bool:
        """Whether the point struck lies on a support, where no vector can start."""
        return bool((self.fine.compliance.diagonal() <= point_load.RESTS).any())

    def modes(self, cutoff: Callable[[Modes, float], float]) -> Modes:
        """The target as struck; Ritz pairs above ``cutoff`` [Hz], of them and a safety factor, act as a spring."""
        with self.stages("vectors"):
            found = self.fine.modes(self.count)
            if self.coarse is not None:
                other = replace(self.coarse.modes(self.count), poorer={})
                found = replace(found, poorer={**found.poorer, "mesh": other})
        self.whole = found = self.target.finished_vectors(found)
        return found.truncated(max_frequency=cutoff(found, self.margin) * (1.0 + 1e-9))

    def improved(self, error: Error, allowed: float) -> bool:
        """Take more vectors or a finer mesh, whichever the error of a blow calls for; False if neither is possible."""
        first = self.coarse is None  # the mesh is compared only when there are vectors enough
        few = error.truncation > SHARE * allowed if first else error.truncation > error.mesh
        if not first and error.truncation + error.mesh <= allowed:
            return False
        self.spent = self.spent or (few and (self.count >= MOST_VECTORS or self._stuck(error.truncation)))
        if few and not self.spent:
            self.count, self.margin = min(MOST_VECTORS, round(MORE * self.count)), NOTCH * self.margin
            return True
        if first:
            self.coarse = self._krylov(self.size * COARSER)
            if self.coarse.system.n_dofs >= self.fine.system.n_dofs:  # the outline allows no larger elements
                self._refine()
            return True
        finer = self.fine.system.n_dofs * COARSER**2
        useless = self.spent and error.truncation > allowed
        if error.mesh <= 0.5 * allowed or self.fixed or useless or finer > refinement.MOST_UNKNOWNS:
            return False
        self._refine()
        return True

    def _refine(self) -> None:
        """Take a finer mesh; the difference of two counts for either, and a size that the user insists on stays."""
        before, size = self.fine, self.size
        for _ in range(TRIES):
            size /= COARSER
            other = self._krylov(size)
            if other.system.n_dofs > before.system.n_dofs:
                break
        if self.fixed:
            self.coarse = other
        else:
            self.coarse, self.fine, self.size = before, other, size
