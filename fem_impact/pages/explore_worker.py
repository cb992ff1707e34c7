"""Computes beside the live page, in a process of its own, what would keep its sliders waiting."""

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any, BinaryIO

from .._base.check import SimulationError

NICE = 10  # [-] the page and the browser go first where cores are short
CODE = "from fem_impact.pages import explore_worker; explore_worker.main()"


class Worker:
    """A process that holds one object and answers one question about it after the other."""

    def __init__(self, held: Any) -> None:
        # not multiprocessing, which would run the user's script again in the new process
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        self.process = subprocess.Popen(
            [sys.executable, "-c", CODE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment
        )
        self.thread = ThreadPoolExecutor(1)
        self.thread.submit(self._send, held)

    def ask(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """What ``function(held, *arguments)`` returns there; it raises ValueError and SimulationError here, too."""
        return self.thread.submit(self._ask, function, arguments)

    def stop(self) -> None:
        """End the process, whatever it is doing."""
        self.process.kill()
        self.process.wait()
        self.thread.shutdown(cancel_futures=True)
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            with suppress(BrokenPipeError):  # something was still to be sent
                pipe.close()

    def _send(self, message: Any) -> None:
        assert self.process.stdin is not None
        pickle.dump(message, self.process.stdin, pickle.HIGHEST_PROTOCOL)
        self.process.stdin.flush()

    def _ask(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        assert self.process.stdout is not None
        try:
            self._send((function, arguments))
            answer, error = pickle.load(self.process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            raise SimulationError("the process that computes beside the page has ended") from None
        if error is not None:
            raise error
        return answer


def main() -> None:
    """The process itself; ends with its input."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the page's process then ends this
    if hasattr(os, "nice"):
        os.nice(NICE)
    # an answer that the page no longer takes is written once more as the pipe is closed
    with suppress(BrokenPipeError), os.fdopen(os.dup(sys.stdout.fileno()), "wb") as out:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # nothing printed may get between the answers
        follow(sys.stdin.buffer, out)


def follow(questions: BinaryIO, answers: BinaryIO) -> None:
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
