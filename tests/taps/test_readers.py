"""Files of measured taps: every format gives the same channels, and a bad file gives one clear sentence."""

import numpy as np
import pytest
import pyuff
from scipy.io import savemat, wavfile

import fem_impact as fi
from fem_impact.modes import universal_files
from fem_impact.taps import readers, units

pytestmark = pytest.mark.usefixtures("read_here")
UNCLOSED = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves files open
RATE = 20e3  # [Hz]
TIME, FORCE = np.arange(2600) / RATE, np.zeros(2600)  # of two taps [N]
for start, peak in ((200, 80.0), (1600, 50.0)):
    FORCE[start : start + 12] = peak * np.sin(np.pi * (np.arange(12) + 0.5) / 12) ** 2
ACCELERATION = np.convolve(FORCE, np.sin(np.arange(60) / 3.0) * np.exp(-np.arange(60) / 20.0))[:2600]  # [m/s^2]


def check(taps, places=1e-6):
    """Both taps were found with their forces and responses."""
    assert taps.n_taps == 2 and taps.rate == RATE
    assert np.allclose(taps.peak, [FORCE[:1000].max(), FORCE[1000:].max()], rtol=places)
    first = int(FORCE[:1000].argmax() - taps.force[0].argmax())
    cut = slice(first, first + len(taps.time))
    assert np.abs(taps.force[0] - FORCE[cut]).max() < places * 80.0 * 2
    assert np.abs(taps.response[0, :, 0] - ACCELERATION[cut]).max() < places * np.abs(ACCELERATION).max() * 10


def table(path, head, columns, separator=","):
    path.write_text(head + "".join(separator.join(f"{x:.12g}" for x in row) + "\n" for row in zip(*columns)))
    return path


def recording(path):
    """Units, rate, notes and the first segment of a file."""
    found = readers.read(path)
    return list(found.units), np.nan if found.rate is None else found.rate, " ".join(found.notes), found.segments[0]


@pytest.mark.parametrize("separator, comma", [(",", False), (";", True), ("\t", False), ("\t", True), (" ", False)])
def test_tables_with_any_separator_and_decimal_sign(tmp_path, separator, comma):
    head = separator.join(["Time [s]", "Force [N]", "Acceleration [g]\n"]) if separator != " " else ""
    path = table(tmp_path / "t.csv", head, (TIME, FORCE, ACCELERATION / 9.80665), separator)
    if comma:
        path.write_text(path.read_text().replace(".", ","))
    if head:
        check(fi.read_taps(path))
    else:
        taps = fi.read_taps(path, force="column 2", response="column 3", units={"column 3": "g"})
        check(taps)
        assert all(any(said in note for note in taps.notes) for said in ("taken as time", "no unit stated"))


@pytest.mark.parametrize("head", ["", "Force [N]\n", "Force [N];Acceleration [g]\n"])
@pytest.mark.parametrize("row", ["0,{}", "0,{},-1,25", '"0,{}","-1,25"', '0.5,"1,{}"'])
def test_commas_that_may_be_decimal_are_no_columns_without_a_heading(tmp_path, row, head):
    path = tmp_path / "t.csv"
    path.write_text(head + "".join(row.format(i % 7) + "\n" for i in range(20)))
    with pytest.raises(ValueError, match=r"t\.csv has rows like .*, whose commas may be decimal; write points in its"):
        recording(path)


VALUES = "".join(f"{i % 7},{i % 3},{i % 2},1\n" for i in range(20))


@pytest.mark.parametrize("text", ["a,b,c,d\n" + VALUES, VALUES.replace(",", ";"), VALUES.replace(",", ",-", 1)])
def test_commas_that_are_none_separate_columns(tmp_path, text):
    (tmp_path / "t.csv").write_text(text)
    assert recording(tmp_path / "t.csv")[-1].shape == (20, 4)


@pytest.mark.parametrize(
    "text, unit",
    [("Hammer force [kN]\n" + "1\n" * 20, ["kN"]), ("# Force [kN]\n" + "1\n" * 20, ["kN"]),
     ("Channel A,Channel B\n(kV),(mV)\n" + "1,2\n" * 20, ["kV", "mV"])],
)  # fmt: skip
def test_a_single_column_has_its_heading_and_a_row_of_units_may_hold_no_mechanical_one(tmp_path, text, unit):
    (tmp_path / "t.csv").write_text(text)
    assert recording(tmp_path / "t.csv")[0] == unit


def test_a_row_of_units_and_a_rate_by_hand(tmp_path):
    path = table(tmp_path / "t.txt", "Hammer;Accel\nlbf;m/s^2\n", (FORCE / 4.4482216152605, ACCELERATION), ";")
    with pytest.raises(ValueError, match="rate must be given"):
        fi.read_taps(path)
    check(fi.read_taps(path, rate=RATE))


def test_numpy_matlab_wav_and_universal_files_agree(tmp_path):
    np.savez(tmp_path / "t.npz", time=TIME, force=FORCE, accel=ACCELERATION)
    np.save(tmp_path / "t.npy", np.stack([FORCE, ACCELERATION]))
    savemat(tmp_path / "t.mat", {"rec": {"force": FORCE, "accel": ACCELERATION, "fs": RATE}})
    wavfile.write(tmp_path / "t.wav", int(RATE), np.stack([FORCE / 100.0, ACCELERATION / 1e3], axis=1))
    check(fi.read_taps(tmp_path / "t.npz"))
    check(fi.read_taps(tmp_path / "t.npy", rate=RATE, force=0, response=1))
    check(fi.read_taps(tmp_path / "t.mat"))
    check(fi.read_taps(tmp_path / "t.wav", force=0, response=1, scale={"channel 1": 100.0, "channel 2": 1e3}))
    with pytest.raises(ValueError, match="scale must be given for 'channel 1'"):
        fi.read_taps(tmp_path / "t.wav", force=0)


def labview(first="", seg="", dec=".", unit="N\tg", n=20, times=False):
    """A LabVIEW file of two channels with ``n`` samples at 20 kHz; ``seg`` lines replace those of the same key."""
    keys = {"Samples": f"Samples\t{n}\t{n}", "Y_Unit_Label": f"Y_Unit_Label\t{unit}", "Delta_X": "Delta_X\t5E-5\t5E-5"}
    keys |= {line.split("\t")[0]: line for line in seg.splitlines()}
    rows = "".join(f"{i / RATE if times else ''}\t{i % 7}.5\t{i % 5}.25\n" for i in range(n)).replace(".", dec)
    head = f"LabVIEW Measurement\nDecimal_Separator\t.\n{first}***End_of_Header***\n\n"
    parts = ["Channels\t2", *keys.values(), "***End_of_Header***", "X_Value\tforce\taccel\tComment"]
    return (head + "\n".join(parts) + "\n" + rows).encode()


ONE = labview()
NEXT = ONE[ONE.index(b"Channels") :]
EMPTY = b"LabVIEW Measurement\n***End_of_Header***\n"
HEADED, ROWS = b"force [N],a [g]\n", b"1,2\n" * 20
# what `test_advice_of_files` does not have
SPOILED = {  # what a library or the system refuses, in the separate process
    "bad.npz": (b"PK\x03\x04 broken", "cannot be read"),
    "bad.wav": (b"RIFF1234WAVEjunkjunkjunk", "cannot be read"),
}
DAMAGED = {
    "words.csv": (b"a,b\nc,d\n" * 50, "no rows of numbers"),
    "cut.lvm": (b"LabVIEW Measurement\nSeparator\tTab\n", "End_of_Header"),
    "bare.lvm": (EMPTY, "no samples"),
    "nan.csv": (HEADED + ROWS + b"nan,2\n" + ROWS, "no finite number"),
    "gap.csv": (b"time,force\n" + b"".join(b"%d,1\n" % (i + (i > 20)) for i in range(40)), "not evenly sampled"),
    "short.csv": (HEADED + b"1,2\n3,4\n5,6\n", "samples"),
    "torn.csv": (HEADED + ROWS + b"1\n" + ROWS, "row without 2 numbers"),
    "first.csv": (HEADED + b"1,o\n" + ROWS, "row without 2 numbers, 1 rows into a segment: '1,o'"),
    "commented.csv": (b"# " + HEADED + b"1,o\n" + ROWS, "row without 2 numbers, 1 rows into a segment: '1,o'"),
    "second.csv": (b"1,2\n1 2\n" + ROWS, "row without 2 numbers, 2 rows into a segment: '1 2'"),
    "third.csv": (HEADED + b"1,2\n3,4\n1,\n" + ROWS, "row without 2 numbers, 3 rows into a segment: '1,'"),
    "wide.csv": (HEADED + ROWS + b"0,1,5\n", "2 columns, but also a row '0,1,5'; export it again"),
    "many.lvm": (EMPTY + b"\nChannels\t99999999999\n***End_of_Header***\nX\n1\t2\n", "channels"),
    "still.lvm": (labview(seg="Delta_X\t0\t0"), "step of '0' s"),
    "step.lvm": (labview(seg="Delta_X\tabc\tabc"), "step of 'abc' s"),
    "steps.lvm": (labview(seg="Delta_X\t5E-5\t1E-4"), "different rates"),
    "lie.lvm": (labview(seg="Delta_X\t1E-4\t1E-4", times=True),
                "rate of 10000 Hz, but its times have 20000 Hz; export it again"),
    "units.lvm": (ONE + b"\n" + NEXT.replace(b"N\tg", b"kN\tg"), "other units in segment 2"),
    "swapped.lvm": (ONE + b"\n" + NEXT.replace(b"force\taccel", b"accel\tforce"), "other channels in segment 2"),
    "twice.csv": (b"Force [N],a\nkN,g\n" + ROWS, "two units for 'Force'"),
    "weeks.csv": (b"Time [Hz],Force [N]\n" + b"".join(b"%d,1\n" % i for i in range(20)), "times in 'Hz'"),
}  # fmt: skip


@pytest.mark.parametrize("name", SPOILED | DAMAGED)
def test_a_bad_file_gives_one_sentence_that_names_it(tmp_path, monkeypatch, name):
    content, said = (SPOILED | DAMAGED)[name]
    if name in SPOILED:
        monkeypatch.undo()  # in the separate process, as a library leaves the file open
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=said) as error:
        readers.read(tmp_path / name)
    assert name in str(error.value) and "\n" not in str(error.value)


def test_pickled_arrays_are_refused(tmp_path):
    np.save(tmp_path / "t.npy", np.array([{"a": 1}] * 20, dtype=object), allow_pickle=True)
    with pytest.raises(ValueError, match=r"t\.npy cannot be read"):
        fi.read_taps(tmp_path / "t.npy")


def test_a_labview_file_with_times_for_each_channel(tmp_path):
    rows = [f"{t:.6f}\t{f:.9g}\t{t:.6f}\t{a:.9g}\t" for t, f, a in zip(TIME, FORCE, ACCELERATION)]
    lines = [
        "LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t.", "X_Columns\tMulti", readers.END_OF_HEADER, "",
        "***Start_Special***", "anything", "***End_Special***", "Channels\t2", "Samples\t2600\t2600",
        "Y_Unit_Label\tNewtons\tm/s^2", f"Delta_X\t{1 / RATE}\t{1 / RATE}", readers.END_OF_HEADER,
        "X_Value\tforce\tX_Value\tacceleration\tComment", *rows,
    ]  # fmt: skip
    (tmp_path / "t.lvm").write_text("\n".join(lines) + "\n")
    check(fi.read_taps(tmp_path / "t.lvm"))


@pytest.mark.parametrize(
    ("raw", "n", "said"),
    [(labview(seg="Samples\t40\t40"), 19, "states 40 samples and holds 20"), (labview(dec=","), 20, "decimal commas"),
     (labview(times=True), 20, ""), (labview(seg="Delta_X\t\t", times=True), 20, "")],
    ids=["samples", "commas", "times", "times alone"],
)  # fmt: skip
def test_a_labview_file_is_read_whatever_is_wrong_with_its_header(tmp_path, raw, n, said):
    (tmp_path / "t.lvm").write_bytes(raw)
    units, rate, notes, values = recording(tmp_path / "t.lvm")
    assert (units, rate, len(values)) == (["N", "g"], RATE, n) and said in notes and values[1].tolist() == [1.5, 1.25]


def test_tables_as_numpy_and_spreadsheets_write_them(tmp_path):
    time, force, accel = values = np.stack([np.arange(20) / RATE, np.arange(20.0), np.arange(20.0) % 3])
    np.savetxt(tmp_path / "a.csv", values.T, delimiter=",", header="t,Force [lbf],Accel [g]")
    units, rate, notes, got = recording(tmp_path / "a.csv")
    assert (units, rate) == (["lbf", "g"], RATE) and "t: no unit stated, s assumed" in notes
    assert got[:, 1].tolist() == accel.tolist()
    rows = [f'"{1e9 * t:.0f}";;"{f}"' for t, f in zip(time, force)]  # quoted, and a column is empty
    (tmp_path / "b.csv").write_text("\n".join(["Time [ns];;Force [N]", *rows]))
    units, rate, _, got = recording(tmp_path / "b.csv")
    assert (units, rate) == (["N"], RATE) and got[:, 0].tolist() == force.tolist()
    rows = [f"{1e3 * t:.6f},{f}," for t, f in zip(time, force)]  # the last column is empty
    (tmp_path / "c.csv").write_text("\n".join(["Time [ms],Force [kN],Accel [g]", *rows]))
    units, rate, _, got = recording(tmp_path / "c.csv")
    assert (units, rate) == (["kN"], RATE) and got[:, 0].tolist() == force.tolist()


def test_a_rate_of_no_rig_is_refused_and_may_be_given(tmp_path):
    path = table(tmp_path / "t.csv", "Time [s],Force [N]\n", (1e6 * TIME, FORCE))
    with pytest.raises(ValueError, match=r"^t\.csv states a rate of 0\.02 Hz; check the unit of its times, or give"):
        fi.read_taps(path)
    assert fi.read_taps(path, rate=RATE).n_taps == 2


@pytest.mark.parametrize(
    ("force", "rates", "said"),
    [
        (FORCE + 0j, {"rate": RATE}, "complex numbers in 'force'"),
        (FORCE.astype(str), {"rate": RATE}, "does not say which channel is the force"),
        (FORCE[1:], {"time": TIME}, r"channels are 'accel'; force has shape \(2599,\) and was left out"),
        ((100 * FORCE).astype(np.int16), {"rate": RATE}, r"scale must be given for 'force'.*in 'counts'"),
        (FORCE, {"rate": RATE, "dt": 1e-3}, "different rates.*; give one of them"),
        (FORCE, {"time": TIME, "fs": 2 * RATE}, "different rates"),
        (FORCE, {"time": TIME, "rate": 1.03 * RATE}, "different rates"),
        (FORCE, {"time": TIME, "rate": 1.002 * RATE}, None),
    ],
    ids=["complex", "text", "short", "counts", "dt", "fs", "3 per cent", "2 per mille"],
)
def test_arrays_that_are_no_samples_or_contradict_their_rate_are_refused(tmp_path, force, rates, said):
    np.savez(tmp_path / "t.npz", force=force, accel=ACCELERATION, **rates)
    if said is None:
        assert fi.read_taps(tmp_path / "t.npz").rate == pytest.approx(RATE, rel=0.01)
    else:
        with pytest.raises(ValueError, match=said):
            fi.read_taps(tmp_path / "t.npz")


def test_several_taps_may_be_rows_of_an_array_and_more_than_its_samples(tmp_path):
    np.savez(tmp_path / "t.npz", force=np.stack([FORCE[:1000], FORCE[1000:2000]]), rate=RATE)
    assert fi.read_taps(tmp_path / "t.npz").n_taps == 2
    fi.Taps.from_arrays(np.tile(FORCE[195:235], (60, 1)), rate=RATE).save(tmp_path / "t.npz")
    assert fi.read_taps(tmp_path / "t.npz").n_taps == 60


@pytest.mark.parametrize(
    ("shape", "said"), [((12, 1000), ""), ((20, 1000), "1000 of (20, 1000)"), ((60, 40), "60 of (60, 40)")]
)
def test_the_axis_of_time_is_in_doubt_where_a_table_has_many_rows(tmp_path, shape, said):
    np.savez(tmp_path / "t.npz", force=np.resize(FORCE[:1000], shape), rate=RATE)
    notes = recording(tmp_path / "t.npz")[2]
    assert f"the longer side of force, {said}, was taken as time" in notes if said else "taken as time" not in notes


def test_structures_and_cells_of_matlab(tmp_path):
    cell = np.empty(2, object)
    cell[:] = [FORCE[:1000], FORCE[1500:2500]]
    savemat(tmp_path / "t.mat", {"run": {"data": {"force": cell}, "fs": RATE}, "who": "nobody"})
    found = readers.read(tmp_path / "t.mat")
    assert found.names == ("run.data.force",) and len(found.segments) == 2


def test_a_wav_that_is_cut_off_or_beyond_full_scale_says_so(tmp_path):
    path = tmp_path / "t.wav"
    wavfile.write(path, int(RATE), np.zeros(2000, np.int16))
    path.write_bytes(path.read_bytes()[:1044])
    *_, notes, values = recording(path)
    assert "cut off" in notes and len(values) == 500
    values = np.zeros((2000, 2), np.float32)
    values[500:520] = [0.9, 3e38]
    wavfile.write(path, int(RATE), values)
    said = "channel 2 reaches 3e+38, but full scale is 1: it has a unit of its own, or is damaged"
    assert recording(path)[2] == said


KINDS = {"func_type": 1, "ord_data_type": 4, "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 13}
RECORD = universal_files.function("NONE", 1, 3, np.arange(40) / RATE, np.arange(40.0)) | KINDS
MOVES = {"ordinate_spec_data_type": 12, "data": 2.0 * np.arange(40)}
POUNDS = {"type": 164, "units_code": 2, "units_description": "foot", "temp_mode": 1, "length": 3.2808, "force": 0.22481,
          "temp": 1.8, "temp_offset": 459.67}  # fmt: skip


def universal(path, *changes, before=()):
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets([*before, *(RECORD | each for each in changes)], mode="add")
    return path


@UNCLOSED
@pytest.mark.parametrize("change", [{}, {"binary": 1, "byte_ordering": 1}, {"binary": 1, "byte_ordering": 2}])
def test_force_and_acceleration_of_one_point_stay_apart_in_a_universal_file(tmp_path, change):
    units, rate, _, values = recording(universal(tmp_path / "t.uff", change, MOVES | change))
    assert (units, rate) == (["N", "m/s^2"], RATE) and values[10].tolist() == [10.0, 20.0]
    milliseconds = change | {"abscissa_axis_units_lab": "ms"}
    assert recording(universal(tmp_path / "t.uff", milliseconds, MOVES | milliseconds))[1] == 1e3 * RATE


def test_accelerometers_without_names_or_nodes_are_told_apart_by_their_order(tmp_path):
    """The second one was taken as the first one's second record, and dropped."""
    more = MOVES | {"data": 5.0 * np.arange(40)}
    path = universal(tmp_path / "t.uff", {}, MOVES, more, {}, MOVES, more)
    units, _, notes, values = recording(path)
    assert units == ["N", "m/s^2", "m/s^2"] and values[10].tolist() == [10.0, 20.0, 50.0]
    assert "2 channels of this name, told apart by their order" in notes


@UNCLOSED
def test_a_universal_file_agrees_with_them(tmp_path):
    long = {"x": TIME, "num_pts": len(TIME)}
    moves = MOVES | long | {"data": ACCELERATION, "id1": "acceleration", "rsp_node": 2}
    path = universal(tmp_path / "t.uff", long | {"data": FORCE, "id1": "force"}, moves)
    check(fi.read_taps(path), places=1e-4)  # six digits are written


def test_universal_files_in_other_units_or_with_unknown_ones(tmp_path):
    path = universal(tmp_path / "t.uff", {}, {"ordinate_axis_units_lab": "bananas"} | MOVES, before=[POUNDS])
    *_, notes, values = recording(path)
    assert values[10] == pytest.approx([10.0 / 0.22481, 20.0 / 3.2808]) and "brought to N by data set 164" in notes
    assert "'bananas' is not known" in notes


def test_directions_times_and_lengths_of_a_universal_file_are_heeded(tmp_path):
    """A sensor against the hammer moved the other way, and one that began later moved too early, without a word."""
    path = tmp_path / "t.uff"
    *_, notes, values = recording(universal(path, {"id1": "force"}, MOVES | {"id1": "a", "rsp_dir": -3}))
    assert (
        values[10].tolist() == [10.0, -20.0]
        and notes == "a: turned around, as it counts against the direction of the force"
    )
    for force, moves in ((-3, -3), (0, -3), (-3, 0)):
        assert recording(universal(path, {"rsp_dir": force}, MOVES | {"rsp_dir": moves}))[3][10].tolist() == [
            10.0,
            20.0,
        ]
    late = MOVES | {"x": RECORD["x"] + 3.0 / RATE, "abscissa_min": 3.0 / RATE}
    with pytest.raises(ValueError, match=r"channels that begin .* s apart; export all"):
        readers.arrays(universal(path, {}, late))
    short = MOVES | {"x": RECORD["x"][:30], "data": MOVES["data"][:30], "num_pts": 30}
    assert "channels of 30 to 40 samples were cut to the shortest" in recording(universal(path, {}, short))[2]
    fast, slow = ({"abscissa_axis_units_lab": unit} for unit in ("msec", "bananas"))
    assert recording(universal(path, fast, MOVES | fast))[1] == 1e3 * RATE
    assert (
        "the unit 'bananas' of its times is not known, s assumed" in recording(universal(path, slow, MOVES | slow))[2]
    )


@pytest.mark.parametrize(("unit", "factor"), [("µs", 1e-6), ("μs", 1e-6), ("MSEC", 1e-3), ("", 1.0), ("ft", None)])
def test_units_of_an_axis_are_known_in_any_letters(unit, factor):
    assert units.axis_factor(unit, readers.TIME_UNITS) == factor


@pytest.mark.parametrize("digits", [4, 5])
def test_times_of_few_digits_in_microseconds_are_even(tmp_path, digits):
    """Rounding moved the last time, which set the step, as well as those compared with it."""
    n = 1000 if digits == 4 else 10000
    rows = "".join(f"{1e6 * k / 12800.0:.{digits}g},{k % 7}\n" for k in range(n))
    (tmp_path / "t.csv").write_text("Time [\u03bcs],Force [N]\n" + rows, encoding="utf-8")
    assert readers.read(tmp_path / "t.csv").rate == pytest.approx(12800.0, rel=1e-3)


def test_channels_of_a_labview_file_begin_together(tmp_path):
    (tmp_path / "t.lvm").write_bytes(labview(seg="X0\t0,0\t0,002"))
    with pytest.raises(ValueError, match=r"channels that begin 0\.002 s apart"):
        readers.arrays(tmp_path / "t.lvm")


@UNCLOSED
@pytest.mark.parametrize(
    ("change", "spoil", "said"),
    [
        ({}, lambda raw: raw[: 2 * len(raw) // 3], "ends within a data set; it may be cut off"),
        ({}, lambda raw: raw.replace(b"        40", b"2147483647", 1),
         "states 2147483647 samples .* holds 40; export it again"),
        ({}, lambda raw: raw.replace(b"   1.00000000000e+01", b"                 nan", 1), "no finite number"),
        ({"binary": 1, "data": np.where(RECORD["x"] == RECORD["x"][3], np.inf, 0.0)}, None, "no finite number"),
        ({"ordinate_axis_units_lab": "g"}, None,
         "states the unit 'g' for 'node 1 direction 3', whose code 13 means N; export it again"),
    ],
    ids=["cut off", "samples", "nan", "infinite", "unit"],
)  # fmt: skip
def test_damaged_universal_files_are_refused(tmp_path, change, spoil, said):
    path = universal(tmp_path / "t.uff", change)
    if spoil is not None:
        path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(ValueError, match=said):
        readers.arrays(path)


@pytest.mark.parametrize(
    ("off", "rounded", "even"), [(0.015, 0, True), (0.05, 0, False), (0, 1.7e-5, True), (0, 7.1e-5, False)]
)
def test_a_sample_off_its_time_by_a_fiftieth_of_a_step_is_told_unless_times_are_rounded(tmp_path, off, rounded, even):
    time = TIME + off / RATE * (np.arange(2600) >= 200)  # the clock jumped
    time = np.round(time / rounded) * rounded if rounded else time
    path = table(tmp_path / "t.csv", "Time [s],Force [N],Acceleration [m/s^2]\n", (time, FORCE, ACCELERATION))
    if even:
        assert recording(path)[1] == pytest.approx(RATE, rel=1e-3 if rounded else 1e-4)
    else:
        with pytest.raises(ValueError, match="not evenly sampled"):
            recording(path)
