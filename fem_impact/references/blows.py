"""Blows whose answers are formulas, published ones, and the same modes followed by SciPy's integrator."""

from functools import partial

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import gamma

from .. import mesh
from ..fe.assembly import assemble
from ..fe.section import Beam, Material
from ..impact import threshold
from ..impact.collision import Touch, collide, strike
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.striker import Striker
from ..modes import analytic
from ..modes.finding import find_modes
from ..modes.modal import Modes
from .case import TABLE, Reference, ReferenceLine, of_blow


def wall(contact: Contact, mass: float, speed: float) -> dict[str, float]:
    """Numbers of a blow on a rigid wall through F = k delta**p (1 + loss delta'); force and time without loss only."""
    if contact.loss:
        x = contact.loss * speed  # loss (v0 + v1) = log((1 + loss v0) / (1 - loss v1))
        end = brentq(lambda y: np.log1p(x) - np.log1p(-y) - x - y, 1e-9, 1.0 - 1e-12, xtol=1e-15)
        return {"restitution": float(end / x)}
    k, p1 = contact.stiffness, contact.exponent + 1.0
    deepest = (p1 * mass * speed**2 / (2.0 * k)) ** (1.0 / p1)
    duration = 2.0 * np.sqrt(np.pi) * gamma(1.0 + 1.0 / p1) / gamma(0.5 + 1.0 / p1) * deepest / speed
    return {"contact_time": float(duration), "peak_force": k * deepest**contact.exponent, "restitution": 1.0}


def _wall(contact: Contact) -> list[ReferenceLine]:
    mass, speed = 0.1, 1.0
    touch = Touch(contact, first=0, second=None)
    hit = collide([Modes.rigid(mass)], [touch], speeds=[speed], tolerance=1e-6)
    return of_blow(hit, wall(contact, mass, speed), {})


def _masses() -> list[ReferenceLine]:
    one, other = 0.1, 0.3
    hit = strike(Modes.rigid(other), Striker.rigid(one), Contact.hertz(1e7), at=None, speed=1.0, tolerance=1e-6)
    both = one + other
    return of_blow(hit, {"restitution": (other - one) / both, "impulse": 2.0 * one * other / both}, {})


def _endless(stiffness: float) -> list[ReferenceLine]:
    mass, sides, total, first = 0.002, (3.1, 2.0), 2.0, 10.0  # so large that the echo of the edges comes after the blow
    plate = analytic.rectangle(*sides, mass=total, first_frequency=first, n_modes=6000)
    root = 2.0 * first / (np.pi * (sides[0] ** -2 + sides[1] ** -2))  # [m**2/s] sqrt(D / m''), of a hinged plate
    mobility = sides[0] * sides[1] / (8.0 * root * total)
    z = 0.5 * mobility * float(np.sqrt(stiffness * mass))
    damped = float(np.sqrt(1.0 - z**2))
    wanted = {
        "restitution": float(np.exp(-np.pi * z / damped)),
        "contact_time": float(np.pi / damped * np.sqrt(mass / stiffness)),
    }
    spring, at = Contact.linear(stiffness), (1.43, 0.97)
    hit = strike(plate, Striker.rigid(mass), spring, at=at, speed=1.0, max_impacts=1, tolerance=1e-3)
    return of_blow(hit, wanted, {})


def tip_displacement(n_modes: int = 40) -> np.ndarray:
    """Displacement of the tip of SDNL32 [mm] at 1 ... 12 ms, positive away from the stop, (12,)."""
    length, side, spin, stop = 0.783, 14e-3, 3.8, 18e3
    beam = Beam.rectangular(Material(E=67e9, nu=0.0, rho=2400.0), width=side, height=side)
    stick = find_modes(assemble(mesh.line(length), beam, {"left": "hinged"}), n_modes=n_modes, damping_ratio=0.01)
    touch = Touch(Contact.linear(stop), first=0, second=None, first_at=length)
    times = 1e-3 * np.arange(1, 13)
    hit = collide([stick], [touch], speeds=[spin * length], tolerance=1e-6, duration=times[-1])
    return -1e3 * hit.displacement([length], times, body=0)[:, 0]


def _sdnl32() -> list[ReferenceLine]:
    about = TABLE["sdnl32"]
    rows = enumerate(zip(about["values"], tip_displacement().tolist()), 1)
    return [ReferenceLine(f"tip at {i} ms", "mm", there, 0.5 * about["digit"], ours, 0.0) for i, (there, ours) in rows]


def _timoshenko() -> list[ReferenceLine]:
    steel, length = Material(E=215.75e9, nu=0.3, rho=7960.0), 0.1535
    beam = Beam.rectangular(steel, width=0.01, height=0.01)
    modes = analytic.beam(length, ends=("hinged", "hinged"), section=beam, n_modes=60)
    ball, contact = Striker.sphere(steel, 0.01), Contact.hertz(1.581e10)
    hit = strike(modes, ball, contact, at=0.5 * length, speed=0.01, max_impacts=1, tolerance=1e-4)
    about = TABLE["timoshenko-ball"]
    return of_blow(hit, about["values"], {name: 0.5 * digit for name, digit in about["digit"].items()})


def follow_by_dop853(hit: Response, end: float) -> dict[str, float]:
    """The same blow of a rigid striker up to ``end`` [s] by SciPy's DOP853; each change of contact ends a run."""
    modes, contact, mass = hit.bodies[-1], hit.contacts[0], hit.bodies[0].mass
    u, omega, n = modes.shape_at([hit.at])[0], modes.omega, modes.n_modes
    damping = 2.0 * modes.damping_ratio * omega
    state, now, touching = np.zeros(2 * n + 3), 0.0, True
    state[-2] = hit.speed  # modal displacements and speeds, place and speed of the striker, impulse
    changes, peak = [0.0], 0.0  # [s] when contacts begin and end, by turns; [N]

    def depth(_: float, y: np.ndarray) -> float:
        return float(y[-3] - u @ y[:n])

    def closing(_: float, y: np.ndarray) -> float:
        return float(y[-2] - u @ y[n : 2 * n])

    def flow(_: float, y: np.ndarray) -> np.ndarray:
        force = contact.stiffness * max(depth(0.0, y), 0.0) ** contact.exponent if touching else 0.0
        p = y[n : 2 * n]
        return np.concatenate([p, u * force - omega**2 * y[:n] - damping * p, [y[-2], -force / mass, force]])

    depth.terminal = True  # type: ignore[attr-defined]
    while now < end:
        depth.direction = -1.0 if touching else 1.0  # type: ignore[attr-defined]
        step = np.inf if touching else 0.1 / omega[-1]  # in flight two crossings in one step would be missed
        run = solve_ivp(
            flow, (now, end), state, "DOP853", events=(depth, closing), max_step=step, rtol=1e-11, atol=1e-15
        )
        now, state = float(run.t[-1]), run.y[:, -1]
        if touching:
            deepest = max(depth(0.0, y) for y in (*run.y.T, *run.y_events[1]))
            peak = max(peak, contact.stiffness * deepest**contact.exponent)
        if run.status:
            changes.append(now)
            touching = not touching
    impacts = np.reshape(changes[: len(changes) // 2 * 2], (-1, 2))
    return {
        "n_impacts": float(len(impacts)),
        "contact_time": float(np.diff(impacts).sum()),
        "peak_force": peak,
        "impulse": float(state[-1]),
        "restitution": -float(state[-2]) / hit.speed,
    }


def _followed(contact: Contact, mass: float) -> list[ReferenceLine]:
    at, end = (0.465, 0.3), 0.02
    plate = analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=20, damping_ratio=0.01)
    alone = Modes.from_arrays(
        plate.frequencies, plate.shape_at([at]), points=[at], mass=plate.mass, damping_ratio=plate.damping_ratio,
        complete=True,
    )  # fmt: skip
    hit = strike(alone, Striker.rigid(mass), contact, at=at, speed=1.0, tolerance=1e-7, duration=end)
    wanted = follow_by_dop853(hit, end)
    return of_blow(hit, wanted, {name: 1e-8 * value for name, value in wanted.items()})  # 1e-11 a step, over some 1e3


def _thresholds(name: str) -> list[ReferenceLine]:
    _, body, place = name.split("-")
    if body == "plate":
        modes = analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=3000)
        at = np.array([1.55 * float(place), 0.5])
    else:
        modes = analytic.beam(1.0, ends=("free", "free"), mass=0.2, first_frequency=100.0, n_modes=1000)
        at = np.array([float(place)])
    lines = []
    for grams, there in zip((1, 2, 5, 10, 20, 50, 100, 200), TABLE[name]["values"]):  # the hammers of the figures
        ours = threshold.threshold_frequency(modes, at, 1e-3 * grams) or 0.0
        lines.append(ReferenceLine(f"{grams} g hammer", "Hz", there, 1e-3 * there, ours, 0.0))  # of 3 or 4 digits known
    return lines


CASES = (
    Reference("wall-linear", partial(_wall, Contact.linear(88.6e3))),
    Reference("wall-hertz", partial(_wall, Contact.hertz(695e3))),
    Reference("wall-felt", partial(_wall, Contact(1e8, 2.5))),
    Reference("wall-hunt-crossley", partial(_wall, Contact.hertz(695e3, loss=0.3))),
    Reference("two-masses", _masses),
    Reference("endless-plate-soft", partial(_endless, 2.2e4)),
    Reference("endless-plate-hard", partial(_endless, 4.1e5)),
    Reference("sdnl32", _sdnl32),
    Reference("timoshenko-ball", _timoshenko),
    Reference("dop853-linear", partial(_followed, Contact.linear(1e6), 0.1 / 3.0)),
    Reference("dop853-hertz", partial(_followed, Contact.hertz(695e3), 0.1 / 3.0)),
    Reference("dop853-light", partial(_followed, Contact.hertz(1e7), 5e-3)),
    *(Reference(name, partial(_thresholds, name)) for name in TABLE if name.startswith("threshold-")),
)
