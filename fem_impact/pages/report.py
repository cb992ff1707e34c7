"""Writes one self-contained HTML page about a strike: the scene, the errors, the results and the sound."""

import json
import math
import os
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, markup
from .._base.explained import lines_of_notes
from ..impact import balance, promise, spectra
from ..impact.assumption import SILENT, Assumption
from ..impact.quantities import NAMES as QUANTITY_NAMES
from ..impact.quantities import rebound
from ..impact.response import Response
from ..mesh.mesh_files import boundary
from ..model.playing import Strokes
from ..modes import viewing
from ..scenes import hearing, sequence
from ..scenes.scene import Run, Scene, load_scene, scene_of
from ..scenes.schema import PATHS, read_bytes, scene_error
from ..scenes.sentences import arriving, body, contact, place, power, si, tidy, words
from ..scenes.sequence import Played
from ..show import export, sampling, sound
from ..show.figures import SPECTRUM_BAND
from .html_page import QUIET, audio, packed, script_data, write_page

POINTS = 1000  # [-] of a spectrum: about one per pixel of a wide page
BOUND = {"low": "estimate from below", "high": "estimate from above"}
MOST_POINTS = 4  # [-] largest number of observation points with a sound player
OPTIONS = {  # of `fem-impact strike`, by the argument of `Scene.run` that they stand for
    "tolerance": "--tolerance", "quantity": "--quantity", "target": "--target", "n_modes": "--n-modes",
    "size": "--size",
}  # fmt: skip


@check.typed
def read(path: str | Path) -> Scene:
    """Read the scene from a TOML file or from a result of `fem-impact strike` (response.json or its folder).

    File names in the scene are relative to the file that contains them. Raises ValueError if the extra ``web`` is
    missing, so that the user learns it before the work and not after it.
    """
    _tools()
    path = check.path("path", path)
    if path.is_dir():
        path = path / "response.json"
    if path.suffix.lower() != ".json":
        return load_scene(path)
    scene = None
    try:
        data = json.loads(read_bytes(path).decode("utf-8", "replace"))
        if isinstance(data, dict) and isinstance(data.get("scene"), dict):
            scene = scene_of(data["scene"], path, folder=path.parent)
    except (json.JSONDecodeError, RecursionError):  # RecursionError: lists nested too deeply
        pass
    if scene is None:
        raise scene_error(path, "not a result of `fem-impact strike`; give its response.json, or the scene's TOML file")
    for source in (scene.mesh.values[key] for key in PATHS if key in scene.mesh.values):
        if not os.path.isfile(source):  # unlike Path.is_file, returns False for invalid file names too
            raise scene_error(
                path, f"the file of the struck body is missing: restore {source}, or give the scene's TOML file"
            )
    return scene


def _tools() -> list[Any]:
    return [check.extra(module, "web", "a report") for module in ("jinja2", "plotly.offline")]


@check.typed
def write(path: str | Path, scene: Scene, run: Run | Played) -> None:
    """Write the page of a strike or of a sequence of strokes.

    Parameters
    ----------
    path : str or Path
        The HTML file to write.
    scene : Scene
    run : Run or Played
        From `Scene.run` with ``motion=True``, as the page shows the motion of the body; of strokes from
        `Scene.run_strokes`.

    Raises
    ------
    ValueError
        If the extra ``web`` is not installed, or ``run`` has no modes.
    """
    _, plotly = _tools()
    if isinstance(run, Run) and not run.rings:
        raise ValueError("run must have modes, because a report shows motion; strike with motion=True")
    response, facts = run.response, _of_blow(scene, run) if isinstance(run, Run) else _of_strokes(scene, run)
    judged = response.hits[response.hardest] if isinstance(response, Strokes) else response
    if isinstance(response, Strokes):
        total, own = power(response.error), ("strokes", str(len(response.strokes)))
    else:
        total = power(response.error.total) if response.error.resolvable else "not resolvable"
        own = "restitution", rebound(response, 4)
    said = f"Contact force over time: {response.n_impacts} impacts, peak {si(response.peak_force, 'N')}"
    shown = response.time <= sampling.end_of(response)
    write_page(
        path,
        "report.html",
        scripts=("report.js",),
        **facts,
        trust=tuple(judged.trust),
        assumptions=[_assumption(each) for each in judged.assumptions],
        reasons=[tidy(line) for line in run.plan.reasons],
        title=scene.title or scene.path.stem,
        picture=scene.picture(),
        observed=bool(scene.watched),
        tiles=[
            ("impacts", str(response.n_impacts)),
            ("peak force", si(response.peak_force, "N")),
            ("contact time", si(response.contact_time, "s")),
            ("impulse", si(response.impulse, "N s")),
            own,
            ("estimated error" if response.tolerance_met else "estimated error, above tolerance", total),
        ],
        response=response,
        verdict=_sentence(tidy(response.verdict)),
        sounds=_sounds(scene, response),
        files=_downloads(scene, run),
        modes_end=si(float(response.target.frequencies[-1]), "Hz"),
        command=_command(scene, run),
        force_picture=markup.curve(response.time[shown], response.force[shown], label="force", unit="N", title=said),
        data=script_data(_plots(response)),
        plotly=plotly.get_plotlyjs(),
        si=si,
        power=power,
        rough=_rough,
    )


def _of_blow(scene: Scene, run: Run) -> dict[str, Any]:
    """What the page states of a single blow only."""
    response, error = run.response, run.response.error
    parts = [
        ("time step", "from a second run of the same blow", error.step),
        ("modes left out", "from a run with fewer modes", error.truncation),
        ("finite elements", "from the frequency errors, weighted by energy", error.mesh),
    ]
    if error.measurement:
        parts.append(("measured responses", "from runs with shapes changed by their errors", error.measurement))
    scale = max(response.tolerance, *(value for _, _, value in parts))
    return {
        "words": (*lines_of_notes(run.notes), *words(scene, response)),
        "strokes": (), "outcome": response.outcome, "error": error.total,
        "energy_error": response.energy_error,
        "budget": [(name, how, value, max(0.0, min(1.0, value / scale))) for name, how, value in parts],
        "model": _sentence(tidy(response.model_verdict[0])),
        "modelled": _modelled(run, len(response.history.steps), response.scheme),
        "energies": _shares(
            response.energies, {"target": "struck body", "dissipated": balance.loss_in_words(response)}
        ),
    }  # fmt: skip


def _of_strokes(scene: Scene, run: Played) -> dict[str, Any]:
    """What the page states of a sequence only."""
    found = run.response
    kinds = [scene.alone(i).striker.kind for i in sequence.played_order(scene)]
    each = [[impact.impulse for impact in found.impacts if impact.contact == i] for i in range(len(kinds))]
    strokes = [
        {
            "striker": arriving(kind, stroke.striker), "when": si(stroke.when, "s"), "at": place(stroke.at),
            "speed": si(stroke.speed, "m/s"), "n_impacts": len(touches), "impulse": si(sum(touches), "N s"),
        }
        for kind, stroke, touches in zip(kinds, found.strokes, each)
    ]  # fmt: skip
    scale = max(found.tolerance, found.error)
    budget = [
        (" and ".join(map(str, who)), f"from {si(start, 's')}", hit.error.total, hit.error.total / scale)
        for start, hit, who in zip(found.starts.tolist(), found.hits, found.strikers)
        if who
    ]
    own, which = found.hits[found.hardest], " and ".join(map(str, found.strikers[found.hardest]))
    laws = dict.fromkeys(contact(stroke.contact) for stroke in found.strokes)
    played = f"It is struck {len(strokes)} times in {si(found.strokes[-1].when - found.strokes[0].when, 's')}."
    energies = {name: found.energies[name] for name in ("target", "contact", "dissipated", "taken away")}
    return {
        "words": (*lines_of_notes(found.notes), body(scene, found.target), played, *laws),
        "strokes": strokes, "outcome": found.hits[-1].outcome, "error": found.error,
        "energy_error": max(hit.energy_error for hit in found.hits),
        "budget": budget[:40],
        "model": f"The hardest, stroke {which}: {tidy(own.model_verdict[0])}",
        "modelled": _modelled(run, sum(len(hit.history.steps) for hit in found.hits), found.hits[0].scheme),
        "energies": _shares(energies, {"target": "struck body", "taken away": "strikers took away"}),
    }  # fmt: skip


def _command(scene: Scene, run: Run | Played) -> str:
    """What reproduces the blow: a command, or a line of Python if no option of a command says what was changed."""
    path, response = str(scene.path), run.response
    quoted = shlex.quote(f"./{path}" if path.startswith("-") else path)
    if scene.path.suffix.lower() == ".json":
        return f"fem-impact report {quoted} --tolerance {response.tolerance:g}"
    changes = dict(run.plan.changes) if isinstance(run, Run) else {}
    changes |= {"target": run.plan.target} if isinstance(run, Run) else {}
    changes |= {"tolerance": response.tolerance}
    if not set(changes) <= set(OPTIONS):
        given = ", ".join(f"{name}={value!r}" for name, value in changes.items())
        return f"fi.load_scene({path!r}).strike({given})"
    asked = changes.get("quantity", [])
    words = [(OPTIONS["quantity"], each) for each in ([asked] if isinstance(asked, str) else asked)]
    words += [(OPTIONS[name], f"{value}") for name, value in changes.items() if name != "quantity"]
    return " ".join(["fem-impact strike", quoted, *(f"{option} {shlex.quote(str(value))}" for option, value in words)])


def _assumption(each: Assumption) -> dict[str, Any]:
    """One row of the table of assumptions: its number, what it changes, and what helps."""
    changes = [  # in percent or as a power of ten
        f"{QUANTITY_NAMES.get(name, name)} {f'{100.0 * size:.2g} %' if size >= 1e-3 else _rough(size)}"
        for name, size in each.effect.items() if size
    ]  # fmt: skip
    changes += [f"not known: {each.why}"] if not each.known else []
    changes += ["beyond this estimate"] if each.beyond else []
    return {
        "name": each.name,
        "number": each.reading,
        "changes": changes or ["nothing"],
        "tone": "doubt" if each.beyond or not each.known else "",
        "remedy": each.remedy if each.doubtful or each.worst > SILENT or not each.known else "",
    }


def _sentence(clause: str) -> str:
    return clause[:1].upper() + clause[1:]


def _rough(size: float) -> str:
    """A size in one digit, as a power of ten."""
    return power(float(f"{size:.0e}"))


def _modelled(run: Run | Played, n_steps: int, scheme: str) -> list[tuple[str, str]]:
    modes, took = run.response.target, sum(run.seconds.values())
    return [
        ("modes of the struck body", f"{modes.n_modes}, up to {si(modes.frequencies[-1], 'Hz')}"),
        ("time steps", f"{n_steps}, scheme {scheme}"),
        ("computing time", f"{si(took, 's', 3)}: " + ", ".join(f"{k} {si(x, 's', 3)}" for k, x in run.seconds.items())),
    ]


def _shares(energies: Mapping[str, float], called: Mapping[str, str]) -> list[dict[str, Any]]:
    total = sum(max(value, 0.0) for value in energies.values()) or 1.0
    return [
        {"name": called.get(name, name), "key": name.replace("taken away", "striker"), "joule": joule,
         "part": max(joule, 0.0) / total}
        for name, joule in energies.items()
    ]  # fmt: skip


def _sounds(scene: Scene, response: Response | Strokes) -> list[dict[str, str]]:
    """Players of the sound at each observation point and, for a plate, each listener, by default 1 m in front of it."""
    # three seconds at most keep the page small; a sequence may take twelve
    duration = sampling.ringing_time(response.target, response.target.omega > 0.0, (sound.SHORTEST, 3.0))
    if not isinstance(response, Response):
        duration = min(duration + float(np.ptp(response.starts)), 12.0)
    found = [
        (f"Motion at {place(point)}", sound.synthesise(response, point, duration=duration))
        for point in scene.points[:MOST_POINTS]
    ]
    if response.target.dimension == 2 or scene.listeners:
        for listener in scene.listeners[:MOST_POINTS] or [[*np.asarray(response.at).tolist(), 1.0]]:
            where = f" to {place(listener)}" if scene.listeners else ", 1 m in front of the strike point"
            sounds = hearing.radiated(scene, response, listener, duration)
            for bound, pressure in zip(hearing.BOUNDS[len(sounds)], sounds):
                air = f" without a baffle, {BOUND[bound]}; {hearing.stated_level(sounds)}" if bound else ""
                found.append((f"Sound radiated{where}{air}", pressure))
    players, doubt = [], promise.doubt_of_sound(response, 0.5 * sound.RATE)
    pressed = isinstance(response, Response) and response.in_contact
    for name, samples in found:
        level = samples.peak_level
        stated = f"peak {samples.said}; full scale {samples.full_scale:g} {samples.unit}, as in every report"
        stated += f"; this {doubt}" if doubt else ""
        stated += "; the run ends in contact, after which the body rings as if let go" if pressed else ""
        players.append({"name": name, "note": stated, "uri": audio(samples.samples, samples.rate)})
        if -math.inf < level < QUIET:
            raised = audio(samples.samples * 10.0 ** (-level / 20.0), samples.rate)
            said = f"the same sound amplified by {-level:.1f} dB to full scale"
            players.append({"name": name, "note": said, "uri": raised})
    return players


@check.typed
def numbers(scene: Scene, run: Run | Played) -> dict[str, Any]:
    """Everything that was found, as plain data: what the page offers as response.json; arguments as of `write`."""
    tables = scene.data(tolerance=run.response.tolerance)
    if isinstance(run, Run):
        return export.run_data(run, tables)
    return sequence.sequence_numbers(run.response, tables, run.seconds)


def _downloads(scene: Scene, run: Run | Played) -> list[dict[str, str]]:
    response, modes = run.response, run.response.target
    frequencies = _frequencies(response)
    spectrum = response.spectrum(frequencies)
    data = numbers(scene, run)
    columns = {
        "force.csv": {"time [s]": response.time, "force [N]": response.force},
        "spectrum.csv": {
            "frequency [Hz]": frequencies, "real [N s]": spectrum.real, "imaginary [N s]": spectrum.imag
        },
        "modes.csv": {"frequency [Hz]": modes.frequencies, "damping ratio [-]": modes.damping_ratio},
    }  # fmt: skip
    texts = {"response.json": ("application/json", json.dumps(data, indent=2, allow_nan=False))}
    texts |= {name: ("text/csv", export.csv_text(**columns)) for name, columns in columns.items()}
    return [
        {"name": name, "size": si(len(text.encode()), "B", 3), "uri": markup.data_uri(kind, text.encode())}
        for name, (kind, text) in texts.items()
    ]


def _plots(response: Response | Strokes) -> dict[str, Any]:
    """The data that the page's script draws: histories, spectrum, energies, and shapes as packed integers."""
    modes, end = response.target, sampling.end_of(response)
    shown = response.time <= end
    frequencies = _frequencies(response)
    # for the mobility: as far as the modes reach, beyond which there are no resonances in it
    last = min(float(modes.frequencies[-1]) or np.inf, float(frequencies[-1]))
    known = np.geomspace(min(float(frequencies[0]), 0.5 * last), last, POINTS)
    moving = (modes.omega > 0.0) & (modes.frequencies < 2.0 * frequencies[-1])
    own: dict[str, Any] = {}
    if isinstance(response, Response):
        last, times = response.impacts[-1].end if response.impacts else 0.0, np.linspace(0.0, end, 400)
        rings = response.modal_energy([last])
        parts = {"x": times, **dict(zip(("striker", "body", "rest"), sampling.energies(response, times)))}
        own["energy"] = {name: _short(part) for name, part in parts.items()}
    else:
        rings = response.hits[-1].modal_energy([response.hits[-1].history.end_time])
    return own | {
        "force": {"x": _short(response.time[shown]), "y": _short(response.force[shown])},
        "impacts": [[impact.start, impact.end] for impact in response.impacts],
        "spectrum": {"x": _short(frequencies), "y": _short(np.abs(response.spectrum(frequencies)))},
        "natural": _short(modes.frequencies[(modes.omega > 0.0) & (modes.frequencies <= frequencies[-1])]),
        "mobility": {"x": _short(known), "y": _short(np.abs(spectra.mobility(modes, response.at, response.at, known)))},
        "modal": {"x": _short(modes.frequencies[moving]), "y": _short(rings[0, moving])},
        "view": _view(response, end),
    }


def _frequencies(response: Response | Strokes) -> np.ndarray:
    # the spectrum reaches at least three lobes of that of the shortest impact
    shortest = min((impact.duration for impact in response.impacts), default=1.0)
    return np.geomspace(SPECTRUM_BAND[0], max(SPECTRUM_BAND[1], 3.0 / shortest), POINTS)


def _view(response: Response | Strokes, end: float) -> dict[str, Any]:
    """The body as a surface, its motion over time and its first mode shapes, for the 3-D views."""
    modes = response.target
    points, cells, surface = sampling.surface(modes)
    rows = modes.shapes.at(points)  # (n_points, n_modes), evaluated once: finding the elements is the slow part
    times = np.linspace(0.0 if isinstance(response, Response) else float(response.time[0]), end, 72)  # three seconds
    wave = response.modal_state(times)[0] @ rows.T  # (n_times, n_points)
    assert response.at is not None
    count = min(12, modes.n_modes)  # more would double the size of the page
    shapes = rows[:, :count].T / np.maximum(np.abs(rows[:, :count]).max(axis=0), 1e-300)[:, None]
    rise, ribs = viewing.heights(modes, points), viewing.rib_sides(modes, points, cells)
    place = np.column_stack([surface, np.zeros(len(surface)) if rise is None else rise])
    under = viewing.places_in_space(modes, np.atleast_2d(response.at))[0, 2]
    columns = {
        "x": surface[:, 0], "y": surface[:, 1], "times": times, "frequencies": modes.frequencies[:count],
        "damping": modes.damping_ratio[:count],
    }  # fmt: skip
    first = int(np.abs(wave).max(axis=1).argmax())
    if isinstance(response, Response):  # several strikers would hide the wave
        first = sampling.clearest(response, times)
        columns["surface"] = response.displacement(response.at[None], times)[:, 0]
        columns["gap"] = sampling.gap(response, times)
    return {name: _short(values) for name, values in columns.items()} | {
        "cells": cells.T.tolist(),
        "rim": _lines(place[boundary(cells)]),
        **({"ribs": _lines(place[ribs])} if len(ribs) else {}),
        **({} if rise is None else {"rise": _short(rise), "under": float(under)}),
        "at": [float(response.at[0]), float(response.at[1]) if modes.dimension == 2 else 0.0],
        "first": first,
        "wave": _packed(wave),
        "shapes": _packed(shapes),
    }


def _lines(ends: np.ndarray) -> list[list[float | None]]:
    """Coordinates of separate lines with these ends (n, 2, 3) [m]."""
    return [[x for a, b in ends[:, :, i].tolist() for x in (a, b, None)] for i in range(3)]


def _packed(rows: np.ndarray) -> dict[str, Any]:
    """Rows as little-endian 16-bit integers and their unit: a tenth of the size of text."""
    step = float(np.abs(rows).max(initial=0.0)) / 32767.0 or 1.0
    return {"step": step, "rows": len(rows), "data": packed(np.round(rows / step), "<i2")}


def _short(values: np.ndarray) -> list[float]:
    """Numbers rounded to six digits, more than a screen can show; the downloads have all."""
    return [float(f"{value:.6g}") for value in np.asarray(values, float).tolist()]
