"""Types of what libraries without types return, as far as it is used here, so that type checkers know public names."""

from typing import Any, Protocol, runtime_checkable

import numpy as np


@runtime_checkable
class Sparse(Protocol):
    """A sparse matrix of SciPy."""

    data: np.ndarray

    @property
    def shape(self) -> tuple[int, int]: ...

    @property
    def T(self) -> "Sparse": ...

    def __matmul__(self, other: np.ndarray, /) -> np.ndarray: ...

    def __add__(self, other: "Sparse", /) -> "Sparse": ...

    def __sub__(self, other: "Sparse", /) -> "Sparse": ...

    def __mul__(self, factor: float, /) -> "Sparse": ...

    def __rmul__(self, factor: float, /) -> "Sparse": ...

    def __getitem__(self, rows: Any, /) -> "Sparse": ...

    def multiply(self, other: "Sparse", /) -> "Sparse": ...

    def sum(self, axis: int) -> np.ndarray: ...

    def diagonal(self) -> np.ndarray: ...

    def toarray(self) -> np.ndarray: ...

    def todense(self) -> np.ndarray: ...

    def tocsc(self) -> "Sparse": ...

    def tocsr(self) -> "Sparse": ...


@runtime_checkable
class Cells(Protocol):
    """A mesh of scikit-fem."""

    p: np.ndarray  # (dimension, n_points)
    t: np.ndarray  # (dimension + 1, n_cells) point numbers
