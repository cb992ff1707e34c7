"""What a scene file can say of a body, it says as objects do."""

import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import edited, load_text

import fem_impact as fi
from fem_impact.scenes.fields import over_frequency, varying_field

HEAD = """
material = { E = 70e9, nu = 0.33, rho = 2700.0 }
contact = { kind = "linear", stiffness = 88.6e3 }
"""
PLATE = (
    HEAD
    + """
mesh = { shape = "rectangle", length = 0.5, width = 0.3 }
supports = { left = { stiffness = 2e5, rotation = 40.0 }, right = "hinged" }
strike = { at = [0.31, 0.12], speed = 1.0, tolerance = 1e-2 }
[section]
kind = "plate"
thickness = { x = [0.0, 0.5], y = [0.0, 0.3], values = [[2e-3, 2e-3], [4e-3, 4e-3]] }
[target]
damping_ratio = { frequency = [100.0, 1000.0], ratio = [0.01, 0.002] }
point_masses = [{ at = [0.1, 0.2], mass = 0.05 }]
[striker]
kind = "bar"
E = 12e9
rho = 700.0
length = 0.4
diameter = { x = [0.0, 0.4], values = [0.008, 0.016] }
at = 0.4
left = "hinged"
"""
)
BAR = (
    HEAD
    + """
mesh = { shape = "line", length = 0.5 }
supports = { left = { stiffness = 1e4 }, right = { stiffness = 1e4 } }
striker = { kind = "rigid", mass = 0.02 }
strike = { at = 0.2, speed = 1.0, tolerance = 1e-2 }
[section]
kind = "beam"
width = 0.04
height = { cases = [{ value = 6e-3, from = 0.2, to = 0.3 }], otherwise = 9e-3 }
"""
)
THICKNESS = "{ x = [0.0, 0.5], y = [0.0, 0.3], values = [[2e-3, 2e-3], [4e-3, 4e-3]] }"
ALLOY = fi.Material(E=70e9, nu=0.33, rho=2700.0)


@pytest.mark.slow
def test_plate_with_everything_equals_its_objects(tmp_path):
    plate = fi.Plate(ALLOY, lambda x: 2e-3 + 4e-3 * x[:, 0])
    held = {"left": fi.Elastic(2e5, 40.0), "right": "hinged"}
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3), plate, held, point_masses=[((0.1, 0.2), 0.05)])
    modes = fi.find_modes(system, n_modes=8, tolerance=1e-4)
    scene = load_text(tmp_path, PLATE)
    found = scene.modes(8)
    assert_allclose(found.frequencies, modes.frequencies, rtol=2e-4)  # both tolerances
    assert_allclose(found.damping_ratio, np.interp(found.frequencies, [100.0, 1000.0], [0.01, 0.002]))
    hit = scene.strike()
    assert hit.target.mass == pytest.approx(0.5 * 0.3 * 3e-3 * 2700.0 + 0.05)
    cone = np.pi / 3.0 * 0.4 * (0.004**2 + 0.004 * 0.008 + 0.008**2)
    assert hit.striker.mass == pytest.approx(700.0 * cone, rel=1e-9)
    assert "springs" in scene._repr_html_() or "svg" in scene._repr_html_()


def test_stepped_bar_equals_its_objects(tmp_path):
    def height(x):
        return np.where((x[:, 0] >= 0.2) & (x[:, 0] <= 0.3), 6e-3, 9e-3)

    beam = fi.Beam.rectangular(ALLOY, width=0.04, height=height)
    system = fi.assemble(fi.mesh.line(0.5), beam, {"left": fi.Elastic(1e4), "right": fi.Elastic(1e4)})
    found = load_text(tmp_path, BAR).modes(6)
    assert_allclose(found.frequencies, fi.find_modes(system, n_modes=6, tolerance=1e-3).frequencies, rtol=2e-3)


def test_table_is_linear_inside_and_constant_beyond_and_of_cases_the_first_that_holds_counts():
    field = varying_field("thickness", {"x": [0.0, 1.0], "y": [0.0, 2.0], "values": [[1.0, 2.0], [3.0, 4.0]]}, 2)
    assert_allclose(field(np.array([[0.5, 1.0], [-3.0, -1.0], [9.0, 9.0], [1.0, 0.5]])), [2.5, 1.0, 4.0, 3.25])
    assert varying_field("thickness", 3e-3, 2) == 3e-3
    cases = [{"value": 1.0, "centre": [0.0, 0.0], "radius": 1.0}, {"value": 2.0, "from": [2.0, 1.0], "to": [0.0, 0.0]}]
    field = varying_field("thickness", {"cases": cases, "otherwise": 3.0}, 2)
    assert_allclose(field(np.array([[0.5, 0.5], [1.5, 0.5], [1.5, -0.5]])), [1.0, 2.0, 3.0])


def test_damping_over_frequency():
    damping = over_frequency({"frequency": [100.0, 300.0], "ratio": [0.0, 0.2]})
    assert_allclose(damping(np.array([50.0, 200.0, 400.0])), [0.0, 0.1, 0.2])


@pytest.mark.parametrize(("old", "new", "text"), [
    ("x = [0.0, 0.5]", "x = [0.5, 0.0]", r"\[section\] thickness.x must be at least two ascending numbers"),
    ("values = [[2e-3, 2e-3], [4e-3, 4e-3]]", "values = [[2e-3, 2e-3]]", r"\[section\] thickness.values must have"),
    ("y = [0.0, 0.3], ", "", r"\[section\] thickness must be a number, a table with x, y and values"),
    ("rotation = 40.0", "rotations = 40.0", r"\[supports\] left: rotations is not a key.*'rotation'"),
    ("stiffness = 2e5, ", "", r"\[supports\] left: stiffness is missing"),
    ("stiffness = 2e5", "stiffness = -1.0", r"\[supports\] left: stiffness must not be negative"),
    ('right = "hinged"', "right = 3", r"\[supports\] right must be one of clamped, hinged, free, soft hinged or"),
    ("ratio = [0.01, 0.002]", "ratio = [0.01]", r"\[target\] damping_ratio.ratio must have shape"),
    ("ratio = [0.01, 0.002]", "ratio = [0.01, -1.0]", r"\[target\] damping_ratio.ratio must not be negative"),
    ("frequency = [100.0, 1000.0], ratio = [0.01, 0.002]", "frequency = [], ratio = []",
     r"scene\.toml: \[target\] damping_ratio.ratio must not be negative or empty, got \[\]"),
    ("frequency = [100.0, 1000.0]", "hertz = [1.0]", r"\[target\] damping_ratio must be a number or have"),
    ("mass = 0.05 }", "mass = -0.05 }", r"\[target\] point_masses\[0\].mass must be positive"),
    ("at = [0.1, 0.2], ", "", r"\[target\] point_masses\[0\] must have at and mass"),
    ("at = [0.1, 0.2], ", "at = [7.0, 0.2], ", r"\[supports\] point of point_masses\[0\] must lie on the body"),
    ("[target]", '[target]\ntheory = "timoshenko"', r"\[target\] theory must be one of kirchhoff, mindlin"),
    (THICKNESS, "{ cases = [], otherwise = -1.0 }", "thickness.otherwise must be positive"),
    (THICKNESS, "{ cases = 3, otherwise = 1.0 }", "thickness must have cases, a list"),
    (THICKNESS, "{ cases = [{ value = 1.0 }], otherwise = 1.0 }", r"thickness.cases\[0\] must have value, centre"),
])  # fmt: skip
def test_wrong_values_are_told_with_table_and_key(tmp_path, old, new, text):
    with pytest.raises(ValueError, match=text):
        load_text(tmp_path, edited(old, new, PLATE)).strike()


def test_what_a_file_holds_is_what_data_gives_back(tmp_path):
    assert tomllib.loads(PLATE).items() <= load_text(tmp_path, PLATE).data().items()


@pytest.mark.slow
def test_a_scene_says_that_its_plate_is_thick(tmp_path):
    stout = PLATE.replace('right = "hinged"', 'right = "soft hinged"').replace("e-3]", "e-2]")
    thin = load_text(tmp_path, stout.replace("soft hinged", "hinged")).built.target.find(3, tolerance=1e-3)
    target = load_text(tmp_path, stout.replace("[target]", '[target]\ntheory = "mindlin"')).built.target
    assert target.theory == "mindlin" and target.thick and target.closed is None
    assert (target.find(3, tolerance=1e-3).omega < thin.omega).all()
