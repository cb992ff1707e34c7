"""A theory of your own: Rayleigh's beam, which is that of Euler and Bernoulli with the inertia of rotation.

python studies/tutorials/own_theory.py

A `Theory` says which strains and motions hold energy, by terms; matrices, point masses, supports, modes and static
deflections follow. This one adds a term to a theory that is there, whose estimate of errors counts what the term
balances. The reference is the closed form of a hinged beam, ``w**2 (m + i k**2) = E I k**4``.
"""

from dataclasses import replace

import numpy as np

import fem_impact as fi
from fem_impact.fe import euler
from fem_impact.fe.theory import Term

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
SECTION, LENGTH, MODES = fi.Beam.rectangular(STEEL, width=0.02, height=0.05), 0.4, 6  # [m], [m], [-]


def terms(space, points, cells):
    """Those of a slender beam, and what the slope turns."""
    (slope,) = space.functions(cells, points.x[cells], (1,))
    return [*euler.terms(space, points, cells), Term("M", "rotary", slope[:, :, None])]


# the estimate of errors of beams (Prager and Synge) counts what turns by itself, as "rotary" is among the fields
RAYLEIGH = replace(euler.EULER, name="rayleigh", terms=terms, fields=("stiffness", "inertia", "rotary"), matrices=None)


def main():
    """Highest frequency [Hz], the closed form, and the error stated [-]."""
    held = {"left": "hinged", "right": "hinged"}
    system = fi.assemble(fi.mesh.line(LENGTH), SECTION, held, theory=RAYLEIGH)
    modes = fi.find_modes(system, n_modes=MODES)
    area, second = 0.02 * 0.05, 0.02 * 0.05**3 / 12.0
    k = MODES * np.pi / LENGTH
    known = np.sqrt(STEEL.E * second * k**4 / (STEEL.rho * (area + second * k**2))) / (2.0 * np.pi)
    found, stated = modes.frequencies[-1], modes.frequency_error[-1]
    slender = fi.find_modes(fi.assemble(fi.mesh.line(LENGTH), SECTION, held), n_modes=MODES).frequencies[-1]
    print(f"mode {MODES} {found:.6f} Hz, closed form {known:.6f} Hz, stated to {stated:.0e}; slender {slender:.0f} Hz")
    return found, known, stated


if __name__ == "__main__":
    main()
