"""`strike` and `collide`: run a blow so that its error stays below the tolerance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .._base.rounding import ROUNDING
from ..modes.modal import Modes, left_out
from ..modes.stretching import Stretching, stretch
from . import accuracy, engine, force_spectrum, promise
from .compiled import layout, record
from .compiled.law import FELT
from .contact import Contact
from .engine import STEP_SHARE, TOLERANCE
from .history import History, ModalSystem
from .quantities import BAND_POINTS, asked_for
from .response import Ends, Error, Response
from .state import State
from .stretched import Stretched
from .striker import Striker

SCHEMES = ("A", "A4", "collocation")
# [-] tolerance advised over the error reached: steps twice as long, to which it may lead, err 16 times more
REACHED = 20.0
AVERAGES = {"restitution", "impulse", "n_impacts"}  # quantities that depend on no single instant
# [-] fraction of the usual steps that averages over the blow need: errors of single instants cancel in them
AVERAGED = 0.5
# [-] step halvings to decide whether bodies touch or part where the margin is less than its error, which each divides
# by eight or more
GRAZES = 6
# [-] error of a margin over the difference of two runs: beside a graze A4 converges at first order only, and a run of
# half the steps may show a seventh of the difference to the truth
SURELY = 4.0
DOUBLINGS = 7  # [-] step halvings before the run gives up: A4 then errs 2**28 times less
# [-] Difference of two runs over the error of the finer one: first for speeds and impulse, then for contact time and
# peak force. These two depend on one instant, and modes faster than the step lower the order of A4 there.
RICHARDSON = {"A": (3.0, 3.0), "A4": (7.0, 4.0), "collocation": (1.0, 1.0)}
RINGING = 0.5  # [-] modes with a damping ratio above this do not ring: a swing is down to 3 % of the one before
# [rad] largest phase of a ringing mode in a step of the coarser run: a third of a period, seen before it comes again
RESOLVED = 2.0
COLLOCATION_BELOW = 1e-7  # [-] below this tolerance, collocation needs less work than A4
RESOLVABLE = 0.3  # [-] largest contact stiffness times residual compliance for which the error estimate holds
# [-] An error estimate below 30 % of the predicted one is replaced by that 30 %, because two runs can agree by chance;
# 30 % is the median over many blows.
AT_LEAST = 0.3
# [-] But by no more than this times the larger of two extra runs: where both differ by less, the prediction does not
# apply, as to contacts that outlast many periods of the modes left out. The truth was more in 2 of 715 random blows.
BY_CHANCE = 10.0
# [-] two extra runs divide the highest kept frequency by these: near enough to foretell, far enough to differ
THINNED = 1.4, 2.0
FALLING = 2.0, 1.0  # [-] the truncation error falls at least with this power of the highest kept frequency; overdamped
# [-] and that of the restitution of an impact with this one: on average it is 1, but it is not steady; with 1, claims
# lay below the truth in 12 % of 73 random impacts, with this in 2 % of 110, by a fifth at most
PARTING = 0.5
# [-] by dimension: frequency of the replacement mode over the last, fact: sqrt(sum u**2/w**2 / sum u**2/w**4) of those
# above is sqrt(7/3) on a beam, whose n-th frequency goes as n**2, and sqrt(3) on a plate, where it goes as n
REST_ABOVE = {1: 1.53, 2: 1.73}
# [-] frequency of the replacement mode under a lossy contact over the last mode's: so far above that it follows as a
# spring; it is critically damped
LOSSY_ABOVE = 30.0
LOSSY_STRIKER = 30.0  # [-] a lossy contact multiplies the truncation error of a striker by this: its modes are sparse
STRIKER_SHARE = 0.05  # [-] fraction of the tolerance for the striker's left-out modes: keeping them is cheap
SLOW = 1e-4  # [-] frequency of a rigid motion that may be missing over that of the first mode: it acts as a mass
NEGLIGIBLE = 1e-4  # [-] mesh errors below this fraction of the tolerance need no extra run; the blow errs by as little


@dataclass(frozen=True)
class Touch:
    """A possible contact between two bodies of `collide`, and its contact law."""

    law: Contact
    first: int  # index of the first body; its positive direction is towards the second
    second: int | None  # index of the second body; None for a rigid wall
    first_at: Any = None  # point on the first body [m]
    second_at: Any = None  # point on the second body [m]

    def __repr__(self) -> str:
        return check.brief(self)

    def __post_init__(self) -> None:
        check.instance("law", self.law, Contact)
        check.count("first", self.first, low=0)
        if self.second is not None:
            check.count("second", self.second, low=0)
        for name in ("first_at", "second_at"):
            if (point := getattr(self, name)) is not None:
                check.finite(name, check.numbers(name, point, "m"), "m")


@dataclass(frozen=True)
class Options:
    """When to stop, how accurate to be, and which scheme to use."""

    tolerance: float
    horizon: float
    n_max: int
    scheme: str | None
    dt: float | None
    quantities: Mapping[str, float | None]  # that must meet the tolerance, each with its band [Hz]

    @classmethod
    def checked(
        cls, tolerance: float, duration: float | None, max_impacts: int | None, scheme: str | None, dt: float | None,
        quantity: Any,
    ) -> "Options":  # fmt: skip
        """The options, each of them checked."""
        return cls(
            check.tolerance(tolerance),
            np.inf if duration is None else check.positive("duration", duration, "s"),
            0 if max_impacts is None else check.count("max_impacts", max_impacts),
            None if scheme is None else check.one_of("scheme", scheme, SCHEMES),
            None if dt is None else check.positive("dt", dt, "s"),
            asked_for(quantity),
        )


@dataclass(frozen=True, eq=False)
class _Part:
    """One body, reduced to its modes and contacts."""

    omega: np.ndarray  # (n_modes,)
    zeta: np.ndarray  # (n_modes,)
    rows: np.ndarray  # (n_ends, n_modes) shapes at its contacts
    touched: tuple[tuple[int, float], ...]  # contact, and sign: 1 for its first body, -1 for its second
    rest: np.ndarray  # (n_ends, n_ends) [m/N] residual compliance of the left-out modes
    doubt: np.ndarray  # (n_ends,) [m/N] estimated error of its diagonal
    q: np.ndarray
    p: np.ndarray
    bias: np.ndarray
    force: float  # [N] constant force at its first contact
    points: np.ndarray  # (n_ends, dimension) [m] contact points
    pressed: np.ndarray  # (2, n_ends) [N], [N/s] contact forces at the start and their rates
    loose: np.ndarray  # (n_ends, n) shapes of rigid motions that it may have besides
    stretching: Stretching | None = None
    speed: float = 0.0  # [m/s] with which it arrives in rigid motion, at its first contact
    held: int = 0  # [-] first modes that only a hand makes swing: within a contact they move like a mass


@check.typed
def strike(
    modes: Modes,
    striker: Striker,
    contact: Contact,
    *,
    at: Any,
    speed: float | None,
    tolerance: float = TOLERANCE,
    quantity: Any = None,
    residual: bool = True,
    duration: float | None = None,
    max_impacts: int | None = None,
    scheme: str | None = None,
    dt: float | None = None,
    striker_force: float = 0.0,
    target_force: float = 0.0,
    start: State | Response | None = None,
    stretching: bool = False,
) -> Response:
    """Strike a body with known modes; see `fi.strike`."""
    if speed is None and start is None:
        raise ValueError("speed must be given in m/s, or start, which tells how the striker moves")
    speed = speed if speed is None else check.non_negative("speed", speed, "m/s")
    before = start.state() if isinstance(start, Response) else start
    forces = [
        check.number(name, x, "N") for name, x in (("striker_force", striker_force), ("target_force", target_force))
    ]
    point = modes.point("at", at)
    options = Options.checked(tolerance, duration, max_impacts, scheme, dt, quantity)
    rows = modes.shapes.at(point)
    rest = left_out(modes, point, rows) if residual and modes.dimension else None
    struck = _part(modes, ((0, -1.0),), point, rows, rest, forces[1])
    if before is not None:
        struck = _moving(struck, *before.of(-1, "modes", modes))
    if check.flag("stretching", stretching) or modes.stretches:
        struck = replace(struck, stretching=stretch(modes))

    def blow(striker: Striker, speed: float, own: tuple[np.ndarray, np.ndarray] | None = None) -> Response:
        touch = Touch(contact, 0, 1, striker.at[None], point)
        rest = striker.left_out if residual and striker.modes.dimension else None
        arriving = _part(striker.body, ((0, 1.0),), striker.at[None], striker.shape[None], rest, forces[0])
        arriving = replace(arriving, bias=arriving.bias + striker.push, held=int(striker.hand is not None))

        def start(one: float = 1.0, other: float = 1.0) -> list[_Part]:
            """Both bodies at the start, each as fast as it is known times a factor."""
            target = _faster(struck, other)
            if own is None:  # the striker arrives at the surface, wherever that is
                return [_moving(arriving, float(rows[0] @ target.q) * striker.motion, speed * striker.motion), target]
            pressed = np.zeros((2, 1)) if before is None else before.force.T
            return [replace(_faster(_moving(arriving, *own), one), pressed=pressed), replace(target, pressed=pressed)]

        doubt = 0.0 if before is None else 1.0 + before.error
        others = [start(*factors) for factors in ((doubt, 1.0), (1.0, doubt))[own is None :] if doubt]
        return _follow((striker.body, modes), [touch], start(), speed, options, striker, point[0], others)

    if speed is None:
        assert before is not None
        striker = before.same_striker(striker, contact, modes, point)
        own = before.of(0, "striker", striker.body)
        return blow(striker, float(striker.shape @ np.where(striker.modes.omega == 0.0, own[1], 0.0)), own)
    if before is not None and before.force.any():
        raise ValueError(
            "start must be a time when nothing touches, or speed None for the striker to go on; at "
            f"{before.time:.4g} s a force of {before.force[:, 0].max():.3g} N acts"
        )
    if striker.fixed or not residual or speed == 0.0:
        return blow(striker, speed)
    needed = striker_modes(striker, contact=contact, speed=speed, tolerance=options.tolerance)[0]
    hit = blow(shortened(striker, needed), speed)
    return hit if hit.error.truncation <= 0.5 * options.tolerance else blow(striker, speed)


@check.typed
def collide(
    bodies: Sequence[Modes],
    contacts: Sequence[Touch],
    *,
    speeds: Sequence[float] | None = None,
    states: Sequence[tuple[Any, Any]] | None = None,
    tolerance: float = TOLERANCE,
    quantity: Any = None,
    residual: bool = True,
    duration: float | None = None,
    max_impacts: int | None = None,
    scheme: str | None = None,
    dt: float | None = None,
    forces: Sequence[float] | None = None,
    start: State | Response | None = None,
    strict: bool = False,
) -> Response:
    """Collide any number of bodies at any number of contacts.

    Parameters
    ----------
    bodies : sequence of Modes
    contacts : sequence of Touch
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
    rule: dict[str, Any] = {"tolerance": tolerance, "quantity": quantity, "residual": residual, "duration": duration}
    rule |= {"max_impacts": max_impacts, "scheme": scheme, "dt": dt, "forces": forces, "start": start}
    return promise.kept(met(bodies, contacts, speeds=speeds, states=states, **rule), strict)


def met(
    bodies: Sequence[Modes], contacts: Sequence[Touch], *, speeds: Any = None, states: Any = None,
    tolerance: float = TOLERANCE, quantity: Any = None, residual: bool = True, duration: float | None = None,
    max_impacts: int | None = None, scheme: str | None = None, dt: float | None = None, forces: Any = None,
    start: State | Response | None = None, pushes: Sequence[np.ndarray] = (),
) -> Response:  # fmt: skip
    """`collide` without a word on its tolerance; ``pushes`` are constant modal forces on the first bodies."""
    options = Options.checked(tolerance, duration, max_impacts, scheme, dt, quantity)
    bodies, contacts = check.several("bodies", bodies, Modes), check.several("contacts", contacts, Touch)
    if any(body.stretches for body in bodies):
        raise ValueError("a body that stretches can only be struck once, by `fi.strike`; leave stretching out")
    before = start.state() if isinstance(start, Response) else start
    if before is not None:
        if states is not None:
            raise ValueError("states must be left out if start is given, which has the states of all bodies")
        states = before.states(bodies, [touch.law for touch in contacts])
    parts, arriving = _parts(bodies, contacts, speeds, states, forces, residual)
    pushed = zip(parts, pushes)
    parts = [
        *(replace(part, bias=part.bias + push, held=int(part.omega[0] > 0.0)) for part, push in pushed),
        *parts[len(pushes) :],
    ]
    others = []
    if before is not None:
        ends = [[i for i, _ in part.touched] for part in parts]
        parts = [replace(part, pressed=before.force[rows].T) for part, rows in zip(parts, ends)]
        doubt = 1.0 + before.error
        others = [[*parts[:i], _faster(part, doubt), *parts[i + 1 :]] for i, part in enumerate(parts)]
    return _follow(bodies, contacts, parts, arriving, options, others=others)


def touching(bodies: Sequence[Modes], touch: Touch, speed: float, residual: bool) -> tuple[ModalSystem, float]:
    """Two bodies that are to touch, the first moving, as the kernels take them, and how long the contact may last."""
    parts, _ = _parts(bodies, [touch], [speed, 0.0], None, None, residual)
    system = _joined(parts, [touch])
    return system, engine.pace_of(system)[0]


def _moving(part: _Part, q: np.ndarray, p: np.ndarray) -> _Part:
    return replace(part, q=q, p=p)


def _faster(part: _Part, factor: float) -> _Part:
    """The same body with all motion larger by a factor, its rigid position as it is."""
    return _moving(part, np.where(part.omega == 0.0, 1.0, factor) * part.q, factor * part.p)


def _follow(bodies, contacts, parts, speed, options, striker=None, at=None, others=()) -> Response:
    """Run the blow to the required tolerance and estimate the remaining errors.

    ``others`` are the parts as they would move at the start if the blow before erred as estimated.
    """
    system = _joined(parts, contacts)
    endless = not np.isfinite(options.horizon) and not options.n_max
    if endless and (system.bias @ system.shape.T > 0.0).any():
        raise ValueError(
            "duration or max_impacts must be given, because a constant force keeps pressing the bodies together"
        )
    held = np.concatenate([np.arange(len(part.omega)) < part.held for part in parts])
    pace = engine.pace_of(system, np.append(held, np.zeros(len(system.omega) - len(held), bool)))
    _check_way(system, pace[0] * pace[1], options.tolerance)
    last = options.horizon, options.n_max
    history, step_error, ran, coarse, (step, size) = _controlled(
        system, options.scheme, options.dt, options.tolerance, options.quantities, pace, *last
    )
    growth, none = _sensitivity(coarse, history), np.zeros(len(step_error))
    if len(coarse.contacts) != len(history.contacts):  # a given step was too long
        coarse, size = history, step

    def differ(one: History, other: History) -> np.ndarray:
        found = _difference(options.quantities, one, other)  # of descriptions with another number of impacts, perhaps
        return found if len(found) == len(none) else np.append(found[:2], np.ones(len(none) - 2))

    told = [any(other.omega[-1] > body.omega[-1] for other in body.poorer.values()) for body in bodies]
    truncation, resolvable = _truncation(parts, told, contacts, system, coarse, ran, size, differ, pace, *last)
    truncation = truncation + _unstated(bodies, parts, contacts, coarse, ran, size, differ, pace, last)
    mesh_error = _mesh_error(bodies, parts, contacts, system, coarse, ran, size, differ, options.tolerance, pace, last)
    moved = (engine.follow(_joined(other, contacts), ran, size, pace, *last) for other in others)
    inherited = sum((differ(run, coarse) for run in moved), none)
    parted = {"step": step_error, "truncation": truncation, "mesh": mesh_error, "inherited": inherited}
    parted["idealisation"] = none
    for i, body in enumerate(bodies):
        before = history
        for cause, other in body.poorer.items():
            poorer = [*parts[:i], _poorer(parts[i], other), *parts[i + 1 :]]
            try:
                # in fine steps, because the fastest modes of two descriptions differ, and so do their step errors
                less = engine.follow(_joined(poorer, contacts), ran, step, pace, *last)
                parted[cause] = parted[cause] + differ(less, before) + float(_may_touch(before, less, pace[0]))
                before = less
            except SimulationError:  # the poorer body cannot be followed, so it tells nothing
                parted[cause] = parted[cause] + 1.0
    errors = {cause: float(found[0]) for cause, found in parted.items()}
    doubts = {cause: float(found[1]) for cause, found in parted.items()}
    if "n_impacts" in options.quantities and sum(doubts.values()) >= history.margin:
        errors[max(doubts, key=lambda cause: doubts[cause])] += 1.0
    error = Error(**errors, resolvable=resolvable, sensitivity=growth)
    order = np.lexsort(history.contacts[:, (4, 0)].T)  # as `History.impacts`
    laws = tuple(touch.law for touch in contacts)
    return Response(
        tuple(bodies), laws, history, speed, options.tolerance, ran, error, striker, at, _ends(parts, system),
        options.quantities, rebounds=sum(parted.values(), none)[2:][order],
    )  # fmt: skip


def _check_way(system: ModalSystem, depth: float, tolerance: float) -> None:
    """Raise ValueError if rounding of a large offset would spoil the approach in contact, about ``depth`` [m]."""
    way = float(np.abs(system.offset).max())
    if np.finfo(float).eps * way > tolerance * depth:
        raise ValueError(
            f"gap and constant forces must be smaller: with an offset of {way:.3g} m, rounding spoils an approach of "
            f"{depth:.3g} m beyond the tolerance of {tolerance:g}; start nearer to contact"
        )


def _ends(parts: Sequence[_Part], system: ModalSystem) -> tuple[Ends, ...]:
    """Where every body is touched; a constant force makes left-out modes dip only if a series spring replaces them."""
    found, rated = [], _rated(system.law)
    last = sum(len(part.omega) for part in parts)
    for part in parts:
        forms = slice(last, last + _forms(part, rated).shape[1])
        last = forms.stop
        dips = part.rest.any() and forms.start == forms.stop
        doubtful, dip_force = bool(part.doubt.any() or part.loose.size), part.force if dips else 0.0
        found.append(
            Ends(part.points, part.touched, part.force, part.rest, forms, dip_force, part.speed, doubtful=doubtful)
        )
    return tuple(found)


def _forms(part: _Part, rated: np.ndarray) -> np.ndarray:
    """Forms (n_ends, n_forms) of unit stiffness that stand for the modes left out; none where a spring does."""
    if not part.rest.any() or (len(part.touched) == 1 and not rated[part.touched[0][0]]):
        return np.zeros((len(part.touched), 0))
    size, vectors = np.linalg.eigh(part.rest)
    kept = size > ROUNDING * size[-1]
    return np.asarray(vectors[:, kept] * np.sqrt(size[kept]))


def _parts(bodies, contacts, speeds, states, forces, residual) -> tuple[list[_Part], float]:
    """Every body as a `_Part`, and the speed of the first body that moves."""
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
        for body, at, sign in ((touch.first, touch.first_at, 1.0), (touch.second, touch.second_at, -1.0)):
            if body is None:
                continue
            if not 0 <= body < len(bodies):
                raise ValueError(f"contacts must name bodies from 0 to {len(bodies) - 1}, got {body}")
            ends[body].append((i, sign, bodies[body].point("at", at)))
    parts, arriving = [], 0.0
    for body, modes in enumerate(bodies):
        points = np.vstack([point for _, _, point in ends[body]] or [np.zeros((0, modes.dimension))])
        rows = np.atleast_2d(modes.shapes.at(points)) if ends[body] else np.zeros((0, modes.n_modes))
        rest = left_out(modes, points, rows) if residual and modes.dimension and ends[body] else None
        part = _part(modes, tuple((i, sign) for i, sign, _ in ends[body]), points, rows, rest, float(forces[body]))
        if states is not None:
            q, p = (check.array(f"states[{body}]", value, (modes.n_modes,)) for value in states[body])
            part = replace(part, q=q, p=p)
        speed = float(speeds[body])
        if speed != 0.0:
            if not ends[body] or not rows[0, modes.omega == 0.0].any():
                raise ValueError(f"speeds must be zero for a body that cannot move rigidly, got {speed:g} m/s")
            part = replace(part, p=part.p + speed * modes.rigid_motion(points[:1]), speed=speed)
        arriving = arriving or speed
        parts.append(part)
    return parts, arriving


def _part(
    modes: Modes,
    touched: tuple,
    points: np.ndarray,
    rows: np.ndarray,
    left_out: tuple[np.ndarray, np.ndarray] | None,
    force: float,
    motion: np.ndarray | None = None,
) -> _Part:
    """One undeformed body, at rest or moving, with its shapes and residual compliance at its contacts."""
    n_ends = len(touched)
    rest, doubt = (np.zeros((n_ends, n_ends)), np.zeros(n_ends)) if left_out is None else left_out
    rest = 0.5 * (rest + rest.T)
    carried = np.square(rows / np.where(modes.omega > 0.0, modes.omega, np.inf)).sum()
    largest = rest[0, 0] if n_ends == 1 else np.linalg.eigvalsh(rest)[-1] if n_ends else 0.0
    if largest <= ROUNDING * (np.trace(rest) + carried):
        rest = np.zeros_like(rest)
    still = np.zeros(modes.n_modes)
    bias = force * rows[0] if force else still
    velocity = still if motion is None else motion
    pressed = np.zeros((2, n_ends))
    return _Part(
        modes.omega, modes.damping_ratio, rows, touched, rest, doubt, still, velocity, bias, force, points, pressed,
        np.zeros((n_ends, 0)) if left_out is None else modes.shapes.loose(points),
    )  # fmt: skip


def _joined(parts: Sequence[_Part], contacts: Sequence[Touch]) -> ModalSystem:
    """Join the modes of all bodies; series springs or replacement modes stand in for the left-out modes.

    A series spring is exact only for a body with one lossless contact. Otherwise each eigenvector of the residual
    compliance becomes a mode above the last kept one, so that loss and other contacts act on it too.
    """
    law = np.array([touch.law.numbers for touch in contacts])
    rated = _rated(law)
    offset = np.array([-t.law.gap for t in contacts])
    n_modes = sum(len(part.omega) for part in parts)
    shape = np.zeros((len(contacts), n_modes))
    # frequency, damping ratio, signed shape (n_contacts,), constant force, static deflection and its rate
    extra: list[tuple[float, float, np.ndarray, float, float, float]] = []
    start, stretched = 0, None
    for part in parts:
        if part.stretching is not None:
            stretched = Stretched(part.stretching.forms, start)
        for (i, sign), row in zip(part.touched, part.rows):
            shape[i, start : start + len(row)] += sign * row
        start += len(part.omega)
        if not part.rest.any():
            continue
        first, sign = part.touched[0]
        if len(part.touched) == 1 and not rated[first]:
            law[first, layout.COMPLIANCE] += part.rest[0, 0]
            offset[first] += sign * part.rest[0, 0] * part.force
            continue
        above, damping = rest_mode(part.points.shape[1], part.omega[-1], part.zeta[-1], bool(rated.any()))
        for form in _forms(part, rated).T:
            column = np.zeros(len(law))
            for (i, sign), share in zip(part.touched, form):
                column[i] += sign * share * above
            held = -(part.pressed @ column[[i for i, _ in part.touched]]) / above**2
            extra.append((above, damping, column, 0.0, float(held[0]), float(held[1])))
    lists = [[getattr(part, name) for part in parts] for name in ("omega", "zeta", "bias", "q", "p")]
    if extra:
        shape = np.ascontiguousarray(np.hstack([shape, *(mode[2][:, None] for mode in extra)]))
        lists = [[*one, np.array([mode[k] for mode in extra])] for one, k in zip(lists, (0, 1, 3, 4, 5))]
    omega, zeta, bias, q, p = (np.concatenate(one) for one in lists)
    return ModalSystem(omega, zeta, shape, offset, bias, law, q, p, stretched=stretched)


def _rated(law: np.ndarray) -> np.ndarray:
    """Whether the force of each contact depends on more than the approach itself, (n_contacts,)."""
    return (law[:, layout.LOSS] > 0.0) | (law[:, layout.KIND] == FELT)


def _poorer(part: _Part, modes: Modes) -> _Part:
    """The same body in the same motion, described by other modes."""
    rows, still = modes.shapes.at(part.points), np.zeros(modes.n_modes)
    moving = part.omega == 0.0
    if part.q.any() or part.p[~moving].any():
        raise ValueError("a body of Ritz vectors must start at rest; find its modes with find_modes")
    velocity = still
    if part.p.any():
        velocity = float(part.rows[0] @ part.p) * modes.rigid_motion(part.points[:1])
    rest, rigid = left_out(modes, part.points, rows), modes.omega == 0.0
    # rigid motions are known up to a rotation among them, which would look like a difference of speeds
    here, there = np.vstack([rows, velocity])[:, rigid], np.vstack([part.rows, part.p])[:, moving]
    left, _, right = np.linalg.svd(here.T @ there)
    turned = here @ left @ right
    rows, velocity = rows.copy(), velocity.copy()
    rows[:, rigid], velocity[rigid] = turned[:-1], turned[-1]
    poorer = _part(modes, part.touched, part.points, rows, rest, part.force, velocity)
    return replace(poorer, stretching=None if part.stretching is None else stretch(modes))


def _may_touch(history: History, other: History, duration: float) -> bool:
    """Whether two descriptions of a blow differ so much in some flight that one more impact cannot be ruled out.

    Wherever the open contacts of the first come nearest, the gap must exceed the largest difference of the two motions
    since both ended the first impact. Looks ahead until all modes together cannot bridge the gap. ``duration`` [s] is
    that of one contact.
    """
    if history.bias.any() or history.status != other.status or not len(history.contacts) or not len(other.contacts):
        return False
    rigid, shape = history.omega == 0.0, history.shape
    size = np.hypot(history.end_q, history.end_p / np.where(rigid, 1.0, history.omega))
    gap = -history.offset - shape[:, rigid] @ history.end_q[rigid]
    apart = -shape[:, rigid] @ history.end_p[rigid]  # [m/s]
    ahead = (np.abs(shape[:, ~rigid]) @ size[~rigid] - gap)[apart > 0.0] / apart[apart > 0.0]
    end = history.end_time
    if history.status == record.FINISHED:
        end += max(0.0, float(ahead.max(initial=0.0)))
    start = max(float(found.contacts[:, 1].min()) for found in (history, other))
    end = max(start, end)
    times = np.linspace(start, end, int(min(engine.LOOKS[1], engine.LOOKS[0] * (end - start) / duration)) + 2)
    surface, opened = history.surfaces(times)
    approach, doubt = history.motion(times) - surface, np.zeros((len(times), 1))
    doubt[:, 0] = np.maximum.accumulate(np.abs(approach - other.motion(times) + other.surfaces(times)[0]).max(axis=1))
    nearest = np.zeros(approach.shape, bool)
    nearest[1:-1] = (approach[1:-1] >= approach[:-2]) & (approach[1:-1] >= approach[2:])
    nearest &= opened
    return bool((nearest & (approach > -doubt)).any())


def rest_mode(dimension: int, omega: float, zeta: float, lossy: bool) -> tuple[float, float]:
    """Frequency [rad/s] and damping ratio [-] of the mode that replaces those above the last kept one.

    A lossy force depends on the approach rate, in which an undamped mode just above the last one would ring. A
    critically damped mode far above behaves like a series spring and takes almost no energy.
    """
    if lossy:
        return LOSSY_ABOVE * omega, 1.0
    return REST_ABOVE[min(dimension, 2)] * omega, float(zeta)


def _thinned(part: _Part, wanted: float) -> tuple[_Part, float]:
    """The body with its upper modes replaced by their compliance, and the ratio of old to new highest frequency."""
    flexible = part.omega[part.omega > 0.0]
    if not part.rest.any() or len(flexible) < 2:
        return part, np.inf
    limit = max(flexible[-1] / wanted, flexible[0])
    n = int(np.searchsorted(part.omega, limit, side="right"))
    gone = part.rows[:, n:] / part.omega[n:]
    thin = replace(
        part, omega=part.omega[:n], zeta=part.zeta[:n], rows=part.rows[:, :n], rest=part.rest + gone @ gone.T,
        q=part.q[:n], p=part.p[:n], bias=part.bias[:n],
        stretching=None if part.stretching is None else part.stretching.truncated(n),
    )  # fmt: skip
    return thin, float(flexible[-1] / part.omega[n - 1])


def _scheme_for(tolerance: float, exponent: float) -> str:
    """The scheme that meets a tolerance with the least work."""
    return "collocation" if tolerance < COLLOCATION_BELOW and exponent >= 1.0 else "A4"


def _first_count(scheme: str, tolerance: float, quantities: Mapping[str, float | None]) -> float:
    """Steps per contact in the first run."""
    count = engine.steps_per_contact(tolerance, 0.5 if scheme == "A" else 0.25)
    return max(6.0, count * (AVERAGED if set(quantities) <= AVERAGES else 1.0))


def steps_for(
    contact: Contact,
    duration: float,
    tolerance: float,
    quantities: Mapping[str, float | None],
    scheme: str | None = None,
    dt: float | None = None,
) -> tuple[str, float]:
    """Scheme and first time step [s] of `strike`; ``duration`` is the contact time on a rigid wall [s]."""
    scheme = scheme or _scheme_for(tolerance, contact.exponent)
    if scheme in ("A", "A4"):
        return scheme, dt or duration / _first_count(scheme, tolerance, quantities)
    return scheme, dt or duration / (2.0 if scheme == "collocation" else 1.0)


def striker_modes(striker: Striker, *, contact: Contact, speed: float, tolerance: float) -> tuple[int, float]:
    """How many striker modes a blow needs, and the expected error [-] of leaving out the others.

    That error may take only STRIKER_SHARE of the tolerance, because striker modes cost little.
    """
    modes = striker.modes
    if modes.n_modes == modes.n_rigid:
        return modes.n_rigid, 0.0
    law: dict[str, Any] = {"contact": contact, "mass": striker.felt_mass, "speed": speed}
    allowed = STRIKER_SHARE * tolerance / (LOSSY_STRIKER if contact.rated else 1.0)
    omega_0 = 2.0 * np.pi * accuracy.contact_resonance(**law)
    whole = modes.truncated(n_modes=modes.n_rigid).residual_compliance(striker.at[None])[0, 0]
    if striker.felt_mass * omega_0**2 * whole <= allowed and not contact.rated:  # what replaces modes needs one below
        return modes.n_rigid, allowed
    limit = accuracy.cutoff_frequency(modes, striker.at, tolerance=allowed, **law)
    kept = min(modes.n_modes, max(modes.n_rigid + 2, int(np.searchsorted(modes.frequencies, limit, side="right"))))
    return kept, striker_error(striker, kept, contact=contact, speed=speed)


def striker_error(striker: Striker, n_modes: int, *, contact: Contact, speed: float) -> float:
    """Expected error [-] if a striker keeps only its first ``n_modes`` modes."""
    highest = float(striker.modes.frequencies[max(n_modes - 1, 1)])
    law: dict[str, Any] = {"contact": contact, "mass": striker.felt_mass, "speed": speed}
    return accuracy.truncation_error(striker.modes, striker.at, highest, **law) * (
        LOSSY_STRIKER if contact.rated else 1.0
    )


def shortened(striker: Striker, n_modes: int) -> Striker:
    """The striker with its first modes only; the others act as a spring."""
    if n_modes >= striker.modes.n_modes:
        return striker
    return replace(striker, modes=striker.modes.truncated(n_modes=n_modes), fixed=True)


def _controlled(
    system, scheme, dt, tolerance, quantities, pace, horizon, n_max, free=None
) -> tuple[History, np.ndarray, str, History, tuple[float, float]]:
    """Refine until two successive runs agree to the tolerance; ``free`` if the scheme is our choice.

    Returns the finer history, its estimated errors as of `_difference`, the scheme, the coarser history and the step
    sizes of both.
    """
    peaked, counted = "force" in quantities, quantities.keys() & {"n_impacts", "contact_time"}

    def compared(coarse: History, fine: History) -> np.ndarray:
        """Estimated errors of the finer run as of `_difference`, (2 + n_impacts,)."""
        found = _difference(quantities, coarse, fine, over)
        found[0] = max(found[0], fine.force_missed if peaked else 0.0)
        found[1] = min(1.0, SURELY * found[1])
        return found

    free = scheme is None and dt is None if free is None else free
    if system.stretched is not None:
        if scheme == "collocation":
            raise ValueError("scheme collocation knows no stretching; use A4")
        scheme = scheme or "A4"
    scheme = scheme or _scheme_for(tolerance, float(system.law[:, layout.EXPONENT].min()))
    if scheme == "collocation" and (system.law[:, layout.EXPONENT] < 1.0).any():
        least = system.law[:, layout.EXPONENT].min()
        raise ValueError(f"scheme collocation needs exponents of at least 1, got {least:g}; use A4")
    over = RICHARDSON[scheme]
    if scheme != "collocation":  # a strong loss reacts to the rates of modes faster than the step
        over = over[0], over[1] / (1.0 + 2.0 * pace[1] * system.law[:, layout.LOSS].max())
    shortest = min(pace[0], horizon)  # or the horizon could cut both runs to one step, and they would always agree
    if dt is not None:
        dt = min(dt, 0.5 * horizon)
        fine = engine.follow(system, scheme, dt, pace, horizon, n_max, "dt")
        coarse = engine.follow(system, scheme, 2.0 * dt, pace, horizon, n_max, "dt")
        return fine, compared(coarse, fine), scheme, coarse, (dt, 2.0 * dt)
    if scheme == "collocation":
        sizes = [max(1e-15, tolerance ** (2.0 / 3.0) * 0.02 ** (1 + n)) for n in range(-1, 5)]
    else:
        first = 2.0 * shortest / _first_count(scheme, min(STEP_SHARE * tolerance, TOLERANCE), quantities)
        first = min(first, _longest_lossy(system, pace, tolerance))
        sizes = [first * 0.5**n for n in range(DOUBLINGS + 1)]
    aim = tolerance if scheme == "collocation" else STEP_SHARE * tolerance
    try:
        runs = [engine.follow(system, scheme, size, pace, horizon, n_max) for size in sizes[:2]]
    except SimulationError as exhausted:  # so many steps are out of reach: longer ones may do
        sizes = [4.0 * sizes[0], 2.0 * sizes[0], *sizes]
        try:
            runs = [engine.follow(system, scheme, size, pace, horizon, n_max) for size in sizes[:2]]
        except SimulationError:
            raise exhausted from None
    best, met, grazes = np.inf, None, 0 if counted else GRAZES
    for i, (before, size) in enumerate(pairwise(sizes)):
        if i:
            runs = [runs[1], engine.follow(system, scheme, size, pace, horizon, n_max)]
        coarse, fine = runs
        estimate = compared(coarse, fine)
        best = min(best, estimate[0])
        if estimate[0] <= tolerance:
            met = fine, estimate, scheme, coarse, (size, before)
        if estimate[0] <= aim:
            if grazes == GRAZES or fine.margin > estimate[1]:
                break
            grazes += 1
        if 2 * len(fine.steps) > engine.most_steps(system):
            break  # the next run would exceed the step limit
    if met is not None:
        return met
    if free and scheme == "A4" and (system.law[:, layout.EXPONENT] >= 1.0).all() and system.stretched is None:
        return _controlled(system, "collocation", dt, tolerance, quantities, pace, horizon, n_max, True)
    hint, enough = "", min(REACHED * best, 1.0)
    advice = f"raise tolerance to {float(f'{enough:.1e}'):g}" if free else "leave out scheme"
    if len(fine.contacts) > 1:
        growth = _sensitivity(coarse, fine)
        hint = f"; small errors grow {growth:.1g}-fold over {len(fine.contacts)} impacts"
        if free and growth == np.inf:  # the last runs were different blows, to which no tolerance applies
            advice = f"give max_impacts of at most {max(1, _agreed(coarse, fine, tolerance * pace[0]))}"
    raise SimulationError(
        f"the step error stays at {best:.1e}, above the tolerance {tolerance:.1e}, with {len(fine.steps)} steps{hint}; "
        f"{advice}"
    )


def _agreed(coarse: History, fine: History, apart: float) -> int:
    """How many impacts end in two runs, one after another, at times no more than ``apart`` [s] from each other."""
    one, two = (np.sort(history.contacts[:, 1]) for history in (coarse, fine))
    n = min(len(one), len(two))
    same = np.abs(one[:n] - two[:n]) <= apart
    return n if same.all() else int(same.argmin())


def _longest_lossy(system: ModalSystem, pace: tuple[float, float], tolerance: float) -> float:
    """Longest step [s] that resolves the modes whose ringing shows in a lossy contact force; infinite without loss.

    A lossy force depends on the approach rate. A force that rises like a spring's makes each mode ring in that rate,
    with stiffness times u**2 / omega**2 of the approach speed.
    """
    longest = np.inf
    slow = system.omega <= np.pi / pace[0]
    fastest = np.argsort(-system.omega, kind="stable")[: np.count_nonzero(system.omega)]
    order = fastest[system.zeta[fastest] < RINGING]
    omega = system.omega[order]
    for shape, loss in zip(system.shape, system.law[:, layout.LOSS]):
        number = loss * pace[1]
        if number > 0.0 and len(omega):
            stiffness = (1.0 + number) * (np.pi / pace[0]) ** 2 / max(float(shape[slow] @ shape[slow]), 1e-300)
            ringing = number / (1.0 + number) * stiffness * np.cumsum((shape[order] / omega) ** 2)
            heard = np.searchsorted(ringing, tolerance)
            if heard < len(omega):
                longest = min(longest, RESOLVED / float(omega[heard]))
    return longest


def _difference(
    quantities: Mapping[str, float | None], coarse: History, fine: History, over: tuple[float, float] = (1.0, 1.0)
) -> np.ndarray:
    """Differences of two runs, (2 + n_impacts,) [-]: largest of the requested quantities, margin, restitution of each.

    All are 1 if the impact counts differ. ``over[0]`` divides the differences of speeds, impulse and spectrum,
    ``over[1]`` those of contact time and peak force. Margins stay as they are, and so do restitutions of impacts:
    points part as fast as the bodies ring there, also in modes faster than the step.
    """
    if len(coarse.contacts) != len(fine.contacts) or coarse.status != fine.status:
        return np.ones(2 + len(fine.contacts))
    rigid = fine.omega == 0.0  # a swinging body has much momentum, of which the striker's error is no share
    momentum = max(float(np.linalg.norm(p[rigid])) for p in (fine.start_p, fine.end_p))
    momentum = momentum or float(np.linalg.norm(fine.start_p) or np.linalg.norm(fine.end_p)) or 1.0
    speed = np.abs(coarse.end_p[coarse.omega == 0.0] - fine.end_p[rigid])
    found = {"restitution": float(speed.max(initial=0.0)) / momentum / over[0]}
    if len(fine.contacts):
        one, two = (engine.totals(history) for history in (coarse, fine))
        shares = {"impulse": over[0], "contact_time": over[1], "force": over[1]}
        found |= {name: abs(x - y) / (y or 1.0) / shares[name] for name, x, y in zip(shares, one, two)}
    for name, band in quantities.items():
        if band is not None:
            frequencies = np.linspace(0.0, band, BAND_POINTS)
            first, second = (
                force_spectrum.of_pieces(force_spectrum.pieces(*history.samples(1.0)), frequencies)
                for history in (coarse, fine)
            )
            found[name] = float(np.abs(first - second).max() / (np.abs(second).max() or 1.0)) / over[0]
    largest = max(ROUNDING, *(float(found.get(name, 0.0)) for name in quantities))
    return np.array([largest, abs(coarse.margin - fine.margin), *_apart(coarse, fine)])


def _apart(coarse: History, fine: History) -> np.ndarray:
    """Difference of two runs in the restitution of each impact [-], (n_impacts,); 1 where only one of them has it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = [run.contacts[:, 6] / run.contacts[:, 5] for run in (coarse, fine)]
    one, two = (np.nan_to_num(ratio, nan=-1.0, posinf=-1.0) for ratio in ratios)
    return np.where((one < 0.0) == (two < 0.0), np.abs(one - two), 1.0)


def _sensitivity(coarse: History, fine: History) -> float:
    """Growth [-] of the difference of two runs between the end of the first and of the last impact."""
    if len(coarse.contacts) != len(fine.contacts):
        return float("inf")
    if len(fine.contacts) < 2:
        return 1.0
    one, two = (np.sort(history.contacts[:, 1]) for history in (coarse, fine))
    least = ROUNDING * two[-1]
    return max(1.0, float((abs(one[-1] - two[-1]) + least) / (abs(one[0] - two[0]) + least)))


def _truncation(parts, told, contacts, system: ModalSystem, whole: History, scheme, size, differ, pace, horizon, n_max):
    """Estimated error [-] of leaving out modes, and whether the estimate can be trusted.

    Repeats the run with the upper modes of one body replaced by their compliance. The error falls at least with the
    power FALLING of the highest kept frequency, so the change bounds the error of the modes already left out. Two such
    runs and a minimum, AT_LEAST of the predicted error up to BY_CHANCE times what they found, guard against a change
    that is small by chance. The bodies ``told`` (n_bodies,) have a poorer description with modes above those of their
    own, whose blow tells the error.
    """
    none = np.zeros(2 + len(whole.contacts))
    if not any(part.rest.any() for part in parts):
        return none, True
    omega_0 = np.pi / pace[0]
    mobility = np.maximum((system.shape**2) @ (system.omega <= omega_0), 1e-300)
    softness, expected = np.zeros(len(contacts)), 0.0
    for part in parts:
        ratio = omega_0 / max(omega_0, part.omega[-1])
        for (i, _), rest in zip(part.touched, np.diag(part.rest)):
            soft = omega_0**2 / mobility[i] * rest
            softness[i] += soft
            expected += accuracy.left_out_error(soft, ratio, contacts[i].law.exponent, part.points.shape[1])
    resolvable = bool((softness <= RESOLVABLE).all())
    found, least, seen = none, np.full(len(none), AT_LEAST * float(expected)), True
    for i, part in enumerate(parts):
        guesses = [none]
        for wanted in () if told[i] else THINNED:
            thin, ratio = _thinned(part, wanted)
            if 1.0 < ratio < np.inf:
                less = [*parts[:i], thin, *parts[i + 1 :]]
                change = differ(engine.follow(_joined(less, contacts), scheme, size, pace, horizon, n_max), whole)
                change[:2] /= ratio ** FALLING[int(part.zeta[-1] > RINGING)] - 1.0
                change[2:] /= ratio**PARTING - 1.0
                guesses.append(change)
        found = found + np.max(guesses, axis=0)
        seen = seen and (not part.rest.any() or len(guesses) > len(THINNED))
    if seen:
        least[0] = min(least[0], BY_CHANCE * found[0])
    return np.maximum(found, least), resolvable


def _mesh_error(
    bodies, parts, contacts, system: ModalSystem, coarse: History, scheme, size, differ, tolerance, pace, last
):
    """Estimated error [-] due to the mesh errors of frequencies and static compliances.

    Repeats the run with every frequency lowered and every compliance raised by its error, so that the estimate grows
    over several impacts as the true error does.
    """
    softer, matters = [], False
    mobility = np.maximum((system.shape**2) @ (system.omega <= np.pi / pace[0]), 1e-300)
    for modes, part in zip(bodies, parts):
        if modes.unstated:  # no finite elements
            softer.append(part)
            continue
        soft = [(np.pi / pace[0]) ** 2 / mobility[i] * doubt for (i, _), doubt in zip(part.touched, part.doubt)]
        error = np.zeros(modes.n_modes) if modes.frequency_error is None else modes.frequency_error
        matters |= max([error.max(), *soft]) > NEGLIGIBLE * tolerance
        lower = part.omega / (1.0 + error)
        softer.append(replace(part, omega=lower, rest=part.rest + np.diag(part.doubt)))
    if not matters:
        return np.zeros(2 + len(coarse.contacts))
    return differ(engine.follow(_joined(softer, contacts), scheme, size, pace, *last), coarse)


def _unstated(bodies, parts, contacts, coarse: History, scheme, size, differ, pace, last):
    """Estimated error [-] due to what nobody said of the bodies, see `Modes.unstated`.

    Repeats the run with the most and the least that the modes left out of a body may yield, and with the rigid motions
    that it may have, on springs too soft to matter.
    """
    error = none = np.zeros(2 + len(coarse.contacts))
    for i, (modes, part) in enumerate(zip(bodies, parts)):
        if not modes.unstated or not len(part.touched):
            continue
        own = np.diag(part.rest)
        kept = np.sqrt(np.maximum(0.0, 1.0 - part.doubt / np.where(own > 0.0, own, np.inf)))
        others = [part.rest + np.diag(part.doubt), part.rest * np.outer(kept, kept)] if part.doubt.any() else []
        trials = [[replace(part, rest=rest) for rest in others], [_loosened(part)] if part.loose.size else []]
        for trial in trials:
            changed = ([*parts[:i], one, *parts[i + 1 :]] for one in trial)
            runs = (engine.follow(_joined(each, contacts), scheme, size, pace, *last) for each in changed)
            error = error + np.max([none, *(differ(run, coarse) for run in runs)], axis=0)
    return error


def _loosened(part: _Part) -> _Part:
    """The body with the rigid motions that it may have besides, as its first modes."""
    n = part.loose.shape[1]
    still, slow = np.zeros(n), np.full(n, SLOW * part.omega[0])
    bias = part.force * part.loose[0] if part.force else still
    return replace(
        part, omega=np.append(slow, part.omega), zeta=np.append(still, part.zeta),
        rows=np.hstack([part.loose, part.rows]), q=np.append(still, part.q), p=np.append(still, part.p),
        bias=np.append(bias, part.bias),
    )  # fmt: skip
