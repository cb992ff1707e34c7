"""Many blows at once: modes collapsed into kernels, steps chosen by contact time, every blow held to the tolerance."""

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy import special

from . import _batch, _kernels
from .modal import Modes
from .striker import Striker

STEPS = 12.0  # [-] per contact at a tolerance of 1e-3, up to sqrt(2) times as many
STEP_ORDER = 3.5  # [-] of the error in the step: 3 linear, 4 Hertz
REFINEMENTS = 4  # [-] how often the step is halved before a blow goes to the modal engine
RICHARDSON = 3.0  # [-] difference of two runs over the error of the finer: order 2 assumed, 3 and more measured
LENGTHS = (192, 1536)  # [-] steps a blow may take, tried in turn
PIECE = 4096  # [-] blows handed to a thread at once


@dataclass(frozen=True, eq=False)
class Family:
    """Blows between the same two bodies at the same points; their masses, the law and the speed may differ."""

    omega: tuple[np.ndarray, np.ndarray]  # target's and striker's (n_modes,) [rad/s]
    zeta: tuple[np.ndarray, np.ndarray]  # (n_modes,) [-]
    squared: tuple[np.ndarray, np.ndarray]  # (n_modes,) [-] squared shapes at the point struck times the body's mass
    rest: tuple[float, float]  # [kg m/N] residual compliance times the body's mass

    @classmethod
    def of(cls, modes: Modes, at: np.ndarray, striker: Striker, residual: bool) -> "Family":
        """The family of a blow."""
        parts = []
        for body, point in ((modes, at), (striker.modes, striker.at)):
            place = point[None] if body.dimension else None
            rest = float(body.residual_compliance(place)[0, 0]) if residual and body.dimension else 0.0
            squared = body.shape_at(place)[0] ** 2 * body.mass
            parts.append((np.array(body.omega), np.array(body.damping_ratio), squared, max(0.0, rest) * body.mass))
        return cls(*zip(*parts))

    def rigid(self, body: int) -> float:
        """Squared shapes of rigid motions times the mass [-]."""
        return float(self.squared[body][self.omega[body] == 0.0].sum())

    def static(self, body: int) -> float:
        """Static compliance of the kept flexible modes times the mass [kg m/N]."""
        flexible = self.omega[body] > 0.0
        return float((self.squared[body][flexible] / self.omega[body][flexible] ** 2).sum())

    def kernels(self, h: float, n_steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Kernels of both bodies at unit mass, (4, n_steps) each."""
        found = []
        for omega, zeta, squared in zip(self.omega, self.zeta, self.squared):
            table = np.empty((_kernels.N_TABLE, len(omega)))
            _kernels.step_table(omega, zeta, h, table)
            rows = np.empty((_batch.N_KERNELS, n_steps))
            _batch.kernel_rows(table, squared, rows)
            found.append(rows)
        return found[0], found[1]


@dataclass(frozen=True, eq=False)
class Blows:
    """Numbers of many blows, all arrays (n_cases,)."""

    families: Mapping[int, Family]
    family: np.ndarray  # which of them
    target_mass: np.ndarray  # [kg]
    striker_mass: np.ndarray  # [kg]
    stiffness: np.ndarray  # [N/m**exponent]
    exponent: np.ndarray  # [-]
    speed: np.ndarray  # [m/s]

    @property
    def n_cases(self) -> int:
        return len(self.family)


@dataclass(frozen=True, eq=False)
class Bounces:
    """What came of many blows, all arrays (n_cases,); not a number where they belong to the modal engine."""

    n_impacts: np.ndarray  # [-]
    contact_time: np.ndarray  # [s]
    restitution: np.ndarray  # [-]
    impulse: np.ndarray  # [N s]
    peak_force: np.ndarray  # [N]
    error: np.ndarray  # [-] estimated
    centroid: np.ndarray  # [Hz]
    done: np.ndarray  # bool: met the tolerance and proved apart


Kernels = dict[tuple[int, int, int], tuple[np.ndarray, np.ndarray]]  # by family, step and length


def bounce(
    blows: Blows, *, tolerance: float, band: float = 0.0, workers: int | None = None, kernels: Kernels | None = None
) -> Bounces:
    """Follow blows at unit speed in kernel form, halving steps until each meets the tolerance.

    Parameters
    ----------
    blows : Blows
    tolerance : float [-]
        Largest error accepted, as in `strike`.
    band : float [Hz]
        Upper end of the spectral centroid; 0 for none.
    workers : int, optional
        Threads; one for each core by default.
    kernels : dict, optional
        Kernels found so far for the same families; new ones are added.

    Returns
    -------
    Bounces

    Notes
    -----
    With ``d = v x`` the blow depends on stiffness and speed through ``k v**(exponent - 1)`` alone; times stay, forces
    grow by v.
    """
    engine = _Engine(blows, band, workers or os.cpu_count() or 1, {} if kernels is None else kernels)
    everyone = np.arange(blows.n_cases)
    step = engine.first_step(STEPS * (1e-3 / tolerance) ** (1.0 / STEP_ORDER))
    coarse = engine.run(everyone, step - 2)
    error = np.full(blows.n_cases, np.nan)
    final = np.full_like(coarse, np.nan)
    todo = everyone
    for _ in range(REFINEMENTS):
        fine = engine.run(todo, step[todo])
        change = engine.difference(coarse, fine, todo)
        met = change <= tolerance
        final[:, todo[met]] = fine[:, met]
        error[todo[met]] = change[met] / RICHARDSON
        coarse, todo = fine[:, ~met], todo[~met]
        step[todo] += 2
        if not todo.size:
            break
    v = blows.speed
    return Bounces(
        final[0], final[1], final[2] * engine.own_rigid - 1.0, final[2] * v, final[3] * v, error, final[4],
        ~np.isnan(error),
    )  # fmt: skip


class _Engine:
    """Kernels by family and step, and the numbers all runs share."""

    def __init__(self, blows: Blows, band: float, workers: int, kernels: Kernels) -> None:
        self.blows, self.band, self.workers, self.kernels = blows, band, workers, kernels

        def of_family(number: Callable[[Family], float]) -> np.ndarray:
            keys, which = np.unique(blows.family, return_inverse=True)
            return np.array([number(blows.families[int(key)]) for key in keys])[which]

        self.shares = np.array([1.0 / blows.target_mass, 1.0 / blows.striker_mass])
        self.own_rigid = of_family(lambda family: family.rigid(1)) * self.shares[1]
        self.rigid = of_family(lambda family: family.rigid(0)) * self.shares[0] + self.own_rigid
        self.static = of_family(lambda family: family.static(0)) * self.shares[0]
        self.static += of_family(lambda family: family.static(1)) * self.shares[1]
        rest = of_family(lambda family: family.rest[0]) * self.shares[0]
        rest += of_family(lambda family: family.rest[1]) * self.shares[1]
        self.law = np.array([blows.stiffness * blows.speed ** (blows.exponent - 1.0), blows.exponent, rest])

    def first_step(self, count: float) -> np.ndarray:
        """Step of each blow as half-octaves: h = 2**(-step / 2), at least ``count`` per contact with a rigid wall."""
        stiffness, exponent, rest = self.law
        q = 1.0 / (exponent + 1.0)
        deepest = np.exp(q * np.log(0.5 / (q * stiffness * self.rigid)))
        duration = 2.0 * np.sqrt(np.pi) * special.gamma(1.0 + q) / special.gamma(0.5 + q) * deepest
        duration *= np.where(exponent == 1.0, np.sqrt(1.0 + stiffness * rest), 1.0)
        return np.ceil(2.0 * np.log2(count / duration)).astype(int)

    def run(self, cells: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Follow blows with their steps; return what `_batch.run` writes, (6, n_cells)."""
        out = np.full((6, self.blows.n_cases), np.nan)
        todo = cells
        for length in LENGTHS:
            self._run(todo, step, out, length)
            again = out[5, todo] == _batch.LONG
            todo, step = todo[again], step[again]
            if not todo.size:
                break
        return out[:, cells]

    def _run(self, cells: np.ndarray, step: np.ndarray, out: np.ndarray, length: int) -> None:
        group = np.stack([self.blows.family[cells], step])
        order = np.lexsort(group)
        edges = np.flatnonzero(np.any(np.diff(group[:, order], axis=1) != 0, axis=0)) + 1
        jobs = []
        for part in np.split(order, edges):
            family, exponent = int(group[0, part[0]]), int(step[part[0]])
            h = 2.0 ** (-0.5 * exponent)
            key = family, exponent, length
            if key not in self.kernels:
                self.kernels[key] = self.blows.families[family].kernels(h, length)
            jobs += [
                (cells[part[i : i + PIECE]], h, *self.kernels[key], self.shares, self.law, self.rigid, self.static,
                 self.band, out)
                for i in range(0, len(part), PIECE)
            ]  # fmt: skip
        if self.workers == 1 or len(cells) < 64:
            for job in jobs:
                _batch.run(*job)
            return
        with ThreadPoolExecutor(self.workers) as pool:
            for result in [pool.submit(_batch.run, *job) for job in jobs]:
                result.result()

    def difference(self, coarse: np.ndarray, fine: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Largest difference of two runs in what the tolerance speaks of; infinite where they ended differently."""
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = np.abs(coarse[1:4] / fine[1:4] - 1.0).max(axis=0)
            if self.band:
                relative = np.maximum(relative, np.abs(coarse[4] / fine[4] - 1.0))
        absolute = np.abs(coarse[2] - fine[2]) * self.own_rigid[cells]
        same = (coarse[0] == fine[0]) & (coarse[5] == _batch.DONE) & (fine[5] == _batch.DONE)
        return np.where(same, np.fmax(relative, absolute), np.inf)
