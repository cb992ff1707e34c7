"""Films a blow in slow motion: striker and body beside the force, with captions."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from .._base import check
from .._base.files import replacing, write_whole
from ..impact.response import Response
from . import canvas, figures, pictures, sampling
from .style import BLUE, VERMILION, font_file, pixels

SIDE, STRIP = (540, 480), 60  # [px] size of the force's picture, and height of the strip with the caption
LETTERS = 20  # [px] height of the caption's letters: legible at half the size


@dataclass(frozen=True)
class Caption:
    """What is said of a blow from an instant on, until the next caption."""

    time: float  # [s]
    text: str


@check.typed
def captions(response: Response) -> list[Caption]:
    """What happens in a blow, in the order of time.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=20, damping_ratio=0.01)
    >>> hit = fi.strike(plate, fi.Striker.rigid(0.03), fi.Contact.linear(1e5), at=(0.13, 0.1), speed=1.0)
    >>> fi.slow_motion.captions(hit)[0].text
    'The striker touches with 1 m/s.'
    """
    said = [Caption(0.0, f"The striker touches with {abs(response.speed):.3g} m/s.")]
    for number, impact in enumerate(response.impacts):
        if number:
            said.append(Caption(impact.start, f"Body and striker meet again: impact {number + 1}."))
        pressed = np.where((response.time >= impact.start) & (response.time <= impact.end), response.force, -1.0)
        peak = float(response.time[pressed.argmax()])
        said.append(Caption(peak, f"The force is largest: {pressed.max():.3g} N, {1e3 * peak:.3g} ms after the touch."))
        said.append(Caption(impact.end, f"They part, after {1e3 * impact.duration:.3g} ms in contact."))
    if response.impacts and response.restitution is not None:
        text = f"{said[-1].text[:-1]}; the striker keeps {response.restitution:.3g} of its speed, the body rings."
        said[-1] = Caption(said[-1].time, text)
    return said


@check.typed
def write(path: str | Path, response: Response, *, frames: int = 144) -> str:
    """Write the film of a blow from the first touch on, and beside it its captions, which are also in the pictures.

    Parameters
    ----------
    path : path ending in .mp4; the captions go to the same name with .vtt (WebVTT)
    response : Response of a struck plate or beam
    frames : int, number of frames from the first touch to a third beyond the last contact; 12 make a second

    Returns
    -------
    str
        Empty, or what to install for 3D pictures if only flat ones could be drawn.

    Raises
    ------
    ValueError
        If the extra ``film`` is not installed.
    """
    check.ending(path, ".mp4")
    encoder = check.extra("imageio_ffmpeg", "film", "an MP4 file")
    times = sampling.frame_times(response, frames)
    said = captions(response)
    with replacing(path) as temporary:
        pictures.encode(encoder, temporary, _composed(response, times, said))
    write_whole(Path(path).with_suffix(".vtt"), subtitles(said, times))
    return "" if pictures.can_render() else pictures.REMEDY


def subtitles(said: list[Caption], times: np.ndarray) -> str:
    """Captions as WebVTT, in the time of a film whose frames show the given times (n_frames,) [s]."""
    starts = [np.searchsorted(times, caption.time) / canvas.RATE for caption in said] + [len(times) / canvas.RATE]
    parts = [f"{_clock(start)} --> {_clock(end)}\n{caption.text}\n"
             for caption, start, end in zip(said, starts, starts[1:]) if end > start]  # fmt: skip
    return "\n".join(["WEBVTT\n", *parts])


def _clock(seconds: float) -> str:
    minutes, rest = divmod(seconds, 60.0)
    return f"{int(minutes):02d}:{rest:06.3f}"


def _composed(response: Response, times: np.ndarray, said: list[Caption]) -> Iterator[Image.Image]:
    """Pictures of the body, the force and the caption, at the given times [s]."""
    face = ImageFont.truetype(font_file(), LETTERS)
    force, spot = _force(response, times[-1])
    slower = float(f"{len(times) / canvas.RATE / times[-1]:.2g}")
    for time, picture in zip(times, pictures.frames_at(response, times)):
        size = round(SIDE[1] * picture.width / picture.height), SIDE[1]
        whole = Image.new("RGB", (size[0] + SIDE[0], SIDE[1] + STRIP), "white")
        whole.paste(picture.resize(size), (0, 0))
        whole.paste(force, (size[0], 0))
        draw = ImageDraw.Draw(whole)
        x, y = spot(time)
        draw.ellipse([size[0] + x - 6, y - 6, size[0] + x + 6, y + 6], fill=VERMILION)
        text = [caption.text for caption in said if caption.time <= time][-1]
        draw.text((LETTERS, SIDE[1] + 0.5 * STRIP), text, "black", face, anchor="lm")
        slow = face.font_variant(size=LETTERS * 3 // 4)
        draw.text((whole.width - LETTERS, LETTERS), f"{slower:,.0f} times slower", "#555555", slow, anchor="rm")
        yield whole


def _force(response: Response, end: float) -> tuple[Image.Image, Any]:
    """The picture of the force until an end [s], and a function from a time [s] to the pixel on its curve."""
    dpi = 100.0  # sets the size of its letters
    with figures.styled(SIDE[0] / dpi, SIDE[1] / dpi) as figure:
        axes = figure.subplots()
        shown = response.time <= end
        axes.plot(1e3 * response.time[shown], response.force[shown], color=BLUE, lw=1.6)
        axes.set(xlabel="time [ms]", ylabel="force [N]", xlim=(0.0, 1e3 * end))
        axes.set_ylim(bottom=0.0)
        axes.set_title(" ")  # room for how slow the film is
        image = Image.fromarray(pixels(figure, dpi)).resize(SIDE)

    def pixel_of(time: float) -> tuple[float, float]:
        """Pixel of the force at a time [s], from the upper left."""
        force = float(np.interp(time, response.time, response.force, right=0.0))
        x, y = axes.transData.transform((1e3 * time, force))
        return float(x), SIDE[1] - float(y)

    return image, pixel_of
