"""Read outlines from SVG, DXF, shapely polygons and lists of points; curves stay curves."""

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from .._base import check, isolated
from .._base.rounding import SAME
from . import open_paths
from .facets import angles, cross_product
from .loops import (
    FARTHEST,
    MOST_PIECES,
    UNITS,
    Arc,
    Bezier,
    Loop,
    Outline,
    Piece,
    extent,
    is_straight,
    polyline,
    refuse_millimetres,
    ring,
    segment,
    signed_area,
    tangent,
    why_crossed,
)
from .smooth_edges import DENSE, smooth_runs

DXF_UNITS = {  # $INSUNITS code -> [m]
    1: 0.0254, 2: 0.3048, 3: 1609.344, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 8: 2.54e-8, 9: 2.54e-5, 10: 0.9144, 11: 1e-10,
    12: 1e-9, 13: 1e-6, 14: 0.1, 15: 10.0, 16: 100.0, 21: 1200.0 / 3937.0, 22: 100.0 / 3937.0, 23: 3600.0 / 3937.0,
    24: 6336000.0 / 3937.0,
}  # fmt: skip
# by the CSS standard -> [m]
SVG_UNITS = UNITS | {"px": 0.0254 / 96.0, "pt": 0.0254 / 72.0, "pc": 0.0254 / 6.0, "q": 0.25e-3}
# [-] gaps below this fraction of the extent are closed and noted: a line's width on paper, no hole anybody means
BRIDGED = 1e-3
MOST_NUMBERS = 100 * MOST_PIECES  # [-] most digit groups in the shapes of a drawing; an arc of long decimals has 12
SHAPES = {"path", "rect", "circle", "ellipse", "line", "polyline", "polygon"}
LONGEST_COMMENT = 1_000_000  # [-] characters of a comment in a drawing: longer ones are none
# [rad] in a drawing without names, a sharper turn, of some 6 degrees, starts a new edge; smooth joints turn by less
CORNER = 0.1

Drawn = tuple[list[Loop], dict[str, np.ndarray]]  # closed loops, and named open paths (n, 2) [m]


def read_outline(source: Any, unit: str | None) -> tuple[Outline, dict[str, np.ndarray], list[str]]:
    """Outline [m] from a file name, a shapely polygon or points (n, 2), named open paths, and notes on assumptions."""
    notes: list[str] = []
    if isinstance(source, (str, Path)):
        path = check.path("source", source)
        if not path.is_file():
            raise ValueError(f"source must name an .svg or .dxf file, got {str(source)!r}; {check.absent(path)}")
        readers = {".svg": _svg, ".dxf": _dxf}
        if path.suffix.lower() not in readers:
            raise ValueError(f"source must be an .svg or .dxf file, got {path.name!r}; meshes are read by fi.mesh.load")
        found, lines = readers[path.suffix.lower()](path, unit, notes)
        return _outline_with_holes(path.name, found), lines, notes
    scale = 1.0 if unit is None else UNITS[check.one_of("unit", unit, UNITS)]
    if hasattr(source, "geom_type"):
        if source.geom_type != "Polygon":
            raise ValueError(f"source must be one shapely Polygon, got a {source.geom_type}; mesh its parts one by one")
        rings = [source.exterior.coords, *(ring.coords for ring in source.interiors)]
    else:
        rings = [source]
    rings = [check.array("source", ring, (None, None), "m") for ring in rings]
    loops = [_smooth_loop(ring[:, :2] * scale, notes) for ring in rings]
    return _outline_with_holes("source", loops), {}, notes


def _smooth_loop(points: np.ndarray, notes: list[str]) -> Loop:
    """Loop through points (n, 2): a smooth curve where the turns are small, straight lines elsewhere."""
    points = ring("source", points, "points", MOST_NUMBERS)
    gaps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    if gaps.min() == 0.0:
        raise ValueError("source has the same point twice in a row; remove one")
    points = points[gaps > SAME * np.ptp(points)]  # rounding leaves the last beside the first
    if signed_area(points) < 0.0:
        points = points[::-1]
    pieces = _smooth_pieces(points, True, "source", notes)
    if len(pieces) > MOST_PIECES:
        raise ValueError(f"source must have at most {MOST_PIECES} corners, got {len(pieces)}")
    return pieces


def _smooth_pieces(points: np.ndarray, closed: bool, source: str, notes: list[str], name: str = "") -> Loop:
    """Pieces through the points (n, 2) of a loop or line."""
    pieces: list[Piece] = []
    runs, scatter = smooth_runs(points, closed)
    for place, controls, circle in runs:
        if circle is None:
            pieces += [Bezier(control, name) for control in controls]
        else:
            centre, radius = circle
            start = math.atan2(*(place[0] - centre)[::-1])
            turns = np.unwrap(np.arctan2(*(place - centre).T[::-1]))
            axes = np.array([radius, 0.0]), np.array([0.0, radius])
            pieces.append(Arc(centre, *axes, start, float(turns[-1] - turns[0]), name))
    if any(not is_straight(piece) for piece in pieces):
        notes.append(
            f"{source}: points along gentle bends were joined by smooth curves; fi.mesh.polygon joins points by "
            "straight lines"
        )
    if scatter:
        notes.append(f"{source}: points scatter by {scatter:.1g} m; the outline passes between them")
    return tuple(pieces)


def _smooth_lines(name: str, pieces: list[Piece], notes: list[str]) -> list[Piece]:
    """Pieces in which many straight ones in a row, as of traced curves, are replaced by smooth ones."""
    ends = np.array([piece.at(np.array([0.0, 1.0])) for piece in pieces]).reshape(-1, 2, 2)
    breaks = [
        i for i in range(1, len(pieces))
        if not (is_straight(pieces[i - 1]) and is_straight(pieces[i]) and np.array_equal(ends[i - 1, 1], ends[i, 0]))
        or pieces[i - 1].name != pieces[i].name
    ]  # fmt: skip
    result: list[Piece] = []
    noted: list[str] = []
    for a, b in pairwise([0, *breaks, len(pieces)]):
        points = np.concatenate([ends[a:b, 0], ends[b - 1 : b, 1]])
        points = points[np.append(np.diff(points, axis=0).any(axis=1), True)] if b > a + DENSE else points
        closed = b > a and np.array_equal(points[0], points[-1])
        if len(points) - closed > DENSE:
            result += _smooth_pieces(points[: len(points) - closed], closed, name, noted, pieces[a].name)
        else:
            result += pieces[a:b]
    notes += dict.fromkeys(noted)
    return result


def svg_arrays(path: Path) -> dict[str, np.ndarray]:
    """Pieces and size of an SVG file; runs in the reader process (see `isolated`)."""
    import svgelements

    _refuse_entities(path)
    drawing = svgelements.SVG.parse(_shown(path))
    if not isinstance(drawing, svgelements.SVG):
        raise ValueError("it contains no <svg> element")
    found: list[Piece] = []
    for shape in drawing.elements():
        if isinstance(shape, svgelements.Shape) and shape.values.get("visibility") not in ("hidden", "collapse"):
            whole = svgelements.Path(shape)
            whole.reify()
            name = str(shape.id) if shape.id else ""
            for part in whole:
                if isinstance(part, svgelements.Arc):
                    centre, *ends = (np.array([p.x, p.y]) for p in (part.center, part.prx, part.pry, part.start))
                    a, b, first = (end - centre for end in ends)  # askew axes once the drawing is sheared
                    sign = math.copysign(1.0, float(cross_product(a, b)))
                    start = math.atan2(sign * float(cross_product(a, first)), sign * float(cross_product(first, b)))
                    found.append(Arc(centre, a, b, start, sign * float(part.sweep), name))
                elif not isinstance(part, svgelements.Move) and part.start is not None and part.end is not None:
                    control = [getattr(part, end, None) for end in ("start", "control", "control1", "control2", "end")]
                    found.append(Bezier(np.array([[p.x, p.y] for p in control if p is not None], float), name))
            _check_number(path.name, found)
    shown, box = svgelements.Matrix(drawing.viewbox_transform), drawing.viewbox
    # parsed here because svgelements rounds its millimetre to seven digits, and takes a side not stated for 1000 px
    stated = (re.fullmatch(r"\s*([\d.eE+-]+)\s*([a-z]+)\s*", str(drawing.values.get(name, "")).lower())
              for name in ("width", "height"))  # fmt: skip
    sides = [float(each[1]) * SVG_UNITS.get(each[2], math.nan) if each else math.nan for each in stated]
    each = np.array(sides) / (box.width, box.height) if box else 0.0 * np.array(sides) + SVG_UNITS["px"]
    style = str(box.preserve_aspect_ratio if box else "")
    if not style.startswith("none") or np.isnan(each).any():
        each = np.full(2, (np.fmax if "slice" in style else np.fmin).reduce(each))
    return {**_packed(found), "pixels": np.array([shown.a, shown.d]), "size": each}


def _shown(path: Path) -> BytesIO:
    """An SVG file without shapes that only masks, markers and symbols hold; svgelements would draw them.

    Views state what is by default: without viewBox svgelements exchanges their sides, without sides it takes others'.
    """
    tree = ElementTree.parse(path)
    for view in tree.iter():
        if str(view.tag).rpartition("}")[2] == "svg":
            for name in ("width", "height") if view is not tree.getroot() else ():
                view.attrib.setdefault(name, "100%")
            sides = [re.fullmatch(r"\s*([\d.]+)\s*([a-z]*)\s*", view.get(name, "")) for name in ("width", "height")]
            if "viewBox" not in view.attrib and all(each and (each[2] or "px") in SVG_UNITS for each in sides):
                pixels = [float(each[1]) * SVG_UNITS[each[2] or "px"] / SVG_UNITS["px"] for each in sides if each]
                view.set("viewBox", f"0 0 {pixels[0]!r} {pixels[1]!r}")
    links = {link for each in tree.iter() for key, link in each.attrib.items() if key.rpartition("}")[2] == "href"}
    for parent in list(tree.iter()):
        for i, child in enumerate(parent):
            start, brace, tag = str(child.tag).rpartition("}")
            if tag == "symbol" and "viewBox" in child.attrib and f"#{child.get('id')}" in links:
                raise ValueError(
                    f"it uses symbol {child.get('id')!r:.99}, which has a viewBox; draw its shapes instead"
                )
            if tag in ("mask", "marker", "symbol"):
                child.tag = start + brace + ("g" if tag == "symbol" else "defs")
                parent[i] = apart = ElementTree.Element(f"{start}{brace}defs")
                apart.append(child)
    return BytesIO(ElementTree.tostring(tree.getroot()))


def _refuse_entities(path: Path) -> None:
    """Raise ValueError if an XML file declares entities, which can expand to gigabytes, or is huge in another way."""

    def refuse(*_: Any) -> None:
        raise ValueError("it declares XML entities; save it as plain SVG")

    numbers = shapes = 0

    def count_shape(element: str, attributes: dict[str, str]) -> None:
        nonlocal numbers, shapes
        shapes += element.rpartition(":")[2] in SHAPES
        if shapes > MOST_PIECES:
            raise ValueError(f"it contains more than {MOST_PIECES} shapes; simplify the drawing")
        for name in ("d", "points"):
            numbers += len(re.findall(r"\d+", attributes.get(name, "")))
        if numbers > MOST_NUMBERS:  # the drawing library would take minutes over them
            raise ValueError(f"its shapes contain more than {MOST_NUMBERS} numbers; simplify them")

    def comment(text: str) -> None:
        if len(text) > LONGEST_COMMENT:
            raise ValueError(f"it contains a comment of {len(text) / 1e6:.3g} million characters; remove it")

    parser = expat.ParserCreate()
    parser.EntityDeclHandler, parser.StartElementHandler, parser.CommentHandler = refuse, count_shape, comment
    with open(path, "rb") as file:
        parser.Parse(file.read(), True)  # ParseFile would read a huge comment again and again


def _svg(path: Path, unit: str | None, notes: list[str]) -> Drawn:
    """Closed loops and named open paths [m] of all shapes in an SVG file, y upward."""
    drawn = isolated.read_apart(path, "SVG", "mesh.drawings:svg_arrays")
    pixels, size = drawn["pixels"], drawn["size"]  # of one unit of the drawing, along x and y
    if unit is not None:
        size = np.full(2, UNITS[check.one_of("unit", unit, UNITS)])
    elif np.isnan(size).any():
        size = pixels * SVG_UNITS["px"]
        notes.append(f"{path.name} states no unit; assumed px of 1/96 inch, pass unit= to change that")
    notes.append(f"{path.name}: y points down in an SVG file and up here: the drawing's y is taken as -y")
    scale = size / np.where(pixels, pixels, np.nan)
    if not (np.isfinite(scale) & (scale > 0.0)).all():
        raise ValueError(f"{path.name} has no usable width and viewBox; set both to positive numbers")
    return _join_pieces(path.name, _unpacked(path.name, drawn, scale * [1.0, -1.0]), notes)


def dxf_arrays(path: Path) -> dict[str, np.ndarray]:
    """Pieces and unit of a DXF file; runs in the reader process (see `isolated`)."""
    import ezdxf
    from ezdxf import bbox
    from ezdxf.math import BoundingBox, Matrix44

    drawing = ezdxf.readfile(path)
    hidden = {layer.dxf.name.lower() for layer in drawing.layers if layer.is_off() or layer.is_frozen()}
    found: list[Piece] = []
    left: set[str] = set()
    box = BoundingBox()
    for whole in drawing.modelspace():
        for entity, place, layer in _dxf_visible(whole, hidden, left, Matrix44()):
            pieces = _dxf_pieces(entity, "" if layer == "0" else layer)
            left |= set() if pieces else {entity.dxftype()}
            within = bbox.extents([entity] if pieces else [], fast=True)
            box.extend(place.transform_vertices(within.cube_vertices()) if within.has_data else ())
            found += [_moved(piece, place) for piece in pieces]
            _check_number(path.name, found)
    size = np.array(box.size if box.has_data else (0.0, 0.0, 0.0))
    unit = np.array(int(drawing.header.get("$INSUNITS", 0)))
    return {**_packed(found), "unit": unit, "left": np.array(sorted(left), str), "size": size}


def _dxf(path: Path, unit: str | None, notes: list[str]) -> Drawn:
    """Closed loops, and open paths on named layers, of the lines, arcs and splines in a DXF file's model space [m]."""
    drawn = isolated.read_apart(path, "DXF", "mesh.drawings:dxf_arrays")
    if drawn["left"].size:
        notes.append(f"{path.name}: left out, as they are no lines to see: {', '.join(drawn['left'].tolist())}")
    if unit is not None:
        scale = UNITS[check.one_of("unit", unit, UNITS)]
    else:
        scale = DXF_UNITS.get(int(drawn["unit"]), 0.0)
        if not scale:
            scale = 1.0
            notes.append(f"{path.name} states no unit; assumed metres, pass unit= to change that")
    loops, lines = _join_pieces(path.name, _unpacked(path.name, drawn, scale), notes)
    if drawn["size"][2] > 1e-3 * drawn["size"].max():  # less is rounding
        notes.append(f"{path.name}: its z, which goes over {scale * drawn['size'][2]:.3g} m, is left out")
    if unit is None:
        refuse_millimetres(path.name, max(extent(loop) for loop in loops))
    return loops, lines


def _dxf_visible(
    entity: Any, hidden: set[str], left: set[str], place: Any, layer: str = "0"
) -> Iterator[tuple[Any, Any, str]]:
    """The entity, or those of the block that it inserts, with their places and layers; ``left`` gets what is hidden.

    The places are multiplied here because ezdxf loses the shear of a turned block in an unevenly scaled one.
    """
    layer = layer if entity.dxf.layer == "0" else str(entity.dxf.layer)  # in a block, 0 is that of its insert
    if entity.dxf.get("invisible", 0) or layer.lower() in hidden:
        left.add(f"hidden {entity.dxftype()}")
    elif entity.dxftype() == "INSERT":
        parts = list(entity.block() or ())
        left |= set() if parts else {"INSERT"}
        for each in entity.multi_insert():
            for part in parts:
                yield from _dxf_visible(part, hidden, left, each.matrix44() * place, layer)
    else:
        yield entity, place, layer


def _moved(piece: Piece, place: Any) -> Piece:
    """A piece under a matrix of ezdxf, by which points are multiplied from the left."""
    turn, shift = np.split(np.array(list(place)).reshape(4, 4)[[0, 1, 3], :2], [2])
    if isinstance(piece, Arc):
        return replace(piece, centre=(piece.centre @ turn + shift)[0], a=piece.a @ turn, b=piece.b @ turn)
    return replace(piece, control=piece.control @ turn + shift)


def _dxf_pieces(entity: Any, name: str) -> list[Piece]:
    kind = entity.dxftype()
    if kind == "LINE":
        return [segment(tuple(entity.dxf.start.vec2), tuple(entity.dxf.end.vec2), name)]
    if kind in ("ARC", "CIRCLE"):
        from ezdxf.entities import Ellipse

        return _dxf_pieces(Ellipse.from_arc(entity), name)
    if kind == "ELLIPSE":
        centre, a, b = (np.array([p.x, p.y]) for p in (entity.dxf.center, entity.dxf.major_axis, entity.minor_axis))
        start = float(entity.dxf.start_param)
        sweep = (float(entity.dxf.end_param) - start) % (2.0 * math.pi) or 2.0 * math.pi
        return [Arc(centre, a, b, start, sweep, name)]
    if kind in ("LWPOLYLINE", "POLYLINE"):
        if kind == "POLYLINE":  # the frame of a smoothed one is no part of it
            entity.vertices[:] = [vertex for vertex in entity.vertices if not vertex.dxf.flags & 16]
        return [piece for part in entity.virtual_entities() for piece in _dxf_pieces(part, name)]
    if kind == "SPLINE":
        curve = _clamped(entity.construction_tool())
        near = curve.cubic_bezier_approximation(level=8) if curve.is_rational else ()
        parts = [part.control_points for part in near] or list(curve.bezier_decomposition())
        return [Bezier(np.array([[p.x, p.y] for p in part]), name) for part in parts]
    return []


def _clamped(curve: Any) -> Any:
    """The same curve of ezdxf with its first and last knots repeated, so that it begins and ends at control points."""
    if curve.is_clamped:
        return curve
    degree, (low, high) = curve.degree, (curve.knots()[curve.degree], curve.knots()[curve.count])
    for end in (low, high):
        for _ in range(degree - curve.knots().count(end)):
            curve = curve.insert_knot(end)
    inner = [knot for knot in curve.knots() if low < knot < high]
    first = sum(knot <= low for knot in curve.knots()) - degree - 1
    used, order = slice(first, first + len(inner) + degree + 1), degree + 1
    knots = [*[low] * order, *inner, *[high] * order]
    return type(curve)(curve.control_points[used], order, knots, curve.weights()[used] or None)


def _check_number(name: str, pieces: list[Piece], most: int = 10 * MOST_PIECES) -> None:
    if len(pieces) > most:
        raise ValueError(f"{name} has more than {most} lines and curves; simplify the drawing")


def _packed(pieces: list[Piece]) -> dict[str, np.ndarray]:
    """Pieces as arrays: all numbers concatenated, how many belong to each piece, which are arcs, and the names."""
    rows = [
        np.concatenate([p.centre, p.a, p.b, [p.start, p.sweep]]) if isinstance(p, Arc) else p.control.ravel()
        for p in pieces
    ]
    return {
        "numbers": np.concatenate([np.zeros(0), *rows]),
        "lengths": np.array([len(row) for row in rows], int),
        "arcs": np.array([isinstance(piece, Arc) for piece in pieces], bool),
        "names": np.array([piece.name[:100] for piece in pieces], str),
    }


def _unpacked(name: str, drawn: dict[str, np.ndarray], scale: Any) -> list[Piece]:
    """Pieces from the arrays of `_packed`, with x and y multiplied by ``scale``, a number or (2,)."""
    if not np.isfinite(drawn["numbers"]).all():
        raise ValueError(f"{name} has coordinates that are not finite numbers; correct the drawing")
    rows = np.split(drawn["numbers"], np.cumsum(drawn["lengths"])[:-1])
    pieces: list[Piece] = []
    for row, arc, edge in zip(rows, drawn["arcs"], drawn["names"].tolist()):
        places = row[: 6 if arc else None].reshape(-1, 2) * scale
        pieces.append(Arc(places[0], places[1], places[2], row[6], row[7], edge) if arc else Bezier(places, edge))
    return pieces


def _join_pieces(name: str, pieces: list[Piece], notes: list[str]) -> Drawn:
    """Join pieces end to end into closed loops; what has a name and cannot belong to one is a line."""
    pieces = _smooth_lines(name, pieces, notes)
    _check_number(name, pieces, MOST_PIECES)
    corners = np.array([piece.at(np.linspace(0.0, 1.0, 5)) for piece in pieces]).reshape(-1, 2)
    if not (np.abs(corners) < FARTHEST).all():
        raise ValueError(f"{name} has coordinates beyond {FARTHEST:g} m; correct the drawing")
    span = float(np.ptp(corners, axis=0).max(initial=0.0)) if pieces else 0.0
    # the single precision of drawing programs leaves shorter pieces
    left = [piece for piece in pieces if extent((piece,)) > 1e-7 * span]
    if not left:
        raise ValueError(f"{name} has no outline; draw it with paths, lines, arcs or splines")
    lines = open_paths.lines(left, span, BRIDGED * span)
    used = {i for chain in lines for i in chain}
    rest = [piece for i, piece in enumerate(left) if i not in used]
    loops = _loops(name, rest or left, span, notes)
    largest = max(extent(loop) for loop in loops)
    for chain in lines:
        if extent(tuple(left[i] for i in chain)) > (1.0 + BRIDGED) * largest:
            raise _why_open(name, *open_paths.flatten_chain([left[i] for i in chain], np.inf)[[0, -1]])
    size = span / 20.0  # parts of a curve are no longer: a quarter circle errs by 3e-4 of it
    paths = [(left[chain[0]].name, open_paths.flatten_chain([left[i] for i in chain], size)) for chain in lines]
    named = open_paths.name_paths(paths, {piece.name for loop in loops for piece in loop})
    if named:
        beside = max(open_paths.sag(left[i], size) for chain in lines for i in chain)
        curved = f"; their curves become straight parts, at most {beside:.1g} m beside them" if beside else ""
        notes.append(f"{name}: the open paths {', '.join(named)} are lines for ribs{curved}")
    return loops, named


def _why_open(name: str, start: np.ndarray, stop: np.ndarray) -> ValueError:
    """What to say of an outline that is not closed."""
    return ValueError(
        f"{name} has an open outline: it ends at ({stop[0]:g}, {stop[1]:g}) m, "
        f"{np.linalg.norm(stop - start):g} m from its start; close the path there, or give it a name (in SVG an id, in "
        "DXF a layer) if it is the line of a rib"
    )


def _loops(name: str, left: list[Piece], span: float, notes: list[str]) -> list[Loop]:
    """Join pieces end to end into closed loops."""
    starts, stops = np.stack([piece.at(np.array([0.0, 1.0])) for piece in left], axis=1)
    free = np.ones(len(left), bool)
    loops: list[Loop] = []
    closed: list[float] = []
    while free.any():
        last = int(free.argmax())
        chain, start, stop = [left[last]], starts[last], stops[last]
        free[last] = False
        while np.linalg.norm(stop - start) > SAME * span:
            onward, back = (np.where(free, np.hypot(*(ends - stop).T), np.inf) for ends in (starts, stops))
            gaps = np.minimum(onward, back)
            best, home = int(gaps.argmin()), float(np.linalg.norm(start - stop))
            if np.count_nonzero(gaps <= SAME * span) > 1:
                raise ValueError(
                    f"{name} has three lines that meet at ({stop[0]:g}, {stop[1]:g}) m; draw the outline as one path"
                )
            if gaps[best] <= min(BRIDGED * span, home):
                ahead = onward[best] <= gaps[best]
                chain.append(left[best] if ahead else left[best].reversed())
                stop, free[best] = stops[best] if ahead else starts[best], False
                closed.append(float(gaps[best]))
            elif home <= BRIDGED * span:
                closed.append(home)
                break
            else:
                raise _why_open(name, start, stop)
        loops.append(tuple(chain))
    closed = [gap for gap in closed if gap > SAME * span]
    if closed:
        which = "a gap of" if len(closed) == 1 else f"each of {len(closed)} gaps of up to"
        notes.append(f"{name}: {which} {max(closed):g} m was closed")
    return loops


def _outline_with_holes(name: str, loops: list[Loop]) -> Outline:
    """The largest loop becomes the outline, the others its holes; unnamed edges get names."""
    areas = [abs(signed_area(polyline(loop, extent(loop) / 50.0))) for loop in loops]
    order = np.argsort(areas)[::-1]
    outer = loops[order[0]]
    outline = Outline.around(outer, tuple(loops[i] for i in order[1:]))
    problem = why_crossed(outline)
    if problem:
        raise ValueError(f"{name}: {problem}")
    holes = tuple(tuple(replace(p, name=p.name or f"hole{i}") for p in loop) for i, loop in enumerate(outline.holes))
    return Outline(_edges(outline.outer), holes)


def _edges(loop: Loop) -> Loop:
    """Name unnamed pieces edge0, edge1 ...; each corner starts a new edge."""
    directions = [tangent(piece, np.array([0.0, 1.0])) for piece in loop]
    before, after = np.stack([directions[-1], *directions[:-1]])[:, 1], np.stack(directions)[:, 0]
    sharp = (np.abs(angles(before, after)) > CORNER).tolist()
    start = sharp.index(True) if any(sharp) else 0
    number, result = -1, []
    for i in [*range(start, len(loop)), *range(start)]:
        if sharp[i] or number < 0:
            number += 1
        result.append(replace(loop[i], name=loop[i].name or f"edge{number}"))
    return tuple(result)
