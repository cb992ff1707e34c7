"""The sound of a blow, as samples: the velocity of a point on the struck body, or the pressure a plate radiates."""

import html
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.io import wavfile

from .._base import check, markup
from ..impact import force_spectrum, promise
from ..impact.response import Response
from ..mesh.meshes import sizes
from ..model.playing import Strokes
from ..modes import free_air
from ..modes.air import DENSITY, SPEED
from ..modes.body import Body
from . import arrivals, sampling

RATE = 48_000  # [Hz] sample rate: all audible modes are below half of it
FULL_SCALE = 10.0  # [m/s] velocity of sample value 1.0: above that of any plate struck at a few m/s
LOUDEST = 200.0  # [Pa] pressure of sample value 1.0: 140 dB, far louder than any struck plate at a distance
REFERENCE = {"m/s": (1e-9, "1 nm/s"), "Pa": (20e-6, "20 µPa")}  # unit: value of 0 dB (ISO 1683) and its name
HIGHEST_RATE = 1_000_000  # [Hz] highest sample rate: far above what any device plays
SHORTEST, LONGEST = 0.5, 5.0  # [s] limits of the default duration: long enough to hear a pitch, short enough to compare


@dataclass(frozen=True, eq=False, repr=False)
class Sound(check.Locked):
    """Samples, ready to write or play."""

    samples: np.ndarray  # (n_times,) or, for several channels, (n_times, n_channels) [-] value over full_scale
    rate: int  # [Hz]
    full_scale: float  # [m/s] or [Pa], value of a sample of 1.0
    unit: str = "m/s"

    @property
    def peak_level(self) -> float:
        """Largest sample in dB relative to full scale; minus infinity for silence."""
        return 20.0 * float(np.log10(self._peak)) if self._peak else -np.inf

    @cached_property
    def _peak(self) -> float:
        return float(np.abs(self.samples).max(initial=0.0))

    @property
    def level(self) -> float:
        """Largest sample in dB relative to ``REFERENCE``: 20 micropascals or 1 nm/s."""
        return self.peak_level + 20.0 * float(np.log10(self.full_scale / REFERENCE[self.unit][0]))

    def audible(self) -> "Sound":
        """The same sound with the smallest full scale that is a power of ten times the present one and holds it."""
        factor = 10.0 ** np.ceil(np.log10(self._peak) - 1e-12) if self._peak else 1.0
        return replace(self, samples=self.samples / factor, full_scale=self.full_scale * float(factor))

    def normalised(self) -> "Sound":
        """The same sound with its peak as full scale."""
        peak = self._peak or 1.0
        return replace(self, samples=self.samples / peak, full_scale=self.full_scale * peak)

    def faded(self) -> "Sound":
        """The same sound, ending in a fade of 0.3 seconds or of a quarter of its length, so that it does not click."""
        count = min(round(0.3 * self.rate), len(self.samples) // 4)
        samples = self.samples.copy()
        fall = np.cos(0.5 * np.pi * np.arange(1, count + 1) / max(count, 1)) ** 2
        samples[len(samples) - count :] *= fall if samples.ndim == 1 else fall[:, None]
        return replace(self, samples=samples)

    @property
    def stated(self) -> str:
        """Level and full scale in words, as written into files."""
        return f"peak {self.said}; a sample of 1.0 is {self.full_scale:.6g} {self.unit}"

    def wav(self) -> bytes:
        """The samples as a 32-bit float WAV file, with `stated` as its comment."""
        if self._peak > float(np.finfo(np.float32).max):
            raise ValueError("response is louder than a WAV file can hold; check the units of its speed")
        file = io.BytesIO()
        wavfile.write(file, self.rate, self.samples.astype(np.float32))
        text = self.stated.replace("−", "-").replace("µ", "u").encode("ascii")
        text += b"\0" * (2 - len(text) % 2)  # ends with a zero and has an even length
        body = b"INFOICMT" + len(text).to_bytes(4, "little") + text
        whole = file.getvalue() + b"LIST" + len(body).to_bytes(4, "little") + body
        return whole[:4] + (len(whole) - 8).to_bytes(4, "little") + whole[8:]

    def _repr_html_(self) -> str:
        """For notebooks: a player."""
        heard = self.audible().faded()
        player = f'<audio controls src="{markup.data_uri("audio/wav", heard.wav())}"></audio>'
        return f"{player}<p>{html.escape(heard.stated)}</p>"

    @property
    def said(self) -> str:
        """The level in words: of a pressure with its reference, of a motion its peak."""
        if self.unit == "m/s":
            return f"{self.full_scale * self._peak:.3g} m/s"
        return f"{self.level:.1f} dB re {REFERENCE[self.unit][1]}".replace("-", "−")


@check.typed
def together(sounds: Sequence[Sound]) -> Sound:
    """Sounds of one blow as the channels of one: stereo of two listeners, left and right.

    They keep their levels and delays relative to each other, on the largest of their full scales; shorter ones are
    continued by silence.

    Examples
    --------
    >>> modes = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=20, damping_ratio=0.01)
    >>> hit = fi.strike(modes, fi.Striker.rigid(0.03), fi.Contact.linear(1e5), at=(0.13, 0.1), speed=1.0)
    >>> ears = [fi.sound.radiate(hit, (x, 0.15, 0.5), duration=0.1) for x in (0.1, 0.3)]
    >>> fi.sound.together(ears).samples.shape
    (4800, 2)
    """
    if not isinstance(sounds, Sequence) or not sounds or not all(isinstance(each, Sound) for each in sounds):
        raise ValueError(f"sounds must be a list of sounds, got {check.shown(sounds)}")
    first = sounds[0]
    for each in sounds:
        if each.samples.ndim != 1 or (each.rate, each.unit) != (first.rate, first.unit):
            raise ValueError("sounds must have one channel each, and the same rate and unit")
    scale = max(each.full_scale for each in sounds)
    samples = np.zeros((max(len(each.samples) for each in sounds), len(sounds)))
    for channel, each in zip(samples.T, sounds):
        channel[: len(each.samples)] = each.samples * (each.full_scale / scale)
    return Sound(samples, first.rate, scale, first.unit)


@check.typed
def synthesise(
    response: Response | Strokes,
    at: Any = None,
    *,
    duration: float | None = None,
    rate: int = RATE,
    normalise: bool = False,
) -> Sound:
    """Turn the velocity of a point of the struck body into sound, from the first touch on.

    Parameters
    ----------
    response : Response or Strokes
    at : array_like, shape (dimension,) [m], optional
        Point to listen to; the (first) strike point by default.
    duration : float [s], optional
        By default until the slowest mode has lost 60 dB, but at least 0.5 s and at most 5 s after the last stroke.
    rate : int [Hz]
    normalise : bool
        Scale the largest sample to 1. Otherwise 1 means ``FULL_SCALE`` for every blow, so that two strikes can be
        compared by ear.

    Returns
    -------
    Sound

    Notes
    -----
    The motion of each mode is exact at every sample, during and after the blow. Leaves out rigid modes (inaudible) and
    modes at or above ``rate / 2`` (they would alias). This is the motion of the surface, not the radiated pressure.
    Warns where it may err by more than 0.05; it meets the tolerance if "sound=.." is among the quantities of `strike`.

    Examples
    --------
    >>> modes = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=20, damping_ratio=0.01)
    >>> hit = fi.strike(modes, fi.Striker.rigid(0.03), fi.Contact.linear(1e5), at=(0.13, 0.1), speed=1.0)
    >>> sound = fi.sound.synthesise(hit, duration=0.5)
    >>> len(sound.samples), sound.rate
    (24000, 48000)
    """
    modes = response.target
    point: Any = modes.point("at", response.at if at is None else at)
    return _moving(response, modes.shape_at(point)[0], duration, rate, normalise)


@check.typed
def of_node(
    response: Response | Strokes,
    body: Body,
    where: Any,
    direction: Any = "normal",
    *,
    duration: float | None = None,
    rate: int = RATE,
    normalise: bool = False,
) -> Sound:
    """Turn the velocity of a node of a body from elsewhere, along any direction, into sound.

    Parameters
    ----------
    response : Response or Strokes
        Of a blow on ``body.modes(...)``, along whatever direction.
    body : Body
    where : node of the body, by number, name or point (3,) [m]
    direction : "normal", "x", "y", "z" or a vector (3,)
    duration, rate, normalise
        As in `synthesise`, whose notes hold here, too.

    Notes
    -----
    This is how the surface moves there, with nothing said of the air. A mode pushes it the better the longer its waves
    are beside those in the air, and both sides of a thin wall push against each other: low modes are too loud in it.

    Examples
    --------
    >>> nodes = [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.2, 0.0)]
    >>> shapes = np.zeros((3, 3, 1))
    >>> shapes[:, 2, 0], shapes[:, 0, 0] = [1.2, -0.9, 0.4], 0.1
    >>> body = fi.Body([110.0], shapes, nodes, mass=0.5)
    >>> hit = fi.strike(body.modes("z"), fi.Striker.rigid(0.1), fi.Contact.linear(1e4), at=body.at(2), speed=0.2,
    ...                 tolerance=1.0)
    >>> along, across = (fi.sound.of_node(hit, body, 1, way, duration=0.2) for way in "zx")
    >>> round(float(np.abs(along.samples).max() / np.abs(across.samples).max()), 3)
    12.0
    """
    own, known = body.along(where, direction), response.target.frequencies
    shape = np.zeros(len(known))
    first = len(shape) - len(own)  # rigid motions that were added come first
    if first < 0 or not np.allclose(known[first:], body.frequencies):
        raise ValueError(
            f"response must be of a blow on this body of {len(own)} modes, got one on {len(shape)}; strike body.modes()"
        )
    shape[first:] = own
    return _moving(response, shape, duration, rate, normalise)


def _moving(
    response: Response | Strokes, shape: np.ndarray, duration: float | None, rate: int, normalise: bool
) -> Sound:
    """Sound of the velocity of a point at which modes have these values (n_modes,) [kg**-0.5]."""
    rate, audible = _audible(response, rate)
    times = _times(response, audible, duration, rate)
    parts = arrivals.parts(response, times)
    velocity = np.concatenate([arrivals.velocity(hit, audible, shape, part) for hit, _, part in parts])
    return _scaled(velocity, rate, FULL_SCALE, "m/s", normalise)


def _scaled(values: np.ndarray, rate: int, full_scale: float, unit: str, normalise: bool = False) -> Sound:
    """Values (n_times,) in a unit as sound."""
    sound = Sound(values / full_scale, rate, full_scale, unit)
    return sound.normalised() if normalise else sound


@check.typed
def radiate(
    response: Response | Strokes,
    listener: Any,
    *,
    duration: float | None = None,
    rate: int = RATE,
    normalise: bool = False,
    air: tuple[float, float] = (DENSITY, SPEED),
) -> Sound:
    """Sound pressure near a plate mounted in an infinite rigid wall.

    Parameters
    ----------
    response : Response or Strokes of a plate
    listener : array_like, shape (3,) [m]
        Position; the third coordinate is the distance from the plate's plane, positive on the side it moves to.
    duration, rate, normalise
        As in `synthesise`; unless normalised, a sample of 1 means ``LOUDEST``.
    air : density [kg/m^3] and speed of sound [m/s]

    Returns
    -------
    Sound
        Time zero is the first touch; the sound arrives after its travel time through the air.

    Notes
    -----
    Rayleigh's integral ``p = rho/(2 pi) int a(x, t - R/c) / R dS`` over the whole plate, to 1e-3 of each mode but for
    those whose lobes cancel until nobody hears them. After the blow each mode is exact in time; the first waves, where
    acceleration is a finite difference of velocity, err by less than 0.01 of the loudest. The air does not act back on
    the plate, and rigid motions are left out.

    A curved plate radiates as if it lay flat in the wall. Of domes that rise by h, up to a fifth of their radius, this
    changes the pressure by at most 2 pi h / wavelength of what all parts would give in step: 0.18 at 1 kHz for 1 cm.

    References
    ----------
    Rayleigh, The Theory of Sound, section 278.

    Examples
    --------
    >>> modes = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=20, damping_ratio=0.01)
    >>> hit = fi.strike(modes, fi.Striker.rigid(0.03), fi.Contact.linear(1e5), at=(0.13, 0.1), speed=1.0)
    >>> heard = fi.sound.radiate(hit, (0.2, 0.15, 1.0), duration=0.1)  # a metre above the middle
    >>> heard.unit
    'Pa'
    """
    modes = response.target
    if modes.dimension != 2:
        raise ValueError(f"response must be that of a plate, got one of dimension {modes.dimension}; use radiate_bar")
    place = beside(listener)
    density, speed = _air(air)
    rate, audible = _audible(response, rate)
    # waves of the modes, by Weyl's law, and of the air multiply, where the blow moves modes faster than they ring; near
    # the plate what is below is louder, and to limit the cost that counts as far as 80 points across it resolve it
    side = sizes(*sampling.grid(modes)).sum() ** 0.5
    fast = max(force_spectrum.fastest(response, rate), modes.omega[audible].max(initial=0.0))
    wave = np.sqrt(4.0 * np.pi * np.count_nonzero(audible)) / side + fast / speed
    points, areas = modes.shapes.quadrature(wave + min(5.0 / abs(place[2]), 160.0 / side))
    weights = density / (2.0 * np.pi) * np.sign(place[2]) * areas
    way = np.sqrt(((points - place[:2]) ** 2).sum(axis=1) + place[2] ** 2)  # (n_points,) [m]
    # a point stands for a disk of its area, whose mean of 1 / R in its middle is 2 over its radius
    shapes = modes.shapes.at(points)[:, audible] * (weights / np.maximum(way, np.sqrt(areas / (4.0 * np.pi))))[:, None]
    times = _times(response, audible, duration, rate)
    pressure = arrivals.pressure(response, times, audible, {2: shapes}, way / speed, 1.0 / rate)
    return _scaled(pressure, rate, LOUDEST, "Pa", normalise)


@check.typed
def radiate_bar(
    response: Response | Strokes,
    listener: Any,
    *,
    width: float,
    height: float,
    duration: float | None = None,
    rate: int = RATE,
    air: tuple[float, float] = (DENSITY, SPEED),
) -> tuple[Sound, Sound]:
    """Sound pressure of a bar in free air, without a baffle: an estimate from below and one from above.

    Parameters
    ----------
    response : Response or Strokes of a beam, which lies along x
    listener : array_like, shape (3,) [m]
        Position, farther than the width from the bar; the third coordinate is along the motion, positive on the side it
        moves to.
    width, height : float [m]
        Of the bar's section, across and along the motion; at its widest if it varies. The height is at most the width.
    duration, rate : as in `synthesise`
    air : density [kg/m^3] and speed of sound [m/s]

    Returns
    -------
    low, high : Sound
        For equal motion the pressure of each mode that is slow enough lies between them: a flat strip of the width, and
        a section that drags the air of a square one and its own volume of air besides. They keep their ratio. Where a
        mode is hardly audible, and around thick ends nearer than three widths, neither holds.

    Notes
    -----
    Every piece of a bar that is narrow beside the sound's wave pushes the air by its mass per length m times the
    acceleration a, and is a dipole: ``p = z / (4 pi R**2) int m (a'(t - R/c) / c + a(t - R/c) / R) dx``. A flat strip
    has ``m = rho pi width**2 / 4``, a square of that width 1.51 times as much. Air flows around the ends, too: at a
    distance of d widths from each, m is less by ``sqrt(1 - (1 + d)**-3.2)``. The sound of a free bar is mostly
    that, as its motion sums to nothing. This holds while half the width times the wavenumber is below 0.5, where it
    errs by a tenth at most; modes above are left out of both sounds, as are rigid motions.

    References
    ----------
    Pierce, Acoustics (1989), chapter 4 (the dipole); Blevins, Formulas for Natural Frequency and Mode Shape (1979),
    chapter 14 (masses of air).

    Examples
    --------
    >>> bar = fi.analytic.beam(0.35, ends=("free", "free"), mass=0.3, first_frequency=220.0, n_modes=20,
    ...                        damping_ratio=0.005)
    >>> hit = fi.strike(bar, fi.Striker.rigid(0.03), fi.Contact.linear(1e5), at=0.17, speed=1.0)
    >>> low, high = fi.sound.radiate_bar(hit, (0.17, 0.0, 0.5), width=0.05, height=0.02, duration=0.1)
    >>> round(high.level - low.level, 1)  # dB
    6.1
    """
    modes = response.target
    if modes.dimension != 1:
        raise ValueError(f"response must be that of a beam, got a body of dimension {modes.dimension}; use radiate")
    if not modes.continuous:
        raise ValueError(
            "response must be that of a beam whose shapes are known everywhere, not at points only; strike it again if "
            "the blow was read from a folder"
        )
    place = check.array("listener", listener, (3,), "m")
    width = check.positive("width", width, "m")
    if check.positive("height", height, "m") > width:
        raise ValueError(f"height must be at most the width, {width:g} m, got {height:g} m")
    density, speed = _air(air)
    rate, audible = _audible(response, rate)
    audible &= modes.omega * 0.5 * width <= arrivals.COMPACT * speed
    orders, way = arrivals.dipoles(response, audible, place, width, speed, rate)
    times = _times(response, audible, duration, rate)
    pressure = arrivals.pressure(response, times, audible, orders, way / speed, 1.0 / rate)  # of 1 kg/m
    flat = density * np.pi * width**2 / 4.0  # [kg/m]
    masses = flat, arrivals.SQUARE * flat + density * width * height
    low, high = (_scaled(mass * pressure, rate, LOUDEST, "Pa") for mass in masses)
    return low, high


@check.typed
def radiate_free(
    response: Response | Strokes,
    listener: Any,
    *,
    duration: float | None = None,
    rate: int = RATE,
    air: tuple[float, float] = (DENSITY, SPEED),
) -> tuple[Sound, Sound]:
    """Sound pressure of a plate in free air, without a baffle: an estimate from below and one from above.

    Parameters
    ----------
    response : Response or Strokes of a plate of any outline
    listener : array_like, shape (3,) [m]
        Position; the third coordinate is the distance from the plate's plane, positive on the side it moves to.
    duration, rate : as in `synthesise`
    air : density [kg/m^3] and speed of sound [m/s]

    Returns
    -------
    low, high : Sound
        For equal motion the pressure of each mode lies between them: so it did at three places beside 46 free plates
        whose edges run across the lattice. Where a mode is hardly audible, beside its lobes, ``low`` may be silent.

    Notes
    -----
    The plate is a sheet of dipoles, whose strength is the jump of the pressure across it. Every mode has that at its
    own frequency, half way between the jumps of a plate that is too small and one that is too large by up to a cell of
    a lattice (`modes.free_air`), for any wavelength; larger cells estimate its error. In time it follows the mode's
    acceleration with its part in phase and the velocity with the rest, which is exact as the mode rings. Left out are
    rigid motions, modes after about the 800th, and those whose sound has a wavelength below a sixteenth of the side of
    a square as large as the plate.

    Unlike a rigid disk, whose low sound in free air is far below that in a wall, a plate of many lobes may be louder
    without the wall: `radiate` bounds neither from above nor from below. A curved plate radiates as if it were flat,
    which neither sound covers; see `radiate`.

    References
    ----------
    Pierce, Acoustics (1989), chapters 4 and 5.

    Examples
    --------
    >>> drum = fi.analytic.disk(0.15, edge="clamped", mass=0.3, first_frequency=120.0, n_modes=6, damping_ratio=0.01)
    >>> hit = fi.strike(drum, fi.Striker.rigid(0.03), fi.Contact.linear(1e5), at=(0.04, 0.0), speed=1.0, tolerance=1e-2)
    >>> low, high = fi.sound.radiate_free(hit, (0.0, 0.0, 1.0), duration=0.1)
    >>> high.level < fi.sound.radiate(hit, (0.0, 0.0, 1.0), duration=0.1).level - 3.0  # dB
    True
    """
    modes = response.target
    if modes.dimension != 2 or not modes.continuous:
        raise ValueError(
            "response must be that of a plate whose shapes are known everywhere; use radiate_bar for a beam"
        )
    place = beside(listener)
    density, speed = _air(air)
    rate, audible = _audible(response, rate)
    audible &= free_air.reach(modes, speed) <= free_air.ACROSS[-1]
    field, doubt = free_air.fields(modes, audible, place, speed, speed / (arrivals.OVERSAMPLING * rate))
    times = _times(response, audible, duration, rate)
    own, less, more = (
        density / LOUDEST * arrivals.pressure(response, times, audible, orders, way / speed, 1.0 / rate)
        for orders, way in (field, *doubt)
    )
    return Sound(own - less, rate, LOUDEST, "Pa"), Sound(own + more, rate, LOUDEST, "Pa")


def beside(listener: Any) -> np.ndarray:
    """Check the coordinates (3,) [m] of a listener, which must lie off the plate's plane."""
    place = check.array("listener", listener, (3,), "m")
    if not abs(place[2]) >= 1e-6:
        raise ValueError(
            f"listener must lie off the plate's plane, got a third coordinate of {place[2]:g} m; give a distance"
        )
    return place


def _audible(response: Response | Strokes, rate: int) -> tuple[int, np.ndarray]:
    rate = check.count("rate", rate, high=HIGHEST_RATE)
    if doubt := promise.doubt_of_sound(response, 0.5 * rate):
        promise.warn(doubt)
    return rate, (response.target.omega > 0.0) & (response.target.omega < np.pi * rate)


def _air(air: Any) -> tuple[float, float]:
    """Density [kg/m^3] and speed of sound [m/s], checked."""
    density, speed = (check.positive("air", x) for x in check.array("air", air, (2,)))
    return density, speed


def _times(response: Response | Strokes, audible: np.ndarray, duration: float | None, rate: int) -> np.ndarray:
    """Times [s] of all samples in a duration [s]; without one, chosen from the decay after the last stroke."""
    if duration is None:
        duration = sampling.ringing_time(response.target, audible, (SHORTEST, LONGEST))
        duration += 0.0 if isinstance(response, Response) else float(response.starts[-1] - response.starts[0])
    # so many samples take about ten seconds to compute
    duration = check.between("duration", check.positive("duration", duration, "s"), 0.0, 1e7 / rate, "s")
    return response.time[0] + np.arange(max(1, round(duration * rate))) / rate
