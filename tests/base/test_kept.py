"""Kept arrays are read as they were written, or not at all."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fem_impact._base import kept

ARRAYS = {"omega": np.arange(3.0), "notes": np.array(["a", "b"]), "mass": 0.2}


@dataclass
class Gong:
    mass: float
    omega: np.ndarray
    places: dict
    ringing: Callable | None = None


class Blow(NamedTuple):
    gong: Gong
    speed: float


@pytest.fixture
def path(tmp_path):
    kept.write_arrays(tmp_path / "modes.npz", "key", ARRAYS)
    return tmp_path / "modes.npz"


def test_what_was_written_is_read(path):
    found = kept.read_arrays(path, "key")
    assert set(found) == set(ARRAYS)
    for name, array in ARRAYS.items():
        assert_array_equal(found[name], array)
    assert kept.read_arrays(path, "other") is None and kept.read_arrays(path.with_name("none"), "key") is None


def test_no_file_with_a_flipped_bit_is_read(path):
    raw = path.read_bytes()
    for place in range(0, 8 * len(raw), 61):
        damaged = bytearray(raw)
        damaged[place // 8] ^= 1 << place % 8
        path.write_bytes(damaged)
        assert kept.read_arrays(path, "key") is None, place


@pytest.mark.parametrize("raw", [b"", b"PK", 40 * b"\0"])
def test_no_other_file_is_read(path, raw):
    path.write_bytes(raw)
    assert kept.read_arrays(path, "key") is None
    path.unlink()
    path.mkdir()
    assert kept.read_arrays(path, "key") is None


def test_objects_of_known_classes_come_back_with_what_is_kept_of_them(tmp_path):
    known = kept.kinds(Gong, Blow, left_out={"ringing"})
    gong = Gong(2.0, np.arange(3.0), {(0.1, 0.2): slice(1, 4)}, ringing=len)
    kept.pack(tmp_path / "a.npz", "key", known, blows=[Blow(gong, np.float64(3.0)), None], title="one")
    found = kept.unpack(tmp_path / "a.npz", "key", known)
    assert found["title"] == "one" and found["blows"][1] is None and found["blows"][0].speed == 3.0
    again = found["blows"][0].gong
    assert (again.mass, again.places, again.ringing) == (2.0, {(0.1, 0.2): slice(1, 4)}, None)
    assert_array_equal(again.omega, gong.omega)
    assert kept.unpack(tmp_path / "a.npz", "other", known) is None
    with pytest.raises(KeyError, match="Gong"):
        kept.unpack(tmp_path / "a.npz", "key", kept.kinds(Blow))
