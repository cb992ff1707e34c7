"""Is the contact elastic, small and slow? What Hertz's law leaves out does to a blow.

The contact of a sphere of radius R under the force F has the radius a = (3 F R / (4 E*))**(1/3) and the largest
pressure p = (6 F E*^2 / (pi^3 R^2))**(1/3). The softer body begins to yield at p = 1.6 Y. From there the restitution
falls as Thornton's model says, towards V**(-1/4).

References
----------
Johnson (1985), Contact mechanics, sections 3.4 (point force), 4.2 and 11.5; Thornton (1997), J. Appl. Mech. 64, 383;
Lamb (1882), Proc. London Math. Soc. 13, 189-212 (modes of a sphere).
"""

import numpy as np

from .._base.rounding import SAME
from ..fe.section import Material
from ..impact.assumption import Assumption
from ..impact.compiled import layout
from ..impact.contact import YIELDS, Contact, loss_number
from ..impact.history import History
from ..modes.modal import SampledShapes
from .restrike import Struck, softer
from .thinness import wavenumber

# [-] contact radius over half the thickness, a wavelength / (2 pi) or the edge's distance, small for Hertz: a choice
SMALL = 0.5
SLOW = 0.2  # [-] longest period of the striker's own vibration over the contact time: five swings within the contact
LAMB = 2.64  # [-] fact: lowest spheroidal mode of a sphere, omega R / c_s, for nu = 0.25; 2.65 for 0.33
INERT = 10.0  # [-] frequency over that of this mode from which on it does not swing: it leaves 1 % of the effect
LIVELY = 2.5  # [-] fact: squared shape of that mode at its pole times the mass of the sphere
EDGE = "contact radius over the distance to the edge"
SPHERE = "give the striker as a sphere with its material, and the contact between the two"
PLASTIC = "take a contact that yields (yield_strength of `Contact.between`, or elastic_plastic), or a slower blow"


def _hertz(struck: Struck) -> tuple[float, float] | None:
    """Radius R [m] of the sphere and the modulus E* [Pa] of its contact; None if these are not known."""
    striker, law = struck.hit.striker, struck.hit.contact
    if striker is None or striker.radius is None or law.exponent != 1.5 or law.hard_stiffness or law.hysteresis:
        return None
    return striker.radius, 0.75 * law.stiffness / striker.radius**0.5


def contact_radius(law: Contact, radius: float, force: float) -> float:
    """Radius [m] of the contact of a sphere under a force [N], also beyond first yield."""
    first = law.yield_approach
    beyond = force - law.stiffness * first**1.5
    if first and beyond > 0.0:
        approach = first + beyond / (1.5 * law.stiffness * first**0.5)
    else:
        approach = (force / law.stiffness) ** (2.0 / 3.0)
    return (radius * approach) ** 0.5


def yielding(struck: Struck) -> Assumption:
    """Whether the contact stays elastic."""
    hit, quantities = struck.hit, struck.quantities
    number = "contact pressure over that at first yield"
    still = dict.fromkeys(quantities, 0.0)
    if hit.contact.yield_approach and hit.contact.exponent > 1.0:
        return Assumption("no yielding", None, None, still, quantities, "", number)
    round_body = _hertz(struck)
    strengths = {"striker": _strength(struck, 0), "target": _strength(struck, -1)}
    missing = [name for name, strength in strengths.items() if strength is None]
    if round_body is None or len(missing) == 2:
        why = "radius and material of the contact" if round_body is None else "yield strengths"
        remedy = SPHERE if round_body is None else "state yield_strength of both materials"
        unknown = dict.fromkeys(quantities)
        return Assumption("no yielding", None, 1.0, unknown, quantities, remedy, number, why, round_body is None)
    R, E = round_body
    weakest = min(strength for strength in strengths.values() if strength is not None)
    value = (6.0 * hit.peak_force * E**2 / (np.pi**3 * R**2)) ** (1.0 / 3.0) / (YIELDS * weakest)
    remedy = PLASTIC
    if value <= 1.0 and missing:
        why, remedy = f"yield strength of the {missing[0]}", "state its yield_strength"
        return Assumption("no yielding", value, 1.0, dict.fromkeys(quantities), quantities, remedy, number, why)
    if value <= 1.0:
        return Assumption("no yielding", value, 1.0, still, quantities, remedy, number)
    law = hit.history.law.copy()
    bare = law.copy()
    k, a = law[0, layout.STIFFNESS], law[0, layout.EXPONENT]
    stored = hit.peak_force * (hit.peak_force / k) ** (1.0 / a) / (a + 1.0)  # [J]
    speed = abs(hit.speed) or np.sqrt(2.0 * stored / hit.bodies[0].mass)  # at rest, a constant force presses it
    bare[0, 2] += SAME / speed  # a lossy contact has no compliance in series: both blows are to lack it
    law[0, layout.LOSS] += loss_number(restitution(value ** (-2.5))) / speed  # pressure goes as speed**0.4 on a wall
    effect = dict(struck.between({"law": bare}, {"law": law}))
    return Assumption("no yielding", value, 1.0, effect, quantities, remedy, number)


def restitution(ratio: float) -> float:
    """Restitution [-] of an elastic, ideally plastic sphere for the speed of first yield over its speed (Thornton)."""
    if ratio >= 1.0:
        return 1.0
    tail = ratio / (ratio + 2.0 * np.sqrt(1.2 - 0.2 * ratio**2))
    return float(np.sqrt(1.2 * np.sqrt(3.0) * (1.0 - ratio**2 / 6.0)) * tail**0.25)


def _strength(struck: Struck, body: int) -> float | None:
    """Yield strength [Pa] of the material of the striker (0) or the target (-1)."""
    material = _material(struck, body)
    return None if material is None else material.yield_strength


def _material(struck: Struck, body: int) -> Material | None:
    if body == 0:
        return None if struck.hit.striker is None else struck.hit.striker.material
    return None if struck.target is None or struck.target.section is None else struck.target.section.material


def small(struck: Struck) -> Assumption:
    """Whether the contact is small beside the thickness, the waves and the distance to an edge."""
    hit, quantities, body = struck.hit, struck.quantities, struck.target
    number = "contact radius over half the thickness"
    if struck.bodies[1].dimension == 0:
        return Assumption("local contact", None, None, dict.fromkeys(quantities, 0.0), quantities, "", number)
    round_body = _hertz(struck)
    if round_body is None or body is None or body.section is None or body.thickness is None:
        why = "radius of the contact" if round_body is None else "thickness of the body"
        remedy = SPHERE if round_body is None else "give material and section of the body"
        unknown = dict.fromkeys(quantities)
        return Assumption("local contact", None, SMALL, unknown, quantities, remedy, number, why, round_body is None)
    a = contact_radius(hit.contact, round_body[0], hit.peak_force)
    material, h = body.section.material, body.thickness
    E, nu = (material.E if material.E_across is None else material.E_across), material.nu
    # a half space sinks by this much at the depth of the middle plane, where the plate moves by bending instead
    compliance = (1.0 + nu) * (3.0 - 2.0 * nu) / (np.pi * E * h)
    ratios = {number: 2.0 * a / h}
    if struck.clearance is not None:
        away = max(struck.clearance, a, SAME * h)
        compliance += (1.0 - nu**2) / (2.0 * np.pi * E * away)  # of the image beyond the edge
        ratios[EDGE] = a / away
    history, integrals = hit.history, struck.bending
    changed = softer(history, compliance)
    waves = "contact radius times wavenumber"
    if struck.foreseen:
        foreseen = wavenumber(body, integrals, struck.omega)
        ratios |= {} if foreseen is None else {waves: foreseen * a}
    elif integrals is not None and struck.energy.any():
        x = np.maximum(integrals.wave * a, 1e-3)  # Hertz's pressure is smooth: it hardly drives shorter waves
        spread = 3.0 * (np.sin(x) - x * np.cos(x)) / x**3
        changed["shape"] = struck.of_target(history.shape[:, struck.mine] * spread, "shape")
        wave = float(np.sqrt(struck.energy @ integrals.wave**2 / struck.energy.sum()))
        ratios[waves] = wave * a
    name = max(ratios, key=lambda each: ratios[each])
    remedy = "take a slower blow or a thicker body: Hertz's half space does not fit"
    if name == EDGE:
        remedy = "strike farther from the edge: Hertz's half space does not fit"
    return Assumption("local contact", ratios[name], SMALL, dict(struck.changes(**changed)), quantities, remedy, name)


def slow(struck: Struck) -> Assumption:
    """Whether the contact lasts much longer than the striker's own vibration."""
    hit, quantities, striker = struck.hit, struck.quantities, struck.hit.striker
    number = "own period of the striker over the contact time"
    lumps = striker is not None and striker.modes.thick and isinstance(striker.modes.shapes, SampledShapes)
    if striker is not None and striker.modes.dimension and not lumps:
        value = None  # its modes are part of the blow
        return Assumption("quasi-static contact", value, SLOW, dict.fromkeys(quantities, 0.0), quantities, "", number)
    if striker is None or striker.radius is None or striker.material is None:
        why, remedy = "size and material of the striker", "give it as a sphere or a bar"
        unknown, stated = dict.fromkeys(quantities), _hertz(struck) is None
        return Assumption("quasi-static contact", None, SLOW, unknown, quantities, remedy, number, why, stated)
    E, nu, rho = striker.material.E, striker.material.nu, striker.material.rho
    own = LAMB * np.sqrt(E / (2.0 * (1.0 + nu) * rho)) / striker.radius
    shape = (LIVELY / striker.mass) ** 0.5
    # Hertz's law has the static give of the mode, as has a mode too fast to swing
    effect = struck.between(_with(hit.history, INERT * own, INERT * shape), _with(hit.history, own, shape))
    remedy = "take a striker with its own modes: a bar, or a flexible one"
    return Assumption("quasi-static contact", 2.0 * struck.omega / own, SLOW, effect, quantities, remedy, number)


def _with(history: History, omega: float, shape: float) -> dict[str, np.ndarray]:
    """The fields of a history that change if the striker gets one more mode at rest."""
    column = np.zeros((len(history.shape), 1))
    column[0] = shape
    rest = {name: np.append(getattr(history, name), 0.0) for name in ("zeta", "bias", "start_q", "start_p")}
    return {"omega": np.append(history.omega, omega), "shape": np.hstack([history.shape, column]), **rest}
