"""Results that are needed again: Gauss rules, and a bounded store for threads, emptied when its owner is pickled."""

from collections.abc import Callable, Hashable
from functools import cache
from threading import Lock
from typing import Any

import numpy as np


@cache
def gauss_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points between 0 and 1, and their weights, (n,) each; read-only."""
    node, weight = np.polynomial.legendre.leggauss(n)
    rule = 0.5 * (node + 1.0), 0.5 * weight
    for part in rule:
        part.setflags(write=False)
    return rule


class Remembered:
    """The last ``most`` results of a function, by what it was asked for."""

    def __init__(self, most: int) -> None:
        self.most, self.lock = most, Lock()
        self.results: dict[Hashable, Any] = {}

    def __reduce__(self):
        return Remembered, (self.most,)

    def recall(self, key: Hashable, find: Callable[[], Any]) -> Any:
        """The result for a key: a known one, or that of ``find()``, which then displaces the oldest."""
        with self.lock:
            if key in self.results:
                return self.results[key]
        result = find()  # without the lock: other threads need not wait
        with self.lock:
            while len(self.results) >= self.most:
                del self.results[next(iter(self.results))]
            self.results[key] = result
        return result
