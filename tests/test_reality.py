"""Measured numbers stay inside the bands that the program states for them, and those outside are the ones explained."""

import pytest
from reality import page
from reality.record import at_first_look, judge

QUICK = ("small_ball", "leeb", "copper", "steel_cantilever")
CASES = [
    pytest.param(each, id=each.key, marks=[] if each.key in QUICK else [pytest.mark.slow, pytest.mark.thin(3)])
    for each in page.EXPERIMENTS
]


@pytest.mark.parametrize("experiment", CASES)
def test_what_is_outside_its_band_is_what_has_a_reason(experiment):
    verdicts = judge(experiment).verdicts
    assert {each.point.name for each in verdicts if not each.inside} == set(experiment.reasons)
    line = page.counted(experiment, verdicts, at_first_look(experiment, verdicts)).split("|")
    written = next(row for row in page.PAGE.read_text(encoding="utf-8").splitlines() if row.startswith(f"|{line[1]}|"))
    assert [cell.strip() for cell in written.split("|")[2:5]] == [cell.strip() for cell in line[2:5]]


def test_the_page_names_every_experiment_and_its_licence():
    text = page.PAGE.read_text(encoding="utf-8")
    for experiment in page.EXPERIMENTS:
        assert f"## {experiment.key.replace('_', ' ')}\n" in text and experiment.licence
        assert (page.shared.PICTURES / f"reality_{experiment.key}.png").is_file()
