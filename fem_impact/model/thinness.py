"""Is the body thin? What shear and rotary inertia, which Kirchhoff and Euler leave out, do to a blow.

Every frequency drops as 1 / sqrt(1 + rotary + shear + edge), `bending.Bending`: the compliances of bending and of shear
add up, and so do the two inertias, which stays right in sign and size where the first order is not. The modes left out
yield more by shear, too: in all, a point force on a thick plate sinks in by ln(k_2 / k_1) / (2 pi kappa G h) between
two wavenumbers; beyond k h = 2 the half space of Hertz's contact has the rest.

References
----------
Mindlin (1951), J. Appl. Mech. 18, 31-38; Wang (1994), J. Vib. Acoust. 116, 536-540.
"""

import numpy as np

from ..fe.section import SHEAR, Beam, Plate
from ..impact.assumption import Assumption, allowed
from ..impact.compiled import layout
from .bending import Bending, Known
from .deflection import OTHER
from .restrike import Struck, softer

LIMIT = 0.23  # [-] thickness times wavenumber at which a wave is 1 % too fast for nu = 0.3
# [-] thickness times wavenumber beyond which a force is local to the contact: waves shorter than three thicknesses
DENT = 2.0
DOUBT = 0.2  # [-] drop of all frequencies by which a striker of unknown thickness is tried: a choice for a stout one
# [-] what a plate gives by shear over what it gives by bending, at most: it is thinner than half its side
SHEARED = 10.0
NEAR = 10  # [-] modes next to a frequency that tell its wavenumber: some of them swing unlike waves, hardly all of ten
NUMBER = "thickness times wavenumber"
THICKER = 'take a thick plate, theory = "mindlin", or a softer contact'
SLENDER = 'take a thick beam, theory = "timoshenko", or a softer contact'
NO_SECTION = "the thickness is not stated; give material and section instead of mass and first frequency"
MORLEY = "the shear forces of element 'morley'"
NO_SLENDERNESS = "give the slenderness of a stick, or material and section of a bar"


def lowered(thick: np.ndarray) -> np.ndarray:
    """Frequencies of a thick body over those of the thin one, from the relative drop of omega**2 to first order."""
    return 1.0 / np.sqrt(1.0 + thick)


def of_target(struck: Struck) -> Assumption:
    """The struck body."""
    body, quantities = struck.target, struck.quantities

    def told(value: float | None, effect: dict, unknown: str = "") -> Assumption:
        plate = body is None or body.modes.dimension == 2
        remedy = OTHER if unknown == MORLEY else NO_SECTION if unknown else THICKER if plate else SLENDER
        return Assumption("thin target", value, LIMIT, effect, quantities, remedy, NUMBER, unknown)

    if struck.bodies[1].dimension == 0 or struck.bodies[1].thick:
        return Assumption("thin target", None, None, dict.fromkeys(quantities, 0.0), quantities, "", NUMBER)
    if struck.ideal == "rigid" and not struck.foreseen and (body is None or body.thickness is None):
        given = min(1.0, SHEARED * struck.hit.error.idealisation)  # at most
        return Assumption("thin target", None, LIMIT, dict.fromkeys(quantities, given), quantities, NO_SECTION, NUMBER)
    if body is None or body.thickness is None:
        return told(None, dict.fromkeys(quantities), "the thickness of the body")
    if struck.foreseen:
        return told(*_ahead(body, wavenumber(body, struck.bending, struck.omega)))
    if struck.ideal:
        return told(*_simplified(struck, body))
    integrals, history = struck.bending, struck.hit.history
    assert integrals is not None
    if integrals.thick is None:
        return told(None, dict.fromkeys(quantities), MORLEY)
    wave = integrals.wave
    weight = struck.energy.sum()
    value = body.thickness * float(np.sqrt(struck.energy @ wave**2 / weight)) if weight else 0.0
    assert integrals.rotary is not None
    changed = {
        "omega": struck.of_target(history.omega[struck.mine] * lowered(integrals.thick)),
        "shape": struck.of_target(
            integrals.heavier(history.shape[:, struck.mine] / np.sqrt(1.0 + integrals.rotary)), "shape"
        ),
    }
    if body.plate is not None and history.law[0, layout.COMPLIANCE] > 0.0:
        changed |= softer(history, _give(struck, body, body.plate, integrals))
    effect = struck.heard(struck.changes(**changed), lambda _, found: _heard(found))
    unknown = "the thickness of the body" if effect.get("sound", 0.0) is None else ""
    return told(value, effect, unknown)


def _heard(found: Bending | None) -> np.ndarray | None:
    return None if found is None or found.thick is None else 1.0 - lowered(found.thick)


def _shear_give(plate: Plate, thickness: float, low: float) -> float:
    """Deflection [m/N] by shear under a point force, between a wavenumber [rad/m] and that of a dent."""
    return max(0.0, np.log(DENT / (thickness * low))) / (2.0 * np.pi * _shear(plate, thickness)) if low > 0.0 else 0.0


def _shear(plate: Plate, thickness: float) -> float:
    """Shear stiffness [N/m] for which an isotropic plate sinks under a point force as this one does."""
    return SHEAR * thickness * float(np.sqrt(np.prod(plate.material.transverse)))


def _give(struck: Struck, body: Known, plate: Plate, integrals: Bending) -> float:
    """Compliance [m/N] by shear that the residual compliance of the modes left out lacks."""
    assert body.thickness is not None
    return _shear_give(plate, body.thickness, float(integrals.wave[-1]))


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
        near = moving[np.argsort(np.abs(np.log(body.modes.omega[moving] / omega)))[:NEAR]]
        if len(near):
            return float(np.median(integrals.wave[near] * np.sqrt(omega / body.modes.omega[near])))
    section = body.section
    if section is None or any(callable(size) for size in vars(section).values()):
        return None
    return plane_wave(section, omega)


def _ahead(body: Known, wave: float | None) -> tuple[float | None, dict[str, float | None], str]:
    """What is known before the blow."""
    if wave is None or body.thickness is None:
        return None, {}, "the waves of this body, without its modes"
    return body.thickness * wave, {}, ""


def _simplified(struck: Struck, body: Known) -> tuple[float | None, dict[str, float | None], str]:
    """A rigid body gives by shear alone; the mobility of an infinite plate rises as its waves get slower."""
    plate, history = body.plate, struck.hit.history
    if plate is None or body.thickness is None or callable(plate.thickness):
        return None, dict.fromkeys(struck.quantities), "the waves of this body, without its modes"
    wave = plane_wave(plate, struck.omega)
    value = body.thickness * wave
    changed = softer(history, _shear_give(plate, body.thickness, wave))
    if struck.ideal == "infinite":
        D = plate.stiffness(np.zeros((1, 2)))[0]
        drop = value**2 / 12.0 + float(np.sqrt(D[0, 0] * D[1, 1])) * wave**2 / _shear(plate, body.thickness)
        # the modes of a wide plate get denser by the whole drop of omega**2, and so does the mobility
        changed["shape"] = struck.of_target(history.shape[:, struck.mine] * np.sqrt(1.0 + drop), "shape")
    return value, dict(struck.changes(**changed)), ""


def of_striker(struck: Struck) -> Assumption:
    """A flexible striker: its own section, or if that is not known a trial with lower frequencies."""
    hit, quantities, modes = struck.hit, struck.quantities, struck.bodies[0]
    flexible = modes.omega > 0.0
    if not modes.dimension or not flexible.any() or modes.thick:
        return Assumption("thin striker", None, None, dict.fromkeys(quantities, 0.0), quantities, "", NUMBER)
    body, omega = struck.striker, hit.history.omega.copy()
    columns = hit.body_slice(0)
    integrals = struck.striker_bending
    if body is None or body.thickness is None or integrals is None or integrals.thick is None:
        if struck.foreseen:
            unknown = "the thickness of the striker"
            return Assumption("thin striker", None, LIMIT, {}, quantities, NO_SLENDERNESS, NUMBER, unknown)
        omega[columns] *= 1.0 - DOUBT
        effect = struck.changes(omega=omega)
        if max(np.inf if x is None else x for x in effect.values()) <= allowed(hit.tolerance):  # at most so much
            return Assumption("thin striker", None, None, effect, quantities, NO_SLENDERNESS, NUMBER)
        unknown = "the thickness of the striker, and the blow depends on its bending modes"
        effect = dict.fromkeys(quantities)
        return Assumption("thin striker", None, LIMIT, effect, quantities, NO_SLENDERNESS, NUMBER, unknown)
    if struck.foreseen:
        value, effect, unknown = _ahead(body, wavenumber(body, integrals, struck.omega))
        return Assumption("thin striker", value, LIMIT, effect, quantities, SLENDER, NUMBER, unknown)
    omega[columns] *= lowered(integrals.thick)
    h, shape = hit.history, hit.history.shape.copy()
    shape[:, columns] = integrals.heavier(shape[:, columns])
    end = h.states(np.array([max((impact.end for impact in hit.impacts), default=0.0)]))
    energy = 0.5 * (end[1][0, columns] ** 2 + (h.omega[columns] * end[0][0, columns]) ** 2) * flexible
    weighed = body.thickness * float(np.sqrt(energy @ integrals.wave**2 / (energy.sum() or 1.0)))
    effect = dict(struck.changes(omega=omega, shape=shape))
    return Assumption("thin striker", weighed, LIMIT, effect, quantities, SLENDER, NUMBER)
