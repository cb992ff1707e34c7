"""Air around a plate: the mass that it adds to every mode, and the damping by the sound that it carries away.

A plate in a rigid baffle presses on each side with the Rayleigh integral of its velocity. Between two mass-normalised
shapes this is, on one side,

    Z_jk = (rho / 2 pi) (omega**2 C_jk - i omega S_jk),   C_jk - i S_jk = double integral of w_j w_k exp(-i k R) / R,

with k = omega / c: C makes the plate heavier and S takes energy away. The modes in air solve

    (diag(omega_j**2) - Omega**2 (1 + M(Omega))) q = 0,   M = sides rho C / (2 pi),

each at its own frequency, together with its neighbours. Their static deflections are those in vacuum, because still air
carries no load. The power radiated adds sides rho q' S q / (4 pi) to the damping ratio of a mode.

The integrals are convolutions on a grid of square cells, in which a shape counts by its mean (fast Fourier transforms,
zero padding). The kernel between cells is exact for 1 / R, integrated over both cells, and takes the rest at their
centres. In frequency they are interpolated from as many Chebyshev nodes as rounding takes.

References
----------
Rayleigh (1896), The Theory of Sound, sections 278 and 302; Wallace (1972), J. Acoust. Soc. Am. 51, 946-952 (radiation
of hinged rectangles); Christian, Davis, Tubis, Anderson, Mills and Rossing (1984), J. Acoust. Soc. Am. 76, 1336-1345
(drumheads, whose low frequencies the air sets).
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.interpolate import BarycentricInterpolator
from scipy.linalg import block_diag, eigh
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.special import jv

from .._base import check
from .._base.rounding import HALVINGS, SAME
from .._base.threads import one_thread
from ..fe import plausible
from .free_air import PER_WAVE, between_cells, lattice, loads
from .modal import Modes
from .shapes import ScaledShapes, Shapes, surface_of

DENSITY, SPEED = 1.204, 343.2  # [kg/m^3], [m/s] fact: of air at 20 degrees C and 1013 hPa
SAMPLES = 2, 3  # [-] points across a cell over which a shape is averaged, fine and coarse: both use one set of points
GAIN = (SAMPLES[1] / SAMPLES[0]) ** 2 - 1.0  # [-] fact: the coarse error less the fine one, over the fine one
# [-] modes solved at the same few frequencies, and modes beside it that air may mix in: far ones swing too differently
BLOCK = 24
# [-] waves in a plate over those of sound, as long as which modes are not solved for, and how much of the damping by
# plane waves the last ones solved for may be off that
PLANE = 2.0, 0.3


@check.typed
@one_thread
def in_air(
    modes: Modes, *, density: float = DENSITY, speed: float = SPEED, sides: int = 2, baffled: bool = True,
    finer: float = 1.0,
) -> Modes:  # fmt: skip
    """The modes of a plate surrounded by air: lower frequencies, and damping by the sound radiated.

    Parameters
    ----------
    modes : Modes
        In vacuum, with shapes known everywhere on a plate. Air mixes them; those left out get no air. To the air, a
        curved plate is flat.
    density : float [kg/m^3]
    speed : float [m/s]
        Of sound.
    sides : {1, 2}
        Sides of the plate that face open air; a box behind one of them is not modelled.
    baffled : bool
        Whether the plate fills a hole in a large rigid wall. Without the wall air flows around the edge. Half the
        added mass is taken and no damping is added: the shift and the damping with the wall become the errors or, where
        they are larger, those of a sheet of dipoles (see `sound.radiate_free`) or, with air on one side, in front of a
        flat box.
    finer : float [-]
        How many times smaller the cells of the grid are than usual, from 1 to 4, as far as 1e8 numbers allow: errors
        shrink with their area.

    Returns
    -------
    Modes
        With `frequency_error` from a second grid of cells, with which frequencies are extrapolated, and from the area
        that the grids miss at the rim; with `damping_error` in the same way. Modes that outrun sound by far radiate
        like plane waves; their errors are how far the slowest of them are from that. Rigid motions and damping ratios
        given before stay; that the added mass changes with frequency is kept in the frequencies, not in the amplitudes.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(0.465, 0.3, mass=0.19, first_frequency=105.0, n_modes=20)
    >>> loud = fi.in_air(plate)
    >>> bool(loud.frequencies[0] < 100.0), bool(loud.damping_ratio[0] > 0.001)
    (True, True)
    """
    density, speed = check.positive("density", density, "kg/m^3"), check.positive("speed", speed, "m/s")
    if check.count("sides", sides) > 2:
        raise ValueError(f"sides must be 1 or 2, got {sides}")
    if modes.dimension != 2 or not modes.continuous:
        raise ValueError("in_air needs the modes of a plate whose shapes are known everywhere")
    if modes.n_modes == modes.n_rigid:
        return modes
    finer = check.between("finer", finer, 1.0, 4.0)
    how: dict[str, Any] = {"density": density, "speed": speed, "sides": sides, "baffled": baffled, "finer": finer}
    poorer = {cause: in_air(other, **how) for cause, other in modes.poorer.items()}
    share, solved, count = 1.0 if baffled else 0.5, None, _count_slow(modes, speed)
    while solved is None:
        solved = _solved(modes, count, density * sides * share / (2.0 * np.pi), speed, finer)
        count = min(2 * count, modes.n_modes)
    omega, mix, doubt, radiated, unsure = solved
    heavier = modes.omega[modes.n_rigid :] / omega - 1.0
    side = "both sides" if sides == 2 else "one side"
    note = f"air of {density:g} kg/m^3 on {side}, with a rigid wall around the plate"
    if not baffled:
        own, part = np.zeros((2, len(omega))), 1.0
        if sides == 1:  # in front of a flat box, half as in a wall and half as a sheet that moves half as fast
            own, part = np.stack([heavier * (2.0 + heavier), radiated]), 0.25
        doubt, unsure, radiated = doubt + heavier, unsure + radiated / share, np.zeros(len(omega))
        # a free edge may radiate more than in a wall, and fast modes be heavier
        middle, half = (density * part * each[modes.n_rigid :].T for each in loads(modes, speed))  # (2, n) each
        for mass, lost in (own + middle - half, own + middle + half):
            bare = omega / modes.omega[modes.n_rigid :] * np.sqrt(np.maximum(0.0, 1.0 + mass))
            doubt, unsure = np.maximum(doubt, np.abs(bare - 1.0)), np.maximum(unsure, lost)
        note = f"air of {density:g} kg/m^3 on {side} adds half the mass that it would with a rigid wall around"
    order = np.argsort(omega, kind="stable")
    mix = block_diag(np.eye(modes.n_rigid), mix[:, order])
    rest = np.zeros(modes.n_rigid)
    omega, radiated, doubt, unsure = (np.append(rest, each[order]) for each in (omega, radiated, doubt, unsure))
    before = 0.0 if modes.frequency_error is None else modes.frequency_error
    return Modes(
        omega, modes.damping_ratio + radiated, ScaledShapes(modes.shapes, mix=mix), modes.mass, before + doubt,
        notes=plausible.together(modes.notes, (note,)), poorer=poorer, section=modes.section, thick=modes.thick,
        air=True, damping_error=unsure,
    )  # fmt: skip


def _count_slow(modes: Modes, speed: float) -> int:
    """How many modes are solved for in air: all but the last, which outrun sound.

    Of those a block, by which the others are judged.
    """
    area = float(modes.shapes.quadrature(0.0)[1].sum())
    number = np.arange(1, modes.n_modes + 1)  # its wavenumber is that of Weyl's law
    slow = np.flatnonzero(modes.omega < PLANE[0] * speed * np.sqrt(4.0 * np.pi * number / area))
    count = int(slow[-1]) + 1 + BLOCK if slow.size else 0
    return min(max(count, modes.n_rigid + 2 * BLOCK), modes.n_modes)


def _solved(modes: Modes, count: int, weight: float, speed: float, finer: float) -> tuple[np.ndarray, ...] | None:
    """Frequencies [rad/s], mixtures, errors, damping ratios by sound and their errors of the flexible modes in air.

    The first ``count`` are solved for. Those beyond push the air before them as a plane wave, without weight; None if
    the last ones solved for do not. ``weight`` as of `_Air`, ``finer`` as of `in_air`.
    """
    whole, modes = modes, modes.truncated(n_modes=count)
    rigid, spacing = modes.n_rigid, _spacing(modes, float(modes.shapes.quadrature(0.0)[1].sum()), speed, finer)
    points, sizes = modes.shapes.quadrature(2.0 * np.pi / (PER_WAVE * SAMPLES[0] * spacing))
    known = points, sizes, surface_of(modes.shapes, points)
    samples, missed = _sampled(modes.shapes, spacing, known)
    found, other = (_Air(modes, _strengths(samples, spacing, n), n * spacing, weight, speed) for n in SAMPLES)
    (omega, own), (lower, mixed) = found.solved(), other.solved()
    shift = lower / omega - 1.0
    rarer = SAMPLES[1] / SAMPLES[0] * spacing
    few = _strengths(_sampled(modes.shapes, rarer, known)[0], rarer, SAMPLES[0])
    sparse = _Air(modes, few, other.size, weight, speed)
    radiated, unsure = _extrapolated(
        found.damping(own, omega), sparse.damping(own, omega), other.damping(mixed, lower), missed[rigid:]
    )
    better = 1.0 - shift / GAIN  # the error of square cells shrinks with their area
    # the nearest mixtures (n, n) that together give the static deflections of the old modes
    turned, _, back = np.linalg.svd(own * (modes.omega[rigid:, None] / omega), full_matrices=False)
    mix = (turned @ back) / modes.omega[rigid:, None] * omega * better
    omega *= better
    # the two grids agree by chance where the shift changes its sign, so that no mode is surer than those below it
    heavier = modes.omega[rigid:] / omega - 1.0
    doubt = 1.5 * (np.maximum.accumulate(np.abs(shift)) + missed[rigid:] * np.abs(heavier))
    unsure = unsure + _mistaken(found, mix, omega, doubt)  # of a pair at one frequency both of `own` may be one
    if count == whole.n_modes:
        return omega, mix, doubt, radiated, unsure
    fast = slice(count - BLOCK, None)
    points, sizes = whole.shapes.quadrature(2.0 * np.sqrt(4.0 * np.pi * whole.n_modes / sizes.sum()))
    plane = np.pi * weight * speed / whole.omega[fast] * (sizes @ surface_of(whole.shapes, points)[:, fast] ** 2)
    over = radiated[-BLOCK:] / plane[:BLOCK] - 1.0  # the faster, the less
    apart, plane = float(np.abs(over).max()), plane[BLOCK:]
    if apart > PLANE[1]:
        return None
    heaviest = doubt[-1] + 2.0 * np.abs(heavier[-BLOCK:]).max()
    return (
        np.append(omega, whole.omega[count:]), block_diag(mix, np.eye(len(plane))),
        np.append(doubt, np.full(len(plane), heaviest)), np.append(radiated, (1.0 + 0.5 * over.mean()) * plane),
        np.append(unsure, (apart + (unsure / radiated)[-BLOCK:].max()) * plane),
    )  # fmt: skip


def _spacing(modes: Modes, area: float, speed: float, finer: float) -> float:
    """Distance [m] of the points at which shapes are sampled on a plate of an area [m^2].

    At least 24 cells lie across a square as large as the plate: those at the rim then cover a sixth of it.
    """
    # [1/m] of the highest mode, by Weyl's law, or of its sound
    wave = max(np.sqrt(4.0 * np.pi * modes.n_modes / area), modes.omega[-1] / speed)
    spacing = min(2.0 * np.pi / wave / PER_WAVE, np.sqrt(area) / 24.0) / SAMPLES[0]
    least = np.sqrt(modes.n_modes * area / 1e9)  # [m] as many numbers fit into memory
    if not least <= spacing:
        raise ValueError(
            f"speed of sound in the air must be higher or modes fewer, got {speed:g} m/s: {modes.n_modes} modes on a "
            f"grid for waves of {2.0 * np.pi / wave:.2g} m, the shortest of plate or sound, take more than 1e+09 "
            "numbers; leave air out, or take a larger tolerance or a smaller band"
        )
    return float(max(min(spacing, 10.0**0.5 * least), spacing / finer))


def _extrapolated(
    fine: np.ndarray, sparse: np.ndarray, coarse: np.ndarray, missed: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Damping ratios (n_flexible,) by sound from those on the fine grid, and their errors.

    ``sparse`` are those of the same mixtures, sampled at points as much farther apart as the cells are larger, so that
    all errors shrink with their area. ``coarse`` are those of the mixtures found on the coarse grid. What both change
    may agree by chance, so that no mode is surer, relative to its damping, than those below it. The true errors were at
    most 0.74 of those stated, of 113 plates, and of one 1.85 times.
    """
    some = np.maximum(fine, np.finfo(float).tiny)
    apart = [np.maximum.accumulate(np.abs(each - fine) / some) for each in (sparse, coarse)]
    return np.maximum(0.0, fine - (sparse - fine) / GAIN), 1.5 * (sum(apart) + missed) * fine


def _mistaken(air: "_Air", mix: np.ndarray, omega: np.ndarray, doubt: np.ndarray) -> np.ndarray:
    """Error (n,) of damping ratios by sound, as neighbours in frequency mix by angles that are not known exactly.

    ``doubt`` (n,) are the relative errors of the frequencies omega (n,): those of their difference turn two modes.
    """
    order, found = np.argsort(omega, kind="stable"), np.zeros(len(omega))
    for pair, source in zip(map(np.array, pairwise(order)), air.sources(mix[:, order], 2)):
        gap, apart = float(np.ptp(omega[pair]) / omega[pair[1]]), float(doubt[pair].sum())
        turn = min(1.0, 0.5 * apart / gap) if gap > 0.0 else 1.0
        lost = air.exchanged(source, float(omega[pair[1]]))
        found[pair] += 2.0 * turn * abs(lost[0, 1]) + turn**2 * abs(lost[0, 0] - lost[1, 1])
    return found


class _Air:
    """Radiation integrals between the modes of a plate on a grid of square cells.

    Parameters
    ----------
    modes : Modes
    strength : ndarray, shape (n_modes, nx, ny) [m^2 kg**-0.5]
        Integral of every shape over each cell.
    size : float [m]
        Side of a cell.
    weight : float [kg/m^3]
        Density times sides over 2 pi.
    speed : float [m/s]
    """

    def __init__(self, modes: Modes, strength: np.ndarray, size: float, weight: float, speed: float) -> None:
        self.size = size
        self.old, self.strength = modes.omega[modes.n_rigid :], strength[modes.n_rigid :]
        self.weight, self.speed = weight, speed
        nx, ny = strength.shape[1:]
        self.padded = next_fast_len(2 * nx - 1, True), next_fast_len(2 * ny - 1, True)
        self.distance, self.inverse = between_cells(self.padded, size)

    def _added(self, spectrum: np.ndarray, omega: float) -> np.ndarray:
        """Mass [-] (n, n) that air adds between sources of a spectrum (n, ...), at a frequency [rad/s]."""
        matrix = self._product(spectrum, self._pressing(omega))
        return 0.5 * self.weight * (matrix + matrix.T)

    def _pressing(self, omega: float) -> np.ndarray:
        """Kernel (padded) [1/m] of the added mass at a frequency [rad/s]."""
        away = np.divide(1.0, self.distance, out=np.zeros_like(self.distance), where=self.distance > 0.0)
        return self.inverse - 2.0 * away * np.sin(0.5 * omega / self.speed * self.distance) ** 2

    def sources(self, shapes: np.ndarray, together: int = 1) -> Iterator[np.ndarray]:
        """Strengths (together, ...) of so many neighbours of mixtures (n_flexible, n) of the modes, one after another.

        Their sums are made for many at once, as each would take all shapes through memory.
        """
        for first in range(0, shapes.shape[1] - together + 1, BLOCK):
            found = np.tensordot(shapes[:, first : first + BLOCK + together - 1].T, self.strength, 1)
            yield from (found[i : i + together] for i in range(len(found) - together + 1))

    def exchanged(self, source: np.ndarray, omega: float) -> np.ndarray:
        """Damping ratios (n, n) by sound between sources (n, ...) at a frequency [rad/s]."""
        wave = omega / self.speed
        kernel = wave * np.sinc(wave / np.pi * self.distance)
        return 0.5 * self.weight * self._product(rfft2(source, self.padded), kernel)

    def damping(self, shapes: np.ndarray, omega: np.ndarray) -> np.ndarray:
        """Damping ratios (n,) by sound of mixtures (n_flexible, n) of the modes at frequencies (n,) [rad/s]."""
        return np.array([max(0.0, self.exchanged(*each)[0, 0]) for each in zip(self.sources(shapes), omega)])

    def _product(self, spectrum: np.ndarray, kernel: np.ndarray) -> np.ndarray:
        """Double integrals (n, n) of pairs of sources of a spectrum (n, ...) with a kernel (padded), which is even."""
        weight = rfft2(kernel).real / kernel.size
        weight[:, 1 : (kernel.shape[1] + 1) // 2] *= 2.0  # for the other half of the spectrum
        flat = spectrum.reshape(len(spectrum), -1)
        return np.asarray((flat * weight.ravel()).view(float) @ flat.view(float).T)

    def solved(self) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies [rad/s] of the flexible modes, and their mixture of the old ones (n_flexible, n_flexible) [-]."""
        count, heaviest = len(self.old), 0.1
        omega, vectors = self.old.copy(), np.zeros((count, count))
        for first in range(0, count, BLOCK):
            block, solved = slice(first, min(first + BLOCK, count)), False
            while not solved:  # again if the air is heavier than on the block before, or a mode leaves the band
                low, high = omega[block].min(), omega[block].max()
                far = 1e3 * heaviest  # beyond which mixtures of first order err by a millionth
                near = np.searchsorted(self.old, [low * (1.0 - far), high * (1.0 + far)])
                ends = (max(0, first - BLOCK), block.stop), (first, min(count, block.stop + BLOCK))
                window = slice(*np.clip(near, *ends).tolist())
                low, high = low * (1.0 - min(0.5, 2.0 * heaviest)), high * (1.0 + min(0.1, 2.0 * heaviest))
                most = self._solve(block, window, (low, high), omega, vectors)
                solved = most <= 2.0 * heaviest and low <= omega[block].min() and omega[block].max() <= high
                heaviest = max(most, SAME)  # or the band had no width
            self._mix_in(block, window, omega, vectors)
        return omega, vectors

    def _mix_in(self, block: slice, window: slice, omega: np.ndarray, vectors: np.ndarray) -> None:
        """Add to the mixtures of a block, in place, what the modes outside its window have in them, to first order.

        The lowest ones radiate so much more that a few percent of them change the damping by a tenth.
        """
        outside = np.r_[: window.start, window.stop : len(self.old)]
        if outside.size:
            field = np.tensordot(vectors[window, block].T, self.strength[window], 1)
            for i, source in enumerate(field):
                spectrum = rfft2(source, self.padded) * rfft2(self._pressing(omega[block][i]))
                source[:] = irfft2(spectrum, self.padded)[: source.shape[0], : source.shape[1]]
            added = self.weight * np.tensordot(self.strength, field, ((1, 2), (1, 2)))[outside]
            square = omega[block] ** 2
            vectors[outside, block] = square * added / (self.old[outside, None] ** 2 - square)

    def _solve(
        self, block: slice, window: slice, band: tuple[float, float], omega: np.ndarray, vectors: np.ndarray
    ) -> float:
        """Solve for the modes of a block with masses known within a band of frequencies [rad/s], in place.

        Returns the largest mass [-] that air adds.
        """
        middle, half = 0.5 * (band[0] + band[1]), 0.5 * (band[1] - band[0])
        # interpolated from n Chebyshev nodes, cos(k R) errs by 4 Bessel functions J_n(k R) and less, k of half the band
        reach = half / self.speed * self.distance.max()
        needed = np.flatnonzero(jv(np.arange(2.0 * reach + 20.0), reach) > SAME)
        count = max(2, int(needed[-1]) + 1)  # one alone has no span
        nodes = middle + half * np.cos(np.pi * (np.arange(count) + 0.5) / count)
        spectrum = rfft2(self.strength[window], self.padded)
        added = BarycentricInterpolator(nodes, [self._added(spectrum, node) for node in nodes])
        stiffness, unit = np.diag(self.old[window] ** 2), np.eye(window.stop - window.start)
        for i in range(block.start, block.stop):
            only = [i - window.start] * 2
            for _ in range(HALVINGS):
                value, vector = eigh(stiffness, unit + added(np.clip(omega[i], *band)), subset_by_index=only)
                before, omega[i] = omega[i], np.sqrt(value[0])
                if abs(omega[i] - before) <= SAME * before:
                    break
            own = vector[:, 0]
            vectors[window, i] = own if own[np.abs(own).argmax()] > 0.0 else -own
        return float(np.abs(added(nodes[0])).max())


def _sampled(
    shapes: Shapes, spacing: float, whole: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Every shape at points on a square lattice around the body, (n_modes, nx, ny) [kg**-0.5]; zero beside it.

    Squares cut by the rim count by the part of them on the body, in four pieces each way: undivided, the added masses
    of free plates err ten times as much. What the integrals of a shape and its first moments then lack is spread over
    the body, as low modes between free edges hardly radiate but by what these leave; ``whole`` are points [m], sizes
    [m^2] and shapes that sum over it. Also returned is how much of each mode's energy (n_modes,) [-] the area missed
    holds.
    """
    places, inside = lattice(shapes, spacing, SAMPLES[0] * SAMPLES[1])
    rim = binary_dilation(inside, np.ones((3, 3))) & ~binary_erosion(inside, np.ones((3, 3)))
    parts = spacing * (0.25 * np.arange(4) - 0.375)
    pieces = (places[rim][:, None] + np.stack(np.meshgrid(parts, parts), axis=-1).reshape(-1, 2)).reshape(-1, 2)
    covered = shapes.contains(pieces)
    at_rim = surface_of(shapes, pieces[covered])
    values = np.zeros((len(pieces), at_rim.shape[1]))
    values[covered] = at_rim
    samples = np.zeros((at_rim.shape[1], *inside.shape))
    samples[:, inside & ~rim] = surface_of(shapes, places[inside & ~rim]).T
    samples[:, rim] = values.reshape(rim.sum(), 16, -1).mean(axis=1).T
    share = inside.astype(float)
    share[rim] = covered.reshape(-1, 16).mean(axis=1)
    points, weight, exact = whole
    middle = points.mean(axis=0)
    known, there = (np.insert(each - middle, 0, 1.0, axis=-1) for each in (points, places))  # 1, x and y
    lacking = (weight * known.T) @ exact - spacing**2 * np.einsum("xyi,nxy->in", there, samples)
    gram = spacing**2 * np.einsum("xyi,xyj,xy->ij", there, there, share)
    samples += np.einsum("in,xyi,xy->nxy", np.linalg.solve(gram, lacking), there, share)
    energy = (samples**2).sum(axis=(1, 2)) * covered.sum()
    missed = abs(share.sum() - weight.sum() / spacing**2)
    return samples, missed * (at_rim**2).sum(axis=0) / energy


def _strengths(samples: np.ndarray, spacing: float, across: int) -> np.ndarray:
    """Integral of every shape over each cell of some samples across, (n_modes, nx, ny) [m^2 kg**-0.5]."""
    n, nx, ny = samples.shape
    return samples.reshape(n, nx // across, across, ny // across, across).sum(axis=(2, 4)) * spacing**2
