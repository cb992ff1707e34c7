"""What every command prints with --json, how it ends, and examples of it: the tables that help, pages and tests use."""

from enum import IntEnum
from typing import Any

FORMAT = 1  # number of the format of all answers; it grows when a key changes its meaning, not when one is added
MISSES = ("strike", "report", "tune")  # commands that end with 3 where the tolerance is missed


class Status(IntEnum):
    """How a command ends, as Unix tools do: 130 is 128 + SIGINT."""

    DONE = 0
    FAILED = 1
    BAD_INPUT = 2
    MISSED = 3
    INTERRUPTED = 130


STATUSES = {
    Status.DONE: "done", Status.FAILED: "the run failed", Status.BAD_INPUT: "bad input",
    Status.MISSED: "done, but the tolerance is missed", Status.INTERRUPTED: "interrupted",
}  # fmt: skip
Keys = dict[str, tuple[str, str]]  # key: JSON type (with "?" if it may be left out), and meaning
ALL: Keys = {
    "command": ("string", "the command"),
    "format": ("integer", f"number of this format, {FORMAT}; it grows when a key changes its meaning"),
    "notes": ("array", "what was assumed, and numbers that are probably a slip of a unit, as sentences"),
    "see": ("array", "headings that explain what is said, as `notes.md#not-resolvable` of `studies/notes.md`"),
    "folder": ("string|null", "where the files are; null if none was written"),
    "files": ("array", "names of the files in that folder"),
    "versions": ("object", "versions of Python and of the packages that compute the numbers"),
}


def _alike(meaning: str, names: str) -> Keys:
    """Keys that are explained together."""
    return dict.fromkeys(names.split(), ("any?", meaning))


SCENE: Keys = {"scene": ("object", "tables of the scene as it was struck, as in its TOML file")}
SECONDS: Keys = {"seconds": ("object", "wall time [s] of each stage")}
BLOW: Keys = {
    "response": (
        "object?",
        "numbers of the blow in SI units: n_impacts, restitution, peak_force, error ..., assumptions",
    ),
    "sequence": ("object?", "of a scene with strokes, in place of response: the numbers of all strokes together"),
    "impacts": ("array", "of each impact start [s], end [s], peak_force [N], impulse [N s], contact and restitution"),
    "strokes": ("array?", "of each stroke when [s], at [m], speed [m/s], n_impacts and impulse [N s]"),
    "plan": ("object?", "what was modelled, why, and the errors and the cost predicted"),
}
KEYS: dict[str, Keys] = {
    "strike": BLOW | SCENE | SECONDS | {
        "sounds": ("array?", "of each sound file, place, full_scale, unit, levels [dB] and their reference"),
        "sound": ("object?", "the first of the sounds at a point"),
        "radiated": ("object?", "the first of the sounds at a listener"),
        "band": ("object?", "with --band: inputs, blows, and of each quantity value, errors, low, high and ends"),
        "verified": ("object?", "with --verify: differences [-] from a finer run"),
    },
    "plan": {
        "tolerance": ("number", "largest error accepted [-]"),
        "seconds": ("number", "predicted time [s]"),
        "memory": ("number", "predicted memory [byte]"),
        "ringing": ("number?", "predicted besides, of the modes for motion and sound once they are asked for [s]"),
        "target": ("string?", "how the struck body is treated"),
        "errors": ("object?", "predicted errors [-] by cause"),
        "reasons": ("array?", "why, as sentences"),
        "assumptions": ("array?", "what the model assumes, and what each assumption changes"),
        "strokes": ("array?", "of a scene with strokes: each, with the number of its plan"),
        "plans": ("array?", "of a scene with strokes: their plans"),
    } | _alike(
        "see `Plan.data` of `fi.plan`",
        "quantities element size n_dofs n_modes max_frequency n_striker_modes scheme dt duration mass mobility meets "
        "needed",
    ),
    "modes": {
        "frequencies": ("array", "natural frequencies [Hz], rigid motions (0 Hz) first"),
        "damping_ratios": ("array", "damping ratio [-] of each mode"),
        "n_rigid": ("integer", "number of rigid motions"),
        "mass": ("number", "mass of the body [kg]"),
    },
    "map": SECONDS | {
        "n_blows": ("integer", "number of blows"),
        "axes": ("object", "number of values along each axis"),
        "n_single": ("integer", "blows with one impact"),
        "n_failed": ("integer", "blows without an answer"),
        "cells": ("string?", "how many cells were computed, in words"),
        "borders": ("string?", "how many borders between numbers of impacts were found, in words"),
        "model_error": ("object?", "least and largest error of the model itself [-], and what of it is not known"),
    },
    "spread": SECONDS | _alike(
        "see `Spread.data` of `fi.spread`",
        "title inputs blows independent failed seed tolerance correlation confidence double_hit chaotic quantities "
        "checks rescaled why_no_sobol",
    ),
    "hammer": {
        "bandwidth": ("number?", "bandwidth to reach [Hz]"),
        "drop": ("number?", "how far the spectrum may fall within it [dB]"),
        "hammers": ("array?", "of each its mass [kg], reach [Hz], and tips [N/m] that hit once, or that also reach it"),
        "table": ("object?", "with --rove or --catalogue: columns with a row for every point and tip"),
        "verdicts": ("array?", "with --rove: of every point whether a tip works, or why none does"),
        "resolution": ("number?", "with --rove: frequency resolution [Hz]"),
    },
    "tune": {
        "tones": ("array", "of each mode pitch, frequency and wanted [Hz], off and error [cents], and then "
                  "tuned [Hz], left and tuned_error [cents]"),
        "patches": ("array", "of each its places at [m], radius [m], depth [m], modes, cents (solved) and by_slopes"),
        "met": ("boolean", "whether every pitch is within the tolerance"),
        "volume": ("number", "taken off [m^3]"),
    } | _alike("see `fi.tune`", "tolerance depth radius mirror"),
    "watch": {
        "records": ("array", "of each tap file, tap, good, said, peak [N], reach [Hz] (null: beyond half the rate)"),
        "n_good": ("integer", "good taps so far"),
    },
    "report": BLOW | SCENE | SECONDS,
    "page": {
        "n_blows": ("integer", "number of blows on the page"),
        "n_missed": ("integer", "blows that miss their tolerance"),
        "n_failed": ("integer", "blows without an answer"),
        "n_unlike": ("integer", "blows that the map behind them counts otherwise"),
        "tolerance": ("number", "of the blows [-]"),
        "force_error": ("number", "by which curves shown miss the force, over its peak [-]"),
        "spectrum_error": ("number", "by which spectra shown miss that of the force, over the impulse [-]"),
        "questions": ("integer", "number of questions"),
        "bytes": ("integer", "size of the page"),
    },
    "explore": {"address": ("string", "address of the page, printed as soon as it is served")},
    "play": {
        "played": ("object", "number of strokes, contacts ... by name"),
        "step": ("number", "longest time step [s]"),
        "n_modes": ("integer", "number of modes"),
        "n_blocks": ("integer", "blocks computed"),
        "slowest": ("number", "99th percentile of the computing time of a block [s]"),
        "missed": ("integer", "blocks that missed their deadline"),
    },
    "new": {},
    "catalogue": {
        "entries": ("array", "of each section, group, name, kind, note, tips, and numbers with value, low, high, unit, "
                    "source, and whether that was read"),
    },
    "mesh": {
        "mesh": ("object", "what the mesh is, by name, in words"),
        "edges": ("array", "of each edge name, length [m], n_facets, curved, middle [m], twins"),
    },
    "show": {
        "holds": ("array", "commands that wrote what is in it, or store"),
        "response": ("object?", "of a strike: numbers of the blow, as of `strike`"),
        "sequence": ("object?", "of a scene with strokes: their numbers, as of `strike`"),
        "summary": ("array", "what is in it, as sentences"),
    },
    "doctor": {"findings": ("array", "of each check name, works, vital, seconds [s] and remedy")},
    "verify": {
        "cases": ("array", "of each name, title, kind, source, seconds, lines (quantity, unit, reference, within, "
                  "ours, error, difference, holds) and holds; with --list what is known of each"),
        "n_failed": ("integer?", "cases whose numbers differ by more than both errors allow"),
    },
    "completion": {"shell": ("string", "the shell"), "script": ("string", "its script")},
    "frf": {
        "peaks": ("array", "of each response, frequency [Hz], magnitude, unit, coherence, error (null: not known)"),
    },
    "fit": _alike(
        "see `Found.data` of `fi.fit`",
        "values unidentifiable limited ridges intervals point per_tap errors left_out outliers whiteness compared "
        "summary",
    ) | {"tried": ("array?", "with --propose: of each model name, inside, n_unknowns, error, left_out, taken")},
}  # fmt: skip

EXAMPLES: dict[str, tuple[str, ...]] = {
    "tune": ("fem-impact tune studies/scenes/marimba_bar.toml --pitch F#5 --mirror x --out out/tuning.png",),
    "strike": (
        "fem-impact strike studies/scenes/drumstick.toml --tolerance 1e-3 --out out",
        "fem-impact strike studies/scenes/drumstick.toml --listener 0.2 0.1 1.0 --json",
    ),
    "plan": ("fem-impact plan studies/scenes/drumstick.toml --tolerance 1e-3",),
    "modes": ("fem-impact modes studies/scenes/drumstick.toml --n-modes 20 --vtk out/modes.pvd",),
    "map": ("fem-impact map studies/scenes/drumstick_map.toml --store out/store --out out",),
    "spread": (
        'fem-impact spread studies/scenes/drumstick.toml --vary "contact.stiffness=lognormal(695e3,0.1)"',
    ),
    "hammer": (
        "fem-impact hammer studies/scenes/drumstick.toml --bandwidth 800",
        "fem-impact hammer studies/scenes/drumstick.toml --bandwidth 800 --rove 12 --out out",
        "fem-impact hammer studies/scenes/drumstick.toml --bandwidth 300 --catalogue --out out",
    ),
    "watch": ("fem-impact watch records --bandwidth 2000", "fem-impact watch records --bandwidth 2000 --once",),
    "report": ("fem-impact report studies/scenes/drumstick.toml", "fem-impact report out --out page.html"),
    "page": ("fem-impact page studies/scenes/drumstick.toml --out drumstick.html",),
    "explore": ("fem-impact explore studies/scenes/drumstick.toml",),
    "play": (
        "fem-impact play studies/scenes/drumstick.toml --n-modes 100", "fem-impact play scene.toml --midi song.mid",
    ),
    "new": (
        "fem-impact new disk --out gong.toml",
        'fem-impact new --from leaf.svg --material brass --mallet "yarn, medium"',
    ),
    "catalogue": ("fem-impact catalogue spruce", 'fem-impact catalogue "yarn, medium"'),
    "mesh": ("fem-impact mesh drawing.svg --unit mm --out edges.png",),
    "show": ("fem-impact show out",),
    "schema": ("fem-impact schema", "fem-impact schema strike"),
    "doctor": ("fem-impact doctor",),
    "verify": ("fem-impact verify square beam", "fem-impact verify --out verify.png"),
    "completion": ('eval "$(fem-impact completion bash)"',),
    "frf": (
        "fem-impact frf studies/measured/acceleration.lvm --out out/frf.csv",
        "fem-impact frf studies/measured/acceleration_multi.lvm --out out",
    ),
    "fit": (
        "fem-impact fit taps.lvm scene.toml --unknown contact.stiffness=1e4:1e9 --mass 0.1",
        "fem-impact fit studies/measured/acceleration_multi.lvm --propose --mass 0.15",
    ),
}  # fmt: skip


def epilog(command: str) -> str:
    """The end of a command's help: examples, each on an indented line, and how it may end."""
    can = (f"{number} {said}" for number, said in STATUSES.items() if number != Status.MISSED or command in MISSES)
    return "\n".join(["examples:", *(f"  {line}" for line in EXAMPLES[command]), "", f"exit status: {'; '.join(can)}"])


def schema(command: str) -> dict[str, Any]:
    """A JSON schema of what a command prints with --json."""
    keys = {**ALL, **KEYS[command]}
    properties: dict[str, Any] = {}
    for name, (kind, meaning) in keys.items():
        kinds = kind.rstrip("?").split("|")
        properties[name] = {"description": meaning}
        if kinds != ["any"]:
            properties[name] |= {"type": kinds[0] if len(kinds) == 1 else kinds}
    properties["command"] |= {"const": command}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"What `fem-impact {command} --json` prints",
        "type": "object",
        "properties": properties,
        "required": [name for name, (kind, _) in keys.items() if not kind.endswith("?")],
        "additionalProperties": False,
    }
