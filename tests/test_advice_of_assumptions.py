"""Every remedy of an assumption: following it makes the assumption known and fine, or its effect smaller."""

import re
from dataclasses import replace
from functools import cache, partial

import pytest
from comparing import examined

import fem_impact as fi
from fem_impact.impact import assumption

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0, yield_strength=1e9)
SILENT = replace(STEEL, yield_strength=None)  # on its strength
SPRUCE = fi.Material(E=10e9, nu=0.3, rho=450.0)
BALL = fi.Striker.sphere(STEEL, 5e-3)
SIDES = 0.4, 0.3


def plate(thickness=5e-3, material=STEEL, n_modes=60, damping_ratio=0.01):
    section = fi.Plate(material, thickness)
    return fi.analytic.rectangle(*SIDES, section=section, n_modes=n_modes, damping_ratio=damping_ratio)


def scaled():
    return fi.analytic.rectangle(*SIDES, mass=4.7, first_frequency=210.0, n_modes=60, damping_ratio=0.01)


def mindlin():
    system = fi.assemble(
        fi.mesh.rectangle(*SIDES, size=0.1), fi.Plate(STEEL, 5e-3), {"boundary": "hinged"}, theory="mindlin"
    )
    return fi.find_modes(system, n_modes=30, damping_ratio=0.01)


def bar(theory="euler"):
    section = fi.Beam.rectangular(STEEL, width=0.03, height=0.02)
    ends = ("free", "free")
    return fi.analytic.beam(0.3, ends=ends, section=section, n_modes=14, damping_ratio=0.01, theory=theory)


def rod(theory="euler", damping_ratio=0.01):
    """A wooden rod that strikes with its free end."""
    section, ends = fi.Beam.circular(fi.Material(E=12e9, nu=0.3, rho=600.0), diameter=0.03), ("hinged", "free")
    how = {"section": section, "n_modes": 16, "damping_ratio": damping_ratio, "theory": theory}
    return fi.Striker.flexible(fi.analytic.beam(0.4, ends=ends, **how), at=0.4)


def blow(target=None, striker=BALL, law=None, *, speed=0.05, at=(0.12, 0.1), **how):
    target = plate() if target is None else target
    law = fi.Contact.between(striker, STEEL) if law is None else law
    return fi.strike(target, striker, law, at=at, speed=speed, tolerance=1e-2, **how)


def club(across):
    """A rigid body whose contact point lies beside its centre of mass, and ahead of it."""
    return fi.Striker.turning(0.1, 5e-5, (across, 0.03))


@cache
def flapping():
    """A plate on springs that do not say how they hold its plane."""
    edges = {"left": "clamped", "right": fi.Elastic(1e6), "bottom": "hinged"}
    system = fi.assemble(fi.mesh.rectangle(*SIDES), fi.Plate(STEEL, 5e-4), edges)
    return fi.find_modes(system, n_modes=60, damping_ratio=0.01)


def elements(element="argyris"):
    body = fi.mesh.rectangle(*SIDES, size=0.1), fi.Plate(STEEL, 5e-4), {"boundary": "hinged"}
    return fi.find_modes(fi.assemble(*body, element=element), n_modes=12, damping_ratio=0.01)


quadratic = partial(elements, "morley")
on_bar = partial(blow, striker=fi.Striker.rigid(0.1), at=0.15, speed=1.0)
by_rod = partial(blow, law=fi.Contact.hertz(1e9), speed=1.0)
by_stick = partial(fi.Striker.stick, mass=0.05, first_frequency=500.0)
SOFT, LARGE = fi.Material(E=1e6, nu=0.4, rho=1100.0), fi.Striker.sphere(SILENT, 2e-2)


# the name begins with that of the assumption: a blow, a pattern of its remedy, and blows that follow it
# fmt: off
REMEDIES = {
    "thin target, a plate": (lambda: blow(), '^take a thick plate, theory = "mindlin", or a softer contact$',
     [lambda: blow(mindlin()), lambda: blow(law=fi.Contact.hertz(1e8))]),
    "thin target, a beam": (lambda: on_bar(bar(), law=fi.Contact.hertz(3e10)),
     '^take a thick beam, theory = "timoshenko", or a softer contact$',
     [lambda: on_bar(bar("timoshenko"), law=fi.Contact.hertz(3e10)), lambda: on_bar(bar(), law=fi.Contact.hertz(1e6))]),
    "thin target, scaled": (lambda: blow(scaled()),
     "^the thickness is not stated; give material and section instead of mass and first frequency$",
     [lambda: blow(plate(1e-3))]),
    "thin striker, a bar": (lambda: by_rod(striker=rod()),
     '^take a thick beam, theory = "timoshenko", or a softer contact$',
     [lambda: by_rod(striker=rod("timoshenko")), lambda: by_rod(striker=rod(), law=fi.Contact.hertz(1e5))]),
    "thin striker, a stick": (lambda: by_rod(striker=by_stick()),
     "^give the slenderness of a stick, or material and section of a bar$",
     [lambda: by_rod(striker=by_stick(slenderness=20.0)), lambda: by_rod(striker=rod("timoshenko"))]),
    "small deflections, large": (lambda: blow(plate(5e-4), speed=2.0),
     "^let it stretch, stretching = true, or take a softer blow or a thicker body$",
     [
        lambda: blow(plate(5e-4), speed=2.0, stretching=True),
        lambda: blow(plate(5e-4), speed=0.1),
        lambda: blow(plate(3e-3), speed=2.0),
    ]),
    "small deflections, beyond the thickness": (lambda: blow(plate(5e-4), speed=6.0),
     "^take a softer blow or a thicker body: stretching = true holds up to deflections of the thickness$",
     [lambda: blow(plate(5e-4), speed=0.1), lambda: blow(plate(6e-3), speed=6.0)]),
    "small deflections, an elastic edge": (lambda: blow(flapping(), speed=2.0),
     "^take a softer blow or a thicker body: stretching is not modelled$",
     [lambda: blow(flapping(), speed=0.1), lambda: blow(plate(3e-3), speed=2.0)]),
    "small deflections, a dent": (lambda: blow(plate(5e-4), speed=3.0, stretching=True),
     "^take a softer blow or a thicker body: local stretching is not modelled$",
     [lambda: blow(plate(5e-4), speed=0.1, stretching=True), lambda: blow(plate(3e-3), speed=2.0, stretching=True)]),
    "small deflections, elements without shear forces": (lambda: blow(quadratic(), speed=1.0),
     "^(?:take element 'argyris'|\\{\\}) and (?:let it stretch|\\{\\})",
     [lambda: blow(plate(5e-4, n_modes=7), speed=1.0, stretching=True), lambda: blow(quadratic(), speed=0.1)]),
    "thin target, elements without shear forces": (lambda: blow(quadratic()), "^take element 'argyris'$",
     [lambda: blow(elements())]),
    "small deflections, scaled": (lambda: blow(scaled()), "^give material and section$", [lambda: blow()]),
    "no yielding, a dent": (lambda: blow(speed=1.0),
     r"^take a contact that yields \(yield_strength of `Contact.between`, or elastic_plastic\), or a slower blow$",
     [
        lambda: blow(law=fi.Contact.between(BALL, STEEL, yield_strength=1e9), speed=1.0),
        lambda: blow(law=fi.Contact.elastic_plastic(1e10, yield_approach=2e-6), speed=1.0),
        lambda: blow(),
    ]),
    "no yielding, a mass": (lambda: blow(striker=fi.Striker.rigid(0.004), law=fi.Contact.hertz(1e10)),
     "^give the striker as a sphere with its material, and the contact between the two$", [lambda: blow()]),
    "no yielding, two unknown strengths": (lambda: blow(plate(material=SILENT), fi.Striker.sphere(SILENT, 5e-3)),
     "^state yield_strength of both materials$", [lambda: blow()]),
    "no yielding, one unknown strength": (lambda: blow(plate(material=SILENT)), "^state its yield_strength$",
     [lambda: blow()]),
    "local contact, wide": (lambda: blow(plate(2e-3), LARGE, speed=5.0),
     "^take a slower blow or a thicker body: Hertz's half space does not fit$",
     [lambda: blow(plate(2e-3), LARGE, speed=0.1), lambda: blow(plate(2e-2), LARGE, speed=5.0)]),
    "local contact, at the edge": (lambda: blow(at=(0.12, 1e-4)),
     "^strike farther from the edge: Hertz's half space does not fit$", [lambda: blow()]),
    "local contact, a mass": (lambda: blow(striker=fi.Striker.rigid(0.004), law=fi.Contact.hertz(1e10)),
     "^give the striker as a sphere with its material, and the contact between the two$", [lambda: blow()]),
    "local contact, scaled": (lambda: blow(scaled()), "^give material and section of the body$", [lambda: blow()]),
    "quasi-static contact, a soft ball": (
     lambda: blow(striker=fi.Striker.sphere(SOFT, 2e-2), law=fi.Contact.hertz(1e9), speed=5.0),
     "^take a striker with its own modes: a bar, or a flexible one$", [lambda: by_rod(striker=rod())]),
    "quasi-static contact, a mass": (lambda: blow(striker=fi.Striker.rigid(0.004), law=fi.Contact.hertz(1e9)),
     "^give it as a sphere or a bar$", [lambda: blow(), lambda: by_rod(striker=rod())]),
    "quasi-static contact, a head and its handle": (
     lambda: blow(striker=fi.Striker.hammer(0.03, 0.06, stiffness=2e4, damping=5.0), law=fi.Contact.hertz(1e9)),
     "^give it as a sphere or a bar$", [lambda: blow(), lambda: by_rod(striker=rod())]),
    "no friction, beside the centre of mass": (lambda: blow(striker=club(0.02), law=fi.Contact.hertz(1e8), speed=0.5),
     "^strike square to the surface, in line with the centre of mass: contacts here have no friction$",
     [lambda: blow(striker=club(0.0), law=fi.Contact.hertz(1e8), speed=0.5)]),
    "still air, a light plate": (lambda: blow(plate(1e-3, SPRUCE, 20), law=fi.Contact.hertz(1e7)),
     r'^take the modes in air: air = "both sides" under \[target\], or `fi\.in_air`$',
     [lambda: blow(fi.in_air(plate(1e-3, SPRUCE, 20)), law=fi.Contact.hertz(1e7))]),
    "still air, a beam of no known width": (
     lambda: on_bar(
        fi.analytic.beam(0.3, ends=("free", "free"), mass=1.4, first_frequency=1100.0, n_modes=14),
        law=fi.Contact.hertz(1e8),
    ),
     "^give material and section$", [lambda: on_bar(bar(), law=fi.Contact.hertz(1e8))]),
    "stated damping, a plate": (lambda: blow(plate(damping_ratio=0.0)),
     r"^state the damping ratio of the (?:struck body|\{\})$", [lambda: blow()]),
    "stated damping, a rod": (lambda: by_rod(striker=rod(damping_ratio=0.0)),
     "^state the damping ratio of the striker$", [lambda: by_rod(striker=rod())]),
}
# fmt: on


STRETCH = tuple(
    f"small deflections, {case}" for case in ("large", "a dent", "elements without shear forces")
)  # one worker compiles the kernels of stretching
MARKS = pytest.mark.slow, pytest.mark.xdist_group("stretched")


@pytest.mark.parametrize("name", [pytest.param(name, marks=MARKS if name in STRETCH else ()) for name in REMEDIES])
def test_following_the_remedy_mends_the_assumption(name):
    wrong, words, right = REMEDIES[name]
    before = examined(wrong(), name)
    assert not before.known or before.doubtful or before.worst > assumption.SILENT
    assert re.search(words, before.remedy), before.sentence
    for follow in right:
        after = examined(follow(), name)
        assert after.known, after.sentence
        assert not after.doubtful or (before.known and after.worst < 0.1 * before.worst), after.sentence
        assert not before.known or after.worst < before.worst, after.sentence
