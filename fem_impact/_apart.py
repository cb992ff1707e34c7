"""Reads a file with another library in a process of its own: some parsers never end, fill the memory, crash or follow
references to other files; there, time, memory and files are limited, and whatever goes wrong is one sentence."""

import importlib
import io
import logging
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path

import numpy as np

from . import _check

PATIENCE = 8.0  # [s] for a small file: no honest one of a megabyte takes a tenth of it
RATE = 2e5  # [byte/s] and as much longer as its size asks for: a third of the slowest reader's speed
HEAD = 4096  # [byte] of which one must not be zero: a hole of a gigabyte would be parsed for minutes
MEMORY = 2 << 30  # [byte] of address space, of which Python and numpy take 0.2 GB
EXTRAS = {"svgelements": "cad", "ezdxf": "cad", "pyuff": "uff", "h5py": "hdf5"}  # optional libraries, and our extras
ACTS = ("socket.", "subprocess.", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork", "shutil.", "ftplib.")
DONE, REFUSED, TOLD = 0, 1, 3  # exit statuses; any other is a reader that died


def read(path: Path, kind: str, reader: str, *arguments: str) -> dict[str, np.ndarray]:
    """Call a function of this package on a file, in a process of its own.

    Parameters
    ----------
    path : Path
    kind : str, what the file should be, for the message
    reader : str, "module:function" of this package; called with the path and the arguments, returns arrays by name

    Raises
    ------
    ValueError
        One line that names the file, where the reader raises anything, takes too long or too much memory.
    """
    if not path.is_file():
        raise ValueError(f"path must name {kind}, got {str(path)!r}; there is no such file")
    with path.open("rb") as file:
        if not file.read(HEAD).strip(b"\0"):
            raise ValueError(f"{path.name} cannot be read as {kind} (it is empty, or begins with nothing but zeros)")
    patience = PATIENCE + path.stat().st_size / RATE
    try:
        status, out, said = run(path, reader, arguments, patience)
    except subprocess.TimeoutExpired:
        status, out = REFUSED, b""
        said = f"it takes longer than {patience:.0f} s; write it anew, or in another format".encode()
    if status != DONE:
        reason = _check.line(said.decode("utf-8", "replace"))
        if status == TOLD:
            raise ValueError(reason)
        reason = reason if status == REFUSED else f"its reader died or took {MEMORY >> 30} GB"
        raise ValueError(f"{path.name} cannot be read as {kind} ({reason})")
    with np.load(io.BytesIO(out), allow_pickle=False) as arrays:
        return dict(arrays)


def run(path: Path, reader: str, arguments: tuple[str, ...], patience: float) -> tuple[int, bytes, bytes]:
    """Exit status of the other process, the arrays it read, and what it says where there are none."""
    command = [sys.executable, "-m", __name__, str(path), reader, *arguments]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, timeout=patience, env=environment, check=False)
    return done.returncode, done.stdout, done.stderr


def main(path: Path, reader: str, arguments: list[str]) -> tuple[int, bytes]:
    """In the other process: exit status, and arrays or the reason for having none."""
    said = io.StringIO()
    logging.disable()
    try:
        with redirect_stdout(said), redirect_stderr(said), np.errstate(all="ignore"):
            module, function = reader.split(":")
            arrays = getattr(importlib.import_module(f".{module}", __package__), function)(path, *arguments)
            if any(array.dtype.hasobject for array in arrays.values()):
                raise TypeError("it holds something else where numbers should be")
            out = io.BytesIO()
            np.savez(out, **arrays)
            return DONE, out.getvalue()
    except ImportError as error:
        extra = f"'fem-impact[{EXTRAS[error.name]}]'" if error.name in EXTRAS else error.name
        return REFUSED, f"this needs {error.name}: pip install {extra}".encode()
    except MemoryError:
        return 2, b""
    except (Exception, SystemExit) as error:  # parsers raise whatever comes
        text = str(error)
        if isinstance(error, ValueError) and text.startswith(path.name):  # our own words
            return TOLD, text.encode("utf-8", "replace")
        return REFUSED, (said.getvalue().strip() or text or type(error).__name__).encode("utf-8", "replace")


def confine(path: Path) -> None:
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


def limit_memory() -> None:
    """No more address space than `MEMORY` for this process, and no core file of it."""
    with suppress(ImportError):  # where there is no such limit, the time limit stands alone
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    limit_memory()
    status, answer = main(Path(sys.argv[1]), sys.argv[2], sys.argv[3:])
    (sys.stderr if status else sys.stdout).buffer.write(answer)
    sys.exit(status)
