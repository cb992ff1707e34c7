"""Blows with contacts that yield, have two layers or are felt, by scipy's Runge-Kutta method with located events.

Written from the laws alone, without the package: the truth for `test_lossy_contacts.py`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp


@dataclass
class Found:
    """What a blow ended with."""

    speeds: np.ndarray  # (n_modes,) modal velocities after the last separation
    impulse: float  # [N s]
    contact_time: float  # [s]
    peak: float  # [N]
    lost: float  # [J]
    pieces: int  # [-] between events


def blow(omega, zeta, row, start_p, law, until, rtol=1e-12):
    """Follow modes (n_modes,) with the shapes ``row`` at the contact: the approach is row @ q; no gap, no forces.

    ``law`` holds a kind and its numbers: ("layers", k, a, depth, k2, a2), ("plastic", k, a, first, reach, steeper) or
    ("felt", k, a, share, time). The state is q, p, impulse and, for felt, its memory.
    """
    omega, zeta, row = (np.asarray(x, float) for x in (omega, zeta, row))
    n = len(omega)
    kind, k, a, *more = law
    deepest = more[0] if kind == "plastic" else 0.0  # [m]

    def yielding(d):
        """Force beyond first yield: its slope falls short of the last one as exp(-approach / reach)."""
        x, reach = more[0], more[1] * more[0]
        over = max(d - x, 0.0)
        short = reach * (1.0 - np.exp(-over / reach))
        return k * x**a + a * k * x ** (a - 1.0) * (more[2] * over - (more[2] - 1.0) * short), over - short

    def unloading():
        """Force at the deepest approach, and the approach taken back from there."""
        force, wider = yielding(deepest)
        return force, force / (k * (deepest + wider) ** (a - 1.0))

    def force(state, phase):
        d = row @ state[:n]
        if phase == "free":
            return 0.0
        if kind == "layers":
            return k * abs(d) ** a * np.sign(d) + (more[1] * abs(d - more[0]) ** more[2] if phase == "hard" else 0.0)
        if kind == "felt":
            return k * (abs(d) ** a * np.sign(d) - more[0] * state[-1])
        if phase == "yields":
            return yielding(d)[0]
        at, back = unloading()
        x = (d - deepest + back) / back
        return at * abs(x) ** a * np.sign(x)

    def rates(t, state, phase):
        f = force(state, phase)
        q, p = state[:n], state[n : 2 * n]
        d = row @ q
        out = np.empty_like(state)
        out[:n] = p
        out[n : 2 * n] = -2.0 * zeta * omega * p - omega**2 * q - row * f
        out[2 * n] = f
        if kind == "felt":
            g, z = max(d, 0.0) ** a, state[-1]
            if phase == "free":
                g = more[0] * z
            out[-1] = (g - z) / more[1]
        else:
            out[-1] = 0.0
        return out

    def surface(state):
        """Approach at which the body meets the contact."""
        if kind == "felt":
            return (more[0] * max(state[-1], 0.0)) ** (1.0 / a)
        if kind == "plastic":
            return deepest - unloading()[1]
        return 0.0

    def gap(t, state, phase):
        return row @ state[:n] - surface(state)

    def pull(t, state, phase):
        return force(state, "presses")

    def rate(t, state, phase):
        return row @ state[n : 2 * n]

    def deeper(t, state, phase):
        return row @ state[:n] - (deepest if kind == "plastic" else more[0])

    state, t, phase = np.concatenate([np.zeros(n), start_p, np.zeros(2)]), 0.0, "presses"
    times, peak, pieces, began = 0.0, 0.0, 0, 0.0
    while t < until:
        if phase == "free":
            events = [("presses", gap, 1)]
        elif phase == "yields":
            events = [("turns", rate, -1)]
        else:
            events = [("free", pull if kind == "felt" else gap, -1)] if phase == "presses" else []
            if kind == "plastic":
                events.append(("yields", deeper, 1))
            if kind == "layers":
                events.append(("presses" if phase == "hard" else "hard", deeper, -1 if phase == "hard" else 1))
        for _, event, direction in events:
            event.terminal, event.direction = True, direction
        scale = np.abs(state).max()
        found = solve_ivp(
            rates, (t, until), state, "DOP853", args=(phase,), rtol=rtol, atol=1e-15 * scale * 1e-3,
            events=[event for _, event, _ in events], dense_output=True,
        )  # fmt: skip
        pieces += 1
        if phase != "free":
            looks = np.linspace(t, found.t[-1], 4001)
            peak = max(peak, max(force(s, phase) for s in found.sol(looks).T))
        t, state = found.t[-1], found.y[:, -1]
        which = next((i for i, at in enumerate(found.t_events) if len(at)), None)
        if which is None:
            break
        new = events[which][0]
        if new == "free":
            times += t - began
        elif phase == "free":
            began = t
        if new == "turns":
            deepest, new = row @ state[:n], "presses"
        phase = new
    q, p = state[:n], state[n : 2 * n]
    lost = 0.5 * float(start_p @ start_p - p @ p - (omega * q) @ (omega * q))
    return Found(p, state[2 * n], times, peak, lost, pieces)
