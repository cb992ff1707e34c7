"""Is the model itself right? Examines every assumption of a blow after it, and what can be predicted before it.

Nothing is examined until somebody asks: a response carries the examiner along (`Response.assumptions`).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from .._base import check
from .._base.check import SimulationError
from ..fe.assembly import THEORIES
from ..fe.section import Beam, Plate
from ..impact import collision
from ..impact.assumption import Assumption, unexamined
from ..impact.compiled import build
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.striker import Striker
from ..mesh.meshes import Mesh
from ..modes.disk import DiskShapes
from ..modes.modal import Modes
from ..modes.rectangle import RectangleShapes
from ..modes.shapes import ElementShapes, unwrap_shapes
from . import bending, deflection, fresh, local_contact, sliding, still_air, thinness
from .idealisation import Surroundings, rigid_plate
from .restrike import Doubt, Struck
from .target import BOTH, Target

# [-] tolerance of blows that only predict, on a wall or for the cost: estimates err more
ROUGH = 1e-2
# [-] damping ratio tried, on the side of caution: bare metal has a hundredth of it, wood as much, felt more
PLAUSIBLE = 0.01
DAMPING = Doubt("stated damping", "damping ratio tried", None)


def examine_damping(struck: Struck) -> Assumption:
    """The struck body, unless its damping is stated, and a flexible striker: every body has some."""
    hit, zeta, unstated = struck.hit, struck.hit.history.zeta.copy(), []
    for name, body, modes in zip(("striker", "struck body"), (0, len(hit.bodies) - 1), struck.bodies):
        flexible = modes.omega > 0.0
        simple = body and struck.ideal and not struck.planned
        if modes.dimension and flexible.any() and not modes.damping_ratio[flexible].any() and not simple:
            unstated.append(name)
            if not struck.planned:
                zeta[hit.body_slice(body)] = np.where(flexible, PLAUSIBLE, 0.0)
    if not unstated:
        return DAMPING.holds(struck)
    remedy = f"state the damping ratio of the {' and of the '.join(unstated)}"
    if struck.planned:
        return DAMPING.unknown(struck, "what a damping that nobody stated would change", remedy, PLAUSIBLE)
    effect = struck.changes(zeta=zeta)
    if "sound" in effect and "struck body" in unstated:
        effect["sound"] = 1.0  # it would ring for ever
    return DAMPING.judged(struck, PLAUSIBLE, effect, remedy)


EXAMINERS = (
    thinness.examine_target, thinness.examine_shallowness, thinness.examine_striker, deflection.examine_deflection,
    local_contact.examine_pressure, local_contact.examine_size, local_contact.examine_time, sliding.examine_friction,
    still_air.examine_air, examine_damping,
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Simplified:
    """A body that the plan treats as rigid or infinite: what is known of it besides the modes of the blow."""

    kind: str  # "rigid" or "infinite"
    mass: float  # [kg]
    mesh: Mesh
    section: Plate | Beam | None
    supports: Mapping[str, Any]


def with_examiner(hit: Response, simplified: Simplified | None = None) -> Response:
    """The response of a blow that was just struck, given its examiner."""
    check.settle(hit, audit=partial(examine, simplified=simplified))
    return hit


def examine(hit: Response, simplified: Simplified | None = None) -> tuple[Assumption, ...]:
    """Every assumption of a blow, in the order of `assumption.ALL`."""
    struck = _struck(hit, (hit.bodies[0], hit.bodies[-1]), simplified, hit.at)

    def examined() -> tuple[Assumption, ...]:
        return tuple(examiner(struck) for examiner in EXAMINERS)

    steps = len(EXAMINERS) * len(hit.history.steps)  # about, as each may strike again
    short = hit.history.stretched is None and steps <= fresh.TOGETHER * fresh.STEPS
    return fresh.answer_soon(examined) if short else examined()


def required_model(
    target: Target, hit: Response, without: Collection[str] = (), together: bool = True
) -> tuple[dict[str, Any], str, list[str]] | None:
    """Changes of the target to the better model that the tolerance of a blow requires, why, and for which assumptions.

    None if it requires none. Assumptions ``without`` a better model stay; if not ``together``, all but the first do.
    """
    if target.mesh is None:
        return None
    plate, theory = target.mesh.dimension == 2, THEORIES[target.mesh.dimension][1]
    plain = getattr(target.section, "plain", True)
    better: dict[str, tuple[bool, dict[str, Any], str]] = {  # by assumption: whether it can be had, and what it does
        "thin target": (
            target.section is not None and plain and not target.thick, {"theory": theory},
            f"has shear and rotary inertia ({theory})",
        ),
        "still air": (plate and target.air is None, {"air": BOTH}, "moves the air on both sides"),
        "small deflections": (
            target.can_stretch and not target.stretching, {"stretching": True}, "stiffens as it stretches",
        ),
    }  # fmt: skip
    wrong = [
        each for each in hit.assumptions
        if each.name not in without and better.get(each.name, (False,))[0] and each.worst > hit.tolerance
    ][: None if together else 1]  # fmt: skip
    if not wrong:
        return None
    does = (f"{better[each.name][2]}, which changes the {each.change()} ({each.reading})" for each in wrong)
    changes = dict(item for each in wrong for item in better[each.name][1].items())
    return changes, f"the target now {', and '.join(does)}", [each.name for each in wrong]


def examine_plan(
    target: Target, body: Modes | Simplified, striker: Striker, contact: Contact, at: Any, **how: Any
) -> tuple[Assumption, ...]:
    """What is known of every assumption before a blow, from one on a wall; effects are not.

    ``body`` is what is known of the target: modes, its first ones at least, or nothing but mesh and section. ``how``
    are ``speed``, ``quantity`` and ``rings``: whether the damping of the target is part of the model.
    """
    simplified = None if isinstance(body, Modes) else body
    if isinstance(body, Modes):
        modes = replace(body, air=body.air or target.air is not None, stretches=target.stretching)
        place = modes.point("at", at)
    else:
        place = np.atleast_2d(np.asarray(at, float))
        ratio = target.damping_ratio
        damped = not how["rings"] or (ratio is not None and (callable(ratio) or bool(np.any(ratio))))
        modes = replace(
            rigid_plate(place[0], body.mass), damping_ratio=np.full(1, float(damped)), thick=target.thick,
            air=target.air is not None, stretches=target.stretching,
        )  # fmt: skip
    stiff = replace(collision.shortened_striker(striker, striker.modes.n_rigid), hand=None, gravity=0.0)
    bare, wall = replace(contact, loss=0.0, gap=0.0), rigid_plate(np.zeros(1), 1.0)
    try:
        with build.uncompiled():
            hit = collision.strike(wall, stiff, bare, at=np.zeros(1), speed=how["speed"], tolerance=ROUGH)
    except SimulationError:
        return unexamined(how["quantity"], "the same blow on a wall cannot be computed", "strike")
    hit = replace(hit, striker=striker, contacts=(contact,), quantities=how["quantity"])
    struck = _struck(hit, (striker.modes, modes), simplified, place[0])
    return tuple(replace(examiner(replace(struck, place=place)), effect={}) for examiner in EXAMINERS)


def _struck(hit: Response, bodies: tuple[Modes, Modes], simplified: Simplified | None, at: np.ndarray | None) -> Struck:
    """A blow as it is examined: the response, striker and target, and where the target is struck [m]."""
    modes, mesh, ideal = bodies[1], None, ""
    if simplified is None:
        target = bending.known_of(modes)
    else:
        mesh, ideal, whole = simplified.mesh, simplified.kind, replace(modes, mass=simplified.mass)
        target = bending.bending_around(whole, simplified.section, mesh, simplified.supports)
    striker = None if hit.striker is None else bending.known_of(bodies[0])
    return Struck(hit, bodies, target, striker, ideal, _clearance(modes, target, mesh, at))


def _clearance(modes: Modes, known: bending.Known | None, mesh: Mesh | None, at: np.ndarray | None) -> float | None:
    """Distance [m] from the strike point to the nearest edge of a plate, or end or side of a beam; None if not known.

    A beam is struck on its centre line.
    """
    shapes = unwrap_shapes(modes.shapes)[0]
    if at is None or not modes.dimension:
        return None
    if isinstance(shapes, ElementShapes):
        mesh = shapes.system.mesh
    if modes.dimension == 1:
        width = None if known is None else still_air.width_of(known)
        line = mesh.points if mesh is not None else shapes.grid()[0] if known is not None else None
        if width is None or line is None:
            return None
        return float(min(at[0] - line.min(), line.max() - at[0], 0.5 * width))
    if isinstance(shapes, RectangleShapes):
        return float(np.min([at, np.array([shapes.length, shapes.width]) - at]))
    if isinstance(shapes, DiskShapes):
        return shapes.radius - float(np.hypot(*at))
    view = None if mesh is None else Surroundings.of(mesh, at)
    return None if view is None else view.clearance
