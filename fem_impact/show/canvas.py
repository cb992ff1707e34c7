"""Draws pictures in 3D from arrays alone, without a screen; as a process of its own it starts while a blow is computed.

Nothing of the package is imported here but how files appear and how progress is reported, and pyvista only to draw.
"""

import base64
import io
import os
import pickle
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from .._base import progress
from .._base.files import replacing

NAMES = ("modes", "wave")  # of the pictures of a blow, besides wave.gif
WINDOW = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
SIZE = (720, 480)  # [px] size of a frame: a GIF stays below a few megabytes
FINER = 2  # [-] a frame is drawn with so many pixels for one in each direction, which makes its lines smooth
RATE = 12  # [1/s] frames per second: enough for a wave, half the size of a film
HEIGHT = 0.12  # [-] largest drawn deflection over the body's extent
LIFT = 0.0015  # [-] height of lines above the surface, over their extent
RIM, VERMILION, RIB = "#666666", "#D55E00", "#009E73"  # colours of the body's edge, of the striker and of ribs
COLOURS = "PuOr"  # of deflections: symmetric about zero, safe for colour-blind readers


class Film(NamedTuple):
    """A body and a striker at several instants."""

    plane: np.ndarray  # (n_points, 2) [m]
    cells: np.ndarray  # (n_cells, 3)
    rim: np.ndarray  # (n_sides, 2) sides at the edge
    at: np.ndarray  # (2,) [m] strike point
    motion: np.ndarray  # (n_times, n_points) [-] deflection over the largest
    gap: np.ndarray  # (n_times,) [-] distance of the striker over the largest deflection
    titles: list[str]
    clearest: int  # number of the frame that shows the wave best
    rise: Any = 0.0  # (n_points,) [m] of a curved plate
    ribs: Any = ()  # (n_sides, 2) sides along ribs


class Gallery(NamedTuple):
    """The shapes of a body, each with largest value 1."""

    plane: np.ndarray  # (n_points, 2) [m]
    cells: np.ndarray  # (n_cells, 3)
    shapes: np.ndarray  # (n_points, n_shapes)
    titles: list[str]
    columns: int
    rise: Any = 0.0  # (n_points,) [m] of a curved plate
    ribs: Any = ()  # (n_sides, 2) sides along ribs


def probe() -> None:
    """End the process if nothing renders here; a signal may end it, too."""
    import pyvista

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[16, 16])
    plotter.add_mesh(pyvista.Sphere())
    if not plotter.screenshot(None).std() > 0:
        sys.exit(1)


def main() -> None:
    """The process: reads folder, film and shapes, writes the pictures, and prints the progress."""
    probe()  # takes seconds, during which the response is computed
    folder, film, shapes, form = pickle.load(sys.stdin.buffer)
    with progress.observed(lambda _, done, total: print(f"{done}/{total}", flush=True)):
        draw(folder, film, shapes, form)


def draw(folder: Path, film: Film, shapes: Gallery, form: str = "png") -> None:
    """Draw all pictures of a blow into a folder, in a format of `show.FORMATS`."""
    pictures = list(frames(film))
    write_gif(folder / "wave.gif", pictures)
    write_picture(folder / f"wave.{form}", pictures[film.clearest])
    write_picture(folder / f"modes.{form}", gallery(shapes))


def frames(film: Film) -> Iterator[Image.Image]:
    """A picture of body, striker and title at every instant, all on the same scale.

    They move in one window: a new one takes 0.2 s each.
    """
    import pyvista

    plane, cells, extent = film.plane, film.cells, _extent(film.plane)
    rise = film.rise + np.zeros(len(plane))
    under = int(np.argmin(((plane - film.at) ** 2).sum(axis=1)))  # the striker
    plotter = _plotter((FINER * SIZE[0], FINER * SIZE[1]))
    plotter.disable_anti_aliasing()  # several pixels become one, in half the time
    mesh = _mesh(plane, cells, rise, np.zeros(len(plane)))
    _add_surface(plotter, mesh)
    lines = [_sides(mesh.points, sides) for sides in (film.rim, film.ribs)]
    for line, colour in zip(lines, (RIM, RIB)):
        if line.n_cells:
            plotter.add_mesh(line, color=colour, line_width=2 * FINER, render=False)
    radius = 0.03 * extent  # of the striker
    ball = plotter.add_mesh(pyvista.Sphere(radius=radius), color=VERMILION, smooth_shading=True, render=False)
    _look(plotter, plane, rise)
    try:
        for i, (deflection, gap, title) in enumerate(zip(film.motion, film.gap, film.titles)):
            height = rise - HEIGHT * extent * deflection
            points = np.column_stack([plane, height])
            mesh.points, mesh["deflection"] = points, -deflection
            mesh.point_data["Normals"] = _normals(points, cells)
            for line in lines:
                line.points = points + np.array([0.0, 0.0, LIFT * mesh.length])
            above = radius + extent * min(HEIGHT * float(gap), 2.0 * HEIGHT)
            ball.position = (*film.at, height[under] + above)
            _write(plotter, title, 10 * FINER, name="title", render=False)
            plotter.reset_camera_clipping_range()  # the striker may lie outside the bounds
            plotter.render()
            yield Image.fromarray(plotter.screenshot(None)).reduce(FINER)
            progress.report("frames", i + 1, len(film.titles))
    finally:
        plotter.close()


def gallery(shown: Gallery) -> Image.Image:
    """Shapes side by side, as warped surfaces with nodal lines."""
    rows = -(-len(shown.titles) // shown.columns)
    # [px] of one mode shape 320 by 250: four side by side on a screen
    plotter = _plotter((320 * shown.columns, 250 * rows), shape=(rows, shown.columns))
    for i, title in enumerate(shown.titles):
        plotter.subplot(*divmod(i, shown.columns))
        shape = shown.shapes[:, i]
        mesh = _mesh(shown.plane, shown.cells, shown.rise + HEIGHT * _extent(shown.plane) * shape, shape)
        _add_surface(plotter, mesh)
        rim = mesh.extract_feature_edges(feature_edges=False, manifold_edges=False, non_manifold_edges=False)
        _add_line(plotter, rim, RIM)
        _add_line(plotter, _sides(mesh.points, shown.ribs), RIB)
        _add_line(plotter, mesh.contour([0.0]), "black")
        _write(plotter, title, 9)
        _look(plotter, shown.plane, shown.rise, zoom=1.15)
    picture = Image.fromarray(plotter.screenshot(None))
    plotter.close()
    return picture


def write_picture(path: str | Path, picture: Image.Image) -> None:
    """Write a picture, whole or not at all; the ending sets the format."""
    with replacing(path) as temporary:
        if Path(path).suffix.lower() != ".svg":
            picture.save(temporary)
            return
        file = io.BytesIO()
        picture.save(file, format="png")
        data, (width, height) = base64.b64encode(file.getvalue()).decode("ascii"), picture.size
        size = f'width="{width}" height="{height}"'
        temporary.write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 {width} {height}">'
            f'<image {size} href="data:image/png;base64,{data}"/></svg>\n',
            encoding="utf-8",
        )


def write_gif(path: str | Path, pictures: list[Image.Image]) -> None:
    """Write pictures as an animation with one palette, so that its colours do not flicker."""
    some = [picture.reduce(2) for picture in pictures[:: max(1, len(pictures) // 8)]]
    mosaic = Image.new("RGB", (some[0].width, some[0].height * len(some)))
    for i, picture in enumerate(some):
        mosaic.paste(picture, (0, i * picture.height))
    colours = mosaic.quantize(255)
    first, *rest = (picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in pictures)
    with replacing(path) as temporary:
        first.save(temporary, save_all=True, append_images=rest, duration=1000 // RATE, loop=0)


def _normals(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Unit normals (n_points, 3) of a surface of triangles: means over the triangles at each point, by area."""
    a, b, c = points[cells.T]
    across = np.cross(b - a, c - a)
    total = np.column_stack([np.bincount(cells.T.ravel(), np.tile(one, 3), len(points)) for one in across.T])
    return total / np.linalg.norm(total, axis=1, keepdims=True)


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
    mesh.point_data["Normals"] = _normals(mesh.points, cells)
    return mesh


def _sides(points: np.ndarray, sides: Any) -> Any:
    """Lines between numbered points."""
    import pyvista

    pairs = np.reshape(sides, (-1, 2)).astype(int)
    return pyvista.PolyData(points, lines=np.column_stack([np.full(len(pairs), 2), pairs]).ravel())


def _add_surface(plotter: Any, mesh: Any) -> None:
    shown = plotter.add_mesh(
        mesh, scalars="deflection", cmap=COLOURS, clim=(-1.0, 1.0), show_scalar_bar=False, ambient=0.4, diffuse=0.6,
        specular=0.0, render=False,
    )  # fmt: skip
    shown.prop.interpolation = "phong"  # smooth_shading=True would compute the normals again for every picture


def _add_line(plotter: Any, line: Any, colour: str) -> None:
    """Draw a line on the surface, raised a little so that the surface does not hide it."""
    if line.n_points and line.n_cells:
        raised = line.translate((0.0, 0.0, LIFT * line.length))
        plotter.add_mesh(raised, color=colour, line_width=2, render=False)


def _write(plotter: Any, title: str, size: int, **options: Any) -> None:
    """Write a title, in one font whatever other libraries made the default of the process."""
    plotter.add_text(title, font_size=size, font="arial", color="black", position="upper_left", **options)


def _look(plotter: Any, plane: np.ndarray, rise: Any = 0.0, zoom: float = 1.35) -> None:
    """Set the camera, the same for every picture of a body whatever its deflection."""
    low, high = plane.min(axis=0), plane.max(axis=0)
    room = HEIGHT * _extent(plane)
    bottom, top = float(np.min(rise)) - room, float(np.max(rise)) + room
    # from the front left, above the plate
    plotter.camera_position = [(-0.55, -1.0, 0.75), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera(render=False, bounds=(low[0], high[0], low[1], high[1], bottom, top))
    plotter.camera.zoom(zoom)


def _extent(plane: np.ndarray) -> float:
    return float(np.ptp(plane, axis=0).max())
