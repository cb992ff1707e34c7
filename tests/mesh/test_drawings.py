"""Outlines from SVG, DXF, shapely and points: curves stay curves, units are honoured, what is no body is refused."""

from itertools import pairwise

import ezdxf
import numpy as np
import pytest
import shapely
from numpy.testing import assert_allclose
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

import fem_impact as fi
from fem_impact._base import isolated
from fem_impact.mesh import drawings

pytestmark = pytest.mark.usefixtures("read_here")
READ_APART = isolated.run_reader
PLATE = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 2e-3)
PER_RATE = np.sqrt(7850 * 2e-3 / (210e9 * 2e-3**3 / (12 * (1 - 0.3**2))))
ANGLE = np.linspace(0, 2 * np.pi, 48, endpoint=False)
RIM = '<rect id="rim" x="0" y="0" width="400" height="300"/>'
HOLE, OPEN = '<circle id="hole" cx="80" cy="200" r="20"/>', '<path id="rim" d="M0 0 H400 V300 H0"/>'
SVG = '<svg xmlns="http://www.w3.org/2000/svg" {head}>{body}</svg>'


def first(shape, support):
    """Dimensionless first frequency with the rim held."""
    return fi.find_modes(fi.assemble(shape, PLATE, {"boundary": support}), n_modes=1).omega[0] * PER_RATE


def svg(folder, body, head='width="2000mm" height="2000mm" viewBox="0 0 2 2"'):
    (folder / "plate.svg").write_text(SVG.format(head=head, body=body))
    return folder / "plate.svg"


def in_mm(folder, body, width=1000, height=600):
    return svg(folder, body, f'width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}"')


def dxf(folder, draw, units=6):
    document = ezdxf.new()
    document.units = units
    draw(document.modelspace())
    document.saveas(folder / "plate.dxf")
    return folder / "plate.dxf"


@pytest.mark.parametrize(
    "source",
    [
        lambda _: np.column_stack([np.cos(ANGLE), np.sin(ANGLE)]),
        lambda _: shapely.Point(3, 4).buffer(1.0),
        lambda folder: svg(folder, '<circle cx="1" cy="1" r="1"/>'),
    ],
    ids=["points", "shapely", "svg"],
)
def test_points_on_a_circle_make_a_disk(source, tmp_path):
    disk = fi.mesh.outline(source(tmp_path))
    assert_allclose(disk.curvatures, 1.0, rtol=1e-9)
    assert_allclose(first(disk, "hinged"), 4.935149043, rtol=1e-5)  # Bessel root; the polygon's limit is 40 % higher


TURNED = '<ellipse cx="1" cy="1" rx="1" ry=".5" transform="rotate(30 1 1)"/>'


@pytest.mark.parametrize(
    ("source", "half", "note"),
    [
        (lambda _: np.column_stack([2 * np.cos(ANGLE), np.sin(ANGLE)]), 2.0, "smooth curves"),
        (lambda folder: svg(folder, TURNED, 'viewBox="0 0 2 2"'), 1.0, ""),
        (lambda folder: dxf(folder, lambda space: space.add_ellipse((0, 0), (2, 0), 0.5)), 2.0, ""),
    ],
    ids=["points", "svg", "dxf"],
)
def test_an_ellipse_is_an_ellipse(source, half, note, tmp_path):
    """a^2 omega sqrt(rho h / D) = 27.377 for a clamped one of 2 : 1 (Leissa, Vibration of Plates, table 3.1)."""
    shape = fi.mesh.outline(source(tmp_path), unit=None if note else "m")
    assert not note or note in shape.notes[0]
    assert_allclose(half**2 * first(shape, "clamped"), 27.377, rtol=1e-4)


def test_svg_keeps_size_names_and_holes_and_turns_y_upward(tmp_path):
    body = '<path id="rim" d="M0 0 H300 V200 H0 Z"/><circle id="hole" cx="80" cy="50" r="20"/>'
    body += '<g visibility="hidden"><circle id="unseen" cx="200" cy="50" r="20"/></g>'
    shape = fi.mesh.outline(in_mm(tmp_path, body, 300, 200))
    assert set(shape.edges) == {"rim", "hole", "outer", "boundary"}
    assert_allclose(np.ptp(shape.points, axis=0), [0.3, 0.2], rtol=1e-9)
    hole = shape.points[shape.facets[shape.edges["hole"]][:, 0]]
    assert_allclose(hole.mean(axis=0), [0.08, -0.05], atol=1e-4)  # y upward
    assert shape.notes == ("plate.svg: y points down in an SVG file and up here: the drawing's y is taken as -y",)


@pytest.mark.parametrize(("head", "unit", "size"), [
    ('width="200" height="100" viewBox="0 0 100 100"', "mm", (0.05, 0.04)),  # drawn half as wide as the page
    ('width="200mm" height="100mm" viewBox="0 0 100 100" preserveAspectRatio="none"', "mm", (0.05, 0.04)),
    ('width="200mm" height="100mm" viewBox="0 0 100 100" preserveAspectRatio="none"', None, (0.1, 0.04)),
    ('width="200mm" height="100mm" viewBox="0 0 100 100"', None, (0.05, 0.04)),
    ('width="200mm" height="100mm" viewBox="0 0 100 100" preserveAspectRatio="xMidYMid slice"', None, (0.1, 0.08)),
    ('width="100mm" viewBox="0 0 100 100"', None, (0.05, 0.04)),
    ('height="100mm" viewBox="0 0 300 200"', None, (0.025, 0.02)),
    ('width="10CM" height="10CM" viewBox="0 0 100 100"', None, (0.05, 0.04)),
    ('width="72pt" height="72pt" viewBox="0 0 100 100"', None, (0.0127, 0.01016)),
    ('width="1600Q" height="1200Q" viewBox="0 0 400 300"', None, (0.05, 0.04)),  # quarters of millimetres
    ('width="100mm" height="100mm"', None, (50 * 0.0254 / 96, 40 * 0.0254 / 96)),
])  # fmt: skip
def test_svg_has_the_size_of_its_page_or_of_the_unit_given(tmp_path, head, unit, size):
    shape = fi.mesh.outline(svg(tmp_path, '<rect width="50" height="40"/>', head), unit=unit)
    assert_allclose(np.ptp(shape.points, axis=0), size, rtol=1e-9)
    assert not any("no unit" in note for note in shape.notes)


def test_dxf_lines_and_arcs_in_any_order_make_a_stadium(tmp_path):
    def draw(space):
        space.add_line((0, 0), (1000, 0))
        space.add_line((0, 1000), (1000, 1000))
        space.add_arc((1000, 500), 500, -90, 90)
        space.add_arc((0, 500), 500, 90, 270)
        space.add_circle((500, 500), 100)

    shape = fi.mesh.outline(dxf(tmp_path, draw, units=4))
    exact = 1.0 + 0.25 * np.pi - 0.01 * np.pi
    assert_allclose(fi.mesh.outline(dxf(tmp_path, draw, units=4), size=0.02).area, exact, rtol=1e-5)  # parabolas
    assert set(shape.edges) == {"edge0", "hole0", "outer", "boundary"}  # smooth all round: one edge


def test_an_edge_beside_a_gap_that_is_closed_stays_straight(tmp_path):
    corners = [(1e-7, 0.0), (0.4, 0.0), (0.4, 0.3), (0.0, 0.3), (0.0, 0.0)]

    def draw(space):
        for start, end in pairwise(corners):
            space.add_line(start, end)

    shape = fi.mesh.outline(dxf(tmp_path, draw))
    assert any("gap of 1e-07 m was closed" in note for note in shape.notes) and not shape.curved.any()
    parts = [[(0, 0), (0.4, 0)], [(0.4, 2e-4), (0.4, 0.3)], [(0.4, 0.3), (0, 0.3)], [(0, 0.3), (0, 1e-4)]]

    def lines(space):
        for part in parts:
            space.add_line(*part)

    apart = fi.mesh.outline(dxf(tmp_path, lines))
    assert apart.notes == ("plate.dxf: each of 2 gaps of up to 0.0002 m was closed",)


@pytest.mark.parametrize(("code", "metres"), [(7, 1e3), (9, 2.54e-5), (10, 0.9144), (15, 10.0), (21, 1200 / 3937)])
def test_a_unit_that_a_dxf_file_states_is_not_taken_as_none(tmp_path, code, metres):
    corners = np.array([(0.0, 0.0), (0.4, 0.0), (0.4, 0.3), (0.0, 0.3)]) / metres
    shape = fi.mesh.outline(dxf(tmp_path, lambda space: space.add_lwpolyline(corners, close=True), units=code))
    assert shape.notes == () and shape.area == pytest.approx(0.12)


def test_dxf_polyline_with_a_bulge_is_an_arc(tmp_path):
    corners = [(0, 0, 0, 0, 0), (1, 0, 0, 0, 1), (1, 1, 0, 0, 0), (0, 1, 0, 0, 0)]
    shape = fi.mesh.outline(dxf(tmp_path, lambda space: space.add_lwpolyline(corners, close=True)))
    curved = shape.curvatures[np.abs(shape.curvatures[:, 0]) > 0]
    assert_allclose(curved, 2.0, rtol=1e-6)


def test_dxf_blocks_are_drawn_and_what_is_hidden_or_no_line_is_told(tmp_path):
    def draw(space):
        space.add_lwpolyline([(0, 0), (1, 0), (1, 3), (0, 3)], close=True)
        space.doc.blocks.new("bolt").add_circle((0, 0), 0.1)
        pair = space.doc.blocks.new("pair")
        pair.add_blockref("bolt", (0, 0))
        pair.add_blockref("bolt", (0.6, 0))
        rows = {"rotation": 90.0, "column_count": 2, "column_spacing": 1.0}  # columns turn with the block
        space.add_blockref("pair", (0.5, 0.5), dxfattribs=rows)
        space.doc.layers.add("Plan").off()
        space.add_circle((0.2, 0.2), 0.1, dxfattribs={"layer": "plan"})
        space.add_circle((0.2, 0.2), 0.1, dxfattribs={"invisible": 1})
        space.add_text("top")

    shape = fi.mesh.outline(dxf(tmp_path, draw))
    holes = [shape.points[shape.facets[shape.edges[f"hole{i}"]].ravel()] for i in range(4)]
    centres = [0.5 * (hole.min(axis=0) + hole.max(axis=0)) for hole in holes]
    assert_allclose(sorted(y for _, y in centres), [0.5, 1.1, 1.5, 2.1], atol=2e-3)  # chords
    assert "hole4" not in shape.edges and "to see: TEXT, hidden CIRCLE" in shape.notes[0] and len(shape.notes) == 1


def test_what_is_hidden_in_a_dxf_block_is_left_out_and_layer_0_is_that_of_the_insert(tmp_path):
    def draw(space):
        space.doc.layers.add("Plan").freeze()
        block = space.doc.blocks.new("plate")
        block.add_lwpolyline([(0, 0), (1, 0), (1, 3), (0, 3)], close=True)
        block.add_circle((0.5, 0.5), 0.1, dxfattribs={"layer": "plan"})
        block.add_circle((0.5, 1.5), 0.1, dxfattribs={"invisible": 1})
        block.add_text("top")
        space.add_blockref("plate", (0, 0), dxfattribs={"layer": "rim"})

    shape = fi.mesh.outline(dxf(tmp_path, draw))
    assert set(shape.edges) == {"rim", "outer", "boundary"} and shape.area == pytest.approx(3.0)
    assert "to see: TEXT, hidden CIRCLE" in shape.notes[0]


def test_a_turned_dxf_block_within_an_unevenly_scaled_one_is_sheared(tmp_path):
    def draw(space):
        space.doc.blocks.new("square").add_lwpolyline([(0, 0), (1, 0), (1, 1), (0, 1)], close=True)
        space.doc.blocks.new("turned").add_blockref("square", (0, 0), dxfattribs={"rotation": 45.0})
        space.add_blockref("turned", (0, 0), dxfattribs={"xscale": 2.0, "yscale": -1.0})

    points = fi.mesh.outline(dxf(tmp_path, draw)).points  # a rhombus from the origin
    assert_allclose([points.min(axis=0), points.max(axis=0)], np.sqrt([[2.0, 2.0], [2.0, 0.0]]) * [[-1, -1], [1, 1]])


def test_the_frame_of_a_smoothed_dxf_polyline_is_no_part_of_it(tmp_path):
    def draw(space):
        line = space.add_polyline2d([], close=True)
        line.dxf.flags |= 4
        for flag, size in ((16, 1.0), (8, 0.7)):
            for corner in np.array([(1, 0), (0, 1), (-1, 0), (0, -1)]) * size:
                line.append_vertex(corner, dxfattribs={"flags": flag})

    assert fi.mesh.outline(dxf(tmp_path, draw)).area == pytest.approx(2 * 0.7**2)


@pytest.mark.parametrize("change", ["skewX(40)", "rotate(20) scale(-2 0.5) rotate(30)", "matrix(1 .3 -2 1.2 5 6)"])
def test_arcs_of_a_sheared_svg_are_arcs_of_ellipses(tmp_path, change):
    area = np.prod({"s": (1.0,), "r": (2.0, 0.5), "m": (1.8,)}[change[0]]) * 1e-6
    half = '<path d="M-60 0 A60 20 0 0 1 60 0 z"/>'
    shape = fi.mesh.outline(in_mm(tmp_path, f'<g transform="{change}">{half}</g>'), size=0.005)
    assert shape.area == pytest.approx(600 * np.pi * area, rel=1e-5)
    round_one = '<rect width="200" height="100" rx="40" ry="25"/>'
    shape = fi.mesh.outline(in_mm(tmp_path, f'<g transform="{change}">{round_one}</g>'), size=0.01)
    assert shape.area == pytest.approx((20000 - (4 - np.pi) * 1000) * area, rel=1e-5)


@pytest.mark.parametrize(("head", "body", "size"), [
    ('width="400mm" height="300mm"', '<rect width="100%" height="50%"/>', (0.4, 0.15)),
    ('width="400" height="300"', '<rect width="100%" height="50%"/>', (400 * 0.0254 / 96, 150 * 0.0254 / 96)),
    ('width="400mm" height="300mm" viewBox="0 0 400 300"', '<svg width="200" height="100">{}</svg>', (0.1, 0.05)),
    ('width="400mm" height="300mm" viewBox="0 0 400 300"', '<svg viewBox="0 0 800 600">{}</svg>', (0.2, 0.15)),
])  # fmt: skip
def test_shares_of_a_view_are_of_its_own_sides(tmp_path, head, body, size):
    drawn = svg(tmp_path, body.format('<rect width="50%" height="50%"/>'), head)
    assert_allclose(np.ptp(fi.mesh.outline(drawn).points, axis=0), size, rtol=1e-6)


def test_what_svg_masks_markers_and_symbols_hold_is_drawn_where_it_is_used(tmp_path):
    hole = '<circle cx="100" cy="100" r="20"/>'
    for name in ("mask", "marker", "symbol"):
        shape = fi.mesh.outline(in_mm(tmp_path, f'{RIM}<{name} id="a">{hole}</{name}>'))
        assert set(shape.edges) == {"rim", "outer", "boundary"}
    body = f'{RIM}<symbol id="a">{hole}</symbol><use href="#a" x="30"/>'
    shape = fi.mesh.outline(in_mm(tmp_path, body))
    assert_allclose(shape.points[shape.facets[shape.edges["hole0"]].ravel()].max(axis=0), [0.15, -0.08], atol=1e-3)
    with pytest.raises(ValueError, match="symbol 'a', which has a viewBox; draw its shapes instead"):
        fi.mesh.outline(in_mm(tmp_path, body.replace('id="a"', 'id="a" viewBox="0 0 9 9"')))


def test_the_third_coordinate_of_a_dxf_file_is_told(tmp_path):
    tilted = [(0, 0, 0), (1, 0, 0.1), (1, 3, 0.1), (0, 3, 0)]
    shape = fi.mesh.outline(dxf(tmp_path, lambda space: space.add_polyline3d(tilted, close=True)))
    assert shape.area == pytest.approx(3.0) and "its z, which goes over 0.1 m, is left out" in shape.notes[0]


@pytest.mark.parametrize("weights", [None, [1.0, 2.0, 1.0, 0.5, 1.0, 1.0, 1.0, 2.0, 1.0]])
def test_dxf_spline_whose_end_knots_are_not_repeated(tmp_path, weights):
    corner, knots = np.array([(2, 0), (1, 2), (-1, 2), (-2, 0), (-1, -2), (1, -2)] * 2, float)[:9], np.arange(2.0, 15.0)

    def draw(space):
        spline = space.add_open_spline(corner)
        spline.knots, spline.weights = knots, weights or []

    weighted = np.column_stack([corner, np.ones(9)]) * np.reshape(weights or np.ones(9), (9, 1))
    curve = BSpline(knots, weighted, 3)(np.linspace(5.0, 11.0, 100_001))
    control = drawings.dxf_arrays(dxf(tmp_path, draw))["numbers"].reshape(-1, 4, 2)  # of cubics, end to end
    assert_allclose(control[:, 0], np.roll(control[:, 3], 1, axis=0), atol=1e-12)
    halfway = np.array([1.0, 3.0, 3.0, 1.0]) / 8.0 @ control
    away, _ = cKDTree(curve[:, :2] / curve[:, 2:]).query(halfway)
    assert away.max() < 1e-4  # half the distance of the 100 001 points, around a curve of length 10


def traced(corners, n, scatter):
    """Points (n, 2) [m] along a polygon through ``corners``, which scatter by ``scatter`` [m]."""
    rim = shapely.LinearRing(corners)
    along = shapely.line_interpolate_point(rim, np.linspace(0.0, rim.length, n, endpoint=False))
    return shapely.get_coordinates(along) + scatter * np.random.default_rng(1).standard_normal((n, 2))


ELLIPSE = np.array([0.2, 0.15]) * np.exp(2j * np.pi * np.arange(5000) / 5000)[:, None].view(float).reshape(-1, 2)


@pytest.mark.parametrize(("scatter", "error"), [(0.0, 1e-5), (1e-5, 1e-4)])
def test_a_curve_of_many_points_takes_as_few_facets_as_a_drawn_one(scatter, error, tmp_path):
    """Hinged, where a polygon of many sides has other frequencies; points scatter by 7e-5 of the half axis."""
    drawn = svg(tmp_path, '<ellipse cx="1" cy="1" rx="0.2" ry="0.15"/>')
    shape = fi.mesh.outline(ELLIPSE + scatter * np.random.default_rng(1).standard_normal(ELLIPSE.shape))
    assert len(shape.facets) < 60 and shape.curved.all()
    assert any(f"scatter by {scatter:.1g} m" in note for note in shape.notes) == bool(scatter)
    assert_allclose(first(shape, "hinged"), first(fi.mesh.outline(drawn), "hinged"), rtol=error)


@pytest.mark.parametrize(
    "source",
    [
        lambda folder: in_mm(folder, f'<polygon points="{" ".join(f"{x} {y}" for x, y in 1e3 * ELLIPSE[::10])}"/>'),
        lambda folder: dxf(folder, lambda space: space.add_lwpolyline(ELLIPSE, close=True)),
    ],
    ids=["svg", "dxf"],
)
def test_a_polyline_of_many_points_is_a_curve(source, tmp_path):
    shape = fi.mesh.outline(source(tmp_path))
    assert shape.curved.all() and len(shape.facets) < 80
    assert "joined by smooth curves" in shape.notes[-1]


@pytest.mark.parametrize("scatter", [0.0, 1e-7, 1e-4])
@pytest.mark.parametrize("n", [420, 4200])
def test_traced_polygons_keep_their_corners_and_straight_sides(n, scatter):
    corners = np.array([(0.0, 0.0), (0.4, 0.0), (0.4, 0.15), (0.15, 0.15), (0.15, 0.3), (0.0, 0.3)])
    outer = drawings.read_outline(traced(corners, n, scatter), None)[0].outer
    starts = np.array([piece.at(np.zeros(1))[0] for piece in outer])
    assert len(outer) == 6 and not any(len(piece.control) > 2 for piece in outer)
    assert cKDTree(starts).query(corners)[0].max() <= 5.0 * scatter + 1e-12


def rounded_rectangle(n):
    """Points on the fillets, of 3 cm, of a rectangle of 30 x 20 cm: n on each, and none between."""
    turn = np.linspace(0.0, np.pi / 2.0, n)[:, None] + np.pi / 2.0 * np.arange(4)
    centre = np.array([(0.27, 0.17), (0.03, 0.17), (0.03, 0.03), (0.27, 0.03)])
    place = centre[:, None] + 0.03 * np.stack([np.cos(turn.T), np.sin(turn.T)], axis=2)
    return place.reshape(-1, 2)


def area_of(source):
    outer = drawings.read_outline(source, None)[0].outer
    return shapely.Polygon(np.concatenate([piece.at(np.linspace(0.0, 1.0, 2000)) for piece in outer])).area


@pytest.mark.parametrize(("digits", "error"), [(12, 1e-6), (6, 1e-5), (5, 2e-5)])
@pytest.mark.parametrize("n", [4, 6, 12, 150, 600])
def test_sides_between_fillets_are_straight(n, digits, error):
    """They bulged, as gentle bends do: a first frequency of 536 Hz instead of 171; points on a grid move the rim."""
    exact = 0.3 * 0.2 - (4.0 - np.pi) * 0.03**2
    assert_allclose(area_of(rounded_rectangle(n).round(digits)), exact, rtol=error)


@pytest.mark.parametrize("digits", [12, 6, 5])
@pytest.mark.parametrize("n", [31, 361, 901])
def test_sides_between_an_arc_and_a_corner_are_straight(n, digits):
    """A disk of 0.1 m with tangents to a tip 0.25 m away; its sides bulged by up to 13 % of the area."""
    half = np.arccos(0.1 / 0.25)
    turn = np.linspace(half, 2.0 * np.pi - half, n)
    drop = np.concatenate([0.1 * np.column_stack([np.cos(turn), np.sin(turn)]), [(0.25, 0.0)]])
    exact = 0.1 * np.sqrt(0.25**2 - 0.1**2) + 0.1**2 * (np.pi - half)
    assert_allclose(area_of(drop.round(digits)), exact, rtol=2e-5)  # of rounding


@pytest.mark.parametrize("side", [0.15, 0.3, 0.9])
def test_a_short_straight_side_beside_an_arc_is_straight(side):
    """Twice as long as a chord of the arc and more; it bulged by up to 7 % of the area."""
    turn = np.linspace(-np.pi / 2.0, np.pi / 2.0, 9)
    bullet = np.concatenate([[(-side, -0.2)], 0.2 * np.column_stack([np.cos(turn), np.sin(turn)]), [(-side, 0.2)]])
    assert_allclose(area_of(bullet), 0.4 * side + 0.02 * np.pi, rtol=1e-6)


@pytest.mark.parametrize(("n", "axes"), [(12, (0.1, 0.1)), (14, (0.2, 0.1))])
def test_a_curve_whose_points_are_dense_on_one_side_is_the_same_curve(n, axes):
    turn = np.concatenate([np.linspace(0.0, np.pi, k, endpoint=False) for k in (300, n)])
    turn[300:] += np.pi
    place = np.column_stack([np.cos(turn), np.sin(turn)]) * axes
    assert_allclose(area_of(place), np.pi * axes[0] * axes[1], rtol=2e-6)  # of the 8 000 chords and more


def test_a_last_point_that_rounding_left_beside_the_first_is_none():
    place = np.concatenate([ELLIPSE[::10], ELLIPSE[:1] + 1e-12])
    shape = fi.mesh.outline(place)
    assert shape.curved.all() and len(shape.facets) < 80


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("away", [0.0, 1e5])
def test_a_curve_of_many_points_may_lie_far_away(away):
    assert_allclose(fi.mesh.outline(ELLIPSE + away, size=0.01).area, np.pi * 0.2 * 0.15, rtol=1e-5)  # parabolas


def test_a_disk_traced_in_pixels_is_round():
    """Steps of one pixel of 500 along the rim; the area is that of the pixels inside."""
    rows = np.arange(-249.5, 250.0)
    half = np.round(np.sqrt(250.0**2 - rows**2) - 0.5) + 0.5
    right = np.column_stack([np.repeat(half, 2), (rows[:, None] + [-0.5, 0.5]).ravel()])
    rim = shapely.segmentize(shapely.Polygon(np.concatenate([right, -right])).exterior, 1.0)
    shape = fi.mesh.outline(1e-3 * shapely.get_coordinates(rim))
    assert len(shape.facets) < 60
    assert_allclose(np.linalg.norm(shape.middles, axis=1), 0.25, rtol=4e-3)  # a pixel


def test_a_dxf_spline_through_points_is_a_curve(tmp_path):
    points = [(0.0, 0.0), (1.0, 0.0), (1.2, 0.8), (0.0, 1.0), (0.0, 0.0)]
    assert fi.mesh.outline(dxf(tmp_path, lambda space: space.add_spline(points))).curved.all()


@pytest.mark.parametrize(("make", "text"), [
    (lambda t: in_mm(t, OPEN + HOLE), r"open outline: it ends at \(0, -0.3\) m, 0.3 m from its start; .* a name"),
    (lambda t: in_mm(t, RIM + '<path d="M50 20 L200 20"/>'), "has an open outline"),
    (lambda t: in_mm(t, '<path d="M0 0 H1000 V600 H0 V5"/>'), "has an open outline"),  # by 5 mm of a metre
    (lambda t: t / "none.svg", "there is no such file"),
    (lambda _: [(0, 0), (1, 0)], "must have 3 to 200000 points, got 2"),
    (lambda _: [(0, 0), (1, 1), (1, 0), (0, 1)], "must not cross or touch itself"),
    (lambda _: shapely.Point(0, 0), "one shapely Polygon, got a Point"),
    (lambda t: dxf(t, lambda s: s.add_circle((0, 0), 15.0), units=0), "looks like millimetres"),  # 30 m, no unit
])  # fmt: skip
def test_what_is_no_outline_is_refused(tmp_path, make, text):
    with pytest.raises(ValueError, match=text):
        fi.mesh.outline(make(tmp_path))


def test_what_is_nearly_wrong_is_taken_and_noted(tmp_path):
    """A gap of half a millimetre, as wide as a pencil line, in an outline of a metre; a plate of 15 m; no unit."""
    bare = svg(tmp_path, '<rect width="96" height="96"/>', 'viewBox="0 0 96 96"')
    assert "states no unit" in fi.mesh.outline(bare).notes[0]
    assert any("gap" in note for note in fi.mesh.outline(in_mm(tmp_path, '<path d="M0 0 H1000 V600 H0 V0.5"/>')).notes)
    assert fi.mesh.outline(dxf(tmp_path, lambda space: space.add_circle((0, 0), 7.5), units=0)).notes


def test_broken_files_are_refused(tmp_path):
    for name in ("plate.svg", "plate.dxf"):
        (tmp_path / name).write_text("neither")
        with pytest.raises(ValueError, match=f"{name} cannot be read as"):
            fi.mesh.outline(tmp_path / name)


LAUGHS = '<!DOCTYPE svg [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>'
OUTSIDE = '<!DOCTYPE svg [<!ENTITY a SYSTEM "file:///etc/passwd">]>'


@pytest.mark.parametrize("head", [LAUGHS, OUTSIDE])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_entities_are_refused_not_expanded(tmp_path, head, encoding):
    text = f'<?xml version="1.0" encoding="{encoding}"?>{head}' + SVG.format(head="", body="<text>&a;</text>")
    (tmp_path / "plate.svg").write_bytes(text.encode(encoding))
    with pytest.raises(ValueError, match="declares XML entities; save it as plain SVG"):
        fi.mesh.outline(tmp_path / "plate.svg")


def test_what_refers_to_itself_or_multiplies_is_a_sentence(tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=r"plate\.svg cannot be read as SVG \(maximum recursion"):
        fi.mesh.outline(svg(tmp_path, '<g id="a"><use href="#a"/></g>'))
    monkeypatch.setattr(isolated, "run_reader", READ_APART)
    monkeypatch.setattr(isolated, "PATIENCE", 2.0)
    uses = "".join(f'<g id="a{i}">' + f'<use href="#a{i - 1}"/>' * 10 + "</g>" for i in range(1, 9))
    with pytest.raises(ValueError, match=r"plate\.svg cannot be read as SVG \(reading took longer|its reader crashed"):
        fi.mesh.outline(svg(tmp_path, f'<g id="a0"><rect width="1" height="1"/></g>{uses}'))


def test_links_to_other_files_are_not_followed(tmp_path):
    (tmp_path / "other.svg").write_text(SVG.format(head="", body='<circle id="x" r="1"/>'))
    links = ("other.svg#x", f"file://{tmp_path}/other.svg#x", "http://localhost:1/other.svg#x")
    body = "".join(f'<use href="{href}"/><image href="{href}" width="1" height="1"/>' for href in links)
    with pytest.raises(ValueError, match="has no outline"):
        fi.mesh.outline(svg(tmp_path, body))


@pytest.mark.parametrize(("degrees", "n_edges"), [(3.0, 4), (9.0, 5)])
def test_a_bend_of_some_degrees_starts_a_new_edge(tmp_path, degrees, n_edges):
    body = f'<path d="M0 100 L500 {100.0 - 500.0 * np.tan(np.radians(degrees / 2.0))} L1000 100 V600 H0 Z"/>'
    shape = fi.mesh.outline(in_mm(tmp_path, body))
    assert sum(name.startswith("edge") for name in shape.edges) == n_edges


def test_named_open_paths_are_lines(tmp_path):
    lines = '<path id="bar" d="M50 20 L200 20 L300 100"/><path id="brace" d="M0 0 L400 300"/>'  # corner to corner
    shape = fi.mesh.outline(in_mm(tmp_path, RIM + HOLE + lines))
    assert set(shape.edges) == {"rim", "hole", "outer", "boundary"} and list(shape.lines) == ["bar", "brace"]
    assert_allclose(shape.lines["bar"], [(0.05, -0.02), (0.2, -0.02), (0.3, -0.1)], atol=1e-12)
    assert_allclose(shape.lines["brace"], [(0.0, 0.0), (0.4, -0.3)], atol=1e-12)
    assert "the open paths bar, brace are lines for ribs" in shape.notes[-1]
    assert shape.refined(2.0).lines is shape.lines


def test_a_line_may_touch_an_outline_of_several_named_edges_and_another_line(tmp_path):
    sides = {"top": "M0 0 H400", "right": "M400 0 V300", "bottom": "M400 300 H0", "left": "M0 300 V0"}
    lines = {"bar": "M400 0 L300 100", "strut": "M300 100 L200 100", "far": "M200 100 L300 100.2 V200"}
    body = "".join(f'<path id="{name}" d="{d}"/>' for name, d in (sides | lines).items())
    shape = fi.mesh.outline(in_mm(tmp_path, body))
    assert set(shape.edges) == {*sides, "outer", "boundary"} and set(shape.lines) == set(lines)
    with pytest.raises(ValueError, match=r"three lines that meet at .*; draw the outline as one path"):
        fi.mesh.outline(in_mm(tmp_path, body + '<path id="brace" d="M0 0 L400 300"/>'))


def test_lines_of_one_layer_get_numbers_and_curves_become_straight_parts(tmp_path):
    def draw(space):
        space.add_lwpolyline([(0, 0), (4, 0), (4, 3), (0, 3)], close=True)
        space.add_line((1, 0), (1, 3), dxfattribs={"layer": "bars"})
        space.add_arc((2, 1), 1.0, 0.0, 90.0, dxfattribs={"layer": "bars"})
        space.add_line((1.5, 2), (2, 2), dxfattribs={"layer": "bars"})  # goes on where the arc ends
        for end in ((3, 2), (3.8, 2.5), (3.8, 1.5)):
            space.add_line((3.5, 2), end, dxfattribs={"layer": "fork"})

    shape = fi.mesh.outline(dxf(tmp_path, draw))
    assert list(shape.lines) == ["bars0", "bars1", "fork0", "fork1", "fork2"]  # one line up to a branch
    path = shape.lines["bars1"]
    assert_allclose(path[[0, -1]], [(3, 1), (1.5, 2)], atol=1e-12)
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    # chords of at most a twentieth of 4 m on a radius of 1 m: shorter than the arc by a 24th of 0.2**2
    assert 0.0 < 1.0 - length / (0.5 * np.pi + 0.5) < 0.2**2 / 24
    assert "their curves become straight parts, at most 0.005 m" in shape.notes[-1]  # (pi / 16)**2 / 8


def test_a_rib_along_a_line_of_a_drawing_is_that_along_its_points(tmp_path):
    plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), 3e-3)
    bar = fi.Beam.rectangular(plate.material, width=8e-3, height=12e-3)
    shape = fi.mesh.outline(in_mm(tmp_path, RIM + '<path id="bar" d="M50 50 L350 200"/>'), size=0.1)
    one, two = (
        fi.find_modes(fi.assemble(shape, plate, {"rim": "hinged"}, ribs=[fi.Rib(path, bar)]), n_modes=3).omega
        for path in ("bar", [(0.05, -0.05), (0.35, -0.2)])
    )
    assert_allclose(one, two, rtol=1e-9)  # the same body, but for rounding
    flat = fi.find_modes(fi.assemble(shape, plate, {"rim": "hinged"}), n_modes=3).omega
    assert one[0] > 1.05 * flat[0]
