"""Mutated inputs for everything that comes from outside, and the judge of what becomes of them.

An input passes where it gives a result or one clear error: ValueError, SimulationError or OSError raised by the
package itself, in one printable line that names the file, within the time and the memory below, leaving no file.
"""

import contextlib
import io
import json
import logging
import os
import re
import resource
import shutil
import signal
import struct
import subprocess
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random

import numpy as np
import pytest
from scenes import QUICK as SCENE
from scenes import SHIPPED, load_text

import fem_impact as fi
from fem_impact import cli
from fem_impact._base import isolated
from fem_impact.scenes import maps
from fem_impact.scenes.scene import Scene
from fem_impact.sweeps.cases import Cases
from fem_impact.sweeps.cells import Case
from fem_impact.sweeps.store import Texts, by_blocks

PATIENCE = 10.0  # [s] per input
MEMORY = 2 << 30  # [byte] more than the process has when it begins
SHORT_PATIENCE = 0.5  # [s] of the process that reads a mesh; the files here are read in a hundredth of it
PACKAGE = str(Path(fi.__file__).parent)

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
NUMBERS = [b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"5e-324", b"1e999", b"-1", b"0", b"-0.0", b"1", b"2", b"7"]
NUMBERS += [b"1000000000000", b"2147483647", b"-2147483648", b"18446744073709551616", b"9" * 400, b"0x10", b"1_0", b""]
PACKED = [struct.pack(f"<{kind}", value) for kind in "iqQ" for value in (0, 1, 3, 2**31 - 1)]
PACKED += [struct.pack("<i", -1), struct.pack("<q", -1), struct.pack("<q", 10**12), struct.pack("<q", 2**62)]
PACKED += [struct.pack("<d", value) for value in (float("nan"), float("inf"), 1e308, -1e308, 5e-324, 0.0)]
ODD = ["é", "\u202e", "\0", "\ufeff", "😀", "\x1b[31m", "\ud7ff", "﷽", "%s%n", "../../../etc/passwd", "\t", "'", '"']
NESTS = [b"[", b"{a=", b"<g>", b"(", b"<!--", b"\n*INCLUDE, INPUT=", b"a.", b"0\nSECTION\n"]


def mutated(raw: bytes, random: Random, others: list[bytes]) -> bytes:
    """One to four mutations of a file."""
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        raw = mutated_once(raw, random.choice(MUTATIONS), random, others)
    return raw


MUTATIONS = (
    "flip", "cut", "double", "insert", "renumber", "renumber", "pack", "swap", "drop", "splice", "nest", "line ends",
)  # fmt: skip


def mutated_once(raw: bytes, how: str, random: Random, others: list[bytes]) -> bytes:
    """One mutation, mostly of a span from ``a`` to ``b``."""
    a = random.randrange(len(raw) + 1)
    b = min(len(raw), a + random.choice((1, 2, 8, 64, 4096)))
    if how == "flip":
        data = bytearray(raw)
        for _ in range(random.choice((1, 1, 4, 32)) if data else 0):
            data[random.randrange(len(data))] ^= 1 << random.randrange(8)
        return bytes(data)
    if how == "cut":
        return random.choice((raw[:a], raw[a:], raw[:a] + raw[b:], b""))
    if how == "double":
        return raw[:b] + raw[a:b] * random.choice((1, 1, 2, 50)) + raw[b:]
    if how == "insert":
        odd = random.choice(ODD).encode("utf-8", "surrogatepass")
        return raw[:a] + random.choice((odd, random.randbytes(8), b"\xff\xfe", odd * 40)) + raw[a:]
    if how == "renumber" and (found := list(NUMBER.finditer(raw))):
        hit = random.choice(found[: random.choice((12, len(found)))])  # counts stand at the beginning
        return raw[: hit.start()] + random.choice(NUMBERS) + raw[hit.end() :]
    if how == "pack":
        value = random.choice(PACKED)
        place = random.randrange(max(1, len(raw) // 4)) * random.choice((1, 4))
        return raw[:place] + value + raw[place + len(value) :]
    if how in ("swap", "drop"):
        mark = random.choice((b" ", b"\n", b",", b"=")) if how == "swap" else b"\n"
        parts = raw.split(mark)
        i, j = random.randrange(len(parts)), random.randrange(len(parts))
        if how == "swap":
            parts[i], parts[j] = parts[j], parts[i]
        else:
            del parts[i : i + random.choice((1, 1, 3))]
        return mark.join(parts)
    if how == "splice":
        other = random.choice(others)
        return raw[:a] + other[random.randrange(len(other) + 1) :]
    if how == "nest":
        return raw[:a] + random.choice(NESTS) * random.choice((10, 3000)) + raw[a:]
    ends = raw.replace(b"\n", b"\r\n"), raw.replace(b"\n", b"\r")
    return random.choice((*ends, b"\xef\xbb\xbf" + raw, raw.upper())) if how == "line ends" else raw


@dataclass(frozen=True)
class Category:
    """Files of one kind, and what reads them."""

    samples: Callable[[], list[tuple[str, bytes]]]  # file name and content
    read: Callable[[Path], object]


def mesh_samples() -> list[tuple[str, bytes]]:
    """One small plate in every format that meshio writes and `fi.mesh.load` reads."""
    import meshio

    plate = fi.mesh.rectangle(1.0, 1.0, size=0.5)
    made = meshio.Mesh(np.column_stack([plate.points, np.zeros(len(plate.points))]), [("triangle", plate.cells)])
    with tempfile.TemporaryDirectory() as name, contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fi.mesh.save(Path(name) / "saved.msh", fi.mesh.disk(1.0, size=1.0))
        for file, options in MESH_FORMATS.items():
            made.write(Path(name) / file, **options)
        return [(path.name, path.read_bytes()) for path in sorted(Path(name).iterdir()) if path.is_file()]


PLAIN = ("vtu", "vtk", "inp", "bdf", "stl", "obj", "off", "ply", "mesh", "meshb", "vol", "xml", "post", "avs", "mdpa")
MESH_FORMATS: dict[str, dict] = {
    **{f"plate.{ending}": {} for ending in (*PLAIN, "dat", "wkt", "nas", "tec", "dato")},
    **{f"ascii.{ending}": {"binary": False} for ending in ("vtu", "vtk", "ply")},
    "ascii22.msh": {"file_format": "gmsh22", "binary": False},
    "binary41.msh": {"file_format": "gmsh"},
    "ascii41.msh": {"file_format": "gmsh", "binary": False},
    "binary.stl": {"binary": True},
    "plate.xdmf": {"data_format": "XML"},
    "plate.med": {},
    "plate.hmf": {},
}


def quick(path: Path, reader: str, arguments: tuple[str, ...], patience: float) -> tuple[int, bytes, bytes]:
    """What `isolated.run_reader` gives, from this process: one that starts afresh would take 0.2 s an input."""
    logging.disable()  # as the real one does
    try:
        with limited(SHORT_PATIENCE):
            status, answer = isolated.main(path, reader, list(arguments))
    except Hang:
        raise subprocess.TimeoutExpired("a reader", patience) from None
    finally:
        logging.disable(logging.NOTSET)
    return status, *((b"", answer) if status else (answer, b""))


SVGS = [
    """<?xml version="1.0"?>
<svg xmlns="http://www.w3.org/2000/svg" width="300mm" height="200mm" viewBox="0 0 300 200">
<style>path { stroke-width: 2 }</style>
<g transform="translate(5,5) scale(0.9)"><path id="rim" d="M0 0 H300 V200 H0 Z"/></g>
<circle id="hole" cx="80" cy="50" r="20"/></svg>""",
    """<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 2 2">
<defs><ellipse id="e" cx="1" cy="1" rx="1" ry=".5"/></defs>
<use xlink:href="#e" transform="rotate(30 1 1)"/></svg>""",
    """<svg xmlns="http://www.w3.org/2000/svg" width="40cm" height="40cm" viewBox="0 0 400 400">
<path d="M 100 100 C 150 50 250 50 300 100 S 350 250 300 300 Q 200 350 100 300 T 50 200 A 60 60 0 0 1 100 100 Z"/>
</svg>""",
    """<svg xmlns="http://www.w3.org/2000/svg"><polygon points="0,0 300,0 300,200 150,260 0,200"/>
<rect id="r" x="50" y="50" width="40" height="30" rx="5"/></svg>""",
]
DXF = "0 SECTION 2 HEADER 9 $ACADVER 1 AC1009 9 $INSUNITS 70 4 0 ENDSEC 0 SECTION 2 ENTITIES {} 0 ENDSEC 0 EOF "
LINE = "0 LINE 8 {} 10 {} 20 {} 30 0 11 {} 21 {} 31 0 "
ARC = "0 ARC 8 0 10 {} 20 500 30 0 40 500 50 {} 51 {} "
VERTEX = "0 VERTEX 8 rim 10 {} 20 {} 30 0 42 {} "
BULGED = ((0, 0, 0), (900, 0, 1), (900, 500, 0), (0, 500, 0))
DXFS = [
    LINE.format("low", 0, 0, 1000, 0)
    + LINE.format("0", 0, 1000, 1000, 1000)
    + ARC.format(1000, 270, 90)
    + ARC.format(0, 90, 270)
    + "0 CIRCLE 8 hole 10 500 20 500 30 0 40 100 ",
    "0 POLYLINE 8 rim 66 1 10 0 20 0 30 0 70 1 " + "".join(VERTEX.format(*v) for v in BULGED) + "0 SEQEND 8 rim ",
]


def outline_samples() -> list[tuple[str, bytes]]:
    """Drawings as SVG and as DXF."""
    import ezdxf

    document = ezdxf.new("R2000")
    document.modelspace().add_ellipse((0, 0), (2, 0), 0.5)
    document.modelspace().add_spline([(0.0, 0.0), (0.3, 0.0), (0.4, 0.3), (0.0, 0.4), (0.0, 0.0)])
    text = io.StringIO()
    document.write(text)
    lines = ["\n".join(DXF.format(body).split()) + "\n" for body in DXFS]
    drawn = [(f"plate{i}.svg", text.encode()) for i, text in enumerate(SVGS)]
    drawn += [(f"plate{i}.dxf", text.encode()) for i, text in enumerate([*lines, text.getvalue()])]
    return drawn


def finite(mesh: object) -> object:
    """The mesh, none of whose numbers may be other than finite."""
    for name in ("points", "middles", "tangents", "curvatures"):
        assert np.isfinite(getattr(mesh, name)).all(), name
    return mesh


def uff_samples() -> list[tuple[str, bytes]]:
    """A plate's modes as a universal file, and a beam's."""
    plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), 3e-3)
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.4, 0.3, size=0.2), plate), n_modes=4)
    beam = fi.analytic.beam(1.0, ends=("free", "free"), mass=1.0, first_frequency=100.0, n_modes=3)
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "modes.uff"
        fi.export.write_uff(path, modes)
        raw = path.read_bytes()
        fi.export.write_uff(path, beam)
        return [("plate.uff", raw), ("beam.unv", path.read_bytes())]


def read_uff(path: Path) -> object:
    """Measured modes, and their shapes at a measured point."""
    modes = fi.Modes.from_uff(path, mass=0.2)
    assert np.isfinite(modes.frequencies).all() and np.isfinite(modes.shapes.values).all()
    return modes


def scene_samples() -> list[tuple[str, bytes]]:
    """The scenes of the studies."""
    return [(path.name, path.read_bytes()) for path in sorted(SHIPPED.glob("*.toml"))]


def result_samples() -> list[tuple[str, bytes]]:
    """What `fem-impact strike` keeps of a scene, without the numbers that nothing reads back."""
    scenes = [fi.load_scene(path) for path in sorted(SHIPPED.glob("*.toml"))]
    return [(f"response{i}.json", json.dumps({"scene": fi.export.plain(scene.data())}, indent=1).encode())
            for i, scene in enumerate(scenes)]  # fmt: skip


def store_samples() -> list[tuple[str, bytes]]:
    """Every file of a finished store of a map; a % stands for each / of its path."""
    made = {}
    with tempfile.TemporaryDirectory() as name:
        store = Path(name) / "store"
        by_blocks(small_grid(), solved, None, 1, store)
        made = {str(path.relative_to(store)): path.read_bytes() for path in store.rglob("*") if path.is_file()}
    PRISTINE.update(made)
    return [(name.replace("/", "%"), raw) for name, raw in sorted(made.items())]


PRISTINE: dict[str, bytes] = {}  # the store that one file of is mutated, by the paths in it


def read_store(path: Path) -> object:
    """All of a store in which one file is the one given."""
    raw, place = path.read_bytes(), path.name.split("-", 1)[-1].replace("%", "/")
    path.unlink()
    for name, content in {**PRISTINE, place: raw}.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(content)
    numbers, texts = by_blocks(small_grid(), solved, None, 1, path)
    assert numbers.shape == (len(small_grid().layers), 2) and numbers.dtype == float and set(texts) <= {0, 1}
    assert all(isinstance(text, str) for text in texts.values())
    return numbers


@cache
def small_grid() -> Cases:
    """Two blows on a rigid body."""
    base = Case(fi.Modes.rigid(1.0), fi.Striker.rigid(1.0), fi.Contact.linear(1e5), np.zeros(0), 1.0)
    return Cases(base, {"mass": np.array([0.1, 0.2])}, 1e-3)


def solved(cases: Cases, start: int, stop: int) -> tuple[np.ndarray, Texts]:
    """Stands for the blows themselves, which are of no interest here."""
    texts = {i: "the motion may be chaotic: é" for i in range(start, stop) if i % 2 == 0}
    return np.ones((len(cases.layers), stop - start)), texts


COMMANDS = """strike SCENE --out OUT --tolerance 1e-2 --json
strike SCENE --tolerance=0.1
modes SCENE --n-modes 5 --vtk OUT/modes.pvd
modes SCENE --json --n-modes=3
hammer SCENE --bandwidth 800 --drop 10 --masses 0.1 0.2 --out OUT/hammers.png
map SCENE --out OUT --format nc --workers 1 --store STORE
report SCENE --out OUT/page.html
completion
--version
--help"""


def command_samples() -> list[tuple[str, bytes]]:
    """A command line each."""
    return [(f"{i}.txt", line.encode()) for i, line in enumerate(COMMANDS.splitlines())]


QUICK = SCENE.replace("tolerance = 1e-2", "tolerance = 1e-1")


def hasten(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Replace what takes long in the commands by its result for their scene."""
    scene = load_text(folder, QUICK)
    run, modes = scene.run(), scene.modes(5)
    # compiles, which may take half a minute
    fi.hammers.choose_on(scene.built.target, scene.blow.values["at"], 800.0, [0.1])
    maps.map_scene(scene)
    monkeypatch.setattr(fi.figures, "save", lambda path, figure: Path(path).write_bytes(b""))
    monkeypatch.setattr(fi.report, "write", lambda path, scene, run: Path(path).write_bytes(b""))
    monkeypatch.setattr(Scene, "run", lambda self, watch=None, **changes: run)
    shown = lambda self, count=None, **_: modes if count is None else modes.truncated(n_modes=count)  # noqa: E731
    monkeypatch.setattr(Scene, "modes", shown)


def read_command(path: Path) -> object:
    """Run a command in an empty folder; its message must be one line, and a failure leaves nothing."""
    words = path.read_bytes().decode("utf-8", "surrogateescape").replace("\0", "").split()
    folder = path.with_suffix(".run")
    folder.mkdir()
    (folder / "SCENE").write_text(QUICK)
    out, err, here = io.TextIOWrapper(io.BytesIO()), io.TextIOWrapper(io.BytesIO()), Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = cli.main(words)
    except SystemExit as end:
        status = end.code or 0
    finally:
        os.chdir(here)
        left = sorted(file.name for file in folder.iterdir())
        partial = [file for file in folder.rglob("*") if "partial" in file.name]
        shutil.rmtree(folder)
    err.seek(0)
    said = err.read()
    assert not partial, partial
    if status == 0:
        assert said == "", said
        return status
    assert status in (1, 2), status
    assert left == ["SCENE"], left
    assert said.startswith("fem-impact: ") and said.endswith("\n") and said[:-1].isprintable(), said
    assert len(said) < 1000 + len(path.read_bytes()), said
    return REFUSED


REFUSED = "refused"


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise Hang after some seconds; on a busy machine, after twenty times as many with little done in them."""
    begin, worked = time.monotonic(), time.process_time()

    def ring(*_: object) -> None:
        if time.process_time() - worked > 0.7 * seconds or time.monotonic() - begin > 20.0 * seconds:
            raise Hang(f"longer than {seconds:g} s")
        signal.setitimer(signal.ITIMER_REAL, 0.5 * seconds)

    before = signal.signal(signal.SIGALRM, ring)
    rest, _ = signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.signal(signal.SIGALRM, before)
        signal.setitimer(signal.ITIMER_REAL, rest)


class Hang(BaseException):
    """An input that took too long."""


def judged(read: Callable[[Path], object], path: Path) -> str:
    """'' where reading gives a result, 'refused' for a clear error, else what is wrong."""
    try:
        with limited(PATIENCE), warnings.catch_warnings():
            warnings.simplefilter("error")
            return REFUSED if read(path) is REFUSED else ""
    except (ValueError, fi.SimulationError, OSError) as error:
        text = str(error)
        frame = traceback.extract_tb(error.__traceback__)[-1]
        if not frame.filename.startswith(PACKAGE):
            return f"{type(error).__name__} from {Path(frame.filename).name}:{frame.lineno}: {text:.200}"
        if path.name not in text or not text.isprintable() or len(text) > 1000:
            return f"unclear: {type(error).__name__}: {text!r:.300}"
        return REFUSED
    except (Exception, Hang) as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} from {Path(frame.filename).name}:{frame.lineno}: {error!s:.200}"


def one(category: str, number: int, folder: Path) -> str:
    """Make input ``number`` of a category in an empty folder and judge it, as `judged`."""
    random, known = Random(f"{category} {number}"), samples(category)
    name, raw = known[number % len(known)]
    if random.random() < 0.02:  # a wrong ending
        name = random.choice(known)[0]
    path = folder / f"{number}-{name}"
    path.write_bytes(mutated(raw, random, [other for _, other in known]))
    verdict = judged(CATEGORIES[category].read, path)
    left = sorted(file.name for file in folder.iterdir() if file != path)
    for file in folder.iterdir():
        shutil.rmtree(file) if file.is_dir() else file.unlink()
    return f"left {left}" if left and verdict in ("", REFUSED) else verdict


@contextmanager
def confined() -> Iterator[Path]:
    """In an empty folder, with `MEMORY` more than the process has now."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    own = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (own + MEMORY, before[1]))
    try:
        with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
            yield Path(name)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


CATEGORIES = {
    "scene": Category(scene_samples, fi.load_scene),
    "mesh": Category(mesh_samples, lambda path: finite(fi.mesh.load(path))),
    "outline": Category(outline_samples, lambda path: finite(fi.mesh.outline(path, unit="mm"))),
    "uff": Category(uff_samples, read_uff),
    "result": Category(result_samples, fi.report.read),
    "store": Category(store_samples, read_store),
    "command": Category(command_samples, read_command),
}


@cache
def samples(category: str) -> list[tuple[str, bytes]]:
    """What the inputs of a category are mutated from."""
    return CATEGORIES[category].samples()
