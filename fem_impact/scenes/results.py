"""Reads back what a strike wrote: the blow from response.npz, and what any folder of results holds."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, files, kept
from ..fe.section import Material
from ..impact.assumption import Assumption
from ..impact.compiled import layout
from ..impact.compiled.law import LAW
from ..impact.contact import Contact
from ..impact.error import Error
from ..impact.history import History
from ..impact.reduced_body import Ends
from ..impact.response import Response
from ..impact.stretched import Stretched
from ..impact.striker import Hand, Striker
from ..model.playing import Stroke, Strokes
from ..modes import unstated
from ..modes.modal import Modes
from ..modes.shapes import RigidShapes, SampledShapes, compliance_errors
from ..show import export
from ..sweeps import store
from .schema import scene_error
from .sentences import si

SAVED = "response.npz"  # beside response.json, whose text is its key: one of them alone, or changed, is refused
# fields that are not kept are functions, and descriptions of the body that only a blow needs
KINDS = kept.kinds(
    Assumption, Contact, Ends, Error, Hand, History, Material, Modes, Response, RigidShapes, SampledShapes, Stretched,
    Striker, Stroke, Strokes, left_out={"rings", "audit", "vectors", "poorer", "section"},
)  # fmt: skip


def save_response(folder: Path, found: Response | Strokes, points: Any, data: dict[str, Any]) -> None:
    """Write the data as response.json, and beside it what `load_response` needs.

    Of a sequence, the assumptions of its hardest blow are kept, which its verdict is about.
    """
    export.write_json(folder / "response.json", data)
    judged: Response
    whole: Response | Strokes
    if isinstance(found, Strokes):
        # its body is known at the points and where it was struck
        struck = np.array([np.atleast_1d(each.at) for each in found.strokes])
        places = np.unique(np.vstack([struck, *([points] if len(points) else [])]), axis=0)
        strokes = tuple(each._replace(striker=_striker_alone(each.striker)) for each in found.strokes)
        hits, target = tuple(_known_at(hit, places) for hit in found.hits), _at_points(found.target, struck[:1], places)
        judged, whole = found.hits[found.hardest], replace(found, target=target, strokes=strokes, hits=hits)
    else:
        judged, whole = found, _known_at(found, points)
    kept.pack(folder / SAVED, _key(folder), KINDS, response=whole, assumptions=judged.assumptions)


def _striker_alone(striker: Striker) -> Striker:
    """A striker known at its contact point only, by itself: among the bodies of a blow a hand may hold it."""
    return replace(striker, modes=_at_points(striker.modes, striker.at[None], ()))


def _known_at(response: Response, points: Any) -> Response:
    """A blow whose bodies are known where they touched and the last one at some points, too."""
    last = len(response.bodies) - 1
    places: dict[int, Any] = {last: points} if response.bodies[last].dimension else {}
    touched = [ends.points for ends in response.ends] or [np.atleast_2d(points[0])]  # nothing touched: it swings freely
    bodies = tuple(
        _at_points(modes, each, places.get(i, ())) for i, (modes, each) in enumerate(zip(response.bodies, touched))
    )
    rung, striker = response.target, response.striker
    return replace(
        response, bodies=bodies, rings=None, vectors=None,
        ringing=None if rung is response.bodies[last] else _at_points(rung, touched[last], points),
        striker=None if striker is None else _striker_alone(striker),
    )  # fmt: skip


def _at_points(modes: Modes, touched: np.ndarray, points: Any) -> Modes:
    """Modes known where the body was touched, and at some points; between these, compliance is an estimate."""
    if not modes.dimension:
        return replace(modes, shapes=RigidShapes(modes.mass, modes.n_modes))
    more = modes.points("points", points) if len(points) else np.zeros((0, modes.dimension))
    new = ~(more[:, None] == touched).all(axis=2).any(axis=1)
    places, n = np.vstack([touched, more[new]]), len(touched)
    values = modes.shapes.at(places)
    rest = np.column_stack(unstated.estimate_left_out(modes.omega, values, modes.mass, modes.dimension))
    known_errors, dents = compliance_errors(modes.shapes, touched), np.zeros((len(places), 2))
    rest[:n], rest[:n, 1], dents[:n] = 0.0, known_errors["compliance"], modes.shapes.dent(touched)
    static, flexible = modes.shapes.deflection(touched, places), modes.omega > 0.0
    known: dict[str, Any] = {"loads": np.arange(n), "carried": values[:, flexible] / modes.omega[flexible]}
    known["sideways"] = modes.shapes.across(places)
    return replace(modes, shapes=SampledShapes(places, values, static, rest=rest, dents=dents, **known))


def _key(folder: Path) -> str:
    """The text of response.json, of any length."""
    path = folder / "response.json"
    if not path.is_file():
        raise scene_error(path, f"{check.absent(path)}; give the folder that `fem-impact strike` wrote")
    return path.read_text(encoding="utf-8", errors="replace")


@check.typed
def load_response(folder: str | Path) -> Response | Strokes:
    """Read back the blow, or the sequence of strokes, that `fem-impact strike` wrote to a folder.

    Parameters
    ----------
    folder : str or Path
        The folder, or its response.json.

    Returns
    -------
    Response or Strokes
        With every number, the force and the spectrum at any time and frequency, and the motion of the body at the
        points that the scene observes and at the strike points. Mode shapes elsewhere are in modes.pvd.

    Raises
    ------
    ValueError
        If the folder holds no blow, or its files are damaged or do not belong together. Nothing in them is executed.

    Examples
    --------
    >>> from fem_impact import cli  # at a prompt: fem-impact strike studies/scenes/disk.toml --out out
    >>> status = cli.main(["strike", "studies/scenes/disk.toml", "--out", "out"])  # doctest: +ELLIPSIS
    Steel ball on a clamped steel disk
    ...
    >>> hit = fi.load_response("out")
    >>> round(hit.restitution, 3), hit.n_impacts
    (0.935, 1)
    """
    folder = check.path("folder", folder)
    folder = folder.parent if folder.suffix == ".json" else folder
    if not folder.is_dir():
        raise scene_error(folder, f"{files.no_folder(folder)}; give the one that `fem-impact strike` wrote")
    key = _key(folder)
    again = "strike the scene again"
    if not (folder / SAVED).is_file():
        raise scene_error(folder / SAVED, f"there is no such file, which a blow is read from; {again}")
    try:
        saved = kept.unpack(folder / SAVED, key, KINDS) or {}
        found, assumptions = saved["response"], saved["assumptions"]
        if not isinstance(found, Strokes):
            return _checked(found, assumptions)
        judged = [assumptions if i == found.hardest else None for i in range(len(found.hits))]
        return replace(found, hits=tuple(map(_checked, found.hits, judged)))
    except Exception:  # what somebody else packed may raise anything
        pass
    raise scene_error(folder / SAVED, f"it is damaged, or not of the response.json beside it; {again}")


def _checked(response: Any, assumptions: Any) -> Response:
    """The response, if its arrays fit together: compiled kernels trust their shapes. Its assumptions may be missing."""
    h = response.history
    c, n = h.shape.shape
    shapes = {
        "omega": (n,), "zeta": (n,), "bias": (n,), "start_q": (n,), "start_p": (n,), "end_q": (n,), "end_p": (n,),
        "offset": (c,), "work": (c,), "now": (6, c),
        "steps": (len(h.steps), layout.HEAD + (layout.WIDTH + 1) * c),
    }  # fmt: skip
    good = all(getattr(h, name).shape == shape and getattr(h, name).dtype == float for name, shape in shapes.items())
    good &= h.law.shape == (c,) and h.law.dtype == LAW
    good &= 0 < sum(modes.n_modes for modes in response.bodies) <= n and len(response.ends) in (0, len(response.bodies))
    if h.stretched is not None:
        m = h.stretched.forms.shape[1]
        good &= h.stretched.forms.shape[1:] == (m, m) and 0 <= h.stretched.first <= n - m
    if not good or not all(isinstance(each, Assumption) for each in assumptions or ()):
        raise ValueError("arrays of a response must fit together")
    return response if assumptions is None else replace(response, audit=partial(_stated_assumptions, assumptions))


def _stated_assumptions(assumptions: tuple[Assumption, ...], _: Response) -> tuple[Assumption, ...]:
    return assumptions


def describe(folder: Path) -> tuple[dict[str, Any], list[str]]:
    """What a folder of results or a store holds: as data, and in a few lines."""
    if not folder.is_dir():
        near = [] if folder.exists() else _names(folder.parent)
        raise scene_error(folder, files.no_folder(folder) + check.nearest(folder.name, near))
    names = _names(folder)
    if "zarr.json" in names and not (folder / "map.csv").exists():
        done, total = store.finished(folder)
        said = f"a store of a map or a spread: {done} of {total} blocks are finished"
        return {"holds": ["store"], "summary": [said], "files": names}, [said]
    data: dict[str, Any] = {"holds": [], "summary": [], "files": names}
    for name, (command, read) in READERS.items():
        if name in names:
            more, lines = read(folder / name)
            data |= more
            data["holds"].append(command)
            data["summary"] += [f"{command}: {lines[0]}", *(f"  {line}" for line in lines[1:])]
    if not data["holds"]:
        inner = next((name for name in names if set(READERS) & set(_names(folder / name))), None)
        hint = "the folder that --out named" if inner is None else f"one in it, such as {folder / inner}"
        raise scene_error(folder, f"no results of fem-impact are in it; give {hint}")
    return data, data["summary"]


def _names(folder: Path) -> list[str]:
    """What is in a folder, besides what is hidden."""
    found = folder.iterdir() if folder.is_dir() else ()
    return sorted(path.name for path in found if not path.name.startswith("."))


def _json(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8", errors="replace")) if path.is_file() else None
        if isinstance(data, dict):
            return data
    except (ValueError, RecursionError):  # ValueError: no JSON, or an integer of thousands of digits
        pass
    raise scene_error(path, "it is damaged: not the JSON that fem-impact wrote")


def _of_strike(path: Path) -> tuple[dict[str, Any], list[str]]:
    """A blow, or a sequence of strokes."""
    data = _json(path)
    kept_there = {name: data[name] for name in ("response", "sequence") if isinstance(data.get(name), dict)}
    if not kept_there:
        raise scene_error(path, "it is damaged: it has neither response nor sequence")
    blow = next(iter(kept_there.values()))
    count = blow.get("n_impacts")
    rebound = blow.get("restitution")
    numbers = [f"{count} impact{'s' if count != 1 else ''}"]
    numbers += [f"{name} {si(blow[key], unit)}" for key, (name, unit) in NUMBERS.items()
                if isinstance(blow.get(key), float)]  # fmt: skip
    numbers += [f"restitution {rebound:.5g}"] if isinstance(rebound, float) else []
    readable = [f"`fi.load_response({str(path.parent)!r})` reads it"] if path.with_name(SAVED).is_file() else []
    scene = data.get("scene")
    title = scene.get("title") if isinstance(scene, dict) else None
    said = [str(title or "a scene without title"), str(blow.get("verdict", "")), ", ".join(numbers), *readable]
    return kept_there, [line for line in said if line]


def _of_map(path: Path) -> tuple[dict[str, Any], list[str]]:
    import xarray  # no other folder of results needs it

    try:
        with xarray.open_dataset(path, engine="scipy" if path.suffix == ".nc" else "zarr") as table:
            counts = table["n_impacts"].load()
            title = str(table.attrs.get("title", ""))
    except Exception:  # what cannot be read raises many kinds of error
        raise scene_error(path, "it is damaged: not the map that fem-impact wrote") from None
    axes = ", ".join(f"{name} ({size})" for name, size in counts.sizes.items())
    single, failed = int((counts == 1).sum()), int((counts < 0).sum())
    lines = [f"{counts.size} blow{'s' * (counts.size != 1)} over {axes}: {single} hit once, {failed} failed"]
    return {}, [title, *lines] if title else lines


def _of_spread(path: Path) -> tuple[dict[str, Any], list[str]]:
    data = _json(path)
    title = data.get("title") or "a scene without title"
    return {}, [f"{title}", f"{data.get('blows')} blows, {data.get('failed')} failed"]


def _of_fit(path: Path) -> tuple[dict[str, Any], list[str]]:
    found = _json(path).get("summary")
    return {}, [str(line) for line in found] if isinstance(found, list) and found else ["a fit of measured taps"]


NUMBERS = {"contact_time": ("contact time", "s"), "peak_force": ("peak force", "N"), "impulse": ("impulse", "N s")}
Reader = Callable[[Path], tuple[dict[str, Any], list[str]]]
READERS: dict[str, tuple[str, Reader]] = {  # file: the command that wrote it, and the function that says what is in it
    "response.json": ("strike", _of_strike), "map.nc": ("map", _of_map), "map.zarr": ("map", _of_map),
    "spread.json": ("spread", _of_spread), "fit.json": ("fit", _of_fit),
    "report.html": ("report", lambda path: ({}, [f"{path} is a page to open in a browser"])),
}  # fmt: skip
