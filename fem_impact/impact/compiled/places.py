"""Where compiled kernels are kept on disk: the rule of the command line and of Python, in a file without numba."""

import atexit
import os
import shutil
import tempfile
from collections.abc import MutableMapping
from contextlib import suppress
from pathlib import Path

GIVEN = "NUMBA_CACHE_DIR"  # variable of numba that says where
PASSING = "fem-impact-"  # how the name of a temporary folder begins


def find(environment: MutableMapping[str, str], kernels: Path = Path(__file__).parent) -> Path:
    """The first folder of these that can be written to: the one given, one beside the kernels, and one of the user.

    If there is none, as numba would refuse to work, a temporary one for this process and its children.
    """
    home = os.path.join(environment.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "numba")
    for place in (environment.get(GIVEN), str(kernels / "__pycache__"), home):
        with suppress(OSError):
            if place:
                os.makedirs(place, exist_ok=True)
                tempfile.TemporaryFile(dir=place).close()
                return Path(place)
    environment[GIVEN] = folder = tempfile.mkdtemp(prefix=PASSING)
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def is_lasting(environment: MutableMapping[str, str]) -> bool:
    """Whether what is kept outlives this process."""
    return not environment.get(GIVEN, "").startswith(os.path.join(tempfile.gettempdir(), PASSING))
