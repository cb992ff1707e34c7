"""Random attacks on the promise of a blow, against an integrator of their own; `studies/attack.py` runs thousands."""

import attack_blows
import numpy as np
import pytest


def broken(area, numbers, seed=7):
    """What an area's numbers came to, and every promise broken without a word."""
    truths = attack_blows.Truths()
    verdicts = [each for number in numbers for each in attack_blows.attack(area, number, truths, seed=seed)]
    bad = [each for each in verdicts if each.kind in ("silent miss", "failed") or each.miscounted]
    return verdicts, bad


def check(area, numbers):
    verdicts, bad = broken(area, numbers)
    judged = [each for each in verdicts if each.judged]
    assert len(judged) >= 0.7 * len(verdicts)
    assert not bad, attack_blows.table(verdicts)
    claims = [each.caution for each in judged if each.met and np.isfinite(each.caution)]
    # of thousands one in twenty claims more than 30 times the truth; complete bodies bound what they leave out
    assert sum(claim > 30.0 for claim in claims) <= 0.25 * len(claims), attack_blows.table(verdicts)
    loud = sum(each.kind == "loud" for each in judged)
    assert loud <= 0.2 * len(judged), attack_blows.table(verdicts)  # silence is not bought by doubting everything


def test_a_truth_not_sharper_than_the_answer_tells_nothing_of_the_claim():
    """Where the reference errs by as much as the difference found, the true error may be nothing at all."""
    one = {"area": "complete bodies", "number": 0, "place": "", "kind": "kept", "tolerance": 1e-2, "met": True}
    sharp = attack_blows.Verdict(**one, truth=2e-5, claim=1e-4, floor=1e-6)
    blunt = attack_blows.Verdict(**one, truth=1e-6, claim=1e-4, floor=0.999e-6)
    assert sharp.caution == pytest.approx(5.0) and np.isnan(blunt.caution)
    row = attack_blows.table([sharp, blunt]).splitlines()[2]
    assert row == "| complete bodies | 2 | 0 | 0 | 0.19 | 0 | 0 | 0 | 5 5 5 | 1 |"


@pytest.mark.parametrize("area, count", [("everyday", 12), ("layers and steep laws", 6)])
def test_blows_keep_their_promise_or_tell(area, count):
    check(area, range(count))


@pytest.mark.slow
@pytest.mark.parametrize("start", range(0, 400, 100))
@pytest.mark.parametrize("area", ["everyday", "layers and steep laws"])
def test_more_blows_keep_their_promise_or_tell(area, start):
    check(area, range(100 + start, 200 + start))


@pytest.mark.slow
@pytest.mark.parametrize("start", range(0, 40, 10))
def test_counts_beside_thresholds_are_right_or_in_doubt(start):
    verdicts, bad = broken("beside thresholds", range(start, start + 10))
    assert len(verdicts) >= 60  # one of ten bodies at least has a threshold
    assert not bad, attack_blows.table(verdicts)


@pytest.mark.slow
@pytest.mark.parametrize("area, count", [("cells of maps", 6), ("complete bodies", 20), ("disks by elements", 10)])
def test_maps_whole_bodies_and_elements_keep_their_promise_or_tell(area, count):
    check(area, range(count))
