"""Which channels of a recording are the force and the responses, and what they are in SI."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .._base import check
from . import readers, units


def in_si(
    found: readers.Recording, file: str, force: Any, response: Any, scale: Any, given: Mapping[str, str] | None
) -> tuple[list[tuple[np.ndarray, np.ndarray]], list[str], list[str], list[str]]:
    """Force (n_samples,) and responses (n_samples, n_responses) of every segment of a file in SI, names and units of
    the responses, and what was assumed."""
    unit = stated_units(found, given)
    struck = force_channel(found, force, unit, file)
    others = response_channels(found, response, unit, struck)
    if isinstance(scale, Mapping):
        table = check.table("scale", scale)
        stated = {find_channel("scale", name, found): check.number(f"scale of {name}", x) for name, x in table.items()}
    else:
        stated = {} if scale is None else {struck: check.number("scale", scale)}
    if 0.0 in stated.values():
        raise ValueError("scale must not be zero: it is what the numbers of a channel are multiplied with")
    factors: list[float] = []
    kinds: list[str] = []
    unread = [i for i in set(range(len(unit))) - {struck, *others} if units.RESPONSE_NAMES.search(found.names[i])]
    notes = [
        f"{found.names[i]}: not read, as {unit[i]!r} is no known unit of motion; give units, or response and scale"
        for i in unread if response is None and unit[i]
    ]  # fmt: skip
    for i in (struck, *others):
        known = units.si_unit(unit[i])
        kinds.append("N" if i == struck and not kinds else known[0] if known and known[0] != "N" else "m/s^2")
        value, said = factor(found.names[i], unit[i], kinds[-1], stated.get(i), file)
        factors.append(value)
        notes += said
    pushed = [segment[:, struck] * factors[0] for segment in found.segments]
    rested = [row - np.median(row) for row in pushed]  # an offset may exceed the taps
    if max(map(_push, rested)) < max(_push(-row) for row in rested):
        notes.append("the force is mostly negative and was turned around")
        pushed = [-row for row in pushed]
    moved = [segment[:, others] * np.array(factors[1:]) for segment in found.segments]
    short = [units.label(found.names[i])[0] for i in others]
    short = short if len(set(short)) == len(short) else [found.names[i] for i in others]
    return list(zip(pushed, moved)), short, kinds[1:], notes


def _push(force: np.ndarray) -> tuple[float, float]:
    """How hard a record (n_samples,) pushes: the largest product of two neighbours, so of no spike; and its top."""
    both = np.maximum(force, 0.0)
    return float((both[1:] * both[:-1]).max(initial=0.0)), float(both.max())


def stated_units(found: readers.Recording, given: Mapping[str, str] | None) -> list[str]:
    unit = [stated or units.label(name)[1] for name, stated in zip(found.names, found.units)]
    for name, text in check.table("units", given).items():
        if not isinstance(text, str) or units.si_unit(text) is None:
            words = ", ".join(word for factors in units.KINDS.values() for word in factors)
            raise ValueError(f"units must be one of {words}, got {check.shown(text)} for {name!r}")
        unit[find_channel("units", name, found)] = text
    return unit


def find_channel(argument: str, which: Any, found: readers.Recording) -> int:
    """The number of a channel named by (part of) its name or by its number."""
    there = ", ".join(repr(name) for name in found.names[:20])
    if isinstance(which, (int, np.integer)) and not isinstance(which, bool):
        if 0 <= which < len(found.names):
            return int(which)
        raise ValueError(
            f"{argument} must be a channel from 0 to {len(found.names) - 1}, got {which}; they are {there}"
        )
    if not isinstance(which, str):
        raise ValueError(f"{argument} must be the name or number of a channel, got {check.shown(which)}")
    for test in (str.__eq__, lambda name, text: name.casefold() == text.casefold(),
                 lambda name, text: text.casefold() in name.casefold()):  # fmt: skip
        hits = [i for i, name in enumerate(found.names) if test(name, which)]
        if len(hits) == 1:
            return hits[0]
        if hits:
            break
    said = "fits several channels" if hits else "is no channel"
    raise ValueError(f"{argument}: {check.shown(which)} {said}; they are {there}{check.nearest(which, found.names)}")


def force_channel(found: readers.Recording, force: Any, unit: list[str], name: str) -> int:
    if force is not None:
        return find_channel("force", force, found)
    hits = [i for i, text in enumerate(unit) if (units.si_unit(text) or "")[:1] == ("N",)]
    hits = hits or [i for i, text in enumerate(found.names) if units.FORCE_NAMES.search(text)]
    if len(hits) != 1 and len(found.names) == 1 and not units.RESPONSE_NAMES.search(found.names[0]):
        hits = [0]
    if len(hits) != 1:
        there = ", ".join(repr(text) for text in found.names[:20])
        said = "has several force channels" if hits else "does not say which channel is the force"
        raise ValueError("; ".join([f"force must be given: {name} {said}; its channels are {there}", *found.notes]))
    return hits[0]


def response_channels(found: readers.Recording, response: Any, unit: list[str], struck: int) -> list[int]:
    if response is not None:
        asked = [response] if isinstance(response, (str, int, np.integer)) else response
        if not isinstance(asked, (list, tuple)):
            raise ValueError(f"response must be the names or numbers of channels, got {check.shown(response)}")
        others = [find_channel("response", which, found) for which in asked]
        if struck in others:
            raise ValueError(f"response must name other channels than the force, got {check.shown(response)}")
        return others
    return [
        i
        for i, (kind, text) in enumerate(zip(map(units.si_unit, unit), found.names))
        if i != struck and ((kind and kind[0] != "N") or (not unit[i] and units.RESPONSE_NAMES.search(text)))
    ]


def factor(name: str, unit: str, wanted: str, scale: float | None, file: str) -> tuple[float, list[str]]:
    """What a channel is multiplied with to be in SI, and what was assumed for that."""
    kind = units.si_unit(unit)
    if kind and kind[0] == wanted:
        return kind[1] * (1.0 if scale is None else scale), []
    if scale is not None:
        return scale, []
    if not unit:
        known = " known" if name.rstrip().endswith("]") else ""  # "acc [furlong]"
        return 1.0, [f"{name}: no{known} unit stated, {wanted} assumed"]
    raise ValueError(
        f"scale must be given for {name!r} of {file}, which is in {unit!r} and not in a unit of the kind {wanted}: "
        f"scale={{{name!r}: ... }} in {wanted} per {unit}"
    )
