"""The files of sound of a scene: one for each point and listener, and stereo with the true levels and delays."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import BAR, SMALL, load_text
from scipy.io import wavfile

from fem_impact import commands
from fem_impact.scenes import hearing
from fem_impact.show import sound

OBSERVE = """
[observe]
points = [[0.2, 0.15], [0.1, 0.2]]
listeners = [[0.1, 0.15, 0.3], [0.6, 0.15, 0.9]]
"""


@pytest.mark.parametrize("normalise", [False, True])
def test_every_point_and_listener_has_a_file_and_two_listeners_stereo(tmp_path, normalise):
    told = load_text(tmp_path, SMALL + OBSERVE)
    hit = told.run(target="modal").response
    found = hearing.write_sounds(tmp_path, told, hit, duration=0.05, normalise=normalise)
    names = [each["file"] for each in found]
    assert names == ["strike.wav", "strike_2.wav", "radiated.wav", "radiated_2.wav", "stereo.wav"]
    read = {each["file"]: wavfile.read(tmp_path / each["file"])[1] * each["full_scale"] for each in found}
    for i, name in enumerate(names[:2]):
        wanted = sound.synthesise(hit, told.points[i], duration=0.05)
        assert_allclose(read[name][:1000], wanted.samples[:1000] * wanted.full_scale, rtol=0, atol=1e-6)  # float32
    near, far = read["radiated.wav"], read["radiated_2.wav"]
    stereo = read["stereo.wav"]
    assert stereo.shape == (2400, 2)  # equal but for float32 and the rounding of the scale
    assert_allclose(stereo, np.column_stack([near, far]), rtol=0, atol=1e-6 * np.abs(stereo).max())
    assert np.abs(near).max() > 1.5 * np.abs(far).max()  # pressure falls with the distance
    first = [int(np.argmax(np.abs(each) > 1e-3 * np.abs(each).max())) for each in (near, far)]
    assert first[1] - first[0] > 0.5 / 343.0 * 48000  # and arrives later, by at least half a metre's way
    if normalise:
        assert_allclose(np.abs(wavfile.read(tmp_path / "stereo.wav")[1]).max(), 1.0, rtol=1e-6)


FREE = SMALL.replace("[target]", "[target]\nbaffle = false").replace("tolerance = 1e-2", "tolerance = 0.1")
TWO = "[observe]\nlisteners = [[0.1, 0.15, 0.3], [0.3, 0.05, 0.5]]\n"


@pytest.mark.parametrize("text", [FREE, BAR], ids=["plate", "bar"])
def test_in_free_air_a_listener_gets_both_bounds_and_never_one_number(tmp_path, capsys, text):
    told = load_text(tmp_path, text + TWO)
    hit = told.run(target="modal", n_modes=4).response
    found = hearing.write_sounds(tmp_path, told, hit, duration=0.05)
    names = [f"{name}_{bound}.wav" for name in ("radiated", "radiated_2", "stereo") for bound in ("low", "high")]
    assert [each["file"] for each in found] == ["strike.wav", *names]
    place = told.listeners[1]
    if text is BAR:  # at its widest
        sounds = sound.radiate_bar(hit, place, width=0.05, height=0.02, duration=0.05)
    else:
        sounds = sound.radiate_free(hit, place, duration=0.05)
    assert not told.baffled
    for each, wanted in zip(found[3:5], sounds):
        read = wavfile.read(tmp_path / each["file"])[1]
        assert_allclose(read[:1000] * each["full_scale"], wanted.samples[:1000] * wanted.full_scale, rtol=0, atol=1e-5)
        levels = " and ".join(f"{level.level:.1f}" for level in sounds)
        assert each["stated"] == f"bounded: between {levels} dB re 20 µPa" and each["listener"] == place
    assert [each.get("bound") for each in found] == [None, *["low", "high"] * 3]
    assert found[3]["full_scale"] == found[4]["full_scale"]
    lines, files = commands.describe_sounds(found), "radiated_2_low.wav and radiated_2_high.wav"
    assert len(lines) == 4 and f"Listener: {found[4]['stated']}; full scale of {files}" in lines[2]


def test_the_air_around_a_plate_sees_no_wall_either(tmp_path):
    modes = load_text(tmp_path, FREE.replace("baffle = false", 'baffle = false\nair = "both sides"')).modes(2)
    assert any("half the mass that it would with a rigid wall" in note for note in modes.notes)


def test_silence_is_said():
    quiet, tone = (sound.Sound(value * np.ones(10), 48000, 1.0, "Pa") for value in (0.0, 0.2))
    assert hearing.stated_level((quiet, tone)) == "bounded: between silence and 80.0 dB re 20 µPa"
    assert hearing.stated_level((tone,)) == "80.0 dB re 20 µPa" and "inf" in hearing.stated_level((quiet, quiet))


@pytest.mark.parametrize(("text", "said"), [
    (BAR.replace("height = 0.02", "height = 0.06"), "listener must be left out for a beam higher than wide, here"),
    (BAR.replace("[target]", "[target]\nbaffle = true"), r"\[target\] baffle must be left out for a beam"),
    (BAR.partition("[material]")[0] + "[target]\nmass = 0.2\nfirst_frequency = 200.0" + BAR.partition("0.005")[2],
     r"listener of a beam needs \[material\] and \[section\], for its width"),
    (FREE.replace("false", "0"), r"\[target\] baffle must be True or False"),
])  # fmt: skip
def test_what_cannot_be_heard_is_refused_when_the_scene_is_read(tmp_path, text, said):
    with pytest.raises(ValueError, match=said):
        load_text(tmp_path, text + TWO)


def test_sounds_of_several_kinds_are_not_put_together():
    tone = sound.Sound(np.ones(10), 48000, 1.0, "Pa")
    for other in (sound.Sound(np.ones(10), 44100, 1.0, "Pa"), sound.Sound(np.ones(10), 48000, 1.0),
                  sound.together([tone, tone])):  # fmt: skip
        with pytest.raises(ValueError, match="sounds must have one channel each, and the same rate and unit"):
            sound.together([tone, other])
    both = sound.together([tone, sound.Sound(np.ones(4), 48000, 0.5, "Pa")])
    assert_allclose(both.samples[:5, 1], [0.5, 0.5, 0.5, 0.5, 0.0])
