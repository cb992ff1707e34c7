"""Strike and collide: from bodies, contact laws and a tolerance to a response that keeps its promise."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from . import _check, _kernels
from ._check import SimulationError
from .accuracy import contact_duration
from .contact import Contact
from .modal import Modes
from .response import Error, History, Response
from .striker import Striker

TOLERANCE = 1e-4  # [-] the default promise
ENERGY_SCHEMES = ("A", "A4")
MAX_STEPS = 2_000_000  # [-] of one run, about a second for a few modes
FIRST_STEPS = 12.0  # [-] steps per contact at which A4 errs by about FIRST_ERROR: measured 9e-6 linear, 1e-4 Hertz
FIRST_ERROR = 1e-4  # [-]
DOUBLINGS = 7  # [-] how often the step is halved before the run gives up
RICHARDSON = {"A": 3.0, "A4": 7.0}  # [-] difference of two runs over the error of the finer: 2**order - 1, order 3 kept
RESOLVABLE = 0.3  # [-] contact stiffness times residual compliance up to which the estimate of its error holds
STATIC_ERROR = 0.5  # [-] force error over k C omega_0/omega_c with residual compliance, see accuracy.py
ROUNDING = 1e-13  # [-] below this two runs cannot be told apart


@dataclass(frozen=True)
class Touch:
    """Where two bodies of `collide` may touch, and the law between them."""

    law: Contact
    first: int  # index of the body that moves towards the second
    second: int | None  # index of the other body; None: a rigid wall
    first_at: Any = None  # point on the first body [m]
    second_at: Any = None  # point on the second body [m]


@dataclass(frozen=True, eq=False)
class _System:
    """All modes in one list and what joins them: what a kernel needs."""

    omega: np.ndarray
    zeta: np.ndarray
    shape: np.ndarray
    offset: np.ndarray
    bias: np.ndarray
    law: np.ndarray
    start_q: np.ndarray
    start_p: np.ndarray


def strike(
    modes: Modes,
    striker: Striker,
    contact: Contact,
    *,
    at: Any,
    speed: float,
    tolerance: float = TOLERANCE,
    residual: bool = True,
    duration: float | None = None,
    max_impacts: int | None = None,
    scheme: str | None = None,
    dt: float | None = None,
    striker_force: float = 0.0,
    target_force: float = 0.0,
) -> Response:
    """Strike a body at rest and follow it until the two have parted for good.

    Parameters
    ----------
    modes : Modes
        The struck body. They stand for the whole body: what they leave out acts by its static compliance.
    striker : Striker
        Arrives moving rigidly.
    contact : Contact
    at : point struck, (dimension,) [m]
    speed : float [m/s] of the striker's contact point towards the body
    tolerance : float [-]
        Largest error accepted: absolute in the restitution, relative in impulse, contact time and peak force.
    residual : bool
        Whether the residual compliance acts; False strikes the bare set of modes.
    duration : float [s], optional
        Where to stop at the latest.
    max_impacts : int, optional
        Stop when so many impacts have ended.
    scheme : {"A", "A4"}, optional
        Fixes the scheme instead of leaving it to the tolerance.
    dt : float [s], optional
        Fixes the step in contact; the step error is then estimated, not held to the tolerance.
    striker_force, target_force : float [N]
        Constant forces at the contact points, positive along the blow: the weight of a falling ball, say.

    Returns
    -------
    Response

    Raises
    ------
    ValueError
        Where an argument cannot be.
    SimulationError
        Where the tolerance cannot be met, or no end can be proved and none was given.
    """
    speed = _check.non_negative("speed", speed, "m/s")
    point = modes.points("at", at)[:1]
    touch = Touch(contact, 0, 1, striker.at[None] if striker.modes.dimension else None, point)
    bodies = (striker.modes, modes)
    response = collide(
        bodies,
        [touch],
        speeds=(speed, 0.0),
        tolerance=tolerance,
        residual=residual,
        duration=duration,
        max_impacts=max_impacts,
        scheme=scheme,
        dt=dt,
        forces=(striker_force, target_force),
    )
    return replace(response, striker=striker, at=point[0])


def collide(
    bodies: Sequence[Modes],
    contacts: Sequence[Touch],
    *,
    speeds: Sequence[float] | None = None,
    states: Sequence[tuple[Any, Any]] | None = None,
    tolerance: float = TOLERANCE,
    residual: bool = True,
    duration: float | None = None,
    max_impacts: int | None = None,
    scheme: str | None = None,
    dt: float | None = None,
    forces: Sequence[float] | None = None,
) -> Response:
    """Let any bodies collide at any contacts.

    Parameters
    ----------
    bodies : sequence of Modes
    contacts : sequence of Touch
    speeds : sequence of float [m/s], (n_bodies,)
        Each body arrives moving rigidly; the speed is that of its first contact point, positive from the first body
        of a touch towards the second.
    states : sequence of (q, p), optional
        Modal displacements and velocities of each body at the start, instead of or on top of ``speeds``.
    forces : sequence of float [N], (n_bodies,)
        Constant forces at each body's first contact point, positive like the speeds.
    tolerance, residual, duration, max_impacts, scheme, dt
        As in `strike`.

    Returns
    -------
    Response
    """
    tolerance = _check.between("tolerance", tolerance, 1e-12, 1.0)
    horizon = np.inf if duration is None else _check.positive("duration", duration, "s")
    n_max = 0 if max_impacts is None else _check.count("max_impacts", max_impacts)
    if scheme is not None:
        scheme = _check.one_of("scheme", scheme, ENERGY_SCHEMES)
    if dt is not None:
        dt = _check.positive("dt", dt, "s")
    bodies, contacts = tuple(bodies), tuple(contacts)
    system, arriving = _assemble(bodies, contacts, speeds, states, forces, residual)
    if not np.isfinite(horizon) and not n_max and (system.bias @ system.shape.T > 0.0).any():
        raise ValueError(
            "duration or max_impacts must be given where a constant force keeps pressing the bodies together"
        )
    shortest = _contact_times(system)
    history, step_error, ran = _controlled(system, scheme, dt, tolerance, shortest, horizon, n_max)
    truncation, resolvable = _truncation(bodies, contacts, system, shortest, residual)
    error = Error(step_error, truncation, _mesh_error(bodies, history), resolvable)
    laws = tuple(touch.law for touch in contacts)
    return Response(bodies, laws, history, arriving, tolerance, ran, error)


def _assemble(bodies, contacts, speeds, states, forces, residual) -> tuple[_System, float]:
    """Return the modal system and the speed of the fastest body."""
    if not bodies or not contacts:
        raise ValueError(f"bodies and contacts must not be empty, got {len(bodies)} and {len(contacts)}")
    starts = np.concatenate([[0], np.cumsum([modes.n_modes for modes in bodies])])
    omega = np.concatenate([modes.omega for modes in bodies])
    zeta = np.concatenate([modes.damping_ratio for modes in bodies])
    shape = np.zeros((len(contacts), len(omega)))
    law = np.zeros((len(contacts), 4))
    first_row: dict[int, np.ndarray] = {}
    first_point: dict[int, Any] = {}
    for i, touch in enumerate(contacts):
        compliance = 0.0
        for body, at, sign in ((touch.first, touch.first_at, 1.0), (touch.second, touch.second_at, -1.0)):
            if body is None:
                continue
            if not 0 <= body < len(bodies):
                raise ValueError(f"contacts must join bodies 0 to {len(bodies) - 1}, got {body}")
            modes = bodies[body]
            point = modes.points("at", at)[:1]
            row = modes.shape_at(point if modes.dimension else None)[0]
            shape[i, starts[body] : starts[body + 1]] += sign * row
            first_row.setdefault(body, row)
            first_point.setdefault(body, point if modes.dimension else None)
            if residual and modes.dimension:
                compliance += max(0.0, float(modes.residual_compliance(point)[0, 0]))
        law[i] = touch.law.stiffness, touch.law.exponent, touch.law.loss, compliance
    q, p, bias = np.zeros(len(omega)), np.zeros(len(omega)), np.zeros(len(omega))
    arriving = 0.0
    speeds = np.zeros(len(bodies)) if speeds is None else _check.array("speeds", speeds, (len(bodies),), "m/s")
    forces = np.zeros(len(bodies)) if forces is None else _check.array("forces", forces, (len(bodies),), "N")
    for body, modes in enumerate(bodies):
        part = slice(starts[body], starts[body + 1])
        row = first_row.get(body)
        if row is None:
            row = np.zeros(modes.n_modes)
        if speeds[body] != 0.0:
            if not np.where(modes.omega == 0.0, row, 0.0).any():
                raise ValueError(f"speeds must be zero for a body that cannot move rigidly, got {speeds[body]:g} m/s")
            p[part] += speeds[body] * modes.rigid_motion(first_point[body])
            arriving = arriving or float(speeds[body])
        bias[part] = forces[body] * row
        if states is not None:
            q[part] += _check.array("states", states[body][0], (modes.n_modes,))
            p[part] += _check.array("states", states[body][1], (modes.n_modes,))
    offset = np.array([-touch.law.gap for touch in contacts])
    return _System(omega, zeta, shape, offset, bias, law, q, p), arriving


def _contact_times(system: _System) -> float:
    """Shortest duration [s] to expect of an undisturbed contact, from the masses that can move within it."""
    order = np.argsort(system.omega, kind="stable")
    omega = system.omega[order]
    closing = np.abs(system.shape) @ np.abs(system.start_p)  # bounds the rate of approach at any time
    best = np.inf
    for i, (k, exponent, _, compliance) in enumerate(system.law):
        mobile = np.cumsum(system.shape[i, order] ** 2)  # [1/kg] of the modes up to each
        if not mobile[-1] > 0.0:
            continue
        speed = max(closing[i], 1e-300)
        pressed = max(0.0, system.offset[i] + float(system.shape[i] @ system.start_q))
        if pressed:
            speed = max(speed, pressed * np.sqrt(k * pressed ** (exponent - 1.0) * mobile[-1]))
        for count in np.flatnonzero(np.append(np.diff(omega) > 0.0, True)):
            if not mobile[count] > 0.0:
                continue
            free = contact_duration(Contact(k, exponent), 1.0 / mobile[count], speed)
            if compliance and exponent == 1.0:
                free *= np.sqrt(1.0 + k * compliance)
            if count + 1 == len(omega) or np.pi / free < omega[count + 1]:
                break
        best = min(best, free)
    if not np.isfinite(best):
        raise ValueError("contacts must join points that can move, got only points at rest")
    return float(best)


def _controlled(system, scheme, dt, tolerance, shortest, horizon, n_max) -> tuple[History, float, str]:
    """Run with a step that meets the tolerance, judged by halving it; return the history and its estimated error."""
    name = scheme or "A4"
    if dt is not None:
        fine = _run(system, name, dt, horizon, n_max)
        coarse = _run(system, name, 2.0 * dt, horizon, n_max)
        return fine, _difference(coarse, fine, system) / RICHARDSON[name], name
    order = 2.0 if name == "A" else 4.0
    count = max(6.0, FIRST_STEPS * (FIRST_ERROR / tolerance) ** (1.0 / order))
    coarse = _run(system, name, 2.0 * shortest / count, horizon, n_max)
    best = np.inf
    for doubling in range(DOUBLINGS):
        fine = _run(system, name, shortest / count / 2.0**doubling, horizon, n_max)
        estimate = _difference(coarse, fine, system) / RICHARDSON[name]
        if estimate <= tolerance:
            return fine, estimate, name
        best = min(best, estimate)
        coarse = fine
    raise SimulationError(
        f"the step error stays at {best:.1e}, tolerance {tolerance:.1e}, with {len(fine.steps)} steps; after "
        f"{len(fine.impacts)} impacts the motion may be chaotic: raise tolerance, or give duration or max_impacts"
    )


def _run(system: _System, scheme: str, base: float, horizon: float, n_max: int) -> History:
    """One run at one step; SimulationError where it cannot end."""
    steps, q, p, now, work, time, status, n_fallback, n_blind = _kernels.run_energy(
        system.omega, system.zeta, system.shape, system.offset, system.bias, system.law,
        system.start_q, system.start_p, int(scheme == "A4"), float(base), float(horizon), n_max, MAX_STEPS,
    )  # fmt: skip
    if status == _kernels.EXHAUSTED:
        raise SimulationError(
            f"no final separation was reached in {MAX_STEPS} steps, up to {time:.4g} s; give duration or max_impacts"
        )
    if status == _kernels.FAILED:
        raise SimulationError(f"numbers left the range of floating point at {time:.4g} s; check the units of the scene")
    return History(
        system.omega, system.zeta, system.shape, system.offset, system.bias, system.law, system.start_q, system.start_p,
        steps, q, p, now, work, time, status, n_fallback, n_blind,
    )  # fmt: skip


def _scalars(history: History, system: _System) -> np.ndarray:
    """Restitution-like speed, impulse, contact time and peak force."""
    impacts = history.impacts
    moving = system.omega == 0.0
    scale = np.sqrt(max(float(system.start_p @ system.start_p), 1e-300))
    speed = history.end_p[moving] / scale
    impulse = sum(impact.impulse for impact in impacts)
    return np.array(
        [*speed, impulse, sum(i.duration for i in impacts), max((i.peak_force for i in impacts), default=0.0)]
    )


def _difference(coarse: History, fine: History, system: _System) -> float:
    """Largest difference of two runs in what the tolerance speaks of; 1 where they count impacts differently."""
    if len(coarse.impacts) != len(fine.impacts) or coarse.status != fine.status:
        return 1.0
    one, two = _scalars(coarse, system), _scalars(fine, system)
    scale = np.ones_like(two)
    scale[-3:] = np.where(two[-3:] > 0.0, two[-3:], 1.0)
    return max(float(np.max(np.abs(one - two) / scale)), ROUNDING)


def _truncation(bodies, contacts, system: _System, shortest: float, residual: bool) -> tuple[float, bool]:
    """Estimated error [-] of leaving out modes, and whether the estimate can be trusted."""
    if not residual or not (system.law[:, 3] > 0.0).any():
        return 0.0, True
    omega_0 = np.pi / shortest
    worst, trusted = 0.0, True
    for i, touch in enumerate(contacts):
        k, exponent, _, compliance = system.law[i]
        if compliance == 0.0:
            continue
        mobile = float(system.shape[i, system.omega <= omega_0] @ system.shape[i, system.omega <= omega_0])
        stiffness = omega_0**2 / mobile if mobile > 0.0 else k
        last = min(
            bodies[b].omega[-1] for b in (touch.first, touch.second) if b is not None and bodies[b].omega[-1] > 0.0
        )
        ratio = omega_0 / last if last > 0.0 else 1.0
        share = stiffness * compliance
        worst = max(worst, STATIC_ERROR * share * ratio * (ratio if exponent > 1.2 else 1.0))
        trusted &= share <= RESOLVABLE
    return float(worst), bool(trusted)


def _mesh_error(bodies: tuple[Modes, ...], history: History) -> float:
    """Estimated effect of the frequency errors the modes carry, each weighed by its share of the energy."""
    total, start = 0.0, 0
    energy = 0.5 * (history.end_p**2 + (history.omega * history.end_q) ** 2)
    whole = float(energy.sum())
    for modes in bodies:
        if modes.frequency_error is not None and whole > 0.0:
            part = energy[start : start + modes.n_modes]
            total += float(part @ modes.frequency_error) / whole
        start += modes.n_modes
    return total
