"""What commands share: their answer, the progress they show, and where they write."""

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from .display import Display, announce, width


class Answer(NamedTuple):
    """What a command found: as data for programs, and as text for people."""

    data: dict[str, Any]
    said: Sequence[str | Sequence[str]] | None  # texts to wrap, and tables to print as they are; None: data only
    missed: bool = False  # whether a tolerance was missed
    fault: str = ""  # why the command failed all the same


def answer(
    data: dict[str, Any],
    *said: str | Sequence[str],
    path: Path | None = None,
    folder: Path | None = None,
    files: Sequence[str] = (),
    **ends: Any,
) -> Answer:
    """An answer with the files that were written, one or those in a folder, which are said last."""
    lines, where = list(said), None
    if path is not None:
        folder, files = path.parent, [path.name]
    if folder is not None and files:
        where, one = str(folder), len(files) == 1
        lines.append(f"Files: {folder / files[0]}" if one else f"Files in {where}{os.sep}: {', '.join(files)}")
    return Answer({**data, "folder": where, "files": list(files)}, lines, **ends)


def progress_of(options: argparse.Namespace, announces: bool = False) -> Display:
    """The progress of a command; ``announces`` for one that warns of long work. Quiet commands show nothing."""
    return Display(announce if announces and not options.quiet else None, shown=not options.quiet)


def remark(options: argparse.Namespace, text: str) -> None:
    if not options.quiet:
        announce(text)


def folder_of(options: argparse.Namespace) -> Path:
    """The folder that --out names, or one named after the scene."""
    return options.out if options.out is not None else Path("out") / options.scene.stem


def file_of(options: argparse.Namespace, name: str) -> Path | None:
    """The file that --out names: itself if it has an ending, otherwise ``name`` in that folder."""
    return options.out if options.out is None or options.out.suffix else options.out / name


def page_of(options: argparse.Namespace, name: str) -> Path:
    """The file that --out names, or ``name`` in a folder named after the scene."""
    return file_of(options, name) or folder_of(options) / name


def picture_of(options: argparse.Namespace, name: str) -> Path | None:
    """The picture to write, with the ending of the format asked for."""
    path = file_of(options, name)
    if path is not None and options.format is not None:
        return path.with_suffix(f".{options.format}")
    if path is not None:
        from ._base import check  # imported only when needed
        from .show import style

        check.ending(path, *style.ENDINGS)
    return path


def title_of(scene: Any) -> str:
    return scene.title or str(scene.path)


def as_table(rows: Sequence[Sequence[Any]], head: Sequence[str] = ()) -> list[str]:
    """A table; on a terminal too narrow for it, each row as a list."""
    from ._base import markup  # imports numpy, which --help and --version do not need

    lines = markup.columns(rows, head)
    if max(map(len, lines), default=0) <= width():
        return lines
    if not head:
        return [f"{name}: {value}" for name, value in rows]
    return [line for first, *rest in rows for line in (str(first), *(f"  {h}: {x}" for h, x in zip(head[1:], rest)))]
