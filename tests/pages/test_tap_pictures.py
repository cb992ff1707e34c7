"""Pictures of taps show what they are named for: double hits, errors, the bandwidth asked for."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.pages import tap_pictures

BODY = fi.Modes.from_arrays([0.0, 700.0], [[1.0, 1.0]], points=[[0.0]], mass=1.0, damping_ratio=0.02)


@pytest.fixture(scope="module")
def taps():
    hit = fi.strike(BODY, fi.Striker.rigid(0.02), fi.Contact.linear(1e6), at=[0.0], speed=1.0)
    pair = [fi.measure(hit, rate=25600.0, at=[[0.0]], duration=0.3, noise=1e-3, rng=i) for i in (1, 2)]
    force = np.concatenate([one.force for one in pair])
    force[1] += 0.4 * np.roll(force[1], 60)  # a second pulse
    return fi.Taps.from_arrays(force, np.concatenate([one.response for one in pair]), rate=25600.0)


def test_the_picture_of_a_watched_folder_marks_double_hits_and_has_responses_of_good_taps(taps):
    figure = tap_pictures.watched(taps, taps, 2000.0, 10.0, "b.npz: double hit, repeat")
    pulses, spectra, responses, coherence = figure.axes
    assert [text.get_text() for text in pulses.get_legend().get_texts()] == ["tap 1", "tap 2: double hit"]
    marks = [line for line in pulses.lines if line.get_marker() == "v"]
    assert len(marks) == taps.n_pulses[1] == 2
    assert [line.get_linestyle() for line in spectra.lines[:2]] == ["-", "--"]
    assert responses.get_ylabel() == "response [m/s^2/N]" and coherence.get_ylim()[1] > 1.0
    assert "responses of 2 good taps" in figure.get_suptitle()


def test_of_one_good_tap_no_coherence_is_drawn_and_without_any_no_response(taps):
    alone = tap_pictures.watched(taps, taps.pick([0]), 2000.0, 10.0, "")
    assert [axes.get_ylabel().split()[0] for axes in alone.axes if axes.get_visible()] == ["force", "force", "response"]
    shown = [axes for axes in tap_pictures.watched(taps, None, 2e3, 10.0, "").axes if axes.get_visible()]
    assert len(shown) == 2
