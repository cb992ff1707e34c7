"""Mesh files: what is read, what is mended and said, what is refused and why; and the meshes shipped."""

import re
import sys
from dataclasses import replace

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import MESHES

import fem_impact as fi

pytestmark = pytest.mark.usefixtures("read_here")
PLATE = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 2e-3)
PER_RATE = np.sqrt(7850 * 2e-3 / (210e9 * 2e-3**3 / (12 * (1 - 0.3**2))))
GOOD = fi.mesh.rectangle(1.55, 1.0, size=0.25)
HINGED = np.pi**2 * np.array([1 + 1 / 1.55**2, 1 + 4 / 1.55**2])


def parameters(shape, supports, n_modes=2):
    return fi.find_modes(fi.assemble(shape, PLATE, supports), n_modes=n_modes).omega * PER_RATE


def written(folder, points, cells, kind="triangle", name="plate.vtu", **more):
    """A file with these points (n, 2 or 3) and cells."""
    points = np.asarray(points, float)
    points = np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])
    meshio.Mesh(points, [(kind, np.asarray(cells))], **more).write(folder / name)
    return folder / name


def held(plate):
    return parameters(plate, {"boundary": "hinged"})


def assert_same_as_good(plate):
    """The same triangles, in any order of points and cells, each counterclockwise."""
    one, two = (np.sort(shape.points[shape.cells].mean(axis=1).round(9) @ [1.0, 1j]) for shape in (plate, GOOD))
    assert_allclose(one, two, atol=1e-12)
    corners = plate.points[plate.cells]
    assert len(plate.points) == len(GOOD.points) and (np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0.0).all()


@pytest.mark.parametrize("name", ["plate.vtu", "plate.vtk", "plate.xdmf", "plate.stl", "plate.inp"])
def test_formats_without_names_give_the_same_plate(tmp_path, name):
    plate = fi.mesh.load(written(tmp_path, GOOD.points, GOOD.cells, name=name))
    if name == "plate.stl":  # single precision
        assert_allclose(held(plate), HINGED, rtol=1e-5)  # refined by find_modes: 1e-6
    else:
        assert_same_as_good(plate)


def assert_same_edges(one, two):
    assert set(one.edges) == set(two.edges)
    for name in one.edges:
        places = [shape.points[shape.facets[shape.edges[name]]].mean(axis=1).round(9) for shape in (one, two)]
        assert_allclose(*(np.sort(each @ [1.0, 1j]) for each in places), atol=1e-12)


def test_saved_mesh_comes_back_with_its_edges(tmp_path):
    fi.mesh.save(tmp_path / "plate.msh", GOOD)
    plate = fi.mesh.load(tmp_path / "plate.msh")
    assert_same_as_good(plate)
    assert_same_edges(plate, replace(GOOD, edges=GOOD.edges | {"outer": GOOD.edges["boundary"]}))


def test_lines_with_nodes_of_their_own_name_edges_and_those_beside_all_triangles_are_told(tmp_path):
    """As of a drawing whose curves and surface were exported apart: half of the edge was free without a word."""
    lines = GOOD.facets[GOOD.edges["left"]].copy()
    n, own = len(GOOD.points), lines[0].copy()
    lines[0] = [n, n + 1]
    points = np.vstack([GOOD.points, GOOD.points[own]])
    tags = {"gmsh:physical": [np.ones(len(lines), int), np.full(len(GOOD.cells), 2)]}
    tags["gmsh:geometrical"] = tags["gmsh:physical"]
    names = {"left": np.array([1, 1]), "body": np.array([2, 2])}

    def loaded(lines):
        cells = [("line", lines), ("triangle", GOOD.cells)]
        made = meshio.Mesh(np.column_stack([points, np.zeros(n + 2)]), cells, cell_data=tags, field_data=names)
        made.write(tmp_path / "plate.msh", file_format="gmsh22")
        return fi.mesh.load(tmp_path / "plate.msh")

    plate = loaded(lines)
    assert len(plate.edges["left"]) == len(GOOD.edges["left"])
    assert plate.notes == ("plate.msh: 2 duplicate nodes were merged",)
    lines[0] = GOOD.facets[GOOD.edges["right"]][0, 0], own[0]
    said = "left: 1 of its 4 lines are no sides of triangles and are left out"
    assert any(said in note for note in loaded(lines).notes)


def test_a_slit_of_no_width_is_told_as_closed(tmp_path):
    """Its nodes stood twice in a mesh that was one piece; pieces that only touch are joined as before."""
    n, (x, y) = len(GOOD.points), GOOD.points.T
    cut = np.flatnonzero(np.isclose(x, np.median(np.unique(x.round(9)))) & (y < 0.6 * y.max()))
    cells = GOOD.cells.copy()
    beyond = GOOD.points[cells][:, :, 0].mean(axis=1) > x[cut[0]]
    for k, vertex in enumerate(cut):
        cells[beyond] = np.where(cells[beyond] == vertex, n + k, cells[beyond])
    points = np.column_stack([np.vstack([GOOD.points, GOOD.points[cut]]), np.zeros(n + len(cut))])
    meshio.Mesh(points, [("triangle", cells)]).write(tmp_path / "slit.vtk")
    assert any(
        "merged; some lie in one piece: if that is a slit" in x for x in fi.mesh.load(tmp_path / "slit.vtk").notes
    )


def test_any_name_of_an_edge_comes_back(tmp_path):
    names = {name: np.array([i]) for i, name in enumerate(['3/4" rim', '"', "a\\b", "\\", 'a\\"b', " ä "])}
    fi.mesh.save(tmp_path / "plate.msh", replace(GOOD, edges=GOOD.edges | names))
    again = fi.mesh.load(tmp_path / "plate.msh")
    for name, facets in names.items():
        places = [each.points[each.facets[rows]] for each, rows in ((again, again.edges[name]), (GOOD, facets))]
        assert_allclose(*places)


def test_sets_of_nodes_are_edges_which_may_overlap_and_be_called_as_the_surface_and_are_saved(tmp_path):
    """Abaqus names a support by the nodes it holds; that of all nodes is the whole rim, a single node no edge."""
    left = np.flatnonzero(GOOD.points[:, 0] == 0.0)
    sets = {"plate": left, "ALL": np.arange(len(GOOD.points)), "FORCE": np.array([3])}
    sets["LOW"] = left[GOOD.points[left, 1] < 0.3]
    given = fi.mesh.load(written(tmp_path, GOOD.points, GOOD.cells, name="plate.inp", point_sets=sets))
    assert set(given.edges) == {"plate", "ALL", "LOW", "outer", "boundary"} and not given.notes
    assert len(given.edges["plate"]) == len(GOOD.edges["left"]) > len(given.edges["LOW"]) > 0
    assert_allclose(given.points[given.facets[given.edges["plate"]]][..., 0], 0.0)
    assert given.edges["ALL"].tolist() == given.edges["boundary"].tolist()
    fi.mesh.save(tmp_path / "again.msh", given)
    assert_same_edges(fi.mesh.load(tmp_path / "again.msh"), given)


def test_a_set_of_nodes_of_no_triangle_is_no_edge_and_told_so(tmp_path):
    points = np.vstack([GOOD.points, [[9.0, 9.0]]])
    given = fi.mesh.load(written(tmp_path, points, GOOD.cells, name="plate.inp", point_sets={"RP": np.array([N])}))
    assert given.notes == ("plate.inp: RP: not on the rim, so it cannot be supported",)
    with pytest.raises(ValueError, match="supports names edge 'RP', but the mesh has the edges boundary, outer"):
        fi.assemble(given, fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 1e-3), {"RP": "clamped"})


def test_a_set_that_holds_one_of_two_duplicate_nodes_names_the_sides_of_both(tmp_path):
    """Two parts with nodes of their own where they meet, of which the set names those of the first."""
    points, cells = np.concatenate([GOOD.points] * 2), np.concatenate([GOOD.cells[:HALF], GOOD.cells[HALF:] + N])
    edge = np.flatnonzero(GOOD.points[:, 0] == 0.0)
    both = np.intersect1d(GOOD.cells[:HALF], GOOD.cells[HALF:])
    assert np.isin(edge, both).any()
    given = np.where(np.isin(edge, GOOD.cells[:HALF]), edge, edge + N)
    plate = fi.mesh.load(written(tmp_path, points, cells, name="plate.inp", point_sets={"hinge": given}))
    assert len(plate.edges["hinge"]) == len(GOOD.edges["left"])


def test_markers_of_su2_are_edges(tmp_path):
    nodes = "\n".join(f"{x} {y} {i}" for i, (x, y) in enumerate([(0, 0), (1, 0), (1, 1), (0, 1)]))
    markers = "MARKER_TAG= {}\nMARKER_ELEMS= 1\n3 {} {}\n"
    cells = "NELEM= 2\n5 0 1 2 0\n5 0 2 3 1\n"
    sides = "NMARK= 2\n" + markers.format(7, 0, 1) + markers.format(8, 2, 3)
    (tmp_path / "square.su2").write_text(f"NDIME= 2\n{cells}NPOIN= 4\n{nodes}\n{sides}")
    plate = fi.mesh.load(tmp_path / "square.su2")
    assert_allclose(plate.points[plate.facets[plate.edges["edge7"]]][..., 1], 0.0)
    assert_allclose(plate.points[plate.facets[plate.edges["edge8"]]][..., 1], 1.0)


@pytest.mark.parametrize("name", ["plate.msh", "plate.vtu"])
def test_a_disk_from_a_file_is_a_disk_and_no_polygon(tmp_path, name):
    disk = fi.mesh.disk(1.0, size=0.2)
    if name.endswith("msh"):
        fi.mesh.save(tmp_path / name, disk)
    else:
        written(tmp_path, disk.points, disk.cells, name=name)
    plate = fi.mesh.load(tmp_path / name)
    assert_allclose(plate.curvatures, 1.0, rtol=1e-6)  # the circle is found in its points
    assert_allclose(held(plate), [4.935149043, 13.89816507], rtol=1e-5)  # Bessel roots


def test_a_mesh_far_finer_than_the_modes_need_is_filled_anew_within_its_rim(tmp_path):
    fi.mesh.save(tmp_path / "fine.msh", fi.mesh.disk(1.0, 0.2, size=0.07))
    plate = fi.mesh.load(tmp_path / "fine.msh")
    supports = {"outer": "clamped", "inner": "free"}
    modes = fi.find_modes(fi.assemble(plate, PLATE, supports), n_modes=6, tolerance=1e-3)
    used = modes.shapes.system.mesh
    assert len(used.cells) < 0.7 * len(plate.cells)
    assert_same_edges(used, plate)
    order = [np.lexsort(np.round(m.middles, 9).T) for m in (used, plate)]
    for field in ("middles", "curvatures"):  # 1e-6: curvatures come from second differences of the curve
        one, two = (getattr(m, field)[rows] for m, rows in zip((used, plate), order))
        assert_allclose(one, two, rtol=0, atol=1e-6)
    own = fi.find_modes(fi.assemble(fi.mesh.disk(1.0, 0.2), PLATE, supports), n_modes=6)
    assert_allclose(modes.omega, own.omega, rtol=1e-3)  # the tolerance


def test_triangles_under_a_varying_thickness_are_kept():
    plate = fi.mesh.load(MESHES / "guitar.msh")
    stepped = fi.Plate(PLATE.material, lambda points: np.where(points[:, 0] < 0.2, 2e-3, 3e-3))
    used = fi.assemble(plate, stepped, {"body": "clamped"}).mesh
    assert_allclose(used.refined(0.5).cells, plate.cells)
    fine = used.refined(2.0)
    assert len(fine.cells) == 4 * len(plate.cells)
    assert_allclose(fine.points[: len(plate.points)], plate.points, rtol=0, atol=0)
    assert len(plate.refined(0.5).cells) < len(plate.cells)


def test_where_the_mesher_fails_the_mesh_is_used_as_it_is(monkeypatch):
    def fail(*_):
        raise fi.SimulationError("the mesher could not fill the outline")

    plate = fi.mesh.load(MESHES / "guitar.msh")
    monkeypatch.setattr("fem_impact.mesh.meshes.triangulate", fail)
    assert_allclose(plate.refined(0.5).cells, plate.cells)
    assert len(plate.refined(1.3).cells) == 4 * len(plate.cells)


@pytest.mark.parametrize("factor", [1.3, 2.6])
def test_smaller_triangles_fill_the_same_rim(factor):
    plate = fi.mesh.load(MESHES / "guitar.msh")
    fine = plate.refined(factor)
    assert fine.size <= plate.size / factor * (1.0 + 1e-9)
    assert set(fine.edges) == set(plate.edges)
    # a divided facet is off the curve it was cut from by the sixth power of its length: 1e-6 of 20 mm
    around, inside = (fine.points[fine.facets[fine.edges[name]][:, 0]] for name in ("body", "hole0"))
    assert_allclose(np.hypot(*(inside - [0.335, 0.0]).T), 0.045, rtol=1e-6)
    gap = np.linalg.norm(plate.points[plate.facets[plate.edges["body"]][:, 0]][:, None] - around[None], axis=2)
    assert gap.min(axis=1).max() < 1e-12
    corners = fine.points[fine.cells]
    assert (np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0.0).all()
    assert_allclose(fine.area, plate.area, rtol=1e-4)  # parabolas follow the curve


def test_larger_triangles_have_longer_sides_on_straight_edges(tmp_path):
    """Sides of a file on a straight edge are one line, as far as they have the same names; curves keep their facets."""
    made = fi.mesh.rectangle(1.2, 0.8, size=0.05)
    half = made.edges["bottom"][made.points[made.facets[made.edges["bottom"]]].max(axis=(1, 2)) < 0.61]
    fi.mesh.save(tmp_path / "fine.msh", replace(made, edges=made.edges | {"half": half}))
    fine = fi.mesh.load(tmp_path / "fine.msh")
    coarse = fine.refined(0.25)
    assert len(coarse.facets) < 0.35 * len(fine.facets)
    assert set(coarse.edges) == set(fine.edges) and "half" in fine.edges
    for name, facets in coarse.edges.items():
        assert coarse.lengths[facets].sum() == pytest.approx(fine.lengths[fine.edges[name]].sum(), rel=1e-12), name


ORDER = np.random.default_rng(3).permutation(len(GOOD.points))
N, HALF = len(GOOD.points), len(GOOD.cells) // 2


@pytest.mark.parametrize(("points", "cells", "note"), [
    (GOOD.points, np.concatenate([GOOD.cells[::3, ::-1], GOOD.cells[1::3], GOOD.cells[2::3]]),
     "inverted triangles were flipped"),
    (np.concatenate([GOOD.points, GOOD.points + 1e-13]),
     np.concatenate([GOOD.cells[:HALF], GOOD.cells[HALF:] + N]), "duplicate nodes were merged"),
    (GOOD.points, [*GOOD.cells, [0, 0, 1], [5, 6, 6]], "2 triangles with two corners at one point were removed"),
    (GOOD.points, [*GOOD.cells, *GOOD.cells[:4]], "4 duplicate triangles were removed"),
    (GOOD.points[ORDER], np.argsort(ORDER)[GOOD.cells][::-1], None),
], ids=["inverted", "doubled nodes", "collapsed", "twice", "order"])  # fmt: skip
def test_what_is_safe_to_mend_is_mended_and_said(tmp_path, points, cells, note):
    plate = fi.mesh.load(written(tmp_path, points, cells))
    assert any(note in said for said in plate.notes) if note else not plate.notes
    assert_same_as_good(plate)


def rounded(points, digits):
    return np.array([[float(f"{value:.{digits - 1}e}") for value in point] for point in points])


def turned(points, digits=17):
    """Points (n, 2) turned by 0.7, with so many digits."""
    z = np.exp(0.7j) * (np.asarray(points) @ [1.0, 1j])
    return rounded(np.column_stack([z.real, z.imag]), digits)


@pytest.mark.parametrize("digits", [17, 6])
def test_hanging_nodes_are_tied_in(tmp_path, digits):
    points = turned([(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1), (1, 0.3), (1, 0.6)], digits)
    cells = [[0, 1, 4], [0, 4, 5], [1, 2, 6], [2, 7, 6], [2, 3, 7], [3, 4, 7]]
    plate = fi.mesh.load(written(tmp_path, points, cells))
    assert "hanging nodes" in plate.notes[0]
    assert_allclose(held(plate), np.pi**2 * np.array([1.25, 2.0]), rtol=1e-5)


@pytest.mark.parametrize("out_of_plane", [False, True])
@pytest.mark.parametrize("digits", [5, 6, 8, "single"])
def test_hinged_sides_are_straight_with_few_digits(tmp_path, digits, out_of_plane):
    """Each vertex beside its side would be held like a corner: frequencies 20 to 50 % off."""
    plate = fi.mesh.rectangle(1.55, 1.0, size=0.1)
    points = turned(plate.points)
    if out_of_plane:
        points = points @ np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0]])
    exact = written(tmp_path, points, plate.cells)
    points = points.astype(np.float32).astype(float) if digits == "single" else rounded(points, digits)
    shape = fi.mesh.load(written(tmp_path, points, plate.cells))
    assert not shape.curved.any() and shape.rise is None and fi.mesh.load(exact).rise is None
    error = 1e-7 if digits == "single" else 10.0 ** (1 - digits)  # of the last digit
    assert_allclose(held(shape), HINGED, rtol=1e-6 + 2.0 * error)  # refined by find_modes: 1e-6


def test_digits_that_move_nodes_are_noted(tmp_path):
    points = turned(GOOD.points) + 800.0
    for digits, noted in ((9, False), (6, True)):
        shape = fi.mesh.load(written(tmp_path, rounded(points, digits), GOOD.cells))
        assert any("digits of the file move nodes" in note for note in shape.notes) == noted
    plate = fi.mesh.rectangle(1.0, 0.8, size=0.25)  # coordinates of one digit
    assert not fi.mesh.load(written(tmp_path, plate.points.round(1), plate.cells)).notes


def test_groups_of_med_are_edges_which_may_overlap(tmp_path):
    sides = GOOD.facets[np.concatenate([GOOD.edges["left"], GOOD.edges["right"]])]
    tags = [np.repeat([-6, -8], len(sides) // 2), np.full(len(GOOD.cells), -7)]
    points = np.column_stack([GOOD.points, np.zeros(len(GOOD.points))])
    made = meshio.Mesh(points, [("line", sides), ("triangle", GOOD.cells)], cell_data={"cell_tags": tags})
    made.cell_tags = {-6: ["left", "ends"], -7: ["all"], -8: ["ends"]}
    made.write(tmp_path / "a.med")
    plate = fi.mesh.load(tmp_path / "a.med")
    assert set(plate.edges) == {"left", "ends", "outer", "boundary"}
    assert [len(plate.edges[name]) for name in ("left", "ends")] == [len(sides) // 2, len(sides)]


GMSH = """$MeshFormat
4.1 0 8
$EndMeshFormat
{}$Entities
0 4 1 0
{}
1 0 0 0 1 1 0 {} 4 1 2 3 4
$EndEntities
$Nodes
1 4 1 4
2 1 0 4
1
2
3
4
0 0 0
2 0 0
2 1 0
0 1 0
$EndNodes
$Elements
5 6 1 6
1 1 1 1
1 1 2
1 2 1 1
2 2 3
1 3 1 1
3 3 4
1 4 1 1
4 4 1
2 1 2 2
5 1 2 3
6 1 3 4
$EndElements
"""


@pytest.mark.parametrize(("names", "groups", "surface", "lengths"), [
    ('1 1 "rim"\n2 9 "plate"', ["1 1", "1 -1", "1 1", "1 -1"], "1 9", {"rim": 6.0}),  # Physical Curve = {1, -2, 3, -4}
    ("", ["1 1", "1 1", "1 1", "2 2 1"], "1 9", {"edge1": 6.0, "edge2": 1.0}),
    ('1 1 "rim"', ["1 1", "0", "0", "1 1"], "0", {"rim": 3.0}),
])  # fmt: skip
def test_a_curve_of_gmsh_is_in_each_of_its_groups_whichever_way_it_runs(tmp_path, names, groups, surface, lengths):
    head = f"$PhysicalNames\n{names.count(chr(10)) + 1}\n{names}\n$EndPhysicalNames\n" if names else ""
    curves = "\n".join(f"{i} 0 0 0 2 1 0 {own} 0" for i, own in enumerate(groups, 1))
    (tmp_path / "a.msh").write_text(GMSH.format(head, curves, surface))
    plate = fi.mesh.load(tmp_path / "a.msh")
    found = {name: plate.lengths[own].sum() for name, own in plate.edges.items() if name not in ("outer", "boundary")}
    assert found == pytest.approx(lengths)


ABAQUS = "{}\n*Element, type=S3\n1,1,2,3\n"
NASTRAN = "BEGIN BULK\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\n{}\nCTRIA3,1,1,1,2,3\nENDDATA\n"


@pytest.mark.parametrize(("nodes", "said"), [
    ("*Node\n1,0,0,0\n2,1,0,0\n3,0,1,0\n2,3,0,0", "a.inp has node 2 twice; export it again"),
    ("*NODE, NSET=a\n1,0,0,0\n2,1,0,0\n** parts\n*Node\n1,5,5,0\n2,6,5,0", "several blocks of nodes"),
    ("*Node, system=C\n1,1,0,0\n2,1,90,0\n3,1,180,0", r"a.inp has \*Node, system=C, which is not read"),
    ("*Node\n1,0,0,0\n2,1,0,0\n3,0,1,0\n*Ngen\n1,3,1", r"has \*Ngen, which is not read; write all nodes by x, y"),
    ("*Node\n1,0,0,0\n2,1,0,0\n3,0,1,0\n*Nset, nset=a\n1,2\n*NSET, NSET=A\n2,3", "twice; write all its nodes into one"),
    ("*Node\n1,0,0,0\n2,1,0,0\n3,0,1,0\n*Nset, nset=a\n1,2\n*Assembly, name=b\n*Nset, nset=a\n2,3", None),
    ("GRID,3,0,1.,1.,0.\nGRID,4,0,0.,1.,0.\nCQUAD,2,1,1,2,3,4", "CQUAD, which is not read; export CTRIA3 or CQUAD4"),
    ("GRID,3,0,1.,1.,0.\nGRID,4,0,0.,1.,0.\nctria3,2,1,1,3,4", "a.bdf has ctria3, which is not read; export"),
    ("GRID,3,7,1.,1.,0.", "a.bdf has nodes in coordinate system 7; export all in the global one"),
    ("GRID           3       7      1.      1.      0.", "a.bdf has nodes in coordinate system 7; export all"),
    ("GRID*                  3               7              1.              1.*\n*                     0.",
     "a.bdf has nodes in coordinate system 7; export all"),
    ("GRID,3,0,1.,1.,0.\ninclude 'b.bdf'", "a.bdf includes other files; write all into one"),
    ("GRID           3       0      1.      1.      0.", None),
])  # fmt: skip
def test_decks_of_abaqus_and_nastran_with_what_is_not_read_are_refused(tmp_path, nodes, said):
    path = tmp_path / ("a.inp" if nodes[0] == "*" else "a.bdf")
    path.write_text((ABAQUS if nodes[0] == "*" else NASTRAN).format(nodes))
    if said is None:
        assert fi.mesh.load(path).area == pytest.approx(0.5)
    else:
        with pytest.raises(ValueError, match=said):
            fi.mesh.load(path)


def test_textures_and_numbers_from_the_end_of_an_obj_file_are_left_out_and_counted(tmp_path):
    head = "o plate\nv 0 0 0\nv 1 0 0\nvt 0.5 0.5\nvn 0 0 1\nv 1 1 0 0.9 0.9 0.9\nv 0 1 0\n"
    (tmp_path / "a.obj").write_text(head + "f 1/1/1 2/1/1 3/1/1\nf -4//1 -2//1 -1//1\n")
    assert fi.mesh.load(tmp_path / "a.obj").area == pytest.approx(1.0)


def test_quadrilaterals_are_divided(tmp_path):
    x, y = np.meshgrid(np.linspace(0, 1.55, 7), np.linspace(0, 1, 5), indexing="ij")
    n = np.arange(35).reshape(7, 5)
    cells = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], axis=-1).reshape(-1, 4)
    plate = fi.mesh.load(written(tmp_path, np.column_stack([x.ravel(), y.ravel()]), cells, kind="quad"))
    assert_allclose(held(plate), HINGED, rtol=1e-5)


@pytest.mark.parametrize("kind", ["quad8", "quad9"])
def test_curved_quadrilaterals_beside_triangles_are_no_holes(tmp_path, kind):
    """A ring of quadratic cells, half quadrilaterals, half triangles."""
    n, turn = 24, np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    place = np.concatenate([r * np.column_stack([np.cos(turn), np.sin(turn)]) for r in (0.8, 0.9, 1.0)])
    quads, triangles = [], []
    for i in range(n):
        (a, m, b), across = [(2 * i + k) % 48 for k in range(3)], 96
        inner, middle, outer = ([a + up, m + up, b + up] for up in (0, 48, across))
        corners, between = [inner[0], outer[0], outer[2], inner[2]], [middle[0], outer[1], middle[2], inner[1]]
        if i % 2:
            quads.append(corners + between + ([middle[1]] if kind == "quad9" else []))
        else:
            triangles += [[*corners[:3], *between[:2], middle[1]], [corners[0], *corners[2:], middle[1], *between[2:]]]
    points = np.column_stack([place, np.zeros(len(place))])
    meshio.Mesh(points, [(kind, np.array(quads)), ("triangle6", np.array(triangles))]).write(tmp_path / "ring.vtu")
    ring = fi.mesh.load(tmp_path / "ring.vtu")
    assert set(ring.edges) == {"outer", "hole0", "boundary"} and ring.curved.all()
    assert_allclose(np.abs(ring.curvatures[ring.edges["outer"]]), 1.0, rtol=1e-3)


def test_cells_that_would_become_a_hole_are_refused(tmp_path):
    square, cubic = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [[0, 2, 3, *range(4, 11)]]
    points = np.array([*square, *np.zeros((7, 3))], float)
    meshio.Mesh(points, [("triangle", [[0, 1, 2]]), ("triangle10", cubic)]).write(tmp_path / "plate.msh", "gmsh22")
    with pytest.raises(ValueError, match="contains triangle10, which are not read; export linear or quadratic cells"):
        fi.mesh.load(tmp_path / "plate.msh")


def test_units_are_converted(tmp_path):
    path = written(tmp_path, GOOD.points * 1e3, GOOD.cells)
    assert_allclose(fi.mesh.load(path, unit="mm").area, 1.55)
    with pytest.raises(ValueError, match="unit must be one of"):
        fi.mesh.load(path, unit="parsec")


@pytest.mark.parametrize(
    ("points", "cells", "text"),
    [
        (np.column_stack([GOOD.points, (GOOD.points[:, 0] - 0.8) ** 2]), GOOD.cells,
         r"too steep for a plate: near .* slopes by 5\d.* degrees; .* leave out walls and folds"),
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.5, 0.9, 0.1)], [[0, 1, 2], [0, 1, 3]], "overlap"),  # folded
        ([(0, 0, z) for z in (0, 0.01)] + [(x, 1 - x, z) for x in (0, 1) for z in (0, 0.01)], [[0, 2, 4], [1, 3, 5]],
         "two surfaces, one over the other at .*; export one of them"),
        # the middles of the second side and of the third have changed places; one is on the edge of what is a curve
        ([(0, 0), (1, 0), (0, 1), (0.5, 0), (0, 0.5), (0.5, 0.5)], [range(6)],
         "1 sides far from their middles, the first between nodes 2 and 0, whose middle is node 5; correct it, or"),
    ],
    ids=["steep", "folded", "over one another", "middles"],
)  # fmt: skip
def test_what_cannot_be_mended_is_refused_with_the_place(tmp_path, points, cells, text):
    with pytest.raises(ValueError, match=text):
        fi.mesh.load(written(tmp_path, points, cells, kind={3: "triangle", 6: "triangle6"}[len(cells[0])]))


def test_junk_is_refused(tmp_path, capsys):
    (tmp_path / "junk.msh").write_text("hello")
    with pytest.raises(ValueError, match=r"junk\.msh cannot be read as a mesh"):
        fi.mesh.load(tmp_path / "junk.msh")
    assert capsys.readouterr() == ("", "")  # errors are raised, not printed


@pytest.mark.parametrize("name", ["rectangle", "disk", "cymbal", "guitar", "l_shape"])
def test_shipped_meshes_load_without_repairs(name):
    plate = fi.mesh.load(MESHES / f"{name}.msh")
    assert not plate.notes
    modes = fi.find_modes(fi.assemble(plate, PLATE), n_modes=6)
    assert modes.n_rigid == 3
    assert np.isfinite(modes.residual_compliance([plate.points[plate.facets[0, 0]]])).all()
    if name == "cymbal":
        made = parameters(fi.mesh.disk(0.2032, 0.006), {}, 6)
        assert_allclose(modes.omega[3:] * PER_RATE, made[3:], rtol=1e-5)  # two meshes of one body


def test_marimba_bar_is_tuned_to_two_octaves(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(MESHES), *sys.path])
    import marimba_bar

    modes = fi.find_modes(fi.assemble(*marimba_bar.bar()), n_modes=4)
    assert_allclose(modes.frequencies[3] / modes.frequencies[2], 4.0, rtol=0.02)  # what its script promises


BENT = 4.0  # [m] radius
DOME = replace(GOOD, rise=fi.rise.cap(BENT, centre=(0.775, 0.5)))


def test_a_saved_curved_mesh_comes_back_with_its_rise(tmp_path):
    fi.mesh.save(tmp_path / "dome.msh", DOME)
    shape = fi.mesh.load(tmp_path / "dome.msh")
    assert_allclose(shape.points, DOME.points, atol=1e-12)
    away = shape.rise(DOME.points) - DOME.rise(DOME.points)
    assert_allclose(away, away.mean(), atol=1e-12)  # heights over the mean plane
    said = re.search(r"slopes up to ([\d.]+), where shallow theory errs by some ([\d.]+) %", shape.notes[-1])
    slope, error = (float(number) for number in said.groups())
    furthest = np.linalg.norm(GOOD.points[GOOD.cells].mean(axis=1) - [0.775, 0.5], axis=1).max()
    assert slope == pytest.approx(np.tan(np.arcsin(furthest / BENT)), rel=0.05)  # of a triangle, told in two digits
    assert error == pytest.approx(50.0 * slope**2, rel=0.1)
    assert shape.refined(2.0).rise is shape.rise
    system = fi.assemble(shape, PLATE, {"boundary": "hinged"})
    assert system.section.rise is shape.rise and system.theory == "shallow"
    stated = fi.assemble(shape, PLATE, {"boundary": "hinged"}, rise=fi.rise.saddle(9.0))
    assert stated.section.rise is not shape.rise


def test_a_curved_mesh_with_six_digits_is_that_with_all(tmp_path):
    """Its hinged sides are straight from above; rounding to 5e-6 of its thickness would bend them 4 % off."""
    plate = fi.mesh.rectangle(1.55, 1.0, size=0.1)
    points = np.column_stack([turned(plate.points), DOME.rise(plate.points)])
    exact, rough = (fi.mesh.load(written(tmp_path, rounded(points, digits), plate.cells)) for digits in (17, 6))
    assert_allclose(held(rough), held(exact), rtol=1e-3)  # the default of the modes


@pytest.mark.slow
def test_frequencies_of_a_curved_mesh_file_converge_to_those_of_its_surface(tmp_path):
    """Through heights at vertices the surface errs with the cube of their distance."""
    errors = []
    plate = fi.Plate(PLATE.material, 2e-2)
    for size in (0.25, 0.125):
        dome = replace(fi.mesh.rectangle(1.55, 1.0, size=size), rise=DOME.rise)
        fi.mesh.save(tmp_path / "dome.msh", dome)
        one, two = (
            fi.find_modes(fi.assemble(shape, plate, {"boundary": "hinged"}), n_modes=3).omega
            for shape in (dome, fi.mesh.load(tmp_path / "dome.msh"))
        )
        errors.append(np.abs(two / one - 1.0).max())
    assert errors[1] < 2e-5 and np.log2(errors[0] / errors[1]) > 3.0  # measured: 1.0e-5 and 4.2


def test_a_tilted_mesh_is_levelled(tmp_path):
    around, angle = np.array([1.0, 2.0, 0.5]) / np.linalg.norm([1.0, 2.0, 0.5]), 0.4
    cross = np.cross(np.eye(3), around)
    turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    for height in (np.zeros(len(GOOD.points)), DOME.rise(GOOD.points)):
        path = written(tmp_path, np.column_stack([GOOD.points, height]) @ turn.T, GOOD.cells)
        shape = fi.mesh.load(path)
        assert any("is tilted by" in note for note in shape.notes)
        assert shape.area == pytest.approx(GOOD.area, rel=1e-12 if not height.any() else 1e-3)
        assert (shape.rise is None) == (not height.any())
        if height.any():  # the sides of triangles keep their true lengths
            place = np.column_stack([shape.points, shape.rise(shape.points)])
            sides = [np.linalg.norm(each[GOOD.cells[:, 0]] - each[GOOD.cells[:, 1]], axis=1)
                     for each in (place, np.column_stack([GOOD.points, height]))]  # fmt: skip
            assert_allclose(*sides, rtol=1e-9)


def test_noise_across_the_plane_is_ignored_and_told(tmp_path):
    height = 6e-7 / 0.3 * np.ptp(GOOD.points[:, 0]) * (np.arange(len(GOOD.points)) % 2)
    noisy = fi.mesh.load(written(tmp_path, np.column_stack([GOOD.points, height]), GOOD.cells, name="noisy.vtk"))
    assert any("across the plane of the mesh, which is ignored" in note for note in noisy.notes)
    assert noisy.area == pytest.approx(GOOD.area, rel=1e-12)
