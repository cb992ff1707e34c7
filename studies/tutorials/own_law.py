"""A contact law of your own: foam that stiffens as its pores close, as any function of the approach.

python studies/tutorials/own_law.py

`fi.Contact.of` takes any force that only grows and keeps it as cubics in the compiled loops of all other laws: steps
conserve energy to rounding, maps and gradients work, and ``misfit`` tells how far the force kept differs from yours.
The reference is the same blow by SciPy's integrator, with the function itself.
"""

import numpy as np
from scipy.integrate import solve_ivp

import fem_impact as fi

MASS, SPEED, LOSS = 0.05, 0.8, 0.1  # [kg], [m/s], [s/m]


def foam(approach):
    """Force [N] at approaches [m]: twice as stiff every 0.7 mm."""
    return 20.0 * np.expm1(approach / 1e-3)


def rates(_, state):
    """Speed and acceleration of the mass on a wall."""
    return [state[1], -foam(max(state[0], 0.0)) * (1.0 + LOSS * state[1]) / MASS]


def opens(_, state):
    """Zero as the contact opens."""
    return state[0]


opens.terminal, opens.direction = True, -1


def main():
    """Contact time [s], the reference, and the error stated [-]."""
    law = fi.Contact.of(foam, deepest=5e-3, loss=LOSS)
    hit = fi.strike(fi.Modes.rigid(1e9), fi.Striker.rigid(MASS), law, at=None, speed=SPEED, tolerance=1e-6)
    known = solve_ivp(rates, (0.0, 1.0), [0.0, SPEED], events=opens, rtol=1e-11, atol=1e-13).t[-1]
    stated = hit.error.of_quantity("contact_time") + law.misfit
    print(f"contact time {1e3 * hit.contact_time:.5f} ms, SciPy {1e3 * known:.5f} ms, stated to {stated:.0e}")
    return hit.contact_time, known, stated


if __name__ == "__main__":
    main()
