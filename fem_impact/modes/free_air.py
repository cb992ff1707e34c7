"""The air around a plate without a baffle: how the pressure jumps across it as each mode vibrates.

Without a wall the air flows around the edge, and the plate is a sheet of dipoles. Their strength is the jump m of the
pressure from the back to the front, which is zero at the edge. For an acceleration a of frequency omega = k c it solves

    double integral of G (grad m . grad s - k**2 m s) = rho integral of a s   for all s that are zero at the edge,

with G = exp(i k R) / (4 pi R). On a square lattice both integrals are convolutions (fast Fourier transforms), and the
inverse of the whole lattice's operator makes a few iterations enough. Cells at the edge are cut by it: counting those
whose centre lies on the plate makes it too large, since m vanishes only at the next centre; leaving these out makes it
too small. At rest (k = 0) both are proper bounds of the energy in the air, up to the lattice's own error.

References
----------
Nedelec (2001), Acoustic and Electromagnetic Equations, section 3.4 (the variational form); Lamb (1932), Hydrodynamics,
section 102 (a disk, whose jump is 4 rho a sqrt(radius**2 - r**2) / pi at rest).
"""

import logging
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.fft import fft2, ifft2, next_fast_len
from scipy.ndimage import binary_erosion
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, gmres

from .._base.check import SimulationError
from .._base.rounding import EPSILON
from ..mesh.meshes import sizes
from .modal import Modes
from .shapes import Shapes, surface_of

LOG = logging.getLogger(__name__)
# [-] cells per wavelength of the highest mode, and of its sound; in `air`, two sizes are extrapolated
PER_WAVE = 8.0
# [-] cells across a square as large as the plate, in the lattices to choose of: next ones are 1.8 to 2.3 times as large
ACROSS = 48.0, 64.0, 96.0, 128.0
LARGER = 2.0**0.5  # [-] of the cells of a second solution that estimates the error: half as many
ROOM = 3.0  # [-] half the width of an estimate over the difference that estimates its error
# [-] relative, of the solved equations: a thirtieth of what a bound states at least; smaller parts of the operator are
# not inverted either, which only speeds up the solution
RESIDUAL = 3e-3


class Jumps(NamedTuple):
    """Pressure jumps of some modes on one lattice, for unit modal acceleration and a density of 1 kg/m^3."""

    modes: np.ndarray  # (n,) which modes
    points: np.ndarray  # (n_cells, 2) [m] centres of the cells
    size: float  # [m] side of a cell
    inner: np.ndarray  # (n_cells, n) [m kg**-0.5] of the plate without the cells along its edge
    outer: np.ndarray  # (n_cells, n) of the plate and the space to the next centres around it

    @property
    def mean(self) -> np.ndarray:
        """Half way between both, (n_cells, n) [m kg**-0.5], as the plate's edge lies between theirs."""
        return 0.5 * (self.inner + self.outer)

    def bounds(
        self, larger: "Jumps", place: np.ndarray, omega: np.ndarray, speed: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pressure of every mode at a place (3,) [m], by `mean`, and the half width of the estimate, (n,) each.

        In m kg**-0.5 Pa per kg/m^3 and m/s^2: for a density of 1 kg/m^3 and unit modal acceleration at the frequencies
        omega (n,) [rad/s]. The half width is `ROOM` times the difference from the ``larger`` cells, where the listener
        is and over the half space in front, as one place may agree by chance; it is at least a tenth of the mode's mean
        sound over all directions, as where that nearly cancels (test_free_air.py). Half the difference of `inner` and
        `outer` would be none at sharp corners and notches, where both err alike.
        """
        middle = np.append(0.5 * (self.points.min(axis=0) + self.points.max(axis=0)), 0.0)
        far = max(float(np.linalg.norm(place - middle)), float(np.linalg.norm(np.ptp(self.points, axis=0))))
        number = np.arange(12) + 0.5
        up, angle = number / 12, np.pi * (1.0 + np.sqrt(5.0)) * number  # a spiral of the golden ratio, evenly spread
        across = np.sqrt(1.0 - up**2)
        places = [place, *(middle + far * np.stack([across * np.cos(angle), across * np.sin(angle), up], axis=1))]
        own, other = (each._pressures(places, omega, speed) for each in (self, larger))
        half = np.abs(own - other)
        apart = np.maximum(half[0], np.sqrt((half[1:] ** 2).mean(axis=0)))
        return own[0], ROOM * apart + 0.1 * np.sqrt((np.abs(own[1:]) ** 2).mean(axis=0))

    def _pressures(self, places: list[np.ndarray], omega: np.ndarray, speed: float) -> np.ndarray:
        """Pressure of every mode at places (3,) [m] each, (n_places, n), in the units of `bounds`."""
        found = []
        for each in places:
            way = np.sqrt(((self.points - each[:2]) ** 2).sum(axis=1) + each[2] ** 2)
            turn = 1j * np.outer(way, omega / speed)
            near = each[2] * self.size**2 / (4.0 * np.pi * way**3)
            found.append(np.einsum("cn,cn->n", near[:, None] * (1.0 - turn) * np.exp(turn), self.mean))
        return np.array(found)


def reach(modes: Modes, speed: float) -> np.ndarray:
    """Cells across a square as large as the plate that each mode needs, (n_modes,) [-]; rigid motions get zero."""
    side = np.sqrt(sizes(*modes.shapes.grid()).sum())
    number = np.arange(1, modes.n_modes + 1)  # its wavelength, by Weyl's law
    wave = np.maximum(np.sqrt(4.0 * np.pi * number) / side, modes.omega / speed)  # [1/m]
    return np.where(modes.omega > 0.0, np.maximum(PER_WAVE * wave * side / (2.0 * np.pi), ACROSS[0]), 0.0)


def jumps(modes: Modes, wanted: np.ndarray, speed: float) -> Iterator[tuple[Jumps, Jumps]]:
    """The jumps of the wanted modes, each at its own frequency, on lattices as fine as they need, and on larger cells.

    These are `LARGER`; the difference estimates the error.
    """
    needed = reach(modes, speed)
    side = np.sqrt(sizes(*modes.shapes.grid()).sum())
    for coarser, across in zip((0.0, *ACROSS), ACROSS):
        some = np.flatnonzero(wanted & (needed > coarser) & (needed <= across))
        if some.size:
            size = float(side / across)
            LOG.info("the air around %d modes, on cells of %.3g m", some.size, size)
            yield _solved(modes, some, size, speed), _solved(modes, some, LARGER * size, speed)


def _solved(modes: Modes, some: np.ndarray, size: float, speed: float) -> Jumps:
    """The jumps of some modes (n,), in ascending order, on cells of a size [m]."""
    points, inside = lattice(modes.shapes, size)
    shapes = surface_of(modes.shapes.take(int(some[-1]) + 1), points[inside])[:, some]
    core = binary_erosion(inside)
    sheets = AirSheet(core, size), AirSheet(inside, size)
    solved = [
        np.stack([sheet.jump(shape, omega / speed) for shape, omega in zip(rows.T, modes.omega[some])], axis=1)
        for sheet, rows in zip(sheets, (shapes[core[inside]], shapes))
    ]
    inner = np.zeros(solved[1].shape, complex)
    inner[core[inside]] = solved[0]
    return Jumps(some, points[inside], size, inner, solved[1])


def loads(modes: Modes, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Mass that air of 1 kg/m^3 adds to each mode, and damping ratio by its sound: (n_modes, 2) and half the width.

    The half width is `ROOM` times half the difference of `Jumps.inner` and `Jumps.outer` or, where that is more, of the
    cells and larger ones. Both are zero of modes that no lattice is fine enough for.
    """
    middle, half = np.zeros((2, modes.n_modes, 2))
    for part, larger in jumps(modes, reach(modes, speed) <= ACROSS[-1], speed):
        (own, apart), (other, _) = (_pressed(modes, each) for each in (part, larger))
        middle[part.modes] = own
        half[part.modes] = ROOM * np.maximum(np.abs(apart), np.abs(own - other))
    return middle, half


def _pressed(modes: Modes, part: Jumps) -> tuple[np.ndarray, np.ndarray]:
    """What `loads` finds by the mean of the lattices, and half their difference, (n, 2) each."""
    shapes = surface_of(modes.shapes.take(int(part.modes[-1]) + 1), part.points)[:, part.modes]
    both = [part.size**2 * (shapes * jump).sum(axis=0) for jump in (part.mean, 0.5 * (part.outer - part.inner))]
    mean, apart = (np.column_stack([each.real, 0.5 * each.imag]) for each in both)
    return mean, apart


class AirSheet:
    """Cells of a square lattice that make up a plate.

    Parameters
    ----------
    inside : ndarray of bool, shape (nx, ny)
    size : float [m]
        Side of a cell.
    """

    def __init__(self, inside: np.ndarray, size: float) -> None:
        self.inside, self.size = inside, size
        nx, ny = (next_fast_len(2 * n + 2) for n in inside.shape)  # room for the next centres
        self.padded = nx, ny
        self.distance, self.inverse = between_cells(self.padded, size)
        turns = (np.cos(2.0 * np.pi * np.arange(n) / n) for n in self.padded)
        self.slopes = (4.0 - 2.0 * np.add.outer(*turns)) / size**2  # (padded) [1/m^2] of a wave on the lattice, squared

    def jump(self, acceleration: np.ndarray, wave: float) -> np.ndarray:
        """Jump (n_cells,) [Pa] for an acceleration (n_cells,) [m/s^2] in air of 1 kg/m^3 and a wavenumber [1/m]."""
        if not acceleration.any():
            return np.zeros(acceleration.shape, complex)
        apart = np.where(self.distance > 0.0, self.distance, 1.0)
        swing = np.where(self.distance > 0.0, np.expm1(1j * wave * self.distance) / apart, 1j * wave)
        operator = fft2((self.inverse + swing) * self.size**4 / (4.0 * np.pi)) * (self.slopes - wave**2)
        least = RESIDUAL * np.abs(operator).max()
        inverse = 1.0 / np.where(np.abs(operator) > least, operator, least)
        nx, ny = self.inside.shape

        def apply(factor: np.ndarray, values: np.ndarray) -> np.ndarray:
            """An operator of the whole lattice on values on the plate, (n_cells,)."""
            field = np.zeros((nx, ny), complex)
            field[self.inside] = np.ravel(values)
            return ifft2(fft2(field, self.padded) * factor)[:nx, :ny][self.inside]

        square = 2 * acceleration.shape
        whole, rough = (LinearOperator(square, partial(apply, each), dtype=complex) for each in (operator, inverse))
        load = acceleration.astype(complex) * self.size**2
        found, failed = gmres(whole, load, rtol=RESIDUAL, M=rough, restart=50, maxiter=8)  # ten iterations are usual
        if failed:
            raise SimulationError("the air around the plate was not solved for in 400 iterations")
        return found


class Field(NamedTuple):
    """What reaches a listener from modes: derivatives of their amplitudes, delayed by a way through the air."""

    orders: dict[int, np.ndarray]  # order of derivative -> (n_ways, n) weights, for 1 kg/m^3
    way: np.ndarray  # (n_ways,) [m]


def fields(
    modes: Modes, wanted: np.ndarray, place: np.ndarray, speed: float, step: float
) -> tuple[Field, tuple[Field, Field]]:
    """The field of the wanted modes at a place (3,) [m], and what to take from it and to add to it as its bounds.

    Ways are rounded to multiples of ``step`` [m] by shares of their two neighbours. As a mode rings, the field has its
    pressure by `Jumps.mean`, and the others in phase with it the half width of that estimate, taken away at most to
    silence. An acceleration gives the part of a jump in phase with it, a velocity the rest. Nearer than two of the
    coarsest cells, single cells would be audible.
    """
    grid = modes.shapes.grid()[0]
    low, high = grid.min(axis=0), grid.max(axis=0)
    nearest = float(np.linalg.norm(place - np.append(np.clip(place[:2], low, high), 0.0)))
    least = 2.0 * np.sqrt(sizes(*modes.shapes.grid()).sum()) / ACROSS[0]
    if nearest < least:
        raise ValueError(f"listener must be at least {least:.3g} m from a plate in free air, got {nearest:.3g} m")
    column = np.cumsum(wanted) - 1
    middle = float(np.linalg.norm(place - np.append(0.5 * (low + high), 0.0)))
    across, count = float(np.linalg.norm(high - low)), int(wanted.sum())
    shortest = int(max(0.0, middle - across) / step)
    n_ways = int((middle + across) / step) + 2 - shortest if count else 1
    own = {order: np.zeros((n_ways, count)) for order in (1, 2, 3)}
    bounds = [{order: np.zeros((1, count)) for order in (1, 2)} for _ in range(2)]
    for part, larger in jumps(modes, wanted, speed):
        omega, here = modes.omega[part.modes], column[part.modes]
        way = np.sqrt(((part.points - place[:2]) ** 2).sum(axis=1) + place[2] ** 2)
        share, first = np.modf(way / step)
        rows, cells = np.concatenate([first, first + 1.0]).astype(int) - shortest, np.tile(np.arange(len(way)), 2)
        gather = csr_array((np.concatenate([1.0 - share, share]), (rows, cells)), (n_ways, len(way)))
        near = (place[2] * part.size**2 / (4.0 * np.pi * way**3))[:, None]
        far = near * way[:, None] / speed
        steady, turned = part.mean.real, omega * part.mean.imag
        for order, weights in ((1, near * turned), (2, near * steady + far * turned), (3, far * steady)):
            own[order][:, here] = gather @ weights
        pressure, half = part.bounds(larger, place, omega, speed)
        for bound, size in zip(bounds, (np.minimum(half, np.abs(pressure)), half)):
            strength = size * np.exp(1j * (np.angle(pressure) - omega * middle / speed))
            bound[1][0, here], bound[2][0, here] = omega * strength.imag, strength.real
    some = np.any([weights.any(axis=1) for weights in own.values()], axis=0)
    some[0] |= not some.any()
    field = Field(
        {order: weights[some] for order, weights in own.items()},
        np.multiply(shortest + np.flatnonzero(some), step, dtype=np.float64),
    )
    less, more = (Field(bound, np.array([middle])) for bound in bounds)
    return field, (less, more)


def lattice(shapes: Shapes, size: float, period: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Centres (nx, ny, 2) [m] of square cells around a body, and whether each lies on it; multiples of a period."""
    corner = shapes.grid()[0]
    low, high = corner.min(axis=0), corner.max(axis=0)
    count = period * np.ceil((high - low) / (period * size)).astype(int)
    axes = (0.5 * (low[i] + high[i] + size * (1.0 - count[i])) + size * np.arange(count[i]) for i in (0, 1))
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return places, shapes.contains(places.reshape(-1, 2)).reshape(count)


def between_cells(padded: tuple[int, int], size: float) -> tuple[np.ndarray, np.ndarray]:
    """Distance [m] between cells of a lattice, and the mean of 1 / R [1/m] between their points, (padded) each."""
    x, y = np.abs(np.meshgrid(*(np.arange(-1.0, n // 2 + 2.0) for n in padded), indexing="ij"))  # in steps
    distance = np.hypot(x, y)
    one = np.where(x > 0.0, x, 1.0), np.where(y > 0.0, y, 1.0)
    whole = 0.5 * x * y * (y * np.arcsinh(x / one[1]) + x * np.arcsinh(y / one[0])) - distance**3 / 6.0
    for axis in (0, 1):  # the fourth derivative by both coordinates, twice each, is 1 / R
        whole = np.diff(whole, 2, axis=axis)
    distance = distance[1:-1, 1:-1]
    far = 0.5 * EPSILON ** (-1 / 6)  # rounding, 3 EPSILON R**4, then exceeds what the centres miss, R**-2 / 12
    nearest = np.where(distance > far, 1.0 / np.maximum(distance, 1.0), whole)
    steps = np.meshgrid(*(np.minimum(np.arange(n), n - np.arange(n)) for n in padded), indexing="ij")
    return size * np.hypot(*steps), nearest[steps[0], steps[1]] / size
