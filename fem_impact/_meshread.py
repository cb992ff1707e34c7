"""Reads a mesh file with meshio in a process of its own: some of its readers never end, fill the memory, or follow
references to other files; there, time, memory and files are limited, and whatever goes wrong is one sentence."""

import io
import json
import logging
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import _check

PATIENCE = 8.0  # [s] for a small file: no honest one of a megabyte takes a tenth of it
RATE = 2e5  # [byte/s] and as much longer as its size asks for: a third of the slowest reader's speed
MEMORY = 2 << 30  # [byte] of address space, of which Python and numpy take 0.2 GB
TAGS = ("gmsh:physical", "medit:ref", "edge", "cell_tags")  # meshio's names of numbers on cells, in order of preference
ACTS = ("socket.", "subprocess.", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork", "shutil.", "ftplib.")


@dataclass(frozen=True, eq=False)
class Raw:
    """What stands in a mesh file."""

    points: np.ndarray  # (n_points, 2 or 3)
    blocks: list[tuple[str, np.ndarray, np.ndarray | None]]  # kind of cell, its nodes (n_cells, n), numbers (n_cells,)
    labels: dict[int, str]  # names of numbers on lines
    sets: dict[str, list[np.ndarray | None]]  # name -> cells of each block


def read(path: Path) -> Raw:
    """Read a mesh file; ValueError names the file and what is wrong with it."""
    if not path.is_file():
        raise ValueError(f"path must name a mesh file, got {str(path)!r}; there is no such file")
    patience = PATIENCE + path.stat().st_size / RATE
    try:
        status, out, said = _run(path, patience)
    except subprocess.TimeoutExpired:
        raise _unreadable(path, f"it takes longer than {patience:.0f} s; write it in another format") from None
    if status != 0:
        reason = said.decode("utf-8", "replace") if status == 1 else f"its reader died or took {MEMORY >> 30} GB"
        raise _unreadable(path, reason)
    with np.load(io.BytesIO(out), allow_pickle=False) as arrays:
        index = json.loads(arrays["index"].tobytes())
        blocks = [(kind, arrays[f"cells{i}"], arrays.get(f"tags{i}")) for i, kind in enumerate(index["kinds"])]
        sets: dict[str, list[np.ndarray | None]] = {
            name: [arrays.get(f"set{s}_{i}") for i in range(len(blocks))] for s, name in enumerate(index["sets"])
        }
        return Raw(arrays["points"], blocks, {int(n): name for n, name in index["labels"]}, sets)


def _unreadable(path: Path, reason: str) -> ValueError:
    return ValueError(f"{path.name} cannot be read as a mesh ({_check.line(reason)})")


def _run(path: Path, patience: float) -> tuple[int, bytes, bytes]:
    """Exit status of the other process, arrays it read, and the reason where the status is 1."""
    command = [sys.executable, "-m", __name__, str(path)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run(command, capture_output=True, timeout=patience, env=environment, check=False)
    return run.returncode, run.stdout, run.stderr


def main(path: Path) -> tuple[int, bytes]:
    """In the other process: exit status, and arrays or the reason for having none."""
    said = io.StringIO()
    logging.disable()
    try:
        with redirect_stdout(said), redirect_stderr(said), np.errstate(all="ignore"):
            return 0, _packed(_meshio_read(path))
    except ImportError as error:
        extra = "'fem-impact[hdf5]'" if error.name == "h5py" else error.name
        return 1, f"this format needs {error.name}: pip install {extra}".encode()
    except MemoryError:
        return 2, b""
    except (Exception, SystemExit) as error:  # meshio's readers raise whatever comes
        return 1, (said.getvalue().strip() or str(error) or type(error).__name__).encode("utf-8", "replace")


def _meshio_read(path: Path) -> Any:
    import meshio

    with suppress(ImportError):
        import h5py

        h5py.File = _closed_file(h5py, path)
    _confine(path)
    if not set(path.suffixes) & set(meshio.extension_to_filetypes):
        raise ValueError(
            f"its ending is {path.suffix!r}; meshio reads {', '.join(sorted(meshio.extension_to_filetypes))}"
        )
    return meshio.read(path)


def _packed(mesh: Any) -> bytes:
    """The parts of a `Raw` as one npz."""
    arrays: dict[str, np.ndarray] = {"points": np.asarray(mesh.points, float)}
    tags = next((key for key in TAGS if key in mesh.cell_data), None)
    for i, block in enumerate(mesh.cells):
        arrays[f"cells{i}"] = np.asarray(block.data, np.int64)
        if tags is not None:
            arrays[f"tags{i}"] = np.asarray(mesh.cell_data[tags][i], np.int64).ravel()
    sets = [name for name in mesh.cell_sets if not name.startswith("gmsh:")]
    for s, name in enumerate(sets):
        for i, members in enumerate(mesh.cell_sets[name]):
            if members is not None:
                arrays[f"set{s}_{i}"] = np.asarray(members, np.int64).ravel()
    labels = [(int(v[0]), name) for name, v in mesh.field_data.items() if len(v) == 2 and int(v[1]) == 1]
    index = {"kinds": [block.type for block in mesh.cells], "sets": sets, "labels": labels}
    arrays["index"] = np.frombuffer(json.dumps(index).encode(), np.uint8)
    out = io.BytesIO()
    np.savez(out, **arrays)  # type: ignore[arg-type]
    return out.getvalue()


def _confine(path: Path) -> None:
    """From here on this process opens a file, what lies beside it and Python's own only, and calls nobody."""
    homes = [os.path.realpath(place) for place in (str(path.parent), sys.prefix, sys.base_prefix, *sys.path) if place]
    own = os.path.realpath(path)

    def watch(event: str, arguments: tuple) -> None:
        if event.startswith(ACTS):
            raise PermissionError(f"it asks for {event}")
        if event == "open" and isinstance(arguments[0], (str, bytes)):
            place = os.path.realpath(os.fsdecode(arguments[0]))
            if place != own and not any(place.startswith(home + os.sep) for home in homes):
                raise PermissionError("it names a file outside its folder")

    sys.addaudithook(watch)


def _closed_file(h5py: Any, path: Path) -> Any:
    """h5py's File, for a file or one beside it that refers to no other: HDF5 can link to, and map, any file."""
    own, folder = path.resolve(), path.parent.resolve()

    class File(h5py.File):
        def __init__(self, name: Any, mode: str = "r", **options: Any) -> None:
            place = Path(name).resolve()
            if place != own and not place.is_relative_to(folder):
                raise PermissionError("it names a file outside its folder")
            super().__init__(name, "r", **options)
            self._refuse_references(self)

        def _refuse_references(self, group: Any) -> None:
            for name in group:
                if isinstance(group.get(name, getlink=True), h5py.ExternalLink):
                    raise PermissionError("it links to another file")
                if isinstance(group.get(name, getlink=True), h5py.SoftLink):
                    continue
                item = group[name]
                if isinstance(item, h5py.Group):
                    self._refuse_references(item)
                elif isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
                    raise PermissionError("it keeps its numbers in another file")

    return File


def limit_memory() -> None:
    """No more address space than `MEMORY` for this process, and no core file of it."""
    with suppress(ImportError):  # where there is no such limit, the time limit stands alone
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    limit_memory()
    status, answer = main(Path(sys.argv[1]))
    (sys.stderr if status else sys.stdout).buffer.write(answer)
    sys.exit(status)
