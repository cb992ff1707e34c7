"""Bodies and blows made from numbers: their numbers, and how these change with the free ones."""

import pytest
from comparing import refusing
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.designs.objects import Maker

WOOD = fi.Material(E=16e9, nu=0.35, rho=900.0)


def blow(values):
    """A bar whose height, mallet and speed follow from two numbers."""
    section = fi.Beam.rectangular(WOOD, width=0.05, height=lambda x: values["height"] * (1.0 + x[:, 0]))
    return {
        "mesh": fi.mesh.line(0.35), "section": section, "striker": fi.Striker.stick(values["mass"], 3e3, n_modes=3),
        "contact": fi.Contact.hertz(1e6 * values["mass"] ** 2), "at": 0.1, "speed": 2.0 - values["mass"],
    }  # fmt: skip


def test_numbers_change_by_the_chain_rule():
    maker = Maker.of(blow, ("height", "mass"))
    values = {"height": 0.02, "mass": 0.05}
    mass = maker.rates(values, "mass", 0.05)[""]
    assert mass.section is None
    assert set(mass.numbers) == {"striker.mass", "contact.stiffness", "strike.speed"}
    exact = {"striker.mass": 1.0, "contact.stiffness": 1e5, "strike.speed": -1.0}
    # differences of fourth order with a step of 1e-5: rounding alone
    assert_allclose([mass.numbers[name] for name in exact], [*exact.values()], rtol=1e-9)
    height = maker.rates(values, "height", 0.02)[""]
    assert height.section is not None and not height.numbers


def test_one_sided_where_the_other_side_makes_nothing():
    maker = Maker.of(lambda values: fi.Modes.rigid(values["mass"] ** 2 if values["mass"] <= 2.0 else -1.0), ("mass",))
    found = maker.rates({"mass": 2.0}, "mass", 1.0)[""]
    assert_allclose(found.numbers["target.mass"], 4.0, rtol=1e-9)


def test_a_scene_and_a_function_make_the_same_pieces():
    path = "studies/scenes/marimba_bar.toml"
    one = Maker.of(path, ("striker.mass",)).pieces({"striker.mass": 0.02})[""]
    two = Maker.of(fi.load_scene(path), ("striker.mass",)).pieces({"striker.mass": 0.02})[""]
    assert one.numbers == two.numbers and one.numbers["striker.mass"] == 0.02
    assert one.key == two.key  # the body is the same, and found once


def test_a_scene_whose_ribs_change_is_another_body(tmp_path):
    scene = """
        mesh = {shape = "rectangle", length = 0.4, width = 0.3, size = 0.15}
        material = {E = 10e9, nu = 0.3, rho = 450.0}
        section = {kind = "plate", thickness = 3e-3}
        supports = {boundary = "hinged"}
        striker = {kind = "rigid", mass = 0.02}
        contact = {kind = "linear", stiffness = 1e5}
        strike = {at = [0.13, 0.1], speed = 0.5}
        rib = [{path = [[0.1, 0.0], [0.1, 0.3]], width = 8e-3, height = 10e-3}]
    """
    (tmp_path / "ribbed.toml").write_text(scene)
    found = fi.design(tmp_path / "ribbed.toml", {"mode1.frequency": 140.0}, {"rib.0.height": (4e-3, 2e-2)})
    assert found.met and found.verify().values["mode1.frequency"] == pytest.approx(140.0, rel=1e-3)


test_what_makes_no_blow_is_said = refusing([
    (3, "objects must be a scene, the path of one, or a function"),
    (lambda values: 3, "must return a System, Modes, a dict of arguments"),
    (lambda values: {"target": fi.Modes.rigid(1.0), "striker": fi.Striker.rigid(1.0)}, "contact must be"),
    (lambda values: {"target": fi.Modes.rigid(1.0), "striker": fi.Striker.rigid(1.0), "at": None,
                     "contact": fi.Contact.hertz(1e6)}, "needs speed, an argument of strike"),
    (lambda values: {}, "mesh must be a Mesh of fi.mesh, got None"),
    (lambda values: {"mesh": fi.mesh.line(0.3), "suports": {}}, "each argument must be one of .*mean 'supports'"),
    (lambda values: values["height"], "the function asks for 'height', but gets nothing"),
], lambda objects: Maker.of(objects, ()).pieces({}))  # fmt: skip
