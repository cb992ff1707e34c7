"""The map of the live page counts as single blows do, coarse or fine, whole or in part."""

from dataclasses import replace

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.impact import threshold
from fem_impact.pages import explore_map, explore_model


@pytest.fixture(scope="module")
def mapper(stand):
    return explore_map.Mapper(stand)


def whole(stand):
    return explore_map.Window.of(stand, None, None)


def counted(stand, picture, cells):
    """How many of some cells (row, column) hold the count of the blow itself."""
    blows = [stand.case(replace(stand.start, mass=picture.mass[j], stiffness=picture.stiffness[i])).blow()
             for i, j in cells]  # fmt: skip
    return sum(min(hit.n_impacts, explore_map.MORE) == picture.n_impacts[i, j] for hit, (i, j) in zip(blows, cells))


def test_map_counts_as_single_blows_do(stand, mapper):
    picture = mapper.first(stand.start, whole(stand))
    rng = np.random.default_rng(3)
    cells = list(zip(*(rng.integers(0, size, 8) for size in picture.n_impacts.shape)))
    assert counted(stand, picture, cells) >= 7  # one may graze: 1e-2 here
    assert (picture.n_impacts == 1).any() and (picture.n_impacts > 1).any()


def test_limit_is_where_the_contact_resonates_at_the_threshold(stand, mapper):
    settings = replace(stand.start, exponent=2.0)
    picture = mapper.first(settings, whole(stand))
    there = replace(settings, mass=picture.limit_mass[5], stiffness=picture.limit[5])
    assert stand.case(there).resonance == pytest.approx(picture.threshold[5], rel=1e-9)  # one formula solved for two
    # several hammers at once, to rounding
    assert picture.threshold[5] == pytest.approx(explore_model.limit_of(stand.case(there)), rel=1e-9)


def test_limit_of_a_part_is_that_of_the_whole_map_in_between(stand, mapper):
    picture = mapper.first(stand.start, explore_map.Window.of(stand, (0.02, 0.03), None))
    case = stand.case(stand.start)
    felt = case.striker.felt_mass / case.striker.mass
    exact = threshold.thresholds(case.modes, case.at, felt * picture.mass)
    # found at 97 masses of which neighbours differ by 6 %: the logarithm is straight to 0.06**2 / 8
    np.testing.assert_allclose(picture.threshold, exact, rtol=5e-3)


def test_finer_map_keeps_the_coarse_one_and_counts_its_borders(stand, mapper):
    window = explore_map.Window.of(stand, (0.01, 0.2), (1.0, 30.0))
    coarse = mapper.first(stand.start, window)
    fine = mapper.finer(stand.start, coarse)
    np.testing.assert_array_equal(fine.n_impacts[::2, ::2], coarse.n_impacts)
    np.testing.assert_allclose(fine.mass[::2], coarse.mass, rtol=1e-12)  # the same numbers, rounded differently
    assert (fine.mass[0], fine.mass[-1]) == pytest.approx(window.mass)
    rows, columns = (np.diff(fine.n_impacts, axis=axis) != 0 for axis in (0, 1))
    edge = np.argwhere(rows[:, :-1] | columns[:-1])
    some = edge[:: max(1, len(edge) // 8)]
    assert len(some) >= 8 and counted(stand, fine, some) >= len(some) - 2  # right at a border, errors of 1e-2 decide


def test_sharp_borders_are_those_found_pixel_by_pixel(stand, mapper, monkeypatch):
    monkeypatch.setattr(explore_map, "FINEST", 193)  # two halvings instead of three
    window = explore_map.Window.of(stand, (0.01, 0.2), (1.0, 30.0))
    picture = mapper.finer(stand.start, mapper.first(stand.start, window))
    sharp = mapper.sharp(stand.start, picture)
    exact = mapper.finer(stand.start, mapper.finer(stand.start, picture))
    assert exact.finest and sharp.n_impacts.shape == exact.n_impacts.shape
    np.testing.assert_allclose(sharp.mass, exact.mass, rtol=1e-12)  # the same numbers, rounded differently
    blocks = np.repeat(np.repeat(picture.n_impacts, 4, axis=0), 4, axis=1)[2:-1, 2:-1]
    missed, before = ((one != exact.n_impacts).mean() for one in (sharp.n_impacts, blocks))
    assert before > 0.0 and missed < 0.3 * before  # 0.17 measured: borders are bent, and grazing blows are noisy


def test_window_stays_on_the_map_and_is_never_empty(stand):
    low, high = stand.range("mass")
    wide = explore_map.Window.of(stand, (1e-9, 1e9), None)
    assert wide == whole(stand) and wide.mass == (low, high)
    for at in (low / 3.0, low, 0.5 * (low + high), high, 3.0 * high):
        narrow = explore_map.Window.of(stand, (at, at), None).mass
        assert low <= narrow[0] < narrow[1] <= high * (1.0 + 1e-12)  # rounding
        assert narrow[1] / narrow[0] == pytest.approx(explore_map.NARROWEST)


@pytest.mark.parametrize(
    "changes", [pytest.param({"loss": 0.3}, marks=pytest.mark.slow), {"exponent": 1.0}, {"thickness": 1.5}]
)
def test_maps_follow_the_other_sliders(stand, mapper, changes):
    settings = replace(stand.start, **changes)
    picture = mapper.first(settings, whole(stand))
    i, j = (n // 2 for n in picture.n_impacts.shape)
    for row in (0, i):
        case = stand.case(replace(settings, mass=picture.mass[j], stiffness=picture.stiffness[row]))
        assert picture.n_impacts[row, j] == min(case.blow().n_impacts, explore_map.MORE)


@pytest.mark.slow
def test_limit_under_a_hard_layer_is_where_the_contact_resonates_at_the_threshold(stand):
    law = fi.Contact.layers(5e5, 1.2, depth=2e-4, hard_stiffness=1e7)
    setup = replace(stand, base=replace(stand.base, contact=law))
    picture = explore_map.Mapper(setup).first(setup.start, whole(setup))
    assert (picture.n_impacts > 0).all()
    assert np.isfinite(picture.limit).any()
    for i in np.flatnonzero(np.isfinite(picture.limit)):
        there = replace(setup.start, mass=picture.limit_mass[i], stiffness=picture.limit[i])
        # between two rows of the map the logarithms are taken for straight
        assert setup.case(there).resonance == pytest.approx(picture.threshold[i], rel=0.1)
