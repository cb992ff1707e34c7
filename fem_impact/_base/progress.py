"""How far long work is: loops report a count or what is left to do, and whoever shows it listens.

What will take longer than two seconds is announced in one line, at the level INFO of the log "fem_impact.slow". On a
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
Observers = tuple[Listener | None, Oracle | None]
OBSERVERS: ContextVar[Observers] = ContextVar("OBSERVERS", default=(None, None))  # of the work in this thread


def report(what: str, done: int, total: int) -> None:
    """Report how many of something are done, to the listener if there is one."""
    listener, _ = OBSERVERS.get()
    if listener is not None:
        listener(what, done, total)


def revise(seconds: float) -> None:
    """Report how many more seconds work takes that was not planned, or was planned otherwise."""
    _, oracle = OBSERVERS.get()
    if oracle is not None:
        oracle(seconds)


@contextmanager
def observed(listener: Listener | None, oracle: Oracle | None = None) -> Iterator[None]:
    """Send the reports of the block to a listener and an oracle; None silences them."""
    token = OBSERVERS.set((listener, oracle))
    try:
        yield
    finally:
        OBSERVERS.reset(token)


class Line(logging.Handler):
    """Writes a line for people at a terminal or a notebook, if nobody else shows what is logged."""

    def emit(self, record: logging.LogRecord) -> None:
        interactive = sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules)
        if interactive and not logging.getLogger().handlers:
            sys.stderr.write(f"fem_impact: {record.getMessage()}\n")
            sys.stderr.flush()


def speak() -> None:
    """Show people what is about to take long."""
    SLOW.setLevel(logging.INFO)
    SLOW.addHandler(Line())
