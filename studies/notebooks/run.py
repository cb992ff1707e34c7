"""Runs the notebooks of this folder and keeps what they show, without times, paths and names of the machine.

python studies/notebooks/run.py [NOTEBOOK ...]; needs nbclient and ipykernel (pip install -e '.[test]')
"""

import base64
import io
import sys
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from PIL import Image

HERE = Path(__file__).parent
COLOURS = 64  # [-] of a kept picture: a quarter of its size
PATIENCE = 300  # [s] for a cell on a busy machine; each notebook takes some seconds


def executed(path: Path) -> Any:
    """A notebook with the outputs of a fresh run in this folder, and nothing else that could differ."""
    notebook: Any = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    NotebookClient(
        notebook,
        timeout=PATIENCE,
        kernel_name="python3",
        coalesce_streams=True,  # a cell's words may arrive in several pieces
        resources={"metadata": {"path": HERE}},
    ).execute()
    notebook.metadata = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    for number, cell in enumerate(notebook.cells):
        cell.metadata, cell.id = {}, f"cell-{number}"
        for output in cell.get("outputs", ()):
            if "image/png" in output.get("data", {}):
                output.data["image/png"] = smaller(output.data["image/png"])
    return notebook


def smaller(png: str) -> str:
    """A picture in few colours."""
    file = io.BytesIO()
    picture = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    picture.save(file, format="png", optimize=True)
    return base64.b64encode(file.getvalue()).decode("ascii")


def main(paths: list[Path]) -> None:
    """Run the notebooks and write them."""
    for path in paths:
        nbformat.write(executed(path), path)  # type: ignore[no-untyped-call]
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]] or sorted(HERE.glob("*.ipynb")))
