"""Blows by Ritz vectors against closed forms: within tolerance, honestly estimated, late impacts included."""

import warnings

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.model import planner

WOOD = fi.Material(E=10e9, nu=0.3, rho=450.0)


def compared(kind, thickness, mass_ratio, pitch, tolerance, law, at, speed=1.0, **more):
    """A blow by vectors and by closed-form modes: (vectors, truth); ``pitch`` is contact resonance over first mode."""
    mesh = fi.mesh.rectangle(0.465, 0.3) if kind == "rectangle" else fi.mesh.disk(0.2)
    supports = {"boundary": "hinged" if kind == "rectangle" else kind}
    plate = fi.Plate(WOOD, thickness=thickness)
    closed = fi.analytic.closed_form(mesh, plate, supports)
    few = closed(n_modes=20)
    resonance = pitch * few.frequencies[few.omega > 0.0][0]
    mass = mass_ratio * few.mass
    if law == "linear":
        contact = fi.Contact.linear(mass * (2.0 * np.pi * resonance) ** 2)
    else:  # the duration of a Hertz contact on a wall is 3.218 (m**2 / (k**2 v))**(1/5)
        contact = fi.Contact.hertz(mass / np.sqrt(speed) * (2.0 * 3.2180654597 * resonance) ** 2.5)
    blow = {"at": at, "speed": speed}
    body = fi.assemble(mesh, plate, supports)
    plan = planner.plan_of(body, fi.Striker.rigid(mass), contact, tolerance=tolerance, target="vectors", **blow, **more)
    run = plan.run()
    modes = closed(max_frequency=max(60.0 * resonance, few.frequencies[-1]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)  # the truth's own claim is ten times stricter than needed
        truth = fi.strike(
            modes,
            fi.Striker.rigid(mass),
            contact,
            tolerance=tolerance / 20.0,
            max_impacts=run.response.n_impacts + 2,
            **blow,
        )
    return run, truth


def missed(hit, truth):
    relative = (
        abs(getattr(hit, name) / getattr(truth, name) - 1.0) for name in ("impulse", "contact_time", "peak_force")
    )
    return 1.0 if hit.n_impacts != truth.n_impacts else max(abs(hit.restitution - truth.restitution), *relative)


@pytest.mark.parametrize(
    ("kind", "thickness", "mass_ratio", "pitch", "tolerance", "law", "at"),
    [
        ("rectangle", 1.2e-3, 0.005, 3.2, 2e-3, "linear", (0.024, 0.235)),
        ("hinged", 3e-3, 0.8, 9.6, 5e-2, "hertz", (-0.12, -0.013)),  # four impacts
        ("free", 1.2e-3, 0.15, 1.2, 4e-4, "linear", (0.041, -0.095)),
        ("clamped", 1.3e-3, 0.05, 10.0, 2e-3, "hertz", (-0.142, -0.059)),
        ("free", 2e-3, 0.05, 8.0, 1e-2, "hertz", (0.19, 0.0)),  # near the rim
    ],
)
def test_blow_is_that_of_all_modes(kind, thickness, mass_ratio, pitch, tolerance, law, at):
    run, truth = compared(kind, thickness, mass_ratio, pitch, tolerance, law, at)
    hit = run.response
    assert hit.tolerance_met and missed(hit, truth) <= float(hit.error)
    assert run.plan.target == "vectors" and hit.finished and hit.energy_error < 1e-12


@pytest.mark.slow
def test_late_impact_is_not_overlooked():
    """With 52 vectors three impacts look final; the fourth comes when the vectors have stopped telling the echo."""
    run, truth = compared("clamped", 3.98e-3, 0.0193, 34.6, 8.8e-2, "hertz", (-0.007, 0.085))
    assert run.response.n_impacts == truth.n_impacts == 4
    assert missed(run.response, truth) <= float(run.response.error) <= 8.8e-2
