"""A theory of your own: Rayleigh's beam, which is that of Euler and Bernoulli with the inertia of rotation.

python studies/tutorials/own_theory.py

A `Theory` says which strains and motions hold energy, by terms; matrices, point masses, supports, modes and static
deflections follow. This one adds a term to a theory that is there, and the moments that this term balances to its
errors. The reference is the closed form of a hinged beam, ``w**2 (m + i k**2) = E I k**4``.
"""

from dataclasses import replace

import numpy as np

import fem_impact as fi
from fem_impact.fe import beam_elements, euler
from fem_impact.fe.theory import Term, unknowns_of_cells

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
SECTION, LENGTH, MODES = fi.Beam.rectangular(STEEL, width=0.02, height=0.05), 0.4, 6  # [m], [m], [-]


def terms(space, points, cells):
    """Those of a slender beam, and what the slope turns."""
    (slope,) = space.functions(cells, points.x[cells], (1,))
    return [*euler.terms(space, points, cells), Term("M", "rotary", slope[:, :, None])]


def errors(system, vectors, loads, forced=None):
    """Errors (3, n) of squared energies: the moments must balance the loads and what turns (Prager and Synge)."""
    space, x = system.space, beam_elements.quadrature(system.space)[0][..., None]
    value, slope, bend = space.functions(np.arange(len(x)), x, (0, 1, 2))
    own, load = unknowns_of_cells(system, vectors), unknowns_of_cells(system, loads)
    stiffness, inertia, rotary = (system.frame.field(system.section, name, x) for name in RAYLEIGH.fields)
    turned = beam_elements.integral_along(space, -rotary[..., None] * (slope @ load))
    carried = inertia[..., None] * (value @ load)
    return np.outer([1.0, 0.0, 0.0], beam_elements.energy_errors(space, stiffness, bend @ own, carried, turned))


RAYLEIGH = replace(
    euler.EULER, name="rayleigh", terms=terms, errors=errors, fields=("stiffness", "inertia", "rotary"), matrices=None
)


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
