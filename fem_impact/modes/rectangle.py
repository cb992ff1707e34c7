"""Modes of a hinged rectangle: sines, with the static deflection as a sum over images of infinite strips."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import special

from .._base import check
from .._base.rounding import EPSILON
from ..fe import plausible
from ..fe.section import Plate
from .modal import Damping, Modes
from .request import check_number, request
from .shapes import ClosedShapes, gauss

# [-] fact: image forces beyond each shorter side of a hinged plate until rounding, as the n-th gives exp(-2 pi n)
IMAGES = math.ceil(-math.log(EPSILON) / (2.0 * np.pi))
POWERS = np.append(2, np.arange(3, 60, 2))  # [-] fact: exponents of these series; all other coefficients are zero
SERIES: np.ndarray = (
    (-1.0) ** POWERS * special.bernoulli(60)[POWERS - 1] / (POWERS - 1.0) / special.factorial(POWERS)
)  # zeta(2-k)/k!
MOST_MODES = 1_000_000  # [-] largest number of modes of a rectangle or beam; they take a few seconds


@dataclass(frozen=True, eq=False, repr=False)
class RectangleShapes(ClosedShapes, check.Brief):
    """Sine shapes of a hinged rectangle of unit mass and rigidity with one corner at the origin."""

    length: float  # [m]
    width: float  # [m]
    numbers: np.ndarray  # (n_modes, 2) half waves along length and width

    def at(self, points: np.ndarray) -> np.ndarray:
        phase = np.pi * points / (self.length, self.width)  # (n_points, 2)
        along, across = (  # modes share their half waves: a sine for each number
            np.sin(np.outer(angle, np.arange(number.max() + 1)))[:, number]
            for angle, number in zip(phase.T, self.numbers.T)
        )
        return np.asarray(2.0 * along * across)

    def slopes(self, points: np.ndarray) -> np.ndarray:
        """Slopes (n, n_q, 2, n_modes) at points (n, n_q, 2)."""
        wave = np.pi * self.numbers / (self.length, self.width)
        x, y = points[..., :1] * wave[:, 0], points[..., 1:] * wave[:, 1]
        return 2.0 * np.stack([wave[:, 0] * np.cos(x) * np.sin(y), wave[:, 1] * np.sin(x) * np.cos(y)], 2)

    def contains(self, points: np.ndarray) -> np.ndarray:
        slack = 1e-9 * max(self.length, self.width)
        inside = (points >= -slack) & (points <= np.array([self.length, self.width]) + slack)
        return np.asarray(inside.all(axis=1))

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Sum of closed-form deflections of an infinite hinged strip; images make the shorter sides hinged.

        In a strip of unit width and rigidity each force adds the sum over m of 2 sin(m pi place) sin(m pi load) (1 + z)
        exp(-z) / (4 (m pi)**3), z = m pi times the distance along the strip. This is a difference of polylogarithms in
        which the constant and linear terms cancel.
        """
        sides = np.array([self.length, self.width])
        across, along = (1, 0) if self.width < self.length else (0, 1)  # the strip runs along the longer sides
        scale = sides[across]
        place, load = points[:, None, None] / scale, loads[None, :, None] / scale  # (n_points, n_loads, n_images, 2)
        images = 2.0 * sides[along] / scale * np.arange(-IMAGES, IMAGES + 1)
        shift = np.stack([place[..., along] + sign * load[..., along] + images for sign in (-1.0, 1.0)])
        x = np.pi * np.abs(shift)
        apart, far = (np.pi * np.abs(place + sign * load)[..., across] for sign in (-1.0, 1.0))
        angles = np.stack(np.broadcast_arrays(apart, np.minimum(far, 2.0 * np.pi - far), x)[:2])
        near, far = _decaying_cosines(np.broadcast_to(x, angles.shape), angles)
        once, mirrored = (near - far).sum(axis=-1) / (4.0 * np.pi**3)
        inside, loaded = ((np.minimum(at, sides - at) > 0.0).all(axis=1) for at in (points, loads))
        return np.where(inside[:, None] & loaded, scale**2 * (once - mirrored), 0.0)

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        return _rectangle_grid(self.length, self.width)

    def quadrature(self, wave: float) -> tuple[np.ndarray, np.ndarray]:
        (x, dx), (y, dy) = gauss(self.length, wave), gauss(self.width, wave)
        return np.column_stack([np.repeat(x, len(y)), np.tile(y, len(x))]), np.outer(dx, dy).reshape(-1)


@lru_cache(maxsize=4)  # [-] rectangles; a gradient asks for one several times
def _rectangle_grid(length: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Points [m] and triangles over a rectangle."""
    n = (48, 32)
    x, y = np.meshgrid(np.linspace(0, length, n[0] + 1), np.linspace(0, width, n[1] + 1), indexing="ij")
    node = np.arange(x.size).reshape(x.shape)
    a, b, c, d = node[:-1, :-1].ravel(), node[1:, :-1].ravel(), node[1:, 1:].ravel(), node[:-1, 1:].ravel()
    found = np.column_stack([x.ravel(), y.ravel()]), np.vstack([np.c_[a, b, c], np.c_[a, c, d]])
    for each in found:
        each.setflags(write=False)
    return found


def _decaying_cosines(x: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Sum over m of cos(m angle) (1 + m x) exp(-m x) / m**3, without the part that does not depend on the angle.

    The sum is Re Li3(exp(mu)) + x Re Li2(exp(mu)), mu = -x + i angle, for angles from 0 to pi and x >= 0.

    References
    ----------
    Wood (1992), The computation of polylogarithms, eq. 9.3, for the power series about mu = 0.
    """
    result = np.empty(x.shape)
    near = x < 1.0  # where the power series falls as (x / 2 pi)**n, beyond as exp(-n x)
    gap, u = x[near], -x[near] + 1j * angle[near]
    log = np.log(np.where(u == 0.0, 1.0, -u))
    powers = np.empty((len(POWERS), len(u)), complex)  # by products, many times as fast as by powers
    powers[0], powers[1] = u**2, u**3
    powers[2:] = u**2
    np.multiply.accumulate(powers[1:], out=powers[1:])
    series = gap * (SERIES @ powers) + u * ((SERIES / (POWERS + 1.0)) @ powers)
    result[near] = (0.5 * u**2 * (1.5 - log) + gap * u * (1.0 - log) + series).real
    octave = np.floor(np.log2(np.where(near, 1.0, x)))
    for each in np.unique(octave[~near]):
        part = ~near & (octave == each)  # where terms fall at least as exp(-m 2**each), to rounding
        m, gap = np.arange(1.0, math.ceil(-math.log(EPSILON) / 2.0**each) + 1.0)[:, None], x[part]
        waves = np.empty((len(m), 2, len(gap)), complex)
        waves[:, 0], waves[:, 1] = np.exp(-gap + 1j * angle[part]), np.exp(-gap)
        waves = np.multiply.accumulate(waves).real
        result[part] = ((1.0 + m * gap) * (waves[:, 0] - waves[:, 1]) / m**3).sum(axis=0)
    return result


def rectangle(
    length: float,
    width: float,
    *,
    mass: float | None = None,
    first_frequency: float | None = None,
    section: Any = None,
    n_modes: int | None = None,
    max_frequency: float | None = None,
    damping_ratio: Damping = 0.0,
) -> Modes:
    """Modes of a hinged (simply supported) rectangular Kirchhoff plate with corners (0, 0) and (length, width) [m].

    Parameters
    ----------
    length, width : float [m]
    mass, first_frequency : float [kg], [Hz]
        Give both of these, or a section.
    section : Plate, isotropic and of constant thickness
    n_modes : int, or max_frequency : float [Hz]
    damping_ratio : float, array (n_modes,) or function of frequency [Hz]

    Returns
    -------
    Modes, with frequencies exact to rounding

    Raises
    ------
    ValueError
        If a size is not positive, or if both or neither of two alternatives are given.

    References
    ----------
    Leissa (1969), Vibration of plates, NASA SP-160, eq. 4.20; Timoshenko and Woinowsky-Krieger, art. 35 (static sum).

    Examples
    --------
    >>> modes = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=3)
    >>> modes.frequencies.round(2).tolist()
    [100.0, 188.17, 311.83]
    """
    length, width = check.positive("length", length, "m"), check.positive("width", width, "m")
    asked = request(
        section, Plate, length * width, mass=mass, first_frequency=first_frequency,
        n_modes=n_modes, max_frequency=max_frequency, damping_ratio=damping_ratio,
    )  # fmt: skip
    # with unit mass and unit D the mass per area is 1 / area, so omega = wavenumber**2 * sqrt(area)
    root_area = np.sqrt(length * width)

    def omega(m, n):
        return np.pi**2 * ((m / length) ** 2 + (n / width) ** 2) * root_area

    count, reach = asked.count(float(omega(1, 1)), MOST_MODES)
    if not np.isfinite(reach):  # start from Weyl's law, then raise the limit until there are enough modes
        reach = 4.0 * np.pi * (count + 2.0) / root_area
        while _lattice(length, width, reach / root_area, count)[0].size < count:
            reach *= 1.3
    m, n = _lattice(length, width, reach / root_area, count)
    check_number(min(len(m), count), MOST_MODES, length=length, width=width)
    order = np.lexsort((n, m, omega(m, n)))[:count]
    if not order.size:
        raise ValueError(f"max_frequency must reach the first mode, got {max_frequency:g} Hz")
    numbers = np.column_stack([m[order], n[order]])
    values = omega(*numbers.T) ** 2
    notes = plausible.doubted_sizes((length, width), section)
    shapes = RectangleShapes(length, width, numbers)
    return asked.answered(shapes, values, notes)


def _lattice(length: float, width: float, wavenumber_squared: float, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Half-wave numbers (m, n), each at most ``most``, with wavenumber**2 up to ``wavenumber_squared`` [1/m^2]."""
    limit = wavenumber_squared * (1.0 + 1e-12)
    size = [int(min(most, side * np.sqrt(limit) / np.pi + 1.0)) for side in (length, width)]
    if size[0] * size[1] > 4 * MOST_MODES:  # more than `rectangle` tries for as many modes as are allowed
        check_number(size[0] * size[1], MOST_MODES, length=length, width=width)
    m, n = (grid.ravel() for grid in np.meshgrid(*(np.arange(1, k + 1) for k in size), indexing="ij"))
    keep = np.pi**2 * ((m / length) ** 2 + (n / width) ** 2) <= limit
    return m[keep], n[keep]
