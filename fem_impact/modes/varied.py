"""What a small change of a body's section changes in its modes: frequencies, shapes at a point, and its compliance."""

from dataclasses import dataclass

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .._base.rounding import SAME
from ..fe.eigenvalues import CLUSTER
from ..fe.variation import SectionChange, energy_changes
from .modal import Modes
from .shapes import FieldShapes


@dataclass(frozen=True, eq=False, repr=False)
class ModesChange(check.Locked):
    """Changes per unit of a number, of modes as they are excited at one point."""

    omega: np.ndarray  # (n_modes,) [rad/s]
    shape: np.ndarray  # (n_modes,) [kg**-0.5] at the point
    compliance: float  # [m/N] of the whole body at the point


def solution(modes: Modes) -> FieldShapes:
    """The finite elements behind modes; SimulationError for modes of other kinds."""
    if not isinstance(modes.shapes, FieldShapes):
        raise SimulationError("no derivative in the section: it needs modes of finite elements, of find_modes")
    if modes.thick and modes.dimension == 2:
        raise SimulationError("no derivative in the section: it is not available for a thick plate; take a thin one")
    return modes.shapes


def frequency_slopes(modes: Modes, change: SectionChange, which: np.ndarray) -> np.ndarray:
    """Changes (n,) [Hz] of the frequencies of some modes per unit of a number.

    A frequency that several modes share splits at any change unless all its modes change alike; then it has a
    derivative, otherwise SimulationError says so.
    """
    shapes, omega = solution(modes), modes.omega
    rate = shapes.system.frame.rate
    groups = [np.flatnonzero(share_frequency(modes)[i]) for i in which]
    used = np.unique(np.concatenate(groups)) if len(groups) else np.zeros(0, int)
    stiffer, heavier = energy_changes(shapes.system, change, shapes.vectors[:, used])
    found = np.zeros(len(which))
    for k, (i, group) in enumerate(zip(which, groups)):
        own = np.searchsorted(used, group)
        split = stiffer[np.ix_(own, own)] - (omega[i] / rate) ** 2 * heavier[np.ix_(own, own)]
        mean = float(np.trace(split)) / len(own)
        scale = np.abs(np.diag(stiffer)[own]).max() + (omega[i] / rate) ** 2 * np.abs(np.diag(heavier)[own]).max()
        if np.abs(split - mean * np.eye(len(own))).max() > np.sqrt(CLUSTER) * scale:
            raise SimulationError(
                f"no derivative of the frequency {omega[i] / (2.0 * np.pi):.6g} Hz: {len(own)} modes share it, and a "
                "change splits it; want another frequency, or start from a body without this symmetry"
            )
        found[k] = mean * rate**2 / (2.0 * omega[i]) / (2.0 * np.pi) if omega[i] else 0.0
    return found


def share_frequency(modes: Modes) -> np.ndarray:
    """Whether each two modes share one frequency, as far as the elements resolve, (n_modes, n_modes)."""
    omega, doubt = modes.omega, CLUSTER if modes.frequency_error is None else CLUSTER + modes.frequency_error
    unsure = doubt * omega
    return np.abs(omega - omega[:, None]) <= np.maximum(unsure, np.reshape(unsure, (-1, 1)))


def changed_modes(modes: Modes, change: SectionChange, at: np.ndarray) -> ModesChange:
    """Changes of modes as excited at a point ``at`` (dimension,) [m], exact but for the elements.

    Modes that share a frequency are changed together: only their motion at the point counts, and that is smooth.
    """
    shapes = solution(modes)
    system, n = shapes.system, modes.n_modes
    frame, n_rigid = system.frame, modes.n_rigid
    load = np.asarray(system.interpolate(at[None]).todense()).T  # (n_dofs, 1)
    shape_at = (load.T @ shapes.vectors)[0]  # (n_modes,) in the frame
    square = (modes.omega / frame.rate) ** 2
    rest, answers = _rest_vectors(shapes, shape_at, square, load)
    stiffer, heavier = energy_changes(system, change, np.column_stack([shapes.vectors, rest]))
    force = stiffer[:, :n] - heavier[:, :n] * square  # (n + n_rest, n) what a change of each mode is pushed with
    slope = np.diag(force[:n]).copy()  # of the eigenvalues
    apart, alike = square - square[:, None], share_frequency(modes)
    mix = np.where(alike, -0.5 * heavier[:n, :n], force[:n] / np.where(alike, 1.0, apart))
    shape = shape_at @ mix - np.einsum("ki,ki->i", answers, force[n:])
    for i in np.flatnonzero(alike.sum(axis=0) > 1):
        group = alike[i]
        size = float(shape_at[group] @ shape_at[group])
        if i >= n_rigid and size:
            slope[i] = float(shape_at[group] @ force[:n][np.ix_(group, group)] @ shape_at[group]) / size
    omega = np.zeros(n)
    omega[n_rigid:] = slope[n_rigid:] * frame.rate**2 / (2.0 * modes.omega[n_rigid:])
    found = shapes._deflection(at[None])
    system, dip = found.system, found.vectors[:, 0]
    force = np.asarray(system.interpolate(at[None]).todense())[0]
    drift = system.rigid @ (system.rigid.T @ force)  # acceleration of a body that can move rigidly
    stiffer, heavier = energy_changes(system, change, np.column_stack([dip, drift]))
    softer = -float(stiffer[0, 0] + 2.0 * heavier[0, 1]) / (system.frame.mass * system.frame.rate**2)
    return ModesChange(omega, shape * frame.mass**-0.5, softer)


def _rest_vectors(
    shapes: FieldShapes, shape_at: np.ndarray, square: np.ndarray, load: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Vectors (n_dofs, n) that stand for the modes left out, and how much of each answers a load (n, n_modes).

    Their sum is ``(1 - square A)**-1 A load`` for the square frequency of each mode kept, where A is ``K**-1 M`` among
    the modes left out, by the method of Lanczos. It soon finds those next to the modes kept, however near they are.
    """
    M, kept, flexible = shapes.system.M, shapes.vectors, square > 0.0
    vector = shapes.flexibility.solve(load)[:, 0] - kept[:, flexible] @ (shape_at[flexible] / square[flexible])
    steps = 30  # of beams and plates cut next to a mode left out, ten miss 1e-3 of a shape and 20 miss 1e-10
    basis, soft, lengths = kept, np.zeros((steps, steps)), np.zeros(steps)
    for k in range(steps):
        for _ in range(2):  # rounding of the modes kept would grow
            vector = vector - basis @ (basis.T @ (M @ vector))
        lengths[k] = float(vector @ (M @ vector)) ** 0.5
        if lengths[k] <= SAME * lengths[0]:  # no more are left out
            break
        basis = np.column_stack([basis, vector / lengths[k]])
        vector = shapes.flexibility.solve(M @ basis[:, -1:])[:, 0]
        soft[: k + 1, k] = soft[k, : k + 1] = basis[:, kept.shape[1] :].T @ (M @ vector)
    rest = basis[:, kept.shape[1] :]
    softness, turned = np.linalg.eigh(soft[: rest.shape[1], : rest.shape[1]])
    near = 1.0 - softness[:, None] * square
    answers = lengths[0] * turned[:1].T / np.where(np.abs(near) > CLUSTER, near, np.inf)
    return rest @ turned, answers
