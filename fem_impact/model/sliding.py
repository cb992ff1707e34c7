"""Does friction matter? An oblique blow slides, and one beside a centre of mass begins to; contacts here have none.

A body that comes with the speed v_t across the normal impulse J slips at ``v_t + W_tn J + W_tt T`` under a tangential
impulse T; W are the motions of its rigid and slow modes per impulse. By Coulomb and Routh it slides with T = mu J until
it stops, then sticks if that takes no more, or slides the other way. The mean of both stages goes with the normal force
and drives the modes by their shapes across: ``s_n (s_n + g s_t)`` stands for ``s_n**2`` where g = T / J. That the
stages differ makes the parting speed another: the spring gives back in the second what it took in the first. The other
body is taken as fixed across.

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
SQUARE = "strike square to the surface, in line with the centre of mass: contacts here have no friction"


class Dragged(NamedTuple):
    """What friction does to one body."""

    needed: float  # [-] tangential over normal impulse, or that which would stick
    slides: bool  # to the end
    squares: np.ndarray  # (n_modes,) [-] factors of squared shapes that stand for friction
    parting: float  # [-] relative change of the parting speed by the order of sliding and sticking


def examine(struck: Struck) -> Assumption:
    """Striker and target, as far as their motion across the blow is known."""
    hit, history = struck.hit, struck.hit.history
    found = []
    for body, place, sign in ((0, _tip(struck), -1.0), (len(hit.bodies) - 1, _spot(struck), 1.0)):
        if place is None or not hit.impulse:
            continue
        columns, p = hit.body_slice(body), np.zeros(0)
        if not struck.foreseen:
            p = history.start_p[columns]
        elif body == 0 and hit.striker is not None:
            p = hit.speed * hit.striker.motion
        slow = history.omega <= struck.omega
        slow[columns] = False
        others = float(np.square(history.shape[0, slow]).sum())
        dragged = _dragged(struck.bodies[min(body, 1)], place, p, sign * hit.impulse, struck.omega, others)
        if dragged is not None and dragged.needed > SAME:
            found.append((columns, dragged))
    if not found:
        return STICKS.holds(struck)
    worst = max((each for _, each in found), key=lambda each: each.needed)
    doubt = SLIDES if worst.slides else STICKS
    if min(each.squares.min() for _, each in found) <= 0.0:
        return doubt.unknown(struck, "whether friction jams the contact", SQUARE, worst.needed)
    if struck.foreseen:
        return doubt.judged(struck, worst.needed, {}, SQUARE)
    changed = {name: getattr(history, name).copy() for name in ("shape", "start_q", "start_p")}
    for columns, each in found:
        root = np.sqrt(each.squares)
        changed["shape"][:, columns] *= root
        for name in ("start_q", "start_p"):  # the motion at the contact stays as it is
            changed[name][columns] /= root
    effect = struck.changes(**changed)
    parting = sum(each.parting for _, each in found)
    for name, share in (("restitution", 1.0), ("impulse", 0.5)):
        if (known := effect.get(name)) is not None:
            effect[name] = known + share * parting
    return doubt.judged(struck, worst.needed, effect, SQUARE)


def _tip(struck: Struck) -> np.ndarray | None:
    """Where the striker touches, (1, dimension) [m]."""
    striker = struck.hit.striker
    return None if striker is None or not striker.modes.dimension else striker.at[None]


def _spot(struck: Struck) -> np.ndarray | None:
    """Where the target is struck, (1, dimension) [m]."""
    at = struck.hit.at if struck.place is None else struck.place[0]
    return None if at is None or not struck.bodies[1].dimension else at[None]


def _dragged(
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
    wanted = -np.linalg.pinv(mobile, rcond=SAME) @ (comes + drawn)
    first, until, then = _stages(comes, drawn, mobile, wanted)
    pull = until * first + (1.0 - until) * then
    slides = until >= 1.0 or bool(np.linalg.norm(then) >= FRICTION)
    needed = float(np.linalg.norm(wanted if slides else pull))
    stages = [others + float(along[slow] @ (along + each @ aside)[slow]) for each in (first, then)]
    jams = min(stages) <= 0.0
    product, square = along * (along + pull @ aside), along**2
    rigid, squares = modes.omega == 0.0, np.ones(len(along))
    if square[rigid].any():  # of rigid motions only their sum tells, whatever they are split into
        squares[rigid] = 0.0 if jams else product[rigid].sum() / square[rigid].sum()
    bends = ~rigid & (square > SAME * square.max(initial=0.0))
    squares[bends] = np.maximum(product[bends] / square[bends], SAME)
    return Dragged(needed, slides, squares, 0.0 if jams else _parting(stages, until * 2.0 / (others + own)))


def _stages(
    comes: np.ndarray, drawn: np.ndarray, mobile: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, float, np.ndarray]:
    """Tangential over normal impulse (2,) as the body slides first, the share of the blow that lasts, and then."""
    speed, first, until = float(np.linalg.norm(comes)), np.zeros(2), 0.0
    if speed > SAME * np.trace(mobile):
        way = comes / speed
        first = -FRICTION * way
        slows = float(-way @ (drawn + mobile @ first))
        until = min(1.0, speed / slows) if slows > 0.0 else 1.0
    then = (wanted - until * first) / (1.0 - until) if until < 1.0 else first
    return first, until, then * min(1.0, FRICTION / max(float(np.linalg.norm(then)), SAME))


def _parting(stages: list[float], until: float) -> float:
    """Change of the speed at which bodies part that came at unit speed, slowed by each of two stages per impulse.

    The second begins after the impulse ``until``.
    """
    one, two = stages
    if one * until >= 1.0:  # the spring is pressed in before the first stage ends
        left = 1.0 / one - one * (until - 1.0 / one) ** 2  # twice the energy that it still holds then
        speed = one * until - 1.0
        return abs(1.0 - float(np.sqrt(speed**2 + two * left))) if left > 0.0 else 0.0
    pressed = until * (2.0 - one * until) + (1.0 - one * until) ** 2 / two
    return abs(1.0 - float(np.sqrt(two * pressed)))
