"""Draws the pictures of a blow in a process of its own: it loads its libraries while the blow is computed.

with Painter() as painter:
    ...                              # compute the response
    painter.begin(folder, response)
    ...                              # write other files
    missing = painter.finish()
"""

import pickle
import subprocess
from contextlib import ExitStack, suppress
from pathlib import Path

from .._base import child, progress
from .._base.files import undoable
from ..impact.response import Response
from . import canvas, pictures


def draw(folder: Path, response: Response, form: str = "png") -> str:
    """Draw all pictures of a blow into a folder, in a format of `show.FORMATS`.

    Returns an empty text, or what to install for pictures in 3D.
    """
    pictures.animation(folder / "wave.gif", response)
    pictures.wave(folder / f"wave.{form}", response)
    return pictures.mode_shapes(folder / f"modes.{form}", response.target)


class Painter:
    """The other process; it ends with the block."""

    def __init__(self) -> None:
        self.task: tuple[Path, Response, str] | None = None
        self.stack: ExitStack = ExitStack()
        self.process: subprocess.Popen[bytes]

    def __enter__(self) -> "Painter":
        self.process = child.begin("show.canvas:main", quiet=True, **canvas.WINDOW)
        self.stack.enter_context(undoable(self.process.kill))
        return self

    def __exit__(self, *_: object) -> None:
        child.end(self.process)
        self.stack.close()

    def begin(self, folder: Path, response: Response, form: str = "png") -> None:
        """Start drawing the pictures of a blow into a folder."""
        self.task = folder, response, form
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):  # the process is gone, which `finish` deals with
            shown = pictures.film(response), pictures.gallery(response.target)
            pickle.dump((folder, *shown, form), self.process.stdin, protocol=pickle.HIGHEST_PROTOCOL)
            self.process.stdin.close()

    def finish(self) -> str:
        """Wait for the pictures; the answer is that of `draw`. If the process fails, this one draws them."""
        assert self.task is not None and self.process.stdout is not None
        for line in self.process.stdout:
            done, _, total = line.decode("utf-8", "replace").partition("/")
            if total:
                progress.report("frames", int(done), int(total))
        return draw(*self.task) if self.process.wait() else ""
