"""Meshes of plates and beams: outline, named edges, triangles or line elements.

Start with `meshes`: it holds `Mesh` and the functions that users call as `fem_impact.mesh`. `loops` describes exact
outlines, `facets` the curved element edges; `drawings` and `mesh_files` read files.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__all__ = ["Mesh", "aligned", "disk", "fill", "line", "load", "outline", "polygon", "rectangle", "save", "straight"]

if TYPE_CHECKING:
    from .meshes import Mesh, aligned, disk, fill, line, load, outline, polygon, rectangle, save, straight
else:

    def __getattr__(name: str) -> Any:  # at first use: the process that reads a file would load the mesher in vain
        if name in __all__:
            return getattr(import_module(".meshes", __name__), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
