"""The first blow of a kind: answered in plain Python while another process compiles the inner loops.

Compiling takes 10 s, a blow as plain Python one or two. As long as a kernel of LONG compilation is not on disk, short
blows are plain; longer ones are compiled here, and so is everything where NUMBA_DISABLE_JIT is set, to 0 or 1, or where
what is compiled cannot be kept.
"""

import os
import pickle
import subprocess
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from .._base import check, child
from ..impact.compiled import build, energy, places
from ..impact.response import Response

SWITCH = "NUMBA_DISABLE_JIT"  # variable of numba; where a user sets it, to 0 or 1, nothing is decided here
MARK = "compiling"  # name of the file that is there while a process compiles
PATIENCE = 300.0  # [s] age of a mark whose process was killed: compiling takes 15 s, a minute or two on a busy machine
STEPS = 10_000  # [-] most steps of one run as plain Python: about a second
# [-] runs that give up: all runs of an answer may take as long together; one takes 2 to 6 s of computing, compiling 14
TOGETHER = 2.0
Answer = TypeVar("Answer")


def answer(compute: Callable[[], Response], stretches: bool) -> Response:
    """What a function finds that strikes once, soon; a step of a body that stretches takes as long as fifty."""
    return answer_soon(compute, STEPS / 50 if stretches else STEPS, lambda found: found.tolerance_met)


def answer_soon(compute: Callable[[], Answer], most: float = np.inf, holds: Callable[[Answer], bool] = bool) -> Answer:
    """What a function finds: where kernels are not compiled yet, as plain Python, if that ``holds``.

    Runs as plain Python give up after ``most`` steps, and all of them together when they took as long as TOGETHER.
    """
    if not build.COMPILED:
        return compute()
    lacking: tuple[Any, ...] = ()
    try:
        with build.uncompiled(build.REFUSED):
            return compute()
    except build.Uncompiled as error:
        lacking = error.args
    if SWITCH not in os.environ and places.is_lasting(os.environ) and _under_way(lacking):
        with suppress(check.SimulationError, build.Uncompiled), build.uncompiled(most, TOGETHER):
            found = compute()
            if holds(found):
                return found
    return compute()


def _under_way(lacking: tuple[Any, ...]) -> bool:
    """Whether a process compiles; begins one for a kernel if there is none and none was begun for it here."""
    folder = build.folder(energy.follow)
    assert folder is not None
    mark = folder / MARK
    with suppress(OSError):
        if mark.exists() and time.time() - mark.stat().st_mtime > PATIENCE:
            mark.unlink()
        return mark.exists() or _begin_compiling(mark, lacking).poll() is None
    return mark.exists()  # another process was quicker


@cache
def _begin_compiling(mark: Path, lacking: tuple[Any, ...]) -> "subprocess.Popen[bytes]":
    """Begin to compile in a process that outlives this one, at most once for each kernel; the mark says which."""
    mark.parent.mkdir(parents=True, exist_ok=True)
    with mark.open("xb") as file:
        pickle.dump(lacking, file)
    words, environment = child.python("doctor:compile_kernels", str(mark), **{SWITCH: "0", "OMP_NUM_THREADS": "1"})
    silent: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    try:
        process = subprocess.Popen(words, env=environment, start_new_session=True, **silent)
    except OSError:
        mark.unlink()
        raise
    build.LOG.info("compiling the inner loops in another process, once; until then short blows are plain Python")
    threading.Thread(target=_end_compiling, args=(process, mark), daemon=True).start()
    return process


def _end_compiling(process: "subprocess.Popen[bytes]", mark: Path) -> None:
    """Leave neither a zombie nor a mark behind, even if the process is killed."""
    process.wait()
    with suppress(OSError):
        mark.unlink(missing_ok=True)
