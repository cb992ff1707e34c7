"""Measures how long a user waits: `--help`, a strike, and one with pictures, each in a new process."""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STUDIES = Path(__file__).parent
PROGRAM = Path(sys.executable).with_name("fem-impact")


def wall_times(command: list[str], repeats: int) -> list[float]:
    """Wall time [s] of each of several runs of a command."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - start)
    return times


def share_of_pictures(scene: str, folder: str, repeats: int) -> float:
    """Least wall time of a strike with pictures over that of one without; the two take turns."""
    plain = [str(PROGRAM), "strike", scene, "--out", folder]
    without, drawn = zip(*(wall_times(plain, 1) + wall_times([*plain, "--pictures"], 1) for _ in range(repeats)))
    return min(drawn) / min(without)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, {repeats} runs each")
    with tempfile.TemporaryDirectory() as folder:
        scene = str(STUDIES / "scenes" / "drumstick.toml")
        jobs = {"--help": ["--help"], "strike drumstick.toml": ["strike", scene, "--out", folder]}
        for name, arguments in jobs.items():
            times = wall_times([str(PROGRAM), *arguments], repeats)
            print(f"{name:>22}: first {times[0]:6.2f} s, median {statistics.median(times):6.2f} s")
        print(f"{'strike --pictures':>22}: {share_of_pictures(scene, folder, repeats):.2f} times as long as without")


if __name__ == "__main__":
    main()
