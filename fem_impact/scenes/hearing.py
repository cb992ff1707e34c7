"""Writes what a scene lets hear: the motion of every observed point and the pressure at every listener."""

from pathlib import Path
from typing import Any

from ..impact.response import Response
from ..model.playing import Strokes
from ..show import export, sound
from .scene import Scene

EARS = 2  # [-] listeners whose sounds make one stereo file


def write(
    folder: Path, scene: Scene, response: Response | Strokes, *, duration: float | None = None, normalise: bool = False
) -> list[dict[str, Any]]:
    """Write strike.wav, strike_2.wav ... of the points, radiated.wav ... of the listeners, and stereo.wav of two.

    Returns the file, place and levels of each; each is scaled as in `export.write_wav`. In stereo the first listener is
    the left channel, and both channels have one scale and one start.
    """
    wanted: dict[str, Any] = {"duration": duration, "normalise": normalise}
    found = []
    for i, point in enumerate(scene.points):
        heard = export.write_wav(folder / _name("strike", i), response, at=point, **wanted)
        found.append({"file": _name("strike", i), "at": point, **_levels(heard)})
    ears = [sound.radiate(response, listener, duration=duration) for listener in scene.listeners]
    for i, (listener, heard) in enumerate(zip(scene.listeners, ears)):
        written = export.write_sound(folder / _name("radiated", i), _scaled(heard, normalise))
        found.append({"file": _name("radiated", i), "listener": listener, **_levels(written)})
    if len(ears) == EARS:
        both = export.write_sound(folder / "stereo.wav", _scaled(sound.together(ears), normalise))
        found.append({"file": "stereo.wav", "listeners": scene.listeners, **_levels(both)})
    return found


def _name(kind: str, i: int) -> str:
    return f"{kind}.wav" if i == 0 else f"{kind}_{i + 1}.wav"


def _scaled(heard: sound.Sound, normalise: bool) -> sound.Sound:
    return heard.normalised() if normalise else heard.audible()


def _levels(heard: sound.Sound) -> dict[str, Any]:
    levels = {"full_scale": heard.full_scale, "unit": heard.unit, "peak_level": heard.peak_level, "level": heard.level}
    return {**levels, "stated": heard.said, "reference": sound.REFERENCE[heard.unit][0]}
