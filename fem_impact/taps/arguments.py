"""Checks of arguments that are texts, tables or seeds."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .._base import check


def texts(name: str, value: Any, count: int | None = None, each: str = "") -> list[str]:
    """Return ``value`` as a list of ``count`` texts, one for each of something."""
    if not isinstance(value, (list, tuple)) or not all(isinstance(text, str) for text in value):
        raise ValueError(f"{name} must be a list of texts, got {check.shown(value)}")
    if count is not None and len(value) != count:
        raise ValueError(f"{name} must have {count} entries, one for each {each}, got {len(value)}")
    return list(value)


def table(name: str, value: Any, example: str = "") -> dict[str, Any]:
    """Return ``value`` as a dict whose keys are texts; None gives an empty one."""
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise ValueError(f"{name} must be a dict of names{example}, got {check.shown(value)}")
    return dict(value)


def generator(value: Any) -> np.random.Generator:
    """A random generator from ``rng``, a seed or a generator."""
    if isinstance(value, np.random.Generator):
        return value
    seed = [value] if isinstance(value, (int, np.integer)) and not isinstance(value, bool) else value
    if isinstance(seed, (list, tuple)) and seed and all(
        isinstance(part, (int, np.integer)) and not isinstance(part, bool) and part >= 0 for part in seed
    ):  # fmt: skip
        return np.random.default_rng(seed if len(seed) > 1 else seed[0])
    raise ValueError(f"rng must be a numpy.random.Generator or a seed of whole numbers, got {check.shown(value)}")
