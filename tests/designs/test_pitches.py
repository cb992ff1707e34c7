"""Pitches as words: notes of equal temperament, intervals, and which mode is meant."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

from fem_impact.designs import pitches


@pytest.mark.parametrize(
    ("text", "frequency"),
    [("A4", 440.0), ("a3", 220.0), ("C4", 261.6255653), ("Bb3", 233.0818808), ("F#5", 739.9888454), ("440 Hz", 440.0),
     ("A4 +100 cents", 466.1637615), ("A#4", 466.1637615), ("B3 -1200 cents", 123.4708253), (523.25, 523.25)],
)  # fmt: skip
def test_notes_are_those_of_equal_temperament(text, frequency):
    (found,) = pitches.read_pitches({2: text}, "order")
    assert found.mode == 2
    assert_allclose(found.wanted(np.ones(1), np.ones(1), [1]), frequency, rtol=1e-9)  # digits of the published table


@pytest.mark.parametrize(("frequency", "said"), [(440.0, "A4 +0 cents"), (261.6, "C4 -0 cents"), (69.3, "C#2 +0 cents"),
                                                 (452.0, "A4 +47 cents"), (123.47, "B2 -0 cents")])  # fmt: skip
def test_a_frequency_is_told_as_the_nearest_note(frequency, said):
    assert pitches.note(frequency) == said


def test_intervals_are_from_now_and_ratios_to_the_first_mode():
    first, second, third = pitches.read_pitches([262.0, "-100 cents", "ratio 4"], "order")
    now = np.array([250.0, 800.0, 1700.0])
    assert first.wanted(now, now, (1, 2, 3)) == 262.0
    assert_allclose(second.wanted(now, now, (1, 2, 3)), 800.0 * 2.0 ** (-1.0 / 12.0))
    assert third.wanted(now, now, (1, 2, 3)) == 1000.0


def test_each_pitch_is_that_of_the_nearest_mode_if_there_is_no_doubt():
    given = pitches.read_pitches(["A4", 800.0], "nearest")
    assert [each.mode for each in pitches.match_pitches(given, np.array([200.0, 430.0, 830.0, 1500.0]))] == [2, 3]
    with pytest.raises(
        ValueError, match=r"A4 is 386 cents from mode 3 and 498 cents from mode 2.*name the mode, as in"
    ):
        pitches.match_pitches(given[:1], np.array([100.0, 330.0, 550.0]))
    with pytest.raises(ValueError, match="so it is not clear which is meant; name the mode"):
        pitches.match_pitches(pitches.read_pitches([440.0, 441.0], "nearest"), np.array([100.0, 441.0, 900.0]))


test_what_is_no_pitch_is_refused = refusing([
    ({1: "H4"}, "order", r"pitches\[1\] must be a frequency in Hz, a note such as 'A4'"),
    ({1: "ratio 4"}, "order", "must not be a ratio: mode 1 is what ratios are to; give a frequency"),
    ({1: -3.0}, "order", r"pitches\[1\] must be positive"), ({}, "order", "pitches must name at least one mode"),
    ({0: "A4"}, "order", "mode in pitches must be"), ({1: "A4"}, "nearest", "match must be left out where"),
    (["-3 cents"], "nearest", "match must be 'order' for pitches that are no frequencies"),
    ({2: "-999999999 cents"}, "order", "must lie between -12000 and 12000 cents"),
    ({1: "A4 +99999 cents"}, "order", "must lie between -12000 and 12000 cents"),
    (["A4"], "best", "match must be one of"),
], pitches.read_pitches)  # fmt: skip
