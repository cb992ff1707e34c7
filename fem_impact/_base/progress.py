"""How far long work is: loops report a count or what is left to do, and whoever shows it listens."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[str, int, int], object]
Oracle = Callable[[float], object]
LISTENER: ContextVar[Listener | None] = ContextVar("LISTENER", default=None)  # of the work in this thread
ORACLE: ContextVar[Oracle | None] = ContextVar("ORACLE", default=None)  # the same, of what is left


def report(what: str, done: int, total: int) -> None:
    """Say how many of something are done, to the listener if there is one."""
    listener = LISTENER.get()
    if listener is not None:
        listener(what, done, total)


def foresee(seconds: float) -> None:
    """Say how many more seconds work takes that was not planned, or was planned otherwise."""
    oracle = ORACLE.get()
    if oracle is not None:
        oracle(seconds)


@contextmanager
def heard(listener: Listener | None, oracle: Oracle | None = None) -> Iterator[None]:
    """Send the reports of the block to a listener and an oracle; None silences them."""
    tokens = LISTENER.set(listener), ORACLE.set(oracle)
    try:
        yield
    finally:
        LISTENER.reset(tokens[0])
        ORACLE.reset(tokens[1])
