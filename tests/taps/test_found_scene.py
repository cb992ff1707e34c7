"""Scene files that strike with what was found."""

from pathlib import Path

import pytest

import fem_impact as fi
from fem_impact.taps import found_scene

LAW = fi.Contact.hertz(2e8)
SCENES = Path(__file__).parents[2] / "studies" / "scenes"


@pytest.fixture(scope="module")
def found():
    wall = [fi.Touch(LAW, 0, None)]
    hits = [fi.collide([fi.Modes.rigid(0.1)], wall, speeds=[v]) for v in (0.5, 1.0)]
    taps = [fi.measure(hit, rate=25600.0, noise=1e-3, rng=i) for i, hit in enumerate(hits)]
    ranges = {"contact.stiffness": (1e6, 1e10)}
    return fi.fit(taps, striker=fi.Striker.rigid(0.1), contact=LAW, unknown=ranges, starts=1)


def test_a_wall_becomes_a_scene_with_the_same_blow(found, tmp_path):
    assert found_scene.write_scene(tmp_path / "s.toml", found) == ()
    hit = fi.load_scene(tmp_path / "s.toml").strike()
    same = fi.collide([fi.Modes.rigid(0.1)], [fi.Touch(found.contact, 0, None)], speeds=[hit.speed])
    assert hit.peak_force == pytest.approx(same.peak_force, rel=1e-3)  # the tolerance is 1e-4
    assert hit.speed == pytest.approx(0.75, rel=0.01)
    assert "90 % interval" in (tmp_path / "s.toml").read_text()


def test_the_body_of_a_scene_is_kept(found, tmp_path):
    scene = fi.load_scene(SCENES / "drumstick.toml")
    found_scene.write_scene(tmp_path / "s.toml", found, scene)
    again = fi.load_scene(tmp_path / "s.toml")
    assert again.data()["mesh"] == scene.data()["mesh"]
    assert again.make_striker().mass == pytest.approx(0.1) and again.make_contact().exponent == 1.5


def test_an_unknown_structure_needs_a_scene(found):
    body = fi.Modes.from_arrays([500.0], [[1.0]], points=[[0.0]], mass=1.0, complete=True)
    hit = fi.strike(body, fi.Striker.rigid(0.1), LAW, at=[0.0], speed=1.0)
    taps = [fi.measure(hit, rate=25600.0)]
    made = fi.fit(
        taps, target=body, at=[0.0], striker=fi.Striker.rigid(0.1), contact=LAW, starts=1,
        unknown={"contact.stiffness": (1e6, 1e10)},
    )  # fmt: skip
    with pytest.raises(ValueError, match="scene must be given"):
        found_scene.tables(made)
