"""A flat cymbal of 16 inches: a free annulus with a hole of 12 mm; edges outer and inner."""

from pathlib import Path

import fem_impact as fi

if __name__ == "__main__":
    fi.mesh.save(Path(__file__).with_suffix(".msh"), fi.mesh.disk(0.2032, 0.006, size=0.05))
