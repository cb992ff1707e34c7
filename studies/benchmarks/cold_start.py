"""Measures how long a user waits: in a new process, and for the spectrum and the sound of a blow.

    python studies/benchmarks/cold_start.py [--repeats 5]

First times `--help`, a strike and one with pictures in new processes: with the kernels compiled, and as on the first
day, before they are. Processor seconds tell more than wall time where others use the machine, too. Then, in this
process, times the spectrum of a blow at 256 frequencies and one second of its sound at 300 modes, in shares of the
strike and of the second, with the largest difference from the direct sum over pieces and from the modes one by one.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import fem_impact as fi
from fem_impact.impact import force_spectrum

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

STUDIES = Path(__file__).parent
PROGRAM = Path(sys.executable).with_name("fem-impact")
RATE = 44_100  # [Hz]
FREQUENCIES = {"evenly": np.linspace(0.0, 5e3, 256), "by octaves": np.geomspace(20.0, 5e3, 256)}  # Hz


def waits(command: list[str], repeats: int, **environment: str) -> list[tuple[float, float]]:
    """Wall time and processor time [s] of each of several runs of a command."""
    times = []
    for _ in range(repeats):
        start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env={**os.environ, **environment})
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        times.append((time.perf_counter() - start, used))
    return times


def share_of_pictures(strike: list[str], repeats: int) -> float:
    """Least wall time of a strike with pictures over that of one without; the two take turns."""
    plain = [str(PROGRAM), *strike]
    without, drawn = zip(*(waits(plain, 1) + waits([*plain, "--pictures"], 1) for _ in range(repeats)))
    return min(drawn)[0] / min(without)[0]


def shortest(call: Callable[[], Any], repeats: int) -> float:
    """The least time [s] of several calls after a first one."""
    times = []
    for _ in range(repeats + 1):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times[1:])


def processes(repeats: int) -> None:
    """Print what new processes take."""
    with tempfile.TemporaryDirectory() as folder:
        strike = ["strike", str(shared.SCENES / "drumstick.toml"), "--out", folder]
        jobs: dict[str, tuple[list[str], dict[str, str]]] = {
            "--help": (["--help"], {}),
            "strike": (strike, {"NUMBA_DISABLE_JIT": "0"}),
            "strike, nothing compiled": (strike, {"NUMBA_DISABLE_JIT": "1"}),
        }
        for name, (arguments, environment) in jobs.items():
            times = waits([str(PROGRAM), *arguments], repeats, **environment)
            wall, used = zip(*times)
            print(
                f"{name:>25}: first {wall[0]:6.2f} s, median {statistics.median(wall):6.2f} s, "
                f"least {min(wall):6.2f} s; processor {min(used):6.2f} s"
            )
        print(f"{'strike --pictures':>25}: {share_of_pictures(strike, repeats):.2f} times as long as without")


def after_a_blow(repeats: int) -> None:
    """Print what spectrum and sound take, and how far they are from direct sums."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=20.0, n_modes=300, damping_ratio=0.002)
    law, at = fi.Contact.hertz(695e3), (0.45, 0.3)
    for name, striker in {"hammer": fi.Striker.rigid(0.1), "stick": fi.Striker.stick(0.1, 10e3)}.items():
        blow = partial(fi.strike, plate, striker, law, at=at, speed=1.0, tolerance=1e-3, residual=False)
        hit, struck = blow(), shortest(blow, repeats)
        pieces = force_spectrum.straight_pieces(hit.time, hit.force[:, None])
        print(f"{name}: strike {1e3 * struck:.2f} ms; the force has {len(pieces[0])} pieces")
        for spacing, frequencies in FREQUENCIES.items():
            taken = shortest(partial(hit.spectrum, frequencies), repeats)
            direct = force_spectrum.spectrum_in_closed_form(pieces, frequencies)
            miss = np.abs(hit.spectrum(frequencies) - direct).max() / hit.impulse
            print(f"  spectrum {spacing}: {1e3 * taken:.2f} ms, {taken / struck:.2f} strikes, errs by {miss:.0e}")
        for duration in (1.0, 5.0):
            sound = partial(fi.sound.synthesise, hit, (0.3, 0.2), duration=duration, rate=RATE)
            heard, taken = sound(), shortest(sound, repeats)
            print(f"  sound of {duration:g} s: {1e3 * taken:.1f} ms, {duration / taken:.0f} times real time", end="; ")
            some = np.arange(0, len(heard.samples), 97)
            velocity = hit.modal_state(some / RATE)[1] @ plate.shape_at((0.3, 0.2))[0]
            miss = np.abs(heard.samples[some] * heard.full_scale - velocity).max() / np.abs(velocity).max()
            print(f"errs by {miss:.0e} of its peak")


def main() -> None:
    parser = shared.parser(__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, {repeats} runs each")
    processes(repeats)
    after_a_blow(repeats)


if __name__ == "__main__":
    main()
