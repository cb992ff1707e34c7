"""Every message about a file that gives advice: following it works."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
import shapely
from scenes import SMALL
from scipy.io import savemat

import fem_impact as fi
from fem_impact.mesh import drawings, meshio_reader, triangulation
from fem_impact.taps import readers, transfer

GOOD = fi.mesh.rectangle(0.4, 0.3, size=0.2)
SVG = '<svg xmlns="http://www.w3.org/2000/svg" {head}>{body}</svg>'
INCH = 'width="4in" height="3in" viewBox="0 0 400 300"'
PLATE = '<rect width="400" height="300"/>'
STEEL = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 1e-3)


pytestmark = pytest.mark.usefixtures("read_here")


def mesh_of(folder, points=GOOD.points, cells=GOOD.cells, kind="triangle", unit=None, sets=None, **more):
    """A mesh file of these points (n, 2 or 3) and cells, loaded."""
    points = np.asarray(points, float)
    points = np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])
    blocks = [(kind, np.asarray(cells)), *more.get("others", ())]
    made = meshio.Mesh(points, blocks, cell_sets=sets)
    suffix = "inp" if sets else "vtu"
    made.write(folder / f"plate.{suffix}")
    return fi.mesh.load(folder / f"plate.{suffix}", unit=unit)


def moved(value):
    """The points of a good mesh with one coordinate changed."""
    points = GOOD.points.copy()
    points[3, 0] = value
    return points


def pieces(shift, weld=()):
    """A good mesh twice, the second moved; ``weld`` names nodes of the second that lie on nodes of the first."""
    points = np.concatenate([GOOD.points, GOOD.points + np.array(shift)])
    return {"points": points, "cells": np.concatenate([GOOD.cells, GOOD.cells + len(GOOD.points)])}


def raw(folder, triangles=None, sets=None):
    """A square of two triangles and a line as the reader of meshes finds it, where no writer makes such a file."""
    lines = "line", np.array([[0, 1]]), None
    cells = "triangle", TRIANGLES if triangles is None else triangles, None
    found = meshio_reader.Raw(np.array(SQUARE, float), [cells, lines], {}, sets or {})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(meshio_reader, "read", lambda path: found)
        return fi.mesh.load(folder / "plate.msh")


def svg(folder, body=PLATE, head=INCH, unit=None):
    pytest.importorskip("svgelements", reason="the cad extra is not installed")
    (folder / "plate.svg").write_text(SVG.format(head=head, body=body))
    return fi.mesh.outline(folder / "plate.svg", unit=unit)


def dxf(folder, radius, unit=None, units=6):
    ezdxf = pytest.importorskip("ezdxf", reason="the cad extra is not installed")
    document = ezdxf.new()
    document.units = units
    document.modelspace().add_circle((0, 0), radius)
    document.saveas(folder / "plate.dxf")
    return fi.mesh.outline(folder / "plate.dxf", unit=unit)


def modes_of(folder, change=None, written=True):
    """Modes from a universal file, of whose data sets ``change`` makes others, before or after they are written."""
    pyuff = pytest.importorskip("pyuff", reason="the uff extra is not installed")
    modes = fi.find_modes(fi.assemble(GOOD, STEEL), n_modes=4)
    fi.export.write_uff(folder / "good.uff", modes)
    sets = pyuff.UFF(str(folder / "good.uff")).read_sets()
    if change is not None and written:
        change(sets)
    (folder / "plate.uff").unlink(missing_ok=True)
    pyuff.UFF(str(folder / "plate.uff")).write_sets(sets, mode="add")
    with pytest.MonkeyPatch.context() as patch:
        if not written:
            change(sets)
            patch.setattr(pyuff.UFF, "read_sets", lambda self, i: sets[i])
        return fi.Modes.from_uff(folder / "plate.uff", mass=1.0)


def functions_of(folder, first="   0.00000000000e+00"):
    """Frequency responses from a universal file, the first of their numbers replaced."""
    pytest.importorskip("pyuff", reason="the uff extra is not installed")
    (folder / "h.uff").unlink(missing_ok=True)
    transfer.write_uff(
        folder / "h.uff", fi.frf(fi.Taps.from_arrays(np.eye(1, 256, 9), np.zeros((1, 256, 1)), rate=1e3))
    )
    text = (folder / "h.uff").read_text().replace("   0.00000000000e+00", first, 1)
    (folder / "h.uff").write_text(text)
    return transfer.read_frf(folder / "h.uff")


def functions_as_taps(folder):
    functions_of(folder)
    return fi.read_taps(folder / "h.uff")


def matlab(folder, version):
    if version == "-v7":
        savemat(folder / "taps.mat", tap_of(4000))
    else:
        (folder / "taps.mat").write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64" + bytes(600))
    return fi.read_taps(folder / "taps.mat", rate=10e3)


def change(**values):
    """Set entries of the last mode of a universal file."""
    return lambda sets: sets[-1].update(values)


def nodes_lost(sets):
    """Take the last node from the tables of nodes of a universal file."""
    for one in sets[:2]:
        one.update({name: one[name][:-1] for name in ("node_nums", "def_cs", "disp_cs", "color", "x", "y", "z")})


def complex_shapes(phase):
    """Give the last mode of a universal file complex shapes, turned by one angle or by one for every node [rad]."""

    def turn(sets):
        last = sets[-1]
        shape = last["r3"] * np.exp(1j * phase * np.arange(len(last["r3"])))
        pole = 2.0j * np.pi * last["freq"]
        last.update(
            r1=0j * shape, r2=0j * shape, r3=shape, data_type=5, analysis_type=3, eig=pole, modal_a=2.0 * pole,
            modal_b=0j, load_case=1,
        )  # fmt: skip
        last.pop("freq")

    return turn


def taps_of(folder, text=None, name="taps.csv", **options):
    """Taps read from a table: two half waves of 40 N at 10 kHz, unless its text is given."""
    time = np.arange(4000) / 10e3
    force = 40.0 * np.maximum(np.sin(np.arange(4000) / 4.0), 0.0) * np.isin(np.arange(4000) // 12, [80, 200])
    (folder / name).write_text(told(force, time) if text is None else text(force, time))
    return fi.read_taps(folder / name, **options)


def told(force, time=None):
    rows = zip(force) if time is None else zip(time, force)
    return ("Force [N]\n" if time is None else "t [s],Force [N]\n") + "\n".join(",".join(map(str, row)) for row in rows)


def spoiled(force, time):
    force = force.copy()
    force[7] = np.nan
    return told(force, time)


def saved(folder, name, force=None, **arrays):
    np.savez(folder / name, **arrays)
    return fi.read_taps(folder / name, rate=10e3, force=force)


def tap_of(n_samples, n_channels=1):
    time = np.arange(n_samples)
    one = 40.0 * np.maximum(np.sin(time / 4.0), 0.0) * (time // 12 == 8)
    return {"force": one} | {f"a{i}": one for i in range(n_channels - 1)}


def scene_of(folder, encoding="utf-8"):
    (folder / "scene.toml").write_bytes(("# Membran für 0,3 m\n" + SMALL).encode(encoding))
    return fi.load_scene(folder / "scene.toml")


TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
SQUARE = [(0, 0), (0.4, 0), (0.4, 0.3), (0, 0.3)]

FILES = {  # what fails, the message, and what it advises
    "a coordinate that is no number": (
        lambda f: mesh_of(f, moved(np.nan)),
        r"not a number at node \S+: .*; correct that node",
        mesh_of,
    ),
    "a coordinate far away": (
        lambda f: mesh_of(f, moved(1e13)),
        r"beyond \S+ at node \S+: .*; correct that node",
        mesh_of,
    ),
    "millimetres": (
        lambda f: mesh_of(f, 1e3 * GOOD.points),
        "pass unit='mm' to load it, or unit='m' if it is that large",
        lambda f: (mesh_of(f, 1e3 * GOOD.points, unit="mm"), mesh_of(f, 1e3 * GOOD.points, unit="m")),
    ),
    "a beam": (
        lambda f: mesh_of(f, cells=GOOD.facets, kind="line"),
        r"mesh the surface with triangles \(make a beam with fi.mesh.line\)",
        lambda f: (mesh_of(f), fi.mesh.line(0.4)),
    ),
    "no surface": (
        lambda f: mesh_of(f, SQUARE, [[0, 1, 2, 3]], "tetra"),
        "mesh the surface with triangles",
        mesh_of,
    ),
    "a volume": (
        lambda f: mesh_of(f, others=[("tetra", np.array([[0, 1, 2, 3]]))]),
        "export only the flat surface",
        mesh_of,
    ),
    "all at one point": (
        lambda f: mesh_of(f, 0.0 * GOOD.points),
        "all its nodes at one point; export it again",
        mesh_of,
    ),
    "crowds": (
        lambda f: mesh_of(f, np.repeat([(0, 0), (1, 0), (0, 1)], 20, axis=0), np.arange(60).reshape(3, 20).T),
        "most of its nodes at a few points; export it again",
        lambda f: mesh_of(f, [(0, 0), (1, 0), (0, 1)], [[0, 1, 2]]),
    ),
    "no area": (
        lambda f: mesh_of(f, [*SQUARE, (0.2, 0)], [*TRIANGLES, [0, 4, 1]]),
        "remove them or mesh the outline again",
        lambda f: (mesh_of(f, SQUARE, TRIANGLES), fi.mesh.outline(np.array(SQUARE))),
    ),
    "three on a side": (
        lambda f: mesh_of(f, [*SQUARE, (0.1, 0.2)], [*TRIANGLES, [0, 2, 4]]),
        "remove the extra one",
        lambda f: mesh_of(f, SQUARE, TRIANGLES),
    ),
    "two pieces": (
        lambda f: mesh_of(f, **pieces((1.0, 0.0))),
        "connect them, or export only one piece",
        lambda f: (mesh_of(f, **pieces((0.4, 0.0))), mesh_of(f)),
    ),
    "a fold": (
        lambda f: mesh_of(f, [(0, 0), (1, 0), (0, 1), (0.5, 0.9)], [[0, 1, 2], [0, 1, 3]]),
        "on the same side of their common edge; mesh it again",
        lambda f: mesh_of(f, SQUARE, TRIANGLES),
    ),
    "a hinge of one node": (
        lambda f: mesh_of(f, *bow_tie(joined=False)),
        "is connected only by the node .*; connect it along a side",
        lambda f: mesh_of(f, *bow_tie(joined=True)),
    ),
    "a spiral": (
        lambda f: mesh_of(f, *ribbon(2.5)),
        "overlap at the rim .*; mesh it again",
        lambda f: mesh_of(f, *ribbon(0.8)),
    ),
    "no outline to refine": (
        lambda f: replace(GOOD, recipe=None).refined(),
        "make it with fi.mesh, or load a finer file",
        lambda f: (GOOD.refined(), mesh_of(f, *(lambda m: (m.points, m.cells))(GOOD.refined())).refined()),
    ),
    "a tolerance on a mesh of one's own": (
        lambda f: fi.find_modes(fi.assemble(replace(GOOD, recipe=None), STEEL), n_modes=4, tolerance=1e-3),
        "make it with fi.mesh or load it with fi.mesh.load",
        lambda f: [
            fi.find_modes(fi.assemble(m, STEEL), n_modes=4, tolerance=1e-3)
            for m in (fi.mesh.rectangle(0.4, 0.3), mesh_of(f))
        ],
    ),
    "a beam saved": (
        lambda f: fi.mesh.save(f / "a.msh", fi.mesh.line(1.0)),
        "make a beam with fi.mesh.line",
        lambda f: fi.mesh.line(1.0),
    ),
    "a point twice": (
        lambda f: fi.mesh.outline([(0, 0), (1, 0), (1, 0), (0, 1)]),
        "same point twice in a row; remove one",
        lambda f: fi.mesh.outline([(0, 0), (1, 0), (0, 1)]),
    ),
    "a corner twice": (
        lambda f: fi.mesh.polygon([(0, 0), (1, 0), (1, 0), (0, 1)]),
        "at the same place; remove one",
        lambda f: fi.mesh.polygon([(0, 0), (1, 0), (0, 1)]),
    ),
    "several polygons": (
        lambda f: fi.mesh.outline(two_disks()),
        "mesh its parts one by one",
        lambda f: [fi.mesh.outline(part) for part in two_disks().geoms],
    ),
    "a sliver": (
        lambda f: fi.mesh.polygon([(0, 0), (1, 0), (1, 1e-5), (0, 1e-5)]),
        "longer than wide; widen it",
        lambda f: fi.mesh.polygon([(0, 0), (1, 0), (1, 1e-2), (0, 1e-2)]),
    ),
    "a sliver somewhere": (
        lambda f: fi.mesh.polygon(with_whisker(1e-6)),
        r"longer than wide near \(.*\) m; widen it there",
        lambda f: fi.mesh.polygon(with_whisker(1e-1)),
    ),
    "entities": (lambda f: entities(f), "save it as plain SVG", svg),
    "a huge comment": (
        lambda f: svg(f, PLATE + f"<!--{'a' * (drawings.LONGEST_COMMENT + 1)}-->"),
        "million characters; remove it",
        svg,
    ),
    "too many shapes": (lambda f: svg(f, PLATE * (drawings.MOST_PIECES + 1)), "simplify the drawing", svg),
    "too many numbers": (
        lambda f: svg(f, f'<path d="M0 0{" 1" * (drawings.MOST_NUMBERS + 2)}"/>'),
        "simplify them",
        svg,
    ),
    "too many curves": (
        lambda f: svg(f, f'<path d="M0 0{" L1 2" * (drawings.MOST_PIECES + 2)}"/>'),
        "lines and curves; simplify the drawing",
        svg,
    ),
    "no width": (
        lambda f: svg(f, head='width="0in" height="0in" viewBox="0 0 4 3"'),
        "no usable width and viewBox; set both to positive numbers",
        svg,
    ),
    "an infinite drawing": (
        lambda f: svg(f, '<path d="M0 0 H1e400 V1 Z"/>'),
        "not finite numbers; correct the drawing",
        svg,
    ),
    "a drawing far away": (
        lambda f: svg(f, '<path d="M0 0 H1e17 V1 Z"/>'),
        "coordinates beyond .*; correct the drawing",
        svg,
    ),
    "frequency responses for taps": (
        functions_as_taps,
        "no time records; export those, or give the path of frequency responses to fi.frf",
        lambda f: fi.frf(f / "h.uff"),
    ),
    "an empty drawing": (
        lambda f: svg(f, ""),
        "draw it with paths, lines, arcs or splines",
        lambda f: (svg(f), svg(f, '<path d="M0 0 A9 9 0 0 1 20 0 Q 10 30 0 0"/>')),
    ),
    "an open path": (
        lambda f: svg(f, '<path d="M0 0 H400 V300"/>'),
        r"ends at \(.*\) m, .* close the path there",
        lambda f: svg(f, '<path d="M0 0 H400 V300 Z"/>'),
    ),
    "millimetres drawn": (
        lambda f: dxf(f, 150.0),
        "pass unit='mm' to load it, or unit='m' if it is that large",
        lambda f: (dxf(f, 150.0, unit="mm"), dxf(f, 150.0, unit="m")),
    ),
    "shapes without coordinates": (
        lambda f: modes_of(f, nodes_lost),
        "which has no coordinates; export it again",
        modes_of,
    ),
    "shapes that are no numbers": (
        lambda f: modes_of(f, change(freq=-5.0)),
        "negative, too large or not numbers; export it again",
        modes_of,
    ),
    "modes at other nodes": (
        lambda f: modes_of(f, lambda sets: sets[-1].update(node_nums=sets[-1]["node_nums"][::-1])),
        "export all modes at the same nodes",
        modes_of,
    ),
    "no modal mass": (
        lambda f: modes_of(f, change(modal_m=0.0)),
        "export mass-normalised shapes with modal mass 1, or use Modes.from_arrays",
        lambda f: (modes_of(f), fi.Modes.from_arrays([9.0], [[1.0]], points=[[0.0, 0.0]], mass=1.0)),
    ),
    "complex modes": (
        lambda f: modes_of(f, complex_shapes(1.0)),
        "export real modes",
        lambda f: modes_of(f, complex_shapes(0.0)),
    ),
    "a scene in Latin-1": (
        lambda f: scene_of(f, "latin-1"),
        "a scene must be UTF-8 text; save it in that encoding",
        scene_of,
    ),
    "a set of lines that are not there": (
        lambda f: raw(f, sets={"rim": [None, np.array([7])]}),
        r"has no line \S+, named by set \S+; export it again",
        lambda f: raw(f, sets={"rim": [None, np.array([0])]}),
    ),
    "triangles of four nodes": (
        lambda f: raw(f, triangles=np.zeros((2, 4), int)),
        r"has a \S+ without exactly \S+ nodes; export it again",
        raw,
    ),
    "a cell with a node too many": (
        lambda f: raw(f, triangles=TRIANGLES + 1),
        r"has a cell with node \S+ but only \S+ nodes; export it again",
        raw,
    ),
    "a shape cut short": (
        lambda f: modes_of(f, lambda sets: [one.update(r3=one["r3"][:-1]) for one in sets[3:]], written=False),
        "but names .*; export it again",
        modes_of,
    ),
    "a function that is no number": (
        lambda f: functions_of(f, "                 nan"),
        "no finite numbers; export it again",
        functions_of,
    ),
    "a file of new MATLAB": (
        lambda f: matlab(f, "-v7.3"),
        "is a MATLAB 7.3 file; save it with '-v7' and try again",
        lambda f: matlab(f, "-v7"),
    ),
    "no taps": (
        lambda f: taps_of(f, trigger=900.0),
        "check scale and trigger",
        lambda f: (taps_of(f, trigger=9.0), taps_of(f, trigger=900.0, scale={"Force": 1e3})),
    ),
    "a value that is missing": (
        lambda f: taps_of(f, spoiled),
        "export it again, or cut it out",
        lambda f: (taps_of(f), taps_of(f, lambda force, time: told(force[8:], time[8:]))),
    ),
    "times that go back": (
        lambda f: taps_of(f, lambda force, time: told(force, time[::-1])),
        "give the channels without them, and rate=",
        lambda f: taps_of(f, lambda force, time: told(force), rate=10e3),
    ),
    "numbers that are no text": (
        lambda f: ((f / "taps.dat").write_bytes(b"\0" * 9 + b"ab" * 5000), fi.read_taps(f / "taps.dat")),
        "give .npy, .npz, .wav, .mat or .uff its own ending",
        lambda f: saved(f, "taps.npz", hammer_force=tap_of(4000)["force"]),
    ),
    "a table called LabVIEW": (lambda f: taps_of(f, name="taps.lvm"), "for a plain table use the ending .csv", taps_of),
    "channels across": (
        lambda f: saved(f, "taps.npz", a=np.zeros((readers.MOST_CHANNELS + 1, 4000))),
        "give channels by time",
        lambda f: saved(f, "taps.npz", a=np.stack([tap_of(4000)["force"]] * 2), force="a 1"),
    ),
    "records too long": (
        lambda f: taps_of(f, length=9.0),
        "give a shorter length or before, or check rate",
        lambda f: (taps_of(f, length=0.05), taps_of(f, lambda force, time: told(force), rate=100.0, length=9.0)),
    ),
}


def two_disks():
    return shapely.MultiPolygon([shapely.Point(x, 0).buffer(0.1) for x in (0.0, 1.0)])


def with_whisker(width):
    return [(0, 0), (1, 0), (1, 0.5), (2, 0.5), (2, 0.5 + width), (1, 0.5 + width), (1, 1), (0, 1)]


def bow_tie(joined):
    """A ring of triangles whose ends meet in one node, or along a side."""
    angle = np.linspace(0.0, 2.0 * np.pi, 7)
    inner = angle if joined else 0.9 * angle
    points = [r * np.column_stack([np.cos(t), np.sin(t)]) for r, t in ((0.5, inner), (1.0, angle))]
    i = np.arange(6)
    cells = np.concatenate([np.column_stack([i, 7 + i, 8 + i]), np.column_stack([i, 8 + i, i + 1])])
    return np.concatenate(points), cells


def ribbon(turns):
    """A strip of triangles around a circle, which overlaps itself after one turn."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, int(24 * turns))
    n = len(angle)
    rise = 1.0 + 0.02 * np.arange(n) / n
    rings = [r * rise[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (0.6, 1.0)]
    i = np.arange(n - 1)
    cells = np.concatenate([np.column_stack([i, n + i, n + i + 1]), np.column_stack([i, n + i + 1, i + 1])])
    return np.concatenate(rings), cells


def entities(folder):
    pytest.importorskip("svgelements", reason="the cad extra is not installed")
    (folder / "plate.svg").write_text('<!DOCTYPE svg [<!ENTITY a "ha">]>' + SVG.format(head=INCH, body=PLATE))
    return fi.mesh.outline(folder / "plate.svg")


@pytest.mark.parametrize("name", FILES)
def test_following_the_advice_works(tmp_path, name):
    wrong, words, right = FILES[name]
    with pytest.raises(ValueError, match=words):
        wrong(tmp_path)
    right(tmp_path)


def test_a_unit_that_was_assumed_can_be_passed(tmp_path):
    for made, words in (
        (lambda **given: svg(tmp_path, head='viewBox="0 0 400 300"', **given), "pass unit= to change that"),
        (lambda **given: dxf(tmp_path, 0.3, units=0, **given), "assumed metres, pass unit= to change that"),
    ):
        assert any(words in note for note in made().notes)
        assert not any(words in note for note in made(unit="mm").notes)


def test_a_body_that_the_mesher_cannot_fill_is_filled_as_advised(monkeypatch):
    """No outline that passes the checks defeats the mesher here, so it is made to fail for one size."""
    from netgen.meshing import NgException

    spiked = [(0, 0), (1, 0), (1, 1), (0.5, 1e-3), (0, 1)]
    made = triangulation.triangulate

    def fails(outline, size):
        if size == 0.1 and len(outline.outer) == len(spiked):
            raise fi.SimulationError(f"the mesher could not fill the outline ({NgException()}); {triangulation.REMEDY}")
        return made(outline, size)

    monkeypatch.setattr("fem_impact.mesh.meshes.triangulate", fails)
    with pytest.raises(fi.SimulationError, match="remove very thin necks or spikes, or pass another size"):
        fi.mesh.polygon(spiked, size=0.1)
    fi.mesh.polygon(spiked, size=0.2)
    fi.mesh.polygon([(0, 0), (1, 0), (1, 1), (0, 1)], size=0.1)
