"""Meshes of plates and beams: outline, named edges, triangles or line elements.

Start with `meshes`: it holds `Mesh` and the functions that users call as `fem_impact.mesh`. `loops` describes exact
outlines, `facets` the curved element edges; `drawings` and `mesh_files` read files.
"""

from .meshes import Mesh, aligned, disk, fill, line, load, outline, polygon, rectangle, save, straight

__all__ = ["Mesh", "aligned", "disk", "fill", "line", "load", "outline", "polygon", "rectangle", "save", "straight"]
