"""What arrives of the motion of a body: the velocity of its points, and its pressure after a way through the air."""

from collections.abc import Mapping

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.sparse import csr_array

from .._base import progress
from ..impact import force_spectrum, free_motion
from ..impact.compiled import layout
from ..impact.response import Response
from ..model.playing import Strokes

OVERSAMPLING = 8  # [-] instants per sample as the first waves arrive: the finite differences err by 0.5 % at 10 kHz
BLOCK = 2048  # [-] samples computed at a time as the first waves arrive: limits the memory, does not change the result
COMPACT = 0.5  # [-] half the width of a bar times the wavenumber, up to which a piece of it is a dipole
SQUARE = 1.51  # [-] mass of air that a square section drags, over that of a flat strip of its width
# [-] ends of a flat strip drag the less air the nearer, by this power of the distance in widths; test_arrivals.py
ENDS = 3.2


def parts(response: Response | Strokes, times: np.ndarray) -> list[tuple[Response, slice, np.ndarray]]:
    """The blow that gives the motion at each of ascending times: it, its times, and these from its start."""
    return [(response, slice(0, len(times)), times)] if isinstance(response, Response) else response.parts(times)


def velocity(response: Response, audible: np.ndarray, shape: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Velocity [m/s] of a point at equally spaced times of one blow, (n_times,)."""
    if response.history.stretched is not None:  # the modes pull on each other: none rings on its own
        blocks = [response.modal_state(times[i : i + BLOCK])[1] for i in range(0, len(times), BLOCK)]
        return np.concatenate([p @ np.where(audible, shape, 0.0) for p in blocks])
    history = response.history
    busy = np.flatnonzero(history.pressed.any(axis=1))
    ends = history.steps[:, layout.START] + history.steps[:, layout.LENGTH]
    # the first sample of every long free flight and of what follows it; the last begins when the blow is over
    first = np.searchsorted(times, np.append(0.0, ends[busy]))
    after = np.append(np.searchsorted(times, history.steps[busy, layout.START]), len(times))
    long = after - first >= free_motion.BLOCK
    long[-1] = after[-1] > first[-1]
    flights = list(zip(first[long].tolist(), after[long].tolist()))
    alone = np.ones(len(times), bool)  # samples whose states are asked for: all but those within the flights
    for start, end in flights:
        alone[start + 1 : end] = False
    q, p = response.modal_state(times[alone])  # (n_alone, n_modes)
    found = np.empty(len(times))
    found[alone] = p @ np.where(audible, shape, 0.0)
    row = np.cumsum(alone) - 1
    for start, end in flights:
        state = q[row[start], audible], p[row[start], audible]
        found[start:end] = _ringing_motion(response, times[start:end], state, audible, shape[None, audible] + 0j, 1)
    return found


def pressure(
    response: Response | Strokes, times: np.ndarray, audible: np.ndarray, orders: Mapping[int, np.ndarray],
    delay: np.ndarray, sample: float,
) -> np.ndarray:  # fmt: skip
    """Sum (n_times,) over points of delayed motion; ``orders``: derivative -> weights (n_points, n_audible)."""
    roots = free_motion.roots(response.target.omega[audible], response.target.damping_ratio[audible])
    last = delay.max()
    early = last - delay  # [s] how much sooner it arrives than the last: over a long way decays cannot be undone
    two = roots[0].imag == 0.0  # modes that do not swing; the second root of all others is the conjugate of the first
    delayed = {order: np.zeros(roots.shape, complex) for order in orders}
    for some in np.array_split(np.arange(len(early)), 1 + len(early) // BLOCK):  # to limit the memory
        for k, which in enumerate((np.ones(len(two), bool), two)):
            sooner = np.exp(np.outer(early[some], roots[k, which]))
            for order, weights in orders.items():
                delayed[order][k, which] += np.einsum("km,km->m", weights[some][:, which], sooner)
    found = []
    for hit, part, local in parts(response, times):
        n_first = int(np.searchsorted(local, hit.time[-1] + last, side="right"))
        n_first = n_first if hit.history.stretched is None else len(local)
        first = [_arrival(response, times[part][:n_first], audible, *each, delay, sample) for each in orders.items()]
        found.append(np.sum(first, axis=0))
        if n_first < len(local):
            since = local[n_first:] - last
            q, p = (state[0, audible] for state in hit.modal_state(since[:1]))
            rest = [_ringing_motion(hit, since, (q, p), audible, weights, order) for order, weights in delayed.items()]
            found.append(np.sum(rest, axis=0))
    return np.concatenate(found)


def _ringing_motion(
    response: Response, times: np.ndarray, state: tuple, audible: np.ndarray, weights: np.ndarray, order: int
) -> np.ndarray:
    """`free_motion.flexible_motion` of the audible modes, (n_times,)."""
    modes, bias = response.target, response.constant_forces[audible]
    known = modes.omega[audible], modes.damping_ratio[audible], bias, state
    return free_motion.flexible_motion(*known, times, weights, order)


def _arrival(
    response: Response | Strokes, times: np.ndarray, audible: np.ndarray, order: int, shapes: np.ndarray,
    delay: np.ndarray, sample: float,
) -> np.ndarray:  # fmt: skip
    """`pressure` (n_times,) while sound from the blow still arrives, of one order: 2 is the acceleration."""
    found, began, step = np.zeros(len(times)), response.time[0], sample / OVERSAMPLING
    silent = int(np.searchsorted(times, began + delay.min(), side="right"))
    # every point is heard with the two delays, whole numbers of steps, between which its own lies
    lag, first = delay / step, int(delay.min() / step)
    row, n_lags = lag.astype(int) - first, int(lag.max()) - first + 2
    where = np.append(row, row + 1), np.tile(np.arange(len(delay)), 2)
    heard = csr_array((np.append(1.0 - lag % 1.0, lag % 1.0), where), shape=(n_lags, len(delay)))
    size = next_fast_len(OVERSAMPLING * min(BLOCK, len(times) - silent) + n_lags, real=True)
    spectra = rfft(heard @ shapes, size, axis=0)
    for start in range(silent, len(times), BLOCK):
        progress.report("samples of sound", start, len(times))
        part = slice(start, start + BLOCK)
        # instants whose sound arrives in this block, with one more on each side for every difference
        n, room = OVERSAMPLING * (len(times[part]) - 1) + n_lags, order - 1
        fine = times[start] + step * (np.arange(-room, n + room) - (n_lags - 1 + first))
        moves = np.flatnonzero(fine >= began)
        motion = response.modal_state(fine[moves])[1][:, audible]
        for _ in range(room):
            motion = np.gradient(motion, step, axis=0)
        motion = np.vstack([np.zeros((moves[0], motion.shape[1])), motion])[room : n + room]
        found[part] = irfft((rfft(motion, size, axis=0) * spectra).sum(axis=1), size)[n_lags - 1 : n : OVERSAMPLING]
    return found


def dipoles(
    response: Response | Strokes, audible: np.ndarray, place: np.ndarray, width: float, speed: float, rate: int
) -> tuple[dict[int, np.ndarray], np.ndarray]:
    """Weights as `pressure` takes them of the pieces of a bar, if each drags 1 kg/m, and their distances (n,) [m]."""
    modes = response.target
    x = np.sort(modes.shapes.grid()[0][:, 0])
    gap = float(np.hypot(place[0] - np.clip(place[0], x[0], x[-1]), np.hypot(place[1], place[2])))
    length = x[-1] - x[0]
    least = max(width, 2e-4 * length)  # nearer to a wire, its pieces would take long
    if not gap > least:
        raise ValueError(f"listener must be farther than {least:g} m from the bar, got {gap:g} m")
    waves = 8.0 * audible.sum() + force_spectrum.fastest(response, rate) / speed * length
    count = max(len(x), 64 + int(waves), int(2.0 * length / gap))  # [-] pieces, at most as long as the gap
    turn = np.pi * (np.arange(count) + 0.5) / count  # shortest at the ends, where the mass is as a root
    ends = length * np.stack([np.sin(0.5 * turn), np.cos(0.5 * turn)]) ** 2  # (2, n_pieces) [m] how far away they are
    x = x[0] + ends[0]
    way = np.sqrt((x - place[0]) ** 2 + place[1] ** 2 + place[2] ** 2)  # (n_pieces,) [m]
    mass = np.sqrt(1.0 - (1.0 + ends / width) ** -ENDS).prod(axis=0)  # [-] over that of a piece far from both ends
    share = 0.5 * np.pi * length / count * np.sin(turn) * mass * place[2] / (4.0 * np.pi * way**2)
    shapes = modes.shapes.at(x[:, None])[:, audible] * share[:, None]
    return {3: shapes / speed, 2: shapes / way[:, None]}, way
