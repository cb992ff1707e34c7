"""Numbers and sentences as a person writes them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import SMALL, load_text

from fem_impact.scenes import sentences


@pytest.mark.parametrize(
    ("said", "written"),
    [
        ("modes up to 1.34e+04 Hz, about 232", "modes up to 13.4 kHz, about 232"),
        ("steps of 4.23e-05 s (9 per contact), to 4.5e-03", "steps of 42.3 µs (9 per contact), to 4.5 · 10⁻³"),
        ("elements of 0.011 m, about 13818 unknowns", "elements of 11 mm, about 13818 unknowns"),
        ("the target, 5e+05 kg, of mobility 1.2e-05 m/(N s)", "the target, 500 t, of mobility 12 µm/(N s)"),
        ("guitar_0.02.msh: 52 sides of 2 smooth curves", "guitar_0.02.msh: 52 sides of 2 smooth curves"),
    ],
)
def test_sentences_of_a_plan_are_tidied(said, written):
    assert sentences.tidy(said).replace(sentences.NBSP, " ") == written


@pytest.fixture
def scene(tmp_path):
    def made(kind):
        return load_text(tmp_path, SMALL.replace('"hertz"', f'"{kind}"'))

    return made


def test_a_linear_contact_is_a_tip_and_needs_no_word(scene):
    assert sentences.tip_notes(scene("linear")) == ()


def test_a_hertz_contact_acts_as_long_as_the_tip_that_is_told(scene):
    """Hertz on a wall lasts 2.9432 (5/4)**(2/5) (m**2 / (k**2 v))**(1/5); a tip k' lasts pi sqrt(m / k')."""
    made = scene("hertz")
    k, m, v = made.contact.values["stiffness"], made.make_striker().felt_mass, made.blow.values["speed"]
    told = float(sentences.tip_notes(made)[0].rsplit("tip of ", 1)[1].split()[0])
    duration = 2.9432 * (5.0 / 4.0) ** 0.4 * (m**2 / (k**2 * v)) ** 0.2
    assert_allclose(told, m * (np.pi / duration) ** 2, rtol=6e-3)  # three digits are printed
