"""A sketch of a body as SVG: outline, supports, strike point and observation points."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base.markup import BODY, INK, MARGIN, STRIKE, STROKE, WIDTH, picture
from .mesh_files import loops_of

if TYPE_CHECKING:
    from .meshes import Mesh

EDGES = {  # support -> line width [px] and dash pattern; free edges keep the thin outline
    "clamped": (4.5, ""),
    "hinged": (2.5, "7 4"),
    "elastic": (2.5, "2 4"),
}


def draw_body(
    mesh: "Mesh", *, supports: Mapping[str, Any] | None = None, at: Any = None, points: Any = (), ribs: Any = (),
    title: str,
) -> str:  # fmt: skip
    """A plate from above or a beam from the side, with its supports, strike point and observation points.

    Parameters
    ----------
    mesh : Mesh
    supports : mapping of edge name to "clamped", "hinged", "free" or an elastic support, optional
    at : strike point, (dimension,) [m], or several, (n, dimension), optional
    points : observation points, (n_points, dimension) [m]
    ribs : paths (n, 2) [m] or names of edges
    title : str, description for screen readers
    """
    held = held_edges(mesh, supports or {})
    plane = mesh.points
    if mesh.dimension == 1:
        thick = 0.015 * np.ptp(plane)  # half of that drawn
        plane = np.array([[plane.min(), -thick], [plane.max(), thick]])
    low, size = plane.min(axis=0), np.ptp(plane, axis=0)
    scale = float(min((WIDTH - 2 * MARGIN) / size[0], 1.1 * WIDTH / size[1]))
    height = scale * float(size[1]) + 2 * MARGIN

    def place(point: Any) -> tuple[float, float]:
        x, y = (*np.atleast_1d(point), plane[:, 1].max())[:2] if mesh.dimension == 1 else point
        return MARGIN + scale * float(x - low[0]), height - MARGIN - scale * float(y - low[1])

    if mesh.dimension == 2:
        drawn = _outline(mesh, held, place)
        for piece in (piece for path in ribs for piece in mesh.pieces(path)):
            along = "L".join("{:.1f} {:.1f}".format(*place(end)) for end in piece)
            drawn += f'<path d="M{along}" fill="none" stroke="{INK}" stroke-width="2" stroke-linecap="round"/>'
    else:
        (x0, y0), (x1, y1) = place(low), place(low + size)
        box = f'x="{x0:.1f}" y="{y1:.1f}" width="{x1 - x0:.1f}" height="{y0 - y1:.1f}"'
        drawn = f'<rect {box} fill="{BODY}" stroke="{STROKE}"/>'
        for i, x in enumerate((x0, x1)):
            if held.get(i) == "clamped":  # a wall
                drawn += f'<path d="M{x:.1f} {y0 - 26:.1f}v38" stroke="{STROKE}" stroke-width="4.5"/>'
            elif held.get(i) == "hinged":
                drawn += f'<path d="M{x:.1f} {y0:.1f}l-7 12h14z" fill="{STROKE}"/>'
    drawn += "".join(
        f'<circle cx="{a:.1f}" cy="{b:.1f}" r="5" fill="none" stroke="{INK}" stroke-width="1.6"/>'
        for a, b in map(place, points)
    )
    for struck in () if at is None else np.atleast_2d(at):
        a, b = place(struck)
        drawn += (
            f'<circle cx="{a:.1f}" cy="{b:.1f}" r="6" fill="{STRIKE}"/>'
            f'<circle cx="{a:.1f}" cy="{b:.1f}" r="10" fill="none" stroke="{STRIKE}" stroke-width="1.5"/>'
        )
    return picture(height, title, drawn)


def held_edges(mesh: "Mesh", supports: Mapping[str, Any]) -> dict[int, str]:
    """Facet number -> support; facets without a named support are left out and count as free."""
    ordered = sorted(supports.items(), key=lambda item: item[0] != "boundary")  # a named edge overrides "boundary"
    return {
        int(i): kind if isinstance(kind, str) else "elastic"
        for name, kind in ordered
        if name in mesh.edges
        for i in mesh.edges[name]
    }


def _outline(mesh: "Mesh", held: Mapping[int, str], place: Any) -> str:
    """The filled outline and its supported edges; each facet is a parabola through its middle."""
    arcs, whole, number = {}, "", {int(start): i for i, start in enumerate(mesh.facets[:, 0])}
    for i, (a, b) in enumerate(mesh.facets):
        pull = 2.0 * mesh.middles[i] - 0.5 * (mesh.points[a] + mesh.points[b])
        (px, py), (bx, by) = place(pull), place(mesh.points[b])
        arcs[i] = f"Q{px:.1f} {py:.1f} {bx:.1f} {by:.1f}"
    for loop in loops_of(mesh.facets):
        whole += "M{:.1f} {:.1f}".format(*place(mesh.points[loop[0]])) + "".join(arcs[number[each]] for each in loop)
        whole += "Z"
    drawn = f'<path d="{whole}" fill="{BODY}" fill-rule="evenodd" stroke="{STROKE}" stroke-width="1"/>'
    for kind, (width, dashes) in EDGES.items():
        parts, last = "", -1
        for i in arcs:
            if held.get(i) == kind:
                start = int(mesh.facets[i, 0])
                parts += ("" if start == last else "M{:.1f} {:.1f}".format(*place(mesh.points[start]))) + arcs[i]
                last = int(mesh.facets[i, 1])
        if parts:
            style = f'stroke="{STROKE}" stroke-width="{width}" stroke-dasharray="{dashes}"'
            drawn += f'<path d="{parts}" fill="none" {style}/>'
    return drawn
