"""Measures whether a body of 300 modes can be played: computing time of each block, allocations, force against strike.

    python studies/benchmarks/play_speed.py [MINUTES]

Ten minutes of random strokes by default, as fast as they can be computed.
"""

import os
import sys
import threading
import time
from collections.abc import Callable

os.environ.setdefault("NUMBA_NRT_STATS", "1")  # before numba is imported

import numpy as np
from numba.core.runtime import rtsys

import fem_impact as fi
from fem_impact.live.controllers import spread_points
from fem_impact.live.devices import perform
from fem_impact.live.player import PlayedStroke, Player, Score

N_MODES, RATE, BLOCK = 300, 48_000, 64
AT, FASTEST = (0.1395, 0.09), 2.0  # [m], [m/s]
PER_SECOND = 8.0  # strokes, on average, at random times
PARTS = (50.0, 90.0, 99.0, 99.9, 100.0)


class Timed(Player):
    """A player that also takes down the CPU time of its thread for each block."""

    def fill(self, strokes, out):
        """As the player does."""
        begin = time.thread_time()
        super().fill(strokes, out)
        self.taken.append(time.thread_time() - begin)


def player(kind: type[Player] = Player, **options: object) -> Player:
    """The 1.55 : 1 plate of 200 g under a drumstick through a Hertz spring, with ten points."""
    modes = fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=N_MODES, damping_ratio=0.005)
    stick, law = fi.Striker.stick(mass=0.1, first_frequency=10e3), fi.Contact.hertz(695e3)
    return kind(modes, stick, law, points=list(spread_points(modes, AT, 10)), fastest=FASTEST, **options)  # type: ignore[arg-type]


def force_error() -> float:
    """Largest difference of the force from that of `fi.strike`, over the peak, of a blow at each point."""
    worst = 0.0
    for i, speed in enumerate(np.linspace(0.1, FASTEST, 10)):
        game = player(n_trace=20_000)
        game.play([PlayedStroke(0, i, float(speed))], 0.02)
        hit = fi.strike(
            game.modes, game.striker, game.contact, at=game.points[i], speed=float(speed), tolerance=1e-6, duration=0.02
        )
        end, force = game.struck.trace[:, 0], game.struck.trace[:, 5]
        worst = max(worst, float(np.abs(force - np.interp(end, hit.time, hit.force)).max() / hit.peak_force))
    return worst


def allocations() -> tuple[int, int]:
    """Arrays made by a call for a block, and by one for a thousand blocks with strokes in them."""
    game, found = player(), []
    for n_blocks in (1, 1, 1000):
        out = np.zeros(n_blocks * BLOCK, np.float32)
        before = rtsys.get_allocation_stats().alloc
        game.fill([PlayedStroke(len(out) // 64 * i, i % 10, 1.0) for i in range(60)], out)
        found.append(rtsys.get_allocation_stats().alloc - before)
    return found[1], found[2]


def turns(work: Callable[[], None]) -> float:
    """How many turns a second this thread makes while another one works."""
    count, thread = 0, threading.Thread(target=work)
    begin = time.perf_counter()
    thread.start()
    while thread.is_alive():
        count += 1
    return count / (time.perf_counter() - begin)


def row(name: str, seconds: np.ndarray) -> None:
    """Print percentiles in milliseconds."""
    print(f"{name:<22}" + "".join(f"{1e3 * np.percentile(seconds, part):10.3f}" for part in PARTS))


def main(minutes: float) -> None:
    """Play, and print."""
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    game = player(Timed)
    game.taken = []  # type: ignore[attr-defined]
    game.play([], 0.1)
    print(
        f"{N_MODES} modes up to {game.modes.frequencies[-1]:.0f} Hz, and {game.striker.modes.n_modes} of each of four "
        f"sticks; step in contact {1e6 * game.step:.2f} us"
    )
    rng = np.random.default_rng(1)
    count = round(60.0 * minutes * PER_SECOND)
    frames = np.sort(rng.integers(0, round(60.0 * minutes * RATE), count))
    strokes = [
        PlayedStroke(int(frame), int(point), float(speed))
        for frame, point, speed in zip(frames, rng.integers(0, 10, count), rng.uniform(0.05, FASTEST, count))
    ]
    game.struck.reset()
    game.taken.clear()  # type: ignore[attr-defined]
    begin = time.perf_counter()
    played = perform(game, Score(strokes), 60.0 * minutes)
    took = time.perf_counter() - begin
    taken = np.array(game.taken)  # type: ignore[attr-defined]
    happened = ", ".join(f"{count} {name}" for name, count in game.struck.counted.items())
    print(f"{minutes:g} minutes, {happened}: {took:.1f} s, {100.0 * took / (60.0 * minutes):.1f} % of one core")
    print(f"{'[ms] per block':<22}" + "".join(f"{f'{part:g} %':>10}" for part in PARTS))
    row("CPU time", taken)
    row("wall-clock time", played.seconds)
    print(f"a block lasts {1e3 * BLOCK / RATE:.3f} ms; {played.missed} of {len(taken)} took longer by the clock")
    one, many = allocations()
    print(f"arrays made by a call: {one} for 64 frames, {many} for 64000 with 60 strokes: handles of its arguments")
    out = np.zeros(20 * RATE, np.float32)
    idle = turns(lambda: time.sleep(0.5))
    print(f"another thread makes {turns(lambda: game.fill([], out)) / idle:.2f} of its turns while a block is computed")
    print(f"force: within {force_error():.1e} of the peak of fi.strike at 1e-6, the worst of ten points and speeds")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
