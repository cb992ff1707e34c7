"""Arrays and objects kept in a file for the next run: read only if they are what was written, for what is asked."""

import hashlib
import io
import json
from collections.abc import Collection, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from .files import replacing

SIZE = hashlib.sha256().digest_size
Kinds = Mapping[str, tuple[type, list[str]]]  # name of a class: the class, and its fields that are kept


def kinds(*classes: type, left_out: Collection[str] = ()) -> Kinds:
    """The dataclasses and named tuples that `pack` may meet; fields that are left out have their defaults later."""
    found = {}
    for each in classes:
        names = getattr(each, "_fields", None) or [field.name for field in fields(each) if field.init]
        found[each.__name__] = each, [name for name in names if name not in left_out]
    return found


def pack(path: Path, key: str, known: Kinds, **things: Any) -> None:
    """Write objects found for a key, as `flatten` takes them."""
    write_arrays(path, key, flatten(known, **things))


def unpack(path: Path, key: str, known: Kinds) -> dict[str, Any] | None:
    """What `pack` wrote for this key, as `restore` returns it; or None."""
    arrays = read_arrays(path, key)
    return None if arrays is None else restore(known, arrays)


def flatten(known: Kinds, **things: Any) -> dict[str, np.ndarray]:
    """Objects as arrays alone: known classes, mappings, sequences, slices, arrays, texts and numbers in them."""
    arrays: dict[str, np.ndarray] = {}
    packed = {name: _packed(thing, known, arrays) for name, thing in things.items()}
    return {**arrays, "told": np.array(json.dumps(packed))}


def restore(known: Kinds, arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """What `flatten` was given, by name, sequences as tuples. No other class is ever made."""
    return {name: _unpacked(packed, known, arrays) for name, packed in json.loads(str(arrays["told"])).items()}


def _packed(value: object, known: Kinds, arrays: dict[str, np.ndarray]) -> Any:
    """A value as plain data for JSON; arrays are put aside under the number that stands for them."""
    name = type(value).__name__
    if name in known:
        return {"kind": name, "fields": {each: _packed(getattr(value, each), known, arrays) for each in known[name][1]}}
    if isinstance(value, np.ndarray):
        arrays[str(len(arrays))] = value
        return {"array": str(len(arrays) - 1)}
    if isinstance(value, slice):
        return {"slice": [value.start, value.stop]}
    if isinstance(value, Mapping):
        return {"mapping": [_packed(pair, known, arrays) for pair in value.items()]}
    if isinstance(value, (tuple, list)):
        return [_packed(each, known, arrays) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def _unpacked(packed: Any, known: Kinds, arrays: Mapping[str, np.ndarray]) -> Any:
    if isinstance(packed, list):
        return tuple(_unpacked(each, known, arrays) for each in packed)
    if not isinstance(packed, dict):
        return packed
    if "kind" in packed:
        kind, names = known[packed["kind"]]
        return kind(**{name: _unpacked(packed["fields"][name], known, arrays) for name in names})
    if "array" in packed:
        return arrays[packed["array"]]
    if "slice" in packed:
        return slice(*packed["slice"])
    return dict(_unpacked(packed["mapping"], known, arrays))


def write_arrays(path: Path, key: str, arrays: dict[str, Any]) -> None:
    """Write named arrays found for a key: an npz file, and behind it a digest of it and the key."""
    with replacing(path) as temporary, open(temporary, "w+b") as file:
        np.savez(file, **arrays)
        file.seek(0)
        digest = _digest(file, key)
        file.write(digest)


def read_arrays(path: Path, key: str) -> dict[str, np.ndarray] | None:
    """The arrays written for this key; None if the file is missing, for another key or damaged anywhere."""
    try:
        raw = path.read_bytes()
    except (OSError, MemoryError):
        return None
    body, digest = io.BytesIO(raw[:-SIZE]), raw[-SIZE:]
    if _digest(body, key) != digest:
        return None
    body.seek(0)
    with np.load(body, allow_pickle=False) as file:
        return dict(file)


def _digest(file: Any, key: str) -> bytes:
    return hashlib.sha256(hashlib.file_digest(file, "sha256").digest() + key.encode()).digest()
