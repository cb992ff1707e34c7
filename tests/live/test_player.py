"""A played body: the blow is that of `fi.strike`, its sound that of `fi.sound`, block by block without allocating."""

import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from comparing import refusing

import fem_impact as fi
from fem_impact.impact.compiled import build
from fem_impact.live.player import AT_ONCE, PlayedStroke, Player, Score

pytestmark = pytest.mark.xdist_group("live")  # one worker compiles
POINTS = [(0.1395, 0.09), (0.05, 0.05), (0.2, 0.15)]
FASTEST = 2.0  # m/s


def plate(n_modes=300):
    return fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=n_modes, damping_ratio=0.005)


STICK, HERTZ = fi.Striker.stick(mass=0.1, first_frequency=10e3), fi.Contact.hertz(695e3)


def player(striker=STICK, law=HERTZ, n_modes=300, **options):
    return Player(plate(n_modes), striker, law, points=POINTS, fastest=FASTEST, **options)


LAWS = {
    "hertz": (STICK, HERTZ),
    "linear, rigid": (fi.Striker.rigid(0.02), fi.Contact.linear(1e6)),
    "hard": (fi.Striker.rigid(0.005), fi.Contact.hertz(1e9)),
    "lossy": (fi.Striker.rigid(0.02), fi.Contact.restituting(1e7, 1.5, restitution=0.6, speed=1.0)),
    "felt": (fi.Striker.rigid(0.02), fi.Contact.felt(1e9, 2.5, hysteresis=0.5, relaxation=1e-4)),
    "layers": (fi.Striker.rigid(0.02), fi.Contact.layers(1e6, 1.5, depth=5e-5, hard_stiffness=1e8, hard_exponent=1.5)),
    "yielding": (fi.Striker.rigid(0.02), fi.Contact.elastic_plastic(1e8, 1.5, yield_approach=1e-5)),
}


def test_a_score_gives_every_stroke_once_in_its_block():
    score = Score([PlayedStroke(130, 1, 0.5), PlayedStroke(3, 0, 1.0), PlayedStroke(64, 2, 2.0)])
    assert score.due(0, 64) == [(3, 0, 1.0)] and not score.over(0)
    assert score.due(64, 128) == [(0, 2, 2.0)]
    assert score.due(128, 192) == [(2, 1, 0.5)] and score.over(192)
    crowd = Score([PlayedStroke(1, 0, 0.1)] * 100)
    first = crowd.due(0, 64)
    assert len(first) == AT_ONCE and len(crowd.due(64, 128)) == 100 - len(first)


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize(("point", "speed"), [(0, FASTEST), (2, 0.7)])
def test_the_force_of_a_blow_is_that_of_strike(name, point, speed):
    striker, law = LAWS[name]
    game = player(striker, law, n_trace=20_000)
    sound = game.play([PlayedStroke(0, point, speed)], 0.05)
    hit = fi.strike(game.modes, striker, law, at=POINTS[point], speed=speed, tolerance=1e-6, duration=0.05)
    end, length, struck, mean, _, force = game.struck.trace.T
    assert (struck == point).all()
    expected = np.interp(end, hit.time, hit.force)
    assert np.abs(force - expected).max() < 1e-3 * hit.peak_force  # what is promised
    assert mean @ length == pytest.approx(hit.impulse, rel=1e-3)
    assert game.struck.counted["contacts"] == hit.n_impacts
    heard = fi.sound.synthesise(hit, POINTS[0], duration=0.05)
    assert np.abs(sound.samples - heard.samples).max() < 1e-3 * np.abs(heard.samples).max()


@pytest.mark.slow
def test_strokes_on_a_body_still_moving_are_those_of_strokes():
    game = player(n_modes=100, n_trace=20_000)
    when = [0, 960, 1920, 1940]  # frames; the last two sticks are on the body together
    speeds, at = [1.0, 0.5, 2.0, 1.5], [0, 1, 2, 0]
    sound = game.play([*map(PlayedStroke, when, at, speeds)], 0.1)
    strokes = [(w / 48e3, STICK, HERTZ, POINTS[i], v) for w, i, v in zip(when, at, speeds)]
    roll = fi.strokes(game.modes, strokes, tolerance=1e-4, duration=0.1)
    heard = fi.sound.synthesise(roll, POINTS[0], duration=0.1)
    _, length, _, mean, _, _ = game.struck.trace.T
    assert mean @ length == pytest.approx(roll.impulse, rel=1e-3)
    # the last two sticks do not feel how far the modes left out move under each other
    assert np.abs(sound.samples - heard.samples).max() < 2e-3 * np.abs(heard.samples).max()


@pytest.mark.slow
def test_a_stick_held_by_a_hand_comes_back():
    held = fi.Striker.rigid(0.02).held(fi.Hand(stiffness=200.0, force=2.0))
    game = player(held, n_modes=30, n_trace=20_000)
    game.play([PlayedStroke(0, 0, 1.0)], 0.1)
    hit = fi.strike(game.modes, held, HERTZ, at=POINTS[0], speed=1.0, tolerance=1e-4, duration=0.03)
    end, length, _, mean, _, _ = game.struck.trace.T
    assert hit.n_impacts >= 3
    early = end < 0.03
    assert mean[early] @ length[early] == pytest.approx(hit.impulse, rel=2e-3)  # the last contact may be cut off


@pytest.mark.slow
def test_the_same_strokes_give_the_same_bits_in_blocks_of_any_length():
    rng = np.random.default_rng(3)
    strokes = [PlayedStroke(int(f), int(p), float(v)) for f, p, v in zip(
        rng.integers(0, 20_000, 40), rng.integers(0, 3, 40), rng.uniform(0.05, 2.0, 40)
    )]  # fmt: skip
    first = player(n_modes=60).play(strokes, 0.5).wav()
    assert first == player(n_modes=60).play(strokes, 0.5).wav()
    assert first == player(n_modes=60, block=1000).play(strokes, 0.5).wav()
    game = player(n_modes=60)
    game.play(strokes, 0.3)
    game.struck.reset()
    assert game.play(strokes, 0.5).wav() == first


@pytest.mark.slow
def test_a_stick_too_many_takes_the_place_of_another_and_all_leave_at_last():
    game = player(n_modes=30, sticks=2)
    game.play([PlayedStroke(100 * i, i % 3, 0.5) for i in range(6)], 0.05)
    assert game.struck.counted["strokes"] == 6 and game.struck.counted["stolen"] > 0
    game.play([], 1.5)
    state = game.struck.state
    assert state.place[0] == 0 and not state.q[: state.q.size - 30].any()


@pytest.mark.slow
def test_a_free_body_does_not_fly_away():
    bar = fi.analytic.beam(0.4, ends=("free", "free"), mass=0.1, first_frequency=200.0, n_modes=20, damping_ratio=0.01)
    game = Player(bar, fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), points=[[0.2]], fastest=1.0, n_trace=20_000)
    game.play([PlayedStroke(9600 * i, 0, 1.0) for i in range(10)], 2.0)
    end, length, _, mean, _, _ = game.struck.trace.T
    each = [(mean * length)[(end > 0.2 * i) & (end <= 0.2 * (i + 1))].sum() for i in range(10)]
    assert each == pytest.approx([each[0]] * 10, rel=0.2)  # what rings on changes it a little


@pytest.mark.slow
@pytest.mark.skipif(not build.COMPILED, reason="in plain Python everything allocates")
def test_a_block_allocates_nothing_and_leaves_other_threads_alone():
    code = f"""
import numpy as np, sys
sys.path[:0] = {sys.path!r}
from test_player import player, PlayedStroke
from numba.core.runtime import rtsys
game = player(n_modes=30)
for n in (64, 48_000):
    out = np.zeros(n, np.float32)
    before = rtsys.get_allocation_stats().alloc
    game.fill([PlayedStroke(n // 70 * i, i % 3, 1.0) for i in range(60)], out)
    print(rtsys.get_allocation_stats().alloc - before)
print(len(game.struck.body) + len(game.struck.pads) + len(game.struck.state) + 4)
"""
    environment = {**os.environ, "NUMBA_NRT_STATS": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    short, long, n_arrays = map(int, done.stdout.split())
    assert short == long == n_arrays  # the handles of the arguments; nothing for frames, strokes or contacts
    game, counted = player(n_modes=300), 0
    out = np.zeros(480_000, np.float32)  # ten seconds in one block: some 0.1 s
    work = threading.Thread(target=game.fill, args=([], out))
    work.start()
    while work.is_alive():
        counted += 1
    assert counted > 1000  # with the lock held, this thread would wait


test_what_cannot_be_played_is_refused = refusing([
    (lambda: Player(plate(5), STICK, HERTZ, points=3, fastest=1.0),
     "points must be a list of points of the body, got 3"),
    (lambda: Player(plate(5), STICK, HERTZ, points=[(0.1, 0.1), (1.0, 0.1)], fastest=1.0),
     r"points\[1\] must lie on the body"),
    (lambda: Player(fi.Modes.rigid(1.0), fi.Striker.rigid(1e-9), fi.Contact.linear(1e12), points=[()], fastest=1.0),
     r"contact must last at least .* s at 1 m/s to be played, got"),
    (lambda: player(n_modes=5).play([(0, 0, 3.0)], 0.1),
     "speed of a stroke must lie between 0 and 2 m/s, got 3 m/s"),
    (lambda: player(n_modes=5).play([(0, 3, 1.0)], 0.1), "point of a stroke must be at most 2, got 3"),
])  # fmt: skip
