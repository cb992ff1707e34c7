"""The command line: parses the arguments, calls the library and prints the results; contains no physics."""

import argparse
import atexit
import difflib
import io
import json
import logging
import os
import re
import shutil
import signal
import sys
import tempfile
import textwrap
import threading
import time
import webbrowser
from collections.abc import Iterator, MutableMapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

import fem_impact as fi

from ._base.files import undo_all, undoable

BAD_INPUT, FAILED, INTERRUPTED = 2, 1, 130  # exit statuses
WIDEST = 88  # [-] columns: printed text is never wider, and narrower on a narrow terminal
MOTION_TIMES = 100  # [-] instants in motion.pvd
SHAPES_WRITTEN = 24  # [-] mode shapes in modes.pvd of a strike; `modes --vtk` writes any number


def main(arguments: list[str] | None = None) -> int:
    """Run one command; the exit status is 0, 2 for bad input, 1 for a run that failed, 130 after Ctrl-C."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(
                errors="backslashreplace"
            )  # a title may contain characters that this terminal cannot show
    options = _parser().parse_args(arguments)
    plain = _prepare(os.environ, once=options.run in (_strike, _modes, _report))
    try:
        with _interruptible(options):
            options.run(options)
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
            again = [sys.executable, "-m", "fem_impact", *(sys.argv[1:] if arguments is None else arguments)]
            os.execve(sys.executable, again, {**os.environ, "NUMBA_DISABLE_JIT": "0"})
        return _complain(error, FAILED)
    except KeyboardInterrupt:
        return _complain(f"interrupted; {_kept(options)}", INTERRUPTED)
    return 0


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
    if options.run is not _map:
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
    package = Path(str(fi.__file__)).parent
    if "numba" not in sys.modules:
        _find_cache(environment, package)
    if not once or "numba" in sys.modules or "NUMBA_DISABLE_JIT" in environment:
        return False
    compiled = package / "impact" / "compiled"
    source = max(file.stat().st_mtime for file in compiled.glob("*.py"))
    kept = (compiled / "__pycache__").glob("energy.run_energy-*.nbi")
    if any(file.stat().st_mtime >= source for file in kept):
        return False
    # A single strike takes 0.3 to 1 s in plain Python; compiling takes 15 to 30 s, and `doctor` does it once.
    environment["NUMBA_DISABLE_JIT"] = "1"
    return True


def _find_cache(environment: MutableMapping[str, str], package: Path) -> None:
    """Give numba a temporary cache folder if it can write to none of its own: it refuses to work without one."""
    given = environment.get("NUMBA_CACHE_DIR")
    home = environment.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    for place in [given] if given else [str(package / "impact" / "compiled" / "__pycache__"), home]:
        with suppress(OSError):
            os.makedirs(place, exist_ok=True)
            tempfile.TemporaryFile(dir=place).close()
            return
    environment["NUMBA_CACHE_DIR"] = folder = tempfile.mkdtemp(prefix="fem-impact-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)


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
        hint = f"did you mean {close[0]}?" if close else f"see {self.prog} --help"
        sys.exit(_complain(f"{message:.300}; {hint}", BAD_INPUT))


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="fem-impact", description="Strike anything thin with anything, and know how far to trust the answer."
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    verbs = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    strike = verbs.add_parser("strike", help="strike a scene; write force, spectrum, modes and sound")
    strike.set_defaults(run=_strike)
    strike.add_argument(
        "scene", metavar="SCENE", type=_place, help="a TOML file, such as studies/scenes/drumstick.toml"
    )
    strike.add_argument("--out", metavar="DIR", type=_place, help="output folder (default: out/NAME-OF-SCENE)")
    _add_choices(strike)
    strike.add_argument(
        "--verify", action="store_true", help="strike again with a finer model and print the differences"
    )
    strike.add_argument(
        "--pictures", action="store_true", help="write 3-D pictures of the mode shapes and the wave, as PNG and GIF"
    )
    strike.add_argument("--vtk", action="store_true", help="write motion.pvd, the motion for ParaView and pyvista")
    strike.add_argument(
        "--listener", metavar=("X", "Y", "Z"), nargs=3, type=float,
        help="write radiated.wav, the sound the plate radiates to this point [m]; Z is the height above the plate",
    )  # fmt: skip
    strike.add_argument(
        "--duration", metavar="S", type=float, help="length of the sounds [s] (default: by their decay)"
    )
    strike.add_argument("--normalise", action="store_true", help="scale each sound to a peak of 1.0")
    strike.add_argument(
        "--json", action="store_true", help="print the contents of response.json instead of the summary"
    )

    plan = verbs.add_parser("plan", help="show the model, its reasons, expected errors and cost, without striking")
    plan.set_defaults(run=_plan)
    plan.add_argument("scene", metavar="SCENE", type=_place, help="a TOML file")
    _add_choices(plan)
    plan.add_argument("--json", action="store_true", help="print the plan as JSON")

    modes = verbs.add_parser("modes", help="list the modes of the struck body; write their shapes")
    modes.set_defaults(run=_modes)
    modes.add_argument("scene", metavar="SCENE", type=_place, help="a TOML file")
    modes.add_argument("--count", metavar="N", type=int, default=12, help="how many modes (default: 12)")
    modes.add_argument("--vtk", metavar="FILE", type=_place, help="write the shapes to a .pvd or .vtu file")
    modes.add_argument("--json", action="store_true", help="print the numbers as JSON")

    chart = verbs.add_parser("map", help="strike a scene on the grid of its table [map]; write numbers and pictures")
    chart.set_defaults(run=_map)
    chart.add_argument(
        "scene", metavar="SCENE", type=_place, help="a TOML file, such as studies/scenes/drumstick_map.toml"
    )
    chart.add_argument(
        "--out", metavar="DIR", type=_place,
        help="folder for map.nc, map.csv and, for two axes, a PNG of each layer (default: out/NAME-OF-SCENE)",
    )  # fmt: skip
    chart.add_argument("--tolerance", metavar="T", type=float, help="largest accepted error; overrides the scene's")
    chart.add_argument(
        "--format", choices=("nc", "zarr"), default="nc", help="format of the numbers: map.nc or map.zarr (default: nc)"
    )
    chart.add_argument("--workers", metavar="N", type=int, help="number of threads (default: one per core)")
    chart.add_argument("--cluster", metavar="ADDRESS", help="run on the Dask cluster whose scheduler has this address")
    chart.add_argument(
        "--store",
        metavar="DIR",
        type=_place,
        help="keep finished cells in this folder; an interrupted run continues from it",
    )
    chart.add_argument(
        "--max-cells", metavar="N", type=float, default=1e8, help="refuse maps with more cells (default: 1e8)"
    )

    hammer = verbs.add_parser("hammer", help="find the hammers that reach a bandwidth without a double hit")
    hammer.set_defaults(run=_hammer)
    hammer.add_argument("scene", metavar="SCENE", type=_place, help="a TOML file; its body and strike point are used")
    hammer.add_argument("--bandwidth", metavar="F", type=float, required=True, help="bandwidth to reach [Hz]")
    hammer.add_argument(
        "--drop",
        metavar="D",
        type=float,
        default=10.0,
        help="how far the spectrum may fall within the bandwidth [dB] (default: 10)",
    )
    hammer.add_argument(
        "--masses", metavar="KG", type=float, nargs="+", help="masses of the hammers [kg] (default: 1 g to 1 kg)"
    )
    hammer.add_argument("--out", metavar="FILE", type=_place, help="write a picture to this file: .png, .pdf or .svg")
    hammer.add_argument("--json", action="store_true", help="print the numbers as JSON")

    report = verbs.add_parser("report", help="strike a scene; write one HTML page with everything about the blow")
    report.set_defaults(run=_report)
    report.add_argument(
        "scene", metavar="SCENE|RESULT", type=_place, help="a TOML file, or a folder written by `strike`"
    )
    report.add_argument("--out", metavar="FILE", type=_place, help="the page to write (default: out/NAME/report.html)")
    report.add_argument("--tolerance", metavar="T", type=float, help="largest accepted error; overrides the scene's")

    explore = verbs.add_parser("explore", help="serve a page on this machine where sliders and clicks change the blow")
    explore.set_defaults(run=_explore)
    explore.add_argument("scene", metavar="SCENE", type=_place, help="a TOML file")
    explore.add_argument("--port", metavar="N", type=int, default=0, help="port on 127.0.0.1 (default: any free port)")
    explore.add_argument("--no-open", action="store_true", help="print the address, but do not open it in a browser")

    doctor = verbs.add_parser("doctor", help="check this installation and suggest a remedy for each failure")
    doctor.set_defaults(run=_doctor)

    completion = verbs.add_parser("completion", help="print a completion script for bash: eval it in ~/.bashrc")
    completion.set_defaults(run=lambda options: print(_completion(parser)))
    return parser


def _add_choices(verb: argparse.ArgumentParser) -> None:
    """Add the options that choose the model."""
    verb.add_argument("--tolerance", metavar="T", type=float, help="largest accepted error; overrides the scene's")
    verb.add_argument(
        "--quantity", metavar="Q", action="append",
        help="what the tolerance is for; repeatable: restitution, contact_time, force ..., spectrum=5000 (up to 5 kHz)",
    )  # fmt: skip
    verb.add_argument(
        "--target",
        metavar="KIND",
        help="treat the struck body as rigid, infinite or modal, whatever the plan would choose",
    )
    verb.add_argument("--n-modes", metavar="N", type=int, help="number of modes to keep for the struck body")
    verb.add_argument("--size", metavar="H", type=float, help="element size [m]")


def _choices(options: argparse.Namespace) -> dict[str, Any]:
    names = ("tolerance", "quantity", "target", "n_modes", "size")
    return {name: getattr(options, name) for name in names if getattr(options, name) is not None}


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        print(f"fem-impact {fi.__version__}")
        parser.exit()


def _strike(options: argparse.Namespace) -> None:
    began = time.perf_counter()
    scene = fi.load_scene(options.scene)
    if options.listener is not None:
        scene = scene.heard_from(options.listener)
    folder = options.out if options.out is not None else Path("out") / options.scene.stem
    with fi.export.staged(folder) as staging:
        needs = {"target": "modal"} if options.pictures or options.vtk else {}  # only a modal body shows motion
        place = folder.resolve()  # "." has no name of its own
        keep = place.parent / f"{place.name}.modes.npz"  # beside the folder, which an interrupted run leaves unchanged
        choices = {**needs, **_choices(options)}
        run = scene.run(_progress, before=_warn, verify=options.verify, keep=keep, **choices)
        start = time.perf_counter()
        with _progress("files"):
            data = _write(staging, scene, run, options)
    keep.unlink(missing_ok=True)
    seconds = {**run.seconds, "files": time.perf_counter() - start, "total": time.perf_counter() - began}
    if options.json:
        print(json.dumps(data, indent=2, allow_nan=False))
        return
    print(_wrapped(scene.title or str(scene.path)))
    print(_wrapped(run.response.summary()))
    if run.plan.target != "modal":
        print(
            _wrapped(
                f"Model: {run.plan.reasons[0]}; no modes and no sound (use --target modal or --quantity sound=5000)"
            )
        )
    if run.verified is not None:
        tested = (
            ""
            if run.finer.target == "modal"
            else f" (which also treats the body as {run.finer.target}: it has too many modes)"
        )
        differences = ", ".join(f"{name} {value:.1e}" for name, value in run.verified.items())
        print(_wrapped(f"Verified by a finer run{tested}: {differences}"))
    for key, name, where in (("sound", "strike.wav", "Point"), ("radiated", "radiated.wav", "Listener")):
        if key in data:
            heard = data[key]
            level = "silence" if heard["level"] is None else f"peak {heard['stated']}"
            print(_wrapped(f"{where}: {level}; 1.0 in {name} is {heard['full_scale']:.4g} {heard['unit']}"))
    print(_wrapped("Time: " + ", ".join(f"{name} {value:.2f} s" for name, value in seconds.items())))
    print(_wrapped(f"Files in {folder}{os.sep}: {', '.join(data['files'])}"))


def _warn(plan: Any) -> None:
    """Warn of a long run before it starts."""
    if plan.costly:
        text = f"{plan.cost}; Ctrl-C stops it, and the same command later reuses the modes already found"
        print(_wrapped(f"fem-impact: {text} (`fem-impact plan` explains why)"), file=sys.stderr)


def _write(folder: Path, scene: Any, run: Any, options: argparse.Namespace) -> dict[str, Any]:
    """Write every file of a strike; return the contents of response.json."""
    from .show import sampling  # imported only when needed

    response, files = run.response, ["response.json", "force.csv", "force.png"]
    extra: dict[str, Any] = {}
    fi.export.write_force(folder / "force.csv", response)
    fi.figures.save(folder / "force.png", fi.figures.force(response))
    if run.plan.target == "modal":
        fi.export.write_vtk(folder / "modes.pvd", response.target.truncated(n_modes=SHAPES_WRITTEN))
        files += ["modes.pvd", *_write_sounds(folder, scene, response, extra, options)]
        if options.vtk:
            end = sampling.end_of(response)
            times = [end * i / (MOTION_TIMES - 1) for i in range(MOTION_TIMES)]
            fi.export.write_vtk(folder / "motion.pvd", response.target, response, times)
            files.append("motion.pvd")
        if options.pictures:
            fi.pictures.animation(folder / "wave.gif", response)
            fi.pictures.wave(folder / "wave.png", response)
            missing = fi.pictures.mode_shapes(folder / "modes.png", response.target)
            if missing:
                print(_wrapped(f"fem-impact: pictures are drawn in two dimensions; {missing}"), file=sys.stderr)
            files += ["modes.png", "wave.png", "wave.gif"]
    if run.verified is not None:
        extra["verified"] = run.verified
    changes = {name: value for name, value in run.plan.changes.items() if name in ("tolerance", "quantity")}
    tables, copies = scene.kept(folder, **changes)
    files += copies
    data = fi.export.plain(
        {
            **fi.export.numbers(response),
            **extra,
            "plan": run.plan.data(),
            "scene": tables,
            "seconds": dict(run.seconds),
            "notes": list(run.notes),
            "versions": fi.export.versions(),
            "files": files,
        }
    )
    fi.export.write_json(folder / "response.json", data)
    return data


def _write_sounds(
    folder: Path, scene: Any, response: Any, extra: dict[str, Any], options: argparse.Namespace
) -> list[str]:
    """Write the motion of a point and the pressure at the listener as sound; record places and levels."""
    heard = {"sound": ("strike.wav", {"at": scene.points[0]})}
    if scene.listener is not None:
        heard["radiated"] = ("radiated.wav", {"listener": scene.listener})
    for key, (name, where) in heard.items():
        wav = fi.export.write_wav(
            folder / name, response, duration=options.duration, normalise=options.normalise, **where
        )
        levels = {"full_scale": wav.full_scale, "unit": wav.unit, "peak_level": wav.peak_level, "level": wav.level}
        levels["stated"] = wav.said
        extra[key] = {**where, **levels, "reference": fi.sound.REFERENCE[wav.unit][0]}
    return [name for name, _ in heard.values()]


def _plan(options: argparse.Namespace) -> None:
    scene = fi.load_scene(options.scene)
    plan = scene.plan(watch=_progress, **_choices(options))
    if options.json:
        print(json.dumps(fi.export.plain({**plan.data(), "versions": fi.export.versions()}), indent=2, allow_nan=False))
        return
    print(_wrapped(scene.title or str(scene.path)))
    print(_wrapped(str(plan)))


def _map(options: argparse.Namespace) -> None:
    from .scenes import maps  # imported only when needed

    began = time.perf_counter()
    maps.can_write(options.format, options.out)
    scene = fi.load_scene(options.scene)
    folder = options.out if options.out is not None else Path("out") / options.scene.stem
    with fi.export.staged(folder) as staging:
        with _counted("cells") as watch:
            table = maps.map_scene(
                scene, tolerance=options.tolerance, workers=options.workers, client=options.cluster,
                store=options.store, watch=watch, max_cells=options.max_cells, tell=_tell,
            )  # fmt: skip
        with _progress("files"):
            names = maps.write(staging, table, options.format)
    print(_wrapped(scene.title or str(scene.path)))
    axes = ", ".join(f"{name} ({size})" for name, size in table.sizes.items())
    single, failed = int((table.n_impacts == 1).sum()), int((table.n_impacts < 0).sum())
    print(_wrapped(f"{table.n_impacts.size} blows over {axes}: {single} hit once, {failed} failed"))
    _print_notes(table.attrs["notes"].splitlines())
    print(_wrapped(f"Time: {time.perf_counter() - began:.2f} s"))
    print(_wrapped(f"Files in {folder}{os.sep}: {', '.join(names)}"))


def _tell(text: str) -> None:
    """Print one sentence to stderr."""
    print(_wrapped(f"fem-impact: {text}"), file=sys.stderr, flush=True)


def _hammer(options: argparse.Namespace) -> None:
    from .scenes import maps  # imported only when needed
    from .show import plots  # imported only when needed

    scene = fi.load_scene(options.scene)
    masses = options.masses or [m * 10.0**e for e in (-3, -2, -1) for m in (1.0, 2.0, 5.0)] + [1.0]
    with _progress("hammers"):
        hammers = maps.hammers_for(scene, options.bandwidth, masses, drop=options.drop)
        if options.out is not None:
            fi.figures.save(options.out, plots.hammers(hammers, options.bandwidth, options.drop))
    if options.json:
        data = {"bandwidth": options.bandwidth, "drop": options.drop, "hammers": [hammer.data() for hammer in hammers]}
        print(json.dumps(fi.export.plain({**data, "versions": fi.export.versions()}), indent=2, allow_nan=False))
        return
    print(_wrapped(scene.title or str(scene.path)))
    print(
        _wrapped(f"Tips that reach {options.bandwidth:g} Hz (spectrum at most {options.drop:g} dB down) and hit once:")
    )
    _print_notes(hammers[0].notes)
    print(f"{'mass':>9} {'softest tip':>14} {'hardest tip':>16} {'its reach':>11}")
    for hammer in hammers:
        soft = f"{hammer.softest:10.3g} N/m" if hammer.softest else "none"
        hard = f"{'> ' * hammer.unlimited}{hammer.hardest:.3g} N/m" if hammer.hardest else "none"
        reach = f"{hammer.reach:8.4g} Hz" if hammer.reach else "-"
        print(f"{1e3 * hammer.mass:7.4g} g {soft:>14} {hard:>16} {reach:>11}")
        if len(hammer.working) > 1:
            ranges = ", ".join(f"{low:.3g} to {high:.3g} N/m" for low, high in hammer.working)
            print(_wrapped(f"          every range that works: {ranges}"))
    if any(hammer.unlimited for hammer in hammers):
        print(_wrapped(">: no limit up to this tip, where the model ends: it keeps too few modes for harder ones"))
    idle = ", ".join(f"{1e3 * hammer.mass:.4g} g" for hammer in hammers if not hammer.works)
    if idle:
        print(_wrapped(f"{idle}: no tip reaches {options.bandwidth:g} Hz and hits once; try lighter hammers"))
    if options.out is not None:
        print(_wrapped(f"Files: {options.out}"))


def _report(options: argparse.Namespace) -> None:
    scene = fi.report.read(options.scene)
    path = options.out if options.out is not None else Path("out") / options.scene.stem / "report.html"
    changes = {} if options.tolerance is None else {"tolerance": options.tolerance}
    with fi.export.staged(path.parent) as staging:
        run = scene.run(_progress, before=_warn, target="modal", **changes)
        with _progress("page"):
            fi.report.write(staging / path.name, scene, run)
    print(_wrapped(scene.title or str(scene.path)))
    print(_wrapped(run.response.summary()))
    print(_wrapped(f"Files: {path}"))


def _explore(options: argparse.Namespace) -> None:
    scene = fi.load_scene(options.scene)

    def ready(address: str) -> None:
        print(f"{address}   (Ctrl-C stops it)", flush=True)
        if not options.no_open:
            webbrowser.open(address)

    fi.explore.serve(scene, port=options.port, ready=ready, watch=_progress)


def _modes(options: argparse.Namespace) -> None:
    scene = fi.load_scene(options.scene)
    if options.vtk is None:
        with _progress("modes"):
            modes = scene.modes(options.count)
    else:
        fi.export.vtk_ending(options.vtk)
        with fi.export.staged(options.vtk.parent) as staging:  # a bad folder fails before the work, not after it
            with _progress("modes"):
                modes = scene.modes(options.count)
            fi.export.write_vtk(staging / options.vtk.name, modes)
    if options.json:
        data = {"frequencies": modes.frequencies, "damping_ratios": modes.damping_ratio, "mass": modes.mass}
        data["notes"] = list(modes.notes)
        print(json.dumps(fi.export.plain({**data, "versions": fi.export.versions()}), indent=2, allow_nan=False))
        return
    print(_wrapped(scene.title or str(scene.path)))
    _print_notes(modes.notes)
    print(f"{'mode':>5} {'frequency':>14} {'damping ratio':>14}")
    for i, (frequency, ratio) in enumerate(zip(modes.frequencies, modes.damping_ratio), 1):
        print(f"{i:5d} {frequency:11.5g} Hz {ratio:14.3g}")
    if options.vtk is not None:
        print(_wrapped(f"Files: {options.vtk}"))


def _doctor(options: argparse.Namespace) -> None:
    from . import doctor  # imported only when needed

    for name, version in fi.export.versions().items():
        print(f"{name:<22} {version}")
    with _progress("checking, and compiling if not yet done"):
        findings = doctor.examine()
    for finding in findings:
        state = "works" if finding.works else "fails" if finding.vital else "missing"
        print(_wrapped(f"{finding.name:<22} {state:<8} {finding.seconds:5.2f} s  {finding.remedy}".rstrip()))
    failed = [finding.name for finding in findings if finding.vital and not finding.works]
    if failed:
        raise fi.SimulationError(f"{', '.join(failed)}: not working; see above")


def _completion(parser: argparse.ArgumentParser) -> str:
    """A bash script that completes the command, then its options and file names."""
    (verbs,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    cases = [
        f"        {name}) words='{' '.join(word for action in verb._actions for word in action.option_strings)}' ;;"
        for name, verb in verbs.choices.items()
    ]
    return "\n".join(
        [
            "_fem_impact() {",
            "    local words='--help --version'",
            '    case "${COMP_WORDS[1]}" in',
            *cases,
            "    esac",
            '    [ "$COMP_CWORD" = 1 ] && words="$words ' + " ".join(verbs.choices) + '"',
            '    COMPREPLY=($(compgen -W "$words" -- "${COMP_WORDS[COMP_CWORD]}"))',
            "}",
            "complete -o default -F _fem_impact fem-impact",
        ]
    )


def _print_notes(notes: Sequence[str]) -> None:
    for note in notes:
        print(_wrapped(f"Note: {note}"))


def _wrapped(text: str) -> str:
    """Wrap text to the width of the terminal and indent continued lines."""
    width = max(20, min(WIDEST, shutil.get_terminal_size().columns))
    filled = textwrap.TextWrapper(
        width, subsequent_indent="    ", break_on_hyphens=False
    )  # so that paths can be copied
    lines = (filled.wrap(line) or [""] for line in text.splitlines())
    return "\n".join(line for wrapped in lines for line in wrapped)


def _show_cursor() -> None:
    """Clear the progress line and show the cursor again."""
    os.write(2, b"\r\x1b[2K\x1b[?25h")


@contextmanager
def _progress(stage: str) -> Iterator[None]:
    """On a terminal, show which stage is running and for how long."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield
        return
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with undoable(_show_cursor), Progress(*columns, console=console, transient=True) as progress:
        progress.add_task(stage, total=None)
        yield


@contextmanager
def _counted(what: str) -> Iterator[Any]:
    """On a terminal, show the number done, the rate and the time left."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"), TimeRemainingColumn(),
    )  # fmt: skip
    with undoable(_show_cursor), Progress(*columns, console=console, transient=True) as progress:
        task, began = progress.add_task(what, total=None, rate=""), time.perf_counter()
        known: list[int] = []

        def watch(done: int, total: int) -> None:
            if not known:
                known.append(done)
            rate = (done - known[0]) / max(1e-9, time.perf_counter() - began)
            progress.update(task, completed=done, total=total, rate=f"{rate:.3g}/s" if rate else "")

        yield watch


if __name__ == "__main__":
    sys.exit(main())
