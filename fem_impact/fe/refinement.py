"""Find the lowest modes of a system without missing any, and refine the mesh until their estimated error is small."""

import hashlib
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.ndimage import maximum_filter1d
from scipy.optimize import brentq

from .._base import check, identity
from .._base import kept as keeping
from .._base.rounding import EPSILON, SAME
from .._base.threads import one_thread
from ..mesh import mesh_files
from ..mesh.meshes import MOST_CELLS, Mesh
from . import plausible, ribs, shallow
from .assembly import BY_ELEMENT, assemble, reassemble
from .corners import SAY
from .eigenvalues import BLOCK, FIRST_SLICE, RESIDUAL, STRICT, Flexibility, by_slices, count_below, krylov, lowest
from .material import stiffness_by_way
from .section import Plate
from .supports import support_of_facets
from .system import System
from .theory import Theory

COARSER = 1.5  # [-] ratio of element sizes whose frequencies are compared: less than half the unknowns
# [-] the same ratio where triangles are halved, at the blow and where a plate is curved: one halving more
FLATTER = 2.0
ERROR_OF_WAVE = (8e-7, 3.3)  # [-] a smooth frequency's error is at most 8e-7 (kh)**8, growing slower above kh = 3.3
# [-] factor of the edge length in Weyl's law, fact: 1 + Gamma(3/4) / (sqrt(pi) Gamma(5/4)) clamped; free for nu = 0.3
EDGE_TERM = {"clamped": 1.76, "hinged": 1.0, "soft hinged": 1.0, "free": -1.71}
CLAIMED = 2.0  # [-] factor on error estimates, which are 0.3 to 4 times the true error; test_residual.py
MORLEY = 0.2574578  # [-] error constant of Morley interpolation, over h**2 (Carstensen and Gallistl 2014)
# [-] triangles that take little time to solve, so that fewer are not worthwhile; point loads start with as many
CHEAP_CELLS = 700
LOOSEST = 0.1  # [-] largest tolerance of frequencies
MOST_UNKNOWNS = 150_000  # [-] refinement gives up beyond this size
# [-] powers of the size with which the parts of the error fall: 8 of smooth shapes less a reserve, at curved rims, at
# steps of the thickness
ORDERS = 7.5, 5.0, 1.0
# [-] smallest ratio of element sizes between two meshes: a tenth more triangles; with less the mesh may not change
LEAST_STEP = 1.05


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Eigenpairs of a system, rigid motions first."""

    system: System
    flexibility: Flexibility
    omega: np.ndarray  # (n_modes,) [rad/s]
    vectors: np.ndarray  # (n_dofs, n_modes) [-] mass-normalised in the frame of the system
    # (5, n_modes) [-] relative error of omega from elements, curved edges, steps of the thickness, and what no mesh
    # cures: corners and rounding, and a rise that is known at points only
    parts: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """Estimated relative error of omega, (n_modes,) [-]."""
        return self.parts.sum(axis=0)


def other_rise(section: Any) -> Any:
    """Another rise of a section through the points at which its own is known; None if that is a function."""
    return getattr(getattr(section, "rise", None), "otherwise", None)


def with_other_rise(system: System) -> System | None:
    """The system with its rise off by as much as it may be, on the same triangles; None if the rise is a function."""
    rise = other_rise(system.section)
    return rise and reassemble(replace(system, section=replace(system.section, rise=rise)), system.mesh)


def note_on_rise(parts: np.ndarray) -> tuple[str, ...]:
    """How uncertain the rise between its points leaves frequencies, by the parts of their errors."""
    unsure = 100.0 * float(parts[4].max(initial=0.0))
    if unsure <= 100.0 * SAY:
        return ()
    said = f"the rise between the points where it is known leaves frequencies uncertain by {unsure:.2g} % at most"
    return (f"{said}, whatever the mesh, each by its `frequency_error`",)


def unknowns(element: str, mesh: Mesh, size: float) -> float:
    """Number of unknowns [-] on a mesh of the same outline with another element size [m]."""
    return BY_ELEMENT[element].unknowns * mesh.area / size**mesh.dimension


def smallest_size(element: str, mesh: Mesh) -> float:
    """Element size [m] of the same outline with as many unknowns as are allowed."""
    return float((unknowns(element, mesh, 1.0) / MOST_UNKNOWNS) ** (1.0 / mesh.dimension))


def _wave(system: System, n_modes: int | None, max_frequency: float | None) -> float:
    """Wavenumber [rad/m] of the shortest wave among the modes wanted."""
    mesh, frame = system.mesh, system.frame
    if max_frequency is not None:
        rate, softest = 2.0 * np.pi * max_frequency, system.softness * frame.inertia / frame.stiffness
        if not system.rules.thick:
            return float((softest * rate**2) ** 0.25)
        section, points = system.section, mesh.points  # the thick wave is shorter, but not by more than this
        shear = np.linalg.eigvalsh(section.shear(points).reshape(len(points), mesh.dimension, -1)).min(axis=1)
        return float((softest**0.5 * rate + rate**2 * (section.inertia(points) / shear).max()) ** 0.5)
    assert n_modes is not None
    if mesh.dimension == 1:
        return float(np.pi * (n_modes + 1) / np.ptp(mesh.points))
    # Weyl's law: the number of modes grows with the area; a held edge lowers it, a free edge raises it
    edge = mesh.perimeter * EDGE_TERM["hinged"]
    if system.rim is not None:
        ends = system.rim.points[system.rim.facets]
        length = frame.length * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        edge = float(length @ [EDGE_TERM[kind] for kind in system.rim.kinds])
    mean = float((edge + np.sqrt(edge**2 + 16.0 * np.pi * mesh.area * n_modes)) / (2.0 * mesh.area))
    assert isinstance(system.section, Plate)
    # waves across the grain are shorter than the mean
    stiffness = stiffness_by_way(system.section.material.plane_stress)
    return mean * float((np.mean(stiffness**-0.5) ** -2 / stiffness.min()) ** 0.25)


def solve_on_mesh(system: System, n_modes: int | None, max_frequency: float | None) -> Spectrum:
    """Find the lowest modes on the mesh as it is: a given number, or all below a frequency [Hz], counted by inertia.

    The last of their errors are rounding and unresolved corners, and the rise between points.
    """
    flexibility, omega, whole = _pairs(system, n_modes, max_frequency)
    parts, flexible = np.zeros((5, len(omega))), omega > 0.0
    if flexible.any():
        values, vectors = (omega[flexible] / system.frame.rate) ** 2, whole[:, flexible]
        parts[:3, flexible] = CLAIMED * 0.5 * system.rules.errors(system, vectors, vectors * values) / values
        if system.rules.compared:
            # each mode of five in a row is stated to have the largest error of them: two meshes may agree by chance
            different = _compared(system, omega)[:, flexible] / omega[flexible]
            parts[::4, flexible] += maximum_filter1d(different, 5, axis=1)
        vectors, squares = flexibility.bent(vectors)[0], system.K.multiply(system.K)
        rounding = 0.5 * EPSILON * np.sqrt(np.einsum("ij,ij->j", vectors**2, squares @ vectors**2)) / values
        # three standard deviations of a random walk, and what the eigensolver leaves
        parts[3, flexible] = 3.0 * rounding + RESIDUAL**2 + _missed_at_corners(system, vectors, values)
    return Spectrum(system, flexibility, omega, whole, parts)


def _pairs(
    system: System, n_modes: int | None, max_frequency: float | None
) -> tuple[Flexibility, np.ndarray, np.ndarray]:
    """Frequencies (n_modes,) [rad/s] and vectors (n_dofs, n_modes) of `Spectrum`, without their errors."""
    flexibility = Flexibility.of(system)
    n_rigid, rate = system.rigid.shape[1], system.frame.rate
    limit = None if max_frequency is None else (2.0 * np.pi * max_frequency / rate) ** 2
    mass = shallow.whole_mass(system)
    if n_modes is None:
        assert limit is not None
        # of ribbed plates, as a drift spares some of their mass, there are no more below
        n_modes = count_below(system.K, mass.whole, limit)
        if n_modes == 0:
            raise ValueError(f"max_frequency must reach the first mode; there is none below {max_frequency:g} Hz")
    if n_modes <= n_rigid:
        values, vectors = np.zeros(0), np.zeros((system.n_dofs, 0))
    else:
        n = n_modes - n_rigid
        if system.mesh.dimension == 1 and n > FIRST_SLICE:
            values, vectors = by_slices(flexibility, n)
        else:
            values, vectors = _complete_eigenpairs(system, flexibility, mass, n, limit)
        if system.strain is not None:  # more accurate than K if there are tiny triangles
            values = system.strain.energy(system, vectors) / np.einsum("ij,ij->j", vectors, mass @ vectors)
            order = np.argsort(values, kind="stable")
            values, vectors = values[order], vectors[:, order]
    omega = np.concatenate([np.zeros(n_rigid), np.sqrt(values) * rate])[:n_modes]
    if max_frequency is not None:
        omega = omega[omega <= 2.0 * np.pi * max_frequency]
    vectors = np.column_stack([system.rigid, vectors])[:, : len(omega)]
    return flexibility, omega, vectors


def solve_or_read(
    system: System, n_modes: int | None, max_frequency: float | None, path: str | Path | None
) -> Spectrum:
    """Call `solve_on_mesh` and save the result in a file, if any; a later call for the same modes of it reads that."""
    if path is None:
        return solve_on_mesh(system, n_modes, max_frequency)
    if Path(path).is_dir() or not Path(path).parent.is_dir():
        raise ValueError(f"keep must be a file in a folder that exists, got {check.shown(path)}")
    frame = system.frame  # the matrices are the same for every size, thickness and material
    sizes = frame.length, frame.stiffness, frame.inertia
    asked = repr((n_modes, max_frequency, system.element, *sizes, identity.program())).encode()
    matrices: Any = system.K, system.M
    numbers = [part for A in matrices for part in (A.data, A.indices, A.indptr)]
    key = hashlib.sha256(b"".join([asked, *(part.tobytes() for part in numbers)])).hexdigest()
    names = ("omega", "vectors", "parts")
    arrays = keeping.read_arrays(Path(path), key)
    if arrays is not None:
        return Spectrum(system, Flexibility.of(system), *(arrays[name] for name in names))
    found = solve_on_mesh(system, n_modes, max_frequency)
    keeping.write_arrays(Path(path), key, {name: getattr(found, name) for name in names})
    return found


def _missed_at_corners(system: System, vectors: np.ndarray, values: np.ndarray) -> np.ndarray | float:
    """Estimated relative errors (n_modes,) of frequencies by what the triangles at singular corners cannot follow.

    The energy within a distance r grows as a power of r that the corner's exponent gives. So the energy in the second
    ring shows what the innermost triangles, half as far, would hold, and that they hold little of. Frequencies are too
    high by it, so that an error near one over the frequency found is more over the true one.
    """
    if system.strain is None or not system.graded:
        return system.unresolved if system.unresolved > SAY else 0.0
    missed = np.zeros(len(values))
    for vertex, corner in system.corners.items():
        own = 0.5 * system.strain.around(system, vectors, vertex) / values / (2.0**corner.power - 1.0)
        if corner.free:
            own = np.minimum(own, corner.left / CLAIMED) if corner.left > SAY else 0.0
        missed += own
    return CLAIMED * missed / (1.0 - np.minimum(missed, 0.99))  # more would state errors above 200, which say nothing


def _compared(system: System, omega: np.ndarray) -> np.ndarray:
    """Estimated errors (2, n_modes) [rad/s] of frequencies of a thick or curved plate, from those on other triangles.

    The second is that of a rise that is known at points only, from another one through them on the same triangles.
    The order assumed, four, is less than that of smooth plates, whose errors are stated some three times too large. It
    is 1.5 if ribs end inside or at a free edge, where stresses in the plane are singular; 1 to 2 were measured.
    """
    mesh, n_modes = system.mesh, len(omega)
    if mesh.recipe is None:
        raise ValueError("mesh must be made with fi.mesh or loaded with fi.mesh.load for a thick or curved plate")
    for factor in (1.0 / COARSER, COARSER, COARSER**2):  # where edges curve, coarser meshes may be no coarser there
        other = mesh.refined(factor)
        ratio = (len(other.cells) / len(mesh.cells)) ** 0.5
        if max(ratio, 1.0 / ratio) > COARSER**0.5 and (factor > 1.0 or len(other.cells) > n_modes):
            break
    bent = not system.rules.thick
    layer = system.layer / (factor if not bent else FLATTER if factor > 1.0 else 1.0 / FLATTER)
    body = reassemble(system, other, layer=layer)
    if bent:  # the rise divides triangles, too
        ratio = (len(body.space.origin) / len(system.space.origin)) ** 0.5
    again = _pairs(body, n_modes, None)[1]
    kinds = support_of_facets(mesh, system.supports, system.rules.words)
    ends = ribs.singular_vertices(mesh, getattr(system.section, "ribs", ()), kinds)[0].values()
    order = 1.5 if any(1 in each for each in ends) else 4.0
    # where triangles at masses, springs and ends of ribs are most, as many of both meshes, only the others differ
    found = np.zeros((2, n_modes))
    found[0] = np.abs(again - omega) / max(abs(ratio**-order - 1.0), 1.0 - COARSER ** (-0.25 * order))
    raised = with_other_rise(body)
    if raised is not None:
        found[1] = np.abs(_pairs(raised, n_modes, None)[1] - again)
    return found


def _complete_eigenpairs(
    system: System, flexibility: Flexibility, mass: shallow.PlaneMass, n: int, limit: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """Find the n lowest flexible eigenpairs, with a ``mass`` as of `shallow.whole_mass`, without missing any.

    If a limit is given, n is the number of modes below it. Otherwise inertia confirms the number below a gap after the
    last mode. In a dense cluster the first search may miss some modes; it is then repeated for more modes, with a
    stricter residual, twice at most.
    """
    n_rigid = flexibility.rigid.shape[1]
    moving = np.count_nonzero(mass.whole.diagonal())
    available = moving - n_rigid
    if n > available:
        size = size_for(system, n + n_rigid, None)
        advice = f"elements of {size:.1g} m suffice"
        if len(system.mesh.cells) * (system.mesh.size / size) ** system.mesh.dimension > MOST_CELLS:
            advice = "no mesh allowed has enough"
        raise ValueError(
            f"size must be smaller or n_modes lower: elements of {system.mesh.size:g} m have {moving} unknowns "
            f"for {n + n_rigid} modes; {advice}"
        )
    more = min(n + (BLOCK if limit is None else 0), available)
    find = partial(_lowest_of_ribbed, flexibility, mass) if system.ribbed else partial(lowest, flexibility)
    for allowed in (RESIDUAL, STRICT, STRICT):
        values, vectors = find(more, allowed)
        if more == available:
            return values[:n], vectors[:, :n]
        if limit is not None:
            below, found = n, int((values < limit * (1.0 + 1e-12)).sum())
        else:
            gaps = np.diff(values[n - 1 :]) / values[n - 1 : -1]
            at = n - 1 + int(gaps.argmax())
            below, found = count_below(system.K, mass.whole, 0.5 * (values[at] + values[at + 1])) - n_rigid, at + 1
        # the count has the mass that drifts spare, too, and each of them may add one
        if below - mass.spared.shape[1] <= found <= below:
            return values[:n], vectors[:, :n]
        more = min(max(below, more) + 4 * BLOCK, available)
    raise check.SimulationError(
        f"{below} flexible modes lie below {np.sqrt(values[min(n, more) - 1]) * system.frame.rate / 2 / np.pi:g} Hz, "
        f"but {found} were found; ask for a few more modes"
    )


@one_thread
def _lowest_of_ribbed(
    flexibility: Flexibility, mass: shallow.PlaneMass, n: int, residual: float
) -> tuple[np.ndarray, np.ndarray]:
    """`lowest` of a ribbed plate, whose plane has mass and modes of its own; the inverse problem keeps the lowest."""
    # (n_sprung, n_dofs) orthonormal in all the mass: in that of the deflection they would mix with modes not found
    pulled = mass @ flexibility.sprung
    square = np.linalg.cholesky(flexibility.sprung.T @ pulled)
    sprung, pulled = np.linalg.solve(square, [flexibility.sprung.T, pulled.T])

    def unsprung(loads: np.ndarray) -> np.ndarray:
        found = flexibility.solve(loads - pulled.T @ (sprung @ loads))
        return found - sprung.T @ (pulled @ found)

    available = flexibility.K.shape[0] - flexibility.rigid.shape[1] - len(sprung)
    bent = krylov(unsprung, mass, min(n, available), available, residual)
    basis = np.column_stack([flexibility.solve(pulled.T), bent])  # what the springs bend comes with their motions
    energy, kinetic = flexibility.products(basis), basis.T @ (mass @ basis)
    unit = np.diag(energy) ** -0.5
    slowness, turn = eigh(0.5 * (kinetic + kinetic.T) * np.outer(unit, unit), energy * np.outer(unit, unit))
    slowness, turn = slowness[: -n - 1 : -1], turn[:, : -n - 1 : -1]
    return 1.0 / slowness, (basis * unit) @ (turn / np.sqrt(slowness))


def fine_enough(system: System, size: float, coarser: bool = False) -> System:
    """The system on a mesh of elements of a size [m]; unchanged if the user chose that size, or if it is finer already.

    If ``coarser`` meshes serve, too, a mesh file much finer than needed gives way to one.
    """
    mesh, finer = system.mesh, size < system.mesh.size
    coarser = coarser and size > mesh.size and len(mesh.cells) > CHEAP_CELLS
    if mesh.size_stated or not (finer or coarser):
        return system
    other = mesh.refined(mesh.size / size)
    # a mesh file's largest triangle sets its size, so a mesh refined to a smaller size can still have fewer cells
    more = len(other.cells) - len(mesh.cells)
    return reassemble(system, other) if (more > 0 if finer else more < 0) else system


def size_for(system: System, n_modes: int | None, max_frequency: float | None, side: float | None = None) -> float:
    """Size [m] of elements that resolve the shortest wave wanted; ``side`` [rad] is it times the wavenumber."""
    wave = _wave(system, n_modes, max_frequency)
    size = (side or system.rules.wave) / wave
    if system.rules.graded and side is None:  # a few modes cost little, so find them more accurately
        size = min(size, max(affordable_size(system.mesh), 1.1 / wave))  # errors of 2e-7, clamped 1e-5
    if isinstance(system.section, Plate) and system.section.tension:
        size = min(size, layer_size(system.frame.stiffness, system.section.tension, system.frame.length))
    return size


def side_for(rules: Theory, tolerance: float) -> float:
    """Size of elements times the wavenumber [rad] at which frequencies err by a tolerance, or by less."""
    if not rules.graded:
        return rules.wave
    factor, bend = ERROR_OF_WAVE
    excess = lambda log: np.log(factor / tolerance) + 8.0 * log - np.log1p((np.exp(log) / bend) ** 3)  # noqa: E731
    return float(np.exp(brentq(excess, -10.0, 10.0)))


def longest_side(rules: Theory, tolerance: float) -> float:
    """The same [rad] for modes that follow the first ones; these meet the tolerance, however small it is.

    Errors that need a second mesh are stated several times too large where the coarser hardly resolves the waves.
    """
    return max(rules.wave, side_for(rules, 0.2 * tolerance if rules.compared else tolerance))


def affordable_size(mesh: Mesh) -> float:
    """Size [m] of triangles that are so few on a plate that larger ones save nothing."""
    return (2.3 * mesh.area / CHEAP_CELLS) ** 0.5


def layer_size(stiffness: float, tension: float, extent: float) -> float:
    """Size [m] of elements that resolve the narrow bending layer at the edge of a stretched plate.

    ``stiffness`` [N m], ``tension`` [N/m], ``extent`` [m] of the body. Ten widths of the layer err by 3e-4 at most on a
    clamped disk; a fortieth of the extent makes some 4 000 triangles on a square.
    """
    return max(10.0 * (stiffness / tension) ** 0.5, extent / 40.0)


def refine(
    system: System, n_modes: int | None, max_frequency: float | None, tolerance: float, of_mesh: bool = False,
    enough: float = 0.0,
) -> Spectrum:  # fmt: skip
    """Find modes with an estimated relative error below a tolerance, refining the mesh as often as needed.

    If only the error ``of_mesh`` must be below it, that by a rise which is known at points may be larger. Where no mesh
    meets the tolerance, an error up to ``enough`` will do.

    The shortest wave sets the size of the first mesh. If edges or corners need a finer one, the estimated errors set
    the size of the next, which aims at 60 % of the tolerance. Where eight more do not suffice, rounding or corners hold
    the error; nor does anybody wait for more than four times the unknowns allowed, as predicted from how errors fell:
    rates grow as meshes resolve, and a rate half as large asks for the square of that. Of curved or ribbed plates,
    whose estimates scatter by a factor of two or three, meshes predict nothing, and each is finer by a fifth at least.
    """
    if system.mesh.recipe is None:
        raise ValueError(
            "tolerance needs a mesh that can be refined; make it with fi.mesh or load it with fi.mesh.load"
        )
    side = side_for(system.rules, tolerance)
    first = fine_enough(system, size_for(system, n_modes, max_frequency, side), coarser=True)
    found, size = solve_on_mesh(first, n_modes, max_frequency), np.inf
    tried: list[tuple[float, float]] = []  # size and error of each mesh
    bent = found.system.rules.compared and not found.system.rules.thick
    for left in reversed(range(9)):
        parts = found.parts[: 4 if of_mesh else 5]
        error = float(parts.sum(axis=0).max())
        if error <= tolerance:
            return found
        mesh = found.system.mesh
        step = max(_needed_factor(parts, 0.6 * tolerance), 1.2 if bent else 0.0)
        tried.append((mesh.size, error))
        predicted = 1.0 if bent else _predicted_step(tried, tolerance)
        if (
            not left
            or found.system.n_dofs * predicted**mesh.dimension > 4.0 * MOST_UNKNOWNS
            or not step < np.inf
            or found.system.n_dofs * step**mesh.dimension > MOST_UNKNOWNS
            or mesh.size >= size
        ):
            break
        size = mesh.size
        closer = max(step, FLATTER**0.5) if bent else step  # halves some triangles
        finer = reassemble(system, mesh.refined(step), layer=found.system.layer / closer)
        found = solve_on_mesh(finer, n_modes, max_frequency)
    if error <= enough:
        return found
    mode = int(found.error.argmax())
    least = float(f"{2.0 * found.error[mode]:.1e}")  # where corners hold the error, it differs from mesh to mesh
    slips = plausible.doubted_sizes(np.ptp(found.system.mesh.points, axis=0), found.system.section)
    none = f"no tolerance is: check the units, as {slips[0]}" if slips else f"no tolerance up to {LOOSEST:g} is"
    advice = f"a tolerance of {least:g} is met" if least <= LOOSEST else none
    advice += ", or ask for fewer modes"
    if found.system.unresolved > SAY:
        held = "no tolerance is, as corners hold that error on any mesh" if least > LOOSEST else advice
        advice = "; ".join([held, *found.system.mesh.notes])
    advice = "; ".join([advice, *note_on_rise(found.parts)])
    raise check.SimulationError(
        f"tolerance = {tolerance:g} is not met: mode {mode + 1} is uncertain by {found.error[mode]:.1e} with "
        f"{found.system.n_dofs} unknowns; {advice}"
    )


def _predicted_step(tried: list[tuple[float, float]], goal: float) -> float:
    """Factor [-] to divide the last size by, as errors fell on meshes of sizes and errors ``tried``; 1 if on one only.

    The faster of the rates since the first mesh and since the last but one counts; infinity if neither fell.
    """
    if len(tried) < 2:
        return 1.0
    sizes, errors = np.log(tried).T
    falls, shrinks = errors[[0, -2]] - errors[-1], sizes[[0, -2]] - sizes[-1]
    rate = float(np.max(np.divide(falls, shrinks, out=np.zeros(2), where=shrinks > 0.0)))
    with np.errstate(over="ignore"):
        return float(np.exp((errors[-1] - np.log(goal)) / rate)) if rate > 0.0 else np.inf


def _needed_factor(parts: np.ndarray, goal: float) -> float:
    """Factor [-] to divide the element size by so that errors (5, n_modes) meet a goal; infinity if no mesh can."""
    rest = parts[3:].sum(axis=0)
    if float(rest.max()) >= goal:
        return np.inf

    def excess(log: float) -> float:
        return float((np.exp(-log * np.array(ORDERS)) @ parts[:3] + rest).max()) - goal

    return max(LEAST_STEP, float(np.exp(brentq(excess, 0.0, -np.log(EPSILON))))) if excess(0.0) > 0.0 else LEAST_STEP


def enclosure(found: Spectrum) -> np.ndarray | None:
    """Guaranteed bounds of each frequency, (n_modes, 2) [rad/s], or None if no proof covers the body.

    Argyris elements on straight edges are conforming, so their eigenvalues are upper bounds. An eigenvalue lambda of
    Morley elements gives the lower bound lambda / (1 + c**2 lambda h**4 / (1 - nu)), where h is the longest side and
    c = 0.2574578 the constant of the Morley interpolation error. Without a free edge, nu counts as 0 here.

    References
    ----------
    Carstensen and Gallistl (2014), Numer. Math. 126, 33-51; Liu (2015), Appl. Math. Comput. 267, 341-355.
    """
    system = found.system
    plate, mesh = system.section, system.mesh
    if not isinstance(plate, Plate) or not plate.uniform or plate.material.E_across is not None or plate.tension:
        return None
    sprung = not all(isinstance(kind, str) for kind in system.supports.values())
    attached = sprung or system.point_masses or system.point_supports
    if attached or mesh.curved.any() or system.rim is None or system.element != "argyris":
        return None
    nu, material = plate.material.nu, plate.material
    if "free" not in system.rim.kinds:  # then nu only changes the rigidity, and nu = 0 gives the best bound
        nu, material = 0.0, replace(material, E=material.E / (1.0 - nu**2), nu=0.0)
    if nu < 0.0:
        return None
    morley = assemble(mesh, Plate(material, plate.thickness), system.supports, "morley")
    factor = (20_000 / morley.n_dofs) ** 0.5  # so many unknowns are cheap beside the modes themselves
    if mesh.recipe is not None and abs(factor - 1.0) > 0.1:
        morley = reassemble(morley, mesh.refined(factor))
    second = solve_on_mesh(morley, len(found.omega), None)
    longest = mesh_files.side_lengths(second.system.mesh.points, second.system.mesh.cells).max() / system.frame.length
    value = (second.omega / system.frame.rate) ** 2
    lower = value / (1.0 + MORLEY**2 * value * longest**4 / (1.0 - nu))
    bounds = np.column_stack([np.sqrt(lower) * system.frame.rate, found.omega])
    bounds *= np.array([1.0 - SAME, 1.0 + SAME])  # rounding and the eigensolver
    return bounds
