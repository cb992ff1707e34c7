"""Read the channels of a measurement from a file; `records` finds the taps in them."""

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, isolated, kept
from ..modes import universal_files
from . import units

END_OF_HEADER = "***End_of_Header***"
DECIMAL = r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?"  # a number with a decimal comma, or two numbers
COMMENTS = ("#", "%", "//")  # begin lines that are no data
HEADER_LINES = 200  # [-] of a text table at most, before its numbers begin
LEAST = 8  # [-] samples of a channel
AGREE = 0.01  # [-] two statements of the rate may differ by this, as written with few digits
MOST_CHANNELS = 256  # [-] of a file; an array with more rows holds something else
RATE_NAMES = ("rate", "fs", "sampling_rate", "samplerate", "sample_rate", "sampling_frequency", "frequency")
STEP_NAMES = ("dt", "delta_x", "delta_t", "tsample", "sampling_interval")
TIME_NAMES = ("time", "t", "times", "x_value", "zeit", "time_s")
TIME_UNITS = {
    "s": 1.0, "sec": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0,
}  # fmt: skip
TIME_RESPONSE, FREQUENCY_RESPONSE, COHERENCE = 1, 4, 6  # function types of data set 58
UFF_TYPES = {  # function types of data set 58 -> what it holds
    1: "time records", 2: "auto spectra", 3: "cross spectra", 4: "frequency responses", 5: "transmissibilities",
    6: "coherences", 7: "auto-correlations", 8: "cross-correlations", 9: "power spectral densities",
    10: "energy spectral densities", 11: "probability densities", 12: "spectra",
}  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Recording(check.Brief):
    """All channels of a file as they stand there."""

    segments: tuple[np.ndarray, ...]  # each (n_samples, n_channels), in the units of the file
    names: tuple[str, ...]
    units: tuple[str, ...]  # as written in the file; "" if it states none
    rate: float | None  # [Hz] None: the file does not state it
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for segment in self.segments:
            segment.setflags(write=False)


KINDS = kept.kinds(Recording)


def read(path: Any) -> Recording:
    """Read a LabVIEW, text, NumPy, WAV, MATLAB or universal file (data set 58), in a separate process.

    Raises
    ------
    ValueError
        If the file holds no channels, or channels that are uneven in time or not finite.
    """
    found = isolated.read_apart(check.path("path", path), "a measurement", "taps.readers:arrays")
    recording: Recording = kept.restore(KINDS, found)["recording"]
    return recording


def arrays(path: Path) -> dict[str, np.ndarray]:
    """The result of `read` as arrays, for the separate process."""
    reader = {
        ".lvm": labview, ".npy": numpy_file, ".npz": numpy_file, ".wav": wav, ".mat": matlab, ".uff": universal,
        ".unv": universal, ".58": universal,
    }.get(path.suffix.lower())  # fmt: skip
    if reader is None:
        with path.open("rb") as file:
            head = file.read(64)
        universal_file = re.match(rb"[ \t]*-1[ \t]*\r?\n[ \t]*\d", head)
        reader = labview if head.startswith(b"LabVIEW Measurement") else universal if universal_file else table
    found = reader(path)
    for i, segment in enumerate(found.segments):
        if len(segment) < LEAST:
            raise ValueError(f"{path.name} has {len(segment)} samples in segment {i + 1}; at least {LEAST} are needed")
        if not (np.abs(segment) <= check.REACH).all():
            row, column = np.argwhere(~(np.abs(segment) <= check.REACH))[0]
            raise ValueError(
                f"{path.name} has a value that is no finite number: sample {row + 1} of {found.names[column]!r} "
                f"in segment {i + 1}; export it again, or cut it out"
            )
    if not found.segments or not found.names:
        raise ValueError(f"{path.name} holds no channels")
    names, unit, notes = (tuple(map(check.line, texts)) for texts in (found.names, found.units, found.notes))
    return kept.flatten(KINDS, recording=replace(found, names=names, units=unit, notes=notes))


def _text(path: Path) -> list[str]:
    """The lines of a text file in UTF-8, UTF-16 or Latin-1."""
    raw = path.read_bytes()
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16").splitlines()
    if b"\0" in raw[:4096]:
        raise ValueError(f"{path.name} is not text; give .npy, .npz, .wav, .mat or .uff its own ending")
    try:
        return raw.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return raw.decode("latin-1").splitlines()


def labview(path: Path) -> Recording:
    """A LabVIEW measurement file: every segment has a header of its own.

    References
    ----------
    National Instruments, "Specification for the LabVIEW Measurement File (.lvm)".
    """
    lines = _text(path)
    if not lines or not lines[0].startswith("LabVIEW Measurement"):
        raise ValueError(
            f"{path.name} does not begin with 'LabVIEW Measurement'; for a plain table use the ending .csv"
        )
    separator = "," if any(re.match(r"Separator[\t,]Comma", line) for line in lines[:30]) else "\t"
    common = _header(lines[: _end_of_header(lines, 0, path)], separator)
    segments: list[np.ndarray] = []
    rates: list[float] = []
    notes: list[str] = []
    first: tuple[tuple[str, ...], tuple[str, ...]] | None = None
    for head, names, rows in _labview_segments(lines, separator, path):
        stated_count = max((int(cell) for cell in head.get("Samples") or [] if cell.isdigit()), default=0)
        if len(rows) < stated_count:
            notes.append(
                f"segment {len(segments) + 1} states {stated_count} samples and holds {len(rows)}: the file may be cut "
                "off; its last row was left out"
            )
            rows = rows[:-1]
        columns = [name for name in names if name]
        columns = columns[:-1] if columns and columns[-1] == "Comment" else columns
        spread = common.get("X_Columns", ["One"])[0]
        n_channels = int(float((head.get("Channels") or [str(len(columns))])[0]))
        if not 0 < n_channels <= MOST_CHANNELS:
            raise ValueError(f"{path.name} states {n_channels} channels; 1 to {MOST_CHANNELS} can be read")
        if spread == "Multi":
            use, titles = list(range(1, 2 * n_channels, 2)), columns[1::2]
        else:  # "No" and "One": the first column is the time, or empty
            use, titles = list(range(1, 1 + n_channels)), columns[1:]
        comma = common.get("Decimal_Separator", ["."])[0] == ","
        if not comma and separator != "," and any("," in row for row in rows[:3]):
            comma = True
            notes.append("its numbers have decimal commas, which its header does not say")
        timed = spread != "Multi" and bool(rows) and _number(rows[0].split(separator)[0], comma)
        values = _numbers(rows, separator, [0, *use] if timed else use, comma, path)
        time, values = (values[:, 0], values[:, 1:]) if timed else (None, values)
        stated = head.get("Y_Unit_Label") or []
        channel = tuple((titles[i] if i < len(titles) else f"channel {i + 1}") for i in range(n_channels))
        unit = tuple(stated[i] if i < len(stated) else "" for i in range(n_channels))
        for what, there, before in zip(("channels", "units"), (channel, unit), first or ()):
            if there != before:
                raise ValueError(f"{path.name} has other {what} in segment {len(segments) + 1} than in segment 1")
        first = first or (channel, unit)
        segments.append(values)
        rates += _labview_rates([cell for cell in head.get("Delta_X") or [] if cell], time, path)
        begun = [float(cell.replace(",", ".")) for cell in head.get("X0") or [] if _number(cell, True)]
        _refuse_apart(path, begun, rates[-1] if rates else np.inf)
    if first is None:
        raise ValueError(f"{path.name} holds a header but no samples")
    if rates and not np.allclose(rates, rates[0], rtol=1e-6):
        raise ValueError(f"{path.name} has channels of different rates, {min(rates):g} and {max(rates):g} Hz")
    return Recording(tuple(segments), *first, _round_rate(rates[0]) if rates else None, tuple(dict.fromkeys(notes)))


def _refuse_apart(path: Path, begun: list[float], rate: float) -> None:
    """ValueError if channels begin at different times [s], by a tenth of a sample or more."""
    if begun and rate * np.ptp(begun) > 0.1:
        raise ValueError(f"{path.name} has channels that begin {np.ptp(begun):.3g} s apart; export all from one on")


def _labview_rates(steps: list[str], time: np.ndarray | None, path: Path) -> list[float]:
    """Rates [Hz] by the steps stated, or by the times if none is; both have to agree."""
    found = []
    for cell in steps:
        if not _number(cell, True) or not float(cell.replace(",", ".")) > 0.0:
            raise ValueError(f"{path.name} states a step of {cell[:20]!r} s; it must be positive")
        found.append(1.0 / float(cell.replace(",", ".")))
    if time is None or len(time) < 2 or not np.ptp(time) > 0.0:
        return found
    if not found:
        return [_rate(path, time)]
    mean = (len(time) - 1) / (time[-1] - time[0])
    if abs(mean / found[0] - 1.0) > AGREE:
        raise ValueError(
            f"{path.name} states a rate of {found[0]:g} Hz, but its times have {mean:g} Hz; export it again"
        )
    return found


def _end_of_header(lines: list[str], start: int, path: Path) -> int:
    for i in range(start, len(lines)):
        if lines[i].startswith(END_OF_HEADER):
            return i
    raise ValueError(f"{path.name} has no line {END_OF_HEADER}; it may be cut off")


def _header(lines: list[str], separator: str) -> dict[str, list[str]]:
    """Keys and values of a LabVIEW header."""
    rows = (line.split(separator) for line in lines)
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows if row and row[0].strip()}


def _labview_segments(lines: list[str], separator: str, path: Path) -> Iterator[tuple[dict, list[str], list[str]]]:
    """Header, headings and rows of every segment."""
    i = _end_of_header(lines, 0, path) + 1
    while i < len(lines):
        if lines[i].startswith("***Start_Special***"):
            while i < len(lines) and not lines[i].startswith("***End_Special***"):
                i += 1
            i += 1
        elif lines[i].split(separator)[0].strip() == "Channels":
            end = _end_of_header(lines, i, path)
            head = _header(lines[i:end], separator)
            names = [name.strip() for name in lines[end + 1].split(separator)] if end + 1 < len(lines) else []
            i = end + 2
            start = i
            while i < len(lines) and lines[i].strip() and not lines[i].startswith(("Channels", "***")):
                i += 1
            if i > start:
                yield head, names, lines[start:i]
        else:
            i += 1


def _numbers(rows: list[str], separator: str | None, use: list[int], comma: bool, path: Path) -> np.ndarray:
    """Columns ``use`` of rows of text as floats (n_samples, n_columns)."""
    rows = [row.replace(",", ".") for row in rows] if comma else rows
    rows = [row.replace('"', "") for row in rows] if rows and '"' in rows[0] else rows
    try:
        return np.loadtxt(rows, delimiter=separator, usecols=use, ndmin=2, comments=None)
    except (ValueError, IndexError) as error:
        for i, row in enumerate(rows):
            cells = row.split(separator)
            if max(use) >= len(cells) or not all(_number(cells[k], False) for k in use):
                raise ValueError(
                    f"{path.name} has a row without {len(use)} numbers, {i + 1} rows into a segment: {row[:60]!r}; "
                    "export it again, or cut it out"
                ) from None
        raise ValueError(f"{path.name} cannot be read as numbers: {error}") from None


def _round_rate(rate: float) -> float:
    """A rate as it was set: times are written with few digits."""
    for near in (round(rate), round(rate, 1)):
        if abs(near - rate) < 1e-5 * rate:
            return float(near)
    return float(rate)


def table(path: Path) -> Recording:
    """A text table: tabs, semicolons, commas or blanks between numbers, points or commas in them, headings or none."""
    whole = [line for line in _text(path) if line.strip()]
    lines = [line for line in whole if not line.lstrip().startswith(COMMENTS)]
    commented = bool(whole) and whole[0] not in lines
    for separator, comma in (("\t", False), ("\t", True), (";", False), (";", True), (",", False), (None, False),
                             (None, True)):  # fmt: skip
        first = _first_row(lines, separator, comma, commented)
        if first is not None:
            break
    else:
        raise ValueError(f"{path.name} has no rows of numbers in its first {HEADER_LINES} lines")
    start, row = first
    width, use = len(row), [i for i, cell in enumerate(row) if cell]
    ended = len(lines[start].split(separator))  # columns of a heading whose last one is empty below it
    if width > MOST_CHANNELS:
        raise ValueError(f"{path.name} has {width} columns; at most {MOST_CHANNELS} can be read")
    said = [line.lstrip(" #%/") for line in whole[: whole.index(lines[start])] if line not in lines]
    for above in (lines[:start], said if commented else []):  # a comment may be a heading, as numpy.savetxt writes it
        heads = [[line.strip(' "')] if width == 1 else _cells(line, separator) for line in above]
        heads = [cells[:width] for cells in heads if len(cells) in (width, ended) and any(cells)]
        if heads:
            break
    names, unit = [f"column {i + 1}" for i in range(width)], [""] * width
    if heads:
        names, unit = map(list, zip(*map(units.label, heads[-1])))
        last = [cell.strip("[]() ") for cell in heads[-1]]
        if len(heads) > 1 and (any(map(units.si_unit, last)) or all(map(units.is_unit, filter(None, last)))):
            (names, before), unit = map(list, zip(*map(units.label, heads[-2]))), last
            for name, one, other in zip(names, before, unit):
                if one and other and units.si_unit(one) != units.si_unit(other):
                    raise ValueError(f"{path.name} states two units for {name!r}, {one!r} and {other!r}")
    values = _numbers(lines[start:], separator, use, comma, path)
    long = next((line for line in lines[start:] if any(map(str.strip, line.split(separator)[width:]))), None)
    if long is not None:
        raise ValueError(f"{path.name} has {width} columns, but also a row {long[:60]!r}; export it again")
    if separator == ",":
        rows, timed = lines[start:], bool(heads) or (np.diff(values[:, 0]) > 0.0).all()
        pattern = f'.*"{DECIMAL}".*|{"" if timed else f"{DECIMAL}(,{DECIMAL})*"}'
        if all(re.fullmatch(pattern, row.strip()) for row in rows):
            raise ValueError(
                f"{path.name} has rows like {rows[0].strip()[:40]!r}, whose commas may be decimal; write points in its "
                f"numbers, semicolons between its columns, or a heading with a name for each of {width} columns"
            )
    return _timed(path, values, [names[i] for i in use], [unit[i] for i in use], bool(heads))


def _cells(line: str, separator: str | None) -> list[str]:
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


def _number(text: str, comma: bool) -> bool:
    return check.numeric(text.replace(",", ".") if comma else text)


def _first_row(
    lines: list[str], separator: str | None, comma: bool, commented: bool
) -> tuple[int, list[str]] | None:  # fmt: skip
    """Number of the first row of numbers, right or wrong, and the cells of a right one; None unless three are right.

    Below a heading, of words only or a comment, a row that holds both words and numbers is a wrong one.
    """
    rows = [_cells(line, separator) for line in lines[: HEADER_LINES + 3]]
    found = [[_number(cell, comma) for cell in cells if cell] for cells in rows]
    shapes = [[not cell for cell in cells] for cells in rows]  # a column may be empty, all along
    whole = [any(f) and all(f) and (separator is None or len(row) > 1) for row, f in zip(rows, found)]
    for i, cells in enumerate(rows[2:]):
        if all(whole[i : i + 3]) and shapes[i] == shapes[i + 1] == shapes[i + 2]:
            width = len(cells)
            heading = max(
                (k for k in range(i) if len(rows[k]) == width and not any(found[k])), default=0 if commented else i
            )
            wrong = (k for k in range(heading, i) if len(rows[k]) == width and any(found[k]))
            bare = (k for k in range(i) if whole[k] and len(rows[k]) >= min(width, 2))
            return min([i, *wrong, *bare]), cells
    return None


def _timed(path: Path, values: np.ndarray, names: list[str], unit: list[str], headed: bool) -> Recording:
    """The channels of a table; a column of times becomes the rate."""
    time = [i for i, name in enumerate(names) if name.strip().lower() in TIME_NAMES]
    notes: tuple[str, ...] = ()
    if not time and not headed and values.shape[1] > 1 and (np.diff(values[:, 0]) > 0.0).all():
        time, notes = [0], ("the first column ascends and was taken as time in s",)
    if not time:
        return Recording((values,), tuple(names), tuple(unit), None, notes)
    i = time[0]
    if unit[i] and unit[i] not in TIME_UNITS:
        raise ValueError(f"{path.name} has times in {unit[i]!r}; {', '.join(TIME_UNITS)} can be read")
    rate = _rate(path, TIME_UNITS.get(unit[i], 1.0) * values[:, i])
    if headed and not unit[i]:
        notes = (f"{names[i]}: no unit stated, s assumed, so that the rate is {rate:g} Hz",)
    keep = [k for k in range(len(names)) if k != i]
    return Recording((values[:, keep],), tuple(names[k] for k in keep), tuple(unit[k] for k in keep), rate, notes)


def _rate(path: Path, time: np.ndarray) -> float:
    """The rate [Hz] of evenly spaced times; rounding of the written digits is allowed."""
    if len(time) < 2 or not np.isfinite(time).all() or time[-1] <= time[0]:
        raise ValueError(f"{path.name} has times that do not ascend; give the channels without them, and rate=")
    place = np.arange(len(time)) - 0.5 * (len(time) - 1)
    step = float(place @ time / (place @ place))  # the ends alone may both be rounded
    away = np.abs(time - time.mean() - step * place)
    spread = float(np.ptp(np.diff(time)))  # times written with few digits differ by one unit of the last
    # a gap is a whole step; rounded times may be 0.3 off an even grid, others 0.02
    if away.max() > np.clip(0.6 * spread / step, 0.02, 0.3) * step:
        k = int(away.argmax())
        raise ValueError(
            f"{path.name} is not evenly sampled by its times: sample {k + 1} is {away[k]:.2g} s off a step of "
            f"{step:.3g} s; export it again, or give the channels without them, and rate="
        )
    return _round_rate(1.0 / step)


def _columns(path: Path, found: dict[str, np.ndarray]) -> Recording:
    """Named arrays as channels: (n_samples,), or (n_taps, n_samples) with the longer axis in time."""
    rates, notes, clock, channels, unit, n_times = [], [], [], {}, {}, None
    for name, value in found.items():
        low = name.rsplit(".", 1)[-1].lower()
        if value.dtype.kind == "c":
            raise ValueError(f"{path.name} holds complex numbers in {name!r}; samples in time are real")
        if value.dtype.kind not in "iuf":
            notes += [f"{name} holds no numbers and was left out"] if value.size > 1 else []
        elif value.size == 1:
            size = float(value.ravel()[0])
            if low in RATE_NAMES:
                rates.append(size)
            elif low in STEP_NAMES and size > 0.0:
                rates.append(_round_rate(1.0 / size))
        elif value.size and low in TIME_NAMES:
            times = np.asarray(value, float).reshape(-1, value.shape[-1])
            times = times[0] if len(times) < times.shape[1] else times[:, 0]
            rates.append(_rate(path, times))
            clock = [f"{name}: no unit stated, s assumed, so that the rate is {rates[-1]:g} Hz"]
            n_times = len(times)
        elif value.size:
            channels[name] = np.squeeze(np.asarray(value, float))
            unit[name] = "counts" if value.dtype.kind in "iu" else ""
    if len(rates) > 1 and not np.allclose(rates, rates[0], rtol=AGREE):
        raise ValueError(f"{path.name} states different rates, {min(rates):g} and {max(rates):g} Hz; give one of them")
    rate = rates[0] if rates else None
    if not channels:
        raise ValueError(f"{path.name} holds no arrays of samples" + (f"; {notes[0]}" if notes else ""))
    longest = n_times or max(max(value.shape) for value in channels.values())
    kept = {}
    for name, value in channels.items():
        if value.ndim > 2 or longest not in value.shape:
            notes.append(f"{name} has shape {value.shape} and was left out")
            continue
        # fewer rows are taps or channels without a doubt
        if value.ndim == 2 and n_times is None and min(value.shape) > 16:
            notes.append(f"the longer side of {name}, {longest} of {value.shape}, was taken as time")
        kept[name] = np.atleast_2d(value if value.shape[-1] == longest else value.T)
    if not kept:
        raise ValueError(f"{path.name} holds {longest} times but no array of as many samples; {notes[-1]}")
    n_taps = max(len(value) for value in kept.values())
    single = len(kept) == 1 and n_taps > 1 and not units.FORCE_NAMES.search(next(iter(kept)))
    if single:  # one array of several channels
        (name, rows), n_taps = next(iter(kept.items())), 1
        if len(rows) > MOST_CHANNELS:
            raise ValueError(f"{path.name} holds an array of shape {rows.shape}; give channels by time")
        kept = {f"{name} {i + 1}": row[None] for i, row in enumerate(rows)}
        unit = dict.fromkeys(kept, unit[name])
        notes.append(f"the rows of {name} were taken as {len(rows)} channels")
    for name in [name for name, value in kept.items() if len(value) != n_taps]:
        notes.append(f"{name} has {len(kept.pop(name))} rows instead of {n_taps} and was left out")
    segments = tuple(np.column_stack([value[i] for value in kept.values()]) for i in range(n_taps))
    return Recording(segments, tuple(kept), tuple(unit[name] for name in kept), rate, (*notes, *clock))


def numpy_file(path: Path) -> Recording:
    """An .npy array, or an .npz of named arrays with ``rate``, ``dt`` or ``time`` among them."""
    with path.open("rb") as file:
        if not file.read(6).startswith((b"PK", b"\x93NUMPY")):
            raise ValueError(f"{path.name} is no file of NumPy; give a text table the ending .csv")
    loaded = np.load(path, allow_pickle=False)
    alone = isinstance(loaded, np.ndarray)
    return _columns(path, {"array": loaded} if alone else {name: loaded[name] for name in loaded.files})


def matlab(path: Path) -> Recording:
    """A MATLAB file up to version 7; structures are opened, and cells of equally long records joined."""
    from scipy.io import loadmat

    with path.open("rb") as file:
        if file.read(16).startswith(b"MATLAB 7.3"):
            raise ValueError(f"{path.name} is a MATLAB 7.3 file; save it with '-v7' and try again")
    found: dict[str, np.ndarray] = {}
    opened = {name: value for name, value in loadmat(path, simplify_cells=True).items() if not name.startswith("__")}
    while opened:
        name, value = next(iter(opened.items()))
        del opened[name]
        if isinstance(value, dict):
            opened = {f"{name}.{key}": each for key, each in value.items()} | opened
            continue
        rows = [np.ravel(each) for each in value] if isinstance(value, (list, np.ndarray)) and len(value) else []
        whole = np.asarray(value) if not isinstance(value, list) else np.zeros(len(value), object)
        if whole.dtype == object and rows and len({row.shape for row in rows}) == 1:
            whole = np.array(rows) if all(row.dtype.kind in "iufc" for row in rows) else whole
        found[name] = whole if whole.size > 1 or whole.dtype != object else np.zeros(2, object)
    return _columns(path, found)


def wav(path: Path) -> Recording:
    """A WAV file; integers become parts of full scale."""
    from scipy.io import wavfile

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        rate, values = wavfile.read(path)
    cut = any("EOF" in str(each.message) for each in said)
    notes = ["the file is cut off: it holds fewer samples than its header states"] if cut else []
    if values.dtype.kind in "iu":
        low, high = np.iinfo(values.dtype).min, np.iinfo(values.dtype).max
        values = (values.astype(float) - 0.5 * (low + high + 1)) / (0.5 * (float(high) - low + 1))
    values = np.asarray(values, float).reshape(len(values), -1)
    names = tuple(f"channel {i + 1}" for i in range(values.shape[1]))
    for name, peak in zip(names, np.abs(values).max(axis=0, initial=0.0)):
        if peak > 1.0:
            notes.append(f"{name} reaches {peak:.3g}, but full scale is 1: it has a unit of its own, or is damaged")
    return Recording((values,), names, ("full scale",) * len(names), float(rate), tuple(notes))


def universal(path: Path) -> Recording:
    """Time records in data set 58 of a universal file; the second record of a channel begins a new segment."""
    file = Universal(path)
    instead = "; export those, or give the path of frequency responses to fi.frf"
    factors = universal_files.factors(file.sets(164))
    channels: dict[tuple[Any, ...], list[np.ndarray]] = {}
    rates, unit, notes, begun = [], {}, [], dict[tuple[Any, ...], list[float]]()
    for one in file.of_type(TIME_RESPONSE, "time records", instead):
        data = np.real(np.asarray(one["data"])).astype(float)
        code = int(one.get("ordinate_spec_data_type", 0))
        stated = str(one.get("ordinate_axis_units_lab") or "").strip()
        stated = "" if stated == "NONE" else stated
        key = (uff_name(one), int(one.get("rsp_node", 0)), int(one.get("rsp_dir", 0)), code)
        known, kind, doubts = units.uff_unit(path, key[0], stated, code, factors)
        notes += doubts
        if kind and not known and kind in factors:
            data = data / factors[kind]
            notes.append(f"{key[0]}: brought to {kind} by data set 164")
        unit[key] = stated if known or not kind else kind
        channels.setdefault(key, []).append(data)
        label = str(one.get("abscissa_axis_units_lab") or "").strip()
        known_second = units.axis_factor(label, TIME_UNITS)
        notes += [f"{key[0]}: the unit {label!r} of its times is not known, s assumed"] * (known_second is None)
        second = known_second or 1.0
        begun.setdefault(key, []).append(second * float(one.get("abscissa_min") or 0.0))
        step = second * float(one.get("abscissa_inc") or 0.0)
        rates.append(1.0 / step if step > 0.0 else _rate(path, second * np.asarray(one["x"], float)))
    if not np.allclose(rates, rates[0], rtol=1e-6):
        raise ValueError(f"{path.name} has records of different rates, {min(rates):g} and {max(rates):g} Hz")
    count = min(len(records) for records in channels.values())
    for key in [key for key in channels if len(channels[key]) % count == 0 and len(channels[key]) > count]:
        if (units.si_unit(unit[key]) or "N")[0] != "N":  # sensors without names or nodes of their own
            several, first = channels.pop(key), begun.pop(key)
            n = len(several) // count
            notes.append(f"{key[0]}: {n} channels of this name, told apart by their order")
            for j in range(n):
                new = (f"{key[0]} #{j + 1}", *key[1:])
                channels[new], begun[new], unit[new] = several[j::n], first[j::n], unit[key]
    if any(len(records) > count for records in channels.values()):
        notes.append(f"only {count} records of each channel were used, as many as all have")
    # signs of the directions, 0 if not stated
    pushed = {np.sign(key[2]) for key in channels if (units.si_unit(unit[key]) or "")[:1] == ("N",)}
    turned = [key for key in channels if pushed == {-np.sign(key[2])} != {0}]
    notes += [f"{name}: turned around, as it counts against the direction of the force" for name, *_ in turned]
    segments = []
    for i in range(count):
        _refuse_apart(path, [each[i] for each in begun.values()], rates[0])
        rows = [-records[i] if key in turned else records[i] for key, records in channels.items()]
        least, most = min(map(len, rows)), max(map(len, rows))
        notes += [f"channels of {least} to {most} samples were cut to the shortest"] if least < most else []
        segments.append(np.column_stack([row[:least] for row in rows]))
    names = [name for name, *_ in channels]
    names = [f"{name} ({unit[key]})" if names.count(name) > 1 else name for name, key in zip(names, channels)]
    notes = list(dict.fromkeys(notes))
    return Recording(
        tuple(segments), tuple(names), tuple(unit[key] for key in channels), _round_rate(rates[0]), tuple(notes)
    )


class Universal:
    """A universal file as pyuff opens it; ValueError if it is cut off."""

    def __init__(self, path: Path) -> None:
        import pyuff

        universal_files.refuse_cut(path)
        self.path, self.raw = path, path.read_bytes()
        self.file: Any = pyuff.UFF(str(path))
        self.kinds = [int(kind) for kind in self.file.get_set_types()]  # of its data sets

    def sets(self, *kinds: int) -> list[dict]:
        """The data sets of some kinds."""
        return [self.file.read_sets(i) for i, kind in enumerate(self.kinds) if kind in kinds]

    @cached_property
    def function_sets(self) -> list[dict]:
        """The data sets 58."""
        return self.sets(58)

    def of_type(self, function: int, words: str, instead: str = "") -> list[dict]:
        """The functions of a type, whole and finite; ValueError says what the file holds without any."""
        found = []
        for one, i in zip(self.function_sets, (i for i, kind in enumerate(self.kinds) if kind == 58)):
            if int(one.get("func_type", 0)) == function:
                first, last = self.file._block_ind[i][:2]
                tail = b"\n".join(self.raw[first : last + 1].split(b"\n")[13:])  # behind the lines of its head
                count, name = int(one["num_pts"]), uff_name(one)
                if len(one["data"]) != count:
                    raise ValueError(
                        f"{self.path.name} states {count} samples of {name!r} and holds {len(one['data'])}; export it "
                        "again"
                    )
                if one["binary"]:
                    size = 4 if one["ord_data_type"] in (2, 5) else 8
                    kind = f"{'<' if one['byte_ordering'] == 1 else '>'}f{size}"
                    good = bool(np.isfinite(np.frombuffer(tail[: len(tail) // size * size], kind)).all())
                else:
                    good = b"n" not in tail.lower()  # of NaN and infinity, which the reader would replace by zero
                if not good:
                    raise ValueError(
                        f"{self.path.name} has a value of {name!r} that is no finite number; export it again, or cut "
                        "it out"
                    )
                found.append(one)
        if not found:
            types = sorted({int(one.get("func_type", 0)) for one in self.function_sets})
            said = [f"{UFF_TYPES.get(each, 'functions')} (data set 58, function type {each})" for each in types]
            others = ", ".join(str(kind) for kind in sorted(set(self.kinds) - {58}))
            holds = " and ".join(said + [f"data sets {others}"] * bool(others)) or "no data sets"
            raise ValueError(f"{self.path.name} holds {holds}, no {words}{instead}")
        return found


def uff_name(one: dict) -> str:
    name = str(one.get("id1", "")).strip()
    return name if name not in ("", "NONE") else f"node {one.get('rsp_node', 0)} direction {one.get('rsp_dir', 0)}"
