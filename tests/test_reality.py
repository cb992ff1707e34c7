"""Measured numbers stay inside the bands that the program states for them, and those outside are the ones explained."""

import numpy as np
import pytest
from reality import page
from reality.record import Experiment, Measured, Predicted, at_first_look, judge

QUICK = ("small_ball", "leeb", "copper", "steel_cantilever")
CASES = [
    pytest.param(each, id=each.key, marks=[] if each.key in QUICK else pytest.mark.slow) for each in page.EXPERIMENTS
]


@pytest.mark.parametrize("experiment", CASES)
def test_what_is_outside_its_band_is_what_has_a_reason(experiment):
    verdicts = judge(experiment)
    assert {each.point.name for each in verdicts if not each.inside} == set(experiment.reasons)
    line = page.counted(experiment, verdicts, at_first_look(experiment, verdicts)).split("|")
    written = next(row for row in page.PAGE.read_text(encoding="utf-8").splitlines() if row.startswith(f"|{line[1]}|"))
    assert [cell.strip() for cell in written.split("|")[2:5]] == [cell.strip() for cell in line[2:5]]


def made(value, predicted):
    point = Measured("time", value, 0.0, "s")
    return judge(Experiment("", "", "", "", "", {}, "", (point,), lambda: predicted), predicted)[0]


def test_a_band_holds_nine_tenths_of_what_may_be_read():
    """Errors of 3 and 4 % add to 5 %, of which nine tenths lie within 1.645 deviations."""
    rng = np.random.default_rng(3)
    found = made(1.0, Predicted(1.0 + 0.03 * rng.standard_normal((40_000, 1)), model=0.04))
    assert found.inside and found.width == pytest.approx(1.645 * 0.05, rel=0.03)  # 1 / sqrt(40 000) of noise, and tails
    assert not made(1.09, Predicted(np.ones((40_000, 1)), model=0.05)).inside
    assert made(1.09, Predicted(np.ones((40_000, 1)), computation=0.101)).inside  # nine tenths of a uniform error


def test_the_page_names_every_experiment_and_its_licence():
    text = page.PAGE.read_text(encoding="utf-8")
    for experiment in page.EXPERIMENTS:
        assert f"## {experiment.key.replace('_', ' ')}\n" in text and experiment.licence
        assert (page.shared.PICTURES / f"reality_{experiment.key}.png").is_file()
