"""The arguments of the command line: every command, its options, and what is said of a bad one."""

import argparse
import difflib
import re
import sys
import textwrap
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import fem_impact as fi

from . import answers, commands
from .display import complain
from .show import FORMATS


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
        every = {name: verb for choices in verbs for name, verb in choices.items()}
        chosen = [every[name] for name in self.given[:1] if name in every]
        parsers = [self, *(chosen or every.values())]
        known = [word for each in parsers for action in each._actions for word in action.option_strings]
        known += [word for action in self._actions for word in action.choices or () if not chosen]
        if "required" in message:  # perhaps the option was given but misspelled
            words = [word.partition("=")[0] for word in self.given if word.startswith("--")]
            found = [word for word in words if word not in known]
        close = difflib.get_close_matches(found[0], known, n=1) if found else []
        verb = "".join(f" {word}" for choices in verbs for word in self.given[:1] if word in choices)
        owners = [name for name, each in every.items() if found and found[0] in each._option_string_actions]
        hint = f"did you mean {close[0]}?" if close else f"see {self.prog}{verb} --help"
        hint = f"{found[0]} is an option of {', '.join(owners)}" if owners and found[0] not in known else hint
        sys.exit(complain(f"{message:.300}; {hint}", answers.Status.BAD_INPUT))


class _Help(argparse.HelpFormatter):
    """Keeps paths whole, and the lines of an epilog, where a long example goes on in the next line, as shells read it.

    The usage says what a command needs; the options that it can do without are listed below it.
    """

    def add_usage(self, usage: Any, actions: Any, groups: Any, prefix: str | None = None) -> None:
        needed = [each for each in actions if each.required or not each.option_strings]
        super().add_usage(usage, needed, (), prefix)

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(text, width, break_on_hyphens=False, break_long_words=False)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        lines = []
        for line in text.splitlines():
            command = line.startswith("  ")
            room = max(20, width - 2 * command)
            kept = textwrap.wrap(line, room, subsequent_indent="    ", break_on_hyphens=False, break_long_words=False)
            lines.append((" \\\n" if command else "\n").join(kept))
        return "\n".join(lines)


Option = tuple[str, dict[str, Any]]  # its name, and what argparse makes of it


class Command(NamedTuple):
    """A command: what it does, what runs it, what it works on, and its options."""

    help: str
    run: Callable[[argparse.Namespace], commands.Answer | None]
    options: tuple[Option, ...] = ()
    scene: str = "a TOML file"  # the first argument in words; "" for a command without
    called: str = "SCENE"


def _later(name: str) -> Callable[[argparse.Namespace], commands.Answer | None]:
    """What runs a command of `hammer_commands`, which is imported then: it needs numpy, and help does not."""
    return lambda options: getattr(import_module("fem_impact.hammer_commands"), name)(options)


def _option(name: str, value: Any, help: str, type: Any = None, **how: Any) -> Option:
    """An option, or an argument, with a value of that name in the help."""
    return name, {"metavar": value, "help": help, "type": type, **how}


def _flag(name: str, help: str) -> Option:
    return name, {"action": "store_true", "help": help}


def _older(name: str, dest: str, **how: Any) -> Option:
    """An older spelling of an option, which help does not show."""
    return name, {"dest": dest, "default": argparse.SUPPRESS, "help": argparse.SUPPRESS, **how}


def _out(files: str, default: str, single: str = "") -> Option:
    """The option --out, which is a folder everywhere; where one file is written, a name with an ending is that file."""
    named = f"; a name with an ending names the {single} itself" if single else ""
    return _option("--out", "DIR", f"folder for {files}{named} (default: {default})", _place)


def _format(default: str | None = FORMATS[0]) -> Option:
    """The option that sets the format of all pictures; without a default, the ending of --out sets it."""
    said = "by the ending of --out" if default is None else default
    return _option("--format", None, f"format of the pictures (default: {said})", choices=FORMATS, default=default)


TOLERANCE = _option("--tolerance", "T", "largest accepted error; overrides the scene's", float)
MODEL = (
    TOLERANCE,
    _option("--quantity", "Q", "what the tolerance is for; repeatable: restitution, contact_time, force ..., "
            "spectrum=5000 (up to 5 kHz)", action="append"),
    _option("--target", "KIND",
            "model the struck body as rigid, infinite, vectors, mixed or modal, whatever the plan would choose"),
    _option("--model", "MODEL",
            "auto adds thick theory, air and stretching where the tolerance needs them; stated follows the scene"),
    _option("--n-modes", "N", "number of modes to keep for the struck body", int),
    _option("--size", "H", "element size [m]", float),
)  # fmt: skip
WORKERS = (
    _option("--workers", "N", "number of threads (default: one per core)", int),
    _option("--cluster", "ADDRESS", "run on the Dask cluster whose scheduler has this address"),
)
CHANNELS = (
    _option("--force", "NAME", "name or number of the force channel (default: by its unit or name)"),
    _option("--response", "NAME", "name or number of a response; repeatable", action="append"),
    _option("--rate", "HZ", "sampling rate, if the file does not state it; of a scene: 51200", float),
    _option("--scale", "N", "newtons per unit of the force channel", float),
)
TAPS = "measured taps: .lvm, .csv, .npz, .wav, .mat or .uff"
COMMANDS = {
    "strike": Command("strike a scene; write force, spectrum, modes and sound", commands.run_strike, (
        _out("response.json and .npz, force, modes and sounds", "out/NAME"),
        *MODEL,
        _flag("--strict", "write nothing if the tolerance is missed, and exit with 1 instead of 3"),
        _flag("--verify", "strike again with a finer model and print the differences"),
        _flag("--band", "also strike with numbers as well as the scene says they are known, { value, about }, and "
              "print what they leave open"),
        _flag("--pictures", "write 3-D pictures of the mode shapes and the wave, as PNG and GIF"),
        _flag("--film", "write slow_motion.mp4, body and striker beside the force, and its captions"),
        _flag("--vtk", "write motion.pvd, the motion for ParaView and pyvista"),
        _option("--listener", ("X", "Y", "Z"), "write radiated.wav, the sound the body radiates to this point [m]; Z "
                "is the height above its plane; repeatable; of two also stereo.wav", float, nargs=3, action="append"),
        _format(),
        _option("--duration", "S", "length of the sounds [s] (default: until they decay)", float),
        _flag("--normalise", "scale each sound to a peak of 1.0"),
    ), "a TOML file, such as studies/scenes/drumstick.toml"),
    "plan": Command(
        "show the model, its reasons, expected errors and cost, without striking", commands.run_plan, MODEL),
    "modes": Command("list the modes of the struck body; write their shapes", commands.run_modes, (
        _option("--n-modes", "N", "how many, besides rigid motions (default: 12)", int, default=12),
        _older("--count", "n_modes", type=int),
        _option("--vtk", "FILE", "write the shapes to a .pvd or .vtu file", _place),
    )),
    "map": Command(
        "strike a scene on the grid of its table [map]; write numbers, borders and pictures", commands.run_map, (
        _out("map.nc, CSV files and, for two axes, a picture of each layer", "out/NAME"),
        TOLERANCE,
        _option("--format", None, "format of the numbers, nc or zarr, or of the pictures, png, pdf or svg; repeatable "
                "(default: nc and png)", choices=("nc", "zarr", *FORMATS), action="append", default=[]),
        *WORKERS,
        _option("--store", "DIR", "keep finished cells there; an interrupted run continues from them", _place),
        _option("--max-cells", "N", "refuse maps with more cells (default: 1e8)", float, default=1e8),
        _option("--cells", "N", "values along an axis whose range has no count (default: 400, or 100 if each cell must "
                "be struck alone)", int),
        _flag("--borders", "locate where the number of impacts changes, even if all counts are given"),
        _flag("--every-cell", "compute all cells; by default, a map without counts that would take more than a second "
              "is computed where its answer changes and interpolated elsewhere, to within the tolerance"),
    ), "a TOML file, such as studies/scenes/drumstick_map.toml"),
    "spread": Command(
        "strike a scene with uncertain inputs: how much the answers scatter, and which input causes it",
        commands.run_spread, (
        _option("--vary", "INPUT=LAW", 'an uncertain number, such as "contact.stiffness=lognormal(695e3, 0.1)"; '
                "repeatable; also normal(mean, deviation), uniform(low, high), loguniform(low, high), triangular(low, "
                "mode, high)", action="append", default=[], required=True),
        _option("--correlate", "INPUT,INPUT=R", "correlation of two; repeatable", action="append", default=[]),
        _option("--blows", "N", "number of blows (default: 10000)", int, default=10_000),
        _flag("--no-sobol", "no Sobol indices: all blows go into the distributions"),
        _option("--seed", "N", "seed of the random points (default: 0)", int, default=0),
        TOLERANCE,
        _option("--max-frequency", "HZ", "add the spectral centroid up to this frequency (slow)", float),
        *WORKERS,
        _option("--store", "DIR", "keep finished blows there; an interrupted run continues from them", _place),
        _out("spread.json, .nc, .csv and .png", "out/NAME"),
        _format(),
    )),
    "hammer": Command("find the hammers that reach a bandwidth without a double hit", _later("run_hammer"), (
        _option("--bandwidth", "F", "bandwidth to reach [Hz]", float, required=True),
        _option("--drop", "D", "how far the spectrum may fall within the bandwidth [dB] (default: 10)", float,
                default=10.0),
        _option("--masses", "KG", "masses of the hammers [kg] (default: 1 g to 1 kg)", float, nargs="+"),
        _option("--rove", "N", "plan a test of about N points over the body, the sensor at the strike point", int),
        _option("--catalogue", "WORDS", "which hammer and tip of the catalogue, of those with WORDS in their names: "
                "one printable sheet per point", nargs="?", const=""),
        _out("hammers.png, or rove.png and .csv, or hammers.html", "none", "picture or page"),
        _format(None),
    ), "a TOML file; its body and strike point are used"),
    "tune": Command(
        "say what to take off a plate or bar where, so that its modes sound at pitches", commands.run_tune, (
        _option("--pitch", "PITCH", "of the next mode, or MODE=PITCH: Hz, a note (A4, \"Bb3 -5 cents\"), \"-14 cents\" "
                "from now, or \"ratio 4\" to the first; repeatable", action="append", required=True),
        _option("--match", None, "whether pitches belong to modes in order, or to the nearest (default: order)",
                choices=("order", "nearest"), default="order"),
        _option("--depth", "M", "greatest depth [m] (default: a fifth of the thickness)", float),
        _option("--radius", "M", "radius of the patches [m] (default: an eighth of the body)", float),
        _option("--mirror", None, "along which axes patches have images", choices=("x", "y", "xy")),
        _option("--patches", "N", "most patches (default: 6)", int, default=6),
        _option("--tolerance", "CENTS", "how near to come (default: 1)", float, default=1.0),
        _out("tuning.png", "none", "picture"),
        _format(None),
    ), "a TOML file, such as studies/scenes/marimba_bar.toml"),
    "watch": Command("judge every record of taps that a folder gets: good, or what to do", _later("run_watch"), (
        _option("--bandwidth", "F", "bandwidth that taps must reach [Hz]", float, required=True),
        _option("--drop", "D", "how far the spectrum may fall within the bandwidth [dB] (default: 10)", float,
                default=10.0),
        _flag("--once", "judge the records that are there, and end"),
        *CHANNELS,
        _out("watch.png", "out/NAME", "picture"),
    ), f"the folder that gets {TAPS}", "FOLDER"),
    "report": Command("strike a scene; write one HTML page with everything about the blow", commands.run_report, (
        _out("report.html", "out/NAME", "page"),
        TOLERANCE,
    ), "a TOML file, or a folder written by `strike`", "SCENE|RESULT"),
    "page": Command(
        "strike a scene on a grid; write one HTML page with sliders, sound and questions", commands.run_page, (
        _out("page.html", "out/NAME", "page"),
    )),
    "explore": Command(
        "serve a page on this machine where sliders and clicks change the blow", commands.run_explore, (
        _option("scene", "SCENE", "a TOML file, an .svg or .dxf drawing or a mesh file (default: a wooden plate; drop "
                "yours on the page)", _place, nargs="?"),
        _option("--port", "N", "port on 127.0.0.1 (default: any free port)", int, default=0),
        _flag("--no-open", "print the address, but do not open it in a browser"),
    ), ""),
    "play": Command(
        "strike a scene from the keyboard, a MIDI file or a MIDI port, and hear it at once", commands.run_play, (
        _option("--midi", "FILE", "play the notes of a MIDI file: middle C is the first point", _place),
        _option("--midi-port", "NAME", "play from the MIDI input whose name begins with NAME", nargs="?", const=""),
        _older("--port", "midi_port", nargs="?", const=""),
        _option("--at", "X", "a point to strike [m]; repeatable (default: ten points, the scene's and others over the "
                "whole body)", float, nargs="+", action="append"),
        _option("--n-modes", "N", "number of modes (default: 300)", int, default=300),
        _older("--modes", "n_modes", type=int),
        _option("--fastest", "V", "speed of the loudest stroke [m/s] (default: twice the scene's)", float),
        _option("--duration", "S", "stop after this time at the latest [s] (default: 600)", float, default=600.0),
        _option("--block", "N", "frames computed at a time, at 48000 per second (default: 64)", int, default=64),
        _flag("--silent", "play into the file only, and count the deadlines that would be missed"),
        _out("play.wav", "out/NAME", "sound"),
    )),
    "new": Command("write a commented scene to begin with", commands.run_new, (
        _option("kind", "KIND", "plate, disk, beam or map (default: plate)", nargs="?", default="plate"),
        _option("--from", "FILE", "the outline of the plate, an .svg or .dxf drawing or a mesh file", _place,
                dest="drawing"),
        _option("--unit", "U", "unit of the numbers in that file: m, cm, mm, um, in or km (default: the file's)"),
        _option("--material", "NAME", "what the body is made of, a name of the catalogue such as brass"),
        _option("--mallet", "NAME", 'what strikes it, a name of the catalogue such as "yarn, medium"'),
        _out("KIND.toml", "here", "scene"),
    ), ""),
    "catalogue": Command(
        "list materials, strikers and impact hammers that have a name, or all numbers of one", commands.run_catalogue, (
        _option("words", "WORD", "part of a name or group, such as spruce (default: all)", nargs="*"),
    ), ""),
    "mesh": Command(
        "list the edges, sizes and units of a mesh, drawing or scene, to state its supports", commands.run_mesh, (
        _option("--unit", "U", "unit of the numbers in the file: m, cm, mm, um, in or km (default: the file's)"),
        _out("elements and named edges, mesh.png", "none", "picture"),
        _format(None),
    ), "a mesh file, an .svg or .dxf drawing, or a scene, a .toml file", "FILE"),
    "show": Command(
        "show what a folder of results holds, or how much of a store is finished", commands.run_show, (),
        "a folder that --out or --store named", "FOLDER"),
    "schema": Command(
        "print a JSON schema: of scenes, for editors to check them, or of what a command prints with --json",
        commands.run_schema,
        (_option("of", "COMMAND", "a command (default: scenes)", nargs="?", choices=tuple(answers.KEYS)),), ""),
    "doctor": Command(
        "check this installation and suggest a remedy for each failure", commands.run_doctor, scene=""),
    "verify": Command(
        "compute reference cases and say whether our stated errors hold on this machine", commands.run_verify, (
        _option("names", "NAME", "a case, or how its name begins, as square (default: all)", nargs="*"),
        _flag("--list", "list the cases, compute none"),
        _flag("--all", "show every number, not only the worst of each case"),
        _out("verify.png", "none", "picture"),
        _format(None),
    ), ""),
    "completion": Command(
        "print a script that completes commands; eval it in ~/.bashrc", lambda options: completion(options.shell),
        (_option("shell", None, "default: bash", choices=("bash", "zsh", "tcsh"), nargs="?", default="bash"),), ""),
    "frf": Command("compute frequency responses of taps, or of a scene as a rig would measure it", _later("run_frf"), (
        *CHANNELS,
        _option("--method", None, "H1 for noise in the response, H2 in the force, Hv in both", default="H1",
                choices=("H1", "H2", "Hv")),
        _option("--force-window", "S", "ignore the force later than this after each pulse begins", float),
        _option("--response-window", "S", "time constant of an exponential window", float),
        _option("--against", "SCENE", "compare with the modes of this scene; [observe] has a point for each response",
                _place),
        _out("frf.csv and frf.html", "none", ".csv, .uff or .html file"),
    ), f"{TAPS} or frequency responses; or a scene, a TOML file", "TAPS|SCENE"),
    "fit": Command("find the hammer and the contact that explain measured taps", commands.run_fit, (
        _option("body", "SCENE", "the scene struck (default: a wall)", _place, nargs="?"),
        *CHANNELS,
        _option("--unknown", "NAME=LOW:HIGH", "a number to find in a range; repeatable (default: stiffness, exponent, "
                "loss of the contact)", action="append", default=[]),
        _option("--known", "NAME=VALUE", "a number to hold fixed; repeatable", action="append", default=[]),
        _option("--per-tap", "NAME", "fit this unknown separately for each tap; repeatable", action="append",
                default=[]),
        _option("--mass", "KG", "mass of the hammer (default: the scene's, or 0.1)", float),
        _flag("--propose", "find the model, too: a wall, then what predicts taps left out better"),
        _out("fit.html, fit.json and scene.toml", "out/NAME"),
    ), TAPS, "TAPS"),
}  # fmt: skip


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    made = Parser(
        prog="fem-impact", description="Strike anything thin with anything, and know how far to trust the answer.",
        epilog="fem-impact COMMAND --help shows examples and exit statuses",
    )  # fmt: skip
    made.add_argument("--version", action="version", version=f"fem-impact {fi.__version__}")
    verbs = made.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, command in COMMANDS.items():
        said = command.help
        verb = verbs.add_parser(
            name, help=said, description=f"{said[0].upper()}{said[1:]}.", epilog=answers.epilog(name),
            formatter_class=_Help,
        )  # fmt: skip
        verb.set_defaults(run=command.run, command=name)
        described = "" if name == "schema" else f"; `fem-impact schema {name}` describes it"
        scene = (_option("scene", command.called, command.scene, _place),) if command.scene else ()
        for option, how in (
            *scene,
            _flag("--json", f"print the answer as JSON{described}"),
            _flag("--quiet", "write nothing but errors to stderr"),
            *command.options,
        ):
            verb.add_argument(option, **how)
    return made


def completion(shell: str) -> commands.Answer:
    """A script that completes commands, options and file names."""
    from ._base import check  # imports numpy, which --help and --version do not need

    shtab = check.extra("shtab", "completion", "completion")
    made = parser()
    (verbs,) = (action for action in made._actions if isinstance(action, argparse._SubParsersAction))
    for action in (action for verb in verbs.choices.values() for action in verb._actions):
        if action.type is _place:
            action.complete = shtab.FILE
    script = shtab.complete(made, shell)
    return commands.answer({"shell": shell, "script": script}, [script])
