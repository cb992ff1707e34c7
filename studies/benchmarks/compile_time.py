"""Measures what compilation costs: for each kind of first blow after a fresh installation, and part by part.

    python studies/benchmarks/compile_time.py [KIND ...]

Strikes in a new process with an empty cache of kernels, once for each kind of blow. Prints the processor time of the
answer as a user gets it, and where everything is compiled first (NUMBA_DISABLE_JIT=0): with that of each kernel that
Python calls and the number of functions compiled for it. Processor time means something where other programs run, too,
but compare it only with that of the same run. "plan" must compile nothing. Those after "hertz" begin with the cache
that "hertz" leaves, as what they need besides is what a user waits for.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fem_impact.model.fresh import MARK

START = """
import json, resource
import fem_impact as fi

def used():
    found = resource.getrusage(resource.RUSAGE_SELF)
    return found.ru_utime + found.ru_stime

plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), plate, supports={"boundary": "hinged"})
modes = fi.analytic.rectangle(0.465, 0.3, section=plate, n_modes=40)
stick, law = fi.Striker.stick(mass=0.1, first_frequency=10e3), fi.Contact.hertz(695e3)
blow = {"at": (0.1395, 0.09), "speed": 0.5, "tolerance": 1e-2}

from numba.core import event
rows, open_ones = [], []

class Listener(event.Listener):
    def on_start(self, told):
        open_ones.append([used(), 1])

    def on_end(self, told):
        start, count = open_ones.pop()
        if open_ones:
            open_ones[-1][1] += count
        elif count > 1 or used() - start > 0.02:  # else it was not compiled: plans go on as plain Python
            function = told.data["dispatcher"].py_func
            rows.append((function.__module__.rsplit(".", 1)[1] + "." + function.__name__, used() - start, count))

event.register("numba:compile", Listener())
begin = used()
"""
END = "\nprint(json.dumps([used() - begin, rows]))"
KINDS = {
    "plan": "str(fi.plan(system, stick, law, **blow))",
    "hertz": "fi.strike(system, stick, law, **blow)",
    "summary": "fi.strike(system, stick, law, **blow).summary()",
    "lossy": "fi.strike(modes, stick, fi.Contact.hertz(695e3, loss=0.1), **blow)",
    "felt": "fi.strike(modes, stick, fi.Contact.felt(1e6, 2.5, hysteresis=0.3, relaxation=1e-4), **blow)",
    "layers": "fi.strike(modes, stick, fi.Contact.layers(1e5, 1.5, depth=1e-4, hard_stiffness=1e7), **blow)",
    "rigid": "fi.strike(fi.Modes.rigid(0.2), stick, law, **(blow | {'at': None}))",
    "chain": "fi.collide([fi.Modes.rigid(0.1)] * 3, [fi.Touch(law, i, i + 1) for i in (0, 1)], speeds=[1.0, 0.0, 0.0])",
    "stretching": "fi.strike(modes, stick, law, stretching=True, **blow)",
    "map": "fi.sweep(modes, stick, law, over={'mass': [0.02, 0.03]}, **blow)",
    "gradient": "fi.strike(modes, stick, law, **blow).gradient(('restitution', 'peak_force'))",
}


FRESH = ("plan", "hertz")  # those that begin with an empty cache


def used(code: str, cache: Path, **environment: str) -> tuple[float, list[tuple[str, float, int]]]:
    """Processor seconds of a statement in a new process, and what it compiled: kernel, seconds, functions."""
    whole = {name: value for name, value in os.environ.items() if name != "NUMBA_DISABLE_JIT"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", START + code + END], capture_output=True, text=True,
        env={**whole, "NUMBA_CACHE_DIR": str(cache), **environment},
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(done.stderr)
    while list(cache.rglob(MARK)):  # the process beside it still compiles
        time.sleep(0.1)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", help=", ".join(KINDS))
    wanted = parser.parse_args().kinds or list(KINDS)
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; processor seconds and number of functions")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        for kind in ["plan", "hertz", *(kind for kind in wanted if kind not in FRESH)]:
            times = []
            for way, switch in {"answer": {}, "compiled": {"NUMBA_DISABLE_JIT": "0"}}.items():
                cache = Path(folder) / way / kind
                if kind not in FRESH:
                    shutil.copytree(Path(folder) / "compiled" / "hertz", cache)
                seconds, rows = used(KINDS[kind], cache, **switch)
                times.append(seconds)
            print(f"{kind:<32}{times[0]:7.2f} s, compiled first {times[1]:7.2f} s")
            for name, taken, count in rows:
                print(f"  {name:<30}{taken:7.2f} s {count:4}", flush=True)


if __name__ == "__main__":
    main()
