"""The first blow after an installation: answered in plain Python while another process compiles the inner loops.

Compiling takes 10 s and more, a blow as plain Python a second. As long as nothing is on disk and a compiler is at work,
which may be that of another process, short blows are plain; longer ones are compiled here, and so is everything where
NUMBA_DISABLE_JIT is set, to 0 or 1, or where what is compiled cannot be kept.
"""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, child
from ..impact import collision
from ..impact.compiled import build, energy, places
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.striker import Striker
from ..modes.modal import Modes

SWITCH = "NUMBA_DISABLE_JIT"  # variable of numba; where a user sets it, to 0 or 1, nothing is decided here
MARK = "compiling"  # name of the file that is there while a process compiles
PATIENCE = 300.0  # [s] age of a mark whose process was killed: compiling takes 15 s, a minute or two on a busy machine
STEPS = 10_000  # [-] most steps of one run as plain Python: about a second


def answer(compute: Callable[[], Response], short: bool) -> Response:
    """What a function finds that strikes once: if that is short and nothing is compiled yet, as plain Python."""
    if short and build.COMPILED and SWITCH not in os.environ and _under_way():
        with suppress(check.SimulationError), build.uncompiled(STEPS):
            found = compute()
            if found.tolerance_met:
                return found
    return compute()


def _under_way() -> bool:
    """Whether a process compiles what a blow needs; begins one if nothing is on disk and none was begun here."""
    if energy.follow.overloads or not places.lasting(os.environ):
        return False
    folder = build.folder(energy.follow)
    assert folder is not None
    mark = folder / MARK
    with suppress(OSError):
        if mark.exists() and time.time() - mark.stat().st_mtime > PATIENCE:
            mark.unlink()
        return mark.exists() or (not build.kept(energy.follow) and _begun(mark).poll() is None)
    return mark.exists()  # another process was quicker


@cache
def _begun(mark: Path) -> "subprocess.Popen[bytes]":
    """Begin to compile in a process that outlives this one, at most once."""
    mark.parent.mkdir(parents=True, exist_ok=True)
    mark.touch(exist_ok=False)
    words, environment = child.python("model.fresh:compile_blow", str(mark), **{SWITCH: "0", "OMP_NUM_THREADS": "1"})
    unheard: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    try:
        process = subprocess.Popen(words, env=environment, start_new_session=True, **unheard)
    except OSError:
        mark.unlink()
        raise
    build.LOG.info("compiling the inner loops in another process, once; until then short blows are plain Python")
    threading.Thread(target=_finish, args=(process, mark), daemon=True).start()
    return process


def _finish(process: "subprocess.Popen[bytes]", mark: Path) -> None:
    """Leave neither a zombie nor a mark behind, even if the process is killed."""
    process.wait()
    with suppress(OSError):
        mark.unlink(missing_ok=True)


def compile_blow() -> int:
    """Compile what a blow needs, and what is asked of it first, as a process of its own; it is given its mark."""
    try:
        hit = collision.strike(Modes.rigid(1.0), Striker.rigid(1.0), Contact.linear(1e5), at=None, speed=1.0)
        hit.modal_state(np.zeros(1))
        hit.summary()
    finally:
        Path(sys.argv[1]).unlink(missing_ok=True)
    return 0
