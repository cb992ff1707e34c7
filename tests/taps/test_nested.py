"""A larger model begins where the smaller one inside it ends, and is never worse; of those proposed, too."""

import numpy as np
import pytest
from hammer_taps import LAW, taps_of

import fem_impact as fi
from fem_impact.taps import nested, solver
from fem_impact.taps.nested import Inner
from fem_impact.taps.proposal import STIFFNESS

HAMMER = fi.Striker.rigid(0.2)
EXPONENT, LOSS = {"contact.exponent": (1.0, 4.0)}, {"contact.loss": (0.0, 20.0)}
MODE = {"mode1.frequency": (100.0, 5e3), "mode1.mass": (0.02, 2e3)}
MODES = {**MODE, "mode2.frequency": (100.0, 5e3), "mode2.mass": (0.02, 2e3)}


@pytest.fixture(scope="module")
def taps():
    return taps_of(noise=0.003)


def fitted(taps, unknown, **changes):
    given = {"starts": 1, "robust": False, "profiles": False, **changes}
    return fi.fit(taps, striker=HAMMER, contact=LAW, unknown=unknown, **given)


def cost(found):
    return float(np.square(found.problem.residual(found.best.x)).sum())


@pytest.fixture(scope="module")
def small(taps):
    return fitted(taps, STIFFNESS | EXPONENT)


@pytest.mark.parametrize(
    "more", [LOSS, MODE, {"striker.first_frequency": (500.0, 1e5), "striker.mode_ratio": (1e-4, 9)}]
)
def test_at_the_best_fit_of_the_smaller_model_a_larger_one_is_the_same_blow(taps, small, more):
    """A mode of 2 tonnes, or one of a ten-thousandth at 100 kHz, moves the force by less than a thousandth."""
    large = fitted(taps, STIFFNESS | EXPONENT | more, smaller=small)
    inner = Inner("", small.problem, small.best.x)
    for x in nested.embed_fit(large.problem, inner):
        assert np.square(large.problem.residual(x)).sum() == pytest.approx(cost(small), rel=0.02)
    assert cost(large) <= cost(small) * (1.0 + 1e-5) and not large.stuck


def test_what_one_tap_has_of_its_own_goes_along(taps):
    small = fitted(taps, STIFFNESS, per_tap="contact.stiffness")
    large = fitted(taps, STIFFNESS | LOSS, per_tap="contact.stiffness", smaller=small)
    (x,) = nested.embed_fit(large.problem, Inner("", small.problem, small.best.x))
    assert np.square(large.problem.residual(x)).sum() == pytest.approx(cost(small), rel=1e-6)


def test_a_fit_whose_own_searches_stick_says_so(taps, monkeypatch):
    """Searches with two modes that do not leave their start: the model with one is not lost."""
    one = fitted(taps, STIFFNESS | EXPONENT | MODE)
    real, starts = solver.solve, nested.embed_fit

    def lame(problem, x, iterations=solver.ENOUGH, *rest, **more):
        return real(problem, x, 1 if problem.n_shared == 6 else iterations, *rest, **more)

    def later(problem, inner):  # not in the first searches
        monkeypatch.setattr(nested, "embed_fit", starts)
        return []

    monkeypatch.setattr(solver, "solve", lame)
    monkeypatch.setattr(nested, "embed_fit", later)
    two = fitted(taps, STIFFNESS | EXPONENT | MODES, smaller=one)
    assert two.stuck and any("the searches stuck above the model without" in note for note in two.notes)
    assert cost(two) <= cost(one) * (1.0 + 1e-4)


@pytest.mark.slow
def test_a_mode_that_its_range_forces_to_move_is_left_out(taps):
    """A mode of ten times the mass of the hammer that must be where there is none."""
    one = fitted(taps, STIFFNESS | EXPONENT | MODE)
    forced = {"mode2.frequency": (300.0, 400.0), "mode2.mass": (0.2, 0.3)}
    two = fitted(taps, STIFFNESS | EXPONENT | MODE | forced)
    assert cost(two) <= cost(one) * (1.0 + 1e-3) and two.names == one.names
    assert "mode2: left out, as its ranges allow no better fit than without; widen them" in two.notes


def test_a_smaller_fit_of_other_taps_and_what_cannot_be_tried_are_refused(taps, small):
    for others in (taps[:2], taps[::-1]):
        with pytest.raises(ValueError, match=f"smaller must be a fit to the same {len(others)} taps"):
            fitted(others, STIFFNESS | LOSS, smaller=small)
    with pytest.raises(ValueError, match="taps must be two at least"):
        fi.propose(taps[:1], striker=HAMMER)
    with pytest.raises(ValueError, match="striker must be rigid"):
        fi.propose(taps, striker=fi.Striker.stick(mass=0.1, first_frequency=1e4))


def test_a_search_that_did_not_end_says_so_where_it_would_gain(taps, small, monkeypatch):
    real = solver.solve
    monkeypatch.setattr(solver, "solve", lambda problem, x, iterations=2, *rest, **more: real(problem, x, 2))
    cut = fitted(taps, STIFFNESS | EXPONENT | MODE)
    monkeypatch.undo()
    assert any(note.startswith("the search had not ended") for note in cut.notes) and not small.notes
    assert solver.promised_fall(cut.problem, cut.best) > 0.01 * cut.best.cost
    assert solver.promised_fall(small.problem, small.best) < 1e-3 * small.best.cost


def test_a_lossy_law_is_found_and_nothing_more():
    law, ball = fi.Contact.power(2e9, 1.9, loss=0.3), fi.Striker.rigid(0.1)
    found = taps_of(fi.Modes.rigid(1e4), None, mass=0.1, law=law, speeds=(0.5, 1.0, 1.5))
    got = fi.propose(found, striker=ball, starts=1, profiles=False)
    taken = [one.name for one in got.tried if one.taken]
    assert taken == ["Hertz", "Hertz + exponent", "Hertz + exponent + loss"]
    assert got.found.point["contact.exponent"] == pytest.approx(1.9, abs=0.03)
    more = {one.name.rpartition(" + ")[2] for one in got.tried[-3:]}
    assert more == {"springy head", "stiffness per tap", "mode 1"}
    errors = {one.name: one.error for one in got.tried}
    assert all(one.error <= errors[one.inside] * (1.0 + 1e-3) for one in got.tried if one.inside)
    assert "left out" in got.summary() and set(got.found.compared) == set(errors)
