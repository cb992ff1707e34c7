"""What `fem-impact frf` and `fem-impact fit` do, apart from printing."""

from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from .._base import check
from .._base.files import staged_folder, write_whole
from ..impact.contact import Contact
from ..impact.striker import Striker
from ..modes import picked
from ..scenes.scene import Scene, load_scene
from ..scenes.schema import toml_text
from ..show import export
from . import transfer
from .fit import fit as fit_taps
from .found import Found, Watch
from .proposal import Proposal, propose
from .records import Taps, read_taps
from .rig import measure

UNKNOWN = {"contact.stiffness": (1e2, 1e16), "contact.exponent": (1.0, 4.0), "contact.loss": (0.0, 10.0)}


def taps_of(options: Any, path: Path | None = None) -> Taps:
    """The taps of a file, by default the one named first, read as the options say."""
    names: Any = options.response
    if names is not None:
        names = [int(name) if name.isdigit() else name for name in names]
    force = int(options.force) if options.force is not None and options.force.isdigit() else options.force
    return read_taps(path or options.scene, force=force, response=names, rate=options.rate, scale=options.scale)


class Responses(NamedTuple):
    """Frequency responses, and what they come from."""

    found: xr.Dataset
    notes: tuple[str, ...] = ()
    taps: Taps | None = None
    scene: Scene | None = None  # that was measured


def frf(options: Any) -> Responses:
    """Frequency responses of a file of taps, or of a scene measured at its observation points."""
    scene = None
    if options.scene.suffix.lower() == ".toml":
        scene = load_scene(options.scene)
        hit = scene.run(target="modal").response
        rate = 51200.0 if options.rate is None else options.rate  # 2.56 times 20 kHz, usual for analysers
        taps = measure(hit, rate=rate, at=scene.points, duration=1.0)  # resolves peaks 1 Hz apart
    else:
        try:
            taps = taps_of(options)
        except ValueError:  # a universal file may hold frequency responses already
            with suppress(ValueError):
                return Responses(transfer.frf(options.scene))
            raise
    found = transfer.frf(
        taps, method=options.method, force_window=options.force_window, response_window=options.response_window
    )
    return Responses(found, taps.notes, taps, scene)


def peaks(found: xr.Dataset) -> list[dict[str, Any]]:
    """The largest peaks of each response: frequency [Hz], magnitude, unit; coherence and error, None if not known.

    Peaks smaller than their error are left out.
    """
    rows = []
    for k, name in enumerate(found["channel"].values):
        size = np.abs(found["H"].values[1:, k])
        places = picked.peaks(size)
        if "error" in found:
            places = places[~(found["error"].values[1 + places, k] >= size[places])]
        largest = np.sort(places[np.argsort(-size[places])][:20])  # more do not fit a screen
        for i in largest:
            sure = [float(found[x].values[1 + i, k]) if x in found else None for x in ("coherence", "error")]
            rows.append({
                "response": str(name), "frequency": float(found["frequency"].values[1 + i]),
                "magnitude": float(size[i]), "unit": str(found["units"].values[k]), "coherence": sure[0],
                "error": None if sure[1] is None or np.isnan(sure[1]) else sure[1],
            })  # fmt: skip
    return rows


def write_frf(path: Path, found: xr.Dataset) -> None:
    """Write frequency responses as .csv (real and imaginary parts, coherence) or .uff (data set 58)."""
    ending = check.ending(path, ".csv", ".uff")
    with staged_folder(path.parent) as staging:
        if ending == ".uff":
            transfer.write_uff(staging / path.name, found)
            return
        columns = {"frequency [Hz]": found["frequency"].values}
        for k, name in enumerate(found["channel"].values):
            values, unit = found["H"].values[:, k], found["units"].values[k]
            columns |= {f"{name} real [{unit}]": values.real, f"{name} imaginary [{unit}]": values.imag}
            sure = {"coherence": "coherence", "error": f"error [{unit}]"}
            columns |= {f"{name} {said}": found[x].values[:, k] for x, said in sure.items() if x in found}
        (staging / path.name).write_text(export.csv_text(**columns), encoding="utf-8")


def _pairs(name: str, texts: list[str]) -> dict[str, list[float]]:
    """NAME=LOW:HIGH or NAME=VALUE of the command line."""
    found = {}
    for text in texts:
        key, _, values = text.partition("=")
        try:
            found[key] = [float(value) for value in values.split(":")]
        except ValueError:
            found[key] = []
        if len(found[key]) != (2 if name == "unknown" else 1):
            form = "NAME=LOW:HIGH" if name == "unknown" else "NAME=VALUE"
            raise ValueError(f"--{name} must read {form}, got {text!r}")
    return found


def fit(options: Any, watch: Watch | None) -> tuple[Found, Scene | None, Proposal | None]:
    """The fit of a file of taps; the scene struck, None for a wall; and what was tried if the model is asked for."""
    striker = Striker.rigid(0.1 if options.mass is None else options.mass)  # a usual modal hammer, if nothing is said
    if options.propose:
        for name in ("unknown", "known", "per_tap", "body"):
            if getattr(options, name):
                name = "SCENE" if name == "body" else f"--{name.replace('_', '-')}"
                raise ValueError(f"{name} must be left out beside --propose, which tries unknowns and laws itself")
        proposal = propose(taps_of(options), striker=striker, watch=watch)
        return proposal.found, None, proposal
    unknown = {name: tuple(limits) for name, limits in _pairs("unknown", options.unknown).items()} or UNKNOWN
    known = {name: value for name, (value,) in _pairs("known", options.known).items()}
    taps = taps_of(options)
    given: dict[str, Any] = {"striker": striker, "contact": Contact.hertz(1e7)}
    scene = None
    if options.body is not None:
        scene = load_scene(options.body)
        given |= {"target": scene.modes(), "at": scene.blow.values["at"], "contact": scene.make_contact()}
        if options.mass is None:
            given["striker"] = scene.make_striker()
    return fit_taps(taps, unknown=unknown, known=known, per_tap=options.per_tap, watch=watch, **given), scene, None


@check.typed
def write_scene(path: str | Path, found: Found, scene: Scene | None = None) -> tuple[str, ...]:
    """Write the scene file; the body struck is that of ``scene`` or, for taps on a wall, a plate as heavy as one.

    Returns what could not be kept. The file says in its first lines which values the data did not determine.
    """
    hammer, law = found.striker, found.contact
    notes = []
    if hammer.modes.n_modes > 1:
        notes.append("the hammer is written as its rigid mass: its modes are left out")
    speed = float(np.mean(found.problem.speeds(found.best.x)))
    strike: dict[str, Any] = {"speed": speed}
    if scene is None:
        if found.problem.setting.target is not None or len(found.problem.setting.structure(found.point).omega):
            raise ValueError("scene must be given: the struck body of these taps is known at its strike point only")
        made: dict[str, Any] = {
            "title": "Hammer and tip found from measured taps, on a wall",
            "mesh": {"shape": "rectangle", "length": 1.0, "width": 0.8},
            # for a wall: it gains two millionths of the hammer's speed, and bends at 200 times the rate of 0.1 ms
            "target": {"mass": 1e6 * hammer.felt_mass, "first_frequency": 1e6},
            "supports": {"boundary": "free"},
        }
        strike |= {"at": [0.5, 0.4], "tolerance": 1e-4}
    else:
        made = scene.data()
        made.pop("map", None)
        strike = dict(made.pop("strike")) | strike
    made["striker"] = {"kind": "rigid", "mass": hammer.felt_mass}
    made["contact"] = law.table
    made["strike"] = strike
    lines = [f"# {line}" for line in (*found.summary().splitlines(), *notes)]
    write_whole(path, "\n".join(lines) + "\n\n" + toml_text(made))
    return tuple(notes)


def write_files(
    folder: Path, found: Found, scene: Scene | None, proposal: Proposal | None
) -> tuple[dict[str, Any], list[str]]:
    """Write fit.json and, if the body struck is known, scene.toml; return the data and the names of the files."""
    said: dict[str, Any] = {"summary": (proposal or found).summary().splitlines(), "versions": export.versions()}
    said |= {} if proposal is None else {"tried": [asdict(each) for each in proposal.tried]}
    data = export.plain(found.data() | said)
    export.write_json(folder / "fit.json", data)
    files = ["fit.json"]
    modes = [name for name in found.names if name.startswith("mode")]
    if scene is not None or not (modes or "target.mass" in found.names):
        write_scene(folder / "scene.toml", found, scene)
        files.append("scene.toml")
    return data, files
