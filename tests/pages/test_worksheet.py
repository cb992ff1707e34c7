"""Questions of a page without a server: their answers are those of its blows."""

import numpy as np
import pytest
from scenes import load_text

from fem_impact.pages import explore_model, lesson_grid, worksheet
from fem_impact.scenes.sentences import si


@pytest.mark.slow
def test_answers_are_read_off_the_blows(tmp_path, monkeypatch):
    setup = explore_model.Setup.of(load_text(tmp_path))
    monkeypatch.setattr(lesson_grid, "COUNTS", {"mass": 3, "stiffness": 3, "speed": 1})
    told = []
    grid = lesson_grid.made(setup, lambda done, total: told.append((done, total)))
    assert told[-1] == (36, 36)
    asked = worksheet.questions(grid)
    hit = setup.case(grid.settings(*grid.start)).blow(tolerance=grid.tolerance)
    told = f"{hit.n_impacts} impact, {si(hit.contact_time, 's', 3)} in contact, at most "
    assert asked[0].answer == f"{told}{si(hit.peak_force, 'N', 3)}."
    assert si(hit.impulse, "N s", 3) in asked[1].answer  # of a rigid striker: mass times change of speed
    stiffer = next(each for each in asked if each.asked.startswith("Make the contact"))
    place, speed, stiffness, mass = stiffer.position
    time = grid.quantity("contact_time")[place, speed, :, mass]
    assert stiffer.answer.startswith(f"{time[stiffness] / time[stiffness - 1]:.3g}.")
    power = grid.setup.start.exponent
    ratio = grid.axes["stiffness"][1] / grid.axes["stiffness"][0]
    assert f"{ratio ** (-1.0 / (power + 1.0)):.3g}" in stiffer.answer
    elsewhere = next(each for each in asked if "each place" in each.asked)
    rebounds = grid.quantity("restitution")[:, speed, grid.start[2], grid.start[3]]
    assert elsewhere.position[0] == int(np.argmax(rebounds))
