"""Measures what compilation costs: the first blow of a fresh install, and of every later process.

    python studies/compile_time.py

Times the first `fi.strike` of a new process with an empty and with a filled kernel cache, not counting the imports,
and then a blow with everything loaded.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile

REPEATS = 5
BLOW = """
import json, time
begin = time.perf_counter()
import fem_impact as fi
target, striker, law = fi.Modes.rigid(0.2), fi.Striker.rigid(0.1), fi.Contact.hertz(1e6)
import numba
imported = time.perf_counter()
blow = lambda: fi.strike(target, striker, law, at=None, speed=1.0)
blow()
first = time.perf_counter()
times = []
for _ in range(200):
    start = time.perf_counter()
    blow()
    times.append(time.perf_counter() - start)
print(json.dumps([imported - begin, first - imported, min(times)]))
"""


def first_blow(cache: str) -> list[float]:
    """Seconds for imports, the first blow and the best later blow of a new process with a kernel cache."""
    done = subprocess.run(
        [sys.executable, "-c", BLOW], capture_output=True, text=True, check=True,
        env={**os.environ, "NUMBA_CACHE_DIR": cache},
    )  # fmt: skip
    return json.loads(done.stdout)


def main() -> None:
    """Print the table."""
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as cache:
        fresh = first_blow(cache)
        later = [first_blow(cache) for _ in range(REPEATS)]
    print("process        imports   first blow   later blows")
    print(f"fresh install  {fresh[0]:6.2f} s  {fresh[1]:8.2f} s  {fresh[2] * 1e6:8.0f} us")
    middle = [statistics.median(column) for column in zip(*later)]
    print(f"later          {middle[0]:6.2f} s  {middle[1]:8.2f} s  {middle[2] * 1e6:8.0f} us   (median of {REPEATS})")


if __name__ == "__main__":
    main()
