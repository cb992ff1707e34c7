"""The one place where studies save pictures: ``--format svg``, ``pdf`` or ``png`` sets the format of every picture.

Any study takes the option, anywhere among its own: python studies/fig05.py --format svg
"""

import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

import fem_impact as fi
from fem_impact.show import FORMATS


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


def named(path: str | Path) -> Path:
    """The path with the ending of the format asked for."""
    return Path(path).with_suffix(FORMAT)


def save(path: str | Path, figure: Any, dpi: float | None = None) -> Path:
    """Write a picture in the format asked for and forget it; return its path."""
    written = named(path)
    if dpi is None:
        fi.figures.save(written, figure)
    else:
        figure.savefig(written, dpi=dpi)
        plt.close(figure)
    return written
