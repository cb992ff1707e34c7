"""Is the model itself right? Examines every assumption of a blow after it, and what can be foreseen before it.

Nothing is examined until somebody asks: a response carries the examiner along (`Response.assumptions`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..fe.assembly import THEORIES
from ..fe.section import Beam, Plate
from ..impact import collision
from ..impact.assumption import Assumption
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.striker import Striker
from ..mesh.meshes import Mesh
from ..modes.analytic import DiskShapes, RectangleShapes
from ..modes.modal import FieldShapes, Modes
from ..modes.ritz import RitzShapes
from . import bending, deflection, local_contact, still_air, thinness, unstated_damping
from .idealisation import Surroundings, unyielding
from .restrike import Struck
from .target import BOTH, Target

EXAMINERS = (
    thinness.of_target, thinness.of_striker, deflection.of_target, local_contact.yielding, local_contact.small,
    local_contact.slow, still_air.of_target, unstated_damping.of_both,
)  # fmt: skip

WALL = 1e-2  # [-] tolerance of the blow on a wall that tells what can be foreseen


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
    return tuple(examiner(struck) for examiner in EXAMINERS)


def required(target: Target, hit: Response) -> tuple[Target, str] | None:
    """The target with the better model that the tolerance of a blow requires, and why; None if it requires none."""
    if target.model != "auto" or target.mesh is None:
        return None
    for each in hit.assumptions:
        if each.worst <= hit.tolerance:
            continue
        because = f"because {each.name!r} would change the blow by {each.worst:.1g}"
        if each.name == "thin target" and target.section is not None and not target.thick:
            theory = THEORIES[target.mesh.dimension][1]
            return replace(target, theory=theory), f"the target has shear and rotary inertia ({theory}), {because}"
        if each.name == "still air" and target.mesh.dimension == 2 and target.air is None:
            return replace(target, air=BOTH), f"the target moves air on both sides, {because}"
        if each.name == "small deflections" and target.can_stretch and not target.stretching:
            return replace(target, stretching=True), f"the target stiffens as it stretches, {because}"
    return None


def foresee(
    simplified: Simplified, striker: Striker, contact: Contact, at: Any, speed: float
) -> tuple[Assumption, ...]:
    """What is known of every assumption before a blow, from one on a wall; effects are not."""
    place, mass = np.atleast_1d(np.asarray(at, float)), 1.0
    stiff = collision.shortened(striker, striker.modes.n_rigid)
    bare = replace(contact, loss=0.0, gap=0.0)
    hit = collision.strike(unyielding(place, mass), stiff, bare, at=place, speed=speed, tolerance=WALL)
    hit = replace(hit, striker=striker, contacts=(contact,))
    struck = replace(_struck(hit, simplified), foreseen=True)
    return tuple(replace(examiner(struck), effect={}) for examiner in EXAMINERS)


def _struck(hit: Response, simplified: Simplified | None) -> Struck:
    modes = hit.bodies[-1]
    if simplified is None:
        target, ideal = bending.known(modes), ""
    else:
        whole, ideal = replace(modes, mass=simplified.mass), simplified.kind
        target = bending.around(whole, simplified.section, simplified.mesh, simplified.supports)
    striker = hit.bodies[0] if hit.striker is not None else None
    flexible = striker is not None and striker.dimension and (striker.omega > 0.0).any()
    known = bending.known(striker) if striker is not None and flexible else None
    mesh = None if simplified is None else simplified.mesh
    return Struck(hit, target, known, ideal, _clearance(modes, mesh, hit.at))


def _clearance(modes: Modes, mesh: Mesh | None, at: np.ndarray | None) -> float | None:
    """Distance [m] from the strike point to the nearest edge of a plate; None if it is not known."""
    shapes = bending.unwrapped(modes.shapes)[0]
    if at is None:
        return None
    if isinstance(shapes, (FieldShapes, RitzShapes)):
        mesh = shapes.system.mesh
    if isinstance(shapes, RectangleShapes):
        return float(np.min([at, np.array([shapes.length, shapes.width]) - at]))
    if isinstance(shapes, DiskShapes):
        return shapes.radius - float(np.hypot(*at))
    if mesh is None or mesh.dimension != 2:
        return None
    view = Surroundings.seen(mesh, at)
    return None if view is None else view.clearance
