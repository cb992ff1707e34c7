"""Input checks: decide what a valid number is and word every input error the same way."""

import difflib
import functools
import html
import importlib
import inspect
import math
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from itertools import chain
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, TypeVar, get_args, get_origin

import numpy as np

from .explained import printable, with_headings

REACH = 1e75  # [-] largest number accepted; 1 / REACH is the smallest: the fourth power of both still fits a float
MOST = 10**9  # [-] largest count accepted: more items would not fit into memory
AXES = "", "(x)", "(x, y)", "(x, y, z)"  # coordinates of a point on a body of each dimension
SOURCES = {  # type -> how a user makes one, for error messages
    "Body": "fi.Body or fi.Body.load",
    "Comparison": "Response.against, Found.against or fi.band",
    "Contact": "fi.Contact.hertz, linear or power",
    "Figure": "fi.figures",
    "Found": "fi.fit",
    "Hand": "fi.Hand",
    "Material": "fi.Material",
    "Mesh": "fi.mesh",
    "Modes": "fi.find_modes, fi.analytic or fi.Modes",
    "Plan": "fi.plan",
    "Played": "Scene.run_strokes",
    "Response": "fi.strike or fi.collide",
    "Run": "Scene.run",
    "Scene": "fi.load_scene",
    "Spread": "fi.spread",
    "State": "Response.state",
    "Striker": "fi.Striker.rigid, sphere, stick or flexible",
    "Strokes": "fi.strokes",
    "System": "fi.assemble",
    "Touch": "fi.Touch",
}

EXTRAS: dict[str, tuple[str, ...]] = {  # extra: its purpose and the modules it needs
    "cad": ("drawings", "svgelements", "ezdxf"),
    "film": ("films as MP4 files", "imageio_ffmpeg"),
    "uff": ("universal files", "pyuff"),
    "nastran": ("results of Nastran", "pyNastran"),
    "ansys": ("results and matrices of Ansys", "ansys"),
    "calculix": ("results of CalculiX", "pyvista_frd"),
    "cluster": ("clusters and stores", "distributed", "zarr"),
    "hdf5": ("meshes in HDF5", "h5py"),
    "completion": ("shell completion", "shtab"),
    "spread": ("Sobol indices", "SALib"),
    "play": ("playing", "mido", "rtmidi", "sounddevice"),
    "web": ("report and explore", "plotly", "tornado", "jinja2"),
}

Function = TypeVar("Function", bound=Callable)


class SimulationError(RuntimeError):
    """A run missed its accuracy or failed; the text says what went wrong and what to change."""

    def __str__(self) -> str:
        return with_headings(super().__str__())


class ToleranceWarning(UserWarning):
    """A blow missed its tolerance; the text says by how much, why, and what would meet it."""


def _suffix(unit: str) -> str:
    return f" {unit}" if unit else ""


def shown(value: Any) -> str:
    """Any value as one line of at most 80 characters for a message."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to print an integer with thousands of digits
        text = f"a {type(value).__name__} too long to print"
    return line(text, 76)


def number(name: str, value: Any, unit: str = "", *, reach: float = REACH) -> float:
    """Return ``value`` as a float no larger than ``reach``, or raise ValueError."""
    scalar = isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "iuf"
    if isinstance(value, bool) or not (scalar or isinstance(value, (int, float, np.integer, np.floating))):
        raise ValueError(f"{name} must be a number{f' in {unit}' if unit else ''}, got {shown(value)}")
    try:
        result = float(value)
    except OverflowError:
        raise ValueError(f"{name} must be finite, got an integer beyond the range of a float") from None
    if not math.isfinite(result):
        raise ValueError(f"{name} must be finite, got {result}{_suffix(unit)}")
    if abs(result) > reach:
        raise ValueError(f"{name} must not exceed {reach:g}{_suffix(unit)} in magnitude, got {result:g}{_suffix(unit)}")
    return result


def positive(name: str, value: Any, unit: str = "", *, reach: float = REACH) -> float:
    """Return ``value`` as a float between 1 / ``reach`` and ``reach``."""
    result = number(name, value, unit, reach=reach)
    if result <= 0.0:
        raise ValueError(f"{name} must be positive, got {result:g}{_suffix(unit)}")
    if result * reach < 0.999:  # not 1.0: at the limit itself the product may round to just below 1
        raise ValueError(f"{name} must be at least {1.0 / reach:g}{_suffix(unit)}, got {result:g}{_suffix(unit)}")
    return result


def non_negative(name: str, value: Any, unit: str = "") -> float:
    """Return ``value`` as a float that is zero or passes `positive`."""
    result = number(name, value, unit)
    if result < 0.0:
        raise ValueError(f"{name} must not be negative, got {result:g}{_suffix(unit)}")
    return positive(name, result, unit) if result else result


def between(name: str, value: Any, low: float, high: float, unit: str = "") -> float:
    """Return ``value`` as a float with ``low <= value <= high``."""
    result = number(name, value, unit, reach=math.inf)
    if not low <= result <= high:
        raise ValueError(f"{name} must lie between {low:g} and {high:g}{_suffix(unit)}, got {result:g}{_suffix(unit)}")
    return result


def tolerance(value: Any) -> float:
    """Return the tolerance of a blow as a float; beyond rounding, none can be met."""
    return between("tolerance", value, 1e-12, 1.0)


def count(name: str, value: Any, low: int = 1, high: int = MOST) -> int:
    """Return ``value`` as an int from ``low`` to ``high``."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ValueError(f"{name} must be a whole number, got {shown(value)}")
    if value < low:
        raise ValueError(f"{name} must be at least {low}, got {shown(value)}")
    if value > high:
        raise ValueError(f"{name} must be at most {high}, got {shown(value)}")
    return int(value)


def flag(name: str, value: Any) -> bool:
    """Return ``value`` if it is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{name} must be True or False, got {shown(value)}")
    return bool(value)


def instance(name: str, value: Any, *kinds: type, other: str = "") -> Any:
    """Return ``value`` if it has one of these types; ValueError says how to make one, or ``other`` things."""
    if not isinstance(value, kinds):
        wanted = " or ".join(f"a {kind.__name__} of {SOURCES.get(kind.__name__, 'fem_impact')}" for kind in kinds)
        raise ValueError(f"{name} must be {wanted}{other}, got {shown(value)}")
    return value


def tuple_of(name: str, value: Any, *kinds: type) -> tuple:
    """Return ``value`` as a tuple, or raise ValueError unless it is a non-empty list or tuple of these types."""
    if not isinstance(value, (list, tuple)) or not value:
        raise ValueError(f"{name} must be a list of {' or '.join(kind.__name__ for kind in kinds)}, got {shown(value)}")
    return tuple(instance(f"{name}[{i}]", item, *kinds) for i, item in enumerate(value))


def texts(name: str, value: Any, count: int | None = None, each: str = "") -> list[str]:
    """Return ``value`` as a list of ``count`` texts, one for each of something."""
    if not isinstance(value, (list, tuple)) or not all(isinstance(text, str) for text in value):
        raise ValueError(f"{name} must be a list of texts, got {shown(value)}")
    if count is not None and len(value) != count:
        raise ValueError(f"{name} must have {count} entries, one for each {each}, got {len(value)}")
    return list(value)


def table(name: str, value: Any, example: str = "") -> dict[str, Any]:
    """Return ``value`` as a dict whose keys are texts; None gives an empty one."""
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise ValueError(f"{name} must be a dict of names{example}, got {shown(value)}")
    return dict(value)


def generator(value: Any) -> np.random.Generator:
    """A random generator from ``rng``, a seed or a generator."""
    if isinstance(value, np.random.Generator):
        return value
    seed = value if isinstance(value, (list, tuple)) else [value]
    if seed and all(isinstance(x, (int, np.integer)) and not isinstance(x, bool) and x >= 0 for x in seed):
        return np.random.default_rng(seed)
    raise ValueError(f"rng must be a numpy.random.Generator or a seed of whole numbers, got {shown(value)}")


def path(name: str, value: Any) -> Path:
    """Return ``value`` as a path, or raise ValueError if it cannot be a file name."""
    text = os.fspath(value) if isinstance(value, (str, os.PathLike)) else None
    # Linux allows 4096 bytes, and file systems 255 in a name
    try:
        if isinstance(text, str) and "\0" not in text and 0 < len(os.fsencode(text)) <= 4000:
            path = Path(text)
            if all(len(os.fsencode(part)) <= 255 for part in path.parts):
                return path
    except UnicodeEncodeError:
        pass
    raise ValueError(f"{name} must be the path of a file, got {shown(value)}")


def absent(path: Path) -> str:
    """Why a path that is not a regular file cannot be read."""
    if path.is_dir():
        return "it is a folder; name a file in it"
    return "it is not a regular file" if path.exists() else "there is no such file"


def typed(function: Function) -> Function:
    """Decorator: check arguments against the annotations of the signature.

    It checks the classes in `SOURCES`, paths, callables and bools; `Any` and numbers are left to the function. No
    library replaces it: beartype and typeguard take ten times as long to import as this module, refuse numpy's bools,
    and their errors cannot say how to make the right object.
    """
    checked: dict[str, tuple[tuple[Any, ...], tuple[type, ...]]] = {}
    parameters = inspect.signature(function).parameters
    for name, parameter in parameters.items():
        stated = parameter.annotation
        kinds = get_args(stated) if isinstance(stated, UnionType) else (stated,)
        ours = tuple(kind for kind in kinds if isinstance(kind, type) and kind.__name__ in SOURCES)
        functions = all(get_origin(kind) is Callable or kind is NoneType for kind in kinds)
        if ours or functions or Path in kinds or {bool} <= set(kinds) <= {bool, NoneType}:
            checked[name] = kinds, ours

    @functools.wraps(function)
    def tested(*given: Any, **named: Any) -> Any:
        for name, value in chain(zip(parameters, given), named.items()):
            if name not in checked or isinstance(value, checked[name][1]):
                continue
            kinds, ours = checked[name]
            if value is None and NoneType in kinds:
                continue
            if Path in kinds and (isinstance(value, (str, os.PathLike)) or not ours):
                path(name, value)
            elif ours:
                instance(name, value, *ours, other=" or the path of a file" if Path in kinds else "")
            elif bool in kinds:
                flag(name, value)
            elif not callable(value):
                raise ValueError(f"{name} must be a function, got {shown(value)}")
        return function(*given, **named)

    return tested  # type: ignore[return-value]


def array(name: str, value: Any, shape: tuple[int | None, ...], unit: str = "", *, lift: bool = False) -> np.ndarray:
    """Return a new float array of the given shape (None: any length), or raise ValueError; all entries are finite.

    ``lift`` adds missing dimensions in front: a single point (2,) becomes (1, 2).
    """
    result = numbers(name, value, unit)
    if lift and result.ndim < len(shape):
        result = result.reshape((1,) * (len(shape) - result.ndim) + result.shape)
    if result.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, result.shape)):
        wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
        raise ValueError(f"{name} must have shape {wanted}, got {result.shape}")
    return finite(name, result, unit)


def places(name: str, value: Any, dimension: int) -> np.ndarray:
    """Return one point or several on a body of a dimension as a new array (n_points, dimension) [m]."""
    if value is None:
        raise ValueError(f"{name} must be given, a point {AXES[dimension]} in m")
    raw = numbers(name, value, "m")
    if dimension == 1 and raw.ndim < 2:
        raw = raw.reshape(-1, 1)
    if raw.ndim < 2:
        if raw.shape != (dimension,):
            raise ValueError(f"{name} must be a point {AXES[dimension]} in m, got {shown(value)}")
        raw = raw[None]
    return finite(name, raw, "m") if raw.shape[1:] == (dimension,) else array(name, raw, (None, dimension), "m")


def on_body(name: str, points: np.ndarray, inside: np.ndarray, corners: np.ndarray) -> None:
    """Raise ValueError unless every point (n_points, dimension) [m] is inside the body, whose corners these are."""
    if not inside.all():
        lost = ", ".join(f"{x:g}" for x in points[~inside][0])
        low, high = corners.min(axis=0), corners.max(axis=0)
        extent = " x ".join(f"[{a:g}, {b:g}]" for a, b in zip(low, high))
        raise ValueError(
            with_headings(f"{name} must lie on the body, got ({lost}) m; the body extends over {extent} m")
        )


def band(name: str, value: Any, unit: str) -> tuple[float, float]:
    """Return ``value`` as two positive floats in ascending order."""
    low, high = (positive(name, end, unit) for end in array(name, value, (2,), unit))
    if low >= high:
        raise ValueError(f"{name} must be ascending, got {low:g} before {high:g} {unit}")
    return low, high


def finite(name: str, result: np.ndarray, unit: str = "") -> np.ndarray:
    """Return the array, or raise ValueError if an entry is not finite or exceeds `REACH` in magnitude."""
    good = np.abs(result) <= REACH
    if not good.all():
        where = np.argwhere(~good)[0]
        index, entry = ", ".join(str(i) for i in where), result[tuple(where)]
        rule = f"not exceed {REACH:g}{_suffix(unit)} in magnitude" if math.isfinite(entry) else "be finite"
        raise ValueError(f"{name} must {rule}, got {entry} at index {index}")
    return result


def numbers(name: str, value: Any, unit: str = "") -> np.ndarray:
    """Return a new float array of any shape, or raise ValueError."""
    try:
        raw = np.asarray(value)
        if raw.dtype.kind in "iufO":
            return np.where(np.ma.getmask(value), np.nan, np.array(raw, dtype=float))  # masked: not known
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(f"{name} must be numbers{f' in {unit}' if unit else ''}, got {shown(value)}")


def field(name: str, function: Any, points: np.ndarray, unit: str = "") -> np.ndarray:
    """Values (n_points,) of a user's function at points (n_points, ...), or ValueError if it returns anything else."""
    try:
        values = np.broadcast_to(numbers(name, function(points), unit), (len(points),))
    except (TypeError, ValueError, IndexError) as error:
        raise ValueError(f"{name} must be a function that returns numbers of shape ({len(points)},): {error}") from None
    return array(name, values, (None,), unit)


def ascending(name: str, value: Any, unit: str = "") -> np.ndarray:
    """Return a new one-dimensional float array, non-negative and in ascending order (equal neighbours allowed)."""
    result = array(name, value, (None,), unit)
    if result.size and result[0] < 0.0:
        raise ValueError(f"{name} must not be negative, got {result[0]:g}{_suffix(unit)}")
    if (np.diff(result) < 0.0).any():
        i = int(np.argmax(np.diff(result) < 0.0))
        raise ValueError(f"{name} must be ascending, got {result[i]:g} before {result[i + 1]:g}{_suffix(unit)}")
    for least in result[result > 0.0][:1]:
        positive(f"{name} above zero", least, unit)
    return result


def line(text: str, longest: int = 500) -> str:
    """Text from a file or another library, reduced to one printable line of limited length."""
    safe = printable(text)
    return safe if len(safe) <= longest else safe[:longest] + " ..."


def numeric(text: str) -> bool:
    """Whether a word of a file is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def one_of(name: str, value: Any, allowed: Iterable[str]) -> str:
    """Return ``value`` if it is one of the allowed words; the error suggests the closest one."""
    words = list(allowed)
    if isinstance(value, str) and value in words:
        return value
    raise ValueError(f"{name} must be one of {', '.join(words)}, got {shown(value)}{nearest(value, words)}")


def ending(value: Any, *allowed: str) -> str:
    """Return the ending of the argument ``path``, in small letters, if it is one of those allowed."""
    return one_of("path ending", path("path", value).suffix.lower(), allowed)


def nearest(word: Any, known: Iterable[str]) -> str:
    """Return '; did you mean ...?' for a near miss, else an empty string; an ending that all share is ignored."""
    ending, known = Path(str(word)).suffix, list(known)
    ending = ending if all(name.endswith(ending) for name in known) else ""
    names = {name.removesuffix(ending): name for name in known}
    close = difflib.get_close_matches(str(word).removesuffix(ending), list(names), n=1, cutoff=0.6)
    return f"; did you mean {names[close[0]]!r}?" if close else ""


class Brief:
    """A dataclass whose ``repr`` has at most 1000 characters: arrays by their shape, other objects by their class.

    Notebooks show its ``summary``, if it has one, or else what ``print`` shows.
    """

    def _repr_html_(self) -> str:
        text = "\n".join(getattr(self, "summary", self.__str__)().splitlines())
        return f'<pre style="white-space:pre-wrap">{html.escape(text)}</pre>'

    def __repr__(self) -> str:
        parts = []
        for each in fields(self):  # type: ignore[arg-type]
            value = getattr(self, each.name)
            if not each.repr or value is None:
                continue
            if isinstance(value, np.ndarray) and value.size > 4:  # more would not fit on a line
                text = f"array of shape {value.shape}"
            elif is_dataclass(value) or callable(value):
                text = getattr(value, "__name__", type(value).__name__)
            else:
                text = " ".join(shown(value).split())
            parts.append(f"{each.name}={text}")
        return f"{type(self).__name__}({line(', '.join(parts), 900)})"


def settle(instance: Any, **values: Any) -> None:
    """Set fields of a frozen dataclass to their checked values, which are floats whatever number the user passed."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def lock_arrays(instance: Any) -> None:
    """Make every array field of a frozen dataclass read-only; ``frozen=True`` alone does not protect the contents."""
    for value in vars(instance).values():
        if isinstance(value, np.ndarray):
            value.setflags(write=False)


class Locked(Brief):
    """A frozen dataclass whose arrays are read-only, too: ``frozen=True`` alone does not protect their contents."""

    __post_init__ = lock_arrays


def extra(module: str, name: str, purpose: str) -> Any:
    """Import a module of an optional extra; ValueError says how to install it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise ValueError(with_headings(f"{purpose} needs {package}: pip install 'fem-impact[{name}]'")) from None
