"""How far long work is: loops report a count or what is left to do, and whoever shows it listens.

What is about to take longer than two seconds is told in one line, at the level INFO of the log "fem_impact.slow". On a
terminal and in a notebook it is shown, unless the program has a log of its own. To switch it off:
``logging.getLogger("fem_impact.slow").setLevel(logging.WARNING)``.
"""

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

SLOW = logging.getLogger("fem_impact.slow")
LONG = 2.0  # [s] of work that is announced: longer than one waits without wondering
Listener = Callable[[str, int, int], object]
Oracle = Callable[[float], object]
Ears = tuple[Listener | None, Oracle | None]
EARS: ContextVar[Ears] = ContextVar("EARS", default=(None, None))  # of the work in this thread


def report(what: str, done: int, total: int) -> None:
    """Say how many of something are done, to the listener if there is one."""
    listener, _ = EARS.get()
    if listener is not None:
        listener(what, done, total)


def foresee(seconds: float) -> None:
    """Say how many more seconds work takes that was not planned, or was planned otherwise."""
    _, oracle = EARS.get()
    if oracle is not None:
        oracle(seconds)


@contextmanager
def heard(listener: Listener | None, oracle: Oracle | None = None) -> Iterator[None]:
    """Send the reports of the block to a listener and an oracle; None silences them."""
    token = EARS.set((listener, oracle))
    try:
        yield
    finally:
        EARS.reset(token)


class Line(logging.Handler):
    """Writes a line for people at a terminal or a notebook, if nobody else shows what is logged."""

    def emit(self, record: logging.LogRecord) -> None:
        seen = sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules)
        if seen and not logging.getLogger().handlers:
            sys.stderr.write(f"fem_impact: {record.getMessage()}\n")
            sys.stderr.flush()


def speak() -> None:
    """Show people what is about to take long."""
    SLOW.setLevel(logging.INFO)
    SLOW.addHandler(Line())
