"""The command line: parses the arguments, calls the library and prints the results; contains no physics."""

import argparse
import difflib
import io
import json
import logging
import math
import os
import re
import shutil
import signal
import sys
import textwrap
import threading
import time
import warnings
import webbrowser
from collections.abc import Iterator, MutableMapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import fem_impact as fi

from ._base.files import undo_all
from .display import Display
from .show import FORMATS

BAD_INPUT, FAILED, MISSED, INTERRUPTED = 2, 1, 3, 130  # exit statuses, as Unix tools use them; 130 is 128 + SIGINT
WIDEST = 88  # [-] columns: printed text is never wider, and narrower on a narrow terminal
MOTION_TIMES = 100  # [-] instants in motion.pvd: four seconds at 25 per second
SHAPES_WRITTEN = 24  # [-] mode shapes in modes.pvd of a strike; `modes --vtk` writes any number


def main(arguments: list[str] | None = None) -> int:
    """Run one command; the exit status is 0, or

    2 for bad input, 1 for a run that failed, 3 for one that missed its tolerance, 130 after Ctrl-C.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a title may hold characters that this terminal lacks
    options = _parser().parse_args(arguments)
    plain = _prepare(os.environ, once=options.run in (_strike, _modes, _report))
    try:
        with _interruptible(options):
            missed = options.run(options)
            print(end="", flush=True)
    except ValueError as error:
        return _complain(error, BAD_INPUT)
    except BrokenPipeError:
        _forget_output()
        return FAILED
    except OSError as error:
        _forget_output()
        return _complain(f"{error.filename}: {error.strerror}" if error.filename else error.strerror or error, FAILED)
    except MemoryError:
        return _complain("not enough memory; `fem-impact plan SCENE` shows what needs it", FAILED)
    except RuntimeError as error:
        if not isinstance(error, fi.SimulationError):
            raise
        if plain:  # perhaps only plain Python failed: run again with compiled kernels
            from ._base import child  # imported only when needed

            words = sys.argv[1:] if arguments is None else arguments
            again, environment = child.python("__main__:main", *words, NUMBA_DISABLE_JIT="0")
            os.execve(again[0], again, environment)
        return _complain(error, FAILED)
    except KeyboardInterrupt:
        return _complain(f"interrupted; {_kept(options)}", INTERRUPTED)
    return MISSED if missed else 0


@contextmanager
def _interruptible(options: argparse.Namespace) -> Iterator[None]:
    """On Ctrl-C or SIGTERM, remove unfinished output and end the process."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, _: Any) -> None:
        for each in before:
            signal.signal(each, signal.SIG_IGN)
        if options.run is _explore and number == signal.SIGINT:
            os._exit(0)  # Ctrl-C is the normal way to stop the server
        if undo_all():
            word = "interrupted" if number == signal.SIGINT else "terminated"
            with suppress(OSError):
                os.write(2, f"fem-impact: {word}; {_kept(options)}\n".encode())
            os._exit(128 + number)

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _kept(options: argparse.Namespace) -> str:
    """Say what an interrupted command left on disk."""
    if options.run not in (_map, _spread):
        return "nothing was written"
    if options.store is None:
        return "nothing was written; --store DIR keeps finished cells"
    return f"finished cells are in {options.store}; run the same command again to continue"


def _forget_output() -> None:
    """Discard pending output: Python would otherwise write it again at exit and report the same error twice."""
    if sys.stdout is not None:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _place(text: str) -> Path:
    """A path given on the command line."""
    from ._base import check  # imports numpy, which --help and --version do not need

    try:
        return check.path("it", text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _prepare(environment: MutableMapping[str, str], once: bool) -> bool:
    """Set the environment variables that numpy and numba read on import, unless the user has set them.

    Until the kernels are compiled, a command that strikes once runs in plain Python; returns whether this one does.
    """
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        # The dense matrices are small: on two busy cores, two threads took 18 s and one thread 4 s.
        environment.setdefault(name, "1")
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # users need not read about fonts or cache folders
    if "numba" in sys.modules:
        return False
    from .impact.compiled import places

    kernels = Path(str(fi.__file__)).parent / "impact" / "compiled"
    cache = places.find(environment, kernels)
    if not once or "NUMBA_DISABLE_JIT" in environment:
        return False
    source = max(file.stat().st_mtime for file in kernels.glob("*.py"))
    if any(file.stat().st_mtime >= source for file in cache.rglob("energy.follow-*.nbi")):
        return False
    # A single strike takes 0.3 to 1 s in plain Python; compiling takes 15 to 30 s, and `doctor` does it once.
    environment["NUMBA_DISABLE_JIT"] = "1"
    return True


def _complain(error: object, status: int) -> int:
    with suppress(OSError):  # if stderr is closed, the exit status must suffice
        print(f"fem-impact: {_printable(str(error))}", file=sys.stderr, flush=True)
    return status


def _printable(text: str) -> str:
    """The text on one line, with control characters escaped."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))


class _Parser(argparse.ArgumentParser):
    """Reports a bad command in one line and suggests the nearest valid word."""

    given: Sequence[str] = ()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        self.given = sys.argv[1:] if args is None else args
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        found = re.findall(r"(?:invalid choice: '|unrecognized arguments: )([^' ]+)", message)
        verbs = [action.choices for action in self._actions if isinstance(action.choices, dict)]
        parsers = [self, *(verb for choices in verbs for verb in choices.values())]
        known = [word for each in parsers for action in each._actions for word in action.option_strings]
        known += [word for action in self._actions for word in action.choices or ()]
        if "required" in message:  # perhaps the option was given but misspelled
            words = [word.partition("=")[0] for word in self.given if word.startswith("--")]
            found = [word for word in words if word not in known]
        close = difflib.get_close_matches(found[0], known, n=1) if found else []
        verb = "".join(f" {word}" for choices in verbs for word in self.given[:1] if word in choices)
        hint = f"did you mean {close[0]}?" if close else f"see {self.prog}{verb} --help"
        sys.exit(_complain(f"{message:.300}; {hint}", BAD_INPUT))


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="fem-impact", description="Strike anything thin with anything, and know how far to trust the answer."
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    verbs = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def verb(run: Any, name: str, help: str, scene: str = "a TOML file", called: str = "SCENE") -> Any:
        """Add a command and return the function that adds its arguments."""
        made = verbs.add_parser(name, help=help)
        made.set_defaults(run=run)
        if scene:
            made.add_argument("scene", metavar=called, type=_place, help=scene)
        return made.add_argument

    add = verb(
        _strike, "strike", "strike a scene; write force, spectrum, modes and sound",
        scene="a TOML file, such as studies/scenes/drumstick.toml",
    )  # fmt: skip
    add("--out", metavar="DIR", type=_place, help="output folder (default: out/NAME-OF-SCENE)")
    _add_choices(add)
    add("--strict", action="store_true", help="fail if the tolerance is missed; otherwise the exit status is 3")
    add("--verify", action="store_true", help="strike again with a finer model and print the differences")
    add("--pictures", action="store_true", help="write 3-D pictures of the mode shapes and the wave, as PNG and GIF")
    add("--vtk", action="store_true", help="write motion.pvd, the motion for ParaView and pyvista")
    add(
        "--listener", metavar=("X", "Y", "Z"), nargs=3, type=float, action="append",
        help="write radiated.wav, the sound the body radiates to this point [m]; Z is the height above its plane; "
        "repeatable; of two also stereo.wav",
    )  # fmt: skip
    _add_format(add)
    add("--duration", metavar="S", type=float, help="length of the sounds [s] (default: by their decay)")
    add("--normalise", action="store_true", help="scale each sound to a peak of 1.0")
    add("--json", action="store_true", help="print the contents of response.json instead of the summary")

    add = verb(_plan, "plan", "show the model, its reasons, expected errors and cost, without striking")
    _add_choices(add)
    add("--json", action="store_true", help="print the plan as JSON")

    add = verb(_modes, "modes", "list the modes of the struck body; write their shapes")
    add("--count", metavar="N", type=int, default=12, help="how many modes (default: 12)")
    add("--vtk", metavar="FILE", type=_place, help="write the shapes to a .pvd or .vtu file")
    add("--json", action="store_true", help="print the numbers as JSON")

    add = verb(
        _map, "map", "strike a scene on the grid of its table [map]; write numbers, borders and pictures",
        scene="a TOML file, such as studies/scenes/drumstick_map.toml",
    )  # fmt: skip
    add(
        "--out", metavar="DIR", type=_place,
        help="folder for map.nc, CSV files and, for two axes, a PNG of each layer (default: out/NAME-OF-SCENE)",
    )  # fmt: skip
    add("--tolerance", metavar="T", type=float, help="largest accepted error; overrides the scene's")
    add(
        "--format", choices=("nc", "zarr", *FORMATS), action="append", default=[],
        help="format of the numbers, nc or zarr, or of the pictures, png, pdf or svg; repeatable (default: nc and png)",
    )  # fmt: skip
    add("--workers", metavar="N", type=int, help="number of threads (default: one per core)")
    add("--cluster", metavar="ADDRESS", help="run on the Dask cluster whose scheduler has this address")
    add("--store", metavar="DIR", type=_place, help="keep finished cells there; an interrupted run continues from them")
    add("--max-cells", metavar="N", type=float, default=1e8, help="refuse maps with more cells (default: 1e8)")
    add(
        "--cells", metavar="N", type=int,
        help="values along an axis whose range has no count (default: 400, or 100 if each cell must be struck alone)",
    )  # fmt: skip
    add(
        "--borders",
        action="store_true",
        help="locate where the number of impacts changes, also if all counts are given",
    )
    add(
        "--every-cell", action="store_true",
        help="compute all cells; by default, a map without counts that would take more than a second is computed where "
        "its answer changes and interpolated elsewhere, to within the tolerance",
    )  # fmt: skip

    add = verb(_spread, "spread", "strike a scene with uncertain inputs; tell how the answer is distributed, and why")
    add("--vary", metavar="INPUT=DISTRIBUTION", action="append", default=[], required=True,
        help='an uncertain number, such as "contact.stiffness=lognormal(695e3, 0.1)"; repeatable; also normal(mean, '
        "deviation), uniform(low, high), loguniform(low, high), triangular(low, mode, high)")  # fmt: skip
    add("--correlate", metavar="INPUT,INPUT=R", action="append", default=[], help="correlation of two; repeatable")
    add("--blows", metavar="N", type=int, default=10_000, help="number of blows (default: 10000)")
    add("--no-sobol", action="store_true", help="no Sobol indices: all blows go into the distributions")
    add("--seed", metavar="N", type=int, default=0, help="of the scrambled points (default: 0)")
    add("--tolerance", metavar="T", type=float, help="largest accepted error; overrides the scene's")
    add("--max-frequency", metavar="HZ", type=float, help="add the spectral centroid up to this frequency (slow)")
    add("--workers", metavar="N", type=int, help="number of threads (default: one per core)")
    add("--cluster", metavar="ADDRESS", help="run on the Dask cluster whose scheduler has this address")
    add("--store", metavar="DIR", type=_place, help="keep finished blows there; an interrupted run continues from them")
    add("--out", metavar="DIR", type=_place, help="folder for spread.json, .nc, .csv and .png (default: out/NAME)")
    _add_format(add)
    add("--json", action="store_true", help="print the contents of spread.json instead of the summary")

    add = verb(
        _hammer, "hammer", "find the hammers that reach a bandwidth without a double hit",
        scene="a TOML file; its body and strike point are used",
    )  # fmt: skip
    add("--bandwidth", metavar="F", type=float, required=True, help="bandwidth to reach [Hz]")
    add(
        "--drop", metavar="D", type=float, default=10.0,
        help="how far the spectrum may fall within the bandwidth [dB] (default: 10)",
    )  # fmt: skip
    add("--masses", metavar="KG", type=float, nargs="+", help="masses of the hammers [kg] (default: 1 g to 1 kg)")
    add(
        "--rove", metavar="N", type=int,
        help="plan a test of about N points over the body, the sensor at the strike point; --out also writes a CSV",
    )  # fmt: skip
    add("--out", metavar="FILE", type=_place, help="write a picture to this file: .png, .pdf or .svg")
    _add_format(add, None)
    add("--json", action="store_true", help="print the numbers as JSON")

    add = verb(
        _report, "report", "strike a scene; write one HTML page with everything about the blow",
        scene="a TOML file, or a folder written by `strike`", called="SCENE|RESULT",
    )  # fmt: skip
    add("--out", metavar="FILE", type=_place, help="the page to write (default: out/NAME/report.html)")
    add("--tolerance", metavar="T", type=float, help="largest accepted error; overrides the scene's")

    add = verb(_explore, "explore", "serve a page on this machine where sliders and clicks change the blow")
    add("--port", metavar="N", type=int, default=0, help="port on 127.0.0.1 (default: any free port)")
    add("--no-open", action="store_true", help="print the address, but do not open it in a browser")

    add = verb(_play, "play", "strike a scene from the keyboard, a MIDI file or a MIDI port, and hear it at once")
    add("--midi", metavar="FILE", type=_place, help="play the notes of a MIDI file: middle C is the first point")
    add("--port", metavar="NAME", nargs="?", const="", help="play from the MIDI input whose name begins so")
    add("--at", metavar="X", nargs="+", type=float, action="append", help="a point to strike [m]; repeatable "
        "(default: ten points, the scene's and others over the whole body)")  # fmt: skip
    add("--modes", metavar="N", type=int, default=300, help="number of modes (default: 300)")
    add("--fastest", metavar="V", type=float, help="speed of the loudest stroke [m/s] (default: twice the scene's)")
    add("--duration", metavar="S", type=float, default=600.0, help="when to end at the latest [s] (default: 600)")
    add("--block", metavar="N", type=int, default=64, help="frames computed at a time, of 48000 a second (default: 64)")
    add("--silent", action="store_true", help="play into the file only, and count the deadlines that would be missed")
    add("--out", metavar="FILE", type=_place, help="the sound as a .wav file (default: out/NAME/play.wav)")

    add = verb(_new, "new", "write a commented scene to begin with", scene="")
    add("kind", metavar="KIND", nargs="?", default="plate", help="plate, disk, beam or map (default: plate)")
    add("--out", metavar="FILE", type=_place, help="the file to write (default: KIND.toml)")

    add = verb(
        _mesh, "mesh", "list the edges, sizes and units of a mesh, drawing or scene before supports are written",
        scene="a mesh file, an .svg or .dxf drawing, or a scene, a .toml file", called="FILE",
    )  # fmt: skip
    add("--unit", metavar="U", help="unit of the numbers in the file: m, cm, mm, um, in or km (default: the file's)")
    add("--out", metavar="FILE", type=_place, help="draw elements and named edges to this file: .png, .pdf or .svg")
    _add_format(add, None)

    verb(_schema, "schema", "print a JSON schema of scenes, by which editors complete and check them", scene="")

    verb(_doctor, "doctor", "check this installation and suggest a remedy for each failure", scene="")

    add = verb(
        lambda options: print(_completion(parser, options.shell)), "completion",
        "print a script that completes commands; eval it in ~/.bashrc", scene="",
    )  # fmt: skip
    add("shell", choices=("bash", "zsh", "tcsh"), nargs="?", default="bash", help="default: bash")
    _add_taps(verb)
    return parser


def _add_format(add: Any, default: str | None = FORMATS[0]) -> None:
    """Add the option that sets the format of all pictures; without a default, the ending of --out sets it."""
    said = "by the ending of --out" if default is None else default
    add("--format", choices=FORMATS, default=default, help=f"format of the pictures (default: {said})")


def _drawn(options: argparse.Namespace) -> Path | None:
    """The picture to write, with the ending of the format asked for."""
    named = options.out is not None and options.format is not None
    return options.out.with_suffix(f".{options.format}") if named else options.out


def _add_choices(add: Any) -> None:
    """Add the options that choose the model."""
    add("--tolerance", metavar="T", type=float, help="largest accepted error; overrides the scene's")
    add(
        "--quantity", metavar="Q", action="append",
        help="what the tolerance is for; repeatable: restitution, contact_time, force ..., spectrum=5000 (up to 5 kHz)",
    )  # fmt: skip
    add(
        "--target",
        metavar="KIND",
        help="treat the struck body as rigid, infinite, by vectors, mixed or modal, whatever the plan chooses",
    )
    add("--n-modes", metavar="N", type=int, help="number of modes to keep for the struck body")
    add("--size", metavar="H", type=float, help="element size [m]")


def _choices(options: argparse.Namespace) -> dict[str, Any]:
    names = ("tolerance", "quantity", "target", "n_modes", "size")
    return {name: getattr(options, name) for name in names if getattr(options, name) is not None}


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        print(f"fem-impact {fi.__version__}")
        parser.exit()


def _strike(options: argparse.Namespace) -> bool:
    """Strike and write; returns whether the tolerance was missed."""
    from .impact import promise  # imported only when needed
    from .model.target import Stages
    from .show.painter import Painter

    began = time.perf_counter()
    scene = fi.load_scene(options.scene)
    if options.listener is not None:
        scene = scene.heard_from(*options.listener)
    if scene.stroke:
        return _strike_in_turn(options, scene)
    folder = options.out if options.out is not None else Path("out") / options.scene.stem
    display = Display(_tell)
    with fi.export.staged(folder, "strike") as staging, Painter() if options.pictures else nullcontext() as painter:
        place = folder.resolve()  # "." has no name of its own
        keep = place.parent / f"{place.name}.modes.npz"  # not in the folder: an interrupted run leaves that alone
        motion, before = options.pictures or options.vtk, partial(_announce, display, options.verify)
        run = scene.run(display, before=before, verify=options.verify, motion=motion, keep=keep, **_choices(options))
        display.predict(None)
        if options.strict:
            promise.kept(run.response, strict=True)
        stages = Stages(display)
        data = _write(staging, scene, run, options, stages, painter)
    keep.unlink(missing_ok=True)
    seconds = {**run.seconds, **stages.seconds, "total": time.perf_counter() - began}
    missed = not run.response.tolerance_met
    if options.json:
        _print_json(data)
        return missed
    _say(_title(scene), run.response.summary())
    if not run.rings:
        _say(f"Model: {run.plan.reasons[0]}; no modes and no sound (use --target modal or --quantity sound=5000)")
    if run.verified is not None and run.finer is not None:
        coarse = run.finer.target in ("rigid", "infinite")
        tested = f" (which also treats the body as {run.finer.target}: it has too many modes)" if coarse else ""
        differences = ", ".join(f"{name} {value:.1e}" for name, value in run.verified.items())
        _say(f"Verified by a finer run{tested}: {differences}")
    _say_sounds(data.get("sounds", ()))
    _say("Time: " + ", ".join(f"{name} {value:.2f} s" for name, value in seconds.items()))
    _say(f"Files in {folder}{os.sep}: {', '.join(data['files'])}")
    return missed


def _announce(display: Display, verify: bool, plan: Any) -> None:
    """Warn of a long run before it starts, and let its prediction tell the time left."""
    display.predict(None if verify else plan.seconds)  # the plan of the second, finer run is not known yet
    if plan.costly:
        text = f"{plan.cost}; Ctrl-C stops it, and the same command later reuses the modes already found"
        _tell(f"{text} (`fem-impact plan` explains why)")


def _write(
    folder: Path, scene: Any, run: Any, options: argparse.Namespace, stages: Any, painter: Any
) -> dict[str, Any]:
    """Write every file of a strike; return the contents of response.json."""
    from .scenes import hearing  # imported only when needed
    from .show import sampling
    from .show.canvas import NAMES

    response, files = run.response, ["response.json", "force.csv", f"force.{options.format}"]
    extra: dict[str, Any] = {}
    if run.plan.target == "vectors" and response.ringing is None:
        with stages("modes"):
            response = response.on(response.target)
    drawn = painter is not None and run.rings
    if drawn:
        painter.begin(folder, response, options.format)
    with stages("files"):
        fi.export.write_force(folder / "force.csv", response)
        fi.figures.save(folder / f"force.{options.format}", fi.figures.force(response))
    if run.rings:
        with stages("files"):
            fi.export.write_vtk(folder / "modes.pvd", response.target.truncated(n_modes=SHAPES_WRITTEN))
        with stages("sound"):
            sounds = hearing.write(folder, scene, response, duration=options.duration, normalise=options.normalise)
        first = {"at": "sound", "listener": "radiated"}  # the keys of the first point and listener
        for heard in reversed(sounds):
            extra.update({first[name]: heard for name in first if name in heard})
        extra["sounds"] = sounds
        files += ["modes.pvd", *(heard["file"] for heard in sounds)]
        if options.vtk:
            end = sampling.end_of(response)
            times = [end * i / (MOTION_TIMES - 1) for i in range(MOTION_TIMES)]
            with stages("motion"):
                fi.export.write_vtk(folder / "motion.pvd", response.target, response, times)
            files.append("motion.pvd")
        if drawn:
            with stages("pictures"):
                missing = painter.finish()
            if missing:
                _tell(f"pictures are drawn in two dimensions; {missing}")
            files += [*(f"{name}.{options.format}" for name in NAMES), "wave.gif"]
    if run.verified is not None:
        extra["verified"] = run.verified
    changes = {name: value for name, value in run.plan.changes.items() if name in ("tolerance", "quantity")}
    tables, copies = scene.kept(folder, **changes)
    files += copies
    data = fi.export.run_data(run, tables) | fi.export.plain({**extra, "files": files})
    fi.export.write_json(folder / "response.json", data)
    return data


def _strike_in_turn(options: argparse.Namespace, scene: Any) -> bool:
    """Play the strokes of a scene and write what they did; returns whether the tolerance was missed."""
    from .model.target import Stages  # imported only when needed
    from .scenes import hearing, sequence

    given = {"verify": options.verify, "pictures": options.pictures, "vtk": options.vtk, "target": options.target}
    wrong = next((name for name, value in given.items() if value), None)
    if wrong:
        raise ValueError(f"--{wrong} must be left out for a scene with strokes")
    began = time.perf_counter()
    folder = options.out if options.out is not None else Path("out") / options.scene.stem
    display = Display()
    with fi.export.staged(folder, "strike") as staging, warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)  # the first line of the summary says it
        stages = Stages(display)
        found = scene.play(watch=display, strict=options.strict, **_choices(options))
        with stages("files"):
            fi.export.write_force(staging / "force.csv", found)
            fi.figures.save(staging / f"force.{options.format}", fi.figures.force(found))
            fi.export.write_vtk(staging / "modes.pvd", found.target.truncated(n_modes=SHAPES_WRITTEN))
        with stages("sound"):
            sounds = hearing.write(staging, scene, found, duration=options.duration, normalise=options.normalise)
        tables, copies = scene.kept(staging, tolerance=found.tolerance)
        pictures = [f"force.{options.format}"]
        names = ["response.json", "force.csv", *pictures, "modes.pvd", *(each["file"] for each in sounds), *copies]
        seconds = {**stages.seconds, "total": time.perf_counter() - began}
        data = {**sequence.numbers(found, tables, seconds), "sounds": sounds, "files": names}
        fi.export.write_json(staging / "response.json", data)
    if options.json:
        _print_json(data)
    else:
        _say(_title(scene), found.summary())
        _say_sounds(sounds)
        _say(f"Time: {seconds['total']:.2f} s", f"Files in {folder}{os.sep}: {', '.join(names)}")
    return not found.tolerance_met


def _say_sounds(sounds: Sequence[dict[str, Any]]) -> None:
    for heard in sounds:
        where = "Point" if "at" in heard else "Listener" if "listener" in heard else "Both listeners"
        if heard.get("bound") == "low":  # the other one's line tells both
            continue
        level = heard["stated"] if "bound" in heard else f"peak {heard['stated']}"
        level = "silence" if heard["level"] is None or heard["level"] == -math.inf else level
        other = f"{heard['file'].replace('_high', '_low')} and " if "bound" in heard else ""
        _say(f"{where}: {level}; 1.0 in {other}{heard['file']} is {heard['full_scale']:.4g} {heard['unit']}")


def _plan(options: argparse.Namespace) -> None:
    scene = fi.load_scene(options.scene)
    plan = (scene.plan_strokes if scene.stroke else scene.plan)(watch=Display(), **_choices(options))
    if options.json:
        _print_json({**plan.data(), "versions": fi.export.versions()})
        return
    _say(_title(scene), str(plan))


def _map(options: argparse.Namespace) -> None:
    from .scenes import maps  # imported only when needed

    began = time.perf_counter()
    chosen = {word in FORMATS: word for word in options.format}  # of pictures and of numbers
    form, picture = maps.can_write(chosen.get(False, "nc"), options.out), chosen.get(True, FORMATS[0])
    scene = fi.load_scene(options.scene)
    folder = options.out if options.out is not None else Path("out") / options.scene.stem
    with fi.export.staged(folder, "map") as staging:
        display = Display()
        with display("cells"):
            table = maps.map_scene(
                scene, tolerance=options.tolerance, workers=options.workers, client=options.cluster,
                store=options.store, watch=partial(display.report, "cells"), max_cells=options.max_cells, tell=_tell,
                stage=display, cells=options.cells, borders=True if options.borders else None,
                refine=False if options.every_cell else None,
            )  # fmt: skip
        with display("files"):
            names = maps.write(staging, table, form, picture)
    axes = ", ".join(f"{name} ({size})" for name, size in table.n_impacts.sizes.items())
    single, failed = int((table.n_impacts == 1).sum()), int((table.n_impacts < 0).sum())
    _say(_title(scene), f"{table.n_impacts.size} blows over {axes}: {single} hit once, {failed} failed")
    for name in ("cells", "borders"):
        if name in table.attrs:
            _say(f"{name.capitalize()}: {table.attrs[name]}")
    if "model_error" in table:
        own, unknown = table.model_error, table.model_error.attrs["not_known"]
        not_known = f", not counting what is not known ({unknown})" if unknown else ""
        _say(f"Model: its own error is {float(own.min()):.1g} to {float(own.max()):.1g}{not_known}")
    _print_notes(table.attrs["notes"].splitlines())
    _say(f"Time: {time.perf_counter() - began:.2f} s", f"Files in {folder}{os.sep}: {', '.join(names)}")


def _spread(options: argparse.Namespace) -> None:
    from .scenes import uncertainty  # imported only when needed

    began = time.perf_counter()
    folder = options.out if options.out is not None else Path("out") / options.scene.stem
    scene = fi.load_scene(options.scene)
    vary = dict(_split("--vary", text) for text in options.vary)
    pairs = [_split("--correlate", text) for text in options.correlate]
    try:
        correlation = {tuple(name.strip() for name in names.split(",")): float(value) for names, value in pairs}
    except ValueError:
        raise ValueError("--correlate must look like contact.stiffness,striker.mass=0.5") from None
    with fi.export.staged(folder, "spread") as staging:
        display = Display()
        with display("blows"):
            found = uncertainty.spread(
                scene, vary, n=options.blows, correlation=correlation or None, seed=options.seed,
                sobol=False if options.no_sobol else None, tolerance=options.tolerance,
                max_frequency=options.max_frequency, workers=options.workers, client=options.cluster,
                store=options.store, watch=partial(display.report, "blows"),
            )  # fmt: skip
        with display("files"):
            names = uncertainty.write(staging, found, options.format)
    if options.json:
        _print_json({**found.data(), "versions": fi.export.versions()})
        return
    _say(_title(scene))
    print(found.summary())
    _say(f"Time: {time.perf_counter() - began:.2f} s", f"Files in {folder}{os.sep}: {', '.join(names)}")


def _split(option: str, text: str) -> tuple[str, str]:
    """What stands before and after the equals sign of an option."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise ValueError(f"{option} must have a name, an equals sign and a value, got {text!r:.100}")
    return name.strip(), value.strip()


def _hammer(options: argparse.Namespace) -> None:
    from .scenes import maps  # imported only when needed
    from .show import plots  # imported only when needed

    scene = fi.load_scene(options.scene)
    drawn = _drawn(options)
    masses = options.masses or [m * 10.0**e for e in (-3, -2, -1) for m in (1.0, 2.0, 5.0)] + [1.0]
    if options.rove is not None:
        _rove(options, scene, masses, drawn)
        return
    with Display(_tell)("hammers"):
        hammers = maps.hammers_for(scene, options.bandwidth, masses, drop=options.drop)
        if drawn is not None:
            drawn.parent.mkdir(parents=True, exist_ok=True)
            fi.figures.save(drawn, plots.hammers(hammers, options.bandwidth, options.drop))
    if options.json:
        data = {"bandwidth": options.bandwidth, "drop": options.drop, "hammers": [hammer.data() for hammer in hammers]}
        _print_json({**data, "versions": fi.export.versions()})
        return
    _say(_title(scene))
    _say(f"Tips that reach {options.bandwidth:g} Hz (spectrum at most {options.drop:g} dB down) and hit once:")
    _print_notes(hammers[0].notes)
    rows = [
        (
            f"{1e3 * hammer.mass:.4g} g",
            f"{hammer.softest:.3g} N/m" if hammer.softest else "none",
            f"{'> ' * hammer.unlimited}{hammer.hardest:.3g} N/m" if hammer.hardest else "none",
            f"{hammer.reach:.4g} Hz" if hammer.reach else "-",
        )
        for hammer in hammers
    ]
    _print_table(rows, ("mass", "softest tip", "hardest tip", "its reach"))
    for hammer in hammers:
        if len(hammer.working) > 1:
            ranges = ", ".join(f"{low:.3g} to {high:.3g} N/m" for low, high in hammer.working)
            _say(f"{1e3 * hammer.mass:.4g} g: every range that works: {ranges}")
    if any(hammer.unlimited for hammer in hammers):
        _say(">: no limit up to this tip, the hardest for which the model of the body is made")
    idle = ", ".join(f"{1e3 * hammer.mass:.4g} g" for hammer in hammers if not hammer.works)
    if idle:
        _say(f"{idle}: no tip reaches {options.bandwidth:g} Hz and hits once; try lighter hammers")
    if drawn is not None:
        _say(f"Files: {drawn}")


def _rove(options: argparse.Namespace, scene: Any, masses: Sequence[float], drawn: Path | None) -> None:
    """Plan a test with a roving hammer."""
    from ._base import check  # imported only when needed
    from .taps import roving

    number = check.count("--rove", options.rove)
    with Display(_tell)("points"):
        plan = roving.of_scene(scene, masses, options.bandwidth, options.drop, number)
        if drawn is not None:
            with fi.export.staged(drawn.parent) as staging:
                fi.figures.save(staging / drawn.name, plan.figure())
                plan.write_csv((staging / drawn.name).with_suffix(".csv"))
    if options.json:
        data = {"table": plan.table(), "verdicts": plan.verdicts, "resolution": plan.resolution}
        _print_json({**data, "versions": fi.export.versions()})
        return
    _say(_title(scene), *plan.summary().splitlines())
    if drawn is not None:
        _say(f"Files: {drawn}, {drawn.with_suffix('.csv')}")


def _report(options: argparse.Namespace) -> bool:
    scene = fi.report.read(options.scene)
    path = options.out if options.out is not None else Path("out") / options.scene.stem / "report.html"
    changes = {} if options.tolerance is None else {"tolerance": options.tolerance}
    with fi.export.staged(path.parent) as staging:
        display = Display(_tell)
        before = partial(_announce, display, False)
        if scene.stroke:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", fi.ToleranceWarning)  # the first line of the summary says it
                run: Any = scene.run_strokes(display, before=before, **changes)
        else:
            run = scene.run(display, before=before, motion=True, **changes)
        display.predict(None)
        with display("page"):
            fi.report.write(staging / path.name, scene, run)
    _say(_title(scene), run.response.summary(), f"Files: {path}")
    return not run.response.tolerance_met


def _explore(options: argparse.Namespace) -> None:
    scene = fi.load_scene(options.scene)

    def ready(address: str) -> None:
        print(f"{address}   (Ctrl-C stops it)", flush=True)
        if not options.no_open:
            webbrowser.open(address)

    fi.explore.serve(scene, port=options.port, ready=ready, watch=Display())


def _play(options: argparse.Namespace) -> None:
    from .live import command, devices  # imported only when needed

    scene = fi.load_scene(options.scene)
    path = options.out if options.out is not None else Path("out") / options.scene.stem / "play.wav"
    with fi.export.staged(path.parent) as staging:
        with Display()("modes"):
            modes = scene.modes(options.modes)
        with Display()("preparing, and compiling if not yet done"):
            player = command.player_of(scene, modes, options)
        with command.source_of(options, player) as (source, told):
            device, missing = command.device_of(options, source.live)
            if missing:
                _tell(missing)
            _tell(told)
            played = devices.perform(player, source, options.duration, device)
        (staging / path.name).write_bytes(played.sound.wav())
    _say(_title(scene))
    _print_notes(modes.notes)
    happened = ", ".join(f"{count} {name}" for name, count in player.counted.items())
    _say(f"Played: {happened} of at most {1e6 * player.step:.3g} us, {modes.n_modes} modes")
    _say(
        f"Blocks: {len(played.seconds)} of {1e3 * player.block / player.rate:.3g} ms; the 99th percentile of their "
        f"computing time is {1e3 * played.slowest:.3g} ms; {played.missed} missed their deadline"
    )
    _say(f"Files: {path}")


def _modes(options: argparse.Namespace) -> None:
    scene = fi.load_scene(options.scene)
    if options.vtk is None:
        with Display()("modes"):
            modes = scene.modes(options.count)
    else:
        fi.export.vtk_ending(options.vtk)
        with fi.export.staged(options.vtk.parent) as staging:  # a bad folder fails before the work, not after it
            with Display()("modes"):
                modes = scene.modes(options.count)
            fi.export.write_vtk(staging / options.vtk.name, modes)
    if options.json:
        data = {"frequencies": modes.frequencies, "damping_ratios": modes.damping_ratio, "mass": modes.mass}
        _print_json({**data, "notes": list(modes.notes), "versions": fi.export.versions()})
        return
    _say(_title(scene))
    _print_notes(modes.notes)
    rows = [
        (i, f"{frequency:.5g} Hz", f"{ratio:.3g}")
        for i, (frequency, ratio) in enumerate(zip(modes.frequencies, modes.damping_ratio), 1)
    ]
    _print_table(rows, ("mode", "frequency", "damping ratio"))
    if options.vtk is not None:
        _say(f"Files: {options.vtk}")


def _new(options: argparse.Namespace) -> None:
    from .scenes import templates  # imported only when needed

    path = options.out if options.out is not None else Path(f"{options.kind}.toml")
    templates.write(path, options.kind)
    verb = "map" if options.kind == "map" else "strike"
    _say(f"Files: {path}", f"Next: fem-impact {verb} {path}")


def _mesh(options: argparse.Namespace) -> None:
    from .mesh import edge_table  # imported only when needed

    drawn = _drawn(options)
    ending = options.scene.suffix.lower()
    with Display()("mesh"):
        if ending == ".toml":
            if options.unit is not None:
                raise ValueError("--unit must be left out for a scene, which states it")
            mesh = fi.load_scene(options.scene).body()
        else:
            read = fi.mesh.outline if ending in (".svg", ".dxf") else fi.mesh.load
            mesh = read(options.scene, unit=options.unit)
        if drawn is not None:
            drawn.parent.mkdir(parents=True, exist_ok=True)
            fi.figures.save(drawn, fi.figures.edges(mesh))
    _say(str(options.scene))
    _print_notes(mesh.notes)
    _print_table(edge_table.rows(mesh))
    print()
    rows = [
        (edge.name, f"{edge.length:.4g} m", edge.n_facets, "curved" if edge.curved else "straight",
         f"({', '.join(f'{x:.4g}' for x in edge.middle)}) m", ", ".join(edge.twins) or "-")
        for edge in edge_table.edges(mesh)
    ]  # fmt: skip
    _print_table(rows, ("edge", "length", "facets", "form", "half way at", "the same as"))
    if drawn is not None:
        _say(f"Files: {drawn}")


def _schema(options: argparse.Namespace) -> None:
    from .scenes import editor_schema  # imported only when needed

    _print_json(editor_schema.schema())


def _doctor(options: argparse.Namespace) -> None:
    from . import doctor  # imported only when needed

    _print_table(list(fi.export.versions().items()))
    with Display()("checking, and compiling if not yet done"):
        findings = doctor.examine()
    for finding in findings:
        state = "works" if finding.works else "fails" if finding.vital else "missing"
        _say(f"{finding.name:<22} {state:<8} {finding.seconds:5.2f} s  {finding.remedy}".rstrip())
    failed = [finding.name for finding in findings if finding.vital and not finding.works]
    if failed:
        raise fi.SimulationError(f"{', '.join(failed)}: not working; see above")


def _completion(parser: argparse.ArgumentParser, shell: str) -> str:
    """A script that completes commands, options and file names."""
    from ._base import check  # imports numpy, which --help and --version do not need

    shtab = check.extra("shtab", "completion", "completion")
    (verbs,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    for action in (action for verb in verbs.choices.values() for action in verb._actions):
        if action.type is _place:
            action.complete = shtab.FILE
    return shtab.complete(parser, shell)


def _title(scene: Any) -> str:
    return scene.title or str(scene.path)


def _say(*texts: str) -> None:
    """Print texts wrapped to the width of the terminal."""
    for text in texts:
        print(_wrapped(text))


def _tell(text: str) -> None:
    """Print one sentence to stderr."""
    print(_wrapped(f"fem-impact: {text}"), file=sys.stderr, flush=True)


def _print_table(rows: Sequence[Sequence[Any]], head: Sequence[str] = ()) -> None:
    from ._base import markup  # imports numpy, which --help and --version do not need

    print(*markup.columns(rows, head), sep="\n")


def _print_json(data: dict[str, Any]) -> None:
    print(json.dumps(fi.export.plain(data), indent=2, allow_nan=False))


def _print_notes(notes: Sequence[str]) -> None:
    for note in notes:
        print(_wrapped(f"Note: {note}"))


def _wrapped(text: str) -> str:
    """Wrap text to the width of the terminal and indent continued lines."""
    width = max(20, min(WIDEST, shutil.get_terminal_size().columns))
    filled = textwrap.TextWrapper(width, subsequent_indent="    ", break_on_hyphens=False)  # keeps paths whole
    lines = (filled.wrap(line) or [""] for line in text.splitlines())
    return "\n".join(line for wrapped in lines for line in wrapped)


def _add_taps(verb: Any) -> None:
    """Add the commands for measured taps."""
    files = "measured taps: .lvm, .csv, .npz, .wav, .mat or .uff"
    add = verb(_frf, "frf", "frequency responses of taps, or of a scene as a rig would measure it",
               scene=f"{files} or frequency responses; or a scene, a TOML file", called="TAPS|SCENE")  # fmt: skip
    _add_channels(add)
    add("--method", choices=("H1", "H2"), default="H1", help="H1 for noise in the response, H2 in the force")
    add("--force-window", metavar="S", type=float, help="the force counts for this time after the onset only")
    add("--response-window", metavar="S", type=float, help="time constant of an exponential window")
    add("--out", metavar="FILE", type=_place, help="write them to a .csv or .uff file")

    add = verb(_fit, "fit", "find the hammer and the contact that explain measured taps", scene=files, called="TAPS")
    add("body", metavar="SCENE", type=_place, nargs="?", help="the scene struck (default: a wall)")
    _add_channels(add)
    add("--unknown", metavar="NAME=LOW:HIGH", action="append", default=[],
        help="a number to find in a range; repeatable (default: stiffness, exponent, loss of the contact)")  # fmt: skip
    add("--known", metavar="NAME=VALUE", action="append", default=[], help="a number to hold; repeatable")
    add("--per-tap", metavar="NAME", action="append", default=[],
        help="an unknown that every tap gets its own value of, as no spot is struck twice; repeatable")  # fmt: skip
    add("--mass", metavar="KG", type=float, help="mass of the hammer (default: the scene's, or 0.1)")
    add("--out", metavar="DIR", type=_place, help="folder for fit.html, fit.json and scene.toml (default: out/NAME)")
    add("--json", action="store_true", help="print the contents of fit.json instead of the summary")


def _add_channels(add: Any) -> None:
    """Add the options that say what a file of taps holds."""
    add("--force", metavar="NAME", help="name or number of the force channel (default: by its unit or name)")
    add("--response", metavar="NAME", action="append", help="name or number of a response; repeatable")
    add("--rate", metavar="HZ", type=float, help="sampling rate, if the file does not state it; of a scene: 51200")
    add("--scale", metavar="N", type=float, help="newtons per unit of the force channel")


def _frf(options: argparse.Namespace) -> None:
    from .taps import prompt  # imported only when needed

    with Display()("frequency responses"):
        found, notes = prompt.frf(options)
    _print_notes(notes)
    _print_table(*prompt.peaks(found))
    if options.out is not None:
        prompt.write_frf(options.out, found)
        _say(f"Files: {options.out}")


def _fit(options: argparse.Namespace) -> None:
    from .pages import fit_page  # imported only when needed
    from .taps import prompt  # imported only when needed

    folder = options.out if options.out is not None else Path("out") / options.scene.stem
    with fi.export.staged(folder, "fit") as staging:
        display = Display()
        with display("fit"):
            found, scene = prompt.fit(options, partial(display.report, "fits"))
        data, files = prompt.write(staging, found, scene)
        with display("page"):
            target, at = (None, None) if scene is None else (scene.modes(), scene.blow.values["at"])
            fit_page.write(staging / "fit.html", found, title=f"Taps of {options.scene.name}", target=target, at=at)
    if options.json:
        _print_json(data)
        return
    _say(*found.summary().splitlines(), f"Files in {folder}{os.sep}: {', '.join(['fit.html', *files])}")


if __name__ == "__main__":
    sys.exit(main())
