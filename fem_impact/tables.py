"""What a scene file may say: its tables, their keys, and the public functions they stand for."""

import inspect
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from . import _check, integrator, mesh, sound
from .contact import Contact
from .section import Beam, Material, Plate
from .striker import Striker

LARGEST_FILE = 1_000_000  # [byte] a scene is written by hand; more is a mistake, refused before it is read


@dataclass(frozen=True)
class Part:
    """One table of a scene: which public function it stands for and the arguments it gives."""

    kind: str = ""
    values: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


def _beam(material: Material, *, width: Any = None, height: Any = None, diameter: Any = None) -> Beam:
    if diameter is not None and width is None and height is None:
        return Beam.circular(material, diameter=diameter)
    if diameter is not None or width is None or height is None:
        raise ValueError("width and height must both be given, or diameter alone")
    return Beam.rectangular(material, width=width, height=height)


def _sphere(*, radius: float, E: float, nu: float, rho: float) -> Striker:
    return Striker.sphere(Material(E=E, nu=nu, rho=rho), radius)


def target_values(*, mass=None, first_frequency=None, nu=0.3, damping_ratio=0.0, source="auto") -> dict[str, Any]:
    """The table [target], checked: what to scale to, nu where there is no material, damping and source."""
    _check.between("nu", nu, -1.0, 0.5)
    _check.non_negative("damping_ratio", damping_ratio)
    scale = {"mass": (mass, "kg"), "first_frequency": (first_frequency, "Hz")}
    given = {name: _check.positive(name, value, unit) for name, (value, unit) in scale.items() if value is not None}
    return {
        "scale": given,
        "nu": nu,
        "damping_ratio": damping_ratio,
        "source": _check.one_of("source", source, SOURCES),
    }


def _observe(*, points: Any = None, listener: Any = None) -> None:
    if points is None and listener is None:
        raise ValueError("points or listener must be given, or the table left out")
    if points is not None and (not isinstance(points, list) or not points):
        raise ValueError(f"points must be a list of points such as [[0.1, 0.2]], got {_check.shown(points)}")
    if listener is not None:
        sound.beside(listener)


def map_values(*, over: Any, max_frequency: Any = None) -> dict[str, Any]:
    """The table [map], checked: values along each axis, and the band of the spectral centroid [Hz]."""
    if not isinstance(over, dict) or not over:
        raise ValueError(f'over must be a table of axes such as "striker.mass" = [0.05, 0.1], got {_check.shown(over)}')
    band = None if max_frequency is None else _check.positive("max_frequency", max_frequency, "Hz")
    return {"over": {name: _along(name, values) for name, values in over.items()}, "max_frequency": band}


def _along(name: str, values: Any) -> np.ndarray:
    """Values along an axis: a list, or a range {from, to, count, scale}."""
    if isinstance(values, list):
        return np.array(values)
    if not isinstance(values, dict) or not {"from", "to", "count"} <= set(values) <= {"from", "to", "count", "scale"}:
        raise ValueError(
            f"{name} must be a list or {{ from, to, count, scale = 'linear' or 'log' }}, got {_check.shown(values)}"
        )
    low, high = _check.number(f"{name}.from", values["from"]), _check.number(f"{name}.to", values["to"])
    count = _check.count(f"{name}.count", values["count"], high=MOST_VALUES)
    if _check.one_of(f"{name}.scale", values.get("scale", "linear"), ("linear", "log")) == "linear":
        return np.linspace(low, high, count)
    return np.geomspace(_check.positive(f"{name}.from", low), _check.positive(f"{name}.to", high), count)


MOST_VALUES = 10**6  # [-] along one axis of a map
SOURCES = ("auto", "fe", "analytic")
# What makes each part of a scene: the keys of its table are the arguments of these functions, no list is kept twice.
# A table whose first entry is not empty names its maker by that key.
MAKERS: dict[str, tuple[str, dict[str, Callable[..., Any]]]] = {
    "mesh": (
        "shape",
        {
            "rectangle": mesh.rectangle,
            "disk": mesh.disk,
            "polygon": mesh.polygon,
            "outline": mesh.outline,
            "line": mesh.line,
            "file": mesh.load,
        },
    ),
    "material": ("", {"": Material}),
    "section": ("kind", {"plate": Plate, "beam": _beam}),
    "target": ("", {"": target_values}),
    "striker": ("kind", {"rigid": Striker.rigid, "sphere": _sphere, "stick": Striker.stick}),
    "contact": (
        "kind",
        {
            "linear": Contact.linear,
            "hertz": Contact.hertz,
            "power": Contact.power,
            "restituting": Contact.restituting,
            "between": Contact.between,
        },
    ),
    "strike": ("", {"": integrator.strike}),
    "observe": ("", {"": _observe}),
    "map": ("", {"": map_values}),
}
TABLES = [*MAKERS, "supports"]
REQUIRED = ("mesh", "striker", "contact", "strike")
SUPPLIED = {"material", "modes", "striker", "contact", "sphere", "plate"}  # arguments that come from other tables
SUPPORTS = ("clamped", "hinged", "free")
PATHS = ("source", "path")  # keys that name a file, relative to the scene


def fault(path: Path, text: str) -> ValueError:
    """One line naming the file, whatever a key or a value holds: a scene may come from anyone."""
    return ValueError(f"{_check.line(str(path))}: {_check.line(text)}")


def read_tables(path: Path) -> dict[str, Any]:
    """The tables of a TOML file as plain dicts; ValueError in one line where it is none."""
    raw = read_bytes(path)
    try:
        return tomllib.loads(raw.decode("utf-8"))
    except UnicodeDecodeError:
        raise fault(path, "a scene must be UTF-8 text") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise fault(path, f"not valid TOML: {error}") from None


def read_bytes(path: Path) -> bytes:
    """What is in a scene or result; ValueError where there is none, with the nearest name there is."""
    if not path.is_file():  # a folder, or a pipe that might never end
        folder = path.parent
        near = [name.name for name in islice(folder.iterdir(), 1000)] if folder.is_dir() else []
        raise fault(path, f"there is no such file{_check.nearest(path.name, near)}")
    with open(path, "rb") as file:
        raw = file.read(LARGEST_FILE + 1)
    if len(raw) > LARGEST_FILE:
        raise fault(path, f"it must be smaller than {LARGEST_FILE} bytes")
    return raw


def read_part(path: Path, table: str, values: dict[str, Any], folder: Path) -> Part:
    """One table with its keys checked against what its function takes; ValueError names file, table and key.

    File names in it are relative to ``folder``.
    """

    def wrong(text: str) -> ValueError:
        return fault(path, f"[{table}] {text}")

    try:
        bad = _not_finite(values)
    except RecursionError:
        raise wrong("is nested too deeply") from None
    if bad:
        raise wrong(f"{bad[0]} must be finite, got {bad[1]}")
    if table == "supports":
        for edge, support in values.items():
            if support not in SUPPORTS:
                raise wrong(f"{edge} must be one of {', '.join(SUPPORTS)}, got {_check.shown(support)}")
        return Part("", MappingProxyType(values))
    selector, makers = MAKERS[table]
    values = dict(values)
    if selector and selector not in values:
        raise wrong(f"{selector} is missing; it is one of {', '.join(makers)}")
    kind = values.pop(selector) if selector else ""
    try:
        _check.one_of(selector, kind, makers)
        _check_keys(selector, kind, values, makers[kind])
    except ValueError as error:
        raise wrong(str(error)) from None
    if table == "mesh":
        values.update({key: str(folder / values[key]) for key in PATHS if key in values})
    return Part(kind, MappingProxyType(values))


def _check_keys(selector: str, kind: str, values: dict[str, Any], maker: Callable[..., Any]) -> None:
    arguments = {n: p for n, p in inspect.signature(maker).parameters.items() if n not in SUPPLIED}
    known = [selector, *arguments] if selector else list(arguments)
    for key in values:
        if key not in arguments:
            hint = _check.nearest(key, known) or f"; it has {', '.join(known)}"
            raise ValueError(f"{key} is not a key of this table{hint}")
    for key, argument in arguments.items():
        if argument.default is inspect.Parameter.empty and key not in values:
            raise ValueError(f"{key} is missing" + (f" for {selector} = {kind!r}" if selector else ""))
    for key in PATHS:
        if key in values and selector == "shape" and not isinstance(values[key], str):
            raise ValueError(f"{key} must be the name of a file, got {_check.shown(values[key])}")


def _not_finite(value: Any, name: str = "") -> tuple[str, float] | None:
    """Name and value of the first number in nested data that is not finite."""
    if isinstance(value, dict):
        found = (_not_finite(item, f"{name}.{key}" if name else str(key)) for key, item in value.items())
    elif isinstance(value, list):
        found = (_not_finite(item, f"{name}[{i}]") for i, item in enumerate(value))
    else:
        return (name, value) if isinstance(value, float) and not math.isfinite(value) else None
    return next((hit for hit in found if hit), None)
