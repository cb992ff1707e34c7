"""Is the body thin, and if it is curved, shallow? What shear and inertia that the theory leaves out do to a blow.

Every frequency drops as 1 / sqrt(1 + rotary + shear + edge), `bending.Bending`: the compliances of bending and of shear
add up, and so do the two inertias, which stays right in sign and size where the first order is not. The modes left out
yield more by shear, too: in all, a point force on a thick plate sinks in by ln(k_2 / k_1) / (2 pi kappa G h) between
two wavenumbers; beyond k h = 2 the half space of Hertz's contact has the rest.

A mode of a curved or ribbed plate has kinetic energy besides that of its deflection: in the plane, of ribs as they
swing about the middle of the plate, and of the surface that is larger than its outline (`fe.shallow.plane_mass`). To
first order its omega**2 drops by the share of that. Strains measured on the outline are of the same order, the square
of the slope. Elastic bodies of three dimensions are 0.4 to 1.3 of that drop lower where slopes are 0.09 to 0.5
(`tests/independent/test_solids.py`); with ribs, most of it is in the frequencies already.

References
----------
Mindlin (1951), J. Appl. Mech. 18, 31-38; Wang (1994), J. Vib. Acoust. 116, 536-540; Leissa (1973), Vibration of
shells, NASA SP-288, 1.6 and 2.3; Soedel (2004), Vibrations of shells and plates, 6.8.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ..fe import shallow
from ..fe.section import SHEAR, Beam, Plate
from ..impact.assumption import Assumption, allowed
from ..modes.shapes import unwrap_shapes
from .bending import LOW, Bending, Known, flexible_vectors, integrate_shapes
from .deflection import OTHER
from .restrike import Doubt, Struck, softened_system

THICKER = 'take a thick plate, theory = "mindlin", or a softer contact'
SOFTER = "take a softer contact, or modes of a program for thick shells or solids, `fi.Modes.from_arrays`"
SLENDER = 'take a thick beam, theory = "timoshenko", or a softer contact'
NO_SECTION = "the thickness is not stated; give material and section instead of mass and first frequency"
NO_SLENDERNESS = "give the slenderness of a stick, or material and section of a bar"
TARGET = Doubt("thin target", "thickness times wavenumber", 0.23, NO_SECTION)  # a wave is 1 % too fast for nu = 0.3
STRIKER = replace(TARGET, name="thin striker", missing=NO_SLENDERNESS)
SHALLOW = Doubt("shallow target", "steepest slope", 0.1)  # frequencies may be off by its square, 1 %
FLATTER = "the body is too steep for shallow theory; take its modes from a program for shells, `fi.Modes.from_arrays`"
FLAT = "ribs and layers move in the plane, too; take modes of a program for shells or solids, `fi.Modes.from_arrays`"


def lowered_by(thick: np.ndarray) -> np.ndarray:
    """Frequencies of a thick body over those of the thin one, from the relative drop of omega**2 to first order."""
    return 1.0 / np.sqrt(1.0 + thick)


def examine_target(struck: Struck) -> Assumption:
    """The struck body."""
    body, modes = struck.target, struck.bodies[1]
    if modes.dimension == 0 or modes.thick:
        return TARGET.holds(struck)
    if body is None or body.thickness is None:
        if struck.ideal != "rigid" or struck.planned:
            return TARGET.unknown(struck, "the thickness of the body")
        # what it gives by shear is at most ten times what it gives by bending: it is thinner than half its side
        most = min(1.0, 10.0 * struck.hit.error.idealisation)
        return TARGET.judged(struck, None, dict.fromkeys(struck.quantities, most), NO_SECTION)
    remedy = SLENDER if modes.dimension == 1 else SOFTER if body.shaped else THICKER  # no thick theory of shaped plates
    if struck.planned:
        return _judged_by_wave(TARGET, struck, body, struck.bending, remedy)
    if struck.ideal:
        return _simplified(struck, body)
    integrals, history = struck.bending, struck.hit.history
    assert integrals is not None
    if integrals.thick is None or integrals.rotary is None:
        return TARGET.unknown(struck, "the shear forces of element 'morley'", OTHER)
    row = integrals.heavier(history.shape[:, struck.mine] / np.sqrt(1.0 + integrals.rotary))
    changed = {
        "omega": struck.with_target(history.omega[struck.mine] * lowered_by(integrals.thick)),
        "shape": struck.with_target(row, "shape"),
    }
    if body.plate is not None and history.law["compliance"][0] > 0.0:
        # the residual compliance of the modes left out lacks their shear
        changed |= softened_system(history, _shear_give(body.plate, body.thickness, float(integrals.wave[-1])))
    effect = struck.add_sound(
        struck.changes(**changed),
        lambda _, found: None if found.thick is None else 1.0 - lowered_by(found.thick),
    )
    return TARGET.judged(struck, body.thickness * integrals.mean_wave(struck.target_energy), effect, remedy)


def _judged_by_wave(doubt: Doubt, struck: Struck, body: Known, integrals: Bending | None, remedy: str) -> Assumption:
    """What is known before the blow."""
    wave = wavenumber(body, integrals, struck.omega)
    if wave is None or body.thickness is None:
        return doubt.unknown(struck, "the waves of this body, without its modes")
    return doubt.judged(struck, body.thickness * wave, {}, remedy)


def _shear_give(plate: Plate, thickness: float, low: float) -> float:
    """Deflection [m/N] by shear under a point force, between a wavenumber [rad/m] and that of a dent.

    Waves shorter than three thicknesses, k h = 2, are local to the contact.
    """
    return max(0.0, np.log(2.0 / (thickness * low))) / (2.0 * np.pi * _shear(plate, thickness)) if low > 0.0 else 0.0


def _shear(plate: Plate, thickness: float) -> float:
    """Shear stiffness [N/m] for which an isotropic plate sinks under a point force as this one does."""
    return SHEAR * thickness * float(np.sqrt(np.prod(plate.material.transverse)))


def plane_wave(section: Plate | Beam, omega: float) -> float:
    """Wavenumber [rad/m] of a body's bending waves, by the geometric mean of its stiffnesses if orthotropic."""
    origin = np.zeros((1, 2 if isinstance(section, Plate) else 1))
    D = section.stiffness(origin)
    stiff = np.sqrt(D[0, 0, 0] * D[0, 1, 1]) if isinstance(section, Plate) else D.flat[0]
    return float((section.inertia(origin)[0] * omega**2 / stiff) ** 0.25)


def wavenumber(body: Known, integrals: Bending | None, omega: float) -> float | None:
    """Wavenumber [rad/m] at a frequency [rad/s], of modes if there are any, else of the section; None if not known."""
    if integrals is not None:
        moving = np.flatnonzero((body.modes.omega > 0.0) & (integrals.wave > 0.0))
        # some modes swing unlike waves, hardly all of ten
        near = moving[np.argsort(np.abs(np.log(body.modes.omega[moving] / omega)))[:10]]
        if len(near):
            return float(np.median(integrals.wave[near] * np.sqrt(omega / body.modes.omega[near])))
    section = body.section
    if section is None or any(callable(size) for size in vars(section).values()):
        return None
    return plane_wave(section, omega)


def _simplified(struck: Struck, body: Known) -> Assumption:
    """A rigid body gives by shear alone; the mobility of an infinite plate rises as its waves get slower."""
    plate, history = body.plate, struck.hit.history
    if plate is None or body.thickness is None or not plate.uniform:
        return TARGET.unknown(struck, "the waves of this body, without its modes")
    wave = plane_wave(plate, struck.omega)
    value = body.thickness * wave
    changed = softened_system(history, _shear_give(plate, body.thickness, wave))
    if struck.ideal == "infinite":
        D = plate.stiffness(np.zeros((1, 2)))[0]
        drop = value**2 / 12.0 + float(np.sqrt(D[0, 0] * D[1, 1])) * wave**2 / _shear(plate, body.thickness)
        # the modes of a wide plate get denser by the whole drop of omega**2, and so does the mobility
        changed["shape"] = struck.with_target(history.shape[:, struck.mine] * np.sqrt(1.0 + drop), "shape")
    return TARGET.judged(struck, value, struck.changes(**changed), THICKER)


def examine_striker(struck: Struck) -> Assumption:
    """A flexible striker: its own section, or if that is not known a trial with lower frequencies."""
    hit, history, modes = struck.hit, struck.hit.history, struck.bodies[0]
    if not modes.dimension or not (modes.omega > 0.0).any() or modes.thick:
        return STRIKER.holds(struck)
    body, integrals = struck.striker, None if struck.striker is None else integrate_shapes(struck.striker)
    columns, omega, shape = hit.body_slice(0), history.omega.copy(), history.shape.copy()
    if body is None or body.thickness is None or integrals is None or integrals.thick is None:
        if struck.planned:
            return STRIKER.unknown(struck, "the thickness of the striker")
        omega[columns] *= 0.8  # as those of a stout one, a choice
        effect = struck.changes(omega=omega)
        if max(np.inf if x is None else x for x in effect.values()) <= allowed(hit.tolerance):  # at most so much
            return STRIKER.judged(struck, None, effect, NO_SLENDERNESS)
        return STRIKER.unknown(struck, "the thickness of the striker, and the blow depends on its bending modes")
    if struck.planned:
        return _judged_by_wave(STRIKER, struck, body, integrals, SLENDER)
    omega[columns] *= lowered_by(integrals.thick)
    shape[:, columns] = integrals.heavier(shape[:, columns])
    value = body.thickness * integrals.mean_wave(struck.energy_in(columns))
    return STRIKER.judged(struck, value, struck.changes(omega=omega, shape=shape), SLENDER)


def examine_shallowness(struck: Struck) -> Assumption:
    """The struck body."""
    modes = struck.bodies[1]
    shapes: Any = unwrap_shapes(modes.shapes)[0]
    system = getattr(shapes, "system", None)
    if system is None or not system.rules.has_plane:
        return SHALLOW.holds(struck)
    curved = system.section.rise is not None
    value, remedy = (shallow.steepest(system), FLATTER) if curved else (None, FLAT)
    if struck.planned:
        return SHALLOW.judged(struck, value, {}, remedy)
    n_rigid, n = modes.n_rigid, min(LOW, modes.n_modes - modes.n_rigid)
    vectors = flexible_vectors(shapes, n_rigid, n)
    found = np.einsum("ij,ij->j", vectors, shallow.plane_mass(system, vectors))  # of a whole mass of one
    drop = np.full(modes.n_modes, np.median(found[-max(1, n // 4) :]))  # of modes above: that of the last of these
    drop[:n_rigid], drop[n_rigid : n_rigid + n] = 0.0, found
    omega = struck.hit.history.omega[struck.mine]
    return SHALLOW.judged(struck, value, struck.changes(omega=struck.with_target(omega * lowered_by(drop))), remedy)
