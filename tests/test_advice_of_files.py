"""Every message about a file that gives advice: following it works."""

from dataclasses import replace

import ezdxf
import meshio
import numpy as np
import pytest
import pyuff
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


def pieces(shift):
    """A good mesh twice, the second moved."""
    points = np.concatenate([GOOD.points, GOOD.points + np.array(shift)])
    return {"points": points, "cells": np.concatenate([GOOD.cells, GOOD.cells + len(GOOD.points)])}


def raw(folder, triangles=None, sets=None):
    """A square of two triangles and a line as the reader of meshes finds it, where no writer makes such a file."""
    lines = "line", np.array([[0, 1]]), None
    cells = "triangle", TRIANGLES if triangles is None else triangles, None
    found = meshio_reader.Raw(np.array(SQUARE, float), [cells, lines], {}, sets or {})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(meshio_reader, "read_raw", lambda path: found)
        return fi.mesh.load(folder / "plate.msh")


def svg(folder, body=PLATE, head=INCH, unit=None):
    (folder / "plate.svg").write_text(SVG.format(head=head, body=body))
    return fi.mesh.outline(folder / "plate.svg", unit=unit)


def dxf(folder, radius, unit=None, units=6):
    document = ezdxf.new()
    document.units = units
    document.modelspace().add_circle((0, 0), radius)
    document.saveas(folder / "plate.dxf")
    return fi.mesh.outline(folder / "plate.dxf", unit=unit)


def modes_of(folder, change=None, written=True):
    """Modes from a universal file, of whose data sets ``change`` makes others, before or after they are written."""
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
    (folder / "h.uff").unlink(missing_ok=True)
    pulse = np.eye(1, 256, 9)
    transfer.write_uff(folder / "h.uff", fi.frf(fi.Taps.from_arrays(pulse, pulse, rate=1e3)))
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
PLAIN = {"points": SQUARE, "cells": TRIANGLES}


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
    return {"points": np.concatenate(points), "cells": cells}


def ribbon(turns):
    """A strip of triangles around a circle, which overlaps itself after one turn."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, int(24 * turns))
    n = len(angle)
    rise = 1.0 + 0.02 * np.arange(n) / n
    rings = [r * rise[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (0.6, 1.0)]
    i = np.arange(n - 1)
    cells = np.concatenate([np.column_stack([i, n + i, n + i + 1]), np.column_stack([i, n + i + 1, i + 1])])
    return {"points": np.concatenate(rings), "cells": cells}


def shape(n):
    """A path of so many numbers or lines, as SVG."""
    return {"body": f'<path d="M0 0{n}"/>'}


def mesh_outline(folder, points):
    return fi.mesh.outline(points)


def mesh_polygon(folder, points):
    return fi.mesh.polygon(points)


def refined_body(folder, recipe=GOOD.recipe):
    return replace(GOOD, recipe=recipe).refined()


def found_to_tolerance(folder, mesh=None):
    """Modes to a tolerance, of a mesh of one's own or one that can be refined."""
    return fi.find_modes(fi.assemble(mesh or mesh_of(folder), STEEL), n_modes=4, tolerance=1e-3)


CROWD = np.repeat([(0, 0), (1, 0), (0, 1)], 20, axis=0), np.arange(60).reshape(3, 20).T
OPEN, CLOSED = ({"body": f'<path d="M0 0 H400 V300{end}"/>'} for end in ("", " Z"))
ARC = {"body": '<path d="M0 0 A9 9 0 0 1 20 0 Q 10 30 0 0"/>'}
MM, METRES = {"unit": "mm"}, {"unit": "m"}
PULSES = 1.0 * (np.arange(4000) % 6 == 0) * (np.arange(4000) > 3000)  # of one tap, or of many of 6 samples
# fmt: off
FILES = [  # what reads the file, of what it is refused, a pattern of the message, and of what it reads it as advised
    (mesh_of, {"points": moved(np.nan)}, r"not a number at node \S+: .*; correct that node", {}),
    (mesh_of, {"points": moved(1e13)}, r"beyond \S+ at node \S+: .*; correct that node", {}),
    (mesh_of, {"points": 1e3 * GOOD.points}, "pass unit='mm' to load it, or unit='m' if it is that large", MM, METRES),
    (mesh_of, {"cells": GOOD.facets, "kind": "line"},
     r"mesh the surface with triangles \(make a beam with fi.mesh.line\)", {}),
    (mesh_of, {"points": SQUARE, "cells": [[0, 1, 2, 3]], "kind": "tetra"}, "mesh the surface with triangles", {}),
    (mesh_of, {"others": [("tetra", np.array([[0, 1, 2, 3]]))]}, "export only the flat surface", {}),
    (mesh_of, {"points": 0.0 * GOOD.points}, "all its nodes at one point; export it again", {}),
    (mesh_of, {"points": np.repeat(SQUARE[:2], 2, axis=0), "cells": TRIANGLES},
     "no triangle with three corners apart; export it again", PLAIN),
    (mesh_of, dict(zip(("points", "cells"), CROWD)), "most of its nodes at a few points; export it again",
     {"points": [(0, 0), (1, 0), (0, 1)], "cells": [[0, 1, 2]]}),
    (mesh_of, {"points": [*SQUARE, (0.2, 0)], "cells": [*TRIANGLES, [0, 4, 1]]},
     "remove them or mesh the outline again", PLAIN),
    (mesh_of, {"points": [*SQUARE, (0.1, 0.2)], "cells": [*TRIANGLES, [0, 2, 4]]}, "remove the extra one", PLAIN),
    (mesh_of, pieces((1.0, 0.0)), "connect them, or export only one piece", pieces((0.4, 0.0)), {}),
    (mesh_of, {"points": [(0, 0), (1, 0), (0, 1), (0.5, 0.9)], "cells": [[0, 1, 2], [0, 1, 3]]},
     "on the same side of their common edge; mesh it again", PLAIN),
    (mesh_of, bow_tie(joined=False), "is connected only by the node .*; connect it along a side", bow_tie(joined=True)),
    (mesh_of, ribbon(2.5), "overlap at the rim .*; mesh it again", ribbon(0.8)),
    (refined_body, {"recipe": None}, "make it with fi.mesh, or load a finer file", {}),
    (found_to_tolerance, {"mesh": replace(GOOD, recipe=None)}, "make it with fi.mesh or load it with fi.mesh.load",
     {"mesh": GOOD}, {}),
    (mesh_outline, {"points": [(0, 0), (1, 0), (1, 0), (0, 1)]}, "same point twice in a row; remove one",
     {"points": [(0, 0), (1, 0), (0, 1)]}),
    (mesh_outline, {"points": two_disks()}, "mesh its parts one by one", *({"points": x} for x in two_disks().geoms)),
    (mesh_polygon, {"points": [(0, 0), (1, 0), (1, 0), (0, 1)]}, "at the same place; remove one",
     {"points": [(0, 0), (1, 0), (0, 1)]}),
    (mesh_polygon, {"points": [(0, 0), (1, 0), (1, 1e-5), (0, 1e-5)]}, "longer than wide; widen it",
     {"points": [(0, 0), (1, 0), (1, 1e-2), (0, 1e-2)]}),
    (mesh_polygon, {"points": with_whisker(1e-6)}, r"longer than wide near \(.*\) m; widen it there",
     {"points": with_whisker(1e-1)}),
    (svg, {"body": PLATE + f"<!--{'a' * (drawings.LONGEST_COMMENT + 1)}-->"}, "million characters; remove it", {}),
    (svg, {"body": PLATE * (drawings.MOST_PIECES + 1)}, "simplify the drawing", {}),
    (svg, shape(" 1" * (drawings.MOST_NUMBERS + 2)), "simplify them", {}),
    (svg, shape(" L1 2" * (drawings.MOST_PIECES + 2)), "lines and curves; simplify the drawing", {}),
    (svg, {"head": 'width="0in" height="0in" viewBox="0 0 4 3"'},
     "no usable width and viewBox; set both to positive numbers", {}),
    (svg, shape(" H1e400 V1 Z"), "not finite numbers; correct the drawing", {}),
    (svg, shape(" H1e17 V1 Z"), "coordinates beyond .*; correct the drawing", {}),
    (svg, {"body": ""}, "draw it with paths, lines, arcs or splines", {}, ARC),
    (svg, OPEN, r"ends at \(.*\) m, .* close the path there", CLOSED),
    (dxf, {"radius": 150.0}, "pass unit='mm' to load it, or unit='m' if it is that large",
     {"radius": 150.0, **MM}, {"radius": 150.0, **METRES}),
    (modes_of, {"change": nodes_lost}, "which has no coordinates; export it again", {}),
    (modes_of, {"change": change(freq=-5.0)},
     "must hold a stable body, .*; correct the model, or the load under which it", {}),
    (modes_of, {"change": change(freq=np.inf)}, "too large or not numbers; export it again", {}),
    (modes_of, {"change": lambda sets: sets[-1].update(node_nums=sets[-1]["node_nums"][::-1])},
     "export all modes at the same nodes", {}),
    (modes_of, {"change": change(modal_m=0.0)},
     "export mass-normalised shapes with modal mass 1, or use Modes.from_arrays", {},
     lambda _: fi.Modes.from_arrays([9.0], [[1.0]], points=[[0.0, 0.0]], mass=1.0)),
    (modes_of, {"change": complex_shapes(1.0)}, "export real modes", {"change": complex_shapes(0.0)}),
    (modes_of, {"change": lambda sets: [one.update(r3=one["r3"][:-1]) for one in sets[3:]], "written": False},
     "but names .*; export it again", {}),
    (scene_of, {"encoding": "latin-1"}, "a scene must be UTF-8 text; save it in that encoding", {}),
    (raw, {"sets": {"rim": [None, np.array([7])]}}, r"has no line \S+, named by set \S+; export it again",
     {"sets": {"rim": [None, np.array([0])]}}),
    (raw, {"triangles": np.zeros((2, 4), int)}, r"has a \S+ without exactly \S+ nodes; export it again", {}),
    (raw, {"triangles": TRIANGLES + 1}, r"has a cell with node \S+ but only \S+ nodes; export it again", {}),
    (functions_of, {"first": "                 nan"}, "is no finite number; export it again, or cut it out", {}),
    (functions_as_taps, {}, "no time records; export those, or give the path of frequency responses to fi.frf",
     lambda f: fi.frf(f / "h.uff")),
    (matlab, {"version": "-v7.3"}, "is a MATLAB 7.3 file; save it with '-v7' and try again", {"version": "-v7"}),
    (taps_of, {"trigger": 900.0}, "check scale and trigger", {"trigger": 9.0},
     {"trigger": 900.0, "scale": {"Force": 1e3}}),
    (taps_of, {"text": spoiled}, "export it again, or cut it out", {},
     {"text": lambda force, time: told(force[8:], time[8:])}),
    (taps_of, {"text": lambda force, time: told(force, time[::-1])}, "give the channels without them, and rate=",
     {"text": lambda force, time: told(force), "rate": 10e3}),
    (taps_of, {"text": lambda *_: "\0" * 9 + "ab" * 5000, "name": "taps.dat"},
     "give .npy, .npz, .wav, .mat or .uff its own ending",
     lambda f: saved(f, "taps.npz", hammer_force=tap_of(4000)["force"])),
    (taps_of, {"name": "taps.npz"}, "give a text table the ending .csv", {}),
    (taps_of, {"text": lambda _, time: told(40.0 * PULSES, 1e3 * time)}, "check the unit of its times",
     {"text": lambda _, time: told(40.0 * PULSES, 1e3 * time).replace("[s]", "[ms]")}),
    (taps_of, {"name": "taps.lvm"}, "for a plain table use the ending .csv", {}),
    (taps_of, {"length": 9.0}, "give a shorter length or before, or check rate", {"length": 0.05},
     {"text": lambda force, time: told(force), "rate": 100.0, "length": 9.0}),
    (saved, {"name": "taps.npz", "a": np.zeros((readers.MOST_CHANNELS + 1, 4000))}, "give channels by time",
     {"name": "taps.npz", "a": np.stack([tap_of(4000)["force"]] * 2), "force": "a 1"}),
]
# fmt: on


@pytest.mark.parametrize(
    "read, bad, words, goods", [pytest.param(*row[:3], row[3:], id=f"{row[0].__name__}-{row[2]}") for row in FILES]
)
def test_following_the_advice_works(tmp_path, read, bad, words, goods):
    with pytest.raises(ValueError, match=words):
        read(tmp_path, **bad)
    for good in goods:
        good(tmp_path) if callable(good) else read(tmp_path, **good)


def test_no_mesh_of_a_beam_is_saved(tmp_path):
    with pytest.raises(ValueError, match=r"make a beam with fi\.mesh\.line"):
        fi.mesh.save(tmp_path / "a.msh", fi.mesh.line(1.0))


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
