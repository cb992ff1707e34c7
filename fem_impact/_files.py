"""Files appear complete or not at all: written under a temporary name, then renamed."""

import os
import secrets
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

PARTIAL = ".partial-"  # prefix of every temporary name, so that what a killed run left behind can be told

UNDONE: list[Callable[[], object]] = []  # how to take back what this process is at, the last one first
FINISHING: list[Path] = []  # folders whose files are being moved in: too late to take back


@contextmanager
def undoable(undo: Callable[[], object]) -> Iterator[None]:
    """While the block runs, `undo` is what takes it back when the process has to end at once."""
    UNDONE.append(undo)
    try:
        yield
    finally:
        UNDONE.remove(undo)


def undo_all() -> bool:
    """Take back everything unfinished, from a signal handler; False where files are just appearing in their place.

    Raising an exception there does not do: one raised in a finaliser or a callback of a library is swallowed.
    """
    if FINISHING:
        return False
    for undo in reversed(UNDONE):
        undo()
    return True


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` (same suffix); rename it when the block ends well, remove it if not."""
    path = Path(path)
    _placed(path)
    temporary = path.with_name(f"{PARTIAL}{secrets.token_hex(4)}-{path.name}")
    with undoable(lambda: temporary.unlink(missing_ok=True)):
        try:
            yield temporary
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def staged(folder: str | Path) -> Iterator[Path]:
    """Yield an empty folder whose files move into ``folder`` when the block ends well.

    ``folder`` and its parents are made at once, so that a place that cannot be written to is found before the work
    begins; when the block fails they are removed again if they were new. Files of other names stay untouched.
    """
    folder = Path(folder)
    new = [path for path in (folder, *folder.parents) if not path.exists()]
    staging = folder / f"{PARTIAL}{secrets.token_hex(4)}"

    def undo() -> None:
        shutil.rmtree(staging, ignore_errors=True)
        for path in new:
            if path.is_dir() and not any(path.iterdir()):
                path.rmdir()

    with undoable(undo):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            staging.mkdir()
            yield staging
            FINISHING.append(folder)
            try:
                _move(staging, folder)
            finally:
                FINISHING.remove(folder)
            shutil.rmtree(staging, ignore_errors=True)
        except BaseException:  # Ctrl-C too must leave nothing behind; it is raised again
            undo()
            raise


@contextmanager
def scratch() -> Iterator[Path]:
    """Yield a temporary folder; it goes away with the block."""
    with tempfile.TemporaryDirectory() as name, undoable(lambda: shutil.rmtree(name, ignore_errors=True)):
        yield Path(name)


def _placed(path: Path) -> None:
    """Refuse to put a file where a folder, a device or a pipe is: renaming would take its place."""
    if path.is_dir():
        raise IsADirectoryError(21, "Is a directory", str(path))
    if path.exists() and not path.is_file():
        raise FileExistsError(17, "Is no file", str(path))


def _move(staging: Path, folder: Path) -> None:
    """Rename every file below ``staging`` to the same place below ``folder``."""
    files = sorted(path.relative_to(staging) for path in staging.rglob("*") if path.is_file())
    for name in files:
        _placed(folder / name)
    for name in files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        os.replace(staging / name, folder / name)
