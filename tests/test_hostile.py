"""Numbers, files and addresses that once ended in a traceback, a wait of minutes or a wrong message."""

import os
import re

import numpy as np
import pytest
from scenes import QUICK, SMALL

import fem_impact as fi

DISK = """
[mesh]
shape = "disk"
radius = 0.2
[material]
E = 110e9
nu = 0.34
rho = 8800
E_across = 5e9
G = 1e9
angle = 0.0
[section]
kind = "plate"
thickness = 1.2e-3
[supports]
boundary = "clamped"
[striker]
kind = "rigid"
mass = 0.05
[contact]
kind = "hertz"
stiffness = 2e5
loss = 0.0
[strike]
at = [0.05, 0.02]
speed = 1.0
tolerance = 1e-2
"""
TIN = "".join(line for line in DISK.splitlines(True) if not line.startswith(("E_across", "G ", "angle")))


@pytest.fixture
def told(tmp_path, prompt):
    """Run a command on a scene; returns its status and what it said."""

    def run(text, verb="strike", *words):
        (tmp_path / "s.toml").write_text(text)
        ran = prompt([verb, "s.toml", *([] if verb == "plan" else ["--out", "out"])], *words)
        return ran.status, " ".join((ran.out + ran.err).split())

    return run


def edited(text, key, value):
    assert re.search(rf"^{key} = ", text, re.M)
    return re.sub(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.M)


@pytest.mark.parametrize(
    "text, key, huge, status, words",
    [
        (QUICK, "stiffness", "9999999999999999999999999", 1, "take a larger tolerance, or a softer striker or contact"),
        (DISK, "angle", "18446744073709551616", 0, "turns; rad are expected"),
        (TIN, "loss", "9999999999999999999999999", 2, "[contact] loss must lie between 0 and 1e+12 s/m"),
    ],
)
def test_whole_numbers_beyond_64_bits_are_numbers(told, text, key, huge, status, words):
    found, said = told(edited(text, key, huge), "plan")
    assert found == status and words in said


def test_checked_numbers_are_floats_whatever_was_given():
    made = fi.Material(10**20, 0, 10**19, 10**18, 10**17, 10**19), fi.Contact(10**20, 1, 10, -1), fi.Elastic(10**20)
    for thing in made:
        assert all(type(value) is float for value in vars(thing).values() if value not in (None, ()))
    assert type(fi.Plate(made[0], 1).thickness) is float


def test_masked_numbers_are_not_what_is_under_the_mask():
    samples = np.ma.masked_greater(np.arange(100.0), 98.0)
    with pytest.raises(ValueError, match="force must be finite, got nan at index 0, 99"):
        fi.Taps.from_arrays(samples, rate=1e3)
    assert fi.Taps.from_arrays(np.ma.masked_greater(np.arange(100.0), 99.0), rate=1e3).peak == 99.0


@pytest.mark.parametrize(
    "key, value",
    [("G", "1e74"), *(pytest.param(*row, marks=pytest.mark.slow) for row in (("E", "1e74"), ("G", "1e30")))],
)
def test_an_absurd_stiffness_of_wood_is_a_sentence(told, key, value):
    status, said = told(edited(DISK, key, value), "strike")
    assert status in (0, 1) and "Traceback" not in said  # stiff in every direction is nearly rigid, in one a mistake
    assert key == "E" or (status == 1 and "no tolerance is: check the units" in said)


@pytest.mark.parametrize("value", ["1e12", pytest.param("1e74", marks=pytest.mark.slow)])
def test_absurd_damping_and_frequency_are_no_traceback(told, value):
    assert told(edited(SMALL, "damping_ratio", value))[0] in (0, 3)  # modes left out would not move either
    assert told(edited(QUICK, "first_frequency", value))[0] in (0, 2)


def test_a_listener_out_of_reach_hears_silence_and_all_files_are_there(told, tmp_path):
    status, said = told(QUICK, "strike", "--target", "modal", "--listener", "0.1", "0.1", "1e10")
    assert status == 0 and "Listener: silence" in said
    assert {"response.json", "force.csv", "radiated.wav"} <= {path.name for path in (tmp_path / "out").iterdir()}


def test_a_soft_spring_on_a_drumhead_writes_its_files(told, tmp_path):
    """Its blow took a mesh by which the head yields 4 % less under a point than by that of its modes."""
    edits = {
        '"hertz"': '"linear"', "= 2e5": "= 3.0", "speed = 1.0": "speed = 0.1", "radius = 0.2": "radius = 0.1",
        "1.2e-3": "2e-4\ntension = 2000.0", "110e9": "4e9", "8800": "1390",
    }  # fmt: skip
    text = TIN
    for old, new in edits.items():
        text = text.replace(old, new)
    status, said = told(text)
    assert status == 0 and "restitution 1.00000" in said and (tmp_path / "out" / "strike.wav").exists()


def test_a_listener_on_the_plate_is_refused_and_nothing_is_written(told, tmp_path):
    status, said = told(QUICK, "strike", "--target", "modal", "--listener", "0", "0", "1e-300")
    assert status == 2 and "listener must lie off the plate's plane" in said
    assert not (tmp_path / "out").exists()


def test_a_blow_too_loud_for_a_wav_is_scaled_until_it_fits(tmp_path):
    plate = fi.analytic.rectangle(0.3, 0.2, mass=0.2, first_frequency=100.0, n_modes=4)
    hit = fi.strike(plate, fi.Striker.rigid(0.01), fi.Contact.linear(1e4), at=(0.1, 0.1), speed=1e50, tolerance=0.1)
    assert fi.export.write_wav(tmp_path / "a.wav", hit).full_scale > 1e30


def test_a_cluster_that_wants_a_certificate_is_a_sentence(told):
    status, said = told(QUICK, "map", "--cluster", "tls://127.0.0.1:9")
    assert status == 1 and "client: no cluster answers at tls://127.0.0.1:9" in said


HEAD = '<svg xmlns="http://www.w3.org/2000/svg" width="465mm" height="300mm" viewBox="0 0 465 300">'


@pytest.mark.parametrize(
    "words, body",
    [
        ("numbers", f'<path d="M0 0 {"l1.5 1.25 " * 10**6}z"/>'),
        ("a comment", f'<!--{"x" * 20_000_000}--><rect width="465" height="300"/>'),
        ("shapes", '<rect width="4" height="3"/>' * 10**5),
    ],
    ids=["pieces", "comment", "shapes"],
)
@pytest.mark.slow
def test_a_huge_drawing_is_refused_in_seconds(tmp_path, words, body):
    (tmp_path / "a.svg").write_text(f"{HEAD}{body}</svg>")
    began = sum(os.times()[:4])  # of processor time, children included
    with pytest.raises(ValueError, match=f"contains? .*{words}"):
        fi.mesh.outline(tmp_path / "a.svg")
    assert sum(os.times()[:4]) - began < 20.0  # 33 and 108 s once, now 2 to 6 s
