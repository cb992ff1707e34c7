"""Shows on a terminal which stage is running, how far it is and how long it still takes."""

import os
import re
import shutil
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from rich import progress as bars
from rich.console import Console
from rich.table import Column
from rich.text import Text

from ._base.explained import printable, with_headings
from ._base.files import undoable
from ._base.progress import Count, observed

ANNOUNCED = 10.0  # [s] time left that is announced even without a terminal that shows the line
WIDE = 60  # columns of a terminal from which on there is room for a bar
SIGNS = str.maketrans("\N{NO-BREAK SPACE}µ−·×⁻⁰¹²³⁴⁵⁶⁷⁸⁹", " u-*x-0123456789") | {ord("±"): "+-", ord("∞"): "inf"}
LONGER = 2.0  # [-] over the time announced last, from which on a longer one is announced, too


def width() -> int:
    """Columns that printed text may take: at most 88, and fewer on a narrow terminal."""
    return max(20, min(88, shutil.get_terminal_size().columns))


def wrapped(text: str) -> str:
    """Text wrapped to the width of the terminal, with paths kept whole and continued lines indented."""
    filled = textwrap.TextWrapper(width(), subsequent_indent="    ", break_on_hyphens=False, break_long_words=False)
    lines = (filled.wrap(line) or [""] for line in text.splitlines())
    return "\n".join(line for wrapped in lines for line in wrapped)


def in_plain_signs(error: UnicodeError) -> tuple[str, int]:
    """What a stream gets for signs that it lacks: u for µ, ^-3 for a raised -3, escapes for letters; see `codecs`."""
    assert isinstance(error, UnicodeEncodeError)
    plain = re.sub("[⁻⁰¹²³⁴-⁹]+", r"^\g<0>", error.object[error.start : error.end]).translate(SIGNS)
    return plain.encode("ascii", "backslashreplace").decode("ascii"), error.end


def announce(text: str) -> None:
    """Print one sentence to stderr."""
    print(wrapped(f"fem-impact: {text}"), file=sys.stderr, flush=True)


def complain(error: object, status: int) -> int:
    """Print an error on one line of stderr; return the exit status."""
    with suppress(OSError):  # if stderr is closed, the exit status must suffice
        print(f"fem-impact: {printable(with_headings(str(error)))}", file=sys.stderr, flush=True)
    return status


class Display:
    """One line on the terminal, shown while a stage runs; without a terminal nothing is written.

    A stage may run within another. Counts come from `_base.progress`, times from them or from a prediction. With or
    without a terminal, ``announce`` is called with a sentence as soon as a command turns out to take long, and again
    each time that it turns out to take twice as long as was announced.
    """

    def __init__(self, announce: Callable[[str], object] | None = None, shown: bool = True) -> None:
        self.console: Console = Console(stderr=True)
        self.shown = shown
        self.announce = announce
        self.task: bars.TaskID
        self.running: list[tuple[str, float]] = []  # name and start [s] of each stage, the innermost last
        self.count: Count | None = None
        self.end: float | None = None  # [s] predicted end of the command, on the monotonic clock
        self.began = time.process_time()  # [s] of what was predicted or counted; a busy machine makes nothing longer
        self.last: float | None = None  # [s] that it takes in all, as announced last
        self.alarm: threading.Timer | None = None
        self.bar: bars.Progress | None = None

    def predict(self, seconds: float | None) -> None:
        """Say how long the following stages take together; None if that is not known."""
        self.began, self.last = time.process_time(), seconds
        self.end = None if seconds is None else time.monotonic() + seconds
        if self.running:
            self._arm()

    def revise(self, seconds: float) -> None:
        """Note that the rest takes so long, whatever was predicted."""
        if self.end is not None:
            self.end = time.monotonic() + seconds
            self._warn(seconds, f"about {seconds:.0f} s more")

    def _warn(self, left: float, said: str) -> None:
        """Announce what is left [s] if it is long and makes the whole LONGER than was announced."""
        whole = self.spent + left
        if self.announce is not None and left > ANNOUNCED and (self.last is None or whole > LONGER * self.last):
            self.announce(f"{'' if self.last is None else 'longer than predicted: '}{said}; Ctrl-C stops it")
            self.last = whole

    def _overdue(self) -> None:
        """Announce that what was to end long ago still runs, and look again later."""
        if self.announce is not None and self.last is not None and self.spent >= max(ANNOUNCED, LONGER * self.last):
            self.announce(f"longer than predicted: {self.spent:.0f} s so far; Ctrl-C stops it")
            self.last = self.spent
        self._arm()

    def _arm(self) -> None:
        """Look at the clock when the command is overdue, whatever stage runs then."""
        self._disarm()
        if self.announce is not None and self.last is not None:
            self.alarm = threading.Timer(max(ANNOUNCED, LONGER * self.last) - self.spent, self._overdue)
            self.alarm.daemon = True
            self.alarm.start()

    def _disarm(self) -> None:
        if self.alarm is not None:
            self.alarm.cancel()
        self.alarm = None

    @property
    def spent(self) -> float:
        """Processor time [s] since it was predicted or began."""
        return time.process_time() - self.began

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """Show a stage while the block runs."""
        outer, self.count = self.count, None
        self.running.append((name, time.monotonic()))
        try:
            if len(self.running) == 1:
                self._arm()
            with observed(self.report, self.revise):
                if self.bar is None and self.shown and self.console.is_terminal:
                    with undoable(lambda: os.write(2, b"\r\x1b[2K\x1b[?25h")), self._opened():
                        yield
                else:
                    self._draw()
                    yield
        finally:
            self.running.pop()
            self.count = outer
            if self.running:
                self._draw()
            else:
                self._disarm()

    def report(self, what: str, done: int, total: int) -> None:
        """Note how many of something are done."""
        count = self.count
        if count is None or count.what != what or done < count.done:
            self.count = Count(what, done, total)
        else:
            count.update(done, total)
            left = count.left()
            if self.running and what == self.running[-1][0] and left is not None:
                self._warn(left, f"{total} {what}: about {left:.0f} s more")
        self._draw()

    def status_line(self) -> str:
        """Count, rate, time so far and time left of the running stage; on a narrow terminal its name and less."""
        if not self.running:
            return ""
        name, began = self.running[-1]
        spent, count, parts = time.monotonic() - began, self.count, []
        left = count.left() if count is not None else None if self.end is None else self.end - time.monotonic()
        late = self.last is not None and self.spent > LONGER * self.last
        last = "longer than predicted" if late else "soon done"
        # before two seconds, the first counts are no guide
        ends = [] if left is None or spent <= 2.0 else [f"{_clock(left)} left" if left > 0.0 else last]
        if count is not None:
            what = "" if count.what == name else f" {count.what}"
            parts.append(f"{count.done}/{count.total}{what}")
            parts += [f"{count.rate:.3g}/s"] if count.rate >= 1.0 else []
        if self.console.width < WIDE:
            return f"{name} {ends[0] if ends else _clock(spent)}, {', '.join(parts[:1])}".rstrip(", ")
        return ", ".join([*parts, _clock(spent), *ends])

    @contextmanager
    def _opened(self) -> Iterator[None]:
        """The line while the outermost stage runs."""
        columns: list[bars.ProgressColumn] = [bars.SpinnerColumn(), _Text(self.status_line)]
        if self.console.width >= WIDE:
            columns[1:1] = [_Text(lambda: self.running[-1][0]), bars.BarColumn(bar_width=20)]
        with bars.Progress(*columns, console=self.console, transient=True) as self.bar:
            self.task = self.bar.add_task("", total=None)
            try:
                yield
            finally:
                self.bar = None

    def _draw(self) -> None:
        if self.bar is not None:
            done, total = (0, None) if self.count is None else (self.count.done, self.count.total)
            self.bar.update(self.task, completed=done, total=total)


class _Text(bars.ProgressColumn):
    """Text that is written anew at every refresh, and cut where the terminal ends."""

    def __init__(self, text: Callable[[], str]) -> None:
        super().__init__(table_column=Column(no_wrap=True, overflow="ellipsis"))
        self.text = text

    def render(self, task: bars.Task) -> Text:
        return Text(self.text())


def _clock(seconds: float) -> str:
    """Minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{rest:02}" if minutes >= 60 else f"{minutes}:{rest:02}"
