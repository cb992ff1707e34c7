"""Find taps in a record of the force: where they begin, how many pulses they have, what is wrong; and cut them out."""

import numpy as np

from .._base import check

LEVEL = 0.05  # [-] of the largest force: a tap begins where the force rises above this
NOISE = 8.0  # [-] standard deviations of the noise that the trigger stays above at least
GAUSS = 1.4826  # [-] standard deviation over median absolute deviation of Gaussian noise
PULSE = 0.1, 0.05  # [-] of a tap's largest force: a pulse rises above the first and ends below the second
CLIPPED = 3  # [-] equal largest samples in a row that count as clipped
SAME = 1e-9  # [-] relative difference of samples that count as equal
BEFORE = 0.02  # [s] longest record before a tap
LONGEST = 10.0  # [s] longest record of one tap
FEWEST = 8  # [-] samples before a tap from which an offset is estimated
MOST_TAPS = 10_000  # [-] of one file: more are noise
ENDS = 0.5  # [-] of a pulse's peak: a record that begins or ends above this cuts the pulse


def noise(force: np.ndarray) -> float:
    """Standard deviation [N] of the noise, from the differences of neighbours, of which most are no tap."""
    step = np.diff(force)
    return float(GAUSS * np.median(np.abs(step - np.median(step))) / np.sqrt(2.0))


def level(force: np.ndarray) -> float:
    """The trigger [N] for a record (n_samples,)."""
    return max(LEVEL * float(force.max(initial=0.0)), NOISE * noise(force))


def starts(force: np.ndarray, trigger: float, together: int) -> np.ndarray:
    """First samples above the trigger; those within ``together`` samples of the last one above belong to one tap."""
    above = np.flatnonzero(force > trigger)
    if not above.size:
        return above
    return above[np.concatenate([[True], np.diff(above) > together])]


def n_pulses(force: np.ndarray) -> int:
    """Number of pulses of one tap (n_times,): two of a double hit."""
    peak = float(force.max(initial=0.0))
    if peak <= 0.0:
        return 0
    count, up = 0, False
    for value in force / peak:
        if not up and value > PULSE[0]:
            count, up = count + 1, True
        elif up and value < PULSE[1]:
            up = False
    return count


def clipped(values: np.ndarray, full_scale: float | None = None) -> bool:
    """Whether a channel (n_times,) is cut off at its largest magnitude."""
    top = float(np.abs(values).max(initial=0.0))
    if top == 0.0:
        return False
    if full_scale is not None and top >= full_scale * (1.0 - SAME):
        return True
    at_top = (np.abs(values) >= top * (1.0 - SAME)).astype(int)
    runs = np.convolve(at_top, np.ones(CLIPPED, int), mode="valid")
    return bool(runs.max(initial=0) >= CLIPPED)


def cut(segments, rate, name, *, trigger, before, length, together):
    """Records of equal length around every tap: force, responses, labels and notes."""
    pause = max(1, round(check.positive("together", together, "s") * rate))
    whole = np.concatenate([row - np.median(row) for row, _ in segments])
    limit = level(whole) if trigger is None else check.positive("trigger", trigger, "N")
    places = []  # segment, first sample above the trigger, samples free before and after
    for k, (row, _) in enumerate(segments):
        begun = starts(row - np.median(row), limit, pause)
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
