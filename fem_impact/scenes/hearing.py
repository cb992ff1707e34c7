"""Writes the sounds of a scene: the motion of every observed point and the pressure at every listener."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from ..impact.response import Response
from ..model.playing import Strokes
from ..show import export, sound
from .scene import Scene

BOUNDS: dict[int, tuple[str, ...]] = {1: ("",), 2: ("low", "high")}  # number of sounds of a listener: what they are


def radiated(
    scene: Scene, response: Response | Strokes, listener: Any, duration: float | None = None
) -> tuple[sound.Sound, ...]:
    """The sound at a listener: of a plate in a wall one, in free air an estimate from below and one from above."""
    if scene.baffled:
        return (sound.radiate(response, listener, duration=duration),)
    if response.target.dimension == 2:
        return sound.radiate_free(response, listener, duration=duration)
    width, height = scene.girth
    return sound.radiate_bar(response, listener, width=width, height=height, duration=duration)


def stated_level(sounds: tuple[sound.Sound, ...]) -> str:
    """The peak level at a listener in words, with its reference; of two sounds the levels between which it lies."""
    low, high = sorted((sounds[0], sounds[-1]), key=lambda each: each.level)
    if len(sounds) == 1 or high.level == -math.inf:
        return high.said
    least = "silence" if low.level == -math.inf else low.said.partition(" dB")[0]
    return f"bounded: between {least} and {high.said}"


def write_sounds(
    folder: Path, scene: Scene, response: Response | Strokes, *, duration: float | None = None, normalise: bool = False
) -> list[dict[str, Any]]:
    """Write strike.wav, strike_2.wav ... of the points, radiated.wav ... of the listeners, and stereo.wav of two.

    Returns the file, place and levels of each; each is scaled as in `export.write_wav`. In stereo the first listener is
    the left channel, and both channels have one scale and one start. Without a baffle there are two files of each
    listener, radiated_low.wav and radiated_high.wav, with one scale and a ``bound``.
    """
    wanted: dict[str, Any] = {"duration": duration, "normalise": normalise}
    found = []
    for i, point in enumerate(scene.points):
        written = export.write_wav(folder / _name("strike", i), response, at=point, **wanted)
        found.append({"file": _name("strike", i), "at": point, **_levels((written,), written)})
    ears = [radiated(scene, response, listener, duration) for listener in scene.listeners]
    for i, (listener, sounds) in enumerate(zip(scene.listeners, ears)):
        found += _written(folder, partial(_name, "radiated", i), sounds, normalise, listener=listener)
    if len(ears) == 2:
        both = tuple(sound.together(each) for each in zip(*ears))
        found += _written(folder, partial(_name, "stereo", 0), both, normalise, listeners=scene.listeners)
    return found


def _written(
    folder: Path, named: Callable[[str], str], sounds: tuple[sound.Sound, ...], normalise: bool, **place: Any
) -> list[dict[str, Any]]:
    """Write the sounds at one place, or the bounds of one, on the scale of the last; file, place and levels of each."""
    last = sounds[-1].normalised() if normalise else sounds[-1].audible()
    found = []
    for bound, each in zip(BOUNDS[len(sounds)], sounds):
        scaled = replace(each, samples=each.samples * (each.full_scale / last.full_scale), full_scale=last.full_scale)
        written = export.write_sound(folder / named(bound), scaled)
        found.append({"file": named(bound), **place, **({"bound": bound} if bound else {}), **_levels(sounds, written)})
    return found


def _name(kind: str, i: int, bound: str = "") -> str:
    return "_".join([kind, *([str(i + 1)] if i else []), *([bound] if bound else [])]) + ".wav"


def _levels(sounds: tuple[sound.Sound, ...], own: sound.Sound) -> dict[str, Any]:
    levels = {"full_scale": own.full_scale, "unit": own.unit, "peak_level": own.peak_level, "level": own.level}
    return {**levels, "stated": stated_level(sounds), "reference": sound.REFERENCE[own.unit][0]}
