"""What a map needs of the struck body: Ritz vectors at each strike point if they can carry its blows, or else modes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, identity, kept, progress
from ..fe import refinement
from ..fe.eigenvalues import Flexibility
from ..impact import accuracy
from ..impact.contact import Contact
from ..impact.error import Error
from ..impact.striker import Striker
from ..model import vectors
from ..model.asked import refine
from ..model.budget import FINEST, Budget
from ..model.by_modes import MOST_MODES
from ..model.planner import Blow
from ..model.target import FIRST_LOOK, Elements, Stages, Target
from ..model.vectors import RitzTarget
from ..modes.modal import Modes, damping_ratios
from ..modes.shapes import FieldShapes, SampledShapes
from .batches import allowed_error
from .cells import REACH, Case, checked_axes, sample_modes

Axes = Mapping[str, np.ndarray]
Views = Mapping[tuple[float, ...], Modes]
KINDS = kept.kinds(Modes, SampledShapes, left_out={"section"})  # of a file of vectors


def body_of(
    blow: Blow,
    over: Mapping[str, Any],
    *,
    tolerance: float,
    alone: bool = True,
    store: str | Path | None = None,
    stages: Stages | None = None,
) -> tuple[Case, dict[str, np.ndarray]]:
    """The blow that all cells of a map share, on a body described as well as its cells need, and the map's axes.

    A body given by its modes keeps them. ``over`` and ``tolerance`` as in `sweep`. ``alone``: only the numbers of the
    blows are wanted, with the residual compliance; otherwise modes are found. A file beside a ``store`` keeps the
    vectors or the modes; the same map later reads them from there.
    """
    target, stages = blow.target, stages or Stages()
    keep = None if store is None else Path(store).with_name(f"{Path(store).name}.modes.npz")
    speed = check.positive("speed", blow.arguments["speed"], "m/s", reach=REACH)

    def started(modes: Modes) -> Case:
        with target.blame("strike"):
            return Case(modes, blow.striker, blow.contact, modes.point("at", blow.arguments["at"])[0], speed)

    if target.modes is not None:
        case = started(target.finished(target.modes))
        return case, checked_axes(case, over)
    if alone and vectors.vectors_usable(target):
        case = started(outline(target, stages))
        axes = checked_axes(case, over)
        reduced = by_vectors(target, case, axes, tolerance=tolerance, stages=stages, keep=keep)
        if reduced is not None:
            return reduced, axes
    with stages("modes"):
        first = target.find(2 * FIRST_LOOK, tolerance=tolerance, stages=stages)  # a map has harder blows than one
    case = started(target.surrounded(first))
    axes = checked_axes(case, over)
    with stages("modes"):
        return _by_modes(target, case, axes, tolerance, keep), axes


def outline(target: Target, stages: Stages) -> Modes:
    """What stands for a plate until its vectors are known: it has its points, its mass and one frequency, 1 rad/s."""
    system = target.system or target.assembled(stages)
    flexibility = Flexibility.of(system)
    shapes = FieldShapes(system, np.zeros((system.n_dofs, 1)), flexibility)
    return Modes(np.ones(1), np.zeros(1), shapes, target.mass)


def corners(axes: Axes) -> list[dict[str, Any]]:
    """Values of the axes at every combination of their ends; all strike points count as ends."""
    ends = [values if name == "at" else np.unique([values.min(), values.max()]) for name, values in axes.items()]
    return [dict(zip(axes, chosen)) for chosen in product(*ends)]


def _by_modes(target: Target, case: Case, axes: Axes, tolerance: float, keep: Path | None) -> Case:
    """The blow on as many modes as the shortest contact of the map needs."""
    modes = case.modes
    needed = max(
        needed_frequency(corner, tolerance) * modes.frequencies[-1] / corner.modes.frequencies[-1]
        for corner in (case.with_values(values) for values in corners(axes))
    )
    if needed <= modes.frequencies[-1]:
        return case
    number, most = math.ceil(accuracy.number_of_modes(modes, needed)), MOST_MODES[target.kind]
    if number > most:
        raise check.SimulationError(
            f"the shortest blow of the map needs about {number} modes, at most {most} are allowed; leave out the "
            "lightest strikers and the stiffest contacts, or take a larger tolerance"
        )
    first = None
    if keep is not None and target.kind == "fe":
        first = target.find(FIRST_LOOK, tolerance=tolerance)  # what is kept starts from its mesh
    more = target.find(number, tolerance=tolerance, first=first, keep=keep)
    return replace(case, modes=target.surrounded(more))


def needed_frequency(case: Case, tolerance: float) -> float:
    """Frequency [Hz] up to which a blow needs modes to meet the tolerance."""
    return accuracy.cutoff_frequency(
        case.modes, case.at, contact=case.contact, mass=case.striker.felt_mass, speed=case.speed,
        tolerance=Budget(tolerance).half,
    )  # fmt: skip


def by_vectors(
    target: Target, case: Case, axes: Axes, *, tolerance: float, stages: Stages, keep: Path | None = None
) -> Case | None:
    """The blow on Ritz vectors that carry every cell of a map; None if no mesh allowed or a point struck forbids it.

    ``target`` as of `vectors.vectors_usable`, ``case`` on any modes of it, ``axes`` as of `cells.checked_axes`,
    ``keep`` a file. Vectors and mesh may take what the time steps leave of the tolerance of every cell. The shortest
    contact of all cells chooses shift and first mesh. A few cells, those of the shortest and the longest contact among
    them, are struck with all vectors, with fewer and on a coarser mesh; the errors decide on more vectors or a finer
    mesh, as that of a single blow does.
    """
    if "target_frequency" in axes:
        first = target.finished(target.first_flexible)
        case = replace(case, first=float(first.frequencies[first.omega > 0.0][0]))
    points = axes.get("at", case.at[None])
    views: Views | None = None
    if keep is not None:
        shapes, striker, ratio = case.modes.shapes, case.striker, target.damping_ratio
        assert isinstance(shapes, FieldShapes)
        system, frame = shapes.system, shapes.system.frame
        key = identity.identify([  # everything that determines the vectors
            striker.modes.omega, striker.felt_mass, striker.shape, vars(case.contact), case.speed, tolerance, case.at,
            case.first, target.mass, dict(target.scale), target.size_stated,
            damping_ratios(0.0 if ratio is None else ratio, np.geomspace(1.0, 1e7, 50)), list(axes.items()),
            identity.program(), system.K.data, system.M.data, [frame.length, frame.stiffness, frame.inertia],
        ])  # fmt: skip
        views = (kept.unpack(keep, key, KINDS) or {}).get("views")
    if views is None:
        others = {name: values for name, values in axes.items() if name != "at"}
        rng = np.random.default_rng(0)  # the same map gives the same vectors
        number = max(4, math.ceil(10 / len(points)))  # of cells that judge them: each costs several whole blows
        chance = [{name: rng.choice(values) for name, values in others.items()} for _ in range(number - 2)]
        views = Sized(target, case, corners(others), chance, tolerance).views(points, stages)
        if keep is not None and views is not None:
            kept.pack(keep, key, KINDS, views=views)
    if views is None:
        return None
    return replace(case, modes=views[tuple(points[0].tolist())], at=points[0], views=views)


def of_hammers(
    target: Target, at: Any, ends: Sequence[Mapping[str, float]], chance: Sequence[Mapping[str, float]],
    tolerance: float, n_modes: int, stages: Stages,
) -> list[Modes]:  # fmt: skip
    """The body as blows of rigid hammers with linear tips at each point need it.

    ``ends`` and ``chance`` as in `Sized`, of "mass" and "stiffness"; only whether a second impact follows matters.
    """
    if target.modes is None and vectors.vectors_usable(target):
        shape = outline(target, stages)
        points = shape.points("at", at)
        case = Case(shape, Striker.rigid(ends[0]["mass"]), Contact.linear(1.0), points[0], 1.0)
        views = Sized(target, case, ends, chance, tolerance, max_impacts=2).views(points, stages)
        if views is not None:
            return [views[tuple(point.tolist())] for point in points]
    modes = target.modes
    if modes is None:
        with stages("modes"):
            if target.air:  # each mode more costs much there: as many as the bandwidth needs
                first = target.finished(target.find(FIRST_LOOK, tolerance=tolerance))
                case = Case(first, Striker.rigid(1.0), Contact.linear(1.0), first.point("at", at), 1.0)
                needed = max(needed_frequency(case.with_values(values), tolerance) for values in chance)
                n_modes = min(n_modes, max(FIRST_LOOK, math.ceil(accuracy.number_of_modes(first, needed))))
            modes = target.find(n_modes, tolerance=tolerance, stages=stages)
    return [target.surrounded(modes)] * len(np.atleast_2d(at))


@dataclass(frozen=True, eq=False)
class Sized:
    """Many blows at one point, and what they ask of the vectors there."""

    target: Target
    case: Case  # what the blows share
    ends: Sequence[Mapping[str, float]]  # values of the axes; the shortest and the longest contact are among them
    chance: Sequence[Mapping[str, float]]  # values of the axes of other blows by which the vectors are judged
    tolerance: float  # [-]
    max_impacts: int | None = None  # what follows does not matter
    blows: Sequence[Mapping[str, float]] = ()  # values of the axes of those that are struck
    reduced: RitzTarget | None = None
    tried: dict[tuple[int, int], list[float]] = field(default_factory=dict)  # truncation errors of each point and blow

    def at(self, modes: Modes, point: np.ndarray, values: Mapping[str, float]) -> Case:
        """One blow on a body of given modes."""
        return replace(self.case, modes=modes, at=point, views={}).with_values(values)

    def raised(self, values: Mapping[str, float]) -> float:
        """Factor [-] by which an axis raises every frequency of the body in a blow."""
        wanted = values.get("target_frequency")
        return 1.0 if wanted is None or self.case.first is None else wanted / self.case.first

    def views(self, points: np.ndarray, stages: Stages) -> Views | None:
        """The target as excited at each point (n_points, 2) [m], reduced to it; None if that is impossible."""
        resonance = [self.case.with_values(values).resonance / self.raised(values) for values in self.ends]
        size, mesh = vectors.size_for(self.target, max(resonance), self.tolerance), self.target.mesh
        assert mesh is not None
        if not self.target.size_stated and size < refinement.smallest_size(self.target.element, mesh):
            return None
        extreme = [self.ends[int(np.argmax(resonance))], self.ends[int(np.argmin(resonance))]]
        views: dict[tuple[float, ...], Modes] = {}
        # of more points on a mesh, each adds elements that shrink towards it; fewer make more meshes
        for start in range(0, len(points), 8):
            progress.report("points", start, len(points))
            some = points[start : start + 8]
            elements, fixed = Elements(size), self.target.size_stated
            reduced = RitzTarget(self.target, some, max(resonance), self.tolerance, elements, fixed, stages)
            if reduced.at_rest:
                return None
            one = replace(self, reduced=reduced, tried={})
            for blows in (extreme, [*extreme, *self.chance]):
                _, _, found = refine(replace(one, blows=blows), Sized._judged, stages)
            views |= {tuple(point.tolist()): sample_modes(modes, point[None]) for point, modes in zip(some, found)}
        return views

    def found(self, stages: Stages, keep: Any = None) -> "tuple[Sized, list[Modes]]":
        """The same, and the target as excited at each point."""
        assert self.reduced is not None

        def cutoff(point: np.ndarray, modes: Modes, margin: float) -> float:
            """Highest frequency [Hz] that any blow at a point needs of some modes, with a safety factor."""
            needed = []
            for values in self.ends:
                case = self.at(modes, point, values)
                allowed = Budget(self.tolerance, case.contact.rated, margin).for_left_out
                law: dict[str, Any] = {"contact": case.contact, "mass": case.striker.felt_mass, "speed": case.speed}
                limit = accuracy.tail_cutoff(case.modes, point[None], tolerance=allowed, **law)
                needed.append(limit / self.raised(values))
            return max(needed)

        return self, [self.reduced.needed_modes(partial(cutoff, point), i) for i, point in enumerate(self.reduced.at)]

    def refined(self, error: Error, stages: Stages) -> "Sized | None":
        """The same with more vectors or a finer mesh, whichever the errors of its blows require."""
        assert self.reduced is not None
        return self if self.reduced.improved(error, self.tolerance - allowed_error(self.tolerance)) else None

    def _judged(self, found: list[Modes], stages: Stages) -> tuple[Error, list[Modes]]:
        """The errors of the blows at all points, and the target as excited at each.

        A blow that more vectors do not make any better is given up, as it would be alone, and does not stop the others.
        """
        assert self.reduced is not None
        errors, lost = [], False
        with stages("strike"):
            for (i, modes), (n, values) in product(enumerate(found), enumerate(self.blows)):
                before = self.tried.setdefault((i, n), [])
                if vectors.is_hopeless(before):
                    continue
                case, close = self.at(modes, self.reduced.at[i], values), max(FINEST, Budget(self.tolerance).cheap)
                try:
                    error = case.blow(tolerance=close, max_impacts=self.max_impacts).error
                    errors.append((error.truncation, error.mesh))
                except check.SimulationError:  # nothing is known of a blow that fails
                    errors.append((0.0, 0.0))
                before.append(errors[-1][0])
                lost |= vectors.is_hopeless(before)
        if lost:
            self.reduced.tried.clear()  # the others have not been tried as often
        worst = np.sort(np.array(errors or [(0.0, 0.0)]), axis=0)  # (n_struck, 2)
        # but for two of ten, as beside a cell with another number of impacts no error is small
        return Error(0.0, *worst[len(worst) - 1 - int(0.2 * len(worst))].tolist()), found
