"""Does friction matter? An oblique blow slides, and one beside a centre of mass begins to; contacts here have none.

A body that comes with the speed v_t across the normal impulse J slips at ``v_t + W_tn J + W_tt T`` under a tangential
impulse T; W are the motions of its rigid and slow modes per impulse. By Coulomb and Routh it slides with dT = mu dJ
until it stops, then sticks if that takes no more, or slides another way; that is followed through the impulse. The mean
g = T / J goes with the normal force and drives the modes by their shapes across: ``s_n (s_n + g s_t)`` stands for
``s_n**2``. That dT / dJ changes on the way makes the parting speed another: the spring gives back under one what it
took under another. The other body is taken as fixed across.

References
----------
Stronge (2000), Impact Mechanics, chapters 3 and 4; Routh (1905), Dynamics of a System of Rigid Bodies I, 187.
"""

from typing import NamedTuple

import numpy as np

from .._base.rounding import SAME
from ..impact.assumption import FRICTION, Assumption
from ..modes.modal import Modes
from .restrike import Doubt, Struck

STICKS = Doubt("no friction", "tangential over normal impulse, sticking", None)
SLIDES = Doubt("no friction", "tangential over normal impulse that would stick", None)
STEPS = 64  # [-] parts of the impulse: the stages begin and end to some 1 %, which estimates may err by
SQUARE = "strike square to the surface, in line with the centre of mass: contacts here have no friction"


class Dragged(NamedTuple):
    """What friction does to one body."""

    needed: float  # [-] tangential over normal impulse, or that which would stick
    slides: bool  # to the end
    squares: np.ndarray  # (n_modes,) [-] factors of squared shapes that stand for friction
    parting: float  # [-] relative change of the parting speed as sliding and sticking follow each other


def examine_friction(struck: Struck) -> Assumption:
    """Striker and target, as far as their motion across the blow is known."""
    hit, history = struck.hit, struck.hit.history
    at, tip, found = hit.at if struck.place is None else struck.place[0], getattr(hit.striker, "at", None), []
    for body, place, sign in ((0, tip, -1.0), (len(hit.bodies) - 1, at, 1.0)):
        if place is None or not place.size or not hit.impulse:
            continue
        columns, p = hit.body_slice(body), np.zeros(0)
        if not struck.planned:
            p = history.start_p[columns]
        elif body == 0 and hit.striker is not None:
            p = hit.speed * hit.striker.motion
        slow = history.omega <= struck.omega
        slow[columns] = False
        others = float(np.square(history.shape[0, slow]).sum())
        dragged = _drag_of_body(struck.bodies[min(body, 1)], place[None], p, sign * hit.impulse, struck.omega, others)
        if dragged is not None and dragged.needed > SAME:
            found.append((columns, dragged))
    if not found:
        return STICKS.holds(struck)
    worst = max((each for _, each in found), key=lambda each: each.needed)
    doubt = SLIDES if worst.slides else STICKS
    if min(each.squares.min() for _, each in found) <= 0.0:
        return doubt.unknown(struck, "whether friction jams the contact", SQUARE, worst.needed)
    if struck.planned:
        return doubt.judged(struck, worst.needed, {}, SQUARE)
    changed = {name: getattr(history.system, name).copy() for name in ("shape", "q", "p")}
    for columns, each in found:
        root = np.sqrt(each.squares)
        changed["shape"][:, columns] *= root
        for name in ("q", "p"):  # the motion at the contact stays as it is
            changed[name][columns] /= root
    effect = struck.changes(**changed)
    parting = sum(each.parting for _, each in found)
    for name, share in (("restitution", 1.0), ("impulse", 0.5)):
        if (known := effect.get(name)) is not None:
            effect[name] = known + share * parting
    return doubt.judged(struck, worst.needed, effect, SQUARE)


def _drag_of_body(
    modes: Modes, place: np.ndarray, p: np.ndarray, impulse: float, omega: float, others: float
) -> Dragged | None:
    """What friction does to a body that moves with modal velocities p (n,) as the contact pushes it with an impulse.

    ``omega`` [rad/s] is that of the contact, ``others`` [1/kg] what the other body moves; None if the motion across is
    not known.
    """
    across = modes.shapes.across(place)
    if across is None:
        return None
    along, aside, slow = modes.shapes.at(place)[0], across[0], modes.omega <= omega
    own, mobile = float(along[slow] @ along[slow]), aside[:, slow] @ aside[:, slow].T
    if np.trace(mobile) <= SAME * own:
        return Dragged(0.0, False, np.ones(len(along)), 0.0)
    comes = aside[:, : len(p)] @ p / impulse  # all in units of the impulse: [1/kg]
    drawn = aside[:, slow] @ along[slow]
    pulls = _pulls(comes, drawn, mobile)
    pull, slides = pulls.mean(axis=0), bool(np.linalg.norm(pulls[-1]) >= (1.0 - SAME) * FRICTION)
    wanted = np.linalg.pinv(mobile, rcond=SAME) @ (comes + drawn) if slides else pull
    slowing = others + own + pulls @ drawn
    jams = slowing.min() <= 0.0
    product, square = along * (along + pull @ aside), along**2
    rigid, squares = modes.omega == 0.0, np.ones(len(along))
    if square[rigid].any():  # of rigid motions only their sum is defined, whatever they are split into
        squares[rigid] = 0.0 if jams else product[rigid].sum() / square[rigid].sum()
    bends = ~rigid & (square > SAME * square.max(initial=0.0))
    squares[bends] = np.maximum(product[bends] / square[bends], SAME)
    parting = 0.0 if jams else abs(_parting(slowing / (others + own)) - 1.0)
    return Dragged(float(np.linalg.norm(wanted)), slides, squares, parting)


def _pulls(comes: np.ndarray, drawn: np.ndarray, mobile: np.ndarray) -> np.ndarray:
    """Tangential over normal impulse (STEPS, 2) in parts of the normal one: what sticks, as far as Coulomb allows."""
    inverse, slips, found = np.linalg.pinv(mobile, rcond=SAME), comes, np.zeros((STEPS, 2))
    for i in range(STEPS):
        slips = slips + drawn / STEPS
        stops = -STEPS * inverse @ slips
        found[i] = stops * min(1.0, FRICTION / max(float(np.linalg.norm(stops)), SAME))
        slips = slips + mobile @ found[i] / STEPS
    return found


def _parting(slowing: np.ndarray) -> float:
    """Speed over that of arrival at which bodies part on a spring.

    ``slowing`` (STEPS,) [-] is how much each part of the impulse slows them, 1 without friction.
    """
    speeds = 1.0 - 2.0 * np.append(0.0, np.cumsum(slowing)) / STEPS
    held = 2.0 * np.cumsum(speeds[:-1] + speeds[1:]) / STEPS  # in the spring, over the energy on arrival
    released = np.flatnonzero((held <= 0.0) & (speeds[1:] < 0.0))
    last = int(released[0]) if len(released) else STEPS - 1
    return float(np.sqrt(max(0.0, speeds[last + 1] ** 2 + slowing[last] * held[last])))
