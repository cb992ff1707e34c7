"""The files of sound of a scene: one for each point and listener, and stereo with the true levels and delays."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import SMALL
from scipy.io import wavfile

from fem_impact.scenes import hearing, scene
from fem_impact.show import sound

OBSERVE = """
[observe]
points = [[0.2, 0.15], [0.1, 0.2]]
listeners = [[0.1, 0.15, 0.3], [0.6, 0.15, 0.9]]
"""


@pytest.mark.parametrize("normalise", [False, True])
def test_every_point_and_listener_has_a_file_and_two_listeners_stereo(tmp_path, normalise):
    path = tmp_path / "scene.toml"
    path.write_text(SMALL + OBSERVE)
    told = scene.load_scene(path)
    hit = told.run(target="modal").response
    found = hearing.write(tmp_path, told, hit, duration=0.05, normalise=normalise)
    names = [each["file"] for each in found]
    assert names == ["strike.wav", "strike_2.wav", "radiated.wav", "radiated_2.wav", "stereo.wav"]
    read = {each["file"]: wavfile.read(tmp_path / each["file"])[1] * each["full_scale"] for each in found}
    for i, name in enumerate(names[:2]):
        wanted = sound.synthesise(hit, told.points[i], duration=0.05)
        assert_allclose(read[name][:1000], wanted.samples[:1000] * wanted.full_scale, rtol=0, atol=1e-6)  # float32
    near, far = read["radiated.wav"], read["radiated_2.wav"]
    stereo = read["stereo.wav"]
    assert stereo.shape == (2400, 2)
    scale = 1e-6 * np.abs(stereo).max()  # float32 and the rounding of the scale
    assert_allclose(stereo, np.column_stack([near, far]), rtol=0, atol=scale)
    assert np.abs(near).max() > 1.5 * np.abs(far).max()  # pressure falls with the distance
    first = [int(np.argmax(np.abs(each) > 1e-3 * np.abs(each).max())) for each in (near, far)]
    assert first[1] - first[0] > 0.5 / 343.0 * 48000  # and arrives later, by at least half a metre's way
    if normalise:
        assert_allclose(np.abs(wavfile.read(tmp_path / "stereo.wav")[1]).max(), 1.0, rtol=1e-6)


def test_sounds_of_several_kinds_are_not_put_together():
    tone = sound.Sound(np.ones(10), 48000, 1.0, "Pa")
    for other in (sound.Sound(np.ones(10), 44100, 1.0, "Pa"), sound.Sound(np.ones(10), 48000, 1.0),
                  sound.together([tone, tone])):  # fmt: skip
        with pytest.raises(ValueError, match="sounds must have one channel each, and the same rate and unit"):
            sound.together([tone, other])
    both = sound.together([tone, sound.Sound(np.ones(4), 48000, 0.5, "Pa")])
    assert_allclose(both.samples[:5, 1], [0.5, 0.5, 0.5, 0.5, 0.0])
