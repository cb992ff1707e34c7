"""Starts the command line; an interruption while that still loads ends it without a word."""

import os
import signal
import sys

for _number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(_number, lambda number, _: os._exit(128 + number))

from .cli import main  # noqa: E402  loads for a tenth of a second

if __name__ == "__main__":
    sys.exit(main())
