"""Bodies that a user has assembled are planned and struck like scenes, whatever they are made of."""

import numpy as np
import pytest
from comparing import difference
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.model.target import Target

ALUMINIUM = fi.Material(E=70e9, nu=0.33, rho=2700.0)
STICK = fi.Striker.stick(0.1, 1000.0)
SOFT = fi.Contact.linear(88.6e3)


def wedge(points):
    return 2e-3 + 4e-3 * points[:, 0]


def springy_plate():
    held = {"left": fi.Elastic(2e5, 40.0), "right": "hinged"}
    mesh = fi.mesh.rectangle(0.5, 0.3)
    return fi.assemble(mesh, fi.Plate(ALUMINIUM, wedge), held, point_masses=[((0.1, 0.2), 0.05)]), (0.31, 0.12)


def drumhead():
    stretched = fi.Plate(ALUMINIUM, 2e-3, tension=1e5)
    return fi.assemble(fi.mesh.disk(0.16), stretched, {"boundary": "hinged"}), (0.05, 0.02)


def tapered_bar():
    beam = fi.Beam.rectangular(ALUMINIUM, width=0.04, height=lambda x: 8e-3 + 4e-3 * x[:, 0])
    return fi.assemble(fi.mesh.line(0.6), beam, {"left": fi.Elastic(1e4), "right": fi.Elastic(1e4)}), (0.2,)


@pytest.mark.parametrize("body", [pytest.param(springy_plate, marks=pytest.mark.slow), drumhead, tapered_bar])
def test_system_is_struck_as_its_modes_are(body):
    """The planner's choice against 120 modes of the same system, each within its own tolerance."""
    system, at = body()
    how = {"at": at, "speed": 1.0, "damping_ratio": 5e-3}
    hit = fi.strike(system, STICK, SOFT, **how, tolerance=1e-3)
    modes = fi.find_modes(system, n_modes=120, tolerance=1e-4, damping_ratio=5e-3)
    reference = fi.strike(modes, STICK, SOFT, at=at, speed=1.0, tolerance=1e-4)
    assert hit.bodies[-1].n_modes < 120 and reference.error.total < 3e-4
    assert difference(hit, reference) < 1e-3 + reference.error.total
    assert hit.n_impacts == reference.n_impacts
    assert_allclose(hit.target.damping_ratio[hit.target.omega > 0.0], 5e-3)


@pytest.mark.slow
def test_plan_of_objects_is_that_of_the_same_scene_and_runs(tmp_path):
    text = """
[mesh]
shape = "rectangle"
length = 0.5
width = 0.3
[material]
E = 70e9
nu = 0.33
rho = 2700.0
[section]
kind = "plate"
thickness = 3e-3
[supports]
left = "clamped"
[target]
damping_ratio = 0.005
[striker]
kind = "stick"
mass = 0.1
first_frequency = 1000.0
[contact]
kind = "linear"
stiffness = 88.6e3
[strike]
at = [0.31, 0.12]
speed = 1.0
tolerance = 1e-2
"""
    (tmp_path / "scene.toml").write_text(text)
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3), fi.Plate(ALUMINIUM, 3e-3), {"left": "clamped"})
    plan = fi.plan(
        system, STICK, SOFT, at=[0.31, 0.12], speed=1.0, tolerance=1e-2, damping_ratio=0.005
    )  # fmt: skip
    told = fi.plan(tmp_path / "scene.toml")
    assert plan.data() == told.data() and str(plan) == str(told)
    assert difference(plan.strike(), told.strike()) == 0.0
    assert plan.but(n_modes=30).strike().target.n_modes == 30


def test_given_modes_are_thinned_but_never_more_than_there_are():
    plate = fi.analytic.rectangle(0.5, 0.3, section=fi.Plate(ALUMINIUM, 3e-3), n_modes=400)
    how = {"at": (0.2, 0.1), "speed": 1.0, "tolerance": 1e-2}
    plan = fi.plan(plate, STICK, SOFT, **how)
    assert 20 <= plan.n_modes < 400 and plan.target == "modal" and plan.error < 1.1e-2
    assert difference(plan.strike(), fi.strike(plate, STICK, SOFT, **how)) < 2e-2
    few = fi.plan(plate.truncated(n_modes=10), STICK, SOFT, **{**how, "tolerance": 1e-6})
    assert few.n_modes == 10 and few.error > 1e-4  # said beforehand
    assert fi.strike(plate, STICK, SOFT, **how, n_modes=25).target.n_modes == 25


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"striker": 3}, "striker must be a Striker"),
        ({"contact": None}, "contact must be a Contact"),
        ({"at": (2.0, 0.1)}, "at must lie on the body"),
        ({"tolerence": 1e-3}, "tolerence is not an argument.*did you mean 'tolerance'"),
    ],
)
def test_wrong_arguments_are_named(changes, text):
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3), fi.Plate(ALUMINIUM, 3e-3), {"boundary": "hinged"})
    given = {"striker": STICK, "contact": SOFT, "at": (0.2, 0.1), "speed": 1.0, **changes}
    with pytest.raises((ValueError, TypeError), match=text):
        fi.plan(system, **given).strike()


def test_scene_takes_no_striker_of_its_own(tmp_path):
    with pytest.raises(ValueError, match="must be left out for a scene"):
        fi.plan(tmp_path / "scene.toml", STICK)


def test_closed_forms_are_known_by_the_mesh():
    plate = fi.Plate(ALUMINIUM, 3e-3)
    from fem_impact.modes.analytic import closed_form

    def formula(mesh, section, **held):
        found = closed_form(mesh, section, held)
        return None if found is None else found(n_modes=3).frequencies

    hinged = formula(fi.mesh.rectangle(0.5, 0.3), plate, boundary="hinged")
    assert_allclose(hinged, fi.analytic.rectangle(0.5, 0.3, section=plate, n_modes=3).frequencies)
    assert_allclose(
        formula(fi.mesh.disk(0.2).refined(2.0), plate, outer="clamped"),
        fi.analytic.disk(0.2, edge="clamped", section=plate, n_modes=3).frequencies,
    )
    rod = fi.Beam.circular(ALUMINIUM, diameter=0.01)
    assert_allclose(
        formula(fi.mesh.line(0.3), rod, left="clamped"),
        fi.analytic.beam(0.3, ends=("clamped", "free"), section=rod, n_modes=3).frequencies,
    )
    wood = fi.Material.orthotropic(E_along=11e9, E_across=0.7e9, nu=0.37, G=0.7e9, rho=420.0)
    for none in (
        formula(fi.mesh.rectangle(0.5, 0.3), plate, left="hinged"),
        formula(fi.mesh.rectangle(0.5, 0.3), fi.Plate(wood, 3e-3), boundary="hinged"),
        formula(fi.mesh.rectangle(0.5, 0.3), fi.Plate(ALUMINIUM, wedge), boundary="hinged"),
        formula(fi.mesh.rectangle(0.5, 0.3), fi.Plate(ALUMINIUM, 3e-3, tension=1e3), boundary="hinged"),
        formula(fi.mesh.disk(0.2, 0.05), plate, boundary="clamped"),
        formula(fi.mesh.disk(0.2), plate, boundary=fi.Elastic(1e4)),
        formula(fi.mesh.polygon([(0, 0), (1, 0), (0, 1)]), plate, boundary="hinged"),
        formula(fi.mesh.line(0.3), fi.Beam.circular(ALUMINIUM, diameter=wedge)),
    ):
        assert none is None
    assert np.all(hinged > 0.0)


@pytest.mark.parametrize("function", [fi.strike, fi.plan])
def test_a_system_that_only_checks_frequencies_is_not_struck_itself(function):
    plate = fi.assemble(
        fi.mesh.rectangle(0.4, 0.3), fi.Plate(ALUMINIUM, 2e-3), {"boundary": "hinged"}, element="morley"
    )
    with pytest.raises(ValueError, match="assemble it with 'argyris', or give its modes"):
        function(plate, STICK, SOFT, at=(0.1, 0.1), speed=1.0, tolerance=0.3)


@pytest.mark.parametrize("tension", [0.0, 1e3, 1e6])
@pytest.mark.parametrize("frequency", [50.0, 5e3])
def test_waves_obey_the_equation_of_a_stretched_plate(tension, frequency):
    """omega^2 times the mass per area is bending k^4 plus tension k^2."""
    plate = fi.Plate(ALUMINIUM, 2e-3, tension=tension)
    k = Target(fi.mesh.rectangle(0.5, 0.3), plate, {"boundary": "hinged"}).wave(frequency)
    bending = 70e9 * 2e-3**3 / (12.0 * (1.0 - 0.33**2))
    assert_allclose(bending * k**4 + tension * k**2, 2700.0 * 2e-3 * (2.0 * np.pi * frequency) ** 2, rtol=1e-12)
