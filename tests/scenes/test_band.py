"""Blows as well as their inputs are known: intervals in scene files, and what they leave open."""

import json

import numpy as np
import pytest
from scenes import QUICK, load_text

import fem_impact as fi
from fem_impact import cli
from fem_impact.scenes import maps

WALL = QUICK.replace("mass = 0.2", "mass = 1e9")  # so heavy that contact time and impulse have closed forms


def load(tmp_path, text):
    return load_text(tmp_path, text)


@pytest.mark.parametrize("n", [None, 64])
def test_a_band_of_a_linear_contact_on_a_wall(tmp_path, n):
    """Contact time goes with the root of mass over stiffness, impulse with the speed: 90 % within half the share."""
    told = WALL.replace("stiffness = 1e4", "stiffness = { value = 1e4, about = 0.2 }")
    found = fi.band(load(tmp_path, told.replace("speed = 2.0", "speed = { value = 2.0, about = 0.1 }")), n=n)
    assert not found.anew
    time = found["contact_time"]
    assert time.value == pytest.approx(np.pi * (0.03 / 1e4) ** 0.5, rel=1e-2)
    close = 0.01 if n is None else 0.1  # of a width, from so many evenly spread blows
    assert np.log(time.high / time.low) == pytest.approx(0.2, rel=close) and time.mostly == "contact.stiffness"
    assert time.ends[0] < time.low and time.high < time.ends[1]
    force = found["peak_force"]  # impulse m v (1 + e), time from k alone: independent
    assert np.log(force.high / force.low) == pytest.approx(2.0 * np.hypot(0.1, 0.1), rel=2 * close)


def test_an_input_that_needs_another_body_strikes_anew(tmp_path):
    """Both ways give the same band of the same inputs: a length that is no input of a spread, beside one that is."""
    text = QUICK.replace("stiffness = 1e4", "stiffness = { value = 1e4, about = 0.1 }")
    quick = fi.band(load(tmp_path, text), n=32)
    other = fi.band(
        load(tmp_path, text.replace("width = 0.3", "width = { value = 0.3, low = 0.299, high = 0.301 }")), n=32
    )
    assert other.anew and not quick.anew and set(other.inputs) == {"mesh.width", "contact.stiffness"}
    one, two = (each["contact_time"] for each in (quick, other))
    assert two.high / two.low == pytest.approx(one.high / one.low, rel=0.02)


def test_a_scene_without_intervals_has_no_band(tmp_path):
    with pytest.raises(ValueError, match="no number says how well it is known"):
        fi.band(load(tmp_path, QUICK))


def test_the_command_tells_the_band(tmp_path, capsys):
    load(tmp_path, QUICK.replace("speed = 2.0", "speed = { value = 2.0, about = 0.1 }"))
    assert cli.main(["strike", str(tmp_path / "scene.toml"), "--band", "--json", "--out", str(tmp_path / "out")]) == 0
    found = json.loads(capsys.readouterr().out)["band"]
    assert found["inputs"] == {"strike.speed": "lognormal(2, 0.0607957)"}
    impulse = found["quantities"]["impulse"]
    assert impulse["high"] / impulse["low"] == pytest.approx(np.exp(0.2), rel=2e-3)  # a linear blow goes with its speed
    path = tmp_path / "plain.toml"
    path.write_text(QUICK)
    assert cli.main(["strike", str(path), "--band", "--out", str(tmp_path / "none")]) == 2
    assert not (tmp_path / "none").exists()


def test_a_band_of_a_blow_that_ends_early_is_of_such_blows(tmp_path):
    """A map or spread follows whole blows, and refuses; a quarter of the blows here ends in contact (it was 0)."""
    text = WALL.replace("stiffness = 1e4", "stiffness = { value = 1e4, low = 7e3, high = 1.1e4 }")
    time = np.pi * (0.03 / 8e3) ** 0.5  # a contact of half that stiffness lasts longer
    ended = fi.band(load(tmp_path, text.replace("[strike]", f"[strike]\nduration = {time:.6g}")), n=32)
    restitution = ended.values["restitution"]
    assert ended.anew and np.isnan(restitution).sum() == 8
    assert ended["restitution"].low > 0.99 and ended["contact_time"].high < 1.001 * time
    scene = load(tmp_path, QUICK.replace("[strike]", "[strike]\nmax_impacts = 1"))
    for whole in (
        lambda: fi.spread(scene, {"striker.mass": ("uniform", 0.02, 0.03)}, n=8),
        lambda: maps.map_scene(scene, over={"striker.mass": [0.02, 0.03]}),
    ):
        with pytest.raises(ValueError, match=r"\[strike\] max_impacts must be left out here"):
            whole()
