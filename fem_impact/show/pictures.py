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

from .._base import check, progress
from .._base.files import replacing
from ..impact.response import Response
from ..mesh.mesh_files import boundary
from ..modes.modal import Modes
from . import figures, sampling

PATIENCE = 60.0  # [s] time limit of the rendering test
REMEDY = "for 3D pictures install libegl1 and libgl1-mesa-dri"
# Runs in its own process: without a driver it dies from a signal, which `try` cannot catch.
PROBE = (
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(16, 16)); p.add_mesh(pyvista.Sphere()); "
    "assert p.screenshot(None).std() > 0"
)
EXPENDABLE = "FEM_IMPACT_EXPENDABLE"  # environment variable of a process that may die from the rendering test
WINDOW = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
SIZE = (720, 480)  # [px] size of a frame: a GIF stays below a few megabytes
FINER = 2  # [-] a frame is drawn with so many pixels for one in each direction, which makes its lines smooth
TILE = (320, 250)  # [px] size of one mode shape: four side by side on a screen
FRAMES = 48  # [-] default length of an animation: four seconds
RATE = 12  # [1/s] frames per second: enough for a wave, half the size of a film
HEIGHT = 0.12  # [-] largest drawn deflection over the body's extent
LIFT = 0.0015  # [-] height of lines above the surface, over their extent
BALL = 0.03  # [-] drawn radius of the striker over the body's extent
RIM = "#666666"  # colour of the body's edge
VIEW = (-0.55, -1.0, 0.75)  # direction to the camera: from the front left, above the plate


@cache
def can_render() -> bool:
    """Whether pyvista can render here; tested once, in another process unless this one is expendable."""
    if EXPENDABLE in os.environ:
        exec(PROBE, {})
        return True
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
        _add_surface(plotter, mesh)
        rim = mesh.extract_feature_edges(feature_edges=False, manifold_edges=False, non_manifold_edges=False)
        _add_line(plotter, rim, RIM)
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
    pictures = []
    for picture in _frames(response, times):
        pictures.append(picture)
        progress.report("frames", len(pictures), len(times))
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
    titles = [f"{1e3 * time:.3f} ms, deflection up to {1e3 * largest:.3g} mm" for time in times]
    if not can_render():
        for deflection, title in zip(motion, titles):
            yield _in_plane(response, plane, cells, -deflection / largest, title)
        return
    space = _Space(plane, cells, np.append(np.atleast_1d(np.asarray(response.at)), [0.0])[:2])
    try:
        for deflection, distance, title in zip(motion / largest, gap / largest, titles):
            yield space.picture(deflection, distance, title)
    finally:
        space.plotter.close()


class _Space:
    """A window with body, striker and title, which move from frame to frame: a new window takes 0.2 s each."""

    def __init__(self, plane: np.ndarray, cells: np.ndarray, at: np.ndarray) -> None:
        import pyvista

        self.plane, self.cells, self.at, self.extent = plane, cells, at, _extent(plane)
        self.under = int(np.argmin(((plane - at) ** 2).sum(axis=1)))  # the striker
        self.plotter = _plotter((FINER * SIZE[0], FINER * SIZE[1]))
        self.plotter.disable_anti_aliasing()  # several pixels become one, in half the time
        self.mesh = _mesh(plane, cells, np.zeros(len(plane)), np.zeros(len(plane)))
        self.mesh.point_data["Normals"] = _normals(self.mesh.points, cells)
        _add_surface(self.plotter, self.mesh)
        sides = boundary(cells)
        self.rim = pyvista.PolyData(self.mesh.points, lines=np.column_stack([np.full(len(sides), 2), sides]).ravel())
        self.plotter.add_mesh(self.rim, color=RIM, line_width=2 * FINER, render=False)
        ball = pyvista.Sphere(radius=BALL * self.extent)
        self.ball = self.plotter.add_mesh(ball, color=figures.VERMILION, smooth_shading=True, render=False)
        _look(self.plotter, plane)

    def picture(self, deflection: np.ndarray, distance: float, title: str) -> Image.Image:
        """One frame; deflection (n_points,) and distance of the striker in units of the largest deflection."""
        height = -HEIGHT * self.extent * deflection
        points = np.column_stack([self.plane, height])
        self.mesh.points, self.mesh["deflection"] = points, -deflection
        self.mesh.point_data["Normals"] = _normals(points, self.cells)
        self.rim.points = points + np.array([0.0, 0.0, LIFT * self.mesh.length])
        above = self.extent * (BALL + min(HEIGHT * distance, 2.0 * HEIGHT))
        self.ball.position = (*self.at, height[self.under] + above)
        self.plotter.add_text(title, font_size=10 * FINER, position="upper_left", name="title", render=False)
        self.plotter.reset_camera_clipping_range()  # the striker may lie outside the bounds
        self.plotter.render()
        return Image.fromarray(self.plotter.screenshot(None)).reduce(FINER)


def _normals(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Unit normals (n_points, 3) of a surface of triangles: means over the triangles at each point, by area."""
    a, b, c = points[cells.T]
    across = np.cross(b - a, c - a)
    total = np.column_stack([np.bincount(cells.T.ravel(), np.tile(one, 3), len(points)) for one in across.T])
    return total / np.linalg.norm(total, axis=1, keepdims=True)


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


def _add_surface(plotter: Any, mesh: Any) -> None:
    plotter.add_mesh(
        mesh, scalars="deflection", cmap=figures.COLOURS, clim=(-1.0, 1.0), smooth_shading=True,
        show_scalar_bar=False, ambient=0.4, diffuse=0.6, specular=0.0, render=False,
    )  # fmt: skip


def _add_line(plotter: Any, line: Any, colour: str) -> None:
    """Draw a line on the surface, raised a little so that the surface does not hide it."""
    if line.n_points:
        raised = line.translate((0.0, 0.0, LIFT * line.length))
        plotter.add_mesh(raised, color=colour, line_width=2, render=False)


def _look(plotter: Any, plane: np.ndarray, zoom: float = 1.35) -> None:
    """Set the camera, the same for every picture of a body whatever its deflection."""
    low, high = plane.min(axis=0), plane.max(axis=0)
    rise = HEIGHT * _extent(plane)
    plotter.camera_position = [tuple(VIEW), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera(render=False, bounds=(low[0], high[0], low[1], high[1], -rise, rise))
    plotter.camera.zoom(zoom)


def _extent(plane: np.ndarray) -> float:
    return float(np.ptp(plane, axis=0).max())


def _save(path: str | Path, plotter: Any) -> None:
    picture = plotter.screenshot(None)
    plotter.close()
    with replacing(path) as temporary:
        Image.fromarray(picture).save(temporary)
