"""Describes a scene in sentences, and writes numbers as a person would."""

import math
import re
from typing import Any

import numpy as np

from ..impact import accuracy, threshold
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.striker import Striker
from ..modes.modal import Modes
from .scene import Scene

PREFIX = "fpnµm kMGT"
NBSP = "\N{NO-BREAK SPACE}"  # keeps a number and its unit on one line
NUMBER = re.compile(  # numbers with a unit or an exponent; counts and names stay as they are
    r"(?<![\w.])(\d+(?:\.\d+)?(?:e[+-]?\d+)?) (Hz|s|m|kg|m/\(N s\))(?![\w/])"
    r"|(?<![\w.])(\d+(?:\.\d+)?e[+-]?\d+)(?![\w.])"
)
RAISED = str.maketrans("-.0123456789", "⁻·⁰¹²³⁴⁵⁶⁷⁸⁹")


def si(value: float, unit: str, digits: int = 4) -> str:
    """A number with an SI prefix: 0.0041273 s becomes 4.127 ms."""
    if unit == "kg" and abs(value) < 1.0:
        value, unit = 1e3 * value, "g"
    elif unit == "kg" and abs(value) >= 1e3:
        value, unit = 1e-3 * value, "t"
    if not value or not math.isfinite(value):
        return f"{value:g}{NBSP}{unit}".replace("inf", "∞")
    rounded = abs(float(f"{value:.{digits}g}"))  # rounded first: 0.99996 m must become 1 m, not 1000 mm
    power = 0 if unit == "kg" else int(np.clip(math.floor(math.log10(rounded) / 3.0 + 1e-12), -5, 4))
    return f"{value * 10.0 ** (-3 * power):.{digits}g}{NBSP}{PREFIX[power + 5].strip()}{unit}".replace("-", "−")


def power(value: float) -> str:
    """A number as a power of ten, 4.5 · 10⁻⁶, that no line breaks."""
    if not value or not math.isfinite(value):
        return f"{value:g}".replace("inf", "∞")
    digits, exponent = f"{value:.1e}".split("e")
    size = f"10{str(int(exponent)).translate(RAISED)}"
    return size if digits == "1.0" else f"{digits.removesuffix('.0')}{NBSP}·{NBSP}{size}"


def tidy(text: str) -> str:
    """A sentence with readable numbers: 1.34e+04 Hz becomes 13.4 kHz, 4.5e-03 becomes 4.5 · 10⁻³."""

    def written(found: re.Match) -> str:
        number, unit, bare = found.groups()
        return power(float(bare)) if bare else si(float(number), unit)

    return NUMBER.sub(written, text)


def place(point: Any) -> str:
    """Coordinates of a point with their unit."""
    numbers = [f"{x:.4g}".replace("-", "−") for x in np.atleast_1d(point)]
    return (f"({', '.join(numbers)})" if len(numbers) > 1 else numbers[0]) + f"{NBSP}m"


def words(scene: Scene, response: Response) -> list[str]:
    """Describe the scene in a few sentences."""
    striker, law = response.striker, response.contacts[0]
    assert striker is not None
    arrives = arriving(scene.striker.kind, striker)
    blow = f"It is struck at {place(response.at)} by {arrives}, moving at {si(response.speed, 'm/s')}."
    # what the kinetic-energy criterion predicts for the blow, from its contact resonance on a rigid wall
    resonance = accuracy.contact_resonance(law, striker.felt_mass, response.speed)
    limit = threshold.threshold_frequency(response.target, response.at, striker.felt_mass)
    wall = f"contact resonance, {si(resonance, 'Hz', 3)}"
    if limit is None:
        hits = f"No rebound expected, whatever the {wall}: the body is no heavier than the striker."
    elif math.isinf(limit):
        hits = f"Single hit expected, whatever the {wall}: the striker always rebounds."
    else:
        number, side = ("Single hit", "below") if resonance < limit else ("Several hits", "above")
        hits = f"{number} expected: the {wall}, is {side} the limit of {si(limit, 'Hz', 3)} (kinetic-energy criterion)."
    return [body(scene, response.target), blow, contact(law), *_besides(scene), hits]


def _besides(scene: Scene) -> list[str]:
    """What else acts in a blow, and what ends it, in sentences."""
    given, found = scene.blow.values, []
    for name, pushed in (("striker_force", "striker"), ("target_force", "body")):
        if force := given.get(name):
            way = "along" if force > 0.0 else "against"
            found.append(f"A constant force of {si(abs(force), 'N')} pushes the {pushed} {way} the blow.")
    ends = [f"after {si(given['duration'], 's')}"] if given.get("duration") else []
    ends += [f"with impact {given['max_impacts']}"] if given.get("max_impacts") else []
    return found + ([f"It is followed no further than {' or '.join(ends)}."] if ends else [])


def body(scene: Scene, modes: Modes) -> str:
    """The struck body in a sentence."""
    low, high = (f(modes.shapes.grid()[0], axis=0) for f in (np.min, np.max))
    extent = " × ".join(si(x, "m") for x in high - low)
    kind = {1: "beam", 2: "plate"}[modes.dimension]
    if scene.mesh.kind == "disk":
        kind, extent = "disk", f"{si(2.0 * scene.mesh.values['radius'], 'm')} diameter"
    kind = f"curved {kind}" if getattr(modes.section, "rise", None) else kind
    ribs = f", with {len(scene.rib)} rib{'s' * (len(scene.rib) > 1)}" if scene.rib else ""
    flexible = modes.frequencies[modes.omega > 0.0]
    given = scene.held or {"boundary": "free"}
    held = {edge: how if isinstance(how, str) else "held by springs" for edge, how in given.items()}
    if len(set(held.values())) == 1 and ("boundary" in held or len(held) == len(scene.body().edges) - 1):
        edges = next(iter(held.values())) + (" all round" if modes.dimension == 2 else " at both ends")
    else:
        edges = ", ".join(f"{how} at the edge “{name}”" for name, how in held.items())
    ratio = modes.damping_ratio[modes.omega > 0.0]
    damping = "without damping" if not ratio.any() else f"damped by {100 * ratio[0]:.3g} % of critical"
    return (
        f"A {kind} of {extent}{ribs}, {si(modes.mass, 'kg')}, {edges}; its first flexible mode is at "
        f"{si(flexible[0], 'Hz')}, {damping}."
    )


def arriving(kind: str, striker: Striker) -> str:
    """A striker of a kind, as in the scene, in words."""
    arrives = {
        "stick": f"a stick of {si(striker.mass, 'kg')}, hinged at its far end",
        "sphere": f"a ball of {si(striker.mass, 'kg')}",
        "rigid": f"a rigid mass of {si(striker.mass, 'kg')}",
        "hammer": f"a hammer of {si(striker.mass, 'kg')} in two parts",
        "bar": f"a flexible bar of {si(striker.mass, 'kg')}",
        "turning": f"a rigid body of {si(striker.mass, 'kg')}, felt as {si(striker.felt_mass, 'kg')} off its centre",
    }[kind]
    if kind == "stick":
        bending = striker.modes.frequencies[striker.modes.omega > 0.0][0]
        arrives += f" (effective mass {si(striker.felt_mass, 'kg')} at the tip; first bending mode {si(bending, 'Hz')})"
    if striker.hand is not None:
        arrives += f", held by a hand in which it swings at {si(striker.hand_frequency, 'Hz')}"
    if striker.gravity:
        arrives += f", which falls back at {si(striker.gravity, 'm/s²')}"
    return arrives


def contact(law: Contact) -> str:
    """A contact law in a few sentences."""
    raised = "" if law.exponent == 1.0 else f"{law.exponent:g}".translate(RAISED)
    stiffness = si(law.stiffness, "N/m") + raised
    sentence = f"The contact is a spring that only pushes, with a force of {stiffness} × indentation{raised}"
    sentence += f", with loss {law.loss:.3g} s/m." if law.loss else "."
    if law.gap:
        way = "apart" if law.gap > 0.0 else "pressed in"
        sentence += f" At the start the bodies are {si(abs(law.gap), 'm')} {way}."
    return sentence + law.law.sentence(law, si)


def tip_notes(scene: Scene) -> tuple[str, ...]:
    """What a choice of hammers does not follow: a model to be chosen, and a contact that is no linear spring, as tips
    are, with what it amounts to."""
    found: tuple[str, ...] = ()
    if scene.target.values.get("model") == "auto":
        found = (
            'hammers are chosen on the body as stated: model = "auto" is not followed; state the theory and the air '
            "that `fem-impact strike` says the blow requires",
        )
    if scene.contact.kind == "linear":
        return found
    law, mass, speed = scene.make_contact(), scene.make_striker().felt_mass, float(scene.blow.values["speed"])
    alike = accuracy.resonant_stiffness(mass, accuracy.contact_resonance(law, mass, speed))
    return (
        *found,
        f"tips are linear springs [N/m]; the scene's contact is of another kind ({scene.contact.kind}) and not used: "
        f"under {1e3 * mass:.4g} g at {speed:g} m/s it acts as long as a tip of {alike:.3g} N/m",
    )
