"""The tutorials run as they stand, and what they teach is so."""

import beyond_sounds as sounds
import numpy as np
import pytest
import tutorial_fit
import tutorial_hammer_test as tutorial
import tutorial_nastran
import tutorial_outline_to_sound
from scipy.io import wavfile

from fem_impact.show import pictures


@pytest.mark.slow
def test_from_the_outline_to_the_sound(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(pictures, "can_render", lambda: False)  # the plane is quicker; the picture has its own test
    hits = tutorial_outline_to_sound.main(tmp_path, tolerance=1e-2)
    assert hits["fingernail"].contact_time < hits["fingertip"].contact_time
    assert {path.name for path in tmp_path.iterdir()} >= {"ukulele_modes.png", "ukulele_fingertip.wav"}
    said = capsys.readouterr().out
    assert "edges rim, hole" in said and "dB SPL" in said


@pytest.mark.slow
@pytest.mark.usefixtures("read_here")
def test_from_nastran_to_the_sound(tmp_path, capsys):
    """Nastran's files hold single precision, which no number of a blow notices."""
    hit, truth = tutorial_nastran.main(tmp_path, max_frequency=150.0)
    for name in ("restitution", "contact_time", "peak_force"):
        assert getattr(hit, name) == pytest.approx(getattr(truth, name), rel=1e-4)
    assert {path.name for path in tmp_path.iterdir()} >= {"door.op2", "door.bdf", "door.wav", "nastran_door.png"}
    assert "for a mode at" in capsys.readouterr().out


@pytest.mark.slow
def test_hammer_test_warns_of_double_hits_writes_and_advises(tmp_path, capsys):
    verdicts = {(one.place, one.tip): one for one in tutorial.main(tmp_path, max_frequency=3e3)}
    assert verdicts["middle", "nylon"].good
    assert verdicts["middle", "rubber"].reach < tutorial.BANDWIDTH and verdicts["middle", "rubber"].n_impacts == 1
    assert verdicts["middle", "steel"].n_impacts > 1 and verdicts["corner", "nylon"].n_impacts > 1
    assert verdicts["middle", "steel"].ratio > 1.0  # beyond the threshold, as the criterion foretells
    assert "with a hammer of 100 g: tips from" in capsys.readouterr().out and (tmp_path / "hammer_test.png").exists()


def test_hammer_test_gives_no_number_of_a_blow_that_missed(tmp_path, capsys, monkeypatch):
    few = tutorial.fi.analytic.rectangle(0.6, 0.4, mass=2.6, first_frequency=60.0, n_modes=20)
    monkeypatch.setattr(tutorial, "plate", lambda: few)
    monkeypatch.setattr(tutorial, "structure", lambda *_: tutorial.plate())
    monkeypatch.setattr(tutorial.hammers, "choose", lambda *_, **__: [])
    verdicts = tutorial.main(tmp_path)
    steel = [line for line in capsys.readouterr().out.splitlines() if " steel " in line]
    assert len(steel) == 2 and all("?" in line and "not resolved" in line for line in steel)
    assert not any(one.good for one in verdicts if not one.trusted)
    assert len(tutorial.draw(tutorial.plate()).axes[0].get_lines()) < len(tutorial.TIPS) + 1  # with the wanted level


def test_decay_is_measured_in_the_file_as_it_was_modelled(tmp_path, monkeypatch):
    _, heard = sounds.compute(duration=1.0, n_modes=60)["hard"]
    wavfile.write(tmp_path / "hard.wav", heard.rate, heard.samples.astype(np.float32))
    rate, samples = wavfile.read(tmp_path / "hard.wav")
    modelled = np.log(1e3) / (sounds.DAMPING * 2.0 * np.pi * 100.0)
    # the window lets neighbours through by 1e-3 of their size, over 40 dB of decay
    assert sounds.decay_time(samples, rate, 100.0) == pytest.approx(modelled, rel=1e-2)


@pytest.mark.slow
def test_from_four_taps_to_a_double_hit(tmp_path, capsys):
    found = tutorial_fit.main(tmp_path)
    verdicts = {one.name: one for one in found["verdicts"]}
    best, common, springy = (verdicts[name] for name in (
        tutorial_fit.BEST, "power law with loss", "power law behind a springy tip"))  # fmt: skip
    # a tap of the four predicted from the others, at worst: 0.98 % of its rms force; its fall, from its rise, 6.9 %
    assert best.left_out < 0.015 < 0.5 * common.left_out and best.fall < 0.6 * common.fall
    assert springy.found.problem.n_values == best.found.problem.n_values and best.left_out < 0.5 * springy.left_out
    assert verdicts["linear spring"].left_out > 3.0 * best.left_out
    assert set(found["free"].unidentifiable) == {"contact.stiffness", "contact.loss", "striker.mass"}
    heavy, light = found["limits"][0.45], found["limits"][0.05]
    assert all(a <= b for a, b in zip(heavy, light) if a is not None and b is not None)  # stiffer tips hit twice sooner
    assert {path.name for path in tmp_path.iterdir()} == {"fit_pulses.png", "fit_profiles.png", "fit_double_hits.png"}
    assert "Weigh the hammer" in capsys.readouterr().out
