"""One wording for every input error, one place that decides what a valid number is."""

import difflib
import importlib
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

LONGEST = 500  # [-] characters of a foreign text quoted in a message


class SimulationError(RuntimeError):
    """A run could not keep its promise; the text says what failed and what to change."""


def _suffix(unit: str) -> str:
    return f" {unit}" if unit else ""


def number(name: str, value: Any, unit: str = "") -> float:
    """Return ``value`` as a finite float, or raise ValueError naming argument, rule and value."""
    scalar = isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "iuf"
    if isinstance(value, bool) or not (scalar or isinstance(value, (int, float, np.integer, np.floating))):
        raise ValueError(f"{name} must be a number{f' in {unit}' if unit else ''}, got {value!r:.80}")
    try:
        result = float(value)
    except OverflowError:
        raise ValueError(f"{name} must be finite, got an integer beyond the range of a float") from None
    if not math.isfinite(result):
        raise ValueError(f"{name} must be finite, got {result}{_suffix(unit)}")
    return result


def positive(name: str, value: Any, unit: str = "") -> float:
    """Return ``value`` as a finite float above zero."""
    result = number(name, value, unit)
    if result <= 0.0:
        raise ValueError(f"{name} must be positive, got {result:g}{_suffix(unit)}")
    return result


def non_negative(name: str, value: Any, unit: str = "") -> float:
    """Return ``value`` as a finite float, zero or more."""
    result = number(name, value, unit)
    if result < 0.0:
        raise ValueError(f"{name} must not be negative, got {result:g}{_suffix(unit)}")
    return result


def between(name: str, value: Any, low: float, high: float, unit: str = "") -> float:
    """Return ``value`` as a float with ``low <= value <= high``."""
    result = number(name, value, unit)
    if not low <= result <= high:
        raise ValueError(f"{name} must lie between {low:g} and {high:g}{_suffix(unit)}, got {result:g}{_suffix(unit)}")
    return result


def count(name: str, value: Any, low: int = 1) -> int:
    """Return ``value`` as an int of at least ``low``."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ValueError(f"{name} must be a whole number, got {value!r:.80}")
    if value < low:
        raise ValueError(f"{name} must be at least {low}, got {value}")
    return int(value)


def array(name: str, value: Any, shape: tuple[int | None, ...], unit: str = "") -> np.ndarray:
    """Return a new float array of the given shape (None: any length), or raise ValueError; every entry finite."""
    try:
        result = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be numbers{f' in {unit}' if unit else ''}, got {value!r:.80}") from None
    if result.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, result.shape)):
        wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
        raise ValueError(f"{name} must have shape {wanted}, got {result.shape}")
    if not np.isfinite(result).all():
        where = np.argwhere(~np.isfinite(result))[0]
        index = ", ".join(str(i) for i in where)
        raise ValueError(f"{name} must be finite, got {result[tuple(where)]} at index {index}")
    return result


def ascending(name: str, value: Any, unit: str = "") -> np.ndarray:
    """Return a new one-dimensional float array, zero or more and not decreasing."""
    result = array(name, value, (None,), unit)
    if result.size and result[0] < 0.0:
        raise ValueError(f"{name} must not be negative, got {result[0]:g}{_suffix(unit)}")
    if (np.diff(result) < 0.0).any():
        i = int(np.argmax(np.diff(result) < 0.0))
        raise ValueError(f"{name} must ascend, got {result[i]:g} before {result[i + 1]:g}{_suffix(unit)}")
    return result


def line(text: str) -> str:
    """Text that others chose, fit for a message: one printable line, not long."""
    safe = "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))
    return safe if len(safe) <= LONGEST else safe[:LONGEST] + " ..."


def one_of(name: str, value: Any, allowed: Iterable[str]) -> str:
    """Return ``value`` if it is one of the allowed words; otherwise suggest the nearest."""
    words = list(allowed)
    if isinstance(value, str) and value in words:
        return value
    raise ValueError(f"{name} must be one of {', '.join(words)}, got {value!r:.80}{nearest(value, words)}")


def nearest(word: Any, known: Iterable[str]) -> str:
    """Return '; did you mean ...?' for a near miss, else an empty string."""
    close = difflib.get_close_matches(str(word), list(known), n=1, cutoff=0.6)
    return f"; did you mean {close[0]!r}?" if close else ""


def lock_arrays(instance: Any) -> None:
    """Make every array field of a frozen dataclass read-only; frozen alone leaves contents writable."""
    for value in vars(instance).values():
        if isinstance(value, np.ndarray):
            value.setflags(write=False)


def extra(module: str, name: str, purpose: str) -> Any:
    """The module of an optional extra; ValueError says how to install it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise ValueError(f"{purpose} needs {package}: pip install 'fem-impact[{name}]'") from None
