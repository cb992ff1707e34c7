"""What a blow sounds like: the velocity of a point on the struck body, or the pressure a plate radiates, as samples."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _check, drawing
from .response import Response

RATE = 48_000  # [Hz] sample rate: every audible mode lies below half of it
FULL_SCALE = 10.0  # [m/s] the velocity written as 1.0; a plate struck at some m/s stays below, and strikes compare
LOUDEST = 200.0  # [Pa] the pressure written as 1.0: 140 dB, far above any struck plate at some distance
REFERENCE = {"m/s": (1e-9, "1 nm/s"), "Pa": (20e-6, "20 µPa")}  # what 0 dB stands for in acoustics, ISO 1683
AIR = (1.204, 343.2)  # [kg/m^3], [m/s] density and speed of sound at 20 degrees C
OVERSAMPLING = 8  # [-] instants per sample while the first waves arrive: differences err by 0.5 % at 10 kHz
HIGHEST_RATE = 1_000_000  # [Hz] far above what any device plays
MOST_SAMPLES = 10_000_000  # [-] three minutes at 48 kHz: some ten seconds of work
SHORTEST, LONGEST = 0.5, 5.0  # [s] bounds of the length chosen when none is given
DECAY = np.log(1e3)  # [-] 60 dB: how far the slowest mode has decayed at the end, if that is not too long
BLOCK = 4096  # [-] samples propagated from one modal state; bounds the memory, not the result
CRITICAL = 1e-6  # [-] damping ratios this near to 1 are moved aside: the two roots would coincide; test_sound.py


@dataclass(frozen=True, eq=False)
class Sound:
    """Samples ready to be written or played."""

    samples: np.ndarray  # (n_times,) [-] velocity or pressure over full_scale
    rate: int  # [Hz]
    full_scale: float  # [m/s] or [Pa] of sample value 1.0
    unit: str = "m/s"

    def __post_init__(self) -> None:
        _check.lock_arrays(self)

    @property
    def peak_level(self) -> float:
        """Largest sample in dB relative to full scale; minus infinity for silence."""
        peak = float(np.abs(self.samples).max(initial=0.0))
        return 20.0 * float(np.log10(peak)) if peak else -np.inf

    @property
    def level(self) -> float:
        """Largest sample in dB relative to ``REFERENCE``: 20 micropascal, or 1 nm/s."""
        return self.peak_level + 20.0 * float(np.log10(self.full_scale / REFERENCE[self.unit][0]))

    @property
    def said(self) -> str:
        """The level with what it refers to."""
        return f"{self.level:.1f} dB re {REFERENCE[self.unit][1]}".replace("-", "−")


@_check.typed
def synthesise(
    response: Response, at: Any = None, *, duration: float | None = None, rate: int = RATE, normalise: bool = False
) -> Sound:
    """Velocity of a point of the struck body from the first touch on, heard as sound.

    Parameters
    ----------
    response : Response
    at : array_like, shape (dimension,) [m], optional
        Where one listens; the strike point by default.
    duration : float [s], optional
        Default: until the slowest mode has lost 60 dB, but 0.5 to 5 s.
    rate : int [Hz]
    normalise : bool
        Make the largest sample 1; otherwise 1 stands for ``FULL_SCALE`` whatever the blow, so that two strikes
        can be compared by ear.

    Returns
    -------
    Sound

    Notes
    -----
    Each mode's motion is exact at every sample, during the blow and after it. Rigid modes (inaudible) and modes at or
    above ``rate / 2`` (they would alias) are left out. It is the motion of the surface, not the radiated pressure.
    """
    modes = response.target
    point: Any = modes.point("at", response.at if at is None else at)
    rate, heard = _audible(response, rate)
    times = response.time[0] + np.arange(_length(response, heard, duration, rate)) / rate
    shape = modes.shape_at(point)[0]  # (n_modes,)
    n_blow = int(np.searchsorted(times, response.time[-1], side="right"))
    blow = response.modal_state(times[:n_blow])[1][:, heard] @ shape[heard]
    free = _ring(response, times[n_blow:], heard, shape[None, heard] + 0j, 1) if n_blow < len(times) else np.zeros(0)
    return _scaled(np.concatenate([blow, free]), rate, FULL_SCALE, "m/s", normalise)


@_check.typed
def radiate(
    response: Response,
    listener: Any,
    *,
    duration: float | None = None,
    rate: int = RATE,
    normalise: bool = False,
    air: tuple[float, float] = AIR,
) -> Sound:
    """Sound pressure beside a plate set in an infinite rigid wall, heard as sound.

    Parameters
    ----------
    response : Response of a struck plate
    listener : array_like, shape (3,) [m]
        Where one listens; the third coordinate is the distance from the plate's plane, on the side it moves to.
    duration, rate, normalise
        As in `synthesise`; unless normalised, 1 stands for ``LOUDEST``.
    air : density [kg/m^3] and speed of sound [m/s]

    Returns
    -------
    Sound
        Time zero is the first touch; the sound arrives later by the way through the air.

    Notes
    -----
    Rayleigh's integral ``p = rho/(2 pi) int a(x, t - R/c) / R dS`` over the whole plate. The ring after the blow is
    exact for each mode; while the first waves arrive, acceleration is a difference of velocities. The air does not
    act back on the plate, and rigid motions are left out.

    References
    ----------
    Rayleigh, The Theory of Sound, section 278.
    """
    modes = response.target
    if modes.dimension != 2:
        raise ValueError(f"response must be that of a plate, got a body of dimension {modes.dimension}")
    place = beside(listener)
    density, speed = (_check.positive("air", x) for x in _check.array("air", air, (2,)))
    rate, heard = _audible(response, rate)
    points, cells = drawing.grid(modes)
    weights = density / (2.0 * np.pi) * np.sign(place[2]) * _areas(points, cells)
    way = np.sqrt(((points - place[:2]) ** 2).sum(axis=1) + place[2] ** 2)  # (n_points,) [m]
    shapes = modes.shapes.at(points)[:, heard] * (weights / way)[:, None]  # (n_points, n_heard)
    times = response.time[0] + np.arange(_length(response, heard, duration, rate)) / rate
    n_first = int(np.searchsorted(times, response.time[-1] + way.max() / speed, side="right"))
    first = _arrival(response, times[:n_first], heard, shapes, way / speed)
    delayed = np.stack(
        [np.einsum("km,km->m", shapes, np.exp(-np.outer(way / speed, r))) for r in _roots(response, heard)]
    )
    ring = _ring(response, times[n_first:], heard, delayed, 2) if n_first < len(times) else np.zeros(0)
    return _scaled(np.concatenate([first, ring]), rate, LOUDEST, "Pa", normalise)


def beside(listener: Any) -> np.ndarray:
    """Coordinates (3,) [m] of a listener; ValueError where they are none or lie in the plate's plane."""
    place = _check.array("listener", listener, (3,), "m")
    if not abs(place[2]) > 0.0:
        raise ValueError("listener must lie off the plate's plane, got a third coordinate of 0 m")
    return place


def _audible(response: Response, rate: int) -> tuple[int, np.ndarray]:
    rate = _check.count("rate", rate, high=HIGHEST_RATE)
    return rate, (response.target.omega > 0.0) & (response.target.omega < np.pi * rate)


def _length(response: Response, heard: np.ndarray, duration: float | None, rate: int) -> int:
    """Number of samples of a duration [s], or of one that suits the decay."""
    if duration is None:
        slowest = float((response.target.damping_ratio * response.target.omega)[heard].min(initial=np.inf))
        duration = float(np.clip(DECAY / slowest, SHORTEST, LONGEST)) if slowest > 0.0 else LONGEST
    duration = _check.between("duration", _check.positive("duration", duration, "s"), 0.0, MOST_SAMPLES / rate, "s")
    return max(1, round(duration * rate))


def _scaled(signal: np.ndarray, rate: int, full_scale: float, unit: str, normalise: bool) -> Sound:
    scale = float(np.abs(signal).max(initial=0.0)) if normalise else full_scale
    return Sound(signal / (scale or 1.0), rate, scale or full_scale, unit)


def _roots(response: Response, heard: np.ndarray) -> np.ndarray:
    """Both roots [1/s] of ``s**2 + 2 zeta omega s + omega**2`` for each audible mode, (2, n_heard)."""
    omega, zeta = response.target.omega[heard], response.target.damping_ratio[heard]
    zeta = np.where(np.abs(zeta - 1.0) < CRITICAL, 1.0 + CRITICAL, zeta)
    split = omega * np.sqrt(zeta**2 - 1.0 + 0j)
    return np.stack([-zeta * omega + split, -zeta * omega - split])


def _ring(response: Response, times: np.ndarray, heard: np.ndarray, weights: np.ndarray, order: int) -> np.ndarray:
    """Weighted sum of the modes' derivatives of an order at equally spaced times after the last contact, (n_times,).

    In free flight ``q = a exp(r t) + b exp(s t)``; one table of exponentials serves every block of samples. Weights
    are (1, n_heard), or (2, n_heard) one for each root.
    """
    roots = _roots(response, heard)
    step = times[1] - times[0] if len(times) > 1 else 0.0
    table = np.exp(roots[:, None, :] * (step * np.arange(min(BLOCK, len(times))))[None, :, None])
    q, p = (state[:, heard] for state in response.modal_state(times[::BLOCK]))  # (n_blocks, n_heard)
    first = (p - roots[1] * q) / (roots[0] - roots[1])
    parts = np.stack([first, q - first]) * (weights * roots**order)[:, None, :]  # (2, n_blocks, n_heard)
    blocks = np.einsum("rbm,rtm->bt", parts, table, optimize=True).real  # (n_blocks, BLOCK)
    return blocks.reshape(-1)[: len(times)]


def _areas(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Area [m^2] that belongs to each point, (n_points,): a third of every triangle around it."""
    a, b, c = (points[cells[:, i]] for i in range(3))
    area = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return np.bincount(cells.reshape(-1), np.repeat(area / 3.0, 3), minlength=len(points))


def _arrival(response, times: np.ndarray, heard: np.ndarray, shapes: np.ndarray, delay: np.ndarray) -> np.ndarray:
    """Pressure (n_times,) [Pa] while the blow is still heard: delayed accelerations, point by point."""
    pressure, began = np.zeros(len(times)), response.time[0]
    silent = int(np.searchsorted(times, began + delay.min(), side="right"))
    step = (times[-1] - times[0]) / max(1, len(times) - 1) / OVERSAMPLING
    for start in range(max(1, silent), len(times), BLOCK):
        part = slice(start, start + BLOCK)
        # the instants heard meanwhile, and one more on either side for the differences
        first, last = max(began, times[start] - delay.max() - step), times[part][-1] - delay.min() + step
        fine = np.linspace(first, last, int(np.ceil((last - first) / step)) + 1)
        momentum = response.modal_state(fine)[1][:, heard]  # (n_fine, n_heard)
        acceleration = np.gradient(momentum, fine[1] - fine[0], axis=0)
        for shape, late in zip(shapes, delay):
            pressure[part] += np.interp(times[part] - late, fine, acceleration @ shape, left=0.0)
    return pressure
