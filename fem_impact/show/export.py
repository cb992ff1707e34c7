"""Writes files: mode shapes and motion for ParaView, sound, tables, and numbers as JSON."""

import base64
import csv
import io
import json
import math
import platform
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from .._base import check
from .._base.files import replacing, write_whole
from .._base.rounding import SAME
from ..impact.assumption import table
from ..impact.response import Response
from ..model.by_vectors import AUDIBLE
from ..model.planner import Run
from ..model.playing import Strokes
from ..modes import universal_files, viewing
from ..modes.body import Body
from ..modes.modal import Modes
from . import sampling, sound
from .histories import write_history

__all__ = [
    "csv_text", "numbers", "plain", "run_data", "versions", "vtk_ending", "write_animation", "write_force",
    "write_history", "write_json", "write_sound", "write_uff", "write_vtk", "write_wav",
]  # fmt: skip

PACKAGES = ("fem-impact", "numpy", "scipy", "scikit-fem", "netgen-mesher", "numba")
CELL_TYPE = {1: 1, 2: 3, 3: 5}  # number of points: VTK's code for a vertex, line or triangle
KIND = {"f": "Float64", "i": "Int64", "u": "UInt8"}


@check.typed
def write_vtk(path: str | Path, modes: Modes | Body, response: Response | None = None, times: Any = None) -> None:
    """Write mode shapes, or the motion after a strike, for ParaView and pyvista.

    Parameters
    ----------
    path : path ending in .vtu (one file) or .pvd (a collection, its parts in a folder of the same name)
        Modes in a .vtu: one point array ``mode_001`` ... per mode, with all frequencies as field data. Modes in a
        .pvd: one part per mode, with its frequency as time value and field data, ``shape`` [kg**-0.5] and a ``warp``
        vector for display. Motion: one part per time (a .vtu takes only one time), with ``displacement`` [m] and
        ``velocity`` [m/s] of the kept modes; the contact ``force`` [N] and, for a strike, the position of the
        ``striker`` [m] as field data. They point along the blow in z. On a curved plate z is the rise, towards the
        striker, so that their z is negative along the blow.
    modes : Modes or Body
        Of a body of another program, shapes and motion are vectors at its nodes, on the cells of its surface.
    response : Response, optional
        Write its motion instead of the mode shapes; ``modes`` must then be those of the struck body, or the `Body` of
        which they are.
    times : array_like, shape (n_times,) [s], optional
        Times of the motion; required with response.

    Raises
    ------
    ValueError
        If the path has another ending, or times are missing.

    Examples
    --------
    >>> modes = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=4)
    >>> fi.export.write_vtk("modes.pvd", modes)  # opens in ParaView
    """
    path = check.path("path", path)
    suffix = vtk_ending(path)
    if isinstance(modes, Body):
        points = places = modes.nodes
        cells = modes.cells if len(modes.cells) else np.arange(len(points))[:, None]
    else:
        points, cells = viewing.grid(modes)
        places = viewing.places_in_space(modes, points)
    if response is None:
        parts = _mode_parts(modes, points)
        stamps = np.array(modes.frequencies, float)
        for i in range(1, len(stamps)):  # equal ones become distinct
            stamps[i] = max(stamps[i], stamps[i - 1] + SAME * max(stamps[i - 1], 1.0))
    else:
        if times is None:
            raise ValueError("times must be given with response, as an array in s")
        stamps = check.array("times", times, (None,), "s", lift=True)
        parts = _motion_parts(response, points, stamps, modes if isinstance(modes, Body) else None)
    if suffix == ".pvd":
        _write_collection(path, places, cells, parts, stamps)
    elif response is None:
        arrays = {f"mode_{i + 1:03d}": part[0]["shape"] for i, part in enumerate(parts)}
        _write_vtu(path, places, cells, arrays, {"frequency": modes.frequencies, "damping_ratio": modes.damping_ratio})
    elif len(parts) == 1:
        _write_vtu(path, places, cells, *parts[0])
    else:
        raise ValueError(f"times must be one time for a .vtu, got {len(parts)}; write a .pvd")


@check.typed
def write_animation(path: str | Path, modes: Modes, mode: int, *, frames: int = 24) -> None:
    """Write one period of a mode's vibration for ParaView and pyvista to play.

    Parameters
    ----------
    path : path ending in .pvd; its parts go to a folder of the same name
        One part per frame, with its time [s] as time value and the vector ``warp``, at most a tenth of the body's
        extent.
    modes : Modes
    mode : int, number of the mode, from 1
    frames : int, number of frames, evenly spaced over the period

    Raises
    ------
    ValueError
        If the path has another ending, or the mode does not exist or is a rigid motion.
    """
    path = check.path("path", path)
    if vtk_ending(path) != ".pvd":
        raise ValueError(f"path must end in .pvd to hold several times, got {str(path)!r}")
    if check.count("mode", mode) > modes.n_modes:
        raise ValueError(f"mode must be at most {modes.n_modes}, got {mode}")
    frequency = float(modes.frequencies[mode - 1])
    if frequency == 0.0:
        raise ValueError(f"mode must be a flexible mode, but mode {mode} is a rigid motion; take a higher one")
    turns = np.arange(check.count("frames", frames, low=2, high=sampling.MOST_FRAMES)) / frames
    points, cells = viewing.grid(modes)
    arrays, fields = _mode_parts(modes, points)[mode - 1]
    parts = [({"warp": np.cos(2.0 * np.pi * turn) * arrays["warp"]}, fields) for turn in turns]
    _write_collection(path, viewing.places_in_space(modes, points), cells, parts, turns / frequency)


def vtk_ending(path: str | Path) -> str:
    """Ending of a path, if `write_vtk` can write it; ValueError otherwise."""
    return check.ending(path, ".vtu", ".pvd")


@check.typed
def write_uff(path: str | Path, modes: Modes) -> None:
    """Write mode shapes as a universal file for modal-test programs: nodes (15, 2411), cells (2412), shapes (55).

    Nodes of a curved plate have its rise as z. The deflection is in z, normalised to modal mass 1; numbers have six
    digits. Needs pyuff: ``pip install 'fem-impact[uff]'``. `Modes.from_uff` reads the file back, without the static
    compliance, which has no place in it: a blow then counts the error of an estimate.

    Examples
    --------
    >>> modes = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=4)
    >>> fi.export.write_uff("modes.uff", modes)
    >>> fi.Modes.from_uff("modes.uff", mass=0.2).frequencies.round(2).tolist()
    [100.0, 208.0, 292.0, 388.0]
    """
    if modes.dimension == 0:
        raise ValueError("modes must be those of a plate or beam, got a rigid mass, which has no shape to write")
    points, cells = modes.shapes.grid()
    with replacing(path) as temporary:
        shapes, places = modes.shape_at(points), viewing.places_in_space(modes, points)
        universal_files.write_modes(temporary, modes.frequencies, modes.damping_ratio, shapes, places, cells)


@check.typed
def write_wav(
    path: str | Path, response: Response | Strokes, at: Any = None, *, listener: Any = None, **options: Any
) -> sound.Sound:
    """Write the sound of a blow as 32-bit float WAV, with a fade at its end, and return it.

    A sample of 1 means the power of ten [m/s] or [Pa] just above the peak, so that every blow is audible; with
    ``normalise=True`` it means the peak. The true level stays in the comment of the file and in `Sound.stated`.

    The sound is the velocity of the point ``at`` (see `sound.synthesise`) or, with a ``listener``, the pressure near a
    plate (see `sound.radiate`); ``options`` go to that function.

    Examples
    --------
    >>> modes = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=20, damping_ratio=0.01)
    >>> hit = fi.strike(modes, fi.Striker.rigid(0.03), fi.Contact.linear(1e5), at=(0.13, 0.1), speed=1.0)
    >>> sound = fi.export.write_wav("strike.wav", hit, at=(0.2, 0.2))
    >>> sound.rate, sound.full_scale, sound.unit
    (48000, 1.0, 'm/s')
    """
    if listener is None:
        heard = sound.synthesise(response, at, **options)
    else:
        heard = sound.radiate(response, listener, **options)
    return write_sound(path, heard if options.get("normalise") else heard.audible())


@check.typed
def write_sound(path: str | Path, heard: sound.Sound) -> sound.Sound:
    """Write samples as 32-bit float WAV, one channel or several, with a fade at the end; return what was written.

    Examples
    --------
    >>> tone = fi.sound.Sound(np.sin(np.arange(4800.0)), 48000, 1.0, "Pa")
    >>> fi.export.write_sound("both.wav", fi.sound.together([tone, tone])).samples.shape
    (4800, 2)
    """
    check.ending(path, ".wav")
    check.instance("heard", heard, sound.Sound)
    heard = heard.faded()
    write_whole(path, heard.wav())
    return heard


@check.typed
def write_force(path: str | Path, response: Response | Strokes) -> None:
    """Write the force history as CSV in full precision: a header with units, then one row per instant.

    Of several contacts each has a column: ``force_1 [N]``, ``force_2 [N]`` and so on.

    Examples
    --------
    >>> hit = fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=None, speed=1.0)
    >>> fi.export.write_force("force.csv", hit)
    """
    forces = np.atleast_2d(response.force.T)  # (n_contacts, n_times)
    names = ["force [N]"] if len(forces) == 1 else [f"force_{i} [N]" for i in range(1, len(forces) + 1)]
    write_whole(path, csv_text(**{"time [s]": response.time, **dict(zip(names, forces))}))


@check.typed
def write_json(path: str | Path, data: dict[str, Any]) -> None:
    """Write plain data as JSON that every reader accepts, without NaN or infinity (see `plain`).

    Examples
    --------
    >>> hit = fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=None, speed=1.0)
    >>> fi.export.write_json("hit.json", fi.export.numbers(hit))
    """
    write_whole(path, json.dumps(plain(data), indent=2, allow_nan=False) + "\n")


SCALARS = (
    "n_impacts", "margin", "contact_time", "peak_force", "impulse", "restitution", "speed", "energies", "dissipated",
    "energy_error", "momentum_error", "tolerance", "tolerance_met", "trusted", "verdict", "finished", "in_contact",
    "scheme",
)  # fmt: skip
ERROR_PARTS = (
    "step", "truncation", "mesh", "idealisation", "inherited", "measurement", "sensitivity", "total", "resolvable",
)  # fmt: skip
IMPACT_PARTS = ("start", "end", "peak_force", "impulse", "contact", "restitution")


@check.typed
def numbers(response: Response) -> dict[str, Any]:
    """All scalars of a response by name, in SI units, and its impacts.

    Examples
    --------
    >>> hit = fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=None, speed=1.0)
    >>> round(fi.export.numbers(hit)["response"]["restitution"], 3)  # of 1 kg that yields
    0.818
    """
    centroid = None  # without contact, or if the blow is too long for a band up to AUDIBLE
    with suppress(ValueError):
        centroid = response.spectral_centroid(AUDIBLE)
    data = {name: getattr(response, name) for name in SCALARS} | {
        "spectral_centroid": {"value": centroid, "max_frequency": AUDIBLE},
        "error": {name: getattr(response.error, name) for name in ERROR_PARTS},
        "model_error": response.model_error,
        "assumptions": table(response.assumptions),
        "trust": response.trust.table(),
        "n_modes": response.target.n_modes,
        "max_frequency": response.target.frequencies[-1],
    }
    return {
        "response": data,
        "impacts": [{name: getattr(impact, name) for name in IMPACT_PARTS} for impact in response.impacts],
    }


def run_data(run: Run, scene: dict[str, Any]) -> dict[str, Any]:
    """Everything a run found, as plain data: its numbers, plan, notes and seconds, and the tables of its scene."""
    data = {"plan": run.plan.data(), "scene": scene, "seconds": dict(run.seconds), "notes": list(run.notes)}
    return plain({**numbers(run.response), **data, "versions": versions()})


def csv_text(**columns: np.ndarray) -> str:
    """Columns of numbers as CSV in full precision, under a header with their names and units."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(values.tolist() for values in columns.values())))
    return file.getvalue()


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that compute the numbers."""
    return {"python": platform.python_version(), **{name: metadata.version(name) for name in PACKAGES}}


def plain(value: Any) -> Any:
    """The same data as dicts, lists, strings and finite numbers; NaN and infinity become None."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, (bool, int, str)):
        return value
    return str(value)


def _mode_parts(modes: Modes | Body, points: np.ndarray) -> list[tuple[dict, dict]]:
    own = isinstance(modes, Modes)
    shapes = modes.shapes.at(points) if isinstance(modes, Modes) else modes.shapes  # (n_points, n_modes) or (, 3, )
    extent = float(np.ptp(points, axis=0).max(initial=0.0)) or 1.0
    largest = np.abs(shapes).max(axis=tuple(range(shapes.ndim - 1)), initial=0.0)
    warp = np.zeros((len(modes.frequencies), len(points), 3))
    # the largest deflection is a tenth of the body's extent
    drawn = np.moveaxis(shapes * (0.1 * extent / np.where(largest > 0.0, largest, 1.0)), -1, 0)
    warp[:, :, 2 if own else slice(None)] = drawn
    return [
        (
            {"shape": shapes[..., i].copy(), "warp": warp[i]},
            {"mode": i + 1, "frequency": modes.frequencies[i], "damping_ratio": modes.damping_ratio[i]},
        )
        for i in range(len(modes.frequencies))
    ]


def _motion_parts(
    response: Response, points: np.ndarray, times: np.ndarray, body: Body | None = None
) -> list[tuple[dict, dict]]:
    """Displacements and velocities (n_times, n_points, 3), one part per time, with the forces and the striker then."""
    fields: list[dict[str, Any]] = [{"time": t} for t in times]
    for i in range(response.history.n_contacts):
        name = "force" if response.history.n_contacts == 1 else f"force_{i + 1}"
        for field, force in zip(fields, response.history.force_at(times, i)[0]):
            field[name] = force
    states = response.modal_state(times)
    if body is not None:
        moves = [body.displacement(state) for state in states]
    else:
        # Kept modes only: the residual dip would need a static solution for every grid point. `shapes.at` also accepts
        # the midpoints of chords along a hole, which lie just off the body.
        along = 1.0 if viewing.heights(response.target, points[:1]) is None else -1.0  # the blow, in z
        rows, moves = response.target.shapes.at(points), []  # (n_points, n_modes)
        for state in states:
            vector = np.zeros((len(times), len(points), 3))
            vector[:, :, 2] = along * state @ rows.T  # (n_times, n_points)
            moves.append(vector)
        if response.striker is not None and response.at is not None:
            at = viewing.places_in_space(response.target, np.atleast_2d(response.at))
            tip = response.displacement(response.striker.at[None], times, body=0)[:, 0]
            for field, way in zip(fields, tip):
                field["striker"] = at + np.array([0.0, 0.0, along * way])
    return [({"displacement": d, "velocity": v}, field) for d, v, field in zip(*moves, fields)]


def _write_collection(path: Path, points, cells, parts: list[tuple[dict, dict]], stamps: np.ndarray) -> None:
    """Write the parts first and the collection last, so that it never names a missing file."""
    folder = path.with_suffix("")
    folder.mkdir(exist_ok=True)
    lines = []
    for i, ((arrays, fields), stamp) in enumerate(zip(parts, stamps)):
        name = f"{path.stem}_{i + 1:03d}.vtu"
        _write_vtu(folder / name, points, cells, arrays, {**fields, "TimeValue": stamp})
        file = quoteattr(f"{folder.name}/{name}")
        lines.append(f'<DataSet timestep="{float(stamp)!r}" group="" part="0" file={file}/>')
    body = "\n".join(lines)
    text = f'<VTKFile type="Collection" version="0.1">\n<Collection>\n{body}\n</Collection>\n</VTKFile>\n'
    write_whole(path, '<?xml version="1.0"?>\n' + text)


def _write_vtu(path: Path, points: np.ndarray, cells: np.ndarray, arrays: dict, fields: dict) -> None:
    """Write points (n_points, 3) and cells as binary VTK XML.

    Written here, as meshio would drop the field data and pyvista would load all of VTK.
    """
    offsets = np.arange(1, len(cells) + 1) * cells.shape[1]
    types = np.full(len(cells), CELL_TYPE[cells.shape[1]], np.uint8)
    field_data = "".join(_data_array(k, np.atleast_1d(v), tuples=True) for k, v in fields.items())
    point_data = "".join(_data_array(k, v) for k, v in arrays.items())
    geometry = _data_array("Points", points)
    cell_data = "".join(
        _data_array(name, array)
        for name, array in (("connectivity", cells.reshape(-1)), ("offsets", offsets), ("types", types))
    )
    write_whole(
        path,
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64">\n<UnstructuredGrid>\n'
        f"<FieldData>\n{field_data}</FieldData>\n"
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">\n'
        f"<PointData>\n{point_data}</PointData>\n<Points>\n{geometry}</Points>\n<Cells>\n{cell_data}</Cells>\n"
        "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
    )


def _data_array(name: str, values: Any, tuples: bool = False) -> str:
    array = np.asarray(values)
    kind = KIND[array.dtype.kind]
    raw = np.ascontiguousarray(array, dtype=np.dtype(kind.lower()).newbyteorder("<")).tobytes()
    text = base64.b64encode(len(raw).to_bytes(8, "little") + raw).decode("ascii")
    shape = f' NumberOfTuples="{len(array)}"' if tuples else ""
    width = f' NumberOfComponents="{array.shape[1]}"' if array.ndim == 2 else ""
    return f'<DataArray type="{kind}" Name={quoteattr(name)}{shape}{width} format="binary">{text}</DataArray>\n'
