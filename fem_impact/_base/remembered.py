"""A bounded store of results that are needed again; safe in threads, and emptied when its owner is pickled."""

from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any


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
