"""How far apart rounding moves numbers: the few limits that all packages share."""

import numpy as np

EPSILON = float(np.finfo(float).eps)  # [-] fact: rounding of one number with 16 digits
ROUNDING = 1e-12  # [-] of its largest terms, what may be left of a sum that is zero; sums of a few thousand leave 1e-13
# [-] of its size: numbers found in two ways that differ by less are the same, a part of one below it counts as none;
# solving equations loses three digits more than a sum, and nothing that is distinguished here is so near
SAME = 1e-9
HALVINGS = 64  # [-] bisections after which an interval is below rounding: 53 for the digits, some for its length


def rounded_by(values: np.ndarray) -> float:
    """How far values are off by being written with five to ten digits, or in single precision; 0 otherwise."""
    size = np.abs(values[values != 0.0])
    if not size.size:
        return 0.0
    single = 0.5 * float(np.finfo(np.float32).eps) if (size.astype(np.float32) == size).all() else 0.0
    for digits in range(5, 11):
        unit = 10.0 ** (np.floor(np.log10(size)) + 1 - digits)  # of the last digit
        if (np.abs(np.round(size / unit) * unit - size) <= max(single, ROUNDING) * size).all():
            return max(0.5 * float(unit.max()), single * float(size.max()))
    return single * float(size.max())
