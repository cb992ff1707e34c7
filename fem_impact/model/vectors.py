"""A struck plate described by Ritz vectors started from the blow itself, on a mesh and in a number that the blow needs.

No mode is found. The tolerance sets the shift of the vectors and the first mesh; blows with fewer vectors and on a
coarser mesh (`Modes.poorer`) show what either costs, and `RitzTarget.improved` reduces the larger of the two.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..fe import point_load, refinement
from ..fe.assembly import usual_theory
from ..fe.kirchhoff import ARGYRIS
from ..fe.refinement import FLATTER
from ..fe.section import Plate
from ..fe.splitting import DEPTH
from ..impact.error import Error
from ..modes.modal import Modes
from ..modes.ritz import Krylov, grow_together
from . import cost
from .budget import NOTCH
from .target import Elements, Stages, Target

# [-] vectors besides those that stand for modes: the dip under the load has no wavelength and takes its own
FEWEST = 30
# [-] largest (size wave)**2 mass wave**2 / inertia of the triangles at the blow over the tolerance, see `elements_for`:
# a blow on a hinged plate then errs by 2 % of it, whatever its other elements; test_vectors.py
DIP = 60.0
MET = 0.9  # [-] of the allowed error, up to which an estimate suffices: some are a tenth too small (effectivity.py)
# [-] of their number, modes below the shift of many vectors: with 0.5, those that `FEWER` leaves overestimate errors
SPANNED = 0.35
MOST_VECTORS = 2000  # [-] to limit the memory: a mesh of 20 000 unknowns takes some 0.3 GB for so many


def vectors_usable(target: Target) -> bool:
    """Whether vectors can describe the target: a thin plate in a vacuum, not stretched, that can be meshed again."""
    if target.kind != "fe" or target.mesh is None or target.mesh.dimension != 2 or target.mesh.recipe is None:
        return False
    if target.thick or target.air or target.stretching:
        return False
    ratio = target.damping_ratio
    by_mode = not callable(ratio) and np.ndim(ratio if ratio is not None else 0.0) > 0
    return not by_mode and (target.system is None or target.system.rules is usual_theory(target.section, 2))


def _stricter(loose: float, power: float, tolerance: float) -> float:
    """What is ``loose`` at a tolerance of 1e-2 or more, and grows with a power of 1e-2 / tolerance."""
    return loose * max(1.0, 1e-2 / tolerance) ** power


def first_count(target: Target, resonance: float, tolerance: float) -> int:
    """Number of vectors tried first: they resolve one undisturbed contact, or are hardly more than modes may ring.

    A half sine has 1 / 143 of its impulse at 12 times the frequency of the contact.
    """
    modes = target.count_below(_stricter(12.0, 0.25, tolerance) * resonance / target.stretch)
    return round(min(_stricter(84, 0.22, tolerance), FEWEST + modes))


def shift_for(resonance: float, tolerance: float, damping: float = 0.0) -> float:
    """Shift [rad/s] of the vectors for a contact with this resonance [Hz], see `Krylov`; half or twice it serves, too.

    A plate whose ``damping`` is above critical [-] makes the force rise so much faster, while the blow lasts as long:
    far higher shifts would take more vectors to reach its end.
    """
    return 2.0 * np.pi * resonance * min(max(1.0, 0.5 * damping), 4.0) * _stricter(6.0, 1.0 / 6.0, tolerance)


def size_for(target: Target, resonance: float, tolerance: float) -> float:
    """Element size [m] of the first mesh for a contact with this resonance [Hz]; that of the user's mesh if stated.

    A mesh file much finer than needed gives way to a coarser mesh.
    """
    mesh, section = target.mesh, target.section
    assert mesh is not None and isinstance(section, Plate)
    if target.size_stated:
        return mesh.size
    target.check_first(tolerance)
    highest = resonance * _stricter(1.6, 0.37, tolerance) / target.stretch
    size = min(max(mesh.size, refinement.affordable_size(mesh)), ARGYRIS.wave / target.wave(highest))
    if section.tension:
        stiffness = float(section.stiffness(mesh.points[mesh.cells].mean(axis=1))[:, 0, 0].max())
        size = min(size, refinement.layer_size(stiffness, section.tension, float(np.ptp(mesh.points, axis=0).max())))
    return size


def elements_for(target: Target, size: float, mass: float, resonance: float, tolerance: float) -> Elements:
    """Elements of a size [m], with those at the blow small enough for its tolerance.

    Triangles of a size there lack compliance. Over that of a contact of this resonance [Hz] with a striker of a mass
    [kg], it is ``(size wave)**2 mass wave**2 / inertia`` times a constant, with the plate's wavenumber and inertia.
    """
    assert target.mesh is not None
    wave, area = target.wave(resonance / target.stretch, tense=False), target.mesh.area
    allowed = (DIP * min(tolerance, 1e-2) * target.mass / (mass * wave**2 * area)) ** 0.5 / wave
    # triangles at a blow that are more than 64 times coarser were not tried
    coarseness = min(allowed / (DEPTH * area / target.mesh.perimeter), 64.0)
    return Elements(size, coarseness, min(1.0, tolerance / 1e-2) ** (1.0 / 6.0))  # order six where a plate is curved


# [-] a mesh with more than this part of the elements of another is no coarser: sizes 1.5 apart should leave 0.44
ALIKE = 0.85


def finer_elements(target: Target, elements: Elements, stages: Stages) -> Elements:
    """The next smaller elements: more of them, and smaller at the blow; at most five times smaller."""
    size, before = elements.size, target.n_cells(elements.size, stages)
    for _ in range(4):
        size /= refinement.COARSER
        if ALIKE * target.n_cells(size, stages) >= before:
            break
    return Elements(size, elements.coarseness / FLATTER, elements.layer / FLATTER)


def compared_elements(target: Target, elements: Elements, stages: Stages) -> tuple[Elements, Elements]:
    """Elements of the first two meshes that are compared: finer ones if the outline allows no larger ones."""
    coarser = Elements(refinement.COARSER * elements.size, FLATTER * elements.coarseness, FLATTER * elements.layer)
    if target.n_cells(coarser.size, stages) <= ALIKE * target.n_cells(elements.size, stages):
        return elements, coarser
    return finer_elements(target, elements, stages), elements


def is_hopeless(tried: list[float], patience: int = 3) -> bool:
    """Whether the last ``patience`` steps towards more vectors, of the errors of all, did not divide them by 1 / 0.7.

    One or two may fail by chance.
    """
    return len(tried) > patience and min(tried[-patience:]) > 0.7 * min(tried[:-patience])


def fold_upper_pairs(found: Modes, cutoff: Callable[[Modes, float], float], margin: float) -> Modes:
    """The Ritz pairs up to ``cutoff``, as in `RitzTarget.needed_modes`; those above act as a spring.

    The poorer descriptions keep more pairs, whose spring errs 16 times less, so that the difference of their blows is
    the error of the poorer one and includes what the spring costs.
    """
    low, high = (cutoff(found, factor * margin) * (1.0 + 1e-9) for factor in (1.0, 16.0))

    def up_to(limit: float, modes: Modes) -> Modes:
        poorer = {cause: up_to(high, other) for cause, other in modes.poorer.items()}
        flexible = float(modes.frequencies[min(modes.n_rigid, modes.n_modes - 1)])  # a spring needs one to lie above
        return replace(replace(modes, poorer={}).truncated(max_frequency=max(limit, flexible)), poorer=poorer)

    return up_to(low, found)


class RitzTarget:
    """A target by Ritz vectors for a blow at a point, or at several; on a rigid wall the contact has a resonance [Hz].

    The resonance and the tolerance decide on shift and first number of vectors, unless these are given. Every mesh is
    factorised once for all its points, and one solution then gives a vector of each.
    """

    fine: list[Krylov]  # of each point
    # on larger elements; on smaller ones if the user insists on a size and the outline allows no larger
    coarse: list[Krylov]

    def __init__(
        self, target: Target, at: Any, resonance: float, tolerance: float, elements: Elements, fixed: bool,
        stages: Stages, shift: float | None = None, count: int | None = None,
    ) -> None:  # fmt: skip
        self.target, self.at, self.stages = target, np.atleast_2d(at), stages  # (n_points, 2) [m]
        self.fixed = fixed  # whether the user insists on the size of the elements
        self.shift = (shift or shift_for(resonance, tolerance)) / target.stretch  # [rad/s] before scaling
        self.count = count or first_count(target, resonance, tolerance)  # of vectors
        # [-] over the cutoff, up to which Ritz pairs are kept: what acts as a spring errs in every blow
        self.margin = _stricter(4.0, 0.6, tolerance)
        self.whole: Modes | None = None  # all Ritz pairs of the last `needed_modes`
        self.tried: list[float] = []  # [-] truncation errors of the blows so far
        self.spent = False  # whether more vectors no longer help
        self.unmended = np.inf  # [-] error of these meshes with fewer vectors
        self.larger = np.inf  # [-] error of the meshes before
        self.elements, other = compared_elements(target, elements, stages)
        if fixed and self.elements != elements:  # there are no larger elements to compare with
            self.elements, other = other, self.elements
        self.unsure = refinement.other_rise(target.section) is not None
        self.fine, self.coarse = self._krylov(self.elements), self._krylov(other, off=True)
        both = (cost.on_mesh(one[0].system.n_dofs, self.count, self.count) for one in (self.fine, self.coarse))
        self.work = self.done = sum(both, cost.NOTHING)  # for the next blow, and for all so far with it

    def _krylov(self, elements: Elements, off: bool = False) -> list[Krylov]:
        """Vectors of each point; with the rise ``off`` by as much as it may be, if it is unsure."""
        system = self.target.near(self.at, elements, self.stages)
        system = (refinement.with_other_rise(system) if off else None) or system
        with self.stages("vectors"):
            first = Krylov(system, self.at[:1], self.shift)
            return [first, *(first.beside(point[None]) for point in self.at[1:])]

    @property
    def at_rest(self) -> bool:
        """Whether a point struck lies on a support, where no vector can start."""
        return any(float(one.compliance[0, 0]) <= point_load.RESTS for one in self.fine)

    @property
    def n_dofs(self) -> int:
        """Number of unknowns of the finer mesh."""
        return self.fine[0].system.n_dofs

    def needed_modes(self, cutoff: Callable[[Modes, float], float], point: int = 0) -> Modes:
        """The target as struck at a point; Ritz pairs above ``cutoff`` [Hz], of them and a safety factor, are a spring.

        With those of fewer vectors and on a coarser mesh as poorer descriptions.
        """
        fine, coarse = self.fine[point], self.coarse[point]
        with self.stages("vectors"):
            grow_together(self.fine, self.count)
            found = fine.modes(self.count)
            count = found.n_modes - fine.system.rigid.shape[1]  # as many vectors on either mesh
            grow_together(self.coarse, count)
            other = coarse.modes(count)
        found, target = replace(found, poorer={"mesh": other, **found.poorer}), self.target
        # scaled and damped like modes, although their first is no mode
        found = found.stretched(target.scale.get("mass", found.mass) / found.mass, target.stretch)
        self.whole = found if target.damping_ratio is None else found.damped(target.damping_ratio)
        return fold_upper_pairs(self.whole, cutoff, self.margin)

    def improved(self, error: Error, allowed: float, most: float = np.inf) -> bool:
        """Take more vectors or a finer mesh, whichever the error of a blow calls for; False if neither is possible.

        While the number of impacts is in doubt, what descriptions differ by in all else calls for either, and a blow
        that would take more than ``most`` seconds in all is given up: it rattles or is chaotic.
        """
        truncation, mesh, doubted = error.truncation, error.mesh, max(error.truncation, error.mesh) >= 1.0
        much = (truncation + mesh) / allowed if allowed > 0.0 else np.inf
        if much <= MET:
            return False
        if min(truncation, mesh) >= 1.0 and not self.fixed:
            truncation, mesh = truncation % 1.0, mesh % 1.0
        # the error of the mesh contains that of too few vectors: it is at fault if it is three times as large
        coarse = mesh > max(3.0 * truncation, 0.5 * allowed)
        # or if more vectors did not mend it, and are nearly enough
        lasting = mesh > max(0.7 * self.unmended, truncation, 0.5 * allowed)
        coarse |= lasting and truncation < allowed
        self.unmended = mesh
        if not self.spent and not coarse:
            self.tried += [error.truncation] * (self.count < MOST_VECTORS)
            # it is 1 until two descriptions agree on the impacts of the blow, which may take twice as many steps
            patience = 3 if error.truncation < 1.0 else 6
            self.spent = self.count >= MOST_VECTORS or is_hopeless(self.tried, patience)
        finer = coarse or self.spent
        # less than 1.4 times as many gain too little for a run, more may overshoot
        count = self.count if finer else min(MOST_VECTORS, round(1.4 * self.count))
        work = self._work(count, finer)
        if doubted and (self.done + work).seconds > most:
            return False
        if not finer:
            self.count, self.margin = count, NOTCH * self.margin
        elif not self._refined(error, allowed):
            return False
        self.work, self.done = work, self.done + work
        return True

    def _refined(self, error: Error, allowed: float) -> bool:
        """Take a finer mesh; False if that is of no use or not possible."""
        useless = self.spent and error.truncation > allowed
        more = self.n_dofs * refinement.COARSER**2
        if error.mesh <= 0.5 * allowed or self.fixed or useless or more > refinement.MOST_UNKNOWNS:
            return False
        if self.unsure and error.mesh > 0.7 * self.larger:  # no mesh makes the rise any surer
            return False
        before, self.elements = self.elements, finer_elements(self.target, self.elements, self.stages)
        # many vectors reach as many modes from any lower shift, but rounding then grows a hundredfold with each vector
        self.shift = max(self.shift, 2.0 * np.pi * self.target.frequency_below(SPANNED * self.count))
        self.coarse = self._krylov(before, off=True) if self.unsure else self.fine
        self.fine, self.unmended, self.larger = self._krylov(self.elements), np.inf, error.mesh
        return True

    def _work(self, count: int, finer: bool) -> cost.Work:
        """Work for the next blow, by so many vectors: of those that are new, or of all on a finer mesh."""
        fine, coarse = self.n_dofs, self.coarse[0].system.n_dofs
        if finer:
            return cost.on_mesh(fine * refinement.COARSER**2, count, count)
        return sum((cost.on_mesh(n, count - self.count, count) for n in (fine, coarse)), cost.NOTHING)
