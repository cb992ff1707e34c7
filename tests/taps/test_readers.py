"""Files of measured taps: every format gives the same channels, and a bad file gives one clear sentence."""

import numpy as np
import pytest
from scipy.io import savemat, wavfile

import fem_impact as fi
from fem_impact.modes import universal_files
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


@pytest.mark.parametrize("head", ["", "Force [N]\n", "Force [N];Acceleration [g]\n"])
@pytest.mark.parametrize("row", ["0,{}", "0,{},-1,25", '"0,{}","-1,25"', '0.5,"1,{}"'])
def test_commas_that_may_be_decimal_are_no_columns_without_a_heading(tmp_path, row, head):
    path = tmp_path / "t.csv"
    path.write_text(head + "".join(row.format(i % 7) + "\n" for i in range(20)))
    with pytest.raises(ValueError, match=r"t\.csv has rows like .*, whose commas may be decimal; write points in its"):
        recording(path)
    values = "".join(f"{i % 7},{i % 3},{i % 2},1\n" for i in range(20))
    for certain in ("a,b,c,d\n" + values, values.replace(",", ";"), values.replace(",", ",-", 1)):
        path.write_text(certain)
        assert recording(path)[-1].shape == (20, 4)


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
    long = {"x": time, "num_pts": len(time)}
    force, moves = long | {"data": force, "id1": "force"}, MOVES | long | {"data": acceleration, "id1": "acceleration"}
    universal(tmp_path / "t.uff", force, moves | {"rsp_node": 2})
    check(fi.read_taps(tmp_path / "t.uff"), places=1e-4)  # six digits are written


def test_a_force_of_several_taps_in_an_array(tmp_path):
    _, force, _ = channels()
    np.savez(tmp_path / "t.npz", force=np.stack([force[:1000], force[1000:2000]]), rate=RATE)
    assert fi.read_taps(tmp_path / "t.npz").n_taps == 2


def labview(first="", seg="", dec=".", unit="N\tg", n=20, times=False, rows=None):
    """A LabVIEW file of two channels with ``n`` samples at 20 kHz; ``seg`` lines replace those of the same key."""
    keys = {"Samples": f"Samples\t{n}\t{n}", "Y_Unit_Label": f"Y_Unit_Label\t{unit}", "Delta_X": "Delta_X\t5E-5\t5E-5"}
    keys |= {line.split("\t")[0]: line for line in seg.splitlines()}
    made = rows or "".join(f"{i / RATE if times else ''}\t{i % 7}.5\t{i % 5}.25\n" for i in range(n))
    made = made.replace(".", ",") if dec == "," else made
    head = f"LabVIEW Measurement\nDecimal_Separator\t.\n{first}***End_of_Header***\n\n"
    parts = ["Channels\t2", *keys.values(), "***End_of_Header***", "X_Value\tforce\taccel\tComment"]
    return (head + "\n".join(parts) + "\n" + made).encode()


ONE = labview()
NEXT = ONE[ONE.index(b"Channels") :]
SPOILED = {  # what a library or the system refuses, in the separate process
    "empty.csv": (b"", "empty"),
    "zeros.lvm": (b"\0" * 5000, "zeros"),
    "bad.npz": (b"PK\x03\x04 broken", "cannot be read"),
    "bad.wav": (b"RIFF1234WAVEjunkjunkjunk", "cannot be read"),
}
DAMAGED = {
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
    "many.lvm": (
        b"LabVIEW Measurement\n***End_of_Header***\n\nChannels\t99999999999\n***End_of_Header***\nX\n1\t2\n", "channels"
    ),
    "still.lvm": (labview(seg="Delta_X\t0\t0"), "step of '0' s"),
    "step.lvm": (labview(seg="Delta_X\tabc\tabc"), "step of 'abc' s"),
    "steps.lvm": (labview(seg="Delta_X\t5E-5\t1E-4"), "different rates"),
    "lie.lvm": (labview(seg="Delta_X\t1E-4\t1E-4", times=True), "rate of 10000 Hz, but its times have 20000 Hz"),
    "units.lvm": (ONE + b"\n" + NEXT.replace(b"N\tg", b"kN\tg"), "other units in segment 2"),
    "swapped.lvm": (ONE + b"\n" + NEXT.replace(b"force\taccel", b"accel\tforce"), "other channels in segment 2"),
    "twice.csv": (b"Force [N],a\nkN,g\n" + b"1,2\n" * 20, "two units for 'Force'"),
    "weeks.csv": (b"Time [Hz],Force [N]\n" + b"".join(b"%d,1\n" % i for i in range(20)), "times in 'Hz'"),
}  # fmt: skip


@pytest.mark.parametrize("name", SPOILED | DAMAGED)
def test_a_bad_file_gives_one_sentence_that_names_it(tmp_path, name):
    content, said = (SPOILED | DAMAGED)[name]
    (tmp_path / name).write_bytes(content)
    read = readers.read if name in SPOILED else readers.arrays
    with pytest.raises(ValueError, match=said) as error:
        read(tmp_path / name)
    assert name in str(error.value) and "\n" not in str(error.value)


UNCLOSED = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves files open


@UNCLOSED
def test_what_contradicts_itself_is_read_once_it_is_exported_again(tmp_path):
    path = tmp_path / "t.lvm"
    path.write_bytes(DAMAGED["lie.lvm"][0])
    with pytest.raises(ValueError, match="; export it again"):
        readers.arrays(path)
    path.write_bytes(labview(times=True))
    assert recording(path)[1] == RATE
    path = tmp_path / "t.npz"
    np.savez(path, force=np.arange(40.0), rate=RATE, fs=2 * RATE)
    with pytest.raises(ValueError, match=r"different rates.*; give one of them"):
        readers.arrays(path)
    np.savez(path, force=np.arange(40.0), rate=RATE)
    assert recording(path)[1] == RATE
    path = universal(tmp_path / "t.uff", {"ordinate_axis_units_lab": "g"})
    with pytest.raises(ValueError, match="whose code 13 means N; export it again"):
        readers.arrays(path)
    path = universal(path, {"ordinate_axis_units_lab": "N"})
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"        40", b"        50", 1))
    with pytest.raises(ValueError, match=r"samples of .* and holds 40; export it again"):
        readers.arrays(path)
    path.write_bytes(whole)
    assert recording(path)[:2] == (["N"], RATE)


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


def recording(path):
    """Units, rate, notes and the first segment of a file, without the separate process."""
    found = readers.arrays(path)
    return found["units"].tolist(), float(found["rate"]), " ".join(found["notes"]), found["segment0"]


def test_a_labview_file_says_what_is_wrong_with_its_header(tmp_path):
    path = tmp_path / "t.lvm"
    path.write_bytes(labview(seg="Samples\t40\t40"))
    _, rate, notes, values = recording(path)
    assert "states 40 samples and holds 20" in notes and len(values) == 19 and rate == RATE
    path.write_bytes(labview(dec=",").replace(b"Decimal_Separator\t,", b"Decimal_Separator\t."))
    _, _, notes, values = recording(path)
    assert "decimal commas" in notes and values[1].tolist() == [1.5, 1.25]
    path.write_bytes(labview(seg="Delta_X\t\t", times=True))
    assert recording(path)[1] == RATE  # from the times, as no step is stated


def test_tables_as_numpy_and_spreadsheets_write_them(tmp_path):
    values = np.column_stack([np.arange(20) / RATE, np.arange(20.0), np.arange(20.0) % 3])
    np.savetxt(tmp_path / "a.csv", values, delimiter=",", header="t,Force [lbf],Accel [g]")
    units, rate, notes, _ = recording(tmp_path / "a.csv")
    assert (units, rate) == (["lbf", "g"], RATE) and "t: no unit stated, s assumed" in notes
    text = "\n".join(["Time [ns];;Force [N]", *(f'"{1e9 * t:.0f}";;"{f}"' for t, f, _ in values)])
    (tmp_path / "b.csv").write_text(text)  # quoted, and a column is empty
    units, rate, _, got = recording(tmp_path / "b.csv")
    assert (units, rate) == (["N"], RATE) and got[:, 0].tolist() == values[:, 1].tolist()


def test_arrays_that_are_no_samples_are_not_taken_for_some(tmp_path):
    _, force, acceleration = channels()
    path = tmp_path / "t.npz"
    np.savez(path, force=force + 0j, accel=acceleration, rate=RATE)
    with pytest.raises(ValueError, match="complex numbers in 'force'"):
        readers.arrays(path)
    np.savez(path, force=force.astype(str), accel=acceleration, rate=RATE)
    with pytest.raises(ValueError, match="does not say which channel is the force"):
        fi.read_taps(path)
    np.savez(path, force=(100 * force).astype(np.int16), rate=RATE)
    with pytest.raises(ValueError, match=r"scale must be given for 'force'.*in 'counts'"):
        fi.read_taps(path)
    for rates in ({"rate": RATE, "dt": 1e-3}, {"time": np.arange(2600) / RATE, "fs": 2 * RATE}):
        np.savez(path, force=force, **rates)
        with pytest.raises(ValueError, match="different rates"):
            readers.arrays(path)


def test_more_taps_than_samples(tmp_path):
    rows = np.tile(channels()[1][195:235], (60, 1))
    fi.Taps.from_arrays(rows, rate=RATE).save(tmp_path / "t.npz")
    assert fi.read_taps(tmp_path / "t.npz").n_taps == 60
    np.savez(tmp_path / "u.npz", force=rows, rate=RATE)
    assert "the longer side of force, 60 of (60, 40), was taken as time" in recording(tmp_path / "u.npz")[2]


def test_structures_and_cells_of_matlab(tmp_path):
    _, force, _ = channels()
    cell = np.empty(2, object)
    cell[:] = [force[:1000], force[1500:2500]]
    savemat(tmp_path / "t.mat", {"run": {"data": {"force": cell}, "fs": RATE}, "who": "nobody"})
    found = readers.arrays(tmp_path / "t.mat")
    assert found["names"].tolist() == ["run.data.force"] and {"segment0", "segment1"} <= set(found)


def test_a_wav_that_is_cut_off_says_so(tmp_path):
    wavfile.write(tmp_path / "t.wav", int(RATE), np.zeros(2000, np.int16))
    (tmp_path / "u.wav").write_bytes((tmp_path / "t.wav").read_bytes()[:1044])
    *_, notes, values = recording(tmp_path / "u.wav")
    assert "cut off" in notes and len(values) == 500


KINDS = {"func_type": 1, "ord_data_type": 4, "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 13}
RECORD = universal_files.function("NONE", 1, 3, np.arange(40) / RATE, np.arange(40.0)) | KINDS
MOVES = {"ordinate_spec_data_type": 12, "data": 2.0 * np.arange(40)}
POUNDS = {"type": 164, "units_code": 2, "units_description": "foot", "temp_mode": 1, "length": 3.2808, "force": 0.22481,
          "temp": 1.8, "temp_offset": 459.67}  # fmt: skip


def universal(path, *changes, before=()):
    pyuff = pytest.importorskip("pyuff")
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets([*before, *(RECORD | each for each in changes)], mode="add")
    return path


@UNCLOSED
@pytest.mark.parametrize("change", [{}, {"binary": 1, "byte_ordering": 1}, {"binary": 1, "byte_ordering": 2}])
def test_force_and_acceleration_of_one_point_stay_apart_in_a_universal_file(tmp_path, change):
    units, rate, _, values = recording(universal(tmp_path / "t.uff", change, MOVES | change))
    assert (units, rate) == (["N", "m/s^2"], RATE) and values[10].tolist() == [10.0, 20.0]


def test_universal_files_in_other_units_or_with_unknown_ones(tmp_path):
    path = universal(tmp_path / "t.uff", {}, {"ordinate_axis_units_lab": "bananas"} | MOVES, before=[POUNDS])
    *_, notes, values = recording(path)
    assert values[10] == pytest.approx([10.0 / 0.22481, 20.0 / 3.2808]) and "brought to N by data set 164" in notes
    assert "'bananas' is not known" in notes
    with pytest.raises(ValueError, match="states the unit 'g' for 'node 1 direction 3', whose code 13 means N"):
        readers.arrays(universal(path, {"ordinate_axis_units_lab": "g"}))


@UNCLOSED
def test_universal_files_that_are_damaged(tmp_path):
    path = universal(tmp_path / "t.uff", {}, MOVES)
    whole = path.read_bytes()
    for said, raw in (
        ("ends within a data set", whole[: 2 * len(whole) // 3]),
        ("states 2147483647 samples .* holds 40", whole.replace(b"        40", b"2147483647", 1)),
        ("no finite number", whole.replace(b"   1.00000000000e+01", b"                 nan", 1)),
    ):
        path.write_bytes(raw)
        with pytest.raises(ValueError, match=said):
            readers.arrays(path)
    nothing = RECORD["data"].copy()
    nothing[3] = np.inf
    with pytest.raises(ValueError, match="no finite number"):
        readers.arrays(universal(path, {"binary": 1, "data": nothing}))


def timed(path, time):
    """A table of two taps at given times."""
    _, force, acceleration = channels()
    rows = [f"{t:.12g},{f:.6g},{a:.6g}" for t, f, a in zip(time, force, acceleration)]
    path.write_text("Time [s],Force [N],Acceleration [m/s^2]\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize(
    ("off", "rounded", "even"), [(0.015, 0, True), (0.05, 0, False), (0, 1.7e-5, True), (0, 7.1e-5, False)]
)
def test_a_sample_off_its_time_by_a_fiftieth_of_a_step_is_told_unless_times_are_rounded(tmp_path, off, rounded, even):
    time = channels()[0]
    time[200:] += off / RATE  # the clock jumped
    path = timed(tmp_path / "taps.csv", np.round(time / rounded) * rounded if rounded else time)
    if even:
        assert readers.table(path).rate == pytest.approx(RATE, rel=1e-3 if rounded else 1e-4)
    else:
        with pytest.raises(ValueError, match="not evenly sampled"):
            readers.table(path)


@pytest.mark.parametrize(("stated", "agree"), [(1.002, True), (1.03, False)])
def test_a_rate_that_contradicts_the_times_by_some_per_cent_is_refused(tmp_path, stated, agree):
    time, force, acceleration = channels()
    path = tmp_path / "taps.npz"
    np.savez(path, time=time, force=force, acceleration=acceleration, rate=stated * RATE)
    if agree:
        assert readers.numpy_file(path).rate == pytest.approx(RATE, rel=0.01)
    else:
        with pytest.raises(ValueError, match="states different rates"):
            readers.numpy_file(path)


@pytest.mark.parametrize(("n_taps", "doubt"), [(12, False), (20, True)])
def test_the_axis_of_time_is_in_doubt_where_a_table_has_many_rows(tmp_path, n_taps, doubt):
    force = np.tile(channels()[1][:1000], (n_taps, 1))
    np.savez(tmp_path / "taps.npz", force=force, rate=RATE)
    notes = " ".join(readers.numpy_file(tmp_path / "taps.npz").notes)
    assert ("was taken as time" in notes) == doubt


def test_a_wav_beyond_full_scale_says_so(tmp_path):
    values = np.zeros((2000, 2), np.float32)
    values[500:520] = [0.9, 3e38]
    wavfile.write(tmp_path / "t.wav", int(RATE), values)
    *_, notes, _ = recording(tmp_path / "t.wav")
    assert notes == "channel 2 reaches 3e+38, but full scale is 1: it has a unit of its own, or is damaged"
