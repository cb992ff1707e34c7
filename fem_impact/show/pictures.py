"""3D pictures of mode shapes and of the wave of a blow, rendered without a screen; flat ones if rendering fails."""

import io
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from .._base import check
from .._base.files import replacing
from ..impact.response import Response
from ..modes.modal import Modes
from . import figures, sampling

PATIENCE = 60.0  # [s] time limit of the rendering test
REMEDY = "for 3D pictures install libegl1 and libgl1-mesa-dri"
# Runs in its own process: without a driver it dies from a signal, which `try` cannot catch.
PROBE = (
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(16, 16)); p.add_mesh(pyvista.Sphere()); "
    "assert p.screenshot(None).std() > 0"
)
WINDOW = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
SIZE = (720, 480)  # [px] size of a frame: a GIF stays below a few megabytes
TILE = (320, 250)  # [px] size of one mode shape: four side by side on a screen
FRAMES = 48  # [-] default length of an animation: four seconds
RATE = 12  # [1/s] frames per second: enough for a wave, half the size of a film
HEIGHT = 0.12  # [-] largest drawn deflection over the body's extent
LIFT = 0.0015  # [-] height of lines above the surface, over their extent
BALL = 0.03  # [-] drawn radius of the striker over the body's extent
VIEW = (-0.55, -1.0, 0.75)  # direction to the camera: from the front left, above the plate


@cache
def can_render() -> bool:
    """Whether pyvista can render here; tested once, in another process."""
    command = [sys.executable, "-c", PROBE]
    try:
        run = subprocess.run(command, env={**os.environ, **WINDOW}, capture_output=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return False
    return run.returncode == 0


@check.typed
def mode_shapes(path: str | Path, modes: Modes, *, count: int = 12, columns: int = 4) -> str:
    """Draw the first mode shapes as a grid of warped surfaces with nodal lines.

    Parameters
    ----------
    path : path ending in .png
    modes : Modes of a plate or a beam
    count : int, largest number of modes
    columns : int

    Returns
    -------
    str
        Empty, or what to install for a 3D picture if only the flat one of `figures.mode_shapes` could be drawn.
    """
    check.between("dimension of modes", modes.dimension, 1, 2)
    _ending(path, ".png")
    if not can_render():
        figures.save(path, figures.mode_shapes(modes, count=count, columns=columns))
        return REMEDY
    points, cells, plane = sampling.surface(modes)
    shapes, rows, columns = sampling.gallery(modes, points, count, columns)
    plotter = _plotter((TILE[0] * columns, TILE[1] * rows), shape=(rows, columns))
    for i in range(shapes.shape[1]):
        plotter.subplot(*divmod(i, columns))
        mesh = _mesh(plane, cells, HEIGHT * _extent(plane) * shapes[:, i], shapes[:, i])
        _add(plotter, mesh, 1.0)
        _add_line(plotter, mesh.contour([0.0]), "black")
        plotter.add_text(f"{i + 1}   {figures.in_hertz(modes.frequencies[i])}", font_size=9, position="upper_left")
        _look(plotter, plane, zoom=1.15)
    _save(path, plotter)
    return ""


@check.typed
def wave(path: str | Path, response: Response, *, time: float | None = None) -> str:
    """Draw the struck body at one instant, warped by its displacement, with the striker above it.

    Parameters
    ----------
    path : path ending in .png
    response : Response of a struck plate or beam
    time : float [s], optional
        By default when the deflection under the striker reaches half of its largest value.

    Returns
    -------
    str
        Empty, or what to install for a 3D picture if only a flat one could be drawn.
    """
    _ending(path, ".png")
    times = np.linspace(0.0, sampling.end_of(response), FRAMES)
    instant = times[sampling.telling(response, times)] if time is None else check.non_negative("time", time, "s")
    (frame,) = _frames(response, np.array([instant]))
    with replacing(path) as temporary:
        frame.save(temporary)
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
    _ending(path, ".gif", ".mp4")
    film = Path(path).suffix.lower() == ".mp4"
    encoder = check.extra("imageio_ffmpeg", "film", "an MP4 file") if film else None
    times = np.linspace(0.0, sampling.end_of(response), check.count("frames", frames, low=2, high=sampling.MOST_FRAMES))
    if encoder is not None:
        with replacing(path) as temporary:
            _encode(encoder, temporary, _frames(response, times))
        return "" if can_render() else REMEDY
    pictures = list(_frames(response, times))
    colours = _mosaic(pictures[:: max(1, len(pictures) // 8)]).quantize(255)  # one palette avoids flicker
    first, *rest = (picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in pictures)
    with replacing(path) as temporary:
        first.save(temporary, save_all=True, append_images=rest, duration=1000 // RATE, loop=0)
    return "" if can_render() else REMEDY


def _encode(encoder: Any, path: Path, pictures: Iterator[Image.Image]) -> None:
    """Write H.264, which every browser and slide program plays; it needs even numbers of pixels."""
    first = next(pictures)
    size = first.width // 2 * 2, first.height // 2 * 2
    writer = encoder.write_frames(str(path), size, fps=RATE, codec="libx264", macro_block_size=2)
    writer.send(None)
    for picture in (first, *pictures):
        writer.send(np.ascontiguousarray(picture.crop((0, 0, *size))).tobytes())
    writer.close()


def _mosaic(pictures: list[Image.Image]) -> Image.Image:
    mosaic = Image.new("RGB", (pictures[0].width, pictures[0].height * len(pictures)))
    for i, picture in enumerate(pictures):
        mosaic.paste(picture, (0, i * picture.height))
    return mosaic


def _ending(path: str | Path, *endings: str) -> None:
    check.one_of("path ending", check.path("path", path).suffix.lower(), endings)


def _frames(response: Response, times: np.ndarray) -> Iterator[Image.Image]:
    """Pictures of the body at the given times [s], all on the same scale."""
    modes = response.target
    check.between("dimension of the struck body", modes.dimension, 1, 2)
    points, cells, plane = sampling.surface(modes)
    rows = modes.shapes.at(points)
    motion = response.modal_state(times)[0] @ rows.T  # (n_times, n_points)
    whole = response.modal_state(np.linspace(0.0, sampling.end_of(response), FRAMES))[0] @ rows.T
    largest = float(max(np.abs(motion).max(), np.abs(whole).max())) or 1.0
    gap = sampling.gap(response, times)
    for deflection, distance, time in zip(motion, gap, times):
        title = f"{1e3 * time:.3f} ms, deflection up to {1e3 * largest:.3g} mm"
        if can_render():
            yield _in_space(response, plane, cells, deflection / largest, distance / largest, title)
        else:
            yield _in_plane(response, plane, cells, -deflection / largest, title)


def _in_space(response: Response, plane: Any, cells: Any, deflection: Any, distance: float, title: str) -> Image.Image:
    import pyvista

    extent = _extent(plane)
    plotter = _plotter(SIZE)
    _add(plotter, _mesh(plane, cells, -HEIGHT * extent * deflection, -deflection), 1.0)
    at = np.append(np.atleast_1d(np.asarray(response.at)), [0.0])[:2]
    below = deflection[np.argmin(((plane - at) ** 2).sum(axis=1))]
    height = extent * (BALL - HEIGHT * below + min(HEIGHT * distance, 2.0 * HEIGHT))
    plotter.add_mesh(
        pyvista.Sphere(radius=BALL * extent, center=(at[0], at[1], height)),
        color=figures.VERMILION,
        smooth_shading=True,
    )
    plotter.add_text(title, font_size=10, position="upper_left")
    _look(plotter, plane)
    picture = plotter.screenshot(None)
    plotter.close()
    return Image.fromarray(picture)


def _in_plane(response: Response, plane: Any, cells: Any, deflection: Any, title: str) -> Image.Image:
    file = io.BytesIO()
    figures.snapshot(plane, cells, deflection, np.atleast_1d(np.asarray(response.at)), title).savefig(
        file, format="png", dpi=100
    )
    return Image.open(file).convert("RGB")


def _plotter(size: Any, **options: Any) -> Any:
    os.environ.setdefault(*next(iter(WINDOW.items())))  # VTK reads this when it opens its first window
    import pyvista

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=size, border=False, **options)
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def _mesh(plane: np.ndarray, cells: np.ndarray, height: np.ndarray, value: np.ndarray) -> Any:
    import pyvista

    faces = np.column_stack([np.full(len(cells), 3), cells]).ravel()
    mesh = pyvista.PolyData(np.column_stack([plane, height]), faces)
    mesh["deflection"] = value
    return mesh


def _add(plotter: Any, mesh: Any, limit: float) -> None:
    plotter.add_mesh(
        mesh, scalars="deflection", cmap=figures.COLOURS, clim=(-limit, limit), smooth_shading=True,
        show_scalar_bar=False, ambient=0.4, diffuse=0.6, specular=0.0,
    )  # fmt: skip
    rim = mesh.extract_feature_edges(feature_edges=False, manifold_edges=False, non_manifold_edges=False)
    _add_line(plotter, rim, "#666666")


def _add_line(plotter: Any, line: Any, colour: str) -> None:
    """Draw a line on the surface, raised a little so that the surface does not hide it."""
    if line.n_points:
        plotter.add_mesh(line.translate((0.0, 0.0, LIFT * line.length)), color=colour, line_width=2)


def _look(plotter: Any, plane: np.ndarray, zoom: float = 1.35) -> None:
    """Set the camera, the same for every picture of a body whatever its deflection."""
    low, high = plane.min(axis=0), plane.max(axis=0)
    rise = HEIGHT * _extent(plane)
    plotter.camera_position = [tuple(VIEW), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera(bounds=(low[0], high[0], low[1], high[1], -rise, rise))
    plotter.camera.zoom(zoom)
    plotter.reset_camera_clipping_range()  # the striker may lie outside the bounds


def _extent(plane: np.ndarray) -> float:
    return float(np.ptp(plane, axis=0).max())


def _save(path: str | Path, plotter: Any) -> None:
    picture = plotter.screenshot(None)
    plotter.close()
    with replacing(path) as temporary:
        Image.fromarray(picture).save(temporary)
