"""Types of what libraries without types return, as far as it is used here, so that type checkers know public names."""

from typing import Protocol, TypeAlias, runtime_checkable

import numpy as np
from scipy import sparse

Sparse: TypeAlias = sparse.csc_matrix | sparse.csr_matrix  # of SciPy


@runtime_checkable
class Cells(Protocol):
    """A mesh of scikit-fem."""

    p: np.ndarray  # (dimension, n_points)
    t: np.ndarray  # (dimension + 1, n_cells) point numbers
