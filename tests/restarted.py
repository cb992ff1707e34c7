"""Equations of motion followed by DOP853, restarted wherever bodies touch or part."""

import numpy as np
from scipy.integrate import solve_ivp

TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-16}


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
