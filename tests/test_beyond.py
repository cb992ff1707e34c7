"""What the studies beyond the source show."""

from pathlib import Path

import beyond_bell
import beyond_flexible_stick
import beyond_hammer_test
import beyond_marimba_bar
import beyond_sounds as sounds
import numpy as np
import pytest
from numpy.testing import assert_allclose

STUDIES = Path(__file__).parents[1] / "studies"


def test_a_stick_that_bends_strikes_twice():
    table = beyond_flexible_stick.compute(np.array([100.0, 178.0, 224.0, 251.0, 500.0, 3e3, 10e3]))
    once = table.n_impacts.values == 1
    assert (once == (table.striker_frequency.values > 240.0)).all()  # Hz; the contact resonance is 260 Hz
    assert_allclose(float(table.restitution[-1]), 1.0, atol=2e-3)  # rigid stick, unyielding plate: nothing is lost


@pytest.mark.slow
def test_the_end_of_a_free_bar_forgives_least():
    result = beyond_marimba_bar.compute(np.array([0.01, 0.05]), np.geomspace(1e3, 1e7, 21))
    assert (result[0.0] < np.minimum(result[0.1], result[0.4])).all()
    assert result[0.0][1] < result[0.0][0]  # a heavier mallet needs a softer head
    assert result[0.0][0] < 5e5  # 10 g: 398 kN/m in the study's finer row
    assert result[0.4][0] == 1e7  # elsewhere the hardest tried still hits once


@pytest.mark.slow
def test_light_or_soft_clappers_hit_a_bell_once():
    table = beyond_bell.compute(np.array([0.02, 1.0]), np.array([1e7, 1e10]), max_frequency=8e3)
    assert table.n_impacts.values[0].tolist() == [1, 1]  # soft
    assert table.n_impacts.values[1, 0] == 1  # light
    assert table.n_impacts.values[1, 1] > 1  # hard and heavy
    assert table.contact_resonance.values[1, 0] < float(table.threshold[0])  # and theory agrees on all three
    assert table.contact_resonance.values[0, 1] < float(table.threshold[1]) or np.isnan(table.threshold[1])


def test_light_hammers_reach_the_bandwidth_and_heavy_ones_cannot():
    found = beyond_hammer_test.compute(np.array([2e-3, 0.02, 0.1]))
    assert [hammer.works for hammer in found] == [True, True, False]
    assert found[2].reach < 250.0 < 600.0 < found[1].reach  # Hz hitting once; 110 Hz at 100 g, 681 Hz at 20 g


def test_harder_heads_and_second_hits_are_brighter_and_heavier_sticks_louder():
    heard = sounds.compute(duration=0.3)
    assert {name: n for name, (n, _) in heard.items() if n > 1} == {"double": 2}
    bright = {name: sounds.centroid(sound.samples, sound.rate) for name, (_, sound) in heard.items()}
    loud = {name: sounds.level(sound.samples) for name, (_, sound) in heard.items()}
    assert bright["hard"] > 1.3 * bright["soft"]
    assert bright["double"] > 1.2 * bright["single"]
    assert bright["light"] > 1.3 * bright["heavy"]
    assert loud["heavy"] > loud["light"] + 6.0  # dB
    assert {sound.full_scale for _, sound in heard.values()} == {10.0}


def test_the_page_shows_every_study():
    page = (STUDIES / "README.md").read_text()
    for script in [*STUDIES.glob("figures/fig*.py"), *STUDIES.glob("figures/beyond_*.py")]:
        assert f"(pictures/{script.stem}.png)" in page
        assert script.read_text().split('"""')[1].split("\n")[0] in page  # its first sentence
        assert (STUDIES / "pictures" / f"{script.stem}.png").stat().st_size < 100_000
