"""Tables for the terminal and for notebooks, and small SVG pictures without a drawing library."""

import base64
import html
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

WIDTH, HEIGHT = 360.0, 210.0  # [px] size of a picture; narrow pages shrink it
MARGIN = 16.0  # [px] empty border, so that markers on the edge are not cut off
SAMPLES = 400  # [-] points kept of a curve: about one per pixel
BAR = 0.03  # [-] drawn thickness of a beam over its length
EDGES = {  # support -> line width [px] and dash pattern; free edges keep the thin outline
    "clamped": (4.5, ""),
    "hinged": (2.5, "7 4"),
    "elastic": (2.5, "2 4"),
}
# Pages set these CSS variables for light and dark themes; notebooks fall back to the colour after the comma.
INK, BODY, STROKE, STRIKE = (
    "var(--ink, #333333)",
    "var(--body, #d6e6f2)",
    "var(--line-strong, #0072b2)",
    "var(--strike, #d55e00)",
)


def table(rows: Iterable[Sequence[Any]], head: Sequence[str] = ()) -> str:
    """Rows of cells as an HTML table; all text is escaped."""
    top = "".join(f'<th scope="col">{html.escape(str(cell))}</th>' for cell in head)
    body = "".join(
        f'<tr><th scope="row" style="text-align:left">{html.escape(str(first))}</th>'
        + "".join(f'<td style="text-align:right">{html.escape(str(cell))}</td>' for cell in rest)
        + "</tr>"
        for first, *rest in rows
    )
    return f"<table>{f'<thead><tr>{top}</tr></thead>' if top else ''}<tbody>{body}</tbody></table>"


def columns(rows: Iterable[Sequence[Any]], head: Sequence[str] = ()) -> list[str]:
    """Rows of cells as lines of text: the first column to the left, the others to the right."""
    cells = [[str(cell) for cell in row] for row in (*([head] if head else []), *rows)]
    widths = [max(map(len, column)) for column in zip(*cells)]
    return [
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:]))])
        for row in cells
    ]


def notes(lines: Iterable[str]) -> str:
    """Notes, each a paragraph; all text is escaped."""
    return "".join(f"<p>Note: {html.escape(line)}</p>" for line in lines)


def paragraphs(lines: Iterable[str]) -> str:
    """Lines of text as they are; all text is escaped."""
    return f'<pre style="white-space:pre-wrap">{html.escape(chr(10).join(lines))}</pre>'


def player(wav: bytes, words: str) -> str:
    """A player for the bytes of a WAV file, and what is said about them."""
    uri = f"data:audio/wav;base64,{base64.b64encode(wav).decode('ascii')}"
    return f'<audio controls src="{uri}"></audio><p>{html.escape(words)}</p>'


def side_by_side(*parts: str) -> str:
    """HTML pieces side by side; the row wraps on narrow pages."""
    return f'<div style="display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start">{"".join(parts)}</div>'


def curve(x: np.ndarray, y: np.ndarray, *, label: str, unit: str, title: str) -> str:
    """Time history ``y`` [unit] over ``x`` [s], labelled with its peak and duration."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    if len(x) > SAMPLES:
        x, y = _thinned(x, y)
    span, top = float(np.ptp(x)) or 1.0, float(y.max(initial=0.0)) or 1.0
    across = MARGIN + (WIDTH - 2 * MARGIN) * (x - x[0]) / span
    up = HEIGHT - 1.5 * MARGIN - (HEIGHT - 3.5 * MARGIN) * y / top
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, up))
    foot = HEIGHT - 1.5 * MARGIN
    marks = _text(MARGIN, MARGIN, f"{label}, peak {top:.4g} {unit}") + _text(
        WIDTH - MARGIN, HEIGHT - 6, f"{span:.4g} s", "end"
    )
    return _picture(
        HEIGHT,
        title,
        f'<line x1="{MARGIN}" x2="{WIDTH - MARGIN}" y1="{foot}" y2="{foot}" stroke="{INK}" stroke-width="0.6"/>'
        f'<polyline points="{line}" fill="none" stroke="{STROKE}" stroke-width="1.6" stroke-linejoin="round"/>{marks}',
    )


def body(mesh: Any, *, supports: Mapping[str, Any] | None = None, at: Any = None, points: Any = (), title: str) -> str:
    """A plate from above or a beam from the side, with its supports, strike point and observation points.

    Parameters
    ----------
    mesh : Mesh
    supports : mapping of edge name to "clamped", "hinged", "free" or an elastic support, optional
    at : strike point, (dimension,) [m], optional
    points : observation points, (n_points, dimension) [m]
    title : str, description for screen readers
    """
    held = held_edges(mesh, supports or {})
    plane = mesh.points if mesh.dimension == 2 else _bar(mesh.points[:, 0])
    low, size = plane.min(axis=0), np.ptp(plane, axis=0)
    scale = float(min((WIDTH - 2 * MARGIN) / size[0], 1.1 * WIDTH / size[1]))
    height = scale * float(size[1]) + 2 * MARGIN

    def place(point: Any) -> tuple[float, float]:
        x, y = (*np.atleast_1d(point), plane[:, 1].max())[:2] if mesh.dimension == 1 else point
        return MARGIN + scale * float(x - low[0]), height - MARGIN - scale * float(y - low[1])

    if mesh.dimension == 2:
        drawn = _outline(mesh, held, place)
    else:
        (x0, y0), (x1, y1) = place(low), place(low + size)
        box = f'x="{x0:.1f}" y="{y1:.1f}" width="{x1 - x0:.1f}" height="{y0 - y1:.1f}"'
        drawn = f'<rect {box} fill="{BODY}" stroke="{STROKE}"/>'
        drawn += "".join(_end(corner, held.get(i, "free")) for i, corner in enumerate(((x0, y0), (x1, y0))))
    drawn += "".join(
        f'<circle cx="{a:.1f}" cy="{b:.1f}" r="5" fill="none" stroke="{INK}" stroke-width="1.6"/>'
        for a, b in map(place, points)
    )
    if at is not None:
        a, b = place(np.atleast_1d(at))
        drawn += (
            f'<circle cx="{a:.1f}" cy="{b:.1f}" r="6" fill="{STRIKE}"/>'
            f'<circle cx="{a:.1f}" cy="{b:.1f}" r="10" fill="none" stroke="{STRIKE}" stroke-width="1.5"/>'
        )
    return _picture(height, title, drawn)


def held_edges(mesh: Any, supports: Mapping[str, Any]) -> dict[int, str]:
    """Facet number -> support; facets without a named support are left out and count as free."""
    ordered = sorted(supports.items(), key=lambda item: item[0] != "boundary")  # a named edge overrides "boundary"
    return {
        int(i): kind if isinstance(kind, str) else "elastic"
        for name, kind in ordered
        if name in mesh.edges
        for i in mesh.edges[name]
    }


def _outline(mesh: Any, held: Mapping[int, str], place: Any) -> str:
    """The filled outline and its supported edges; each facet is a parabola through its middle."""
    after = {int(a): (int(b), i) for i, (a, b) in enumerate(mesh.facets)}
    arcs = {}
    for i, (a, b) in enumerate(mesh.facets):
        pull = 2.0 * mesh.middles[i] - 0.5 * (mesh.points[a] + mesh.points[b])
        (px, py), (bx, by) = place(pull), place(mesh.points[b])
        arcs[i] = f"Q{px:.1f} {py:.1f} {bx:.1f} {by:.1f}"
    left, whole = set(after), ""
    while left:
        start = vertex = min(left)
        whole += "M{:.1f} {:.1f}".format(*place(mesh.points[start]))
        while vertex in left:
            left.remove(vertex)
            vertex, facet = after[vertex]
            whole += arcs[facet]
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


def _bar(x: np.ndarray) -> np.ndarray:
    thick = 0.5 * BAR * float(np.ptp(x))
    return np.array([[x.min(), -thick], [x.max(), thick]])


def _end(place: tuple[float, float], kind: str) -> str:
    """Support symbol at the end of a beam: a wall if clamped, a triangle if hinged."""
    x, y = place
    if kind == "clamped":
        return f'<path d="M{x:.1f} {y - 26:.1f}v38" stroke="{STROKE}" stroke-width="4.5"/>'
    if kind == "hinged":
        return f'<path d="M{x:.1f} {y:.1f}l-7 12h14z" fill="{STROKE}"/>'
    return ""


def _thinned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    keep = np.unique(np.append(np.linspace(0, len(x) - 1, SAMPLES).astype(int), y.argmax()))
    return x[keep], y[keep]


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x}" y="{y}" font-size="12" text-anchor="{anchor}" fill="{INK}">{html.escape(text)}</text>'


def _picture(height: float, title: str, drawn: str) -> str:
    said = html.escape(title, quote=True)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {height:.0f}" role="img" aria-label="{said}" '
        f'style="max-width:{WIDTH:g}px;width:100%;font-family:system-ui,sans-serif">{drawn}</svg>'
    )
