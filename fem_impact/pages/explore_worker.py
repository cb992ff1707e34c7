"""Computes beside the live page, in a process of its own, what would keep its sliders waiting."""

import logging
import os
import pickle
import signal
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from threading import Lock
from typing import Any, BinaryIO

from .._base import child
from .._base.check import SimulationError

LOG = logging.getLogger(__name__)


class Worker:
    """A process that holds one object and answers one question about it after the other.

    If it ends, as when the system kills it for its memory, another one takes its place and the question is asked again;
    ``ended`` counts that.
    """

    def __init__(self, held: Any) -> None:
        self.held, self.ended, self.stopped = held, 0, False
        self.lock = Lock()  # between a new process and the end of all
        self.thread = ThreadPoolExecutor(1)
        # not multiprocessing, which would run the user's script again in the new process
        self.process = child.begin("pages.explore_worker:main")
        self.thread.submit(self._send, held)

    def ask(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """What ``function(held, *arguments)`` returns there; it raises ValueError and SimulationError here, too."""
        return self.thread.submit(self._ask, function, arguments)

    def stop(self) -> None:
        """End the process, whatever it is doing."""
        with self.lock:
            self.stopped = True
            self.process.kill()
        self.process.wait()
        self.thread.shutdown(cancel_futures=True)
        child.end(self.process)

    def _send(self, message: Any) -> None:
        assert self.process.stdin is not None
        pickle.dump(message, self.process.stdin, pickle.HIGHEST_PROTOCOL)
        self.process.stdin.flush()

    def _ask(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        for first in (True, False):
            with suppress(EOFError, OSError, pickle.UnpicklingError):
                if not first:
                    self._replace()
                self._send((function, arguments))
                assert self.process.stdout is not None
                answer, error = pickle.load(self.process.stdout)
                if error is not None:
                    raise error
                return answer
        raise SimulationError("the process that computes beside the page has ended, and so has the one in its place")

    def _replace(self) -> None:
        """Another process in the place of one that has ended."""
        with self.lock:
            if self.stopped:
                raise SimulationError("the process that computes beside the page has ended")
            status = child.end(self.process)  # it may only have lost its voice
            self.process = child.begin("pages.explore_worker:main")
        self.ended += 1
        LOG.warning("a process beside the page has ended (status %d), another one takes its place", status)
        self._send(self.held)


def main() -> None:
    """The process itself; ends with its input."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the page's process then ends this
    if hasattr(os, "nice"):
        os.nice(10)  # the page and the browser go first where cores are short
    # an answer that the page no longer takes is written once more as the pipe is closed
    with suppress(BrokenPipeError), os.fdopen(os.dup(sys.stdout.fileno()), "wb") as out:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # nothing printed may get between the answers
        answer_questions(sys.stdin.buffer, out)


def answer_questions(questions: BinaryIO, answers: BinaryIO) -> None:
    """Answer the questions about the object that comes first."""
    try:
        held = pickle.load(questions)
        while True:
            function, arguments = pickle.load(questions)
            error = None
            try:
                answer = function(held, *arguments)
            except (SimulationError, ValueError) as raised:
                answer, error = None, raised
            pickle.dump((answer, error), answers, pickle.HIGHEST_PROTOCOL)
            answers.flush()
    except (EOFError, BrokenPipeError):
        return
