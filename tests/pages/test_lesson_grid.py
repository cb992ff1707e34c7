"""The blows of a page without a server: where they strike, and how their curves are kept."""

import numpy as np
import pytest
from scenes import load_text

from fem_impact.pages import explore_model, lesson_grid


@pytest.fixture
def small(tmp_path):
    return load_text(tmp_path)


def test_lines_between_kept_points_miss_a_curve_by_no_more_than_allowed():
    time = np.linspace(0.0, 1.0, 2001)
    force = np.maximum(0.0, np.sin(7.0 * time)) + 0.1 * np.sin(90.0 * time)
    for most in (1e-1, 1e-2, 1e-4):
        kept = lesson_grid.kept_points(time, force, most)
        assert (np.diff(kept) > 0).all() and kept[0] == 0 and kept[-1] == 2000
        assert np.abs(np.interp(time, time[kept], force[kept]) - force).max() <= most
    assert len(lesson_grid.kept_points(time, 2.0 * time, 1e-9)) == 2


def test_places_lie_on_the_body_and_hold_the_scenes_own(small):
    setup = explore_model.Setup.of(small)
    places = lesson_grid.places_of(setup)
    assert len(places) == 4 and setup.start.at in places
    assert not any(setup.at_rest(place) for place in places)
