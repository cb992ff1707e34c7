"""Files of measured taps: every format gives the same channels, and a bad file gives one clear sentence."""

import numpy as np
import pytest
from scipy.io import savemat, wavfile

import fem_impact as fi
from fem_impact.taps import readers

RATE = 20e3  # [Hz]


def channels():
    """Times, a force [N] with two taps and an acceleration [m/s^2]."""
    time = np.arange(2600) / RATE
    force = np.zeros(2600)
    for start, peak in ((200, 80.0), (1600, 50.0)):
        force[start : start + 12] = peak * np.sin(np.pi * (np.arange(12) + 0.5) / 12) ** 2
    return time, force, np.convolve(force, np.sin(np.arange(60) / 3.0) * np.exp(-np.arange(60) / 20.0))[:2600]


def table(path, separator=",", comma=False, head="Time [s],Force [N],Acceleration [g]", factor=9.80665):
    time, force, acceleration = channels()
    rows = [separator.join(f"{x:.9g}" for x in row) for row in zip(time, force, acceleration / factor)]
    text = "\n".join(rows)
    text = text.replace(".", ",") if comma else text
    path.write_text((head.replace(",", separator) + "\n" if head else "") + text + "\n")
    return path


def check(taps, places=1e-6):
    """Both taps were found with their forces and responses."""
    _, force, acceleration = channels()
    assert taps.n_taps == 2 and taps.rate == RATE
    assert np.allclose(taps.peak, [force[:1000].max(), force[1000:].max()], rtol=places)
    start = int(force[:1000].argmax() - taps.force[0].argmax())
    cut = slice(start, start + len(taps.time))
    assert np.abs(taps.force[0] - force[cut]).max() < places * 80.0 * 2
    assert np.abs(taps.response[0, :, 0] - acceleration[cut]).max() < places * np.abs(acceleration).max() * 10


@pytest.mark.parametrize("separator, comma", [(",", False), (";", True), ("\t", False), ("\t", True), (" ", False)])
def test_tables_with_any_separator_and_decimal_sign(tmp_path, separator, comma):
    head = None if separator == " " else "Time [s],Force [N],Acceleration [g]"
    path = table(tmp_path / "t.csv", separator, comma, head)
    if head is None:
        taps = fi.read_taps(path, force="column 2", response="column 3", units={"column 3": "g"})
        assert any("taken as time" in note for note in taps.notes)
        assert any("no unit stated" in note for note in taps.notes)
    else:
        taps = fi.read_taps(path)
    check(taps)


def test_a_row_of_units_and_a_rate_by_hand(tmp_path):
    _, force, acceleration = channels()
    rows = "\n".join(f"{f:.9g};{a:.9g}" for f, a in zip(force / 4.4482216152605, acceleration))
    path = tmp_path / "t.txt"
    path.write_text(f"Hammer;Accel\nlbf;m/s^2\n{rows}\n")
    with pytest.raises(ValueError, match="rate must be given"):
        fi.read_taps(path)
    check(fi.read_taps(path, rate=RATE))


def test_numpy_matlab_wav_and_universal_files_agree(tmp_path):
    time, force, acceleration = channels()
    np.savez(tmp_path / "t.npz", time=time, force=force, accel=acceleration)
    np.save(tmp_path / "t.npy", np.stack([force, acceleration]))
    savemat(tmp_path / "t.mat", {"rec": {"force": force, "accel": acceleration, "fs": RATE}})
    wavfile.write(tmp_path / "t.wav", int(RATE), np.stack([force / 100.0, acceleration / 1e3], axis=1))
    check(fi.read_taps(tmp_path / "t.npz"))
    check(fi.read_taps(tmp_path / "t.npy", rate=RATE, force=0, response=1))
    check(fi.read_taps(tmp_path / "t.mat"))
    both = {"channel 1": 100.0, "channel 2": 1e3}
    check(fi.read_taps(tmp_path / "t.wav", force=0, response=1, scale=both))
    with pytest.raises(ValueError, match="scale must be given for 'channel 1'"):
        fi.read_taps(tmp_path / "t.wav", force=0)
    pyuff = pytest.importorskip("pyuff")
    record = {
        "type": 58, "binary": 0, "func_type": 1, "ver_num": 0, "load_case_id": 0, "rsp_node": 1, "rsp_dir": 3,
        "ref_ent_name": "NONE", "ref_node": 0, "ref_dir": 0, "ord_data_type": 4, "abscissa_spacing": 1,
        "abscissa_min": 0.0, "abscissa_inc": 1.0 / RATE, "z_axis_value": 0.0, "x": time, "id2": "NONE", "id3": "NONE",
        "id4": "NONE", "id5": "NONE", "num_pts": len(time), "rsp_ent_name": "NONE", "abscissa_spec_data_type": 17,
        "orddenom_spec_data_type": 0,
    }  # fmt: skip
    pyuff.UFF(str(tmp_path / "t.uff")).write_sets([
        record | {"id1": "force", "data": force, "ordinate_spec_data_type": 13},
        record | {"id1": "acceleration", "rsp_node": 2, "data": acceleration, "ordinate_spec_data_type": 12},
    ], mode="overwrite")  # fmt: skip
    check(fi.read_taps(tmp_path / "t.uff"), places=1e-4)  # six digits are written


def test_a_force_of_several_taps_in_an_array(tmp_path):
    _, force, _ = channels()
    np.savez(tmp_path / "t.npz", force=np.stack([force[:1000], force[1000:2000]]), rate=RATE)
    assert fi.read_taps(tmp_path / "t.npz").n_taps == 2


HOSTILE = {
    "empty.csv": (b"", "empty"),
    "zeros.lvm": (b"\0" * 5000, "zeros"),
    "words.csv": (b"a,b\nc,d\n" * 50, "no rows of numbers"),
    "cut.lvm": (b"LabVIEW Measurement\nSeparator\tTab\n", "End_of_Header"),
    "bare.lvm": (b"LabVIEW Measurement\n***End_of_Header***\n", "no samples"),
    "other.lvm": (b"not LabVIEW at all", "does not begin"),
    "nan.csv": (b"force [N],a [g]\n" + b"1,2\n" * 20 + b"nan,2\n" + b"1,2\n" * 20, "no finite number"),
    "gap.csv": (b"time,force\n" + b"".join(b"%d,1\n" % (i + (i > 20)) for i in range(40)), "not evenly sampled"),
    "back.csv": (b"time,force\n" + b"0,1\n" * 20, "do not ascend"),
    "short.csv": (b"force [N],a [g]\n1,2\n3,4\n5,6\n", "samples"),
    "torn.csv": (b"force [N],a [g]\n" + b"1,2\n" * 20 + b"1\n" + b"1,2\n" * 20, "row without 2 numbers"),
    "bin.csv": (bytes(range(256)) * 20, "not text"),
    "v73.mat": (b"MATLAB 7.3 MAT-file" + b"x" * 600, "-v7"),
    "bad.npz": (b"PK\x03\x04 broken", "cannot be read"),
    "bad.wav": (b"RIFF1234WAVEjunkjunkjunk", "cannot be read"),
    "many.lvm": (
        b"LabVIEW Measurement\n***End_of_Header***\n\nChannels\t99999999999\n***End_of_Header***\nX\n1\t2\n", "channels"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_a_bad_file_gives_one_sentence_that_names_it(tmp_path, name):
    content, said = HOSTILE[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=said) as error:
        readers.read(tmp_path / name)
    assert name in str(error.value) and "\n" not in str(error.value)


def test_pickled_arrays_are_refused(tmp_path):
    np.save(tmp_path / "t.npy", np.array([{"a": 1}] * 20, dtype=object), allow_pickle=True)
    with pytest.raises(ValueError, match=r"t\.npy cannot be read"):
        readers.read(tmp_path / "t.npy")


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ValueError, match="there is no such file"):
        fi.read_taps(tmp_path / "absent.lvm")


def test_a_labview_file_with_times_for_each_channel(tmp_path):
    time, force, acceleration = channels()
    rows = [f"{t:.6f}\t{f:.9g}\t{t:.6f}\t{a:.9g}\t" for t, f, a in zip(time, force, acceleration)]
    head = [
        "LabVIEW Measurement",
        "Separator\tTab",
        "Decimal_Separator\t.",
        "X_Columns\tMulti",
        readers.END_OF_HEADER,
        "",
    ]
    segment = [
        "Channels\t2", "Samples\t2600\t2600", "Y_Unit_Label\tNewtons\tm/s^2",
        f"Delta_X\t{1 / RATE:.9g}\t{1 / RATE:.9g}",
        readers.END_OF_HEADER, "X_Value\tforce\tX_Value\tacceleration\tComment",
    ]  # fmt: skip
    special = ["***Start_Special***", "anything", "***End_Special***"]
    (tmp_path / "t.lvm").write_text("\n".join([*head, *special, *segment, *rows]) + "\n")
    check(fi.read_taps(tmp_path / "t.lvm"))
