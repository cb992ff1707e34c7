"""Runs every figure study and writes the small pictures for README.md to studies/pictures.

python studies/all.py [FOLDER for full pictures and data, studies/out by default]
"""

import subprocess
import sys

import shared
from PIL import Image

WIDTH, COLOURS = 640, 256  # [-] pixels and colours of a small picture: about 30 kB


def main() -> None:
    """Run the scripts one after another, then shrink their pictures."""
    folder = shared.folder()
    for script in sorted(
        path for name in ("fig", "beyond_", "tutorial_", "roll") for path in shared.STUDIES.glob(f"*/{name}*.py")
    ):
        subprocess.run([sys.executable, str(script), str(folder)], check=True)
    shared.PICTURES.mkdir(exist_ok=True)
    shown = ("fig*", "beyond_*", "ukulele_modes", "ukulele_wave", "nastran_door", "hammer_test", "fit_*", "roll")
    for path in sorted(path for name in shown for path in folder.glob(f"{name}.png")):
        picture = Image.open(path).convert("RGB")
        picture = picture.resize((WIDTH, round(WIDTH * picture.height / picture.width)), Image.Resampling.LANCZOS)
        picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE).save(shared.PICTURES / path.name, optimize=True)


if __name__ == "__main__":
    main()
