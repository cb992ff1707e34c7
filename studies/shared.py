"""What studies share: where files lie, how pictures and tables are kept, how work is timed, options of a command.

Any study takes ``--format svg``, ``pdf`` or ``png``, anywhere among its own options: python studies/figures/fig05.py
--format svg
"""

import argparse
import csv
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

import fem_impact as fi
from fem_impact.show import FORMATS

STUDIES = Path(__file__).parent
SCENES, PICTURES, OUT = STUDIES / "scenes", STUDIES / "pictures", STUDIES / "out"
MESHES = STUDIES.parent / "meshes"
KINDS: dict[Any, Any] = {str: str, int: int, float: float, bool: "True".__eq__}
matplotlib.use("Agg")


def taken(arguments: list[str]) -> str:
    """Remove the option from a command's arguments and return the format it asks for; .png unless it is given."""
    chosen = FORMATS[0]
    for i, word in enumerate(arguments):
        name, equals, value = word.partition("=")
        if name == "--format":
            used = 1 if equals else 2
            chosen = value if equals else "".join(arguments[i + 1 : i + 2])
            if chosen not in FORMATS:
                sys.exit(f"--format must be one of {', '.join(FORMATS)}, got {chosen!r}")
            del arguments[i : i + used]
            break
    return f".{chosen}"


FORMAT = taken(sys.argv)


def folder(default: Path = OUT) -> Path:
    """The folder that the command names as its first word, made where it is missing."""
    chosen = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    chosen.mkdir(parents=True, exist_ok=True)
    return chosen


def named(path: str | Path) -> Path:
    """The path with the ending of the format asked for."""
    return Path(path).with_suffix(FORMAT)


def save(path: str | Path, figure: Any, dpi: float | None = None) -> Path:
    """Write a picture in the format asked for and forget it; return its path."""
    written = named(path)
    written.parent.mkdir(parents=True, exist_ok=True)
    if dpi is None:
        fi.figures.save(written, figure)
    else:
        figure.savefig(written, dpi=dpi)
        plt.close(figure)
    return written


def parser(about: str, out: Path | None = None) -> argparse.ArgumentParser:
    """A parser that says the first line of a script, with --out where the script writes to a folder or file."""
    made = argparse.ArgumentParser(description=about.splitlines()[0])
    if out is not None:
        made.add_argument("--out", type=Path, default=out)
    return made


def write_rows(path: Path, rows: Iterable[Any], *, append: bool = False) -> None:
    """Write dictionaries or dataclasses as CSV, if there are any; with ``append`` after the lines that are there."""
    tables = [asdict(row) if is_dataclass(row) and not isinstance(row, type) else row for row in rows]
    if not tables:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    new = not (append and path.exists())
    with path.open("w" if new else "a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(tables[0]), lineterminator="\n")
        if new:
            writer.writeheader()
        writer.writerows(tables)


def read_rows(path: Path, kind: Any = None) -> list[Any]:
    """The lines of a CSV as dictionaries of text, or as dataclasses of a kind; none where there is no file."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [kind(*(KINDS[each.type](row[each.name]) for each in fields(kind))) for row in rows] if kind else rows


def timed(work: Callable[[], Any], repeats: int = 1, clock: Callable[[], float] = time.process_time) -> tuple:
    """Least time [s] that several calls take, of the processor unless by another clock, and what the last gives."""
    best = np.inf
    for _ in range(repeats):
        start = clock()
        made = work()
        best = min(best, clock() - start)
    return best, made


def timed_in_turn(works: list[Callable[[], Any]], repeats: int) -> np.ndarray:
    """Least processor time [s] of each of several works, which take turns."""
    return np.min([[timed(work)[0] for work in works] for _ in range(repeats)], axis=0)
