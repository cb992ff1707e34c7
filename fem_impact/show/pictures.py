"""3D pictures of mode shapes and of the wave of a blow, rendered without a screen; flat ones if rendering fails."""

import io
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from .._base import check, child, progress
from .._base.files import replacing
from ..impact.response import Response
from ..mesh.mesh_files import boundary
from ..modes import viewing
from ..modes.modal import Modes
from . import FORMATS, canvas, figures, sampling

REMEDY = "for 3D pictures install libegl1 and libgl1-mesa-dri"
STILL = tuple(f".{name}" for name in FORMATS)
FRAMES = 48  # [-] default length of an animation: four seconds


@cache
def can_render() -> bool:
    """Whether pyvista can render here; tested once, in a process that may die from a signal, as `try` cannot catch."""
    try:
        return child.run_function("show.canvas:probe", timeout=60.0, **canvas.WINDOW).returncode == 0
    except subprocess.TimeoutExpired:
        return False


@check.typed
def mode_shapes(path: str | Path, modes: Modes, *, count: int = 12, columns: int = 4) -> str:
    """Draw the first mode shapes as a grid of warped surfaces with nodal lines.

    Parameters
    ----------
    path : path ending in .png, .pdf or .svg, in which a surface stays an image
    modes : Modes of a plate or a beam
    count : int, largest number of modes
    columns : int

    Returns
    -------
    str
        Empty, or what to install for a 3D picture if only the flat one of `figures.mode_shapes` could be drawn.
    """
    check.ending(path, *STILL)
    if not can_render():
        figures.save(path, figures.mode_shapes(modes, count=count, columns=columns))
        return REMEDY
    canvas.write_picture(path, canvas.gallery(gallery(modes, count, columns)))
    return ""


@check.typed
def chladni(modes: Modes, *, count: int = 12, columns: int = 4) -> figures.Figure:
    """Draw the nodal lines of a plate's first flexible modes within its outline, flat, as Chladni's sand shows them.

    Parameters
    ----------
    modes : Modes of a plate
    count : int, largest number of modes
    columns : int

    Returns
    -------
    matplotlib.figure.Figure
        Lines only, which stay lines in PDF and SVG files of `figures.save`; above each, its number and frequency.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=6)
    >>> fi.figures.save("chladni.svg", fi.pictures.chladni(plate, columns=3))
    """
    return figures.chladni(modes, count, columns)


def gallery(modes: Modes, count: int = 12, columns: int = 4) -> canvas.Gallery:
    """The first mode shapes of a plate or a beam, ready to be drawn."""
    points, cells, plane = sampling.surface(modes)
    shapes, columns = sampling.gallery(modes, points, count, columns)
    titles = [f"{i + 1}   {figures.in_hertz(modes.frequencies[i])}" for i in range(shapes.shape[1])]
    return canvas.Gallery(plane, cells, shapes, titles, columns, *_shape(modes, points, cells))


def _shape(modes: Modes, points: np.ndarray, cells: np.ndarray) -> tuple[Any, np.ndarray]:
    """Rise of a body at points, and the sides along its ribs."""
    rise = viewing.heights(modes, points)
    return 0.0 if rise is None else rise, viewing.rib_sides(modes, points, cells)


@check.typed
def wave(path: str | Path, response: Response, *, time: float | None = None) -> str:
    """Draw the struck body at one instant, warped by its displacement, with the striker above it.

    Parameters
    ----------
    path : path ending in .png, .pdf or .svg, in which the surface stays an image
    response : Response of a struck plate or beam
    time : float [s], optional
        By default when the deflection under the striker reaches half of its largest value.

    Returns
    -------
    str
        Empty, or what to install for a 3D picture if only a flat one could be drawn.
    """
    check.ending(path, *STILL)
    times = sampling.frame_times(response, FRAMES)
    instant = times[sampling.clearest(response, times)] if time is None else check.non_negative("time", time, "s")
    (frame,) = frames_at(response, np.array([instant]))
    canvas.write_picture(path, frame)
    return "" if can_render() else REMEDY


@check.typed
def animation(path: str | Path, response: Response, *, frames: int = FRAMES) -> str:
    """Animate the wave that leaves the strike point, with the striker and the time.

    Parameters
    ----------
    path : path ending in .gif, or in .mp4, which needs ``pip install 'fem-impact[film]'``
    response : Response of a struck plate or beam
    frames : int, number of frames from the first touch to a third beyond the last contact

    Returns
    -------
    str
        As in `wave`.
    """
    film = check.ending(path, ".gif", ".mp4") == ".mp4"
    encoder = check.extra("imageio_ffmpeg", "film", "an MP4 file") if film else None
    times = sampling.frame_times(response, frames)
    if film:
        with replacing(path) as temporary:
            encode(encoder, temporary, frames_at(response, times))
    else:
        canvas.write_gif(path, list(frames_at(response, times)))
    return "" if can_render() else REMEDY


def encode(encoder: Any, path: Path, pictures: Iterator[Image.Image]) -> None:
    """Write H.264, which every browser and slide program plays; it needs even numbers of pixels."""
    first = next(pictures)
    size = first.width // 2 * 2, first.height // 2 * 2
    writer = encoder.write_frames(str(path), size, fps=canvas.RATE, codec="libx264", macro_block_size=2)
    writer.send(None)
    for picture in (first, *pictures):
        writer.send(np.ascontiguousarray(picture.crop((0, 0, *size))).tobytes())
    writer.close()


def film(response: Response, times: np.ndarray | None = None) -> canvas.Film:
    """The struck body at the given times [s], by default those of an animation, ready to be drawn."""
    modes = response.target
    check.between("dimension of the struck body", modes.dimension, 1, 2)
    points, cells, plane = sampling.surface(modes)
    rows = modes.shapes.at(points)
    usual = sampling.frame_times(response, FRAMES)
    times = usual if times is None else times
    motion = response.modal_state(times)[0] @ rows.T  # (n_times, n_points)
    whole = response.modal_state(usual)[0] @ rows.T
    largest = float(max(np.abs(motion).max(), np.abs(whole).max())) or 1.0
    gap = sampling.gap(response, times)
    titles = [f"{1e3 * time:.3f} ms, deflection up to {1e3 * largest:.3g} mm" for time in times]
    at = np.append(np.atleast_1d(np.asarray(response.at)), [0.0])[:2]
    clearest = sampling.clearest(response, times)
    shape = _shape(modes, points, cells)
    return canvas.Film(plane, cells, boundary(cells), at, motion / largest, gap / largest, titles, clearest, *shape)


def frames_at(response: Response, times: np.ndarray) -> Iterator[Image.Image]:
    """Pictures of the body at the given times [s], all on the same scale."""
    shown = film(response, times)
    if can_render():
        yield from canvas.frames(shown)
        return
    for i, (deflection, title) in enumerate(zip(shown.motion, shown.titles)):
        file = io.BytesIO()
        figures.snapshot(shown.plane, shown.cells, -deflection, shown.at, title).savefig(file, format="png", dpi=100)
        yield Image.open(file).convert("RGB")
        progress.report("frames", i + 1, len(times))
