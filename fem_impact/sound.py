"""What a blow sounds like where one listens: the velocity of a point on the struck body, as samples."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _check
from .response import Response

RATE = 48_000  # [Hz] sample rate: every audible mode lies below half of it
FULL_SCALE = 10.0  # [m/s] the velocity written as 1.0; a plate struck at some m/s stays below, and strikes compare
SHORTEST, LONGEST = 0.5, 5.0  # [s] bounds of the length chosen when none is given
DECAY = np.log(1e3)  # [-] 60 dB: how far the slowest mode has decayed at the end, if that is not too long
BLOCK = 4096  # [-] samples propagated from one modal state; bounds the memory, not the result
CRITICAL = 1e-6  # [-] damping ratios this near to 1 are moved aside: the two roots would coincide; test_sound.py


@dataclass(frozen=True, eq=False)
class Sound:
    """Samples ready to be written or played."""

    samples: np.ndarray  # (n_times,) [-] velocity over full_scale
    rate: int  # [Hz]
    full_scale: float  # [m/s] velocity of sample value 1.0

    def __post_init__(self) -> None:
        _check.lock_arrays(self)

    @property
    def peak_level(self) -> float:
        """Largest sample in dB relative to full scale; minus infinity for silence."""
        peak = float(np.abs(self.samples).max(initial=0.0))
        return 20.0 * float(np.log10(peak)) if peak else -np.inf


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
    point: Any = response.at if at is None else at
    rate = _check.count("rate", rate)
    heard = (modes.omega > 0.0) & (modes.omega < np.pi * rate)
    if duration is None:
        slowest = float((modes.damping_ratio * modes.omega)[heard].min(initial=np.inf))
        duration = float(np.clip(DECAY / slowest, SHORTEST, LONGEST)) if slowest > 0.0 else LONGEST
    duration = _check.positive("duration", duration, "s")
    times = response.time[0] + np.arange(max(1, round(duration * rate))) / rate
    shape = modes.shape_at(np.atleast_2d(point))[0]  # (n_modes,)
    n_blow = int(np.searchsorted(times, response.time[-1], side="right"))
    blow = response.modal_state(times[:n_blow])[1][:, heard] @ shape[heard]
    free = _free_velocity(response, times[n_blow:], heard, shape) if n_blow < len(times) else np.zeros(0)
    velocity = np.concatenate([blow, free])
    scale = float(np.abs(velocity).max(initial=0.0)) if normalise else FULL_SCALE
    return Sound(velocity / (scale or 1.0), rate, scale or FULL_SCALE)


def _free_velocity(response: Response, times: np.ndarray, heard: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Velocity (n_times,) [m/s] at equally spaced times after the last contact.

    ``q'' + 2 zeta omega q' + omega**2 q = 0`` has the roots r, s; q' = a r exp(r t) + b s exp(s t), and one table of
    exponentials serves every block of samples.
    """
    omega, zeta = response.target.omega[heard], response.target.damping_ratio[heard]
    zeta = np.where(np.abs(zeta - 1.0) < CRITICAL, 1.0 + CRITICAL, zeta)
    split = omega * np.sqrt(zeta**2 - 1.0 + 0j)  # (n_heard,)
    roots = np.stack([-zeta * omega + split, -zeta * omega - split])  # (2, n_heard)
    step = times[1] - times[0] if len(times) > 1 else 0.0
    table = np.exp(roots[:, None, :] * (step * np.arange(min(BLOCK, len(times))))[None, :, None])
    q, p = (state[:, heard] for state in response.modal_state(times[::BLOCK]))  # (n_blocks, n_heard)
    first = (p - roots[1] * q) / (roots[0] - roots[1])
    weights = np.stack([first * roots[0], (q - first) * roots[1]]) * shape[heard]  # (2, n_blocks, n_heard)
    blocks = np.einsum("rbm,rtm->bt", weights, table, optimize=True).real  # (n_blocks, BLOCK)
    return blocks.reshape(-1)[: len(times)]
