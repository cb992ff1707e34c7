"""Taps joined to one table, cut to the samples that a fit compares, and scaled."""

from typing import Any

import numpy as np
import xarray as xr

from .._base import check
from . import readers, triggers
from .records import Taps
from .solver import Data

BEFORE = 12  # [samples] before the tap that are compared: the filter rings there


def join_tables(taps: Any, name: str = "taps") -> Taps:
    """One table of taps from one or several."""
    if isinstance(taps, Taps):
        return taps
    several = check.tuple_of(name, taps, Taps)
    several = tuple(_in_order(each, several[0].table["channel"].values.tolist()) for each in several)
    n_times = min(len(each.time) for each in several)
    for each in several:
        same_rate(each, several[0])
        if each.units != several[0].units:
            raise ValueError(f"taps must have the same responses, got units {each.units} and {several[0].units}")
    labels = [label for each in several for label in each.labels]
    joined = Taps.from_arrays(
        np.concatenate([each.force[:, :n_times] for each in several]),
        np.concatenate([each.response[:, :n_times] for each in several]),
        rate=several[0].rate,
        names=several[0].table["channel"].values.tolist(),
        units=several[0].units,
        overload=np.concatenate([each.table["overload"].values for each in several]),
        labels=labels if len(set(labels)) == len(labels) else None,
        notes=[note for each in several for note in each.notes],
    )
    pulse = np.concatenate([each.table["pulse"].values for each in several])
    return Taps(joined.table.assign(pulse=("tap", pulse)), joined.notes)


def _in_order(taps: Taps, names: list[str]) -> Taps:
    """The taps with their responses in the order of some names; ValueError if they have others."""
    own = taps.table["channel"].values.tolist()
    if own == names:
        return taps
    if sorted(own) != sorted(names) or len(set(names)) < len(names):
        raise ValueError(f"taps must have the same responses, got {', '.join(own)} and {', '.join(names)}")
    order = [own.index(name) for name in names]
    return Taps(taps.table.isel(channel=order, sensor=[0, *(k + 1 for k in order)]), taps.notes)


def level_offsets(taps: Taps) -> Taps:
    """The taps without offsets of their force that are more than noise, each with a note of what was done."""
    rates, moved = taps.rate, np.zeros(taps.n_taps)
    for i, (row, onset) in enumerate(zip(taps.force, taps.onset)):
        rest = row[: max(0, round(onset * rates) - triggers.GUARD)]
        rest = rest if len(rest) >= triggers.FEWEST else row[-(len(row) // 3) :]
        middle, sure = float(np.median(rest)), triggers.CLEAR * triggers.noise(row) / np.sqrt(len(rest))
        # an offset of less than 0.002 of the largest force hardly moves a fit
        if abs(middle) > max(sure, 0.002 * float(np.ptp(row))):
            moved[i] = middle
    if not moved.any():
        return taps
    force = taps.force - moved[:, None]
    table = taps.table.assign(
        force=(("tap", "time"), force, {"units": "N"}),
        onset=("tap", np.array([triggers.onset(row) for row in force]) / rates, {"units": "s"}),
    )
    named = ", ".join(taps.labels[i] for i in np.flatnonzero(moved))
    note = f"offsets of the force were removed, up to {moved[np.abs(moved).argmax()]:.2g} N: {named}"
    return Taps(table, (*taps.notes, note))


def same_rate(tap: Taps, taps: Taps) -> None:
    """ValueError unless both are sampled alike."""
    if abs(tap.rate / taps.rate - 1.0) > 1e-6:
        raise ValueError(f"tap must be sampled at {taps.rate:g} Hz as the taps fitted, got {tap.rate:g} Hz")


def cut_to_window(taps: Taps, window: Any) -> Taps:
    """The taps cut to the samples compared, all with the same place of the onset."""
    if window is not None:
        before, after = (check.non_negative("window", end, "s") for end in check.array("window", window, (2,), "s"))
        first, last = before, after
    else:
        first = BEFORE / taps.rate
        ends = []
        for row, onset, noise in zip(taps.force, taps.onset, taps.noise):
            begin = int(onset * taps.rate)
            large = max(triggers.PULSE * float(row.max()), triggers.CLEAR * noise)  # a small one is no reason to wait
            later = triggers.pulses(row[begin:], noise, large)
            ends.append(later[-1][1] if later else 1)
        # 1.5 times the length of the pulses after them, where the body's answer still shows
        last = 2.5 * max(max(ends), BEFORE) / taps.rate
        if max(ends) > 10_000:  # a second hit comes within 50 ms; searches would take minutes
            raise ValueError(
                f"window must be given: the force is above a tenth of its peak again {max(ends) / taps.rate:.2g} s "
                "after its onset, by hum or noise; check the channel and the rate, or give window=(before, after)"
            )
    starts = np.round(taps.onset * taps.rate).astype(int)
    before, after = round(float(first) * taps.rate), round(float(last) * taps.rate)
    before, after = min(before, int(starts.min())), min(after, int(len(taps.time) - starts.max()))
    if before < 0 or after < 4 or before + after < readers.LEAST:
        raise ValueError(f"window must leave samples after the onset, got {after}; give longer records")
    samples = xr.DataArray(starts[:, None] + np.arange(-before, after), dims=("tap", "time"))
    table = taps.table.drop_vars("time").isel(tap=xr.DataArray(np.arange(taps.n_taps), dims="tap"), time=samples)
    table["time"] = ("time", np.arange(before + after) / taps.rate, {"units": "s"})
    table["onset"] = ("tap", np.full(len(starts), before / taps.rate), {"units": "s"})
    return Taps(table, taps.notes)


def data(taps: Taps, n_points: int, weights: np.ndarray) -> Data:
    """The force and ``n_points`` responses of taps, scaled to their peaks over the weights (1 + n_points,)."""
    records = np.concatenate([taps.force[:, None], np.moveaxis(taps.response, 2, 1)[:, :n_points]], axis=1)
    scale = np.maximum(np.abs(records).max(axis=2), np.finfo(float).tiny) / weights
    lead = max(0, round(float(np.median(taps.onset)) * taps.rate) - 1)
    return Data(records / scale[:, :, None], scale, np.maximum(taps.impulse, 1e-300), lead)
