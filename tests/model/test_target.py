"""Bodies that a user has assembled are planned and struck like scenes, whatever they are made of."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from comparing import difference
from numpy.testing import assert_allclose
from scenes import load_text

import fem_impact as fi
from fem_impact.fe import refinement
from fem_impact.impact.response import Error
from fem_impact.model.planner import Blow
from fem_impact.model.target import Stages, Target
from fem_impact.modes.analytic import closed_form

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
    scene = load_text(tmp_path, """
        mesh = { shape = "rectangle", length = 0.5, width = 0.3 }
        material = { E = 70e9, nu = 0.33, rho = 2700.0 }
        section = { kind = "plate", thickness = 3e-3 }
        supports = { left = "clamped" }
        target = { damping_ratio = 0.005 }
        striker = { kind = "stick", mass = 0.1, first_frequency = 1000.0 }
        contact = { kind = "linear", stiffness = 88.6e3 }
        strike = { at = [0.31, 0.12], speed = 1.0, tolerance = 1e-2 }
    """)  # fmt: skip
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3), fi.Plate(ALUMINIUM, 3e-3), {"left": "clamped"})
    plan = fi.plan(system, STICK, SOFT, at=[0.31, 0.12], speed=1.0, tolerance=1e-2, damping_ratio=0.005)
    told = scene.plan()
    assert plan.data() == told.data() and str(plan) == str(told)
    assert difference(plan.strike(), told.strike()) == 0.0
    assert plan.but(n_modes=30).strike().target.n_modes == 30


def test_given_modes_are_thinned_but_never_more_than_there_are():
    plate = fi.analytic.rectangle(0.5, 0.3, section=fi.Plate(ALUMINIUM, 3e-3), n_modes=400)
    how = {"at": (0.2, 0.1), "speed": 1.0, "tolerance": 1e-2}
    plan = fi.plan(plate, STICK, SOFT, **how)
    assert 20 <= plan.n_modes < 400 and plan.target == "modal" and plan.error < 1.1e-2
    assert difference(plan.strike(), fi.strike(plate, STICK, SOFT, **how)) < 2e-2
    few = fi.plan(plate.truncated(n_modes=10), STICK, SOFT, **how | {"tolerance": 1e-6})
    assert few.n_modes == 10 and few.error > 1e-4  # said beforehand
    assert fi.strike(plate, STICK, SOFT, **how, n_modes=25).target.n_modes == 25


@pytest.mark.parametrize(("changes", "text"), [
    ({"striker": 3}, "striker must be a Striker"),
    ({"contact": None}, "contact must be a Contact"),
    ({"at": (2.0, 0.1)}, "at must lie on the body"),
    ({"tolerence": 1e-3}, "tolerence is not an argument.*did you mean 'tolerance'"),
    ({"target": Path("scene.toml")}, "must be left out for a scene"),
])  # fmt: skip
def test_wrong_arguments_are_named(changes, text):
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3), fi.Plate(ALUMINIUM, 3e-3), {"boundary": "hinged"})
    given = {"striker": STICK, "contact": SOFT, "at": (0.2, 0.1), "speed": 1.0, **changes}
    with pytest.raises((ValueError, TypeError), match=text):
        fi.plan(given.pop("target", system), **given)


PLATE, ROD = fi.Plate(ALUMINIUM, 3e-3), fi.Beam.circular(ALUMINIUM, diameter=0.01)
WOOD = fi.Material.orthotropic(E_along=11e9, E_across=0.7e9, nu=0.37, G=0.7e9, rho=420.0)
OBLONG, DISK = fi.mesh.rectangle(0.5, 0.3), fi.mesh.disk(0.2)


@pytest.mark.parametrize(("mesh", "section", "held", "exact"), [
    (OBLONG, PLATE, {"boundary": "hinged"}, partial(fi.analytic.rectangle, 0.5, 0.3)),
    (DISK.refined(2.0), PLATE, {"outer": "clamped"}, partial(fi.analytic.disk, 0.2, edge="clamped")),
    (fi.mesh.line(0.3), ROD, {"left": "clamped"}, partial(fi.analytic.beam, 0.3, ends=("clamped", "free"))),
    (OBLONG, PLATE, {"left": "hinged"}, None), (OBLONG, fi.Plate(WOOD, 3e-3), {"boundary": "hinged"}, None),
    (OBLONG, fi.Plate(ALUMINIUM, wedge), {"boundary": "hinged"}, None),
    (OBLONG, fi.Plate(ALUMINIUM, 3e-3, tension=1e3), {"boundary": "hinged"}, None),
    (fi.mesh.disk(0.2, 0.05), PLATE, {"boundary": "clamped"}, None), (DISK, PLATE, {"boundary": fi.Elastic(1e4)}, None),
    (fi.mesh.polygon([(0, 0), (1, 0), (0, 1)]), PLATE, {"boundary": "hinged"}, None),
    (fi.mesh.line(0.3), fi.Beam.circular(ALUMINIUM, diameter=wedge), {}, None),
])  # fmt: skip
def test_closed_forms_are_known_by_the_mesh(mesh, section, held, exact):
    found = closed_form(mesh, section, held)
    assert (found is None) == (exact is None)
    assert exact is None or (found(n_modes=3).frequencies == exact(section=section, n_modes=3).frequencies).all()


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


SPRUCE = fi.Plate(fi.Material(10e9, 0.3, 450.0), 3e-3)


def modal(tolerance=1e-2, **of_target):
    """A hinged plate by its modes, as planned for a tolerance."""
    target = Target(fi.mesh.rectangle(0.4, 0.3), SPRUCE, {"boundary": "hinged"}, damping_ratio=0.01, **of_target)
    blow = Blow(target, fi.Striker.rigid(0.02), fi.Contact.hertz(1e7), {"at": (0.13, 0.1), "speed": 1.0})
    return blow.plan(tolerance=tolerance, target="modal").description


def after(description, **errors):
    """What a blow of these errors asks for."""
    return description.refined(
        SimpleNamespace(error=Error(**{"step": 0.0, "truncation": 0.0, "mesh": 0.0} | errors)), Stages()
    )


@pytest.mark.parametrize(("truncation", "more"), [(4e-5, False), (6e-5, True)])
def test_more_modes_are_taken_if_those_left_out_err_more_than_their_share(truncation, more):
    first = modal(tolerance=1e-4)
    better = after(first, truncation=truncation)
    assert (better is not None) == more
    if more:
        ratio = better.forecast.n_modes / first.forecast.n_modes
        assert ratio == pytest.approx(4.0 ** (1.0 / 3.0), rel=0.02)  # the error goes as the cube of the cutoff


def test_the_air_gets_smaller_cells_each_time_it_errs_too_much():
    """Its error goes as their area, and is to fall below the tolerance."""
    first = modal(air="both sides")
    second = after(first, mesh=2e-2)
    third = after(second, mesh=1.2e-2)
    assert (first.finer, second.finer) == (1.0, pytest.approx((2.0 / 0.9) ** 0.5))
    assert third.finer == pytest.approx(second.finer * (1.2 / 0.9) ** 0.5)
    assert after(modal(air="both sides", baffle=False), mesh=2e-2) is None  # whose error is that of the model


def test_another_model_of_a_body_has_the_modes_that_were_found():
    found, _ = modal().found(Stages())
    blow = found.asked.blow

    def with_model(**changes):
        other = replace(blow, target=blow.target.changed(**changes)).plan(tolerance=1e-2, target="modal").description
        return other.after(found).bare

    assert with_model(air="both sides") is with_model(stretching=True) is found.bare
    assert with_model(theory="mindlin") is None


def test_three_attempts_are_enough():
    third = after(after(modal(), truncation=1e-2), truncation=1e-2)
    assert after(third, truncation=1e-2) is None


@pytest.mark.parametrize(("length", "edge"), [(14.0, "free"), (28.5, "hinged")])
def test_modes_of_strips_are_counted_by_their_area(length, edge):
    """The first are those of a beam, or crowd about one half wave across."""
    target = Target.of(fi.assemble(fi.mesh.rectangle(length, 0.19), fi.Plate(ALUMINIUM, 0.01), {"boundary": edge}))
    first, limit = target.find(20, tolerance=0.05), 20e3
    k = np.pi * np.arange(1.0, 6.0) / 0.19  # across a hinged strip
    rate = (ALUMINIUM.plane_stress[0, 0] * 0.01**2 / 12.0 / ALUMINIUM.rho) ** 0.5
    along = np.sqrt(np.maximum(2.0 * np.pi * limit / rate - k**2, 0.0)) * length / np.pi
    assert 0.6 < target.number_below(first, limit) / along.sum() < 1.6
    assert target.number_below(first, 0.0) == 0.0  # of a force that reaches no frequency


@pytest.mark.parametrize(("h", "frequency"), [(0.05, 2.0), (0.05, 20.0), (0.2, 10.0)])
def test_modes_of_thick_plates_are_counted_with_those_of_their_thickness(h, frequency):
    """A hinged square, E = rho = 1, by three unknowns for each pair of half waves."""
    D, S, turn = h**3 / 12.0 / 0.91, h / 2.6 * 5.0 / 6.0, h**3 / 12.0
    a, b = np.meshgrid(*2 * [np.pi * np.arange(400)], indexing="ij")
    K = np.zeros((*a.shape, 3, 3))
    K[..., 0, 0], K[..., 0, 1], K[..., 0, 2] = (
        S * (a**2 + b**2) / h,
        -S * a / (h * turn) ** 0.5,
        -S * b / (h * turn) ** 0.5,
    )
    K[..., 1, 1] = (D * (a**2 + 0.35 * b**2) + S) / turn
    K[..., 2, 2] = (D * (b**2 + 0.35 * a**2) + S) / turn
    K[..., 1, 2] = 0.65 * D * a * b / turn
    square = np.linalg.eigvalsh(K, UPLO="U")
    exact = (square[1:, 1:] < (2.0 * np.pi * frequency) ** 2).sum()
    plate = fi.Plate(fi.Material(E=1.0, nu=0.3, rho=1.0), h)
    found = Target.of(fi.assemble(fi.mesh.rectangle(1.0, 1.0), plate, {"boundary": "hinged"}, theory="mindlin"))
    assert_allclose(found.count_below(frequency), exact, rtol=0.25)  # the edges take up to a fifth of few modes


@pytest.mark.parametrize("theory", ["kirchhoff", "mindlin"])
def test_a_strip_with_too_many_modes_is_refused_before_the_first_are_found(theory, monkeypatch):
    monkeypatch.setattr(refinement, "solve_on_mesh", None)  # takes minutes
    body = fi.assemble(
        fi.mesh.rectangle(2850.0, 0.19), fi.Plate(ALUMINIUM, 0.01), {"boundary": "hinged"}, theory=theory
    )
    with pytest.raises(fi.SimulationError, match=r"needs about .* modes"):
        fi.plan(body, STICK, fi.Contact.hertz(1e9), at=(1000.0, 0.08), speed=1.0, target="modal")


@pytest.mark.parametrize("edge", ["free", "clamped"])
def test_modes_of_disks_are_counted_with_their_edges(edge):
    """The edge takes a tenth of 300 modes, or adds as many; without its law, of 3000 a third was missed."""
    section = fi.Plate(ALUMINIUM, 1e-3)
    modes = fi.analytic.disk(0.3, edge=edge, section=section, n_modes=3000)
    target = Target(fi.mesh.disk(0.3), section, {"boundary": edge})
    counted = target.number_below(modes.truncated(n_modes=20), modes.frequencies[-1])
    assert_allclose(counted, 3000, rtol=0.01)  # 3007 and 3008


def test_plans_refuse_beams_that_cannot_stretch():
    held = {"left": "hinged", "right": "free"}
    bar = fi.assemble(fi.mesh.line(0.4), fi.Beam.rectangular(ALUMINIUM, width=0.01, height=1e-3), held)
    with pytest.raises(ValueError, match="but an end is free; hold it, or leave stretching out"):
        fi.plan(bar, fi.Striker.rigid(1e-3), fi.Contact.linear(1e4), at=0.2, speed=1.0, stretching=True)


def test_too_much_air_is_refused_by_the_file_with_advice(tmp_path):
    text = """
        mesh = { shape = "rectangle", length = 1.0, width = 1.0 }
        supports = { boundary = "hinged" }
        material = { E = 70e9, nu = 0.33, rho = 2700.0 }
        section = { kind = "plate", thickness = 1e-4 }
        target = { air = "one side" }
        striker = { kind = "rigid", mass = 0.1 }
        contact = { kind = "linear", stiffness = 1e5 }
        strike = { at = [0.3, 0.3], speed = 1.0 }
    """
    path = tmp_path / "loud.toml"
    path.write_text(text)
    target = fi.load_scene(path).built.target
    many = target.closed(n_modes=5000)  # all slower than sound
    with pytest.raises(ValueError, match=r"loud\.toml: \[target\] speed of sound .*; leave air out"):
        target.surrounded(many)


def test_frequencies_not_exact_enough_are_named_with_the_tolerance_of_the_blow(monkeypatch):
    def fails(*_, **__):
        raise fi.SimulationError("tolerance = 0.0002 is not met")

    monkeypatch.setattr(Target, "find", fails)
    bar = fi.assemble(fi.mesh.line(0.4), fi.Beam.rectangular(ALUMINIUM, width=0.01, height=1e-3), {"left": "clamped"})
    said = "^tolerance = 0.001 of the blow is 5 times that of its frequencies: tolerance = 0.0002 is"
    with pytest.raises(fi.SimulationError, match=said):
        fi.plan(bar, fi.Striker.rigid(1e-3), SOFT, at=0.2, speed=1.0, tolerance=1e-3, target="modal")


def test_a_plate_whose_corners_hold_the_error_of_its_first_mode_is_scaled_to_it_as_exactly_as_a_blow_asks(tmp_path):
    """The L errs by 1.3e-5 on any mesh; it was refused whatever the tolerance, as 1e-6 was asked of that mode."""
    text = """
        material = { E = 70e9, nu = 0.3, rho = 2700.0 }
        section = { kind = "plate", thickness = 2e-3 }
        mesh.shape = "polygon"
        mesh.corners = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.2], [0.2, 0.2], [0.2, 0.4], [0.0, 0.4]]
        supports.boundary = "hinged"
        target = { first_frequency = 100.0, damping_ratio = 0.01 }
        striker = { kind = "rigid", mass = 0.02 }
        contact = { kind = "hertz", stiffness = 1e8 }
        strike = { at = [0.1, 0.1], speed = 1.0, tolerance = 1e-2 }
    """
    scene = load_text(tmp_path, text)
    target = scene.built.target
    as_stated = fi.Plate(target.section.material, 2e-3)
    own = fi.find_modes(fi.assemble(target.mesh, as_stated, {"boundary": "hinged"}), n_modes=1, tolerance=1e-4)
    assert target.stretch == pytest.approx(100.0 / own.frequencies[0], rel=1e-4)
    assert scene.strike().tolerance_met
    with pytest.raises(fi.SimulationError, match=r"scene\.toml: the first mode, which .* give a tolerance of at least"):
        scene.plan(tolerance=1e-5)
