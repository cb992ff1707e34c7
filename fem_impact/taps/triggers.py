"""Find taps in a record of the force: where they begin, how many pulses they have, and what is wrong with them."""

import numpy as np

LEVEL = 0.05  # [-] of the largest force: a tap begins where the force rises above this
NOISE = 8.0  # [-] standard deviations of the noise that the trigger stays above at least
GAUSS = 1.4826  # [-] standard deviation over median absolute deviation of Gaussian noise
PULSE = 0.1, 0.05  # [-] of a tap's largest force: a pulse rises above the first and ends below the second
CLIPPED = 3  # [-] equal largest samples in a row that count as clipped
SAME = 1e-9  # [-] relative difference of samples that count as equal
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
