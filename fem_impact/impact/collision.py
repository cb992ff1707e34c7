"""`strike` and `collide`: run a blow so that its error stays below the tolerance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

import numpy as np

from .._base import check
from .._base.rounding import EPSILON
from ..modes.modal import Modes
from ..modes.stretching import stretch
from . import accuracy, distance, engine, promise, what_if
from .compiled.bundles import KernelSystem
from .contact import Contact
from .engine import TOLERANCE as TOLERANCE
from .error import Error
from .reduced_body import ReducedBody, ends_of, join_bodies, part_of, part_of_striker, stretched_in
from .response import Response
from .state import State
from .stepping import Options, refine_steps, takes_options
from .striker import Striker

LOSSY_STRIKER = 30.0  # [-] a lossy contact multiplies the truncation error of a striker by this: its modes are sparse
OF_STRIKE = "striker_force", "target_force", "stretching"  # options that `collide` does not have


@dataclass(frozen=True, repr=False)
class Touch(check.Brief):
    """A possible contact between two bodies of `collide`, and its contact law."""

    law: Contact
    first: int  # index of the first body; its positive direction is towards the second
    second: int | None  # index of the second body; None for a rigid wall
    first_at: Any = None  # point on the first body [m]
    second_at: Any = None  # point on the second body [m]

    def __post_init__(self) -> None:
        check.instance("law", self.law, Contact)
        check.count("first", self.first, low=0)
        if self.second is not None:
            check.count("second", self.second, low=0)
        for name in ("first_at", "second_at"):
            if (point := getattr(self, name)) is not None:
                check.finite(name, check.numbers(name, point, "m"), "m")


@takes_options()
@check.typed
def strike(
    modes: Modes, striker: Striker, contact: Contact, *, at: Any, speed: float | None,
    start: State | Response | None = None, **options: Any,
) -> Response:  # fmt: skip
    """Strike a body with known modes; see `fi.strike`."""
    if speed is None and start is None:
        raise ValueError("speed must be given in m/s, or start, which says how the striker moves")
    speed = speed if speed is None else check.non_negative("speed", speed, "m/s")
    before = start.state() if isinstance(start, Response) else start
    if before is not None:
        before.of(-1, "modes", modes)
    point, asked = modes.point("at", at), Options.read(options)
    struck = part_of(modes, ((0, -1.0),), point, asked.residual).push_body(asked.target_force)
    if asked.stretching or modes.stretches:
        struck = replace(struck, stretching=stretch(modes))

    def blow(striker: Striker, speed: float, goes_on: bool = False) -> Response:
        arriving = part_of_striker(striker, asked.residual).push_body(asked.striker_force)

        def start_bodies(before: State | None) -> list[ReducedBody]:
            """Both bodies at the start."""
            target = struck
            if before is not None:
                target = replace(struck, q=before.displacements[-1], p=before.velocities[-1])
            if before is None or not goes_on:  # the striker arrives at the surface, wherever that is
                surface = float(struck.rows[0] @ target.q) * striker.motion
                return [replace(arriving, q=surface, p=speed * striker.motion), target]
            moving = replace(arriving, q=before.displacements[0], p=before.velocities[0])
            return [before.go_on(part) for part in (moving, target)]

        other = None if before is None else start_bodies(before.otherwise)
        late = 0.0 if before is None else before.late
        return _follow_refined(
            (striker.body, modes), (contact,), start_bodies(before), speed, asked, striker, point[0], other, late
        )

    if speed is None:
        assert before is not None
        striker = before.same_striker(striker, contact, point)
        _, p = before.of(0, "striker", striker.body)
        return blow(striker, float(striker.shape @ np.where(striker.modes.omega == 0.0, p, 0.0)), True)
    if before is not None and before.force.any():
        raise ValueError(
            "start must be a time when nothing touches, or speed None for the striker to go on; at "
            f"{before.time:.4g} s a force of {before.force[:, 0].max():.3g} N acts"
        )
    if striker.fixed or not asked.residual or speed == 0.0:
        return blow(striker, speed)
    needed = striker_modes(striker, contact=contact, speed=speed, tolerance=asked.tolerance)[0]
    hit = blow(shortened_striker(striker, needed), speed)
    return hit if hit.error.truncation <= 0.5 * asked.tolerance else blow(striker, speed)


@takes_options(*OF_STRIKE)
@check.typed
def collide(
    bodies: Sequence[Modes | Striker], contacts: Sequence[Touch], *, speeds: Sequence[float] | None = None,
    states: Sequence[tuple[Any, Any]] | None = None, forces: Sequence[float] | None = None,
    start: State | Response | None = None, strict: bool = False, **options: Any,
) -> Response:  # fmt: skip
    """Collide any number of bodies at any number of contacts.

    Parameters
    ----------
    bodies : sequence of Modes or Striker
        A striker arrives as it is made to, turning or straight, and touches with its own point unless stated otherwise;
        neither a hand nor its weight may bring it back.
    contacts : sequence of Touch
        Two bodies may touch at several points.
    speeds : sequence of float [m/s], (n_bodies,)
        Speed of each body's first contact point; the body arrives in rigid motion. Positive from the first body of a
        touch towards the second.
    states : sequence of (q, p), optional
        Initial modal displacements and velocities of each body; ``speeds`` adds to them.
    forces : sequence of float [N], (n_bodies,)
        Constant force at each body's first contact point, with the sign convention of the speeds.
    start : State or Response, optional
        Where an earlier collision of the same bodies left them (`Response.state`), instead of ``states``.
    tolerance, quantity, residual, duration, max_impacts, scheme, dt, strict
        As in `strike`.

    Returns
    -------
    Response

    Examples
    --------
    >>> balls, touch = [fi.Modes.rigid(0.1)] * 3, fi.Contact.linear(1e6)
    >>> chain = [fi.Touch(touch, 0, 1), fi.Touch(fi.Contact.linear(1e6, gap=1e-3), 1, 2)]
    >>> hit = fi.collide(balls, chain, speeds=[1.0, 0.0, 0.0])  # Newton's cradle
    >>> [round(float(hit.velocity(None, [0.01], body=i)[0, 0]), 3) + 0.0 for i in range(3)]  # m/s
    [0.0, 0.0, 1.0]
    """
    for each in bodies if isinstance(bodies, (list, tuple)) else ():
        if isinstance(each, Striker):
            each.let_go("a collision")
    if foreign := [name for name in OF_STRIKE if name in options]:
        raise TypeError(f"collide() got an unexpected keyword argument {foreign[0]!r}")
    hit = collide_unjudged(bodies, contacts, speeds=speeds, states=states, forces=forces, start=start, **options)
    return promise.warn_if_missed(hit, strict)


def collide_unjudged(
    bodies: Sequence[Any], contacts: Sequence[Touch], *, speeds: Any = None, states: Any = None, forces: Any = None,
    start: State | Response | None = None, **options: Any,
) -> Response:  # fmt: skip
    """`collide` without a word on its tolerance; hands and their weight push strikers on."""
    asked = Options.read(options)
    given, contacts = check.tuple_of("bodies", bodies, Modes, Striker), check.tuple_of("contacts", contacts, Touch)
    strikers = {i: each for i, each in enumerate(given) if isinstance(each, Striker)}
    bodies = tuple(strikers[i].body if i in strikers else each for i, each in enumerate(given))
    if any(body.stretches for body in bodies):
        raise ValueError("a body that stretches can only be struck once, by `fi.strike`; leave stretching out")
    before = start.state() if isinstance(start, Response) else start
    if before is not None:
        if states is not None:
            raise ValueError("states must be left out if start is given, which has the states of all bodies")
        states = before.states(bodies, [touch.law for touch in contacts])
    parts, arriving = _reduced_bodies(bodies, contacts, speeds, states, forces, asked.residual, strikers)
    for i, each in strikers.items():
        parts[i] = replace(parts[i], bias=parts[i].bias + each.push, held=int(each.hand is not None))
    other, late = None, 0.0
    if before is not None:
        state, late = before.otherwise, before.late
        moved = [replace(*each, q=q, p=p) for *each, q, p in zip(parts, state.displacements, state.velocities)]
        parts, other = [before.go_on(part) for part in parts], [state.go_on(part) for part in moved]
    return _follow_refined(bodies, [touch.law for touch in contacts], parts, arriving, asked, other=other, late=late)


def touching_system(bodies: Sequence[Modes], touch: Touch, speed: float) -> tuple[KernelSystem, float]:
    """Two bodies that are to touch, the first moving, as the kernels take them, and how long the contact may last."""
    parts, _ = _reduced_bodies(bodies, [touch], [speed, 0.0], None, None, True, {})
    system = join_bodies(parts, [touch.law])
    return system, engine.pace_of(system).duration


def _follow_refined(bodies, laws, parts, speed, options, striker=None, at=None, other=None, late=0.0) -> Response:
    """Run the blow to the required tolerance and estimate the remaining errors.

    ``other`` are the parts as they would move at the start, ``late`` [s], if the blow before erred, see
    `State.otherwise`.
    """
    system, stretched = join_bodies(parts, laws), stretched_in(parts)
    if options.last == (np.inf, 0) and max((system.bias @ system.shape.T).tolist()) > 0.0:
        raise ValueError(
            "duration or max_impacts must be given, because a constant force keeps pressing the bodies together"
        )
    *firsts, n_kept = accumulate([len(part.omega) for part in parts], initial=0)
    held = [first + i for first, part in zip(firsts, parts) for i in range(part.held)]
    pace, own = engine.pace_of(system, held, n_kept)._replace(struck=slice(firsts[-1], None)), parts[0]
    if speed and own.touched:
        rigid = own.rows[0, : own.held] if own.held else own.rows[0, own.omega == 0.0]
        pace = pace._replace(rebound=tuple((rigid / speed).tolist()))
    depth, way = pace.duration * pace.speed, max(np.abs(system.offset).tolist())
    if EPSILON * way > options.tolerance * depth:
        raise ValueError(
            f"gap and constant forces must be smaller: with an offset of {way:.3g} m, rounding spoils an approach of "
            f"{depth:.3g} m beyond the tolerance of {options.tolerance:g}; start nearer to contact"
        )
    found = refine_steps(system, options, pace, stretched)
    for i, law in enumerate(laws):
        law.law.check_reached(law, found.fine, i)
    growth = distance.growth(found.coarse, found.fine)
    if len(found.coarse.contacts) != len(found.fine.contacts):  # a given step was too long
        found = replace(found, coarse=found.fine, steps=(found.steps[0],) * 2)
    blow = what_if.Followed(parts, laws, system, options, pace, found)
    left_out, resolvable = what_if.modes_left_out(blow, bodies)
    variations = left_out, *what_if.unstated_variations(blow, bodies), what_if.mesh_variation(blow, bodies)
    errors = {"step": found.error, **what_if.what_if(blow, variations)}
    moved = [blow.again(other, late=late)] if other else []
    for run in moved:
        errors["inherited"] = distance.of_runs(run, found.coarse, options.quantities, pace=pace)
    what_if.add_poorer_descriptions(blow, bodies, errors)
    whole, n = np.add.reduce([*errors.values()]), options.n_quantities
    if "n_impacts" in options.quantities and whole[n] >= found.fine.margin:
        doubted = max(errors.values(), key=lambda error: error[n])
        doubted[[*options.quantities].index("n_impacts")] += 1.0
    runs = (found.coarse, *moved) if growth < np.inf else ()
    order = np.lexsort(found.fine.contacts[:, (4, 0)].T)  # as `History.impacts`
    error = Error.of_causes(errors, options.quantities, resolvable, growth)
    return Response(
        tuple(bodies), tuple(laws), found.fine, speed, options.tolerance, found.scheme, error, striker, at,
        ends_of(parts, laws), options.quantities, rebounds=whole[n + 1 :][order], runs=runs, late=late,
    )  # fmt: skip


def _reduced_bodies(bodies, contacts, speeds, states, forces, residual, strikers) -> tuple[list[ReducedBody], float]:
    """Every body as a `ReducedBody`, and the speed of the first body that moves; ``strikers`` by their number."""
    if states is not None:
        wrong = not isinstance(states, (list, tuple)) or len(states) != len(bodies)
        if wrong or any(not isinstance(pair, (list, tuple)) or len(pair) != 2 for pair in states):
            raise ValueError(
                f"states must hold one pair (q, p) for each of {len(bodies)} bodies, got {check.shown(states)}"
            )
    speeds = np.zeros(len(bodies)) if speeds is None else check.array("speeds", speeds, (len(bodies),), "m/s")
    forces = np.zeros(len(bodies)) if forces is None else check.array("forces", forces, (len(bodies),), "N")
    ends: list[list] = [[] for _ in bodies]  # (contact, sign, point) on each body
    for i, touch in enumerate(contacts):
        both = (touch.first, "first_at", touch.first_at, 1.0), (touch.second, "second_at", touch.second_at, -1.0)
        for body, name, at, sign in both:
            if body is None:
                continue
            if not 0 <= body < len(bodies):
                raise ValueError(f"contacts must name bodies from 0 to {len(bodies) - 1}, got {body}")
            at = strikers[body].at if at is None and body in strikers else at
            ends[body].append((i, sign, bodies[body].point(f"{name} of contact {i}", at)))
        one = touch.first
        if one == touch.second and (not bodies[one].omega.any() or np.array_equal(*(end[2] for end in ends[one][-2:]))):
            raise ValueError(
                f"second of contact {i} must be another body, or first_at and second_at must be two points of one that "
                f"bends: body {one} does not move towards itself"
            )
    parts, arriving = [], 0.0
    for body, modes in enumerate(bodies):
        points = np.vstack([point for _, _, point in ends[body]] or [np.zeros((0, modes.dimension))])
        touched = tuple((i, sign) for i, sign, _ in ends[body])
        if not touched and (speeds[body] or forces[body]):
            raise ValueError(f"speeds and forces must be zero for a body without contacts, of body {body} they are not")
        part = part_of(modes, touched, points, residual).push_body(float(forces[body]))
        if states is not None:
            q, p = (check.array(f"states[{body}]", value, (modes.n_modes,)) for value in states[body])
            part = replace(part, q=q, p=p)
        speed, own = float(speeds[body]), None
        if body in strikers and touched:
            own, comes = strikers[body].motion, float(part.rows[0] @ strikers[body].motion)
            if comes <= 0.0 and speed:
                raise ValueError(f"first_at of body {body} must come towards the other body as the striker arrives")
            own = own / comes if comes > 0.0 else None
            part = replace(part, coming=own)
        if speed != 0.0:
            if not part.rows[0, modes.omega == 0.0].any():
                raise ValueError(f"speeds must be zero for a body that cannot move rigidly, got {speed:g} m/s")
            own = modes.rigid_motion(points[:1]) if own is None else own
            part = replace(part, p=part.p + speed * own, speed=speed)
        arriving = arriving or speed
        parts.append(part)
    return parts, arriving


def striker_modes(striker: Striker, *, contact: Contact, speed: float, tolerance: float) -> tuple[int, float]:
    """How many striker modes a blow needs, and the error [-] allowed of leaving out the others.

    That is only a twentieth of the tolerance, because striker modes cost little; zero if there are no others.
    """
    modes, mass = striker.modes, striker.felt_mass
    if modes.n_modes == modes.n_rigid:
        return modes.n_rigid, 0.0
    allowed = 0.05 * tolerance / (LOSSY_STRIKER if contact.rated else 1.0)
    omega_0 = accuracy.contact_swing(contact, mass, speed)
    whole, density, s = striker.bending_compliance
    if not contact.rated and mass * omega_0**2 * whole <= allowed:  # what replaces modes under loss needs one below
        return modes.n_rigid, allowed
    limit = accuracy.cutoff(density, s, omega_0, contact.exponent, mass, allowed)
    return min(modes.n_modes, max(modes.n_rigid + 2, int(modes.frequencies.searchsorted(limit, side="right")))), allowed


def striker_error(striker: Striker, n_modes: int, *, contact: Contact, speed: float) -> float:
    """Expected error [-] if a striker keeps only its first ``n_modes`` modes."""
    highest = float(striker.modes.frequencies[max(n_modes - 1, 1)])
    law: dict[str, Any] = {"contact": contact, "mass": striker.felt_mass, "speed": speed}
    error = accuracy.truncation_error(striker.modes, striker.at, highest, **law)
    return LOSSY_STRIKER * error if contact.rated else error


def shortened_striker(striker: Striker, n_modes: int) -> Striker:
    """The striker with its first modes only; the others act as a spring."""
    if n_modes >= striker.modes.n_modes:
        return striker
    found: Striker = striker.known.recall(
        ("shortened", n_modes),
        lambda: replace(striker, modes=striker.modes.truncated(n_modes=n_modes), fixed=True),
    )
    return found
