"""The table of measured taps, and how files become one."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from .._base import check, markup
from . import arguments, readers, triggers, units

TOGETHER = 0.05  # [s] pulses closer than this belong to one tap: nobody taps twice within a twentieth of a second
BEFORE = 0.02  # [s] longest record before a tap
LONGEST = 10.0  # [s] longest record of one tap
FEWEST = 8  # [-] samples before a tap from which an offset is estimated
RATES = (1.0, 1e9)  # [Hz] allowed
MOST_TAPS = 10_000  # [-] of one file: more are noise


@dataclass(frozen=True, eq=False)
class Taps:
    """Measured taps: a table of force and responses over tap and time.

    `table` is an xarray.Dataset with ``force`` (tap, time) [N], ``response`` (tap, time, channel) in SI units,
    ``onset`` (tap) [s], ``overload`` (tap, sensor) and the attribute ``rate`` [Hz]. Time is zero at the first sample of
    a record.
    """

    table: xr.Dataset
    notes: tuple[str, ...] = ()  # what was assumed, and what is wrong with single taps

    @classmethod
    def from_arrays(
        cls,
        force: Any,
        response: Any = None,
        *,
        rate: float,
        names: Sequence[str] | None = None,
        units: Sequence[str] | None = None,
        overload: Any = None,
        labels: Sequence[str] | None = None,
        notes: Iterable[str] = (),
    ) -> "Taps":
        """Taps from arrays in SI units, as other programs hold them.

        Parameters
        ----------
        force : array_like, (n_taps, n_times) or (n_times,) [N]
        response : array_like, (n_taps, n_times) or (n_taps, n_times, n_channels), optional
        rate : float [Hz]
        names, units : sequence of str, optional
            Of the responses; by default accelerations in m/s^2.
        overload : array_like of bool, (n_taps, 1 + n_channels), optional
            Of the force and the responses; by default, a channel with three equal largest samples in a row is cut off.
        labels : sequence of str, optional
            Of the taps; by default "tap 1" and so on.

        Examples
        --------
        >>> pulse = 100.0 * np.sin(np.linspace(0.0, np.pi, 20)) ** 2
        >>> taps = fi.Taps.from_arrays(np.pad(pulse, 30), rate=25600.0)
        >>> taps.n_taps, taps.n_pulses.tolist(), round(float(taps.impulse[0]), 4)  # N s
        (1, [1], 0.0371)
        """
        rate = check.between("rate", rate, *RATES, "Hz")
        rows = check.array("force", force, (None, None), "N", lift=True)
        n_taps, n_times = rows.shape
        if n_taps < 1 or n_times < readers.FEWEST:
            raise ValueError(f"force must hold at least one tap of {readers.FEWEST} samples, got shape {rows.shape}")
        if response is None:
            others = np.zeros((n_taps, n_times, 0))
        else:
            raw = check.numbers("response", response)
            raw = raw[None, :, None] if raw.ndim == 1 else raw[..., None] if raw.ndim == 2 else raw
            others = check.array("response", raw, (n_taps, n_times, None))
        n_channels = others.shape[2]
        names = [f"response {i + 1}" for i in range(n_channels)] if names is None else names
        names = arguments.texts("names", names, n_channels, "response")
        unit = arguments.texts("units", ["m/s^2"] * n_channels if units is None else units, n_channels, "response")
        for text in unit:
            check.one_of("units", text, [si for si in readers.units.KINDS if si != "N"])
        tags = [f"tap {i + 1}" for i in range(n_taps)] if labels is None else labels
        tags = arguments.texts("labels", tags, n_taps, "tap of force")
        said = arguments.texts("notes", tuple(notes) if isinstance(notes, (list, tuple)) else notes)
        for name, given, wanted in (
            ("names", names, n_channels),
            ("units", unit, n_channels),
            ("labels", tags, n_taps),
        ):
            if len(given) != wanted:
                raise ValueError(f"{name} must have {wanted} entries, got {len(given)}")
        if overload is None:
            cut = [[triggers.clipped(f), *(triggers.clipped(r) for r in each.T)] for f, each in zip(rows, others)]
        else:
            flags = np.asarray(check.shown(overload) if isinstance(overload, dict) else overload)
            if flags.dtype != bool or flags.shape not in ((), (n_taps, 1 + n_channels)):
                raise ValueError(
                    f"overload must be bools of shape ({n_taps}, {1 + n_channels}), got {check.shown(overload)}"
                )
            cut = np.broadcast_to(flags, (n_taps, 1 + n_channels)).tolist()
        begun = [triggers.starts(f, triggers.level(f), n_times) for f in rows]
        onset = np.array([each[0] if each.size else 0 for each in begun]) / rate
        table = xr.Dataset(
            {
                "force": (("tap", "time"), rows, {"units": "N"}),
                "response": (("tap", "time", "channel"), others),
                "onset": ("tap", onset, {"units": "s"}),
                "overload": (("tap", "sensor"), np.array(cut, bool)),
            },
            {
                "tap": tags,
                "time": ("time", np.arange(n_times) / rate, {"units": "s"}),
                "channel": names,
                "units": ("channel", unit),
                "sensor": ["force", *names],
            },
            {"rate": rate},
        )
        return cls(table, tuple(said))

    @property
    def rate(self) -> float:
        """Sampling rate [Hz]."""
        return float(self.table.attrs["rate"])

    @property
    def time(self) -> np.ndarray:
        """Times of the samples, (n_times,) [s]."""
        return self.table["time"].values

    @property
    def force(self) -> np.ndarray:
        """Force, (n_taps, n_times) [N]."""
        return self.table["force"].values

    @property
    def response(self) -> np.ndarray:
        """Responses, (n_taps, n_times, n_channels), in `units`."""
        return self.table["response"].values

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each response."""
        return tuple(map(str, self.table["units"].values))

    @property
    def labels(self) -> tuple[str, ...]:
        """Name of each tap."""
        return tuple(map(str, self.table["tap"].values))

    @property
    def n_taps(self) -> int:
        return self.table.sizes["tap"]

    @property
    def overload(self) -> np.ndarray:
        """Whether the force of each tap is cut off, (n_taps,) bool; `table.overload` has the responses too."""
        return self.table["overload"].values[:, 0]

    @property
    def onset(self) -> np.ndarray:
        """Time at which the force of each tap rises above the trigger, (n_taps,) [s]."""
        return self.table["onset"].values

    @cached_property
    def n_pulses(self) -> np.ndarray:
        """Pulses of each tap, (n_taps,); more than one of a double hit."""
        return np.array([triggers.n_pulses(row) for row in self.force])

    @property
    def peak(self) -> np.ndarray:
        """Largest force of each tap, (n_taps,) [N]."""
        return self.force.max(axis=1)

    @property
    def impulse(self) -> np.ndarray:
        """Impulse of each tap between its first and last sample above `triggers.PULSE` of its peak, (n_taps,) [N s]."""
        above = self.force > triggers.PULSE[1] * self.peak[:, None]
        first = above.argmax(axis=1)
        last = above.shape[1] - above[:, ::-1].argmax(axis=1)
        inside = (np.arange(above.shape[1]) >= first[:, None] - 1) & (np.arange(above.shape[1]) <= last[:, None])
        return (self.force * inside).sum(axis=1) / self.rate

    @property
    def noise(self) -> np.ndarray:
        """Standard deviation of each force before its tap or, if that is short, of its differences, (n_taps,) [N]."""
        begins = np.maximum(0, (self.onset * self.rate).astype(int) - 3)
        return np.array([
            np.std(row[:n]) if n >= FEWEST else triggers.noise(row) for row, n in zip(self.force, begins)
        ])  # fmt: skip

    def pick(self, which: Any) -> "Taps":
        """Some of the taps: numbers, a slice or a mask."""
        try:
            index = np.atleast_1d(np.arange(self.n_taps)[which])
        except (IndexError, TypeError, ValueError):
            index = np.zeros(0, int)
        if index.ndim != 1 or not index.size:
            raise ValueError(f"which must pick some of {self.n_taps} taps by number or mask, got {check.shown(which)}")
        return Taps(self.table.isel(tap=index), self.notes)

    def __len__(self) -> int:
        return self.n_taps

    def between(self, start: float, end: float) -> "Taps":
        """The samples from ``start`` to ``end`` [s] only; time begins at zero again."""
        start, end = check.number("start", start, "s"), check.number("end", end, "s")
        first, last = np.searchsorted(self.time, [start - 0.5 / self.rate, end + 0.5 / self.rate])
        cut = self.table.isel(time=slice(int(first), int(last)))
        if cut.sizes["time"] < readers.FEWEST:
            raise ValueError(
                f"start and end must leave at least {readers.FEWEST} samples of {len(self.time)}, got {start:g} and "
                f"{end:g} s"
            )
        cut = cut.assign_coords(time=("time", np.arange(cut.sizes["time"]) / self.rate, {"units": "s"}))
        cut["onset"] = cut["onset"] - first / self.rate
        return Taps(cut, self.notes)

    def summary(self) -> str:
        """The taps in a few readable lines."""
        lines = [f"{self.n_taps} taps of {len(self.time)} samples at {self.rate:g} Hz"]
        rows = [
            (name, f"{peak:.4g} N", f"{impulse:.4g} N s", str(pulses), ", ".join(self._cut(i)))
            for i, (name, peak, impulse, pulses) in enumerate(zip(self.labels, self.peak, self.impulse, self.n_pulses))
        ]
        lines += markup.columns(rows, ("", "peak", "impulse", "pulses", "cut off"))
        return "\n".join(lines + [f"Note: {note}" for note in self.notes])

    def _cut(self, tap: int) -> list[str]:
        """Names of the sensors that are cut off in a tap."""
        row = self.table["overload"].values[tap]
        return [str(name) for name, cut in zip(self.table["sensor"].values, row) if cut]

    def __repr__(self) -> str:
        return f"Taps({self.n_taps} taps, {len(self.time)} samples at {self.rate:g} Hz)"

    def _repr_html_(self) -> str:
        return markup.paragraphs(self.summary().splitlines())

    def save(self, path: str | Path) -> None:
        """Write the taps to an .npz file that `read_taps` reads again."""
        arrays = {"force": self.force, "rate": np.array(self.rate)}
        for i, (name, unit) in enumerate(zip(self.table["channel"].values, self.units)):
            arrays[f"{name} [{unit}]"] = self.response[:, :, i]
        with check.path("path", path).open("wb") as file:
            np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def read_taps(
    path: Any,
    *,
    force: str | int | None = None,
    response: Any = None,
    rate: float | None = None,
    scale: Any = None,
    units: Mapping[str, str] | None = None,
    trigger: float | None = None,
    before: float | None = None,
    length: float | None = None,
    together: float = TOGETHER,
    full_scale: float | None = None,
) -> Taps:
    """Read the taps of an instrumented hammer from a file, and find them in long records.

    Parameters
    ----------
    path : str or Path
        LabVIEW (.lvm), text (CSV, TSV), NumPy (.npy, .npz), WAV, MATLAB up to version 7 (.mat) or universal file
        (data set 58).
    force : str or int, optional
        Name or number of the force channel, from 0; by default the one with a unit of force, or such a name.
    response : str, int or sequence, optional
        Channels of the response; by default all accelerations, velocities and displacements. ``()`` reads none.
    rate : float [Hz], optional
        Sampling rate, for files that do not state it.
    scale : float or mapping of names to float, optional
        What the numbers of a channel are multiplied with, to give `units`; a single number is for the force.
    units : mapping of names to str, optional
        Units of channels, in place of those in the file: "N", "lbf", "g", "m/s^2", "mm/s", ...
    trigger : float [N], optional
        A tap begins where the force rises above this; by default 5 % of the largest force, and above the noise.
    before, length : float [s], optional
        Record before the tap, and of the whole tap; by default all there is, up to the next tap.
    together : float [s]
        Pulses closer than this are one tap, as those of a double hit.
    full_scale : float [N], optional
        A force that reaches this is cut off.

    Returns
    -------
    Taps
        Its notes say what was assumed, and which taps are cut off or have two pulses.

    Raises
    ------
    ValueError
        If the file, a channel or a tap cannot be found; the message names what there is.

    Examples
    --------
    >>> force = 50.0 * np.maximum(np.sin(np.arange(2000) / 4.0), 0.0) * (np.arange(2000) // 12 == 80)  # one half wave
    >>> np.savetxt("taps.csv", np.column_stack([np.arange(2000) / 10e3, force]), delimiter=",", header="t,Force [N]",
    ...            comments="")
    >>> taps = fi.read_taps("taps.csv")
    >>> taps.n_taps, taps.rate, round(float(taps.peak[0]))
    (1, 10000.0, 50)
    """
    found = readers.read(path)
    name = check.path("path", path).name
    notes = list(found.notes)
    stated = found.rate if rate is None else check.between("rate", rate, *RATES, "Hz")
    if stated is None:
        raise ValueError(f"rate must be given: {name} does not state the sampling rate")
    if found.rate is not None and rate is not None and abs(found.rate / stated - 1.0) > 1e-3:
        notes.append(f"the file states {found.rate:g} Hz; rate={stated:g} Hz was used")
    unit = _units(found, units)
    if full_scale is not None:
        full_scale = check.positive("full_scale", full_scale, "N")
    struck = _force_channel(found, force, unit, name)
    others = _response_channels(found, response, unit, struck)
    scales = _scales(found, scale, struck)
    factor, notes_ = _factor(found.names[struck], unit[struck], "N", scales.get(struck), name)
    notes += notes_
    raw = [segment[:, struck] * factor for segment in found.segments]
    flip = -1.0 if max(row.max() for row in raw) < -min(row.min() for row in raw) else 1.0
    if flip < 0.0:
        notes.append("the force is mostly negative and was turned around")
    kinds, factors = [], []
    for i in others:
        kind = units_kind(unit[i])
        value, more = _factor(found.names[i], unit[i], kind, scales.get(i), name)
        kinds.append(kind)
        factors.append(value)
        notes += more
    segments = [
        (flip * row, segment[:, others] * np.array(factors)) for row, segment in zip(raw, found.segments)
    ]  # each (n_samples,), (n_samples, n_responses)
    options = {"trigger": trigger, "before": before, "length": length, "together": together}
    rows, responses, labels, said = _cut(segments, stated, name, **options)
    cut = [
        [triggers.clipped(row, full_scale), *(triggers.clipped(column) for column in other.T)]
        for row, other in zip(rows, responses)
    ]
    taps = Taps.from_arrays(
        rows, responses, rate=stated, names=[found.names[i] for i in others], units=kinds, overload=cut, labels=labels
    )
    double = [label for label, n in zip(taps.labels, taps.n_pulses) if n > 1]
    said += [f"{', '.join(double)}: more than one pulse, kept as one tap"] if double else []
    flat = [f"{label} ({', '.join(taps._cut(i))})" for i, label in enumerate(taps.labels) if any(cut[i])]
    said += [f"cut off by the range of the channel: {', '.join(flat)}"] if flat else []
    return Taps(taps.table, tuple(notes + said))


def units_kind(unit: str) -> str:
    """The SI unit of a response's kind; an acceleration if the unit is not known."""
    found = units.known(unit)
    return found[0] if found and found[0] != "N" else "m/s^2"


def _units(found: readers.Recording, given: Mapping[str, str] | None) -> list[str]:
    unit = []
    for name, stated in zip(found.names, found.units):
        unit.append(stated or units.label(name)[1])
    for name, text in arguments.table("units", given).items():
        if not isinstance(text, str) or units.known(text) is None:
            words = ", ".join(word for factors in units.KINDS.values() for word in factors)
            raise ValueError(f"units must be one of {words}, got {check.shown(text)} for {name!r}")
        unit[_channel("units", name, found)] = text
    return unit


def _channel(argument: str, which: Any, found: readers.Recording) -> int:
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


def _force_channel(found: readers.Recording, force: Any, unit: list[str], name: str) -> int:
    if force is not None:
        return _channel("force", force, found)
    kinds = [units.known(text) for text in unit]
    hits = [i for i, kind in enumerate(kinds) if kind and kind[0] == "N"]
    hits = hits or [i for i, text in enumerate(found.names) if units.FORCE_NAMES.search(text)]
    if len(hits) != 1 and len(found.names) == 1:
        hits = [0]
    if len(hits) != 1:
        there = ", ".join(repr(text) for text in found.names[:20])
        said = "has several force channels" if hits else "does not say which channel is the force"
        raise ValueError(f"force must be given: {name} {said}; its channels are {there}")
    return hits[0]


def _response_channels(found: readers.Recording, response: Any, unit: list[str], struck: int) -> list[int]:
    if response is not None:
        asked = [response] if isinstance(response, (str, int, np.integer)) else response
        if not isinstance(asked, (list, tuple)):
            raise ValueError(f"response must be the names or numbers of channels, got {check.shown(response)}")
        return [_channel("response", which, found) for which in asked]
    kinds = [units.known(text) for text in unit]
    return [
        i
        for i, (kind, text) in enumerate(zip(kinds, found.names))
        if i != struck and ((kind and kind[0] != "N") or (not unit[i] and units.RESPONSE_NAMES.search(text)))
    ]


def _scales(found: readers.Recording, scale: Any, struck: int) -> dict[int, float]:
    if scale is None:
        return {}
    if isinstance(scale, Mapping):
        scale = arguments.table("scale", scale)
        return {_channel("scale", name, found): check.number(f"scale of {name}", x) for name, x in scale.items()}
    return {struck: check.number("scale", scale)}


def _factor(name: str, unit: str, wanted: str, scale: float | None, file: str) -> tuple[float, list[str]]:
    """What a channel is multiplied with to be in SI, and what was assumed for that."""
    kind = units.known(unit)
    if kind and kind[0] == wanted:
        return kind[1] * (1.0 if scale is None else scale), []
    if scale is not None:
        return scale, []
    if not unit:
        return 1.0, [f"{name}: no unit stated, {wanted} assumed"]
    raise ValueError(
        f"scale must be given for {name!r} of {file}, which is in {unit!r} and not in a unit of the kind {wanted}: "
        f"scale={{{name!r}: ... }} in {wanted} per {unit}"
    )


def _cut(segments, rate, name, *, trigger, before, length, together):
    """Records of equal length around every tap: force, responses, labels and notes."""
    pause = max(1, round(check.positive("together", together, "s") * rate))
    level = None if trigger is None else check.positive("trigger", trigger, "N")
    whole = np.concatenate([row - np.median(row) for row, _ in segments])
    limit = triggers.level(whole) if level is None else level
    places = []  # segment, first sample above the trigger, samples free before and after
    for k, (row, _) in enumerate(segments):
        begun = triggers.starts(row - np.median(row), limit, pause)
        for i, start in enumerate(begun):
            last = begun[i - 1] if i else 0
            end = begun[i + 1] if i + 1 < len(begun) else len(row)
            free = int(start) if not i else min(int(start - last), int(0.5 * (start - last)))
            after = int(end - start) if i + 1 == len(begun) else int(0.5 * (end - start))
            places.append((k, int(start), free, after))
    if not places:
        top = max(float(row.max()) for row, _ in segments)
        raise ValueError(
            f"no tap was found in {name}: its force reaches {top:.3g} N and the trigger is {limit:.3g} N; check scale "
            "and trigger"
        )
    if len(places) > MOST_TAPS:
        raise ValueError(f"{name} has {len(places)} places above {limit:.3g} N; give trigger= and together=")
    wanted = BEFORE if before is None else check.positive("before", before, "s")
    lead = min(round(wanted * rate), min(free for _, _, free, _ in places) if before is None else 10**9)
    tail = min(after for _, _, _, after in places)
    if length is not None:
        tail = max(1, round(check.positive("length", length, "s") * rate) - lead)
    tail = min(tail, round(LONGEST * rate))
    rows, responses, labels, notes, offsets = [], [], [], [], []
    for number, (k, start, _, _) in enumerate(places):
        row, other = segments[k]
        first, last = start - lead, start + tail
        if first < 0 or last > len(row):
            notes.append(f"tap {number + 1} is left out: its record is not complete")
            continue
        quiet = slice(max(0, first), max(0, start - max(3, (start - first) // 4)))
        rest = row[quiet], other[quiet]
        base = (np.median(rest[0]), np.median(rest[1], axis=0)) if len(rest[0]) >= FEWEST else (0.0, 0.0)
        offsets.append(float(base[0]))
        rows.append(row[first:last] - base[0])
        responses.append(other[first:last] - base[1])
        labels.append(f"tap {number + 1}")
    if not rows:
        raise ValueError(f"no tap in {name} has a complete record; give a shorter length or before, or check rate")
    largest = max(offsets, key=abs)
    if largest:
        notes.append(f"offsets before the taps were removed, of the force up to {abs(largest):.2g} N")
    if lead < FEWEST:
        notes.append(f"only {lead} samples before the taps: offsets are not removed")
    return np.array(rows), np.array(responses), labels, notes
