"""The arguments of the command line: every command, its options, and what is said of a bad one."""

import argparse
import difflib
import re
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import fem_impact as fi

from . import answers, commands
from .display import complain
from .show import FORMATS

BAD_INPUT = 2  # exit status, as Unix tools use it


def _place(text: str) -> Path:
    """A path given on the command line."""
    from ._base import check  # imports numpy, which --help and --version do not need

    try:
        return check.path("it", text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


class Parser(argparse.ArgumentParser):
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
        sys.exit(complain(f"{message:.300}; {hint}", BAD_INPUT))


class _Help(argparse.HelpFormatter):
    """Keeps the lines of an epilog; an example that is too long goes on in the next line, as a shell reads it.

    The usage says what a command needs; the options that it can do without are listed below it.
    """

    def add_usage(self, usage: Any, actions: Any, groups: Any, prefix: str | None = None) -> None:
        needed = [each for each in actions if each.required or not each.option_strings]
        super().add_usage(usage, needed, (), prefix)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        lines = []
        for line in text.splitlines():
            command = line.startswith("  ")
            room = max(20, width - 2 * command)
            kept = textwrap.wrap(line, room, subsequent_indent="    ", break_on_hyphens=False, break_long_words=False)
            lines.append((" \\\n" if command else "\n").join(kept))
        return "\n".join(lines)


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    made = Parser(
        prog="fem-impact", description="Strike anything thin with anything, and know how far to trust the answer.",
        epilog="fem-impact COMMAND --help shows examples and exit statuses",
    )  # fmt: skip
    made.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    verbs = made.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def verb(run: Any, name: str, help: str, scene: str = "a TOML file", called: str = "SCENE") -> Any:
        """Add a command and return the function that adds its arguments."""
        mine = verbs.add_parser(
            name, help=help, description=f"{help[0].upper()}{help[1:]}.", epilog=answers.epilog(name),
            formatter_class=_Help,
        )  # fmt: skip
        mine.set_defaults(run=run, command=name)
        if scene:
            mine.add_argument("scene", metavar=called, type=_place, help=scene)
        described = "" if name == "schema" else f"; `fem-impact schema {name}` describes it"
        mine.add_argument("--json", action="store_true", help=f"print the answer as JSON{described}")
        mine.add_argument("--quiet", action="store_true", help="write nothing but errors to stderr")
        return mine.add_argument

    add = verb(
        commands.strike, "strike", "strike a scene; write force, spectrum, modes and sound",
        scene="a TOML file, such as studies/scenes/drumstick.toml",
    )  # fmt: skip
    _add_out(add, "response.json and .npz, force, modes and sounds", "out/NAME")
    _add_choices(add)
    add("--strict", action="store_true", help="write nothing if the tolerance is missed, and exit with 1 instead of 3")
    add("--verify", action="store_true", help="strike again with a finer model and print the differences")
    add("--pictures", action="store_true", help="write 3-D pictures of the mode shapes and the wave, as PNG and GIF")
    add("--vtk", action="store_true", help="write motion.pvd, the motion for ParaView and pyvista")
    add(
        "--listener", metavar=("X", "Y", "Z"), nargs=3, type=float, action="append",
        help="write radiated.wav, the sound the body radiates to this point [m]; Z is the height above its plane; "
        "repeatable; of two also stereo.wav",
    )  # fmt: skip
    _add_format(add)
    add("--duration", metavar="S", type=float, help="length of the sounds [s] (default: until they decay)")
    add("--normalise", action="store_true", help="scale each sound to a peak of 1.0")

    add = verb(commands.plan, "plan", "show the model, its reasons, expected errors and cost, without striking")
    _add_choices(add)

    add = verb(commands.modes, "modes", "list the modes of the struck body; write their shapes")
    add("--n-modes", metavar="N", type=int, default=12, help="how many, besides rigid motions (default: 12)")
    _also(add, "--count", "n_modes", type=int)
    add("--vtk", metavar="FILE", type=_place, help="write the shapes to a .pvd or .vtu file")

    add = verb(
        commands.map_of, "map", "strike a scene on the grid of its table [map]; write numbers, borders and pictures",
        scene="a TOML file, such as studies/scenes/drumstick_map.toml",
    )  # fmt: skip
    _add_out(add, "map.nc, CSV files and, for two axes, a picture of each layer", "out/NAME")
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
        help="locate where the number of impacts changes, even if all counts are given",
    )
    add(
        "--every-cell", action="store_true",
        help="compute all cells; by default, a map without counts that would take more than a second is computed where "
        "its answer changes and interpolated elsewhere, to within the tolerance",
    )  # fmt: skip

    add = verb(
        commands.spread,
        "spread",
        "strike a scene with uncertain inputs: how much the answers scatter, and which input causes it",
    )
    add("--vary", metavar="INPUT=LAW", action="append", default=[], required=True,
        help='an uncertain number, such as "contact.stiffness=lognormal(695e3, 0.1)"; repeatable; also normal(mean, '
        "deviation), uniform(low, high), loguniform(low, high), triangular(low, mode, high)")  # fmt: skip
    add("--correlate", metavar="INPUT,INPUT=R", action="append", default=[], help="correlation of two; repeatable")
    add("--blows", metavar="N", type=int, default=10_000, help="number of blows (default: 10000)")
    add("--no-sobol", action="store_true", help="no Sobol indices: all blows go into the distributions")
    add("--seed", metavar="N", type=int, default=0, help="seed of the random points (default: 0)")
    add("--tolerance", metavar="T", type=float, help="largest accepted error; overrides the scene's")
    add("--max-frequency", metavar="HZ", type=float, help="add the spectral centroid up to this frequency (slow)")
    add("--workers", metavar="N", type=int, help="number of threads (default: one per core)")
    add("--cluster", metavar="ADDRESS", help="run on the Dask cluster whose scheduler has this address")
    add("--store", metavar="DIR", type=_place, help="keep finished blows there; an interrupted run continues from them")
    _add_out(add, "spread.json, .nc, .csv and .png", "out/NAME")
    _add_format(add)

    add = verb(
        commands.hammer, "hammer", "find the hammers that reach a bandwidth without a double hit",
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
        help="plan a test of about N points over the body, the sensor at the strike point",
    )  # fmt: skip
    _add_out(add, "hammers.png, or rove.png and .csv", "none", "picture")
    _add_format(add, None)

    add = verb(
        commands.report, "report", "strike a scene; write one HTML page with everything about the blow",
        scene="a TOML file, or a folder written by `strike`", called="SCENE|RESULT",
    )  # fmt: skip
    _add_out(add, "report.html", "out/NAME", "page")
    add("--tolerance", metavar="T", type=float, help="largest accepted error; overrides the scene's")

    add = verb(commands.explore, "explore", "serve a page on this machine where sliders and clicks change the blow")
    add("--port", metavar="N", type=int, default=0, help="port on 127.0.0.1 (default: any free port)")
    add("--no-open", action="store_true", help="print the address, but do not open it in a browser")

    add = verb(
        commands.play, "play", "strike a scene from the keyboard, a MIDI file or a MIDI port, and hear it at once"
    )
    add("--midi", metavar="FILE", type=_place, help="play the notes of a MIDI file: middle C is the first point")
    add("--midi-port", metavar="NAME", nargs="?", const="", help="play from the MIDI input whose name begins with NAME")
    _also(add, "--port", "midi_port", nargs="?", const="")
    add("--at", metavar="X", nargs="+", type=float, action="append", help="a point to strike [m]; repeatable "
        "(default: ten points, the scene's and others over the whole body)")  # fmt: skip
    add("--n-modes", metavar="N", type=int, default=300, help="number of modes (default: 300)")
    _also(add, "--modes", "n_modes", type=int)
    add("--fastest", metavar="V", type=float, help="speed of the loudest stroke [m/s] (default: twice the scene's)")
    add(
        "--duration",
        metavar="S",
        type=float,
        default=600.0,
        help="stop after this time at the latest [s] (default: 600)",
    )
    add(
        "--block",
        metavar="N",
        type=int,
        default=64,
        help="frames computed at a time, at 48000 per second (default: 64)",
    )
    add("--silent", action="store_true", help="play into the file only, and count the deadlines that would be missed")
    _add_out(add, "play.wav", "out/NAME", "sound")

    add = verb(commands.new, "new", "write a commented scene to begin with", scene="")
    add("kind", metavar="KIND", nargs="?", default="plate", help="plate, disk, beam or map (default: plate)")
    _add_out(add, "KIND.toml", "here", "scene")

    add = verb(
        commands.mesh, "mesh", "list the edges, sizes and units of a mesh, drawing or scene, to state its supports",
        scene="a mesh file, an .svg or .dxf drawing, or a scene, a .toml file", called="FILE",
    )  # fmt: skip
    add("--unit", metavar="U", help="unit of the numbers in the file: m, cm, mm, um, in or km (default: the file's)")
    _add_out(add, "elements and named edges, mesh.png", "none", "picture")
    _add_format(add, None)

    verb(commands.show, "show", "show what a folder of results holds, or how much of a store is finished",
         scene="a folder that --out or --store named", called="FOLDER")  # fmt: skip

    add = verb(
        commands.schema, "schema",
        "print a JSON schema: of scenes, for editors to check them, or of what a command prints with --json", scene="",
    )  # fmt: skip
    add("of", metavar="COMMAND", nargs="?", choices=tuple(answers.KEYS), help="a command (default: scenes)")

    verb(commands.doctor, "doctor", "check this installation and suggest a remedy for each failure", scene="")

    add = verb(
        lambda options: _complete(made, options.shell), "completion",
        "print a script that completes commands; eval it in ~/.bashrc", scene="",
    )  # fmt: skip
    add("shell", choices=("bash", "zsh", "tcsh"), nargs="?", default="bash", help="default: bash")
    _add_taps(verb)
    return made


def _also(add: Any, old: str, dest: str, **how: Any) -> None:
    """Take an older spelling of an option, too, which help does not show."""
    add(old, dest=dest, default=argparse.SUPPRESS, help=argparse.SUPPRESS, **how)


def _add_out(add: Any, files: str, default: str, single: str = "") -> None:
    """Add --out, which is a folder everywhere; where one file is written, a name with an ending is that file."""
    named = f"; a name with an ending names the {single} itself" if single else ""
    add("--out", metavar="DIR", type=_place, help=f"folder for {files}{named} (default: {default})")


def _add_format(add: Any, default: str | None = FORMATS[0]) -> None:
    """Add the option that sets the format of all pictures; without a default, the ending of --out sets it."""
    said = "by the ending of --out" if default is None else default
    add("--format", choices=FORMATS, default=default, help=f"format of the pictures (default: {said})")


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
        help="model the struck body as rigid, infinite, vectors, mixed or modal, whatever the plan would choose",
    )
    add(
        "--model", metavar="MODEL",
        help="auto adds thick theory, air and stretching where the tolerance needs them; stated follows the scene",
    )  # fmt: skip
    add("--n-modes", metavar="N", type=int, help="number of modes to keep for the struck body")
    add("--size", metavar="H", type=float, help="element size [m]")


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        sys.stdout.write(f"fem-impact {fi.__version__}\n")
        parser.exit()


def _complete(parser: argparse.ArgumentParser, shell: str) -> commands.Answer:
    script = completion(parser, shell)
    return commands.answer({"shell": shell, "script": script}, [script])


def completion(parser: argparse.ArgumentParser, shell: str) -> str:
    """A script that completes commands, options and file names."""
    from ._base import check  # imports numpy, which --help and --version do not need

    shtab = check.extra("shtab", "completion", "completion")
    (verbs,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    for action in (action for verb in verbs.choices.values() for action in verb._actions):
        if action.type is _place:
            action.complete = shtab.FILE
    return shtab.complete(parser, shell)


def _add_taps(verb: Any) -> None:
    """Add the commands for measured taps."""
    files = "measured taps: .lvm, .csv, .npz, .wav, .mat or .uff"
    add = verb(commands.frf, "frf", "compute frequency responses of taps, or of a scene as a rig would measure it",
               scene=f"{files} or frequency responses; or a scene, a TOML file", called="TAPS|SCENE")  # fmt: skip
    _add_channels(add)
    add("--method", choices=("H1", "H2"), default="H1", help="H1 for noise in the response, H2 in the force")
    add("--force-window", metavar="S", type=float, help="ignore the force later than this after its onset")
    add("--response-window", metavar="S", type=float, help="time constant of an exponential window")
    _add_out(add, "frf.csv", "none", ".csv or .uff file")

    add = verb(
        commands.fit, "fit", "find the hammer and the contact that explain measured taps", scene=files, called="TAPS"
    )
    add("body", metavar="SCENE", type=_place, nargs="?", help="the scene struck (default: a wall)")
    _add_channels(add)
    add("--unknown", metavar="NAME=LOW:HIGH", action="append", default=[],
        help="a number to find in a range; repeatable (default: stiffness, exponent, loss of the contact)")  # fmt: skip
    add("--known", metavar="NAME=VALUE", action="append", default=[], help="a number to hold fixed; repeatable")
    add("--per-tap", metavar="NAME", action="append", default=[],
        help="fit this unknown separately for each tap; repeatable")  # fmt: skip
    add("--mass", metavar="KG", type=float, help="mass of the hammer (default: the scene's, or 0.1)")
    _add_out(add, "fit.html, fit.json and scene.toml", "out/NAME")


def _add_channels(add: Any) -> None:
    """Add the options that say what a file of taps holds."""
    add("--force", metavar="NAME", help="name or number of the force channel (default: by its unit or name)")
    add("--response", metavar="NAME", action="append", help="name or number of a response; repeatable")
    add("--rate", metavar="HZ", type=float, help="sampling rate, if the file does not state it; of a scene: 51200")
    add("--scale", metavar="N", type=float, help="newtons per unit of the force channel")
