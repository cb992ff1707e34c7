"""Hammers at the strike point of a scene, and what its own contact amounts to as a tip."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import SMALL

import fem_impact as fi
from fem_impact.scenes import tips


@pytest.fixture
def scene(tmp_path):
    def made(kind):
        path = tmp_path / "scene.toml"
        path.write_text(SMALL.replace('"hertz"', f'"{kind}"'))
        return fi.load_scene(path)

    return made


def test_a_linear_contact_is_a_tip_and_needs_no_word(scene):
    assert tips.said_of(scene("linear")) == ()


def test_a_hertz_contact_acts_as_long_as_the_tip_that_is_told(scene):
    """Hertz on a wall lasts 2.9432 (5/4)**(2/5) (m**2 / (k**2 v))**(1/5); a tip k' lasts pi sqrt(m / k')."""
    made = scene("hertz")
    k, m, v = made.contact.values["stiffness"], made.make_striker().felt_mass, made.blow.values["speed"]
    told = float(tips.said_of(made)[0].rsplit("tip of ", 1)[1].split()[0])
    duration = 2.9432 * (5.0 / 4.0) ** 0.4 * (m**2 / (k**2 * v)) ** 0.2
    assert_allclose(told, m * (np.pi / duration) ** 2, rtol=6e-3)  # three digits are printed
