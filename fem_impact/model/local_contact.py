"""Is the contact elastic, small and slow? What Hertz's law leaves out does to a blow.

The contact of a sphere of radius R under the force F has the radius a = (3 F R / (4 E*))**(1/3) and the largest
pressure p = (6 F E*^2 / (pi^3 R^2))**(1/3). The softer body begins to yield at p = 1.6 Y. From there the restitution
falls as the law of a contact that yields says, towards V**(-1/4).

References
----------
Johnson (1985), Contact mechanics, sections 3.4 (point force), 4.2, 6.3 and 11.5; Lamb (1882), Proc. London Math. Soc.
13, 189-212 (modes of a sphere).
"""

from dataclasses import replace

import numpy as np

from .._base.rounding import SAME
from ..impact.assumption import Assumption
from ..impact.compiled.laws.plastic import PlasticLaw
from ..impact.contact import YIELDS, Contact, loss_number
from ..impact.history import History
from ..modes.shapes import SampledShapes
from .restrike import Doubt, Struck, softened_system
from .thinness import wavenumber

LAMB = 2.64  # [-] fact: lowest spheroidal mode of a sphere, omega R / c_s, for nu = 0.25; 2.65 for 0.33
LIVELY = 2.5  # [-] fact: squared shape of that mode at its pole times the mass of the sphere
SPHERE = "give the striker as a sphere with its material, and the contact between the two"
PLASTIC = "take a contact that yields (yield_strength of `Contact.between`, or elastic_plastic), or a slower blow"
UNIT = Contact.elastic_plastic(1.0, yield_approach=1.0)
YIELDING = Doubt("no yielding", "contact pressure over that at first yield", 1.0)
# small beside half the thickness, a wavelength / (2 pi) and the edge's distance, of which one decides: a choice
SMALL = Doubt("local contact", "contact radius over half the thickness", 0.5, "give material and section of the body")
EDGE = replace(SMALL, number="contact radius over the distance to the edge")
WAVES = replace(SMALL, number="contact radius times wavenumber")
# slow if the striker swings five times within the contact
SLOW = Doubt(
    "quasi-static contact", "own period of the striker over the contact time", 0.2, "give it as a sphere or a bar"
)


def _hertz(struck: Struck) -> tuple[float, float] | None:
    """Radius R [m] of the sphere and the modulus E* [Pa] of its contact; None if these are not known."""
    striker, contact = struck.hit.striker, struck.hit.contact
    if striker is None or striker.radius is None or contact.exponent != 1.5 or not contact.law.hertzian:
        return None
    return striker.radius, 0.75 * contact.stiffness / striker.radius**0.5


def contact_radius(contact: Contact, radius: float, force: float) -> float:
    """Radius [m] of the contact of a sphere under a force [N], also beyond first yield."""
    return float((radius * contact.law.wide(contact, contact.law.approach(contact, force))) ** 0.5)


def examine_pressure(struck: Struck) -> Assumption:
    """Whether the contact stays elastic."""
    hit = struck.hit
    if hit.history.law["yield_approach"][0] > 0.0:
        return YIELDING.holds(struck)
    round_body = _hertz(struck)
    materials = {
        "striker": None if hit.striker is None else hit.striker.material,
        "target": None if struck.target is None or struck.target.section is None else struck.target.section.material,
    }
    strengths = {name: None if each is None else each.yield_strength for name, each in materials.items()}
    missing = [name for name, strength in strengths.items() if strength is None]
    if round_body is None:
        return YIELDING.unknown(struck, "radius and material of the contact", SPHERE, stated=True)
    if len(missing) == 2:
        return YIELDING.unknown(struck, "yield strengths", "state yield_strength of both materials")
    R, E = round_body
    weakest = min(strength for strength in strengths.values() if strength is not None)
    value = (6.0 * hit.peak_force * E**2 / (np.pi**3 * R**2)) ** (1.0 / 3.0) / (YIELDS * weakest)
    if value <= 1.0 and missing:
        return YIELDING.unknown(struck, f"yield strength of the {missing[0]}", "state its yield_strength", value)
    if value <= 1.0:
        return YIELDING.judged(struck, value, dict.fromkeys(struck.quantities, 0.0), PLASTIC)
    lossy, bare = hit.history.law.copy(), hit.history.law.copy()
    k, a = bare["stiffness"][0], bare["exponent"][0]
    stored = hit.peak_force * (hit.peak_force / k) ** (1.0 / a) / (a + 1.0)  # [J]
    speed = abs(hit.speed) or np.sqrt(2.0 * stored / hit.bodies[0].mass)  # at rest, a constant force presses it
    bare["loss"][0] += SAME / speed  # a lossy contact has no compliance in series: both blows are to lack it
    lossy["loss"][0] += loss_number(restitution(value ** (-2.5))) / speed  # pressure goes as speed**0.4 on a wall
    return YIELDING.judged(struck, value, struck.between({"law": bare}, {"law": lossy}), PLASTIC)


def restitution(ratio: float) -> float:
    """Restitution [-] of a sphere that yields on a rigid wall, for the speed of first yield over its speed."""
    return 1.0 if ratio >= 1.0 else PlasticLaw().rebound(UNIT, 0.4 / ratio**2)  # first yield takes 2/5


def examine_size(struck: Struck) -> Assumption:
    """Whether the contact is small beside the thickness, the waves and the distance to an edge."""
    hit, body = struck.hit, struck.target
    if struck.bodies[1].dimension == 0:
        return SMALL.holds(struck)
    round_body = _hertz(struck)
    if round_body is None:
        return SMALL.unknown(struck, "radius of the contact", SPHERE, stated=True)
    if body is None or body.section is None or body.thickness is None:
        return SMALL.unknown(struck, "thickness of the body")
    a = contact_radius(hit.contact, round_body[0], hit.peak_force)
    material, h = body.section.material, body.thickness
    E, nu = (material.E if material.E_across is None else material.E_across), material.nu
    # a half space sinks by this much at the depth of the middle plane, where the plate moves by bending instead
    compliance = (1.0 + nu) * (3.0 - 2.0 * nu) / (np.pi * E * h)
    ratios = {SMALL: 2.0 * a / h}
    if struck.clearance is not None:
        away = max(struck.clearance, a, SAME * h)
        compliance += (1.0 - nu**2) / (2.0 * np.pi * E * away)  # of the image beyond the edge
        ratios[EDGE] = a / away
    history, integrals = hit.history, struck.bending
    changed, wave = softened_system(history, compliance), None
    if struck.planned:
        wave = wavenumber(body, integrals, struck.omega)
    elif integrals is not None and struck.target_energy.any():
        x = np.maximum(integrals.wave * a, 1e-3)  # Hertz's pressure is smooth: it hardly drives shorter waves
        spread = 3.0 * (np.sin(x) - x * np.cos(x)) / x**3
        changed["shape"] = struck.with_target(history.shape[:, struck.mine] * spread, "shape")
        wave = integrals.mean_wave(struck.target_energy)
    if wave is not None:
        ratios[WAVES] = wave * a
    doubt = max(ratios, key=lambda each: ratios[each])
    remedy = "take a slower blow or a thicker body: Hertz's half space does not fit"
    if doubt is EDGE:
        remedy = "strike farther from the edge: Hertz's half space does not fit"
    return doubt.judged(struck, ratios[doubt], struck.changes(**changed), remedy)


def examine_time(struck: Struck) -> Assumption:
    """Whether the contact lasts much longer than the striker's own vibration."""
    striker = struck.hit.striker
    lumps = striker is not None and striker.modes.thick and isinstance(striker.modes.shapes, SampledShapes)
    if striker is not None and striker.modes.dimension and striker.modes.omega.any() and not lumps:
        return SLOW.holds(struck)  # its modes are part of the blow
    if striker is None or striker.radius is None or striker.material is None:
        return SLOW.unknown(struck, "size and material of the striker", stated=_hertz(struck) is None)
    E, nu, rho = striker.material.E, striker.material.nu, striker.material.rho
    own = LAMB * np.sqrt(E / (2.0 * (1.0 + nu) * rho)) / striker.radius
    shape = (LIVELY / striker.mass) ** 0.5
    # Hertz's law has the static give of the mode, as has one ten times faster, which leaves 1 % of the effect
    effect = struck.between(_with(struck.hit.history, 10.0 * own, 10.0 * shape), _with(struck.hit.history, own, shape))
    return SLOW.judged(
        struck, 2.0 * struck.omega / own, effect, "take a striker with its own modes: a bar, or a flexible one"
    )


def _with(history: History, omega: float, shape: float) -> dict[str, np.ndarray]:
    """The fields of the system that change if the striker gets one more mode at rest."""
    column = np.zeros((len(history.shape), 1))
    column[0] = shape
    rest = {name: np.append(getattr(history.system, name), 0.0) for name in ("zeta", "bias", "q", "p")}
    return {"omega": np.append(history.omega, omega), "shape": np.hstack([history.shape, column]), **rest}
