"""Numbers and sentences as a person writes them."""

import pytest

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
