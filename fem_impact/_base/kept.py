"""Arrays kept in a file for the next run: read only if they are what was written, for what is asked."""

import hashlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from .files import replacing

SIZE = hashlib.sha256().digest_size


def write(path: Path, key: str, arrays: dict[str, Any]) -> None:
    """Write named arrays found for a key: an npz file, and behind it a digest of it and the key."""
    with replacing(path) as temporary, open(temporary, "w+b") as file:
        np.savez(file, **arrays)
        file.seek(0)
        digest = _digest(file, key)
        file.write(digest)


def read(path: Path, key: str) -> dict[str, np.ndarray] | None:
    """The arrays that `write` wrote for this key; None if the file is missing, for another key or damaged anywhere."""
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
