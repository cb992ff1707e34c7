"""Find taps in a record of the force: where they begin, how many pulses they have, what is wrong; and cut them out."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.interpolate import interp1d

from .._base import check
from .._base.rounding import SAME

# [-] of a tap's largest force: pulses above this are apart where the force falls below half of it, smaller ones below
# half of their own
PULSE = 0.1
# [-] standard deviations of the noise: the same, if they are larger, and those of its mean that an offset exceeds; two
# fewer, as a pulse or a tap is already sure
CLEAR = 6.0
SLOW = 20  # [-] widths of a tap's largest pulse over which a force that stays up is drift; test_other_records.py
CLIPPED = 3  # [-] equal largest samples in a row that count as clipped: two may be equal by chance
LONGEST = 10.0  # [s] longest record of one tap: lines 0.1 Hz apart
EDGE = 0.3  # [-] of a tap's largest force, at the ends of its record: filters leave less
FEWEST = 8  # [-] samples before a tap from which an offset is estimated: to a third of the noise, fewer make it worse
# [samples] before the onset that do not count as rest, as pulses start flat
GUARD = 3


def noise(force: np.ndarray) -> float:
    """Standard deviation [N] of the noise, from the differences of neighbours, of which most are no tap."""
    step = np.diff(force)
    # 1.4826: standard deviation over median absolute deviation of Gaussian noise
    return float(1.4826 * np.median(np.abs(step - np.median(step))) / np.sqrt(2.0))


def level(force: np.ndarray) -> float:
    """The trigger [N] for a record (n_samples,).

    A twentieth of the largest force: lower would meet ringing, higher lose taps. Eight standard deviations of noise are
    never reached by chance, in any record.
    """
    return max(0.05 * float(force.max(initial=0.0)), 8.0 * noise(force))


def onset(force: np.ndarray) -> int:
    """First sample of a tap (n_times,) above the trigger, whatever offset the record has; 0 if there is none."""
    rest = float(np.quantile(force, 0.25))  # no pulse fills three quarters of a record
    moved = force - (rest if abs(rest) > 2.0 * noise(force) else 0.0)
    above = moved > level(moved)
    return int(above.argmax())


def find_rooms(force: np.ndarray, trigger: float, together: int) -> list[tuple[int, int, int]]:
    """Of every tap its first sample above the trigger, and the samples before and after it that are its own.

    Samples above the trigger within ``together`` samples of the last one above belong to one tap.
    """
    above = np.flatnonzero(force > trigger)
    begun = above[np.diff(above, prepend=-1 - together) > together]
    halves = (0.5 * np.diff(begun)).astype(int)
    before, after = np.append(begun[:1], halves), np.append(halves, len(force) - begun[-1:])
    return list(zip(begun.tolist(), before.tolist(), after.tolist()))


def cut_short(force: np.ndarray) -> np.ndarray:
    """Whether records (..., n_times) begin or end within a pulse."""
    return np.maximum(force[..., 0], force[..., -1]) > EDGE * force.max(axis=-1)


def width(force: np.ndarray) -> int:
    """Samples of the largest pulse of a tap (n_times,) above half of its peak."""
    low = np.flatnonzero(np.append(force, -np.inf) <= 0.5 * force.max())
    after = int(np.searchsorted(low, force.argmax()))
    return int(low[after] - (low[after - 1] if after else -1)) - 1


def pulls(force: np.ndarray) -> np.ndarray:
    """Whether records (..., n_times) pull more than half as hard as they push: no contact does, a filter rings less."""
    return -force.min(axis=-1) > 0.5 * force.max(axis=-1)


def pulse_reach(force: np.ndarray, start: int, before: int, after: int) -> tuple[int, int]:
    """Samples before and after the first one of a tap with which its record is not `cut_short`."""
    room = force[start - before : start + after]
    high = np.flatnonzero(room > EDGE * room.max())
    return before - int(high[0]) + 1, int(high[-1]) - before + 2


def most_whole(rooms: np.ndarray, needs: np.ndarray) -> tuple[int, int]:
    """How many samples of each leave most taps whole, which have ``rooms`` and need others; and how many taps."""
    possible = needs <= rooms
    lengths = np.unique(rooms)
    enough = np.searchsorted(np.sort(needs[possible]), lengths, side="right")
    whole = enough - np.searchsorted(np.sort(rooms[possible]), lengths)
    best = np.flatnonzero(whole == whole.max())[-1 if whole.any() else 0]  # of as many, rather the longer records
    return int(lengths[best]), int(whole[best])


def pulses(force: np.ndarray, noise: float = 0.0, least: float | None = None) -> list[tuple[int, int]]:
    """First sample of every pulse of a tap (n_times,), and the one after its last; two of a double hit.

    A pulse rises above ``least`` [N]; by default above the noise, of standard deviation ``noise`` [N], above what
    sensor and filter ring: contacts never pull, so that a negative force measures it, and above the largest drift.
    """
    peak = float(force.max(initial=0.0))
    if peak <= 0.0:
        return []
    if least is None:
        ringing, bit = -float(force.min()), float(np.diff(np.unique(force)).min(initial=peak))
        # noise alone pulls 4.5 deviations in a hundred thousand samples; ringing that decays pushes less than twice
        # what it pulled before
        least = max(CLEAR * max(noise, bit), 2.0 * ringing if ringing > 4.5 * noise else 0.0, SAME * peak)
        block = SLOW * int(np.count_nonzero(force > 0.5 * peak))
        parts = force[: len(force) // block * block].reshape(-1, block)
        least += float(np.quantile(parts, 0.25, axis=1).max(initial=0.0))  # no pulses fill three quarters of a part
    up = min(least, 0.5 * peak)  # a tap in strong noise has a pulse, too
    edges = np.flatnonzero(np.diff(np.concatenate([[0], force > 0.5 * up, [0]]).astype(int)))
    tops = np.maximum.reduceat(np.append(force, 0.0), edges)[::2]
    found = []
    for first, end in edges.reshape(-1, 2)[tops > up].tolist():
        top, low = 0.0, first
        for k, value in enumerate(force[first:end].tolist(), first):
            if value < force[low]:
                low = k
            fell = force[low] < 0.5 * min(PULSE * peak, top)
            if fell and value > max(up, 2.0 * force[low]) and top > up:
                found.append((first, low))
                first, top = low, value
            if value >= top:
                top, low = value, k
        found.append((first, end))
    return found


def level_of_rest(force: np.ndarray, block: int) -> np.ndarray:
    """What a record (n_samples,) would be without taps: medians of blocks of samples, joined by straight lines."""
    parts = np.array_split(force, max(1, len(force) // block))
    middle = np.cumsum([0, *(len(part) for part in parts[:-1])]) + [0.5 * (len(part) - 1) for part in parts]
    values = np.array([np.median(part) for part in parts])
    if len(parts) == 1:
        return np.full(len(force), values[0])
    ends = interp1d(middle, values, fill_value="extrapolate")([0, len(force) - 1])
    return np.interp(np.arange(len(force)), [0, *middle, len(force) - 1], [ends[0], *values, ends[1]])


def drift(force: np.ndarray, rate: float) -> np.ndarray:
    """How far the rest of a tap's record (n_samples,) moves from where it is at the onset; zero if that is noise."""
    block = max(0.2 * rate, 4.0 * width(force - np.median(force)))
    rest = level_of_rest(force, round(block))
    sure = max(CLEAR * noise(force) * np.sqrt(2.0 * np.pi / block), 1e-4 * float(np.ptp(force)))
    return rest - rest[onset(force)] if np.ptp(rest) > sure else np.zeros(len(force))


def is_clipped(values: np.ndarray, full_scale: float | None = None) -> bool:
    """Whether a channel (n_times,) is cut off at its largest magnitude."""
    top = float(np.abs(values).max(initial=0.0))
    if top == 0.0:
        return False
    if full_scale is not None and top >= full_scale * (1.0 - SAME):
        return True
    at_top = np.abs(values) >= top * (1.0 - SAME)
    runs = np.convolve(at_top.astype(int), np.ones(CLIPPED, int), mode="valid")
    return bool(runs.max(initial=0) >= CLIPPED) and has_edges(values, at_top)


def is_saturated(force: np.ndarray) -> bool:
    """Whether the top of a tap (n_times,) is flat within its noise, as where an amplifier before the converter ends.

    Of 400 random blows on plates with noise of 1e-4 to 1e-2 none is, of half sines cut to less than 0.9 five in six.
    """
    before, peak = onset(force) - GUARD, float(force.max(initial=0.0))
    if before < FEWEST or peak <= 0.0:
        return False
    spread = 8.0 * max(float(force[:before].std()), float(np.diff(np.unique(force)).min(initial=peak)))
    low = np.flatnonzero(np.append(force, -np.inf) < peak - spread)
    after, half = int(np.searchsorted(low, force.argmax())), width(force)
    run = int(low[after] - (low[after - 1] if after else -1)) - 1
    # a parabola falls by the spread within 0.7 of this, half of it on either side
    return run >= max(CLIPPED, 0.2 * half) and run > 1.0 + 1.5 * half * np.sqrt(2.0 * spread / peak)


def converter_step(values: np.ndarray) -> float:
    """Smallest step between any two values of a channel (n_times,), infinite if there is none."""
    steps = np.diff(np.unique(values))
    return float(steps[steps > SAME * np.ptp(values)].min(initial=np.inf))


def is_flat(values: np.ndarray, before: int) -> bool:
    """Whether a response (n_times,) ends at one level within its noise, by its first ``before`` samples.

    Samples thin out towards the top of a smooth peak as a root, so that the next band below holds 0.4 of those within
    the noise of it; where an amplifier ends hardly any. Of 1200 random responses none is, of as many cut off every
    second.
    """
    if before < FEWEST:
        return False
    band = 8.0 * max(float(values[:before].std()), converter_step(values))
    for turned in (values, -values):
        top = float(turned.max())
        count, beside = ((turned > top - k * band).sum() for k in (1.0, 2.0))
        if top > 5.0 * band and count >= 10 and beside - count < 0.15 * count:
            return True
    return False


def is_filled(values: np.ndarray, least: int = 5, jump: float = 0.0) -> bool:
    """Whether a response (n_times,) stands still for ``least`` samples amid its motion, as where lost ones were filled.

    It jumps by more than steps of its converter on both sides and, with its level, by ``jump`` of the largest on one.
    """
    moved, step, top = np.abs(np.diff(values)), converter_step(values), np.abs(values).max(initial=0.0)
    runs = np.flatnonzero(np.diff(np.concatenate([[0], moved == 0.0, [0]]).astype(int))).reshape(-1, 2)
    runs = runs[(np.diff(runs)[:, 0] >= least - 1) & (runs[:, 0] > 0) & (runs[:, 1] < len(moved))]
    stands = np.abs(values[runs[:, 0]])
    beside = moved[runs[:, 0] - 1], moved[np.minimum(runs[:, 1], len(moved) - 1)]
    sure = (np.minimum(*beside) > 8.0 * step) & (np.maximum(*beside) + stands >= jump * top)
    return bool((sure & (stands < 0.999 * top)).any())  # others are cut off


def filled(force: np.ndarray, response: np.ndarray) -> np.ndarray:
    """Whether forces (n_taps, n_times) and responses (n_taps, n_times, n_channels) stand so, (n_taps, n_sensors).

    Of a force three samples count, beside a third of its peak: it rests between pulses, and they are short. Of 800
    random ones none does by mistake, of as many with a gap three in four.
    """
    return np.array([
        [is_filled(row, 3, 1.0 / 3.0), *map(is_filled, other.T)] for row, other in zip(force, response)
    ])  # fmt: skip


def is_still(records: np.ndarray) -> np.ndarray:
    """Whether channels (n_taps, n_times, n_channels) do not change during a tap, as dead ones, (n_taps, n_channels)."""
    return np.ptp(records, axis=1) == 0.0


def has_edges(values: np.ndarray, at_top: np.ndarray) -> bool:
    """Whether the samples at the top of a channel (n_times,) are cut off rather than round in steps of the converter.

    A parabola in steps whose top step holds n samples has fallen by nine steps n samples later.
    """
    ends = np.flatnonzero(np.diff(at_top.astype(int), prepend=0, append=0)).reshape(-1, 2)
    first, end = ends[np.diff(ends)[:, 0].argmax()]
    beside = [max(0, 2 * first - end), min(len(values), 2 * end - first) - 1]
    counts = (values[first] - values) / converter_step(values)
    if np.median(np.abs(counts - np.round(counts))) > 0.1:  # they have no common step
        return True
    return float(np.abs(counts[beside]).max()) > 16.0  # a pulse is no parabola all the way down


def ceiling(rows: list[np.ndarray]) -> float:
    """Largest value that a channel can show, if its segments (n_samples,) reach it; else infinity.

    That is a largest value which `CLIPPED` samples share, two of them neighbours, beside which the channel falls.
    """
    top = max(float(row.max()) for row in rows)
    reached = [(row, row >= top * (1.0 - SAME)) for row in rows]
    count = sum(int(each.sum()) for _, each in reached)
    sure = any((each[1:] & each[:-1]).any() and has_edges(row, each) for row, each in reached)
    return top if count >= CLIPPED and sure else np.inf


def cut_taps(
    segments: Sequence[tuple[np.ndarray, Any]], rate: float, name: str, *, trigger: float | None,
    before: float | None, length: float | None, together: float | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str], list[str]]:  # fmt: skip
    """Records of equal length around every tap: force, responses, whether the force is cut off, labels and notes."""
    pause = max(1, round(check.positive("together", together, "s") * rate))
    # in 0.2 s the force is at rest for more than half the time: slower changes are drift, a tap lasts some ms
    rests = [level_of_rest(row, max(1, round(0.2 * rate))) for row, _ in segments]
    moved = [row - rest for (row, _), rest in zip(segments, rests)]
    whole = np.concatenate(moved)
    limit = level(whole) if trigger is None else check.positive("trigger", trigger, "N")
    places = [(k, *place) for k, row in enumerate(moved) for place in find_rooms(row, limit, pause)]
    if not whole.any():
        raise ValueError(f"no tap was found in {name}: its force does not change; name its channel, force=")
    if not places:
        reached = f"reaches {whole.max():.3g} N and the trigger is {limit:.3g} N"
        raise ValueError(f"no tap was found in {name}: its force {reached}; check scale and trigger")
    if len(places) > 10_000:  # they are noise
        raise ValueError(f"{name} has {len(places)} places above {limit:.3g} N; give trigger= and together=")
    # 20 ms determine the offset, more may reach back to the last tap's ringing
    longest = np.inf if length is None else check.positive("length", length, "s")
    wanted = min(0.02, 0.25 * longest) if before is None else check.positive("before", before, "s")
    if wanted >= longest:
        raise ValueError(f"length must be longer than before, {wanted:g} s, got {longest:g} s")
    rooms = np.array([place[2:] for place in places])
    needs = np.array([pulse_reach(moved[k], *place) for k, *place in places])
    least, n_whole = most_whole(rooms[:, 0], np.maximum(needs[:, 0], FEWEST + GUARD))
    least = least if 2 * n_whole > len(places) else most_whole(rooms[:, 0], needs[:, 0])[0]
    lead = min(round(wanted * rate), least if before is None else 10**9)
    tail = most_whole(rooms[:, 1], needs[:, 1])[0] if length is None else max(1, round(longest * rate) - lead)
    tail = min(tail, round(LONGEST * rate))
    quiet = lead - max(GUARD, lead // 4)  # samples of each record that determine its offset
    rows, responses, labels, notes, offsets, tops, drift = [], [], [], [], [], [], 0.0
    if without := [str(k + 1) for k in range(len(segments)) if k not in {place[0] for place in places}]:
        notes.append(f"no tap above {limit:.3g} N in record {', '.join(without[:20])}{', ...' * (len(without) > 20)}")
    for number, (k, start, _, _) in enumerate(places):
        row, other = segments[k]
        first, last = start - lead, start + tail
        if first < 0 or last > len(row):
            notes.append(f"tap {number + 1} is left out: its record is not complete")
            continue
        slope = rests[k][first:last] - rests[k][start]  # (n_times,) [N]
        force, response = row[first:last] - slope, other[first:last]
        base = (np.median(force[:quiet]), np.median(response[:quiet], axis=0)) if quiet >= FEWEST else (0.0, 0.0)
        offsets.append(float(base[0]))
        drift = max(drift, float(np.ptp(slope)))
        rows.append(force - base[0])
        responses.append(response - base[1])
        labels.append(f"tap {number + 1}")
        tops.append(float(row[first:last].max()))
    if not rows:
        raise ValueError(f"no tap in {name} has a complete record; give a shorter length or before, or check rate")
    largest = max(offsets, key=abs)
    if largest:
        notes.append(f"offsets before the taps were removed, of the force up to {abs(largest):.2g} N")
    if drift > 0.2 * limit:  # less moves no tap
        notes.append(f"drift of the force was removed, up to {drift:.2g} N within a record")
    if quiet < FEWEST:
        notes.append(f"only {lead} samples before the taps: offsets are not removed")
    top = ceiling([row for row, _ in segments])
    return np.array(rows), np.array(responses), np.array(tops) >= top * (1.0 - SAME), labels, notes
