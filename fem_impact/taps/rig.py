"""What a test rig records of a blow: tip, sensor, anti-alias filter, samples, noise, bits."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal

from .._base import check
from ..impact.history import History
from ..impact.response import Response
from .records import RATES, Taps
from .triggers import LONGEST

# end of the pass band and begin of the stop band, each over the sampling rate
FILTERS: dict[str, tuple[float, float] | None] = {
    # linear-phase filters of delta-sigma converters; data sheets state 0.45 and 0.55 to 0.58 (TI SLAS666B, SBASAU5)
    "delta-sigma": (0.453, 0.547),
    # analysers with a band of rate / 2.56: what folds back must stay outside the band
    "2.56": (1.0 / 2.56, 1.0 - 1.0 / 2.56),
    "none": None,
}
FINE = 16  # [-] samples of the simulation per sample of the rig: aliasing of a half sine stays below 2e-5
# [-] samples of the rig around a record, in which its filter may ring: more than twice those of `windows.BEFORE`
MARGIN = 32


@dataclass(frozen=True)
class Rig:
    """The measuring chain between a blow and its record.

    The force cell sits behind the tip: it misses the force that accelerates the mass of the tip. The sensor answers
    as a resonator, the filter as a linear-phase roll-off or a Butterworth filter.
    """

    rate: float  # [Hz]
    anti_alias: Any = "delta-sigma"  # a name of FILTERS, (order, corner [Hz]) of a Butterworth filter
    tip_mass: float = 0.0  # [kg] in front of the force cell
    resonance: float | None = None  # [Hz] of the force sensor
    resonance_damping: float = 0.01  # [-]
    noise: float = 0.0  # [-] standard deviation over the peak of each channel
    bits: int | None = None  # of the converter
    full_scale: float | None = None  # [N] range of the force channel; by default just above the peak

    def __post_init__(self) -> None:
        check.settle(
            self,
            rate=check.between("rate", self.rate, *RATES, "Hz"),
            tip_mass=check.non_negative("tip_mass", self.tip_mass, "kg"),
            resonance_damping=check.between("resonance_damping", self.resonance_damping, 1e-6, 10.0),
            noise=check.between("noise", self.noise, 0.0, 10.0),
        )
        if self.resonance is not None:
            check.positive("resonance", self.resonance, "Hz")
        if self.bits is not None:
            check.count("bits", self.bits, 2, 64)
        if self.full_scale is not None:
            check.positive("full_scale", self.full_scale, "N")
        if isinstance(self.anti_alias, str):
            check.one_of("anti_alias", self.anti_alias, FILTERS)
        elif self.anti_alias is not None:
            order, corner = check.array("anti_alias", self.anti_alias, (2,))
            check.between("order of anti_alias", order, 1, 20)
            check.positive("corner of anti_alias", corner, "Hz")

    def passes(self, frequencies: np.ndarray) -> np.ndarray:
        """Transfer function of the anti-alias filter at frequencies (n_frequencies,) [Hz], complex [-]."""
        if self.anti_alias is None or self.anti_alias == "none":
            return np.ones(len(frequencies), complex)
        if isinstance(self.anti_alias, str):
            low, high = FILTERS[self.anti_alias] or (1.0, 1.0)
            x = np.clip((np.abs(frequencies) / self.rate - low) / (high - low), 0.0, 1.0)
            return (0.5 + 0.5 * np.cos(np.pi * x)).astype(complex)
        filtered = signal.butter(int(self.anti_alias[0]), self.anti_alias[1], analog=True, output="zpk")
        return signal.freqs_zpk(*filtered, frequencies)[1]

    def senses(self, frequencies: np.ndarray) -> np.ndarray:
        """Transfer function of the force sensor, (n_frequencies,), complex [-]."""
        if self.resonance is None:
            return np.ones(len(frequencies), complex)
        x = frequencies / self.resonance
        return 1.0 / (1.0 - x**2 + 2j * self.resonance_damping * x)


def accelerations(
    history: History, part: slice, rows: np.ndarray, force: np.ndarray, times: np.ndarray, softness: Any = 0.0
) -> np.ndarray:
    """Acceleration of a body under a contact force, (n_times, n_points) [m/s^2].

    Parameters
    ----------
    part : slice, the body's modes in the history
    rows : ndarray, shape (n_points, n_modes) [kg**-0.5], shapes of the body at the points
    force : ndarray, shape (n_times,) [N], at `times`
    times : ndarray, shape (n_times,) [s], ascending in even steps from the begin of the blow on
    softness : float or ndarray, shape (n_points,) [m/N], static deflection of its modes left out under a unit force
    """
    omega, zeta = history.omega[part], history.zeta[part]
    # the force slows the first body and speeds up the second
    forced = history.bias[part] - np.outer(force, history.shape[0, part])
    if omega.any():
        q, p = history.states(times)
        forced -= 2.0 * zeta * omega * p[:, part] + omega**2 * q[:, part]
    found = forced @ rows.T
    if np.any(softness):  # these modes follow the force, which was zero before
        found += np.outer(np.diff(force, 2, prepend=0.0, append=force[-1]) / (times[1] - times[0]) ** 2, softness)
    return found


def behind_tip(history: History, part: slice, tip_mass: float, force: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Contact force (n_times,) [N] less the mass of the tip times its deceleration.

    A rigid striker decelerates by force over mass; its modes (``part`` of the history) add to that.
    """
    if tip_mass == 0.0:
        return force
    return force + tip_mass * accelerations(history, part, history.shape[:, part], force, times)[:, 0]


def sample(fine: np.ndarray, rig: Rig, *, force: bool, shift: Any = 0.0) -> np.ndarray:
    """Filter a fine record and keep every `FINE`-th sample.

    Parameters
    ----------
    fine : ndarray, shape (..., FINE n_times)
        Sampled at FINE times the rate; zero at both ends, or its ends are lost in the filter's ringing.
    force : bool, whether the force sensor's resonance acts
    shift : float or ndarray (...,) [s], by which the record is delayed

    Returns
    -------
    ndarray, shape (..., n_times)
    """
    n = fine.shape[-1]
    frequencies = np.fft.rfftfreq(n, 1.0 / (FINE * rig.rate))
    transfer = rig.passes(frequencies)
    if force:
        transfer = transfer * rig.senses(frequencies)
    delay = np.exp(-2j * np.pi * frequencies * np.asarray(shift)[..., None])
    return np.fft.irfft(np.fft.rfft(fine) * transfer * delay, n)[..., ::FINE]


@check.typed
def measure(
    hit: Response,
    *,
    rate: float,
    at: Any = None,
    anti_alias: Any = "delta-sigma",
    tip_mass: float = 0.0,
    resonance: float | None = None,
    resonance_damping: float = 0.01,
    noise: float = 0.0,
    bits: int | None = None,
    full_scale: float | None = None,
    duration: float | None = None,
    before: float = 1e-3,
    onset: float = 0.0,
    quantity: str = "acceleration",
    rng: Any = None,
) -> Taps:
    """What a test rig would record of a blow.

    Parameters
    ----------
    hit : Response
    rate : float [Hz]
    at : array_like, (n_points, dimension) [m], optional
        Points of the struck body where the response is measured.
    anti_alias : "delta-sigma", "2.56", "none" or (order, corner [Hz])
        The first has linear phase and falls between 0.453 and 0.547 of the rate, as in most converters; the second
        belongs to analysers with a band of rate / 2.56; the last is a Butterworth filter.
    tip_mass : float [kg]
        Mass in front of the force cell, part of the striker's mass.
    resonance, resonance_damping : float [Hz], [-]
        Of the force sensor.
    noise : float [-]
        Standard deviation over the peak of each channel.
    bits : int, optional
        Of the converter; its range is ``full_scale`` [N] or just above the peak.
    duration, before : float [s]
        Length of the record (default: until 20 ms after the last impact), and how much of it is before the blow.
    onset : float [s]
        Delay of the blow, for a place between two samples.
    quantity : "acceleration", "velocity" or "displacement"
        Measured at ``at``.
    rng : numpy Generator or seed, needed for noise

    Returns
    -------
    Taps
        One tap.

    Examples
    --------
    >>> hit = fi.strike(fi.Modes.rigid(100.0), fi.Striker.rigid(0.1), fi.Contact.linear(4e6), at=None, speed=1.0)
    >>> tap = fi.measure(hit, rate=25600.0)
    >>> round(float(tap.impulse[0]), 3), round(hit.impulse, 3)  # N s
    (0.2, 0.2)
    """
    rig = Rig(rate, anti_alias, tip_mass, resonance, resonance_damping, noise, bits, full_scale)
    before, onset = check.non_negative("before", before, "s"), check.non_negative("onset", onset, "s")
    check.one_of("quantity", quantity, ("acceleration", "velocity", "displacement"))
    if len(hit.contacts) != 1:
        raise ValueError(f"hit must have one contact, between hammer and structure, got {len(hit.contacts)}")
    if hit.history.stretched is not None:
        raise ValueError("hit must be on a structure that does not stretch; strike it with stretching=False")
    if rig.tip_mass >= hit.bodies[0].mass:
        raise ValueError(f"tip_mass must be less than the striker's {hit.bodies[0].mass:g} kg, got {rig.tip_mass:g} kg")
    last = max((impact.end for impact in hit.impacts), default=0.0)
    span = last + 0.02 if duration is None else check.positive("duration", duration, "s") - before
    if span <= 0.0:
        raise ValueError(f"duration must be longer than before, {before:g} s, got {duration:g} s")
    if before + onset > LONGEST:
        raise ValueError(f"before and onset must be at most {LONGEST:g} s together, got {before:g} and {onset:g} s")
    lead = round(before * rig.rate)
    n_times = lead + max(8, round(span * rig.rate))
    n_fine = FINE * (n_times + 2 * MARGIN)
    if n_fine > 4_000_000:  # a second of computing
        raise ValueError(f"duration must be shorter, or rate lower: the record would need {n_fine:.1g} fine samples")
    times = (np.arange(n_fine) - FINE * (lead + MARGIN)) / (FINE * rig.rate)
    begun = times >= 0.0
    force = np.zeros(n_fine)
    pushed = hit.history.force_at(times[begun], 0)[0]
    force[begun] = behind_tip(hit.history, hit.body_slice(0), rig.tip_mass, pushed, times[begun])
    rows = [sample(force, rig, force=True, shift=onset)]
    if at is not None:
        points = hit.target.points("at", at)
        moved = np.zeros((len(points), n_fine))
        moved[:, begun] = _moved_points(hit, points, quantity, pushed, times[begun])
        rows += list(sample(moved, rig, force=False, shift=onset))
    found, overload = _digitised(np.array(rows)[:, MARGIN : MARGIN + n_times], rig, rng)
    unit = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}[quantity]
    names = [f"{quantity} {i + 1}" for i in range(len(found) - 1)]
    return Taps.from_arrays(
        found[0], found[1:].T[None], rate=rig.rate, names=names, units=[unit] * len(names), overload=overload[None]
    )


def _moved_points(
    hit: Response, points: np.ndarray, quantity: str, pushed: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """A quantity (n_points, n_times) at points of the struck body, pushed by forces (n_times,) [N]."""
    if quantity == "displacement":
        return hit.displacement(points, times).T
    ringing = hit._motion(-1)
    softness = ringing.softness(points)[:, 0]
    if quantity == "acceleration":
        rows = ringing.modes.shape_at(points)
        return accelerations(ringing.history, ringing.part, rows, pushed, times, softness).T
    # what follows the force jumps with its rate: between samples, as in `accelerations`
    rate = np.gradient(np.append(0.0, pushed), times[1] - times[0])[1:]
    return hit.velocity(points, times, residual=False).T + np.outer(softness, rate)


def _digitised(records: np.ndarray, rig: Rig, rng: Any) -> tuple[np.ndarray, np.ndarray]:
    """Records (n_channels, n_times) with noise, cut off at the range and rounded to bits; and which were cut off."""
    peak = np.maximum(np.abs(records).max(axis=1, keepdims=True), np.finfo(float).tiny)
    if rig.noise:
        if rng is None:
            raise ValueError("rng must be given for noise: a numpy.random.Generator or a seed")
        records = records + rig.noise * peak * check.generator(rng).standard_normal(records.shape)
    top = 1.25 * peak
    top[0] = rig.full_scale or top[0]
    overload = (np.abs(records) >= top).any(axis=1)
    records = np.clip(records, -top, top)
    if rig.bits is not None:
        step = top / 2.0 ** (rig.bits - 1)
        records = np.round(records / step) * step
    return records, overload
