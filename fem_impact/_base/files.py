"""Write files completely or not at all: write them under temporary names, then rename them."""

import hashlib
import json
import os
import platform
import re
import secrets
import shutil
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

PARTIAL = ".partial-"  # prefix of every temporary name, which goes on with machine, process and a random number
MACHINE = re.sub(r"[^A-Za-z0-9.]", "_", platform.node())
LIST = ".fem-impact.json"  # in an output folder: the files that each command wrote last, with digests of their contents
OURS: set[str] = set()  # temporary names in use by this process

UNDONE: list[Callable[[], object]] = []  # functions that remove unfinished work, called newest first
FINISHING: list[Path] = []  # folders that are receiving their finished files: too late to undo


@contextmanager
def undoable(undo: Callable[[], object]) -> Iterator[None]:
    """Register ``undo`` while the block runs; `undo_all` calls it if the process has to stop at once."""
    UNDONE.append(undo)
    try:
        yield
    finally:
        UNDONE.remove(undo)


def undo_all() -> bool:
    """Remove all unfinished work; return False, and remove nothing, while finished files are being moved into place.

    Made for signal handlers. An exception would not do there: Python swallows one raised inside a finaliser or a
    library callback.
    """
    if FINISHING:
        return False
    for undo in reversed(UNDONE):
        undo()
    return True


@contextmanager
def signalled(act: Callable[[int, Any], object], *numbers: int) -> Iterator[None]:
    """Answer signals by ``act`` while the block runs; nothing in other threads than the main one, which gets none."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, act) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` (same suffix); rename it if the block succeeds, otherwise delete it."""
    path = Path(path)
    _refuse_special(path)
    _remove_leftovers(path.parent)
    with _temporary_name(path) as name, undoable(lambda: temporary.unlink(missing_ok=True)):
        temporary = path.with_name(f"{name}-{path.name}")
        try:
            yield temporary
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)


def write_whole(path: str | Path, content: str | bytes) -> int:
    """Write a file, text as UTF-8, by `replacing`; return its size [byte]."""
    with replacing(path) as temporary:
        return temporary.write_bytes(content.encode() if isinstance(content, str) else content)


def no_folder(path: Path) -> str:
    """Why a path that is not a folder cannot be one."""
    return "it is a file and no folder" if path.exists() else "there is no such folder"


@contextmanager
def staged_folder(folder: str | Path, command: str | None = None) -> Iterator[Path]:
    """Yield an empty folder; move all its files into ``folder`` if the block succeeds, none if it fails.

    ``folder`` and its parents are created first, so a location without write access fails before the work starts. If
    the block fails, the folders created here are deleted again. Other files in ``folder`` are left alone, except those
    that an earlier run of the same ``command`` wrote there, if nobody has changed them since.
    """
    folder = Path(folder)
    new = [path for path in (folder, *folder.parents) if not path.exists()]

    def undo() -> None:
        shutil.rmtree(staging, ignore_errors=True)
        for path in new:
            if path.is_dir() and not any(path.iterdir()):
                path.rmdir()

    with _temporary_name(folder) as name, undoable(undo):
        staging = folder / name
        try:
            if folder.exists() and not folder.is_dir():
                raise NotADirectoryError(20, f"{no_folder(folder)}; name another", str(folder))
            folder.mkdir(parents=True, exist_ok=True)
            _remove_leftovers(folder)
            staging.mkdir()
            yield staging
            FINISHING.append(folder)
            try:
                _move(staging, folder, [] if command is None else _stale_files(staging, folder, command))
            finally:
                FINISHING.remove(folder)
            shutil.rmtree(staging, ignore_errors=True)
        except BaseException:  # includes Ctrl-C, which must leave nothing behind either
            undo()
            raise


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """Yield an empty folder that becomes ``folder`` if the block succeeds, unless another process was first.

    ``folder`` must not exist or be empty; afterwards it is complete, made here or there.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    _remove_leftovers(folder.parent)
    with _temporary_name(folder) as name, undoable(lambda: shutil.rmtree(new, ignore_errors=True)):
        new = folder.with_name(f"{name}-{folder.name}")
        try:
            new.mkdir()
            yield new
            with suppress(OSError):  # it does not exist, or is not empty
                folder.rmdir()
            try:
                os.rename(new, folder)
            except OSError:
                if not folder.is_dir():
                    raise
        finally:
            shutil.rmtree(new, ignore_errors=True)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Yield a temporary folder and delete it when the block ends."""
    with tempfile.TemporaryDirectory() as name, undoable(lambda: shutil.rmtree(name, ignore_errors=True)):
        yield Path(name)


@contextmanager
def _temporary_name(place: Path) -> Iterator[str]:
    """A temporary name that says whose it is; errors of what has it name ``place`` instead."""
    name = f"{PARTIAL}{MACHINE}-{os.getpid()}-{secrets.token_hex(4)}"
    OURS.add(name)
    try:
        yield name
    except OSError as error:
        if name in str(error.filename):
            error.filename = str(place)
        raise
    finally:
        OURS.remove(name)


def _remove_leftovers(folder: Path) -> None:
    """Remove what a process that was killed left in a folder; other machines' files are left alone."""
    with suppress(OSError):  # the folder does not exist or cannot be read, which its user will notice
        for path in [Path(entry.path) for entry in os.scandir(folder) if entry.name.startswith(PARTIAL)]:
            owner = re.match(rf"{re.escape(PARTIAL + MACHINE)}-(\d+)-[0-9a-f]{{8}}", path.name)
            if owner is None or owner[0] in OURS or _is_running(int(owner[1])):
                continue
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def _is_running(process: int) -> bool:
    """Whether another process of this number runs, or may run."""
    if os.name != "posix":  # elsewhere, to ask would end it
        return True
    if process == os.getpid():  # what is ours now is known; this is from a namesake of the past
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # it belongs to someone else, or is no number of a process
        return True
    return True


def _refuse_special(path: Path) -> None:
    """Refuse to overwrite anything that is not a regular file: the rename would replace a device or a pipe."""
    if path.is_dir():
        raise IsADirectoryError(21, "Is a directory", str(path))
    if path.exists() and not path.is_file():
        raise FileExistsError(17, "Not a regular file", str(path))


def _files(folder: Path) -> list[Path]:
    """Every file below a folder, relative to it."""
    return sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())


def _stale_files(staging: Path, folder: Path, command: str) -> list[Path]:
    """The files in ``folder`` that this command wrote last time and not now; writes the new list into ``staging``."""
    try:
        lists = json.loads((folder / LIST).read_text("utf-8"))
        before = dict(lists.get(command, {}))
    except (OSError, ValueError, TypeError, AttributeError, RecursionError):  # none yet, or damaged
        lists, before = {}, {}
    new = {name.as_posix(): _digest(staging / name) for name in _files(staging)}
    # what the user had there already, such as the mesh of the scene, which is written again unchanged, stays the user's
    listed = {name: digest for name, digest in new.items()
              if before.get(name) == digest or _digest(folder / name) != digest}  # fmt: skip
    (staging / LIST).write_text(json.dumps({**lists, command: listed}, indent=1), encoding="utf-8")
    home = folder.resolve()
    ours = [Path(name) for name, digest in before.items() if name not in new and _digest(folder / name) == digest]
    found = [name for name in ours if (folder / name).resolve() == home / name]  # no links
    return [name for name in found if home in (home / name).parents]


def _digest(path: Path) -> str | None:
    if not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _move(staging: Path, folder: Path, stale: list[Path]) -> None:
    """Move every file below ``staging`` to the same path below ``folder`` and remove ``stale`` ones; all or nothing."""
    files, old = _files(staging), staging / PARTIAL
    within = {parent for name in files for parent in name.parents}
    made = [folder / name for name in sorted(within, reverse=True) if not (folder / name).exists()]
    for name in within:
        if not (folder / name).is_dir() and folder / name not in made:
            raise NotADirectoryError(20, "Not a directory", str(folder / name))
    for name in files:
        _refuse_special(folder / name)
    moved: list[Path] = []
    try:
        for name in [*stale, *files]:
            (old / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            if (folder / name).exists():
                try:
                    os.link(folder / name, old / name)
                except OSError:  # files can have only one name there
                    shutil.copy2(folder / name, old / name)
            moved.append(name)
            if name in files:
                os.replace(staging / name, folder / name)
            else:
                (folder / name).unlink()
    except OSError:
        for name in moved:
            if (old / name).exists():
                os.replace(old / name, folder / name)
            else:
                (folder / name).unlink(missing_ok=True)
        for path in made:
            with suppress(OSError):
                path.rmdir()
        raise
    for name in stale:
        with suppress(OSError):  # it holds something else
            (folder / name).parent.rmdir()
