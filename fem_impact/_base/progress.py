"""How far long work is: loops report a count or what is left to do, and whoever shows it listens.

What will take longer than two seconds is announced in one line, at the level INFO of the log "fem_impact.slow": by its
cost where that is predicted, or else as soon as a loop that nobody observes shows it. On a terminal and in a notebook
it is shown, unless the program has a log of its own. To switch it off:
``logging.getLogger("fem_impact.slow").setLevel(logging.WARNING)``.
"""

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

SLOW = logging.getLogger("fem_impact.slow")
LONG = 2.0  # [s] of work that is announced: longer than one waits without wondering
Listener = Callable[[str, int, int], object]
Oracle = Callable[[float], object]
Observers = tuple[Listener | None, Oracle | None]
OBSERVERS: ContextVar[Observers | None] = ContextVar("OBSERVERS", default=None)  # of the work in this thread


class Count:
    """How many of something are done, since when."""

    def __init__(self, what: str, done: int, total: int) -> None:
        self.what, self.first = what, done  # already done when it began
        self.began = time.monotonic()  # [s]
        self.update(done, total)

    def update(self, done: int, total: int) -> None:
        self.done, self.total, self.now = done, total, time.monotonic()  # [s] of the last change

    @property
    def rate(self) -> float:
        """Number per second [1/s]; 0 if not yet known."""
        seconds = self.now - self.began
        return (self.done - self.first) / seconds if seconds > 0.0 else 0.0

    def left(self) -> float | None:
        """Seconds left, judged by the progress so far, once that is two per cent."""
        if not self.rate or self.done - self.first < 0.02 * (self.total - self.first):
            return None
        return max(0.0, (self.total - self.done) / self.rate - (time.monotonic() - self.now))


class Announcer:
    """Announces what takes long and nobody observes; nothing else within twice the time that was announced."""

    def __init__(self) -> None:
        self.counts: dict[str, Count] = {}  # the latest loop over each thing
        self.until = 0.0  # [s] on the monotonic clock

    def announce(self, text: str, seconds: float) -> None:
        """Announce what takes so long."""
        self.until = time.monotonic() + 2.0 * seconds
        SLOW.info(text)

    def follow(self, what: str, done: int, total: int) -> None:
        """Announce a loop as soon as it shows that it takes long."""
        count = self.counts.get(what)
        if count is None or done < count.done:
            self.counts[what] = Count(what, done, total)
            return
        count.update(done, total)
        self.revise(count.left(), f"{total} {what}: ")

    def revise(self, seconds: float | None, what: str = "") -> None:
        """Announce what turns out to take so much longer, if that is known."""
        if seconds is not None and seconds > LONG and time.monotonic() > self.until:
            self.announce(f"{what}about {seconds:.0f} s more", seconds)


ANNOUNCER = Announcer()


def report(what: str, done: int, total: int) -> None:
    """Report how many of something are done, to the listener if there is one."""
    listener, _ = observers()
    if listener is not None:
        listener(what, done, total)


def revise(seconds: float) -> None:
    """Report how many more seconds work takes that was not planned, or was planned otherwise."""
    _, oracle = observers()
    if oracle is not None:
        oracle(seconds)


def observers() -> Observers:
    """Who observes the work in this thread; in the main one by default whoever waits for it."""
    found = OBSERVERS.get()
    if found is not None:
        return found
    main = threading.current_thread() is threading.main_thread()
    return (ANNOUNCER.follow, ANNOUNCER.revise) if main else (None, None)


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
