"""Numbers of a scene file that say how well they are known."""

import numpy as np
import pytest
from scenes import QUICK, load_text
from scipy import stats

from fem_impact._base import known


def test_a_scene_strikes_with_the_value(tmp_path):
    scene = load_text(tmp_path, QUICK.replace("speed = 2.0", "speed = { value = 2.0, low = 1.0, high = 4.0 }"))
    assert scene.known == {"strike.speed": ("uniform", 1.0, 4.0)}
    assert scene.strike().impulse == load_text(tmp_path, QUICK).strike().impulse
    assert scene.changed({"strike.speed": 3.0}).known == {}
    assert "strike.speed" in scene.changed({"target.mass": 0.3}).known


def test_about_holds_nine_tenths():
    kind, median, sigma = known.distribution("E", {"value": 70e9, "about": 0.03})
    low, high = stats.lognorm(sigma, scale=median).cdf(70e9 * np.exp([-0.03, 0.03]))
    assert kind == "lognormal" and high - low == pytest.approx(0.9)


@pytest.mark.parametrize(("interval", "match"), [
    ("{ value = 1e4, about = 1.5 }", r"\[contact\] stiffness.about must be a share below 1 .*; give low, high"),
    ("{ value = 1e4, about = -0.1 }", "stiffness.about must be positive"),
    ("{ value = 1e4, low = 2e4, high = 3e4 }", "stiffness.value must lie between low and high"),
    ("{ value = 1e4, near = 0.1 }", "stiffness must be"),
])  # fmt: skip
def test_wrong_intervals_are_named(tmp_path, interval, match):
    with pytest.raises(ValueError, match=match):
        load_text(tmp_path, QUICK.replace("stiffness = 1e4", f"stiffness = {interval}"))


def test_other_tables_of_a_scene_stay_tables():
    springs = {"left": {"stiffness": 1e5, "rotation": 0.0}}
    assert known.taken("supports", springs) == (springs, {})
