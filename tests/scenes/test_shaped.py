"""Scenes of curved, ribbed and layered plates make the same body as the functions they stand for."""

import tomllib

import numpy as np
import pytest
from scenes import edited, load_text
from test_editor_schema import CHECKED

import fem_impact as fi

PLATE = """
supports = { boundary = "hinged" }
striker = { kind = "rigid", mass = 0.01 }
contact = { kind = "hertz", stiffness = 1e5 }
strike = { at = [0.13, 0.1], speed = 0.1, tolerance = 0.2 }
[mesh]
shape = "rectangle"
length = 0.4
width = 0.3
size = 0.1
{mesh}
[material]
E = 10e9
nu = 0.3
rho = 450.0
[section]
kind = "plate"
thickness = 3e-3
{rest}
"""
RIB = "[[rib]]\npath = [[0.1, 0.0], [0.2, 0.3]]\nwidth = 8e-3\nheight = 12e-3\n"
WOOD, ALLOY = fi.Material(E=10e9, nu=0.3, rho=450.0), fi.Material(E=70e9, nu=0.33, rho=2700.0)
RECTANGLE, HINGED = fi.mesh.rectangle(0.4, 0.3, size=0.1), {"boundary": "hinged"}


def load(folder, mesh="", rest="", text=PLATE):
    text = text.replace("{mesh}", mesh).replace("{rest}", rest)
    CHECKED.validate(tomllib.loads(text))
    return load_text(folder, text)


def frequencies(body, **shape):
    plate = body if isinstance(body, fi.Plate) else fi.Plate(WOOD, 3e-3)
    return fi.find_modes(fi.assemble(RECTANGLE, plate, HINGED, **shape), n_modes=4).frequencies


def assert_same(scene, expected):
    # the same elements in both: what is left is rounding, and that of the eigenvalues is some 1e-12
    np.testing.assert_allclose(scene.modes(4).frequencies, expected, rtol=1e-9)


@pytest.mark.parametrize(("keys", "rise"), [
    ('shape = "cap", radius = 2.0, centre = [0.2, 0.15]', fi.rise.cap(2.0, centre=(0.2, 0.15))),
    ('shape = "cylinder", radius = -1.0, angle = 0.3', fi.rise.cylinder(-1.0, angle=0.3)),
    ('shape = "saddle", radius = 3.0', fi.rise.saddle(3.0)),
    ('shape = "cymbal", radius = 1.0, bow = 0.1, cup_radius = 0.2, cup = 0.02', fi.rise.cymbal(1, 0.1, 0.2, 0.02)),
])  # fmt: skip
def test_every_rise_of_a_scene_is_that_of_python(tmp_path, keys, rise):
    scene = load(tmp_path, mesh=f"rise = {{ {keys} }}")
    assert_same(scene, frequencies(None, rise=rise))


def test_a_table_of_heights_lies_beside_the_scene_and_goes_with_its_results(tmp_path):
    rise = fi.rise.cap(2.0, centre=(0.2, 0.15))
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0.0, 0.4, 17), np.linspace(0.0, 0.3, 13)))
    points = np.column_stack([x, y])
    rows = "\n".join(",".join(map(repr, row)) for row in np.column_stack([points, rise(points)]).tolist())
    (tmp_path / "heights.csv").write_text(f"x,y,z\n{rows}\n")
    scene = load(tmp_path, mesh='rise = { table = "heights.csv" }')
    assert_same(scene, frequencies(None, rise=fi.rise.table(points, rise(points))))
    (tmp_path / "kept").mkdir()
    tables, names = scene.kept(tmp_path / "kept")
    assert names == ["heights.csv"] and tables["mesh"]["rise"] == {"table": "heights.csv"}
    assert scene.mesh.values["rise"]["table"].endswith(str(tmp_path / "heights.csv"))
    assert (tmp_path / "kept" / "heights.csv").read_text().startswith("x,y,z")


def test_ribs_tapered_along_edges_and_of_another_material(tmp_path):
    rest = RIB.replace("12e-3", "[[0.0, 4e-3], [0.1, 12e-3]]")
    rest += '[[rib]]\nedge = "left"\ndiameter = 10e-3\noffset = 0.0\nmaterial = { E = 70e9, nu = 0.33, rho = 2700.0 }\n'

    def height(along):
        return np.interp(along[:, 0], [0.0, 0.1], [4e-3, 12e-3])

    bars = [
        fi.Rib([(0.1, 0.0), (0.2, 0.3)], fi.Beam.rectangular(WOOD, width=8e-3, height=height)),
        fi.Rib("left", fi.Beam.circular(ALLOY, diameter=10e-3), 0.0),
    ]
    scene = load(tmp_path, rest=rest)
    assert_same(scene, frequencies(None, ribs=bars))
    assert scene.picture().count('stroke-linecap="round"') == 1 + 3  # one straight rib, and the edge in three facets


def test_a_rib_along_a_line_of_a_drawing(tmp_path):
    shapes = '<rect id="rim" width="400" height="300"/><path id="bar" d="M50 -50 L350 -200" transform="scale(1 -1)"/>'
    head = 'xmlns="http://www.w3.org/2000/svg" width="400mm" height="300mm" viewBox="0 0 400 300"'
    (tmp_path / "plate.svg").write_text(f"<svg {head}>{shapes}</svg>")
    text = PLATE.replace('shape = "rectangle"\nlength = 0.4\nwidth = 0.3', 'shape = "outline"\nsource = "plate.svg"')
    rest = RIB.replace("path = [[0.1, 0.0], [0.2, 0.3]]", 'line = "bar"')
    scene = load(tmp_path, rest=rest, text=text.replace("at = [0.13, 0.1]", "at = [0.13, -0.1]"))
    np.testing.assert_allclose(scene.ribs[0].path, [(0.05, -0.05), (0.35, -0.2)], atol=1e-12)
    assert any("bar are lines for ribs" in note for note in scene.built.target.assumed)
    with pytest.raises(ValueError, match=r"\[\[rib\]\] 0 line must be one of bar, .* did you mean 'bar'"):
        _ = load(tmp_path, rest=rest.replace('"bar"', '"baar"'), text=text).built


def test_layers_stand_for_the_thickness_and_edges_slide(tmp_path):
    text = PLATE.replace(SECTION, "")
    layers = "[in_plane]\nboundary = 'sliding'\n[[layer]]\nthickness = 2e-3\n[[layer]]\nthickness = 1e-3\n"
    scene = load(tmp_path, rest=f"{layers}angle = 1.5\nmaterial = {{ E = 70e9, nu = 0.33, rho = 2700.0 }}", text=text)
    plate = fi.Plate.laminate([(WOOD, 2e-3, 0.0), (ALLOY, 1e-3, 1.5)])
    assert_same(scene, frequencies(plate, in_plane={"boundary": "sliding"}))


def test_numbers_within_ribs_layers_and_rises_have_intervals(tmp_path):
    scene = load(
        tmp_path,
        mesh='rise = { shape = "cap", radius = { value = 2.0, about = 0.05 } }',
        rest=RIB.replace("width = 8e-3", "width = { value = 8e-3, low = 7e-3, high = 9e-3 }"),
    )
    assert scene.known == {"mesh.rise.radius": ("lognormal", 2.0, 0.05 / 1.6448536269514722),
                           "rib.0.width": ("uniform", 7e-3, 9e-3)}  # fmt: skip
    other = scene.changed({"mesh.rise.radius": 3.0, "rib.0.width": 9e-3})
    assert other.mesh.values["rise"]["radius"] == 3.0 and other.rib[0].values["width"] == 9e-3
    assert scene.rib[0].values["width"] == 8e-3 and other.known == {}


def test_modes_of_ribbed_and_curved_plates_do_not_scale(tmp_path):
    scene = load(tmp_path, rest=RIB)
    told = r"section\.thickness rescales the modes of flat plates .*; write it in the sc"
    with pytest.raises(ValueError, match=told):
        fi.spread(scene, {"section.thickness": ("uniform", 2e-3, 3e-3)}, n=16)
    curved = load(tmp_path, mesh='rise = { shape = "saddle", radius = 3.0 }')
    with pytest.raises(ValueError, match=r"target\.size needs a thin body of stated size, flat"):
        fi.spread(curved, {"target.size": ("uniform", 0.9, 1.1)}, n=16)


MATERIAL, SECTION = "[material]\nE = 10e9\nnu = 0.3\nrho = 450.0\n", '[section]\nkind = "plate"\nthickness = 3e-3\n'
BARE = PLATE.replace(MATERIAL, "[target]\nmass = 1.0\nfirst_frequency = 9.0\n").replace(SECTION, "")
WRONG = [
    ('rise = { shape = "cymball", radius = 1.0 }', "", r"\[mesh\] rise.shape must .* did you mean 'cymbal'"),
    ('rise = { shape = "cap" }', "", r"\[mesh\] rise: radius is missing"),
    ('rise = { shape = "cap", radus = 1.0 }', "", r"\[mesh\] rise: radus is not a key .* did you mean 'radius'"),
    ('rise = { shape = "cap", radius = 0.1 }', "", r"\[mesh\] rise.*radius must be larger than the body"),
    ('rise = "cap"', "", r"\[mesh\] rise must be a table"),
    ('rise = { table = "none.csv" }', "", r"\[mesh\] rise: table must name a CSV file .*none.csv"),
    ('rise = { table = 3 }', "", r"\[mesh\] rise: table must be the name of a file"),
    ("", RIB.replace("width", "widht"), r"\[\[rib\]\] 0 widht is not a key .* did you mean 'width'"),
    ("", RIB + 'edge = "left"\n', r"\[\[rib\]\] 0 path, edge or line must be given"),
    ("", RIB.replace("[[0.1, 0.0], [0.2, 0.3]]", "[[1.0, 0.0], [2.0, 0.3]]"), r"\[\[rib\]\] 0 path of a rib"),
    ("", RIB.replace("8e-3", "-8e-3"), r"\[\[rib\]\] 0 width must be positive"),
    ("", RIB.replace("8e-3", "[[0.1, 8e-3], [0.0, 8e-3]]"), r"\[\[rib\]\] 0 width must be two or more"),
    ("", RIB + "material = { E = 1e9 }\n", r"\[\[rib\]\] 0 material: nu is missing"),
    ("", "[[rib]]\nedge = 'lft'\ndiameter = 1e-3\n", r"\[\[rib\]\] 0 edge must be .* did you mean 'left'"),
    ("", "[[rib]]\nline = 'bar'\nwidth = 1e-3\nheight = 1e-3\n", r"\[\[rib\]\] 0 line .*only drawings have lines"),
    ("", RIB.replace("[[rib]]", "[rib]"), r"rib must be tables, each written \[\[rib\]\]"),
    ("", "[[layer]]\nthickness = 1e-3\n", r"\[section\] thickness must be left out beside \[\[layer\]\]"),
    ("", "[in_plane]\nleft = 'slidng'\n", r"\[in_plane\] left must be one of held, .* did you mean 'sliding'"),
    ("", RIB + "[target]\ntheory = 'mindlin'\n", r"\[target\] theory must be left out for a curved, ribbed"),
    ("", "[in_plane]\nlft = 'held'\n", r"\[in_plane\] edge must be one of .* did you mean 'left'"),
    ("", "", ".*thickness is missing; give it here, or write the plate's layers as",
     edited("thickness = 3e-3\n", "", PLATE)),
    ("", RIB, r"\[\[rib\]\] 0 material is missing", BARE),
    ("", RIB, r"\[section\] kind must be 'beam'|\[\[rib\]\] needs",
     edited('"rectangle"', '"line"', PLATE).replace("width = 0.3\n", "")),
]  # fmt: skip


@pytest.mark.parametrize("row", WRONG, ids=lambda row: row[2])
def test_wrong_shapes_name_file_table_and_key(tmp_path, row):
    mesh, rest, match, text = (*row, PLATE)[:4]
    with pytest.raises(ValueError, match=rf"scene\.toml: {match}"):
        _ = load_text(tmp_path, text.replace("{mesh}", mesh).replace("{rest}", rest)).built


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("1,2,3\n4,5\n", "must have three columns"),
        ("1,2,3\na,b,c\n", "line 2 is"),
        ("0,0,o\n1,2,3\n", "line 1 is '0,0,o'"),
        ("\ufeff1,2,3\na,b,c\n", "line 2 is"),
        ("x,y,z\n", "points must be four or more"),
    ],
)
def test_wrong_tables_of_heights_name_the_file(tmp_path, text, match):
    (tmp_path / "heights.csv").write_text(text, "utf-8")
    with pytest.raises(ValueError, match=match):
        load(tmp_path, mesh='rise = { table = "heights.csv" }')


def test_closed_formulas_are_for_flat_plates_only(tmp_path):
    flat = load(tmp_path, text=PLATE.replace("size = 0.1\n", ""))
    assert flat.built.target.closed is not None
    for shape in ({"mesh": 'rise = { shape = "saddle", radius = 3.0 }'}, {"rest": RIB}):
        assert load(tmp_path, text=PLATE.replace("size = 0.1\n", ""), **shape).built.target.closed is None


@pytest.mark.slow
@pytest.mark.parametrize("command", ["plan", "modes --n-modes 3", "strike", "map", "report"])
def test_every_command_takes_a_shaped_plate(tmp_path, prompt, command):
    scene = load(tmp_path, mesh='rise = { shape = "saddle", radius = 3.0 }', rest=RIB)
    scene.path.write_text(scene.path.read_text() + '[map.over]\n"striker.mass" = [0.01, 0.02]\n')
    said = prompt(f"{command} scene.toml")
    assert said.status in (0, 3) and "Traceback" not in said.err
