"""The format of a scene file: its tables, their keys, and the public functions they call."""

import inspect
import json
import math
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any

from .. import mesh
from .._base import check
from ..fe.assembly import THEORIES, assemble
from ..fe.ribs import Rib
from ..fe.section import KINDS, PLANE, SOFT, Beam, Elastic, Material, Plate
from ..impact import collision
from ..impact.contact import MARKS, Contact
from ..impact.striker import STICK_MODES, Hand, Striker
from ..mesh import rise as rises
from ..modes.analytic import closed_form
from ..modes.finding import find_modes
from ..show import sound
from ..sweeps.cells import read_axis
from . import keys
from .fields import heights, over_frequency, tapered_size, varying_field

WORD = r"""(?:[\w-]++|"[^"\\\n]*+(?:\\.[^"\\\n]*+)*+"?|'[^'\n]*+'?)"""  # unclosed, too: each is passed once
DOTTED = re.compile(rf"{WORD}(?:[ \t]*+\.[ \t]*+{WORD}){{0,15}}+(?P<more>[ \t]*+\.[ \t]*+{WORD})?")  # a scene has two
# the last character of what is valid in a line, and what follows -> how it is written
SLIPS = (
    (r".[+-]?\.\d", "numbers begin with a digit, as 0.5 does"),
    (r"\d\.", "numbers end with a digit, as 5.0 does"),
    (r"\d,\d", "decimals stand behind a point"),
    (r"\d([eE]|\d)", "numbers are written as 3, 0.3 or 3e-3"),
    (r"\d[-+*/^]", "numbers are written out, not computed"),
    (r"\d[^],}]", "numbers stand alone, in SI units"),
    (r".(?i:true|false)\b", "true and false are written small"),
    (r".([^\W\d]|[“”„‘’«])", 'text stands between straight quotes, "so"'),
)
LARGEST_FILE = 1_000_000  # [byte] a scene is written by hand, so a larger file is a mistake


@dataclass(frozen=True)
class Part:
    """One table of a scene: the kind of function it calls, and the arguments."""

    kind: str = ""
    values: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


def _plate(material: Material, layers: Sequence[Any] = (), *, thickness: Any = None, tension: float = 0.0) -> Plate:
    """A plate."""
    if layers and thickness is not None:
        raise ValueError("thickness must be left out beside [[layer]] tables, whose thicknesses add up")
    if layers:
        return Plate.laminate(layers, tension=tension)
    if thickness is None:
        raise ValueError("thickness is missing; give it here, or write the plate's layers as [[layer]] tables")
    return Plate(material, varying_field("thickness", thickness, 2), tension)


def _made_within(name: str, value: Any, maker: Callable[..., Any]) -> Any:
    """What a table within another table makes; errors name it."""
    if not isinstance(value, Mapping):
        raise ValueError(f"{name} must be a table {{ {', '.join(keys_of(maker))} }}, got {check.shown(value)}")
    try:
        _check_keys("", "", dict(value), maker)
        return maker(**value)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def rise_of(value: Any) -> Callable[..., Any]:
    """The rise of a body: one of `RISES`, or a table of heights."""
    if not isinstance(value, Mapping) or ("table" in value) == ("shape" in value):
        words = "{ shape = ... } with the keys of the shape, or { table = a CSV file }"
        raise ValueError(f"rise must be a table {words}, got {check.shown(value)}")
    key = "table" if "table" in value else "shape"
    rest = {name: item for name, item in value.items() if name != key}
    if key == "table":
        return _made_within("rise", value, heights)
    return _made_within("rise", rest, RISES[check.one_of("rise.shape", value[key], RISES)])


def _with_rise(maker: Callable[..., Any]) -> Callable[..., Any]:
    """The same maker of meshes, with the rise of the unloaded surface as another argument."""

    def make(*, rise: Any = None, **values: Any) -> mesh.Mesh:
        made: mesh.Mesh = maker(**values)
        if rise is None:
            return made
        function = rise_of(rise)
        check.field("rise", function, made.points, "m")
        return replace(made, rise=function)

    return _with_keys(make, maker, {"rise": None})


def _own_material(material: Any, base: Material | None) -> Material:
    if material is None and base is None:
        raise ValueError("material is missing: give it here or as [material]")
    return base if material is None else _made_within("material", material, Material)  # type: ignore[return-value]


def _rib(
    base: Material | None = None, within: mesh.Mesh | None = None, *, path: Any = None, edge: str | None = None,
    line: str | None = None, offset: float | None = None, material: Any = None, **size: Any,
) -> Rib:  # fmt: skip
    """A bar along a line of a plate."""
    if [path, edge, line].count(None) != 2:
        raise ValueError("path, edge or line must be given, one of them: where the rib runs")
    for name, word, known in (("edge", edge, "edges"), ("line", line, "lines")):
        if word is not None and not isinstance(word, str):
            raise ValueError(f"{name} must be a name, got {check.shown(word)}")
        if word is not None and within is not None:
            check.one_of(name, word, getattr(within, known) or ["none: only drawings have lines"])
    if isinstance(path, str):
        raise ValueError(f"path must be a list of points, got {path!r}; an edge or a line has a key of its own")
    if line is not None:
        path = [[0.0, 0.0], [1.0, 0.0]] if within is None else within.lines[line]  # a stand-in, until there is a mesh
    section = _beam(_own_material(material, base), **{name: tapered_size(name, value) for name, value in size.items()})
    return Rib(path if edge is None else edge, section, offset)


def _layer(
    base: Material | None = None, *, thickness: float, angle: float = 0.0, material: Any = None
) -> tuple[Material, float, float]:
    """A layer of a plate."""
    angle = check.number("angle", angle, "rad")
    return _own_material(material, base), check.positive("thickness", thickness, "m"), angle


def _beam(material: Material, *, width: Any = None, height: Any = None, diameter: Any = None) -> Beam:
    """A beam of rectangular section, or of a round one."""
    width, height = varying_field("width", width, 1), varying_field("height", height, 1)
    diameter = varying_field("diameter", diameter, 1)
    if diameter is not None and width is None and height is None:
        return Beam.circular(material, diameter=diameter)
    if diameter is not None or width is None or height is None:
        raise ValueError("width and height must both be given, or diameter alone")
    return Beam.rectangular(material, width=width, height=height)


def _sphere(*, radius: float, E: float, nu: float, rho: float, yield_strength: float | None = None) -> Striker:
    """A solid ball, which does not vibrate itself."""
    return Striker.sphere(Material(E=E, nu=nu, rho=rho, yield_strength=yield_strength), radius)


def _with_keys(maker: Any, own: Any, optional: Mapping[str, Any]) -> Any:
    """A function of ``**values`` that shows, as the keys it takes, the arguments of another and optional ones more."""
    named = [each for each in inspect.signature(own).parameters.values() if each.kind is not each.VAR_KEYWORD]
    more = [inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=value) for key, value in optional.items()]
    maker.__doc__, maker.__signature__ = own.__doc__, inspect.Signature([*named, *more])
    return maker


def _bar(
    *, E: float, rho: float, length: float, left: str = "free", right: str = "free", at: float, nu: float = 0.3,
    theory: str = "euler", damping_ratio: float = 0.0, **size: Any,
) -> Striker:  # fmt: skip
    """A bar that bends, such as a plectrum or a stick held by one end."""
    section = _beam(Material(E=E, nu=nu, rho=rho), **size)
    body, held = mesh.line(length), {"left": left, "right": right}
    known = closed_form(body, section, held, check.one_of("theory", theory, THEORIES[1]))
    find = known or partial(find_modes, assemble(body, section, held, theory=theory))
    return replace(Striker.flexible(find(n_modes=STICK_MODES, damping_ratio=damping_ratio), at=at), fixed=False)


def _with_hand(maker: Any) -> Callable[..., Striker]:
    """The same maker of strikers, with gravity and a table {stiffness, damping, force} of the hand as arguments."""

    def make(*, hand: Any = None, gravity: float = 0.0, **values: Any) -> Striker:
        striker = maker(**values).falling(gravity)
        if hand is None:
            return striker
        return striker.held(_made_within("hand", hand, Hand))

    return _with_keys(make, maker, {"hand": None, "gravity": 0.0})


def target_values(**values: Any) -> dict[str, Any]:
    """Check the table [target], of which the scale is one entry; what is left out has its default in TARGET."""
    given = {**TARGET, **values}
    for key in set(given) - set(LISTED):
        given[key] = None if given[key] is None else keys.checked("target", key, given[key])
    scale = {key: given.pop(key) for key in ("mass", "first_frequency")}
    given["damping_ratio"] = over_frequency(given["damping_ratio"])
    for key, read in (("point_masses", _weight), ("point_supports", _post)):
        if not isinstance(given[key], (list, tuple)):
            words = f"{key} must be a list of tables such as [{{ at = [0.1, 0.2] }}]"
            raise ValueError(f"{words}, got {check.shown(given[key])}")
        given[key] = tuple(read(i, entry) for i, entry in enumerate(given[key]))
    return given | {"scale": {key: value for key, value in scale.items() if value is not None}}


def _weight(i: int, entry: Any) -> tuple[Any, float]:
    if not isinstance(entry, dict) or set(entry) != {"at", "mass"}:
        raise ValueError(f"point_masses[{i}] must have at and mass, got {check.shown(entry)}")
    return entry["at"], check.positive(f"point_masses[{i}].mass", entry["mass"], "kg")


def _post(i: int, entry: Any) -> tuple:
    if not isinstance(entry, dict) or set(entry) not in ({"at"}, {"at", "stiffness"}, {"at", "clamped"}):
        raise ValueError(
            f"point_supports[{i}] must have at and perhaps stiffness, or clamped, a radius; got {check.shown(entry)}"
        )
    if "clamped" in entry:
        return entry["at"], "clamped", check.positive(f"point_supports[{i}].clamped", entry["clamped"], "m")
    if "stiffness" not in entry:
        return entry["at"], "hinged"
    return entry["at"], check.positive(f"point_supports[{i}].stiffness", entry["stiffness"], "N/m")


def _observe(*, points: Any = None, listener: Any = None, listeners: Any = None) -> None:
    if points is None and listener is None and listeners is None:
        raise ValueError("points or listener must be given; add one or leave out the table")
    if points is not None and (not isinstance(points, list) or not points):
        raise ValueError(f"points must be a list of points such as [[0.1, 0.2]], got {check.shown(points)}")
    if listener is not None and listeners is not None:
        raise ValueError("listener must be left out beside listeners; add it to their list")
    if listeners is not None and (not isinstance(listeners, list) or not 0 < len(listeners) <= keys.MOST_LISTENERS):
        raise ValueError(
            f"listeners must be a list of 1 to {keys.MOST_LISTENERS} places such as [[0.1, 0.2, 1.0]], got "
            f"{check.shown(listeners)}"
        )
    for place in [listener] if listener is not None else listeners or []:
        sound.beside(place)


def stroke_values(
    *, when: float, at: Any = None, speed: float | None = None, lasts: float | None = None, striker: Any = None,
    contact: Any = None,
) -> None:  # fmt: skip
    """Check one table [[stroke]]: when [s] the striker is at the surface, and what differs from the other tables."""
    for name, value in (("when", when), ("speed", speed), ("lasts", lasts)):
        if value is not None:
            keys.checked("stroke", name, value)
    for name, value in (("striker", striker), ("contact", contact)):
        if value is not None and not isinstance(value, Mapping):
            raise ValueError(f"{name} must be a table with the keys of [{name}], got {check.shown(value)}")


def map_values(*, over: Any, max_frequency: Any = None) -> dict[str, Any]:
    """Check the table [map]: the values along each axis, and the upper end of the centroid's band [Hz]."""
    if not isinstance(over, dict) or not over:
        raise ValueError(f'over must be a table of axes such as "striker.mass" = [0.05, 0.1], got {check.shown(over)}')
    band = None if max_frequency is None else keys.checked("map", "max_frequency", max_frequency)
    return {"over": {name: read_axis(name, values) for name, values in over.items()}, "max_frequency": band}


TARGET: dict[str, Any] = {  # keys of [target] and their defaults; None: it says nothing
    "mass": None, "first_frequency": None, "nu": 0.3, "damping_ratio": 0.0, "point_masses": (), "point_supports": (),
    "source": "auto", "theory": None, "air": None, "baffle": True, "stretching": False, "model": "stated",
}  # fmt: skip
LISTED = ("damping_ratio", "point_masses", "point_supports")  # of these, what is more than a number, a word or a flag
RISES = {name: getattr(rises, name) for name in ("cap", "cylinder", "saddle", "cymbal")}
SIZES = dict.fromkeys(("width", "height", "diameter"))
# Functions that build each part of a scene; their arguments are the keys of its table.
# The first entry is the key that selects the function, '' if there is only one.
MAKERS: dict[str, tuple[str, dict[str, Callable[..., Any]]]] = {
    "mesh": ("shape", {
        "rectangle": _with_rise(mesh.rectangle), "disk": _with_rise(mesh.disk), "polygon": _with_rise(mesh.polygon),
        "outline": _with_rise(mesh.outline), "line": mesh.line, "file": _with_rise(mesh.load),
    }),
    "material": ("", {"": Material}),
    "section": ("kind", {"plate": _plate, "beam": _beam}),
    "layer": ("", {"": _layer}),
    "rib": ("", {"": _with_keys(_rib, _rib, SIZES)}),
    "target": ("", {"": _with_keys(target_values, target_values, TARGET)}),
    "striker": ("kind", {
        name: _with_hand(maker) for name, maker in {
            "rigid": Striker.rigid, "sphere": _sphere, "stick": Striker.stick, "hammer": Striker.hammer,
            "turning": Striker.turning,
            "bar": _with_keys(_bar, _bar, SIZES),
        }.items()
    }),
    "contact": ("kind", {
        "linear": Contact.linear, "hertz": Contact.hertz, "power": Contact.power,
        "restituting": Contact.restituting,
        **{law.name: getattr(Contact, law.name) for law in MARKS.values() if law.numbers},
        "between": Contact.between,
    }),
    "strike": ("", {"": collision.strike}),
    "stroke": ("", {"": stroke_values}),
    "observe": ("", {"": _observe}),
    "map": ("", {"": map_values}),
}  # fmt: skip
HOLDS = {"supports": (*KINDS, SOFT), "in_plane": PLANE}  # tables whose keys are edges, and how these may be held
TABLES = [*MAKERS, *HOLDS]
REQUIRED = ("mesh", "striker", "contact", "strike")
# arguments that come from other tables
SUPPLIED = {"material", "modes", "striker", "contact", "sphere", "plate", "start", "layers", "base", "within"}
REPEATED = "stroke"  # the table that may stand several times, written [[stroke]]
PARTS = ("layer", "rib")  # those of the body that may
NESTED = ("striker", "contact")  # tables that may stand within a stroke too
KEPT = {stroke_values: {*NESTED}, _rib: {"material"}, _layer: {"material"}}  # arguments that are keys nevertheless
OF_TARGET = {"stretching"}  # arguments of the strike that are keys of the table [target]
PATHS = ("source", "path")  # keys that name a file, relative to the scene file


def scene_error(path: Path, text: str) -> ValueError:
    """A ValueError of one line that names the file; cleans the text, as a scene may come from an untrusted source."""
    return ValueError(f"{check.line(str(path))}: {check.line(text)}")


def read_tables(path: Path) -> dict[str, Any]:
    """Tables of a TOML file as plain dicts; ValueError of one line if it is not valid TOML."""
    raw = read_bytes(path)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise scene_error(path, "a scene must be UTF-8 text; save it in that encoding") from None
    for key in DOTTED.finditer(text):
        if key["more"]:  # the time to parse it grows with the square of its length
            raise scene_error(
                path, f"a key must have at most 16 parts between dots, got {check.shown(key[0])} and more"
            )
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also integers of thousands of digits
        said = str(error).partition(" use sys.")[0].removesuffix(";")
        said = said.replace("Cannot overwrite a value", "the same key is given twice in one table")
        said = re.sub(r"Cannot declare \('(.*?)',?\) twice", r"the table [\1] stands twice", said)
        raise scene_error(path, f"not valid TOML: {said}{_slip(text, said)}") from None


def _slip(text: str, said: str) -> str:
    """The line at which a TOML file is not valid, and how what stands there is written, for the error that says so."""
    place = re.search(r"line (\d+), column (\d+)", said)
    if place is None:
        return ""
    line, column = text.replace("\r\n", "\n").split("\n")[int(place[1]) - 1], int(place[2]) - 1
    around = line[:column].rstrip()[-1:] + line[column:].lstrip()
    advice = []
    if "Unclosed" in said:
        advice = ["a comma or a bracket is missing, or a number has a unit"]
    elif "after a statement" in said or "Invalid value" in said:
        advice = [words for pattern, words in SLIPS if re.match(pattern, around)]
    return f" {check.shown(line.strip())}" + "".join(f"; {words}" for words in advice[:1])


def toml_text(tables: Mapping[str, Any]) -> str:
    """The text of a TOML file with these tables."""
    lines = [f"{key} = {_toml(value)}" for key, value in tables.items() if not isinstance(value, Mapping)]
    for name, table in tables.items():
        if isinstance(table, Mapping):
            lines += ["", f"[{name}]", *(f"{_toml(key)} = {_toml(value)}" for key, value in table.items())]
    return "\n".join(lines).strip() + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_toml(key)} = {_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, float):
        return repr(float(value))
    # the escapes of a JSON string are those of TOML, but for pairs of them, which make one sign, and for DEL
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def read_bytes(path: Path) -> bytes:
    """Contents of a scene or result file; if it does not exist, the ValueError suggests the nearest name."""
    if not path.is_file():  # refuses folders, and pipes that may never end
        folder = path.parent
        near = [name.name for name in islice(folder.iterdir(), 1000)] if folder.is_dir() and not path.exists() else []
        raise scene_error(path, check.absent(path) + check.nearest(path.name, near))
    with open(path, "rb") as file:
        raw = file.read(LARGEST_FILE + 1)
    if len(raw) > LARGEST_FILE:
        raise scene_error(path, f"the file must be smaller than {LARGEST_FILE} bytes; check that it is a scene")
    return raw


def read_list(path: Path, name: str, tables: Any) -> tuple[Part, ...]:
    """Read tables that may stand several times."""
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise scene_error(path, f"{name} must be tables, each written [[{name}]]")
    return tuple(read_part(path, name, table, Path(), f"[[{name}]] {i}") for i, table in enumerate(tables))


def read_strokes(path: Path, tables: Any, folder: Path) -> tuple[Part, ...]:
    """Read the tables [[stroke]]; what they say of striker and contact stays as it is written."""
    parts = read_list(path, REPEATED, tables)
    for i, (part, table) in enumerate(zip(parts, tables)):
        called = f"[[{REPEATED}]] {i}"
        try:
            stroke_values(**part.values)
        except ValueError as error:
            raise scene_error(path, f"{called} {error}") from None
        for name in NESTED:
            if name in table:
                read_part(path, name, table[name], folder, f"{called} {name}:")
    return parts


def read_part(path: Path, table: str, values: dict[str, Any], folder: Path, called: str = "") -> Part:
    """Read one table and check its keys against the arguments of its function; ValueError names file, table and key.

    File names in the table are relative to ``folder``. Errors call the table ``called``, by default [table].
    """

    def wrong(text: str) -> ValueError:
        return scene_error(path, f"{called or f'[{table}]'} {text}")

    try:
        bad = _not_finite(values)
    except RecursionError:
        raise wrong("is nested too deeply") from None
    if bad:
        raise wrong(f"{bad[0]} must be finite, got {bad[1]}")
    if table in HOLDS:
        words = HOLDS[table]
        for edge, support in values.items():
            if isinstance(support, dict) and table == "supports":
                try:
                    _check_keys("", "", support, Elastic)
                    Elastic(**support)
                except ValueError as error:
                    raise wrong(f"{edge}: {error}") from None
            elif support not in words:
                springs = " or { stiffness, rotation }" * (table == "supports")
                near = check.nearest(support, words)
                raise wrong(f"{edge} must be one of {', '.join(words)}{springs}, got {check.shown(support)}{near}")
        return Part("", MappingProxyType(values))
    selector, makers = MAKERS[table]
    values = dict(values)
    if selector and selector not in values:
        named = ", or give a name of the catalogue" if table == "striker" else ""
        raise wrong(f"{selector} is missing; it is one of {', '.join(makers)}{named}")
    kind = values.pop(selector) if selector else ""
    try:
        check.one_of(selector, kind, makers)
        _check_keys(selector, kind, values, makers[kind])
    except ValueError as error:
        raise wrong(str(error)) from None
    if table == "mesh":
        values.update({key: str(folder / values[key]) for key in PATHS if key in values})
        if isinstance(rise := values.get("rise"), Mapping) and isinstance(rise.get("table"), str):
            values["rise"] = {**rise, "table": str(folder / rise["table"])}
    return Part(kind, MappingProxyType(values))


def keys_of(maker: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """The arguments of a function that are keys of its table."""
    supplied = SUPPLIED | OF_TARGET if maker is collision.strike else SUPPLIED - KEPT.get(maker, set())
    return {n: p for n, p in inspect.signature(maker).parameters.items() if n not in supplied}


def _check_keys(selector: str, kind: str, values: dict[str, Any], maker: Callable[..., Any]) -> None:
    arguments = keys_of(maker)
    known = [selector, *arguments] if selector else list(arguments)
    for key in values:
        if key not in arguments:
            hint = check.nearest(key, known) or f"; it has {', '.join(known)}"
            raise ValueError(f"{key} is not a key of this table{hint}")
    for key, argument in arguments.items():
        if argument.default is inspect.Parameter.empty and key not in values:
            raise ValueError(f"{key} is missing" + (f" for {selector} = {kind!r}" if selector else ""))
    for key in PATHS:
        if key in values and selector == "shape" and not isinstance(values[key], str):
            raise ValueError(f"{key} must be the name of a file, got {check.shown(values[key])}")


def _not_finite(value: Any, name: str = "") -> tuple[str, float] | None:
    """Name and value of the first number in nested data that is not finite; None if all are."""
    if isinstance(value, dict):
        found = (_not_finite(item, f"{name}.{key}" if name else str(key)) for key, item in value.items())
    elif isinstance(value, list):
        found = (_not_finite(item, f"{name}[{i}]") for i, item in enumerate(value))
    else:
        return (name, value) if isinstance(value, float) and not math.isfinite(value) else None
    return next((hit for hit in found if hit), None)
