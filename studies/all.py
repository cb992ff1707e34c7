"""Run every figure study; write the small pictures that README.md shows to studies/pictures.

python studies/all.py [FOLDER for full pictures and data, studies/out by default]
"""

import subprocess
import sys
from pathlib import Path

from PIL import Image

STUDIES = Path(__file__).parent
WIDTH, COLOURS = 640, 256  # [-] pixels and colours of a small picture: some 30 kB


def main() -> None:
    """Run the scripts one after another, then shrink what they drew."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else STUDIES / "out"
    for script in sorted([*STUDIES.glob("fig*.py"), *STUDIES.glob("beyond_*.py")]):
        subprocess.run([sys.executable, str(script), str(folder)], check=True)
    (STUDIES / "pictures").mkdir(exist_ok=True)
    for path in sorted([*folder.glob("fig*.png"), *folder.glob("beyond_*.png")]):
        picture = Image.open(path).convert("RGB")
        picture = picture.resize((WIDTH, round(WIDTH * picture.height / picture.width)), Image.Resampling.LANCZOS)
        picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE).save(STUDIES / "pictures" / path.name, optimize=True)


if __name__ == "__main__":
    main()
