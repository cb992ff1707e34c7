"""What each hat waits from an installed program to its first result: the commands of its page, and their seconds.

python studies/benchmarks/hats.py [HAT ...]

Each hat's page in `studies/site/hats` holds its commands and the files that they leave; here they are typed in an empty
folder. Seconds are wall time on this machine, with kernels compiled as they are found.
"""

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "studies" / "site" / "hats"
HATS = tuple(sorted(path.stem for path in PAGES.glob("*.md")))


def path_of(hat):
    """The commands on the page of a hat, and the files that they leave."""
    text = (PAGES / f"{hat}.md").read_text(encoding="utf-8")
    found = (re.search(rf"^```{kind}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[1] for kind in ("sh", "text"))
    commands, files = (part.splitlines() for part in found)
    return commands, files


def walk(hat, folder):
    """Type the commands in a folder; of each its seconds, what it ended with and what it said."""
    room = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    for command in path_of(hat)[0]:
        name, *words = shlex.split(command)
        if name != "fem-impact":
            raise ValueError(f"commands must begin with fem-impact, got {command!r}")
        start = time.perf_counter()
        typed = [sys.executable, "-m", "fem_impact", *words]
        done = subprocess.run(typed, cwd=folder, capture_output=True, text=True, env=room, timeout=900)
        yield command, time.perf_counter() - start, done


def main():
    """Walk the paths of some hats, all unless they are named, and print the seconds."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("hats", nargs="*", metavar="HAT", help=f"{', '.join(HATS)} (default: all)")
    for hat in options.parse_args().hats or HATS:
        with tempfile.TemporaryDirectory() as folder:
            total = 0.0
            for command, seconds, done in walk(hat, folder):
                total += seconds
                print(
                    f"{hat:15} {seconds:6.1f} s  {command}"
                    + (f"  ended with {done.returncode}" * (done.returncode > 0))
                )
            size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
            print(f"{hat:15} {total:6.1f} s  {size / 1e6:.1f} MB of files", flush=True)


if __name__ == "__main__":
    main()
