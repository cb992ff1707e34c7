"""A bounded store of results that are needed again; safe in threads, and emptied when its owner is pickled."""

from collections.abc import Callable
from threading import Lock
from typing import Any

import numpy as np


class Remembered:
    """The last ``most`` results of a function of one array."""

    def __init__(self, most: int) -> None:
        self.most, self.lock = most, Lock()
        self.results: dict[bytes, Any] = {}

    def __reduce__(self):
        return Remembered, (self.most,)

    def found(self, array: np.ndarray, find: Callable[[np.ndarray], Any]) -> Any:
        """The result for an array: a known one, or ``find(array)``, which then displaces the oldest."""
        key = array.tobytes()
        with self.lock:
            if key in self.results:
                return self.results[key]
        result = find(array)  # without the lock: other threads need not wait
        with self.lock:
            while len(self.results) >= self.most:
                del self.results[next(iter(self.results))]
            self.results[key] = result
        return result
