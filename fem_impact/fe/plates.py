"""What all theories of plates share: triangles that follow the true edge, springs along edges, and tension."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix

from .._base.untyped import Cells, Sparse
from ..mesh.facets import Curves
from ..mesh.meshes import Mesh
from .elements import Bent, on_true_edge, triangles
from .section import PLANE
from .springs import at_facets, edge_stiffness
from .supports import SupportedRim, cells_of_facets, support_of_facets
from .theory import Domain, Frame, Subject, blocks, gram, scatter


def domain(make_space: Callable[[Cells, Bent | None], Any], body: Subject, names: tuple[str, ...]) -> Domain:
    """The triangles of a plate in its frame, with shape functions and the section's fields ``names``."""
    mesh = body.mesh
    bare, curved = Frame.around(mesh), mesh.curved
    cells, bent = triangles(bare.local(mesh.points), mesh.cells), None
    if curved.any():  # triangles there are bent onto the true edge
        facets, middles = mesh.facets[curved], bare.local(mesh.middles[curved])
        curves = Curves(cells.p.T[facets], middles, mesh.tangents[curved], mesh.curvatures[curved] * bare.length)
        bent = Bent(curves, facets, *cells_of_facets(facets, cells.t.T), cells.t.T)
    space = make_space(cells, bent)
    return Domain.of(names, body.section, bare, cells, space, on_true_edge(space, *space.rule()))


def rim(body: Subject, found: Domain, kinds: list[str]) -> SupportedRim:
    """The boundary of a plate in its frame, with supports of these kinds (n_facets,)."""
    mesh, length = body.mesh, found.frame.length
    springs = edge_stiffness(body.held, found.frame)
    curves = mesh.facets, mesh.tangents, mesh.curvatures * length
    return SupportedRim(*curves, found.cells.p.T, kinds, springs, words_in_plane(mesh, body.section, body.kinds))


def words_in_plane(mesh: Mesh, section: Any, kinds: Sequence[str]) -> list[str]:
    """How each facet is held in the plane, of `section.PLANE`, by its support in bending (n_facets,)."""
    held = ["free" if kind == "free" else "held" for kind in kinds]
    return [str(word) for word in support_of_facets(mesh, dict(section.in_plane), PLANE, "in_plane", held)]


def springs(
    body: Subject, found: Domain, dofs: np.ndarray, n_all: int, slopes: Callable[..., np.ndarray] | None = None
) -> Sparse:
    """Stiffness (n_all, n_all) of elastic supports and of tension, on unknowns ``dofs`` (n_local, n_cells).

    Elastic supports turn a normal by ``slopes`` (n, 2, n_q, n_local) of cells (n,) at area coordinates (n, n_q, 3) and
    places (n, n_q, 2); by default these are the slopes of the deflection.
    """
    space, frame = found.space, found.frame
    total, stiffness = csc_matrix((n_all, n_all)), edge_stiffness(body.held, frame)
    on = np.flatnonzero(stiffness.any(axis=1))
    if on.size:
        push, turn = stiffness[on].T
        cells, area, x, ds, normal = at_facets(space, body.mesh.facets[on])
        value, slope = space.functions(cells, x, (0, 1))
        slope = slope if slopes is None else slopes(cells, area, x)
        across = np.einsum("nqi,niqk->nqk", normal, slope)
        pushed = gram(value[:, :, None], push[:, None] * ds) + gram(across[:, :, None], turn[:, None] * ds)
        total = total + scatter(pushed, dofs[:, cells], n_all)
    if body.section.tension:
        if "free" in body.held:
            raise ValueError("tension needs every edge supported, because a free edge cannot be pulled; add supports")
        pull = body.section.tension * frame.length**2 / frame.stiffness
        for cells in blocks(len(found.points.x)):
            slope = space.functions(cells, found.points.x[cells], (1,))[0].transpose(0, 2, 1, 3)
            total = total + scatter(gram(slope, pull * found.points.dx[cells]), dofs[:, cells], n_all)
    return total


def is_tiny(found: Domain) -> bool:
    """Whether the smallest triangle is so small that the stiffness matrix loses digits.

    Rounding grows as its size to the power -2; triangles larger than 4e-3 of the body leave 1e-11.
    """
    return bool(np.abs(np.linalg.det(found.space.jacobian)).min() < 4e-3**2)
