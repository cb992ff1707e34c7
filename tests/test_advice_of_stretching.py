"""Every message about stretching that gives advice: following it works."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from comparing import stretched

import fem_impact as fi

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
PLATE, BAR = fi.Plate(STEEL, 1e-3), fi.Beam.rectangular(STEEL, width=0.02, height=3e-3)
SIDES, AT, ON_BAR = (0.2, 0.3), (0.09, 0.13), 0.12
ALL_ROUND = {"boundary": "hinged"}


def blow(modes, stretching=True, **how):
    how = {"at": (None, ON_BAR, AT)[modes.dimension], **how}
    law = fi.Contact.linear(1e5)
    return fi.strike(modes, fi.Striker.rigid(0.1), law, speed=1.0, tolerance=1e-2, stretching=stretching, **how)


linear = partial(blow, stretching=False)


def plate(n_modes=20):
    return fi.analytic.rectangle(*SIDES, section=PLATE, n_modes=n_modes)


def together(body):
    touch = fi.Touch(fi.Contact.linear(1e5), 0, 1, [0.0, 0.0], AT)
    return fi.collide([fi.Modes.rigid(0.1), body], [touch], speeds=[1.0, 0.0], tolerance=1e-2)


def scaled():
    return fi.analytic.rectangle(*SIDES, mass=0.5, first_frequency=100.0, n_modes=20)


def measured():
    """Modes at one point, whose section was added by hand."""
    body, points = plate(), [AT, (0.05, 0.2)]
    known = fi.Modes.from_arrays(body.frequencies, body.shape_at(points), points=points, mass=body.mass, complete=True)
    return replace(known, section=PLATE)


def elements(supports=ALL_ROUND, element=None, in_plane=None):
    system = fi.assemble(fi.mesh.rectangle(*SIDES, size=0.1), PLATE, supports, element, in_plane=in_plane)
    return fi.find_modes(system, n_modes=8)


def bar(*ends, theory="euler"):
    return fi.analytic.beam(0.3, ends=ends, section=BAR, n_modes=12, theory=theory)


def strip(right):
    system = fi.assemble(fi.mesh.line(0.3), BAR, {"left": "clamped", "right": right})
    return fi.find_modes(system, n_modes=8)


def disk(edge):
    return fi.analytic.disk(0.2, edge=edge, section=PLATE, n_modes=20)


# a blow that is refused, a pattern of its message, and blows that follow it
# fmt: off
STRETCHING = {
    "a mass": (lambda: blow(fi.Modes.rigid(1.0)), r", but (?:a mass has none|\{\}); leave it out$",
     [lambda: linear(fi.Modes.rigid(1.0))]),
    "a scaled plate": (lambda: blow(scaled()), r", but (?:its section is not known|\{\}); leave it out$",
     [lambda: linear(scaled())]),
    "a disk that only moves rigidly": (lambda: blow(disk("free").truncated(n_modes=3)),
     ", but it has no mode that bends; leave it out$", [lambda: linear(disk("free").truncated(n_modes=3))]),
    "modes at points": (lambda: blow(measured()), ", but its shapes are known at points only; leave it out$",
     [lambda: linear(measured())]),
    "a plate on springs": (lambda: blow(elements({"boundary": fi.Elastic(1e6, 0.0)})),
     r"(?:its edge is elastic, which does not say how .*|\{\}); say so with in_plane, hold it, or leave .* out$",
     [lambda: blow(elements({"boundary": fi.Elastic(1e6, 0.0)}, in_plane={"boundary": "free"})),
      lambda: blow(elements()), lambda: linear(elements({"boundary": fi.Elastic(1e6, 0.0)}))]),
    "elements without slopes": (lambda: blow(elements(element="morley")),
     "does not work with element 'morley'; take 'argyris', or leave stretching out$",
     [lambda: blow(elements(element="argyris")), lambda: linear(elements(element="morley"))]),
    "a cantilever": (lambda: blow(bar("clamped", "free")), ", but an end is free; hold it, or leave stretching out$",
     [lambda: blow(bar("clamped", "hinged")), lambda: linear(bar("clamped", "free"))]),
    "a cantilever by elements": (lambda: blow(strip("free")), ", but an end is free; hold it, or leave stretching out$",
     [lambda: blow(strip("hinged")), lambda: linear(strip("free"))]),
    "a stout cantilever": (lambda: blow(bar("clamped", "free", theory="timoshenko")),
     ", but an end is free; hold it, or leave stretching out$",
     [
        lambda: blow(bar("clamped", "hinged", theory="timoshenko")),
        lambda: linear(bar("clamped", "free", theory="timoshenko")),
    ]),
    "several bodies": (lambda: together(replace(plate(), stretches=True)),
     "can only be struck once, by `fi.strike`; leave stretching out$",
     [lambda: blow(replace(plate(), stretches=True)), lambda: together(plate())]),
}
# fmt: on


@pytest.mark.parametrize("name", STRETCHING)
def test_bodies_and_schemes_that_cannot_stretch_are_refused(name):
    wrong, words, _ = STRETCHING[name]
    with pytest.raises(ValueError, match=words):
        wrong()


@stretched
@pytest.mark.parametrize("name", STRETCHING)
def test_following_the_advice_works(name):
    _, words, right = STRETCHING[name]
    hits = [follow() for follow in right]
    assert all(hit.n_impacts and hit.finished for hit in hits)
    assert any(hit.history.stretched is None for hit in hits) == ("leave" in words)
    assert any(hit.history.stretched is not None for hit in hits) == ("leave it out" not in words)


@stretched
def test_steps_too_long_to_settle_are_shortened():
    """A run halves them; the motion splits those in which only the contact let the stretching forces settle."""

    def moved(**how):
        hit = fi.strike(
            plate(8), fi.Striker.rigid(5.0), fi.Contact.linear(1e6), at=AT, speed=3.0, duration=0.01, residual=False,
            stretching=True, **how
        )  # fmt: skip
        return hit.modal_state(np.linspace(0.0, 0.012, 50))[0]

    fine = moved(dt=1e-5)
    for how in ({"dt": 1e-3}, {"dt": 1e-4}, {"tolerance": 0.1}, {"tolerance": 1e-4}):
        # steps as long as the contact lets the plate ring otherwise, but as far
        bound = 2e-2 if how in ({"dt": 1e-4}, {"tolerance": 1e-4}) else 2.0
        assert np.abs(moved(**how) - fine).max() < bound * np.abs(fine).max()
