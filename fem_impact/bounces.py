"""Many blows at once: modes collapsed into kernels, steps chosen by contact time, every blow held to the tolerance."""

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from . import _batch, _kernels
from .modal import Modes
from .striker import Striker

STEPS = 12.0  # [-] per contact at a tolerance of 1e-3, up to sqrt(2) times as many
STEP_ORDER = 3.5  # [-] of the error in the step: 3 linear, 4 Hertz
REFINEMENTS = 4  # [-] how often the step is halved before a blow goes to the modal engine
RICHARDSON = 3.0  # [-] difference of two runs over the error of the finer: order 2 assumed, 3 and more measured
ALLOWED = 2.0  # [-] times the tolerance, of that difference
YIELD = 0.02  # [-] error of the peak over that part of the indentation by which badly sampled top modes yield: measured
ALIAS = (4.0, 8.0)  # [-] omega times step at which they are badly sampled; beyond, they follow the force statically
LENGTHS = (48, 384, 3072)  # [-] steps a blow may take, tried in turn
PIECE = 4096  # [-] blows handed to a thread at once
FEW = 1024  # [-] blows not worth a second thread


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

    def edge(self, body: int) -> float:
        """Highest frequency of a body [rad/s]."""
        return float(self.omega[body].max())

    def top(self, body: int) -> float:
        """Static compliance of the modes in the upper half of the band, times the mass [kg m/N]."""
        high = (self.omega[body] > 0.0) & (self.omega[body] > 0.5 * self.edge(body))
        return float((self.squared[body][high] / self.omega[body][high] ** 2).sum())

    def kernels(self, h: float, n_steps: int) -> tuple[np.ndarray, ...]:
        """Kernels of both bodies at unit mass, (6, n_steps) each, and what bounds their motion in flight."""
        found = []
        for omega, zeta, squared in zip(self.omega, self.zeta, self.squared):
            table = np.empty((_kernels.N_TABLE, len(omega)))
            _kernels.step_table(omega, zeta, h, table)
            rows = np.empty((_batch.N_KERNELS, n_steps))
            _batch.kernel_rows(table, squared, rows)
            bounds = np.empty((_batch.LEVELS + 1, 2, 2))
            _batch.flight_bounds(omega, zeta, squared, h, bounds)
            found.append((rows, bounds))
        return found[0][0], found[1][0], found[0][1], found[1][1]


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


Kernels = dict[tuple[int, int], tuple[np.ndarray, ...]]  # by family and step, as long as was needed
KEPT = 128e6  # [byte] of kernels at most from one call to the next
NO_KERNELS = np.empty((_batch.N_KERNELS, 0)), np.empty((_batch.N_KERNELS, 0))


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
    workers = workers or os.cpu_count() or 1
    if blows.n_cases < FEW:
        workers = 1
    with ThreadPoolExecutor(workers) as pool:
        engine = _Engine(blows, band, pool.submit if workers > 1 else None, {} if kernels is None else kernels)
        final, error = _refined(engine, tolerance)
    if kernels is not None and sum(part.nbytes for parts in kernels.values() for part in parts) > KEPT:
        kernels.clear()
    v = blows.speed
    return Bounces(
        final[0], final[1], final[2] * engine.own_rigid - 1.0, final[2] * v, final[3] * v, error, final[4],
        ~np.isnan(error),
    )  # fmt: skip


def _refined(engine: "_Engine", tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """What `_Engine.run` finds once steps are short enough, and its error; not a number where they never are."""
    blows = engine.blows
    everyone = np.arange(blows.n_cases)
    step = engine.first_step(tolerance)
    coarse = engine.run(everyone, step - 2, sure=False)
    error = np.full(blows.n_cases, np.nan)
    final = np.full_like(coarse, np.nan)
    todo = everyone
    for _ in range(REFINEMENTS):
        fine = engine.run(todo, step[todo])
        change = engine.difference(coarse, fine, todo)
        met = change <= ALLOWED * tolerance
        final[:, todo[met]] = fine[:, met]
        error[todo[met]] = change[met] / RICHARDSON
        coarse, todo = fine[:, ~met], todo[~met]
        step[todo] += 2
        if not todo.size:
            break
    return final, error


class _Engine:
    """Kernels by family and step, and the numbers all runs share."""

    def __init__(self, blows: Blows, band: float, submit: Any, kernels: Kernels) -> None:
        self.blows, self.band, self.submit, self.kernels = blows, band, submit, kernels

        self.keys, self.which = np.unique(blows.family, return_inverse=True)
        self.shares = np.array([1.0 / blows.target_mass, 1.0 / blows.striker_mass])
        rigid, static, rest = (
            np.array([self.of_family(number, body) for body in (0, 1)]) * self.shares
            for number in (Family.rigid, Family.static, lambda family, body: family.rest[body])
        )
        self.own_rigid, self.rigid, self.static, rest = (
            rigid[1],
            rigid.sum(axis=0),
            static.sum(axis=0),
            rest.sum(axis=0),
        )
        stiffness = blows.stiffness * blows.speed ** (blows.exponent - 1.0)
        self.law = np.array([stiffness, blows.exponent, rest])

    def of_family(self, number: Callable[[Family, int], float], body: int) -> np.ndarray:
        """A number of one of the bodies of each blow's family, (n_cases,)."""
        return np.array([number(self.blows.families[int(key)], body) for key in self.keys])[self.which]

    def first_step(self, tolerance: float) -> np.ndarray:
        """Step of each blow as half-octaves: h = 2**(-step / 2), at least STEPS per contact with a rigid wall.

        A step close to the period of a body's highest modes samples them so that two runs may agree on a wrong peak;
        where these modes yield enough to matter, the step is shorter.
        """
        stiffness, exponent, rest = self.law
        q = 1.0 / (exponent + 1.0)
        deepest = np.exp(q * np.log(0.5 / (q * stiffness * self.rigid)))
        duration = 2.0 * np.sqrt(np.pi) * special.gamma(1.0 + q) / special.gamma(0.5 + q) * deepest
        duration *= np.where(exponent == 1.0, np.sqrt(1.0 + stiffness * rest), 1.0)
        count = STEPS * (1e-3 / tolerance) ** (1.0 / STEP_ORDER)
        step = np.ceil(2.0 * np.log2(count / duration)).astype(int)
        for body in (0, 1):
            edge, yields = self.of_family(Family.edge, body), self.of_family(Family.top, body)
            angle = edge * 2.0 ** (-0.5 * step)
            blind = (
                (YIELD * yields * self.shares[body] * stiffness > tolerance) & (angle > ALIAS[0]) & (angle < ALIAS[1])
            )
            step[blind] += np.ceil(2.0 * np.log2(angle[blind] / ALIAS[0])).astype(int)
        return step

    def run(self, cells: np.ndarray, step: np.ndarray, sure: bool = True) -> np.ndarray:
        """Follow blows with their steps; return what `_batch.run` writes, (7, n_cells).

        Unless ``sure``, flights are sampled and not proved free of touches: enough for a run to compare with.
        """
        out = np.full((7, self.blows.n_cases), np.nan)
        todo = cells
        for length in LENGTHS:
            self._run(todo, step, out, length, sure)
            again = out[5, todo] == _batch.LONG
            todo, step = todo[again], step[again]
            if not todo.size:
                break
        return out[:, cells]

    def kernel(self, family: int, step: int, length: int) -> tuple[np.ndarray, ...]:
        """Kernels of a family, found once."""
        known = self.kernels.get((family, step), (np.empty((0, 0)),))
        if known[0].shape[1] < length:
            known = self.kernels[family, step] = self.blows.families[family].kernels(2.0 ** (-0.5 * step), length)
        return known[0][:, :length], known[1][:, :length], *known[2:]

    def _run(self, cells: np.ndarray, step: np.ndarray, out: np.ndarray, length: int, sure: bool) -> None:
        group = np.stack([self.blows.family[cells], step])
        order = np.lexsort(group)
        edges = np.flatnonzero(np.any(np.diff(group[:, order], axis=1) != 0, axis=0)) + 1
        jobs = []
        for part in np.split(order, edges):
            family, exponent = int(group[0, part[0]]), int(step[part[0]])
            h = 2.0 ** (-0.5 * exponent)
            kernels = self.kernel(family, exponent, length)
            halves: tuple[np.ndarray, ...] = NO_KERNELS
            if sure and length > LENGTHS[0]:
                halves = self.kernel(family, exponent + 2, 2 * length)[:2]
            jobs += [
                (cells[part[i : i + PIECE]], h, *kernels, *halves, sure, self.shares, self.law, self.rigid, self.static,
                 self.band, out)
                for i in range(0, len(part), PIECE)
            ]  # fmt: skip
        if self.submit is None:
            for job in jobs:
                _batch.run(*job)
            return
        for result in [self.submit(_batch.run, *job) for job in jobs]:
            result.result()

    def difference(self, coarse: np.ndarray, fine: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Largest difference of two runs in what the tolerance speaks of; infinite where they ended differently."""
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = np.abs(coarse[1:4] / fine[1:4] - 1.0).max(axis=0)
            if self.band:
                relative = np.maximum(relative, np.abs(coarse[4] / fine[4] - 1.0))
        relative = np.maximum(relative, RICHARDSON * fine[6])
        absolute = np.abs(coarse[2] - fine[2]) * self.own_rigid[cells]
        same = (coarse[0] == fine[0]) & (coarse[5] <= _batch.DOUBTFUL) & (fine[5] == _batch.DONE)
        return np.where(same, np.fmax(relative, absolute), np.inf)
