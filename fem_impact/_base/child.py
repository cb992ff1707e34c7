"""How every other Python process of this package is started: nothing in the working folder or in PYTHONPATH is run.

Python looks for modules in the working folder first after ``python -m`` and ``python -c``, and then in PYTHONPATH, of
which an empty part is the working folder, too. A downloaded folder of scenes with a file ``numpy.py`` would be enough.
"""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np

PACKAGE = Path(__file__).parents[1]
LIBRARIES = Path(np.__file__).parents[1]  # where PYTHONPATH led this process to, on clusters and after pip --target
START = """
import sys
from importlib import import_module, util
package, libraries, target, *sys.argv[1:] = sys.argv[1:]
sys.path.append(libraries)
spec = util.spec_from_file_location("fem_impact", package)
sys.modules["fem_impact"] = util.module_from_spec(spec)
spec.loader.exec_module(sys.modules["fem_impact"])
module, function = target.split(":")
sys.exit(getattr(import_module("fem_impact." + module), function)())
"""  # the package alone: what lies beside it in a source tree is not for the child


def python(target: str, *arguments: str, **variables: str) -> tuple[list[str], dict[str, str]]:
    """The command and the environment of a process that calls a function of this package; ends with what it returns.

    Parameters
    ----------
    target : str, "module:function" of this package; called without arguments
    *arguments : str, its ``sys.argv[1:]``
    **variables : str, environment variables besides those of this process
    """
    options = ["-P", *["-s"] * sys.flags.no_user_site, *["-E"] * sys.flags.ignore_environment]
    found = [str(PACKAGE / "__init__.py"), str(LIBRARIES), target]
    environment = {name: value for name, value in os.environ.items() if name.upper() != "PYTHONPATH"}
    return [sys.executable, *options, "-c", START, *found, *arguments], {**environment, **variables}


def begin(target: str, *, quiet: bool = False, **variables: str) -> "subprocess.Popen[bytes]":
    """Start a process that calls a function of this package, with pipes to and from it; `end` closes them."""
    command, environment = python(target, **variables)
    errors = subprocess.DEVNULL if quiet else None
    return subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors)


def end(process: "subprocess.Popen[bytes]") -> int:
    """Kill what `begin` started, unless it has ended, and close its pipes; its exit status."""
    process.kill()
    for pipe in (process.stdin, process.stdout):
        assert pipe is not None
        with suppress(OSError):  # what could not be sent is no longer needed
            pipe.close()
    return process.wait()


def run_function(
    target: str, *arguments: str, timeout: float, **variables: str
) -> "subprocess.CompletedProcess[bytes]":
    """Run a function of this package in a process until it ends; raises TimeoutExpired after a time [s]."""
    command, environment = python(target, *arguments, **variables)
    return subprocess.run(command, capture_output=True, timeout=timeout, env=environment, check=False)
