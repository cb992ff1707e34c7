"""Is the model itself right? Examines every assumption of a blow after it, and what can be foreseen before it.

Nothing is examined until somebody asks: a response carries the examiner along (`Response.assumptions`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

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
from ..modes.analytic import DiskShapes, RectangleShapes
from ..modes.modal import FieldShapes, Modes
from ..modes.ritz import RitzShapes
from . import bending, deflection, fresh, local_contact, still_air, thinness, unstated_damping
from .idealisation import Surroundings, unyielding
from .restrike import Struck
from .target import BOTH, Target

EXAMINERS = (
    thinness.of_target, thinness.of_striker, deflection.of_target, local_contact.yielding, local_contact.small,
    local_contact.slow, still_air.of_target, unstated_damping.of_both,
)  # fmt: skip

# [-] tolerance of blows that only tell what can be foreseen, on a wall or for the cost: estimates err more
ROUGH = 1e-2


@dataclass(frozen=True, eq=False)
class Simplified:
    """A body that the plan treats as rigid or infinite: what is known of it besides the modes of the blow."""

    kind: str  # "rigid" or "infinite"
    mass: float  # [kg]
    mesh: Mesh
    section: Plate | Beam | None
    supports: Mapping[str, Any]


def audited(hit: Response, simplified: Simplified | None = None) -> Response:
    """The response of a blow with its examiner."""
    return replace(hit, audit=partial(examine, simplified=simplified))


def examine(hit: Response, simplified: Simplified | None = None) -> tuple[Assumption, ...]:
    """Every assumption of a blow, in the order of `assumption.ALL`."""
    struck = _struck(hit, simplified)

    def examined() -> tuple[Assumption, ...]:
        return tuple(examiner(struck) for examiner in EXAMINERS)

    short = hit.history.stretched is None and len(hit.history.steps) <= fresh.STEPS
    return fresh.soon(examined) if short else examined()


def required(target: Target, hit: Response) -> tuple[Target, str] | None:
    """The target with the better model that the tolerance of a blow requires, and why; None if it requires none."""
    if target.mesh is None:
        return None
    for each in hit.assumptions:
        if each.worst <= hit.tolerance:
            continue
        because = f"which changes the {each.change()} ({each.reading})"
        if each.name == "thin target" and target.section is not None and not target.thick:
            theory = THEORIES[target.mesh.dimension][1]
            return replace(target, theory=theory), f"the target now has shear and rotary inertia ({theory}), {because}"
        if each.name == "still air" and target.mesh.dimension == 2 and target.air is None:
            return replace(target, air=BOTH), f"the target now moves the air on both sides, {because}"
        if each.name == "small deflections" and target.can_stretch and not target.stretching:
            return replace(target, stretching=True), f"the target now stiffens as it stretches, {because}"
    return None


def foresee(
    target: Target, body: Modes | Simplified, striker: Striker, contact: Contact, at: Any, **how: Any
) -> tuple[Assumption, ...]:
    """What is known of every assumption before a blow, from one on a wall; effects are not.

    ``body`` is what is known of the target: modes, its first ones at least, or nothing but mesh and section. ``how``
    are ``speed``, ``quantity`` and ``rings``: whether the damping of the target is part of the model.
    """
    speed, rings, mesh = how["speed"], how["rings"], None
    if isinstance(body, Modes):
        modes = replace(body, air=body.air or target.air is not None, stretches=target.stretching)
        place = modes.point("at", at)
        known, ideal = bending.known(modes), ""
    else:
        place = np.atleast_2d(np.asarray(at, float))
        ratio, mesh = target.damping_ratio, body.mesh
        damped = not rings or (ratio is not None and (callable(ratio) or bool(np.any(ratio))))
        modes = replace(
            unyielding(place[0], body.mass), damping_ratio=np.full(1, float(damped)), thick=target.thick,
            air=target.air is not None, stretches=target.stretching,
        )  # fmt: skip
        known, ideal = bending.around(modes, body.section, mesh, body.supports), body.kind
    stiff = replace(collision.shortened(striker, striker.modes.n_rigid), hand=None)
    bare, wall = replace(contact, loss=0.0, gap=0.0), unyielding(np.zeros(1), 1.0)
    try:
        with build.uncompiled():
            hit = collision.strike(wall, stiff, bare, at=np.zeros(1), speed=speed, tolerance=ROUGH)
    except SimulationError:
        return unexamined(how["quantity"], "the same blow on a wall cannot be computed", "strike")
    hit = replace(hit, striker=striker, contacts=(contact,), quantities=how["quantity"])
    clearance = _clearance(modes, known, mesh, place[0])
    struck = Struck(hit, known, bending.known(striker.modes), ideal, clearance, place, (striker.modes, modes))
    return tuple(replace(examiner(struck), effect={}) for examiner in EXAMINERS)


def _struck(hit: Response, simplified: Simplified | None) -> Struck:
    modes = hit.bodies[-1]
    if simplified is None:
        target, ideal = bending.known(modes), ""
    else:
        whole, ideal = replace(modes, mass=simplified.mass), simplified.kind
        target = bending.around(whole, simplified.section, simplified.mesh, simplified.supports)
    known = bending.known(hit.bodies[0]) if hit.striker is not None else None
    mesh = None if simplified is None else simplified.mesh
    return Struck(hit, target, known, ideal, _clearance(modes, target, mesh, hit.at))


def _clearance(modes: Modes, known: bending.Known | None, mesh: Mesh | None, at: np.ndarray | None) -> float | None:
    """Distance [m] from the strike point to the nearest edge of a plate, or end or side of a beam; None if not known.

    A beam is struck on its centre line.
    """
    shapes = bending.unwrapped(modes.shapes)[0]
    if at is None or not modes.dimension:
        return None
    if isinstance(shapes, (FieldShapes, RitzShapes)):
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
    view = None if mesh is None else Surroundings.seen(mesh, at)
    return None if view is None else view.clearance
