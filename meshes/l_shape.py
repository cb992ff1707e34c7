"""An L of three squares with sides of 0.2 m; edges edge0 (bottom) to edge5 (left), anticlockwise."""

from pathlib import Path

import fem_impact as fi

if __name__ == "__main__":
    corners = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.2), (0.2, 0.2), (0.2, 0.4), (0.0, 0.4)]
    fi.mesh.save(Path(__file__).with_suffix(".msh"), fi.mesh.polygon(corners, size=0.05))
