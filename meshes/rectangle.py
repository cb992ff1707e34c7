"""The plate of Euphonics 12.1: a rectangle of 1.55 : 1; edges left, right, bottom and top."""

from pathlib import Path

import fem_impact as fi

if __name__ == "__main__":
    fi.mesh.save(Path(__file__).with_suffix(".msh"), fi.mesh.rectangle(1.55, 1.0, size=0.125))
