"""Bodies known at points, and their equations of motion by DOP853, restarted wherever bodies touch or part."""

import numpy as np
from scipy.integrate import solve_ivp

import fem_impact as fi

TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-16}


def measured(n_modes, seed, damping=0.0, n_rigid=0, n_points=3):
    """A body known at some points, 0, 1, .., as from a modal test; no mode is left out."""
    rng = np.random.default_rng(seed)
    frequencies = np.sort(rng.uniform(100.0, 3000.0, n_modes))
    frequencies[:n_rigid] = 0.0
    shapes, points = rng.normal(0.0, 2.0, (n_points, n_modes)), np.arange(float(n_points))[:, None]
    return fi.Modes.from_arrays(frequencies, shapes, points=points, mass=0.3, damping_ratio=damping, complete=True)


def followed(rates, gaps, z, end, start=0.0, max_step=np.inf):
    """State at the end of ``rates(t, z)``, restarted where one of ``gaps(z)`` changes its sign."""

    def crossing(i):
        def gap(t, z):
            return gaps(z)[i]

        gap.terminal = True
        return gap

    events, time = [crossing(i) for i in range(len(gaps(z)))], start
    while time < end:
        off = solve_ivp(rates, (time, min(end, time + 1e-9 * (end - start))), z, **TIGHT)  # off the event
        time, z = off.t[-1], off.y[:, -1]
        if time < end:
            leg = solve_ivp(rates, (time, end), z, events=events, max_step=max_step, **TIGHT)
            time, z = leg.t[-1], leg.y[:, -1]
    return z
