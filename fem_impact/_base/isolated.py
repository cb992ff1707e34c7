"""Read a file with another library in a separate process.

Some parsers hang, fill the memory or crash. The separate process has limits on time and memory, and any failure becomes
a one-line error message. It is not a sandbox: the reader has all rights of the user, so a file can make it read other
files, as the includes of an Abaqus deck do. Read files of unknown origin in a container.
"""

import importlib
import io
import logging
import math
import signal
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path

import numpy as np

from . import check, child

# [s] of processor time for a small file: a valid file of 1 MB takes less than a tenth of this
PATIENCE = 8.0
WAITING = 20.0  # [-] limit on the time by the clock over that: ends what only waits, not what a busy machine delays
MEMORY = 2 << 30  # [byte] limit on the reader's address space; Python and numpy alone use 0.2 GB
REFUSED, EXPLAINED = 1, 3  # exit statuses besides 0; any other means the reader crashed


def read_apart(path: Path, kind: str, reader: str, *arguments: str) -> dict[str, np.ndarray]:
    """Call a reader function of this package on a file, in a separate process.

    Parameters
    ----------
    path : Path
    kind : str, what the file should contain, for the message: "a mesh"
    reader : str, "module:function" of this package; called as function(path, *arguments)

    Returns
    -------
    dict
        Name -> ndarray, as the reader returned them.

    Raises
    ------
    ValueError
        If the reader raises, takes too long or needs too much memory; one line that names the file.
    """
    if not path.is_file():
        raise ValueError(f"path must name {kind}, got {str(path)!r}; {check.absent(path)}")
    with path.open("rb") as file:
        if not file.read(4096).strip(b"\0"):  # parsing 1 GB of zeros takes minutes
            raise ValueError(f"{path.name} cannot be read as {kind} (it is empty or begins with zeros only)")
    patience = min(PATIENCE + path.stat().st_size / 2e5, 30.0)  # a third of the slowest reader's speed in byte/s
    try:
        status, out, said = run_reader(path, reader, arguments, patience)
    except subprocess.TimeoutExpired:
        status, out = REFUSED, b""
        said = f"reading took longer than {patience:.0f} s; export it again or in another format".encode()
    if status:
        reason = check.line(said.decode("utf-8", "replace"))
        if status == EXPLAINED:
            raise ValueError(reason)
        reason = reason if status == REFUSED else f"its reader crashed or exceeded {MEMORY >> 30} GB"
        raise ValueError(f"{path.name} cannot be read as {kind} ({reason})")
    with np.load(io.BytesIO(out), allow_pickle=False) as arrays:
        return dict(arrays)


def run_reader(path: Path, reader: str, arguments: tuple[str, ...], patience: float) -> tuple[int, bytes, bytes]:
    """Run the reader process: its exit status, the arrays as npz bytes, and the error text if it failed.

    Raises TimeoutExpired if it computes longer than ``patience`` [s], or takes `WAITING` times as long by the clock.
    """
    words = str(math.ceil(patience)), str(path), reader, *arguments
    done = child.run_function("_base.isolated:process", *words, timeout=WAITING * patience, OPENBLAS_NUM_THREADS="1")
    if done.returncode == -getattr(signal, "SIGXCPU", 0) != 0:
        raise subprocess.TimeoutExpired(reader, patience)
    return done.returncode, done.stdout, done.stderr


def main(path: Path, reader: str, arguments: list[str]) -> tuple[int, bytes]:
    """What the reader process answers: exit status, and the arrays as npz bytes or the error text."""
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said), np.errstate(all="ignore"):
            module, function = reader.split(":")
            arrays = getattr(importlib.import_module(f"fem_impact.{module}"), function)(path, *arguments)
            if any(array.dtype.hasobject for array in arrays.values()):
                raise TypeError("it contains objects where numbers should be")
            out = io.BytesIO()
            np.savez(out, **arrays)
            return 0, out.getvalue()
    except ImportError as error:
        library = (error.name or "").split(".")[0]
        extras = (f"'fem-impact[{name}]'" for name, (_, *modules) in check.EXTRAS.items() if library in modules)
        return REFUSED, f"this needs {library}: pip install {next(extras, library)}".encode()
    except MemoryError:
        return 2, b""
    except (Exception, SystemExit) as error:  # parsers raise anything, even SystemExit
        text = str(error)
        if isinstance(error, ValueError) and text.startswith(path.name):  # our own message, already complete
            return EXPLAINED, text.encode("utf-8", "replace")
        return REFUSED, (said.getvalue().strip() or text or type(error).__name__).encode("utf-8", "replace")


def process() -> int:
    """The reader process itself: limits its processor time and its address space, and leaves no core files."""
    logging.disable()
    with suppress(ImportError):  # Windows has no such limits; only that by the clock remains there
        import resource

        seconds, most = int(sys.argv[1]), resource.getrlimit(resource.RLIMIT_CPU)[1]
        own = seconds if most == resource.RLIM_INFINITY else min(seconds, most)
        resource.setrlimit(resource.RLIMIT_CPU, (own, most))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    status, answer = main(Path(sys.argv[2]), sys.argv[3], sys.argv[4:])
    (sys.stderr if status else sys.stdout).buffer.write(answer)
    return status
