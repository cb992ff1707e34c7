"""What leaves the program as files: mode shapes and motion for ParaView, sound, tables, and the numbers as JSON."""

import base64
import csv
import json
import math
import platform
from importlib import metadata
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from scipy.io import wavfile

from . import _check, drawing, sound, uff
from ._files import replacing, staged
from .modal import Modes
from .response import Response

__all__ = [
    "numbers",
    "plain",
    "staged",
    "versions",
    "vtk_ending",
    "write_animation",
    "write_force",
    "write_json",
    "write_uff",
    "write_vtk",
    "write_wav",
]

CENTROID_BAND = 20e3  # [Hz] the spectral centroid is that of the force up to here: about what is heard
PACKAGES = ("fem-impact", "numpy", "scipy", "scikit-fem", "netgen-mesher", "numba")
WARP = 0.1  # [-] largest deflection of the ready-made warp vector over the body's extent
CELL_TYPE = {1: 1, 2: 3, 3: 5}  # VTK's numbers for a vertex, a line and a triangle, by their number of points
KIND = {"f": "Float64", "i": "Int64", "u": "UInt8"}
MOST_FRAMES = 1000  # [-] of an animation: 0.2 GB
DISTINCT = 1e-9  # [-] equal frequencies are spread by this much as time values: a collection drops equal times


@_check.typed
def write_vtk(path: str | Path, modes: Modes, response: Response | None = None, times: Any = None) -> None:
    """Write mode shapes, or the motion after a strike, for ParaView and pyvista.

    Parameters
    ----------
    path : path ending in .vtu (one file) or .pvd (a collection, its parts in a folder of the same name)
        Modes in one .vtu: a point array ``mode_001`` ... each, all frequencies as field data. Modes in a .pvd: one
        part per mode, its frequency as time value and field data, ``shape`` [kg**-0.5] and a ready-made ``warp``
        vector. Motion: one part per time (a .vtu takes one time only), ``displacement`` [m], ``velocity`` [m/s]
        of the kept modes; as field data the contact ``force`` [N] and, of a strike, where the ``striker`` is [m].
    modes : Modes
    response : Response, optional
        Write its motion instead of mode shapes; modes is then the body it happened on.
    times : array_like, shape (n_times,) [s], optional
        With response: when.

    Raises
    ------
    ValueError
        Where the path has another ending, or times are missing.
    """
    path = _check.path("path", path)
    suffix = vtk_ending(path)
    points, cells = drawing.grid(modes)
    if response is None:
        parts = _mode_parts(modes, points)
        stamps = _distinct(modes.frequencies)
    else:
        if times is None:
            raise ValueError("times must be given with response, in s")
        stamps = _check.array("times", times, (None,), "s", lift=True)
        parts = _motion_parts(response, points, stamps)
    if suffix == ".pvd":
        _write_collection(path, points, cells, parts, stamps)
    elif response is None:
        arrays = {f"mode_{i + 1:03d}": part[0]["shape"] for i, part in enumerate(parts)}
        _write_vtu(path, points, cells, arrays, {"frequency": modes.frequencies, "damping_ratio": modes.damping_ratio})
    elif len(parts) == 1:
        _write_vtu(path, points, cells, *parts[0])
    else:
        raise ValueError(f"times must be one time for a .vtu, got {len(parts)}; write a .pvd")


@_check.typed
def write_animation(path: str | Path, modes: Modes, mode: int, *, frames: int = 24) -> None:
    """Write one period of a mode's vibration for ParaView and pyvista to play.

    Parameters
    ----------
    path : path ending in .pvd; its parts go to a folder of the same name
        One part per frame, its time [s] as time value: the vector ``warp``, a tenth of the body's extent at most.
    modes : Modes
    mode : int, the mode's number from 1 on
    frames : int, how many, evenly over the period

    Raises
    ------
    ValueError
        Where the path has another ending, or the mode does not exist or is a rigid motion.
    """
    path = _check.path("path", path)
    if vtk_ending(path) != ".pvd":
        raise ValueError(f"path must end in .pvd to hold several times, got {str(path)!r}")
    if _check.count("mode", mode) > modes.n_modes:
        raise ValueError(f"mode must be at most {modes.n_modes}, got {mode}")
    frequency = float(modes.frequencies[mode - 1])
    if frequency == 0.0:
        raise ValueError(f"mode must vibrate; mode {mode} is a rigid motion")
    turns = np.arange(_check.count("frames", frames, low=2, high=MOST_FRAMES)) / frames
    points, cells = drawing.grid(modes)
    arrays, fields = _mode_parts(modes, points)[mode - 1]
    parts = [({"warp": np.cos(2.0 * np.pi * turn) * arrays["warp"]}, fields) for turn in turns]
    _write_collection(path, points, cells, parts, turns / frequency)


def vtk_ending(path: str | Path) -> str:
    """The ending of a path that `write_vtk` takes; ValueError for any other."""
    return _check.one_of("path ending", _check.path("path", path).suffix, (".vtu", ".pvd"))


@_check.typed
def write_uff(path: str | Path, modes: Modes) -> None:
    """Write mode shapes as a universal file for modal-test programs: nodes (15, 2411), cells (2412), shapes (55).

    The deflection stands in z, mass-normalised with modal mass 1; numbers keep six digits. Needs pyuff:
    ``pip install 'fem-impact[uff]'``. `Modes.from_uff` reads it back.
    """
    if modes.dimension == 0:
        raise ValueError("modes must be those of a plate or beam; a rigid mass has no shape to write")
    points, cells = modes.shapes.grid()
    with replacing(path) as temporary:
        uff.write(temporary, modes.frequencies, modes.damping_ratio, modes.shape_at(points), points, cells)


@_check.typed
def write_wav(
    path: str | Path, response: Response, at: Any = None, *, listener: Any = None, **options: Any
) -> sound.Sound:
    """Write the sound of a blow as 32-bit float WAV and return it.

    The velocity of the point ``at`` (see `sound.synthesise`, which takes the options), or the pressure at a
    ``listener`` beside a plate (see `sound.radiate`).
    """
    if listener is None:
        heard = sound.synthesise(response, at, **options)
    else:
        heard = sound.radiate(response, listener, **options)
    with replacing(path) as temporary:
        wavfile.write(temporary, heard.rate, heard.samples.astype(np.float32))
    return heard


@_check.typed
def write_force(path: str | Path, response: Response) -> None:
    """Write the force history as CSV: a header with units, then one row per instant, every digit kept."""
    with replacing(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["time [s]", "force [N]"])
        writer.writerows(zip(response.time.tolist(), response.force.tolist()))


@_check.typed
def write_json(path: str | Path, data: dict[str, Any]) -> None:
    """Write plain data as JSON that any reader accepts: no NaN, no infinity (see `plain`)."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(plain(data), indent=2, allow_nan=False) + "\n", encoding="utf-8")


ERROR_PARTS = ("step", "truncation", "mesh", "idealisation", "sensitivity", "total", "resolvable")


@_check.typed
def numbers(response: Response) -> dict[str, Any]:
    """Every scalar of a response, by name, in SI units, and its impacts."""
    error = response.error
    return {
        "response": {
            "n_impacts": response.n_impacts,
            "contact_time": response.contact_time,
            "peak_force": response.peak_force,
            "impulse": response.impulse,
            "restitution": response.restitution,
            "speed": response.speed,
            "spectral_centroid": {
                "value": _centroid(response),
                "max_frequency": CENTROID_BAND,
            },
            "energies": response.energies,
            "dissipated": response.dissipated,
            "energy_error": response.energy_error,
            "momentum_error": response.momentum_error,
            "error": {name: getattr(error, name) for name in ERROR_PARTS},
            "tolerance": response.tolerance,
            "finished": response.finished,
            "scheme": response.scheme,
            "n_modes": response.target.n_modes,
            "max_frequency": response.target.frequencies[-1],
        },
        "impacts": [
            {"start": hit.start, "end": hit.end, "peak_force": hit.peak_force, "impulse": hit.impulse}
            for hit in response.impacts
        ],
    }


def _centroid(response: Response) -> float | None:
    """The spectral centroid; None where nothing touched, or a blow lasts too long for a band up to CENTROID_BAND."""
    try:
        return response.spectral_centroid(CENTROID_BAND)
    except ValueError:
        return None


def versions() -> dict[str, str]:
    """Versions of everything the numbers come from."""
    return {"python": platform.python_version(), **{name: metadata.version(name) for name in PACKAGES}}


def plain(value: Any) -> Any:
    """The same data in dicts, lists, strings and finite numbers; what is not finite or missing becomes null."""
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


def _mode_parts(modes: Modes, points: np.ndarray) -> list[tuple[dict, dict]]:
    shapes = modes.shapes.at(points)  # (n_points, n_modes)
    extent = float(np.ptp(points, axis=0).max(initial=0.0)) or 1.0
    largest = np.abs(shapes).max(axis=0, initial=0.0)
    warp = np.zeros((modes.n_modes, len(points), 3))
    warp[:, :, 2] = (shapes * (WARP * extent / np.where(largest > 0.0, largest, 1.0))).T
    return [
        (
            {"shape": shapes[:, i].copy(), "warp": warp[i]},
            {"mode": i + 1, "frequency": modes.frequencies[i], "damping_ratio": modes.damping_ratio[i]},
        )
        for i in range(modes.n_modes)
    ]


def _motion_parts(response: Response, points: np.ndarray, times: np.ndarray) -> list[tuple[dict, dict]]:
    moves = []
    # of the modes kept: the dip of the others would cost a static solution for every point of the grid; and the
    # middle of a chord along a hole lies beside the body by a hair, where the elements are evaluated all the same
    rows = response.target.shapes.at(points)  # (n_points, n_modes)
    for state in response.modal_state(times):
        vector = np.zeros((len(times), len(points), 3))
        vector[:, :, 2] = state @ rows.T  # (n_times, n_points)
        moves.append(vector)
    fields: list[dict[str, Any]] = [{"time": t} for t in times]
    for i in range(response.history.n_contacts):
        name = "force" if response.history.n_contacts == 1 else f"force_{i + 1}"
        for field, force in zip(fields, response.history.force_at(times, i)[0]):
            field[name] = force
    if response.striker is not None and response.at is not None:
        striker = response.striker
        tip = response.displacement(striker.at[None] if striker.modes.dimension else None, times, body=0)[:, 0]
        for field, way in zip(fields, tip):
            place = np.zeros((1, 3))
            place[0, : len(response.at)], place[0, 2] = response.at, way
            field["striker"] = place
    return [({"displacement": d, "velocity": v}, field) for d, v, field in zip(*moves, fields)]


def _distinct(stamps: np.ndarray) -> np.ndarray:
    result = np.array(stamps, float)
    for i in range(1, len(result)):
        result[i] = max(result[i], result[i - 1] + DISTINCT * max(result[i - 1], 1.0))
    return result


def _write_collection(path: Path, points, cells, parts: list[tuple[dict, dict]], stamps: np.ndarray) -> None:
    """Parts first, the collection that names them last: it never points at a file that is not there."""
    folder = path.with_suffix("")
    folder.mkdir(exist_ok=True)
    lines = []
    for i, ((arrays, fields), stamp) in enumerate(zip(parts, stamps)):
        name = f"{path.stem}_{i + 1:03d}.vtu"
        _write_vtu(folder / name, points, cells, arrays, {**fields, "TimeValue": stamp})
        file = quoteattr(f"{folder.name}/{name}")
        lines.append(f'<DataSet timestep="{float(stamp)!r}" group="" part="0" file={file}/>')
    with replacing(path) as temporary:
        body = "\n".join(lines)
        text = f'<VTKFile type="Collection" version="0.1">\n<Collection>\n{body}\n</Collection>\n</VTKFile>\n'
        temporary.write_text('<?xml version="1.0"?>\n' + text, encoding="utf-8")


def _write_vtu(path: Path, points: np.ndarray, cells: np.ndarray, arrays: dict, fields: dict) -> None:
    """Write VTK's XML unstructured grid, binary; meshio and pyvista drop field data or load all of VTK for it."""
    spatial = np.zeros((len(points), 3))
    spatial[:, : points.shape[1]] = points
    offsets = np.arange(1, len(cells) + 1) * cells.shape[1]
    types = np.full(len(cells), CELL_TYPE[cells.shape[1]], np.uint8)
    field_data = "".join(_data_array(k, np.atleast_1d(v), tuples=True) for k, v in fields.items())
    point_data = "".join(_data_array(k, v) for k, v in arrays.items())
    geometry = _data_array("Points", spatial)
    cell_data = "".join(
        _data_array(name, array)
        for name, array in (("connectivity", cells.reshape(-1)), ("offsets", offsets), ("types", types))
    )
    text = (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64">\n<UnstructuredGrid>\n'
        f"<FieldData>\n{field_data}</FieldData>\n"
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">\n'
        f"<PointData>\n{point_data}</PointData>\n<Points>\n{geometry}</Points>\n<Cells>\n{cell_data}</Cells>\n"
        "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    )
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _data_array(name: str, values: Any, tuples: bool = False) -> str:
    array = np.asarray(values)
    kind = KIND[array.dtype.kind]
    raw = np.ascontiguousarray(array, dtype=np.dtype(kind.lower()).newbyteorder("<")).tobytes()
    text = base64.b64encode(len(raw).to_bytes(8, "little") + raw).decode("ascii")
    shape = f' NumberOfTuples="{len(array)}"' if tuples else ""
    width = f' NumberOfComponents="{array.shape[1]}"' if array.ndim == 2 else ""
    return f'<DataArray type="{kind}" Name={quoteattr(name)}{shape}{width} format="binary">{text}</DataArray>\n'
