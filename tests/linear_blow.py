"""A blow through one linear spring between undamped bodies, solved by the eigenvectors of the joined bodies."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

LOOKS = 12.0  # [-] per period of the fastest motion that is looked at for an onset or a release


@dataclass(frozen=True)
class Blow:
    """What came of it: (start, end, impulse, largest force) of each impact, and the modal velocities at the end."""

    impacts: np.ndarray  # (n_impacts, 4)
    p: np.ndarray  # (n_modes,)

    @property
    def contact_time(self):
        return float(np.sum(self.impacts[:, 1] - self.impacts[:, 0]))


def first_zero(value, step, end, falling):
    """First time in (0, end) at which a function changes its sign in the given sense; None where it does not."""
    low = 0.0
    while low < end:
        times = low + step * np.arange(1, 4097)
        values = value(times)
        found = np.flatnonzero(values < 0.0 if falling else values > 0.0)
        if found.size and times[found[0]] < end:
            at = times[found[0]]
            one = lambda t: float(value(np.array([t]))[0])  # noqa: E731
            return brentq(one, max(at - step, 1e-3 * step), at, xtol=1e-18, rtol=1e-15)
        low = times[-1]
    return None


def exact(history, *, wait):
    """Follow a history's blow from its start; no new impact is looked for later than ``wait`` [s] after a release."""
    w, u, (k, _, _, compliance, *_) = history.omega, history.shape[0], history.law.tolist()[0]
    k = k / (1.0 + k * compliance)
    square, vectors = np.linalg.eigh(np.diag(w**2) + k * np.outer(u, u))
    rate = np.sqrt(square.clip(0.0))
    seen = vectors.T @ u
    q, p, time, impacts = history.start_q.copy(), history.start_p.copy(), 0.0, []

    def motion(frequency, x, v, t):
        """Positions and velocities (n_modes, n_times)."""
        angle = np.multiply.outer(frequency, t)
        sine = t * np.sinc(angle / np.pi)
        return x[:, None] * np.cos(angle) + v[:, None] * sine, (
            v[:, None] * np.cos(angle) - (frequency**2 * x)[:, None] * sine
        )

    while True:
        x, v = vectors.T @ q, vectors.T @ p
        step = 2.0 * np.pi / LOOKS / rate[np.abs(seen) > 1e-9 * np.abs(seen).max()].max()
        end = first_zero(lambda t, x=x, v=v: seen @ motion(rate, x, v, t)[0], step, np.inf, True)
        looks = np.linspace(0.0, end, 20001)
        force = k * (seen @ motion(rate, x, v, looks)[0])
        top = force.argmax()
        around = np.polynomial.Polynomial.fit(looks[top - 2 : top + 3], force[top - 2 : top + 3], 4)
        fine = around(np.linspace(looks[top - 1], looks[top + 1], 2001)).max()
        x, v = (part[:, 0] for part in motion(rate, x, v, np.array([end])))
        q, before = vectors @ x, p
        p = vectors @ v
        rigid = np.flatnonzero(w == 0.0)[0]
        impacts.append((time, time + end, (before[rigid] - p[rigid]) / u[rigid], fine))
        time += end
        step = 2.0 * np.pi / LOOKS / max(w.max(), 1.0)
        start = first_zero(lambda t, q=q, p=p: u @ motion(w, q, p, t)[0], step, wait, False)
        if start is None:
            return Blow(np.array(impacts), p)
        q, p = (part[:, 0] for part in motion(w, q, p, np.array([start])))
        time += start
