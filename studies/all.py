"""Runs every figure study and writes the small pictures for README.md to studies/pictures.

python studies/all.py [FOLDER for full pictures and data, studies/out by default]
"""

import subprocess
import sys
from pathlib import Path

from PIL import Image

STUDIES = Path(__file__).parent
WIDTH, COLOURS = 640, 256  # [-] pixels and colours of a small picture: about 30 kB


def main() -> None:
    """Run the scripts one after another, then shrink their pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else STUDIES / "out"
    for script in sorted(
        path for name in ("fig", "beyond_", "tutorial_", "roll") for path in STUDIES.glob(f"{name}*.py")
    ):
        subprocess.run([sys.executable, str(script), str(folder)], check=True)
    (STUDIES / "pictures").mkdir(exist_ok=True)
    shown = ("fig*", "beyond_*", "ukulele_modes", "ukulele_wave", "hammer_test", "fit_*", "roll")
    for path in sorted(path for name in shown for path in folder.glob(f"{name}.png")):
        picture = Image.open(path).convert("RGB")
        picture = picture.resize((WIDTH, round(WIDTH * picture.height / picture.width)), Image.Resampling.LANCZOS)
        picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE).save(STUDIES / "pictures" / path.name, optimize=True)


if __name__ == "__main__":
    main()
