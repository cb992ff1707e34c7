"""Compares with Code_Aster's test case SDNL32: a stick, hinged at one end, hits a linear stop with its free end.

    python studies/verification/sdnl32.py

prints the displacement of the tip next to the published values and fails if any differs by more than 0.04 mm.
"""

import numpy as np

import fem_impact as fi
from fem_impact.impact.collision import Touch

# Code_Aster V5.02.032, test case SDNL32: displacement of the tip [mm] at 1 ... 12 ms.
PUBLISHED = np.array([-2.66, -4.33, -4.92, -4.78, -3.82, -2.87, -2.71, -3.09, -3.41, -3.36, -2.64, -0.742])
TIMES = 1e-3 * np.arange(1, 13)
ACCEPTED = 0.04e-3  # [m] largest difference of the published run from Euler-Bernoulli theory
LENGTH, SIDE, SPIN = 0.783, 14e-3, 3.8  # [m], [m], [rad/s]
STOP = 18e3  # [N/m]


def tip_displacement(n_modes: int = 40) -> np.ndarray:
    """Displacement of the tip [m] at the published times, positive away from the stop, (12,)."""
    beam = fi.Beam.rectangular(fi.Material(E=67e9, nu=0.0, rho=2400.0), width=SIDE, height=SIDE)
    system = fi.assemble(fi.mesh.line(LENGTH), beam, supports={"left": "hinged"})
    stick = fi.find_modes(system, n_modes=n_modes, damping_ratio=0.01)
    stop = Touch(fi.Contact.linear(STOP), first=0, second=None, first_at=LENGTH)
    hit = fi.collide([stick], [stop], speeds=[SPIN * LENGTH], tolerance=1e-6, duration=TIMES[-1])
    return -hit.displacement([LENGTH], TIMES, body=0)[:, 0]


def main() -> None:
    """Print the comparison; exit with a message if it fails."""
    computed = tip_displacement()
    print("time [ms]  published [mm]  computed [mm]  difference [mm]")
    for time, reference, value in zip(TIMES, PUBLISHED, computed):
        print(f"{time * 1e3:9.0f}  {reference:14.3f}  {value * 1e3:13.3f}  {value * 1e3 - reference:15.3f}")
    worst = float(np.abs(computed - 1e-3 * PUBLISHED).max())
    print(f"largest difference {worst * 1e3:.4f} mm, accepted {ACCEPTED * 1e3:g} mm")
    if worst > ACCEPTED:
        raise SystemExit("SDNL32 fails: the difference is too large")


if __name__ == "__main__":
    main()
