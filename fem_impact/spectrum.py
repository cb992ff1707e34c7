"""The lowest modes of a system: on a mesh fine enough, none missed, refined until their error is known to be small."""

import hashlib
import zipfile
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from . import _check
from ._files import replacing
from .assembly import System, assemble, reassemble
from .eigen import RESIDUAL, SPARE, Flexibility, count_below, lowest
from .mesh import Mesh
from .section import Plate

WAVE_PER_ELEMENT = {
    "argyris": 1.8,
    "hermite": 0.3,
    "morley": 0.2,
}  # [rad] error 1e-7 (kh)**8 and 7e-4 (kh)**4: about 1e-5 either way
ERROR_OF_WAVE = {
    "argyris": (1e-7, 8.0),
    "hermite": (7e-4, 4.0),
    "morley": (0.2, 2.0),
}  # relative error of a frequency: factor and power of kh
UNEVEN = (
    50.0  # [-] times that: clamped corners on coarse meshes need half of it, smooth modes a fiftieth; test_modal.py
)
HELD = {"argyris": 2e-5, "hermite": 1e-12, "morley": 0.0}  # [-] what supports, curves and corners add at most
MORLEY = 0.2574578  # [-] error of the Morley interpolation, over h**2 (Carstensen and Gallistl 2014)
MORLEY_UNKNOWNS = 20_000  # [-] spent on a second opinion
ALGEBRA = 1e-9  # [-] margin for rounding and the eigensolver on either side of an enclosure
FINE_WAVE = 1.1  # [rad] likewise where the triangles stay fewer than the next number: error 2e-7, clamped 1e-5
CHEAP_CELLS = 700  # [-]
LAYERS = 10.0  # [-] elements under tension are no larger than this times sqrt(D / tension): error 1e-5 on a disk
FINEST_LAYER = 40.0  # [-] nor are they made smaller than the extent over this
MOST_ORDER = 4.0  # [-] order of convergence that an error estimate relies on at most
LEAST_ORDER = 1.0  # [-] and at least
ROUNDING = 3e-12  # [-] error of a frequency that no refinement removes
MOST_UNKNOWNS = 150_000  # [-] where refinement gives up
HOPELESS = 10.0  # [-] times as many unknowns, extrapolated, and refinement gives up at once
FAR_APART = 3.6  # [-] times as many cells: two such meshes tell the error without a third
TWO_LEVEL_ORDER = 3.0  # [-] order then relied on
LEAST_STEP = 1.25  # [-] meshes closer in size than this say less about the error than their sizes suggest
SAY = 1e-3  # [-] errors at singular corners beyond this are stated whether a tolerance was given or not
SEARCHES = 3  # [-] attempts to find every mode of a cluster
STRICT = 1e-11  # [-] residual of the attempts after the first
STEP = 2.0**0.5  # [-] from one mesh size to the next


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Eigenpairs of a system, rigid motions first."""

    system: System
    flexibility: Flexibility
    omega: np.ndarray  # (n_modes,) [rad/s]
    vectors: np.ndarray  # (n_dofs, n_modes) [-] mass-normalised in the frame of the system
    error: np.ndarray  # (n_modes,) [-] estimated relative error of omega

    @property
    def n_rigid(self) -> int:
        """Number of rigid motions."""
        return self.flexibility.rigid.shape[1]


def _wave(system: System, n_modes: int | None, max_frequency: float | None) -> float:
    """Wavenumber [rad/m] of the shortest wave asked for."""
    mesh, frame = system.mesh, system.frame
    if max_frequency is not None:
        softest = system.softness * frame.inertia / frame.stiffness
        return float((softest * (2.0 * np.pi * max_frequency) ** 2) ** 0.25)
    assert n_modes is not None
    if mesh.dimension == 1:
        return float(np.pi * (n_modes + 1) / np.ptp(mesh.points))
    # Weyl's law: modes grow with the area, and fewer fit along the edge
    return float(np.sqrt(4.0 * np.pi * n_modes / mesh.area) + 0.5 * mesh.perimeter / mesh.area)


def solve(system: System, n_modes: int | None, max_frequency: float | None) -> Spectrum:
    """The lowest modes on the mesh as it is: so many of them, or all below a frequency [Hz]; counted by inertia."""
    flexibility = Flexibility(system.K, system.M, system.rigid, system.held)
    n_rigid, rate = system.rigid.shape[1], system.frame.rate
    limit = None if max_frequency is None else (2.0 * np.pi * max_frequency / rate) ** 2
    if n_modes is None:
        assert limit is not None
        n_modes = count_below(system.K, system.M, limit)
        if n_modes == 0:
            raise ValueError(f"max_frequency must reach the first mode; there is none below {max_frequency:g} Hz")
    if n_modes <= n_rigid:
        values, vectors = np.zeros(0), np.zeros((system.n_dofs, 0))
    else:
        values, vectors = _counted(system, flexibility, n_modes - n_rigid, limit)
        values, vectors = sharpened(system, values, vectors)
    omega = np.concatenate([np.zeros(n_rigid), np.sqrt(values) * rate])[:n_modes]
    vectors = np.column_stack([system.rigid, vectors])[:, :n_modes]
    return Spectrum(system, flexibility, omega, vectors, _expected(system, omega))


def kept(system: System, n_modes: int | None, max_frequency: float | None, path: Path) -> Spectrum:
    """What `solve` returns, kept in a file: a later call for the same modes of the same matrices reads it there."""
    asked = repr((n_modes, max_frequency)).encode()
    key = hashlib.sha256(b"".join([asked, system.K.data.tobytes(), system.M.data.tobytes()])).hexdigest()
    names = ("omega", "vectors", "error")
    try:
        with open(path, "rb") as raw, np.load(raw, allow_pickle=False) as file:
            if str(file["key"]) == key:
                flexibility = Flexibility(system.K, system.M, system.rigid, system.held)
                return Spectrum(system, flexibility, *(file[name] for name in names))
    except (OSError, ValueError, KeyError, zipfile.BadZipFile, EOFError, MemoryError):
        pass  # none there, of another kind, or damaged: found anew and written over
    found = solve(system, n_modes, max_frequency)
    with replacing(path) as temporary, open(temporary, "wb") as file:  # savez adds an ending to a name without one
        np.savez(file, key=key, **{name: getattr(found, name) for name in names})
    return found


def _expected(system: System, omega: np.ndarray) -> np.ndarray:
    """Relative error (n_modes,) to expect of frequencies on a mesh of this size, where none was asked for."""
    mesh, frame = system.mesh, system.frame
    size = mesh.area / len(mesh.cells) if mesh.dimension == 1 else np.sqrt(2.0 * mesh.area / len(mesh.cells))
    wave = (system.softness * frame.inertia / frame.stiffness * omega**2) ** 0.25
    factor, power = ERROR_OF_WAVE[system.element]
    error = UNEVEN * factor * (wave * size) ** power + HELD[system.element]
    if system.unresolved > SAY:
        error = np.maximum(error, system.unresolved)
    return np.where(omega > 0.0, error, 0.0)


def _counted(system: System, flexibility: Flexibility, n: int, limit: float | None) -> tuple[np.ndarray, np.ndarray]:
    """The n lowest flexible eigenpairs, none missed.

    Either they are known to be all below a limit, or their number below a gap behind the last is confirmed by inertia.
    In a dense cluster the first search may miss some; it is then repeated for more of them and more strictly.
    """
    n_rigid = flexibility.rigid.shape[1]
    available = system.n_dofs - n_rigid
    if n > available:
        raise ValueError(f"n_modes must not exceed the {system.n_dofs} unknowns of this mesh; refine it")
    more, residual = min(n + (SPARE if limit is None else 0), available), RESIDUAL
    for _ in range(SEARCHES):
        values, vectors = lowest(flexibility, more, residual)
        if more == available:
            return values[:n], vectors[:, :n]
        if limit is not None:
            below, found = n, int((values < limit * (1.0 + 1e-12)).sum())
        else:
            gaps = np.diff(values[n - 1 :]) / values[n - 1 : -1]
            at = n - 1 + int(gaps.argmax())
            below, found = count_below(system.K, system.M, 0.5 * (values[at] + values[at + 1])) - n_rigid, at + 1
        if below == found:
            return values[:n], vectors[:, :n]
        more, residual = min(max(below, more) + 4 * SPARE, available), STRICT
    raise _check.SimulationError(
        f"{below} flexible modes lie below {np.sqrt(values[min(n, more) - 1]) * system.frame.rate / 2 / np.pi:g} Hz, "
        f"but {found} were found; ask for a few modes more"
    )


def sharpened(system: System, values: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The eigenvalues from the strain energy of their vectors, which small triangles leave more digits than K does."""
    if system.strain is None or not len(values):
        return values, vectors
    energy = system.strain.energy(system, vectors)
    mass = np.einsum("ij,ij->j", vectors, system.M @ vectors)
    order = np.argsort(energy / mass, kind="stable")
    return (energy / mass)[order], vectors[:, order]


def fine_enough(system: System, n_modes: int | None, max_frequency: float | None, tolerance: float | None) -> System:
    """The system on a mesh that resolves the shortest wave asked for, where the user left the size open."""
    size = size_for(system, n_modes, max_frequency, tolerance)
    if system.mesh.size_stated or size >= system.mesh.size:
        return system
    finer = system.mesh.refined(system.mesh.size / size)
    # triangles of a file are not all as large as the longest of them
    return reassemble(system, finer) if len(finer.cells) > len(system.mesh.cells) else system


def resolves(system: System, max_frequency: float) -> bool:
    """Whether the mesh is fine enough for the waves up to a frequency [Hz]."""
    return system.mesh.size <= WAVE_PER_ELEMENT[system.element] / _wave(system, None, max_frequency)


def size_for(system: System, n_modes: int | None, max_frequency: float | None, tolerance: float | None) -> float:
    """Size [m] of elements that resolve the shortest wave asked for."""
    wave = _wave(system, n_modes, max_frequency)
    size = WAVE_PER_ELEMENT[system.element] / wave
    if tolerance is not None:
        factor, power = ERROR_OF_WAVE[system.element]
        size = (tolerance / factor) ** (1.0 / power) / wave
    elif system.element == "argyris":  # few modes are cheap enough to be had more exactly
        affordable = (2.3 * system.mesh.area / CHEAP_CELLS) ** 0.5
        size = min(size, max(affordable, FINE_WAVE / wave))
    if isinstance(system.section, Plate) and system.section.tension:  # the edge of a drumhead bends within its layer
        layer = (system.frame.stiffness / system.section.tension) ** 0.5
        size = min(size, max(LAYERS * layer, system.frame.length / FINEST_LAYER))
    return size


def refine(system: System, n_modes: int | None, max_frequency: float | None, tolerance: float) -> Spectrum:
    """Modes whose estimated relative error is below a tolerance, on meshes refined as often as that takes."""
    if system.mesh.recipe is None:
        raise ValueError(
            "tolerance needs a mesh that can be refined; make it with fi.mesh or load it with fi.mesh.load"
        )
    start = _affordable(system, n_modes, max_frequency, tolerance)
    if max_frequency is not None:  # from here on by number, so that all meshes give the same ones
        n_modes = len(solve(start, None, max_frequency).omega)
    history: list[Spectrum] = []
    for candidate in (reassemble(system, start.mesh.refined(1.0 / STEP)), start):
        if candidate is not start and (start.mesh.size_stated or _step(candidate.mesh, start.mesh) < LEAST_STEP):
            continue  # the user's own mesh, or one that cannot be coarsened
        if candidate.n_dofs > 2 * (n_modes or 0):
            history.append(solve(candidate, n_modes, None))
    while True:
        mesh = history[-1].system.mesh if history else start.mesh
        finer = mesh.refined(STEP)
        if _step(mesh, finer) < LEAST_STEP:  # the size meant its longest side, the others are finer already
            finer = mesh.refined(2.0)
        history.append(solve(reassemble(system, finer), n_modes, None))
        cells = [len(found.system.mesh.cells) for found in history[-2:]]
        if len(history) < (2 if cells[-1] > FAR_APART * cells[0] else 3):
            continue
        error, order = _estimate(history[-3:])
        if (error <= tolerance).all():
            last = history[-1]
            return Spectrum(last.system, last.flexibility, last.omega, last.vectors, error)
        worst, n_dofs = int(error.argmax()), history[-1].system.n_dofs
        needed = n_dofs * (error[worst] / tolerance) ** (mesh.dimension / order[worst])
        if n_dofs * STEP**2 > MOST_UNKNOWNS or needed > HOPELESS * MOST_UNKNOWNS:
            raise _check.SimulationError(
                f"tolerance = {tolerance:g} is not met: mode {worst + 1} is uncertain by {error[worst]:.1e} with "
                f"{n_dofs} unknowns; loosen the tolerance, or ask for fewer modes"
            )


def _affordable(system: System, n_modes: int | None, max_frequency: float | None, tolerance: float) -> System:
    """The system on a mesh to begin with: as fine as the waves need, and no mesh of a file much finer than that."""
    mesh, size = system.mesh, size_for(system, n_modes, max_frequency, tolerance)
    if not mesh.size_stated and len(mesh.cells) > CHEAP_CELLS and size > STEP * mesh.size:
        coarse = mesh.refined(mesh.size / size)
        if _step(coarse, mesh) > LEAST_STEP:
            return reassemble(system, coarse)
    return fine_enough(system, n_modes, max_frequency, tolerance)


def _step(coarse: Mesh, fine: Mesh) -> float:
    """How much smaller [-] the elements of one mesh are than those of another."""
    return (len(fine.cells) / len(coarse.cells)) ** (1.0 / fine.dimension)


def _estimate(history: list[Spectrum]) -> tuple[np.ndarray, np.ndarray]:
    """Relative error (n_modes,) of the last spectrum from its difference to those before, and the order they show.

    Of two spectra only, on meshes far apart, the order is taken as TWO_LEVEL_ORDER or that of the corners.
    """
    fine, medium = history[-1].omega, history[-2].omega
    steps = [max(_step(a.system.mesh, b.system.mesh), LEAST_STEP) for a, b in pairwise(history)]
    second, most = steps[-1], min(MOST_ORDER, history[-1].system.order)
    flexible = fine > 0.0
    scale = np.where(flexible, fine, 1.0)
    newer = np.abs(medium - fine) / scale
    order = np.full(len(fine), min(TWO_LEVEL_ORDER, most))
    if len(history) > 2:
        older = np.abs(history[0].omega - medium) / scale
        with np.errstate(divide="ignore", invalid="ignore"):
            shown = np.log(older / newer) / np.log(0.5 * (steps[0] + second))
        order = np.clip(np.where(np.isfinite(shown), shown, most), min(LEAST_ORDER, most), most)
    # a mode whose differences happen to be small borrows from its neighbours, which the same mesh resolves as well
    error = newer / (second**order - 1.0)
    near = np.array([np.median(error[max(0, i - 2) : i + 3]) for i in range(len(error))])
    least = max(ROUNDING, history[-1].system.unresolved if history[-1].system.unresolved > SAY else 0.0)
    return np.where(flexible, np.maximum(np.maximum(error, 0.1 * near), least), 0.0), order


def enclosure(found: Spectrum) -> np.ndarray | None:
    """Guaranteed bounds of each frequency, (n_modes, 2) [rad/s], or None where no proof covers the body.

    Argyris elements on straight edges are conforming, so their eigenvalues lie above the exact ones. Those of Morley
    elements, lambda, give lambda / (1 + c**2 lambda h**4) below, h the longest side: c = 0.2574578 bounds what the
    Morley interpolation misses. Where an edge is free, the energy controls the second derivatives only up to 1 - nu.

    References
    ----------
    Carstensen and Gallistl (2014), Numer. Math. 126, 33-51; Liu (2015), Appl. Math. Comput. 267, 341-355.
    """
    system = found.system
    plate, mesh = system.section, system.mesh
    if not isinstance(plate, Plate) or callable(plate.thickness) or plate.material.E_across is not None:
        return None
    if mesh.curved.any() or system.point_masses or system.element != "argyris" or plate.tension:
        return None
    if system.rim is None or not all(isinstance(kind, str) for kind in system.supports.values()):
        return None
    nu, material = plate.material.nu, plate.material
    if "free" not in system.rim.kinds:  # nu then changes nothing but the rigidity, and 0 gives the sharpest bound
        nu, material = 0.0, replace(material, E=material.E / (1.0 - nu**2), nu=0.0)
    if nu < 0.0:
        return None
    second = _second_opinion(system, Plate(material, plate.thickness), len(found.omega))
    longest = _longest(second.system.mesh) / system.frame.length
    value = (second.omega / system.frame.rate) ** 2
    lower = value / (1.0 + MORLEY**2 * value * longest**4 / (1.0 - nu))
    bounds = np.column_stack([np.sqrt(lower) * system.frame.rate, found.omega])
    bounds *= np.array([1.0 - ALGEBRA, 1.0 + ALGEBRA])
    return bounds


def _second_opinion(system: System, plate: Plate, n_modes: int) -> Spectrum:
    """Modes of the same body on Morley elements, as many unknowns as are cheap."""
    mesh = system.mesh
    morley = assemble(mesh, plate, system.supports, "morley")
    if mesh.recipe is not None:
        factor = (MORLEY_UNKNOWNS / morley.n_dofs) ** 0.5
        if abs(factor - 1.0) > 0.1:
            morley = reassemble(morley, mesh.refined(factor))
    return solve(morley, n_modes, None)


def _longest(mesh: Mesh) -> float:
    """Longest side [m] of any triangle."""
    corners = mesh.points[mesh.cells]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
