"""The command line: runs one command, prints its answer and decides the exit status; contains no physics."""

import argparse
import codecs
import io
import json
import logging
import os
import signal
import sys
import warnings
from collections.abc import MutableMapping
from contextlib import AbstractContextManager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import fem_impact as fi

from . import answers
from ._base.explained import named_headings
from ._base.files import signalled, undo_all
from ._base.progress import observed
from .answers import Status
from .arguments import parser
from .commands import Answer
from .display import complain, in_plain_signs, wrapped


def main(arguments: list[str] | None = None) -> int:
    """Run one command; the exit status is 0, or

    2 for bad input, 1 for a run that failed, 3 for one that missed its tolerance, 130 after Ctrl-C.
    """
    codecs.register_error("fem-impact", in_plain_signs)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="fem-impact")  # titles and units may hold characters that this terminal lacks
    options = parser().parse_args(arguments)
    options.show = partial(_print, options)
    plain = _prepare(os.environ, once=options.command in ("strike", "modes", "report"))
    try:
        with _interruptible(options), observed(None), warnings.catch_warnings():
            if options.quiet:
                warnings.simplefilter("ignore")
            found: Answer | None = options.run(options)
            if found is None:  # it has shown its answer already
                return Status.DONE
            _print(options, found)
    except ValueError as error:
        return complain(error, Status.BAD_INPUT)
    except BrokenPipeError:
        _forget_output()
        return Status.FAILED
    except OSError as error:
        _forget_output()
        said = f"{error.filename}: {error.strerror}" if error.filename else error.strerror or error
        return complain(said, Status.FAILED)
    except MemoryError:
        return complain("not enough memory; `fem-impact plan SCENE` shows what needs it", Status.FAILED)
    except RuntimeError as error:
        if not isinstance(error, fi.SimulationError):
            raise
        if plain:  # perhaps only plain Python failed: run again with compiled kernels
            from ._base import child  # imported only when needed

            words = sys.argv[1:] if arguments is None else arguments
            again, environment = child.python("__main__:main", *words, NUMBA_DISABLE_JIT="0")
            os.execve(again[0], again, environment)
        return complain(error, Status.FAILED)
    except KeyboardInterrupt:
        return complain(f"interrupted; {_kept(options)}", Status.INTERRUPTED)
    if found.fault:
        return complain(found.fault, Status.FAILED)
    return Status.MISSED if found.missed else Status.DONE


def _print(options: argparse.Namespace, found: Answer) -> None:
    """Print an answer as text, or as JSON with what all answers have."""
    if found.said is None or options.json:
        data = found.data
        if found.said is not None:
            said = ("\n".join([part] if isinstance(part, str) else part) for part in found.said)
            rest = {"notes": [], "see": named_headings(said), "versions": fi.export.versions()}
            data = {"command": options.command, "format": answers.FORMAT} | data
            data |= {name: value for name, value in rest.items() if name not in data}
        print(json.dumps(fi.export.plain(data), indent=2, allow_nan=False))
    else:
        for part in found.said:
            print(wrapped(part) if isinstance(part, str) else "\n".join(part))
    print(end="", flush=True)


def _interruptible(options: argparse.Namespace) -> AbstractContextManager[None]:
    """On Ctrl-C or SIGTERM, remove unfinished output and end the process."""
    ends = signal.SIGINT, signal.SIGTERM

    def end(number: int, _: Any) -> None:
        for each in ends:
            signal.signal(each, signal.SIG_IGN)
        if options.command in ("explore", "watch") and number == signal.SIGINT:
            undo_all()
            last = getattr(options, "last", None)  # their last word
            if last and not options.quiet:
                with suppress(OSError):
                    os.write(2, f"fem-impact: {last}\n".encode())
            os._exit(0)  # Ctrl-C is the normal way to stop them
        if undo_all():
            word = "interrupted" if number == signal.SIGINT else "terminated"
            with suppress(OSError):
                os.write(2, f"fem-impact: {word}; {_kept(options)}\n".encode())
            os._exit(128 + number)

    return signalled(end, *ends)


def _kept(options: argparse.Namespace) -> str:
    """Say what an interrupted command left on disk."""
    if options.command not in ("map", "spread"):
        return "nothing was written"
    if options.store is None:
        return "nothing was written; --store DIR keeps finished cells"
    return f"finished cells are in {options.store}; run the same command again to continue"


def _forget_output() -> None:
    """Discard pending output: Python would otherwise write it again at exit and report the same error twice."""
    if sys.stdout is not None:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _prepare(environment: MutableMapping[str, str], once: bool) -> bool:
    """Set the environment variables that numpy and numba read on import, unless the user has set them.

    Until the kernels are compiled, a command that strikes once runs in plain Python; returns whether this one does.
    """
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        # The dense matrices are small: on two busy cores, two threads took 18 s and one thread 4 s.
        environment.setdefault(name, "1")
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # users need not read about fonts or cache folders
    if "numba" in sys.modules:
        return False
    from .impact.compiled import places

    kernels = Path(str(fi.__file__)).parent / "impact" / "compiled"
    cache = places.find(environment, kernels)
    if not once or "NUMBA_DISABLE_JIT" in environment:
        return False
    source = max(file.stat().st_mtime for file in kernels.glob("*.py"))
    if any(file.stat().st_mtime >= source for file in cache.rglob("energy.follow-*.nbi")):
        return False
    # A single strike takes 0.3 to 1 s in plain Python; compiling takes 15 to 30 s, and `doctor` does it once.
    environment["NUMBA_DISABLE_JIT"] = "1"
    return True


if __name__ == "__main__":
    sys.exit(main())
