"""How far apart rounding moves numbers: the few limits that all packages share."""

import numpy as np

EPSILON = float(np.finfo(float).eps)  # [-] fact: rounding of one number with 16 digits
ROUNDING = 1e-12  # [-] of its largest terms, what may be left of a sum that is zero; sums of a few thousand leave 1e-13
# [-] of its size: numbers found in two ways that differ by less are the same, a part of one below it counts as none;
# solving equations loses three digits more than a sum, and nothing that is distinguished here is so near
SAME = 1e-9
HALVINGS = 64  # [-] bisections after which an interval is below rounding: 53 for the digits, some for its length
