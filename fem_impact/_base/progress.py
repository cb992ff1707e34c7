"""How far long work is: loops report a count, and whoever shows it listens."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[str, int, int], object]
LISTENER: ContextVar[Listener | None] = ContextVar("LISTENER", default=None)  # of the work in this thread


def report(what: str, done: int, total: int) -> None:
    """Say how many of something are done, to the listener if there is one."""
    listener = LISTENER.get()
    if listener is not None:
        listener(what, done, total)


@contextmanager
def heard(listener: Listener | None) -> Iterator[None]:
    """Send the reports of the block to a listener; None silences them."""
    token = LISTENER.set(listener)
    try:
        yield
    finally:
        LISTENER.reset(token)
