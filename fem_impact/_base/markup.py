"""Tables for the terminal and for notebooks, small SVG pictures without a drawing library, and text in pictures."""

import base64
import html
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from .explained import lines_of_notes

WIDTH = 360.0  # [px] of a picture; narrow pages shrink it
MARGIN = 16.0  # [px] empty border, so that markers on the edge are not cut off
# Pages set these CSS variables for light and dark themes; notebooks fall back to the colour after the comma.
INK, BODY = "var(--ink, #333333)", "var(--body, #d6e6f2)"
STROKE, STRIKE = "var(--line-strong, #0072b2)", "var(--strike, #d55e00)"


def literal(text: str) -> str:
    """Text of the user's for a picture by matplotlib, which takes what stands between dollar signs for a formula."""
    return text.replace("$", r"\$")


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


def note_list(lines: Iterable[str]) -> str:
    """Notes, each a paragraph; all text is escaped."""
    return "".join(f"<p>{html.escape(line)}</p>" for line in lines_of_notes(lines))


def data_uri(kind: str, raw: bytes) -> str:
    """An address that holds the bytes of a file of a media type."""
    return f"data:{kind};base64,{base64.b64encode(raw).decode('ascii')}"


def side_by_side(*parts: str) -> str:
    """HTML pieces side by side; the row wraps on narrow pages."""
    return f'<div style="display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start">{"".join(parts)}</div>'


def curve(x: np.ndarray, y: np.ndarray, *, label: str, unit: str, title: str) -> str:
    """Time history ``y`` [unit] over ``x`` [s], labelled with its peak and duration."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    if len(x) > 400:  # about one point per pixel is enough
        some = np.unique(np.append(np.linspace(0, len(x) - 1, 400).astype(int), y.argmax()))
        x, y = x[some], y[some]
    span, top = float(np.ptp(x)) or 1.0, float(y.max(initial=0.0)) or 1.0
    across = MARGIN + (WIDTH - 2 * MARGIN) * (x - x[0]) / span
    height = 210.0  # [px]
    foot, right = height - 1.5 * MARGIN, WIDTH - MARGIN
    up = foot - (height - 3.5 * MARGIN) * y / top
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, up))
    drawn = (
        f'<line x1="{MARGIN}" x2="{right}" y1="{foot}" y2="{foot}" stroke="{INK}" stroke-width="0.6"/>'
        f'<polyline points="{line}" fill="none" stroke="{STROKE}" stroke-width="1.6" stroke-linejoin="round"/>'
    )
    said = _text(MARGIN, MARGIN, f"{label}, peak {top:.4g} {unit}") + _text(right, height - 6, f"{span:.4g} s", "end")
    return picture(height, title, drawn + said)


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x}" y="{y}" font-size="12" text-anchor="{anchor}" fill="{INK}">{html.escape(text)}</text>'


def picture(height: float, title: str, drawn: str) -> str:
    said = html.escape(title, quote=True)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {height:.0f}" role="img" aria-label="{said}" '
        f'style="max-width:{WIDTH:g}px;width:100%;font-family:system-ui,sans-serif">{drawn}</svg>'
    )
