"""A disk of radius 0.15 m; its edge is outer."""

from pathlib import Path

import fem_impact as fi

if __name__ == "__main__":
    fi.mesh.save(Path(__file__).with_suffix(".msh"), fi.mesh.disk(0.15, size=0.03))
