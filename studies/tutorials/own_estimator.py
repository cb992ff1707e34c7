"""An estimator of your own: what a clamp that gives way a little does to a blow, counted in its stated error.

python studies/tutorials/own_estimator.py

Any second, poorer description of a body estimates an error: ``poorer`` names the part of the error, the blow is struck
with both, and the difference is that part. Here it is a spring in place of a clamp. The reference is the restitution
with the body as you fear it to be.
"""

from dataclasses import replace

import fem_impact as fi

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
SECTION, LENGTH = fi.Beam.rectangular(STEEL, width=0.02, height=4e-3), 0.2  # [m]
GIVES = 2000.0  # [N m/rad] how stiff the vice may be


def bar(left):
    """Modes of a bar held at its left end."""
    system = fi.assemble(fi.mesh.line(LENGTH), SECTION, {"left": left})
    return fi.find_modes(system, n_modes=40, damping_ratio=0.01)


def struck(modes):
    """A blow not far from the vice."""
    ball, tip = fi.Striker.rigid(0.02), fi.Contact.hertz(1e6)
    return fi.strike(modes, ball, tip, at=[0.3 * LENGTH], speed=0.5, max_impacts=1, tolerance=2e-2)


def main():
    """Restitution, that with the vice as feared, and the error stated [-]."""
    feared = bar(fi.Elastic(stiffness=1e8, rotation=GIVES))
    hit = struck(replace(bar("clamped"), poorer={"idealisation": feared}))
    known, stated = struck(feared).restitution, hit.error.of_quantity("restitution")
    part = hit.error.parts("restitution")["the simplified target"]
    print(
        f"restitution {hit.restitution:.5f}, feared {known:.5f}, stated to {stated:.0e}, {part:.0e} of it by the vice"
    )
    return hit.restitution, known, stated


if __name__ == "__main__":
    main()
