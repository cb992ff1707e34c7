"""`fi.design`: closed forms found again, exact gradients, and what is said where nothing is found."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.designs import goals, search
from fem_impact.designs.objects import Maker
from fem_impact.taps.unknowns import Box

WOOD = fi.Material(E=16e9, nu=0.35, rho=900.0)
WALL = fi.Modes.rigid(1e9)
TUNED, HEIGHT = {"mode1.frequency": 440.0}, {"height": (5e-3, 40e-3)}
BALL = {"mass": (1e-3, 1.0), "stiffness": (1e3, 1e7)}


def bar(values):
    section = fi.Beam.rectangular(WOOD, width=0.05, height=values["height"])
    return {"mesh": fi.mesh.line(values.get("length", 0.35)), "section": section}


def ball(values):
    """A rigid ball on a wall, through a linear spring: in contact for pi sqrt(m / k)."""
    return {
        "target": WALL, "striker": fi.Striker.rigid(values["mass"]), "contact": fi.Contact.linear(values["stiffness"]),
        "at": None, "speed": values.get("speed", 1.0), "tolerance": 1e-7,
    }  # fmt: skip


def test_the_height_of_a_free_bar_is_that_of_the_formula():
    found = fi.design(bar, TUNED, HEIGHT, tolerance=1e-9)
    beta = 4.730040744862704  # cos b cosh b = 1
    height = 440.0 * 2.0 * np.pi * np.sqrt(12.0 * WOOD.rho / WOOD.E) * (0.35 / beta) ** 2
    assert found.met and found.at_end == ()
    assert_allclose(found.values["height"], height, rtol=1e-8)
    (reached,) = found.reached
    assert_allclose(reached.slopes["height"], 440.0 / height, rtol=1e-7)
    assert_allclose(found.verify().values["mode1.frequency"], 440.0, rtol=1e-8)


def test_mass_and_stiffness_follow_from_contact_time_and_peak_force():
    found = fi.design(ball, {"contact_time": 1e-3, "peak_force": 30.0}, BALL, tolerance=1e-6)
    # t = pi sqrt(m / k), F = v sqrt(k m)
    assert_allclose(found.values["mass"], 30.0 * 1e-3 / np.pi, rtol=1e-6)
    assert_allclose(found.values["stiffness"], 30.0 * np.pi / 1e-3, rtol=1e-6)
    assert_allclose(found["contact_time"], 1e-3, rtol=1e-6)
    checked = found.verify()
    assert checked.hits[""].n_impacts == 1 and max(checked.differences[""].values()) < 1e-6


def test_the_least_mass_lies_where_a_range_ends():
    wanted, free = {"contact_time": (1e-3, None), "peak_force": (None, 30.0)}, BALL | {"stiffness": (1e4, 1e7)}
    found = fi.design(ball, wanted, free, least="mass", tolerance=1e-6)
    assert_allclose(found.values["mass"], 1e4 * (1e-3 / np.pi) ** 2, rtol=1e-5)  # the softest tip, which is light
    assert found.at_end == ("stiffness",) and found.met


def test_blows_of_several_names_have_goals_of_their_own():
    def two(values):
        return {name: ball({**values, "speed": speed}) for name, speed in (("soft", 1.0), ("loud", 5.0))}

    wanted = {"soft": {"peak_force": 30.0}, "loud": {"contact_time": 1e-3}}
    found = fi.design(two, wanted, BALL, tolerance=1e-6)
    assert_allclose(found["soft: peak_force"], 30.0, rtol=1e-6)
    assert_allclose(found.values["mass"], 30.0 * 1e-3 / np.pi, rtol=1e-6)


def undercut(values):
    def height(x):
        return values["height"] - values["deep"] * np.sin(np.pi * x[:, 0] / 0.35) ** 2

    section = fi.Beam.rectangular(WOOD, width=0.05, height=height)
    return {
        "mesh": fi.mesh.line(0.35), "section": section, "theory": "timoshenko", "damping_ratio": 0.003,
        "striker": fi.Striker.rigid(0.03), "contact": fi.Contact.power(values["yarn"], 2.0, loss=0.1), "at": 0.175,
        "speed": 2.0, "tolerance": 1e-7,
    }  # fmt: skip


FREE = {"height": (0.01, 0.03), "deep": (1e-3, 15e-3), "yarn": (1e6, 1e9)}


def test_all_slopes_are_differences():
    box = Box.of("free", FREE)
    names = {"mode1.frequency": 1.0, "mode2.ratio": 1.0, "contact_time": 1.0, "restitution": 1.0}
    run = search._Search(Maker.of(undercut, tuple(FREE)), box, goals.read_goals(names, ("",)), None, 1.0, 12)
    x = box.start_at({"height": 0.022, "deep": 8e-3, "yarn": 3e7})
    slopes = run.slope(x)
    for j, each in enumerate(box.unknowns):
        step = 1e-3 * np.eye(len(x))[j]
        low, high = run.state_at(x - step), run.state_at(x + step)
        exact = (high.found - low.found) / (high.values[each.name] - low.values[each.name])
        scale = np.abs(run.state_at(x).found) / run.state_at(x).values[each.name]
        # differences of second order, 1e-6; of blows told to 1e-7 with a step of 1e-3: 1e-4 of their quantities
        assert_allclose(slopes[:, j] / scale, exact / scale, rtol=1e-5, atol=1e-4, err_msg=each.name)


def test_a_scene_is_designed_by_the_names_of_its_numbers():
    path, free = "studies/scenes/marimba_bar.toml", {"contact.stiffness": (1e6, 1e9)}
    found = fi.design(path, {"contact_time": 1.5e-3}, free, n_modes=12)
    scene = found.objects
    assert found.met
    assert_allclose(scene.strike(target="modal").contact_time, 1.5e-3, rtol=2e-3)  # told to 1e-3 by its own plan
    assert scene.contact.values["stiffness"] == found.values["contact.stiffness"]


def test_what_is_out_of_reach_warns_and_says_what_holds_it():
    with pytest.warns(fi.ToleranceWarning, match="mode1.frequency is .* wanted 2000 Hz; height stopped at the end"):
        found = fi.design(bar, {"mode1.frequency": 2000.0}, HEIGHT)
    assert not found.met and found.at_end == ("height",)
    assert "MISSED" in found.summary()


test_errors_name_what_is_wrong = refusing([
    (bar, TUNED, HEIGHT, {"least": "width"}, "least must be one of"),
    (bar, TUNED, HEIGHT, {"start": {"height": 1.0}}, r"start\['height'\] must lie between 0.005 and 0.04"),
    (bar, TUNED, {"height": (40e-3, 5e-3)}, {},
     r"free\['height'\] must be a range \(low, high\), got \(0.04, 0.005\)"),
    (bar, {"impulse": 1.0}, HEIGHT, {}, "a quantity of a blow needs striker, contact, at and speed"),
    (lambda values: WALL, {"mode3.frequency": 1.0}, {"mass": (1.0, 2.0)}, {},
     "mode 3 needs more modes, the body has 0 flexible ones"),
], lambda objects, wanted, free, how: fi.design(objects, wanted, free, **how))  # fmt: skip


def test_tension_rise_and_ribs_change_frequencies():
    """Their slopes were none: the search stopped where it began, and told to free more numbers."""
    mesh, sides = fi.mesh.rectangle(0.4, 0.3, size=0.15), {"boundary": "hinged"}
    thin = fi.Plate(WOOD, 3e-3)
    inertia, bent = float(thin.inertia(np.zeros((1, 2)))[0]), float(thin.stiffness(np.zeros((1, 2)))[0, 0, 0])
    square = np.pi**2 * (0.4**-2 + 0.3**-2)
    pulled = {"tension": (10.0, 2e4)}, lambda x: fi.Plate(WOOD, 3e-3, tension=x["tension"])
    domed = {"rise": (0.01, 2.0)}, lambda x: fi.Plate(WOOD, 3e-3, rise=lambda at: x["rise"] * (at[:, 0] - 0.2) ** 2)
    path = [(0.1, 0.0), (0.1, 0.3)]
    joist = (
        {"deep": (4e-3, 20e-3)},
        lambda x: fi.Plate(WOOD, 3e-3, ribs=(fi.Rib(path, fi.Beam.rectangular(WOOD, width=8e-3, height=x["deep"])),)),
    )
    hertz = {0: np.sqrt(square * (bent * square + 8e3) / inertia) / (2.0 * np.pi), 1: 160.0, 2: 140.0}
    for k, (free, made) in enumerate((pulled, domed, joist)):
        found = fi.design(
            lambda x, made=made: {"mesh": mesh, "section": made(x), "supports": sides},
            {"mode1.frequency": hertz[k]}, free,
        )  # fmt: skip
        assert found.met
        if not k:
            assert_allclose(found.values["tension"], 8e3, rtol=1e-4)
            slope = square / (8.0 * np.pi**2 * inertia * hertz[0])
            assert_allclose(found.reached[0].slopes["tension"], slope, rtol=1e-4)


def test_a_number_that_only_moves_a_step_is_named():
    def stepped(values):
        height = lambda x: np.where(np.abs(x[:, 0] - 0.175) < values["half"], 0.012, 0.02)  # noqa: E731
        return {"mesh": fi.mesh.line(0.35), "section": fi.Beam.rectangular(WOOD, width=0.05, height=height)}

    with pytest.warns(fi.ToleranceWarning, match="half changes no goal there: round off what it moves"):
        fi.design(stepped, {"mode1.frequency": 600.0}, {"half": (0.02, 0.15)})


def test_a_search_may_begin_where_a_number_is_one():
    """Its logarithm is zero, from which scipy alone would take no step."""
    soft = lambda values: ball({**values, "stiffness": 1e5})  # noqa: E731
    found = fi.design(soft, {"contact_time": 2e-3}, {"mass": (0.01, 100.0)})
    assert_allclose(found.values["mass"], 1e5 * (2e-3 / np.pi) ** 2, rtol=2e-3)
