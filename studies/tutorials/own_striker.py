"""A striker of your own: a soft head on a core, as two masses and a spring of which you know the modes.

python studies/tutorials/own_striker.py

Whatever has modes can strike: `fi.Striker.flexible` takes those of a finite element program, of a test or of your own
few masses, as here, where ``complete=True`` says that there are no others. The reference integrates the two masses.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

import fem_impact as fi

HEAD, CORE, BETWEEN, TIP, SPEED = 0.01, 0.03, 4e4, 2e4, 1.0  # [kg], [kg], [N/m], [N/m], [m/s]
M, K = np.diag([HEAD, CORE]), BETWEEN * np.array([[1.0, -1.0], [-1.0, 1.0]])


def rates(_, state):
    """Speeds and accelerations of head and core; only the head meets the wall."""
    push = np.array([-TIP * max(state[0], 0.0), 0.0])
    return [*state[2:], *np.linalg.solve(M, push - K @ state[:2])]


def opens(_, state):
    """Zero as the head leaves the wall."""
    return state[0]


opens.terminal, opens.direction = True, -1


def main():
    """Contact time [s], the reference, and the error stated [-]."""
    squares, shapes = eigh(K, M)  # mass-normalised
    frequencies = [0.0, squares[1] ** 0.5 / (2.0 * np.pi)]
    modes = fi.Modes.from_arrays(frequencies, shapes, points=[(0.0,), (0.02,)], mass=HEAD + CORE, complete=True)
    striker = fi.Striker.flexible(modes, at=[0.0])
    hit = fi.strike(
        fi.Modes.rigid(1e9), striker, fi.Contact.linear(TIP), at=None, speed=SPEED, tolerance=1e-6, max_impacts=1
    )
    start = [0.0, 0.0, SPEED, SPEED]
    known = solve_ivp(rates, (0.0, 1.0), start, events=opens, rtol=1e-11, atol=1e-13).t[-1]
    stated = hit.error.of_quantity("contact_time")
    print(f"contact time {1e3 * hit.contact_time:.5f} ms, SciPy {1e3 * known:.5f} ms, stated to {stated:.0e}")
    return hit.contact_time, known, stated


if __name__ == "__main__":
    main()
