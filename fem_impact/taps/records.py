"""The table of measured taps, and how files become one."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from .._base import check, markup
from .._base.explained import lines_of_notes
from ..fe import plausible
from . import channels, readers, triggers

RATES = (1.0, 1e9)  # [Hz] sampling rates allowed: beyond, the unit is a mistake


@dataclass(frozen=True, eq=False)
class Taps(check.Brief):
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
        pulse: float | None = None,
    ) -> "Taps":
        """Taps from arrays in SI units, as other programs hold them.

        Parameters
        ----------
        force : array_like, (n_taps, n_times) or (n_times,) [N]
            What its rest drifts from that at the onset, by more than noise, is taken off.
        response : array_like, (n_taps, n_times) or (n_taps, n_times, n_channels), optional
        rate : float [Hz]
        names, units : sequence of str, optional
            Of the responses; by default accelerations in m/s^2.
        overload : array_like of bool, (n_taps, 1 + n_channels), optional
            Of the force and the responses; by default, a channel with three equal largest samples in a row is cut off,
            and one whose top is flat within its noise.
        labels : sequence of str, optional
            Of the taps; by default "tap 1" and so on.
        pulse : float [N], optional
            A rise of the force above this counts as a pulse; by default one above its noise and ringing.

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
        if n_taps < 1 or n_times < readers.LEAST:
            raise ValueError(f"force must hold at least one tap of {readers.LEAST} samples, got shape {rows.shape}")
        if response is None:
            others = np.zeros((n_taps, n_times, 0))
        else:
            raw = check.numbers("response", response)
            raw = raw[None, :, None] if raw.ndim == 1 else raw[..., None] if raw.ndim == 2 else raw
            others = check.array("response", raw, (n_taps, n_times, None))
        n_channels = others.shape[2]
        names = [f"response {i + 1}" for i in range(n_channels)] if names is None else names
        names = check.texts("names", names, n_channels, "response")
        unit = check.texts("units", ["m/s^2"] * n_channels if units is None else units, n_channels, "response")
        for text in unit:
            check.one_of("units", text, [si for si in channels.units.KINDS if si != "N"])
        tags = [f"tap {i + 1}" for i in range(n_taps)] if labels is None else labels
        tags = check.texts("labels", tags, n_taps, "tap of force")
        cut = _cut_off(rows, others, overload)
        moved = np.array([triggers.drift(row, rate) for row in rows])
        rows = rows - moved
        said = [f"drift of the force was removed, up to {np.ptp(moved, axis=1).max():.2g} N within a record"]
        table = xr.Dataset(
            {
                "force": (("tap", "time"), rows, {"units": "N"}),
                "response": (("tap", "time", "channel"), others),
                "onset": ("tap", np.array([triggers.onset(f) for f in rows]) / rate, {"units": "s"}),
                "overload": (("tap", "sensor"), cut),
                "pulse": ("tap", np.full(n_taps, np.nan if pulse is None else check.positive("pulse", pulse, "N"))),
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
        return cls(table, (*check.texts("notes", notes), *(said if moved.any() else ())))

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
        """Pulses of each tap, (n_taps,); more than one of a double hit, however small above noise and ringing."""
        return np.array([len(each) for each in self.pulses])

    @cached_property
    def pulses(self) -> list[list[tuple[int, int]]]:
        """First sample of every pulse of each tap, and the one after its last."""
        stated = self.table["pulse"].values
        return [
            triggers.pulses(row, noise, None if np.isnan(least) else least)
            for row, noise, least in zip(self.force, self.noise, stated)
        ]

    @property
    def peak(self) -> np.ndarray:
        """Largest force of each tap, (n_taps,) [N]."""
        return self.force.max(axis=1)

    @property
    def impulse(self) -> np.ndarray:
        """Impulse of each tap from the begin of its first to the end of its last pulse, (n_taps,) [N s]."""
        found = np.zeros(self.n_taps)
        for i, (row, each) in enumerate(zip(self.force, self.pulses)):
            found[i] = row[max(0, each[0][0] - 1) : each[-1][1] + 1].sum() / self.rate if each else 0.0
        return found

    @property
    def cut_short(self) -> np.ndarray:
        """Whether the record of each tap begins or ends within a pulse, (n_taps,) bool."""
        return triggers.cut_short(self.force)

    @property
    def noise(self) -> np.ndarray:
        """Standard deviation of each force before its tap or, if that is short, of its differences, (n_taps,) [N]."""
        begins = np.maximum(0, (self.onset * self.rate).astype(int) - triggers.GUARD)
        return np.array([
            np.std(row[:n]) if n >= triggers.FEWEST else triggers.noise(row) for row, n in zip(self.force, begins)
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
        if cut.sizes["time"] < readers.LEAST:
            raise ValueError(
                f"start and end must leave at least {readers.LEAST} samples of {len(self.time)}, got {start:g} and "
                f"{end:g} s"
            )
        cut = cut.assign_coords(time=("time", np.arange(cut.sizes["time"]) / self.rate, {"units": "s"}))
        cut["onset"] = cut["onset"] - first / self.rate
        return Taps(cut, self.notes)

    def summary(self) -> str:
        """The taps in a few readable lines."""
        lines = [f"{self.n_taps} taps of {len(self.time)} samples at {self.rate:g} Hz"]
        rows = [
            (name, f"{peak:.4g} N", f"{impulse:.4g} N s", str(pulses), ", ".join(self.cut_off(i)))
            for i, (name, peak, impulse, pulses) in enumerate(zip(self.labels, self.peak, self.impulse, self.n_pulses))
        ]
        lines += markup.columns(rows, ("", "peak", "impulse", "pulses", "cut off"))
        return "\n".join(lines + lines_of_notes(self.notes))

    def cut_off(self, tap: int) -> list[str]:
        """Names of the sensors that are cut off in a tap."""
        row = self.table["overload"].values[check.count("tap", tap, 0, self.n_taps - 1)]
        return [str(name) for name, cut in zip(self.table["sensor"].values, row) if cut]

    def __repr__(self) -> str:
        return f"Taps({self.n_taps} taps, {len(self.time)} samples at {self.rate:g} Hz)"

    def save(self, path: str | Path) -> None:
        """Write the samples to an .npz file that `read_taps` reads again; it judges anew which are cut off."""
        arrays = {"force [N]": self.force, "rate": np.array(self.rate), "time": self.time}
        names = [str(name) for name in self.table["channel"].values]
        for i, (name, unit) in enumerate(zip(names, self.units)):
            arrays[f"{name} {i + 1} [{unit}]" if names.count(name) > 1 else f"{name} [{unit}]"] = self.response[:, :, i]
        with check.path("path", path).open("wb") as file:
            np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def _cut_off(force: np.ndarray, response: np.ndarray, stated: Any) -> np.ndarray:
    """Whether the channels (n_taps, n_times[, n_channels]) are, as ``stated`` or as they look, (n_taps, n_sensors)."""
    if stated is None:
        records = np.concatenate([force[:, :, None], response], axis=2)
        found = np.array([[triggers.is_clipped(channel) for channel in record.T] for record in records])
        found[:, 0] |= [triggers.is_saturated(row) for row in force]
        for one, row, other in zip(found, force, response):
            for k, channel in enumerate(other.T, 1):
                one[k] |= triggers.is_flat(channel, triggers.onset(row) - triggers.GUARD)
        return found
    shape, flags = (len(force), 1 + response.shape[2]), np.asarray(None)
    with suppress(ValueError):  # rows of several lengths
        flags = np.asarray(stated)
    if flags.dtype != bool or flags.shape not in ((), shape):
        raise ValueError(f"overload must be bools of shape {shape}, got {check.shown(stated)}")
    return np.broadcast_to(flags, shape).copy()


def _rate_of(found: readers.Recording, name: str) -> float:
    """Sampling rate [Hz] that a recording states."""
    if found.rate is None:
        raise ValueError(f"rate must be given: {name} does not state the sampling rate")
    if not RATES[0] <= found.rate <= RATES[1]:
        raise ValueError(f"{name} states a rate of {found.rate:g} Hz; check the unit of its times, or give rate=")
    return found.rate


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
    together: float = 0.05,
    full_scale: float | None = None,
    pulse: float | None = None,
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
        Pulses closer than this are one tap, as those of a double hit; nobody taps twice within a twentieth of a second.
    full_scale : float [N], optional
        A force that reaches this is cut off.
    pulse : float [N], optional
        A rise of the force above this counts as a pulse; by default one above 6 standard deviations of the noise and
        twice the largest pull: contacts never pull, so that a negative force shows how far sensor and filter ring. What
        is left of a drift is added to it.

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
    stated = _rate_of(found, name) if rate is None else check.between("rate", rate, *RATES, "Hz")
    notes = list(found.notes)
    if found.rate is not None and abs(found.rate / stated - 1.0) > 1e-3:
        notes.append(f"the file states {found.rate:g} Hz; rate={stated:g} Hz was used")
    if full_scale is not None:
        full_scale = check.positive("full_scale", full_scale, "N")
    segments, names, kinds, more = channels.in_si(found, name, force, response, scale, units)
    options = {"trigger": trigger, "before": before, "length": length, "together": together}
    rows, responses, full, labels, said = triggers.cut_taps(segments, stated, name, **options)
    if rows.shape[1] < readers.LEAST:
        raise ValueError(
            f"a tap in {name} has {rows.shape[1]} samples at a rate of {stated:g} Hz, {readers.LEAST} at least are "
            "needed; check the unit of its times, rate, before and length"
        )
    cut = _cut_off(rows, responses, None)
    cut[:, 0] |= [top or triggers.is_clipped(row, full_scale) for row, top in zip(rows, full.tolist())]
    taps = Taps.from_arrays(
        rows, responses, rate=stated, names=names, units=kinds, overload=cut, labels=labels, pulse=pulse
    )  # fmt: skip
    widths = [triggers.width(row) for row in taps.force]
    flat = [f"{label} ({', '.join(taps.cut_off(i))})" for i, label in enumerate(taps.labels) if any(cut[i])]
    dead = [text for text, still in zip(names, triggers.is_still(taps.response).T) if still.any()]
    gaps = triggers.filled(taps.force, taps.response)
    for which, what in (
        ([label for label, n in zip(taps.labels, taps.n_pulses) if n > 1], "{}: more than one pulse, kept as one tap"),
        ([label for label, late in zip(taps.labels, taps.cut_short) if late],
         "{}: the record begins or ends within a pulse"),
        (flat, "cut off by the range of the channel: {}"),
        ([label for label, gap in zip(taps.labels, gaps) if gap[1:].any()],
         "{}: a response stands still amid its motion, as where lost samples were filled"),
        ([label for label, gap in zip(taps.labels, gaps) if gap[0]],
         "{}: the force stands still amid a pulse, as where lost samples were filled"),
        (dead, "{}: does not change during a tap, as a dead channel; leave it out, response="),
        ([label for label, back in zip(taps.labels, triggers.pulls(taps.force)) if back],
         "{}: the force pulls as it pushes, which no contact does; name its channel, force="),
        ([label for label, n in zip(taps.labels, widths) if n < 2],
         "{}: a pulse of a single sample, which is a spike, or the rate is too low for it"),
    ):  # fmt: skip
        said += [what.format(", ".join(which))] if which else []
    said += plausible.note_number("pulse", float(np.median(widths)) / stated)
    return Taps(taps.table, (*notes, *more, *said))
