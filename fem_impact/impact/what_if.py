"""What if: a blow struck again with something changed shows what an error of that size does to it."""

import functools
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base.check import SimulationError
from .._base.rounding import SAME
from ..modes.modal import Modes
from . import accuracy, distance, engine
from .compiled import law, record
from .compiled.bundles import KernelSystem
from .contact import Contact
from .history import History
from .reduced_body import THINNED, ReducedBody, join_bodies, stretched_in
from .stepping import RINGING, Converged, Options

RESOLVABLE = 0.3  # [-] largest contact stiffness times residual compliance for which the error estimate holds


@dataclass(frozen=True, eq=False)
class Followed:
    """A blow whose steps were refined, ready to be followed again with something changed."""

    parts: Sequence[ReducedBody]
    laws: Sequence[Contact]
    system: KernelSystem
    options: Options
    pace: engine.Pace
    runs: Converged

    def again(self, parts: Sequence[ReducedBody], *, finely: bool = False, late: float | None = None) -> History:
        """The blow with these bodies, in the steps of the coarser run or, on request, of the finer.

        They may have moved and begin ``late`` [s]; by default contacts begin as they do in the blow itself.
        """
        last = max(0.0, self.options.last[0] - (late or 0.0)), self.options.last[1]
        how = self.runs.scheme, self.runs.steps[0 if finely else 1], self.pace, last
        system = join_bodies(parts, self.laws)
        if self.system.q.any():
            system = system._replace(offset=system.offset + self._apart(system, late is not None))
        return engine.run_system(system, *how, stretched_in(parts), within=self.runs.within)

    def _apart(self, system: KernelSystem, moved: bool) -> np.ndarray:
        """How much nearer (n_contacts,) [m] contacts must begin: what modes that are lacking had moved them, stays.

        Bodies that ``moved`` must not touch at contacts that were open: they would have parted a little later.
        """
        own, force = self.system, np.zeros(len(self.laws))
        stood, stand = (each.offset + each.shape @ each.q for each in (own, system))
        if moved:
            about = SAME * (np.abs(own.shape) @ np.abs(own.q))
            opened = (stood - law.dents(own.law) <= about) | (own.law["memory"] < 0.0)
            return np.where(opened, np.minimum(0.0, np.maximum(stood, 0.0) - stand), 0.0)
        for part in self.parts:
            force[[i for i, _ in part.touched]] = part.pressed[:, 0]
        return stood + (system.law["compliance"] - own.law["compliance"]) * force - stand

    def changed(self, body: int, part: ReducedBody) -> list[ReducedBody]:
        """The bodies, with one of them changed."""
        return [*self.parts[:body], part, *self.parts[body + 1 :]]

    @functools.cached_property
    def stiffness(self) -> list[float]:
        """Of every contact, as its duration determines it, and the modes that are slower [N/m]."""
        omega = np.pi / self.pace.duration
        mobility = np.maximum((self.system.shape**2) @ (self.system.omega <= omega), 1e-300)
        return (omega**2 / mobility).tolist()


@dataclass(frozen=True)
class Variation:
    """Changes of the bodies whose effect on the blow estimates an error."""

    cause: str  # a field of `Error`
    # the bodies as changed, and the error over the effect, in quantities and in restitutions of impacts: of ways to
    # make one change the worst counts, and all add up
    changes: Sequence[Sequence[tuple[Sequence[ReducedBody], float, float]]]
    least: float = 0.0  # [-] error at least, because two runs can agree by chance
    most_by_chance: float = np.inf  # [-] but in quantities at most this many times the error
    unchecked: float = 0.0  # [-] and in quantities at least this, of what no two runs check


def what_if(blow: Followed, variations: Sequence[Variation]) -> dict[str, np.ndarray]:
    """Estimated errors of a blow by cause, as of `distance.of_runs`: what each variation does to it.

    Of one that cannot be followed, as its bodies do not part, nothing is known, and it counts in full.
    """
    quantities, n = blow.options.quantities, blow.options.n_quantities
    none = np.zeros(len(blow.runs.error))
    errors: dict[str, np.ndarray] = {}
    for each in variations:
        for ways in each.changes:
            effects = []
            for parts, weight, parting in ways:
                try:
                    found = distance.of_runs(blow.again(parts), blow.runs.coarse, quantities, pace=blow.pace)
                    found[: n + 1] *= weight
                    found[n + 1 :] *= parting
                except SimulationError:
                    found = none + 1.0
                effects.append(found)
            if effects:
                errors[each.cause] = errors.get(each.cause, none) + np.maximum.reduce(effects)
        if each.least:
            found = errors.get(each.cause, none)
            least = none + each.least
            least[:n] = max(each.unchecked, min(each.least, each.most_by_chance * max(found[:n].tolist())))
            errors[each.cause] = np.maximum(least, found)
    return errors


def left_out_weight(ratio: float, damping_ratio: float) -> float:
    """Error of modes left out over the change by a highest frequency lower by ``ratio``, see `modes_left_out`."""
    return 1.0 / (ratio ** (1.0 if damping_ratio > RINGING else 2.0) - 1.0)


def modes_left_out(blow: Followed, bodies: Sequence[Modes]) -> tuple[Variation, bool]:
    """Upper modes replaced by their compliance, and whether what that does estimates the error.

    The error falls at least with the square of the highest kept frequency, with its first power if modes are
    overdamped, so the change bounds the error of the modes already left out. That in the restitution of an impact falls
    with the first power on average, but not steadily: with 1, claims lay below the truth in 12 % of 73 random impacts,
    with 1/2 in 2 % of 110, by a fifth at most.

    Two such runs and a minimum guard against a change that is small by chance: 30 % of the predicted error, the median
    over many blows, but at most ten times what the runs found. Where both differ by less, the prediction does not
    apply, as to contacts that outlast many periods of the modes left out; the truth was more in 2 of 715 random blows.
    Of bodies with so few modes that there are no two such runs the whole prediction counts in quantities: with 30 % of
    it 45 of 150 blows on beams known by two modes and their compliance erred by 1.3 to 3 times what was stated, with
    all of it none.
    The blow with a poorer description of a body that has modes above those of its own estimates the error, too.
    """
    omega_0, softness, looked = np.pi / blow.pace.duration, [0.0] * len(blow.laws), True
    predicted, unchecked = 0.0, 0.0  # of all bodies, and of those that no two runs check
    changes: list[list[tuple[Sequence[ReducedBody], float, float]]] = []
    for i, (part, modes) in enumerate(zip(blow.parts, bodies)):
        if not part.yields:
            continue
        above, expected = omega_0 / max(omega_0, part.omega[-1]), 0.0
        for (k, _), rest in zip(part.touched, part.rest.diagonal().tolist()):
            soft = blow.stiffness[k] * rest
            softness[k] += soft
            expected += float(accuracy.left_out_error(soft, above, blow.laws[k].exponent, part.points.shape[1]))
        known = modes.poorer and any(other.omega[-1] > modes.omega[-1] for other in modes.poorer.values())
        changes.append([])
        for thin, ratio in () if known else part.thinner:
            weight = left_out_weight(ratio, part.zeta[-1])
            changes[-1].append((blow.changed(i, thin), weight, 1.0 / (ratio**0.5 - 1.0)))
        both = len(changes[-1]) == len(THINNED)
        predicted, unchecked = predicted + expected, unchecked + expected * (not both and not known)
        looked &= both
    found = Variation("truncation", changes, 0.3 * predicted, 10.0 if looked else np.inf, unchecked)
    return found, max(softness) <= RESOLVABLE


def unstated_variations(blow: Followed, bodies: Sequence[Modes]) -> tuple[Variation, Variation]:
    """What nobody said of the bodies, see `Modes.unstated`.

    That is the most and the least that the modes left out of a body may yield, and the rigid motions that it may have,
    on springs too soft to matter; and shapes that were measured, larger or smaller by their errors, in each of the ways
    that these may go together.
    """
    changes, measured = [], []
    for i, (modes, part) in enumerate(zip(bodies, blow.parts)):
        if not modes.unstated or not len(part.touched):
            continue
        if part.doubt.any():
            own = np.diag(part.rest)
            kept = np.sqrt(np.maximum(0.0, 1.0 - part.doubt / np.where(own > 0.0, own, np.inf)))
            most, fewest = part.rest + np.diag(part.doubt), part.rest * np.outer(kept, kept)
            changes.append([(blow.changed(i, replace(part, rest=rest)), 1.0, 1.0) for rest in (most, fewest)])
        if part.spread is not None:
            either = np.concatenate([1.0 + part.spread, 1.0 - part.spread])
            others = part.rows * np.sqrt(np.maximum(0.0, either))
            measured.append([(blow.changed(i, replace(part, rows=rows)), 1.0, 1.0) for rows in others])
        if part.loose.size:
            changes.append([(blow.changed(i, part.loosened()), 1.0, 1.0)])
    return Variation("truncation", changes), Variation("measurement", measured)


def mesh_variation(blow: Followed, bodies: Sequence[Modes]) -> Variation:
    """Every frequency lowered and every compliance raised by its error due to the mesh, if any of them matters.

    Those below 1e-4 of the tolerance do not: the blow errs by as little. Being struck again, the estimate grows over
    several impacts as the true error does.
    """
    softer, worst = [*blow.parts], 0.0
    of_elements = [(i, modes) for i, modes in enumerate(bodies) if not modes.unstated]
    for i, modes in of_elements:
        part = blow.parts[i]
        for (contact, _), doubt in zip(part.touched, part.doubt.tolist()):
            worst = max(worst, blow.stiffness[contact] * doubt)
        worst = worst if modes.frequency_error is None else max(worst, modes.frequency_error.max())
    if worst <= 1e-4 * blow.options.tolerance:
        return Variation("mesh", ())
    for i, modes in of_elements:
        error, part = 0.0 if modes.frequency_error is None else modes.frequency_error, softer[i]
        softer[i] = replace(part, omega=part.omega / (1.0 + error), rest=part.rest + np.diag(part.doubt))
    return Variation("mesh", [[(softer, 1.0, 1.0)]])


def add_poorer_descriptions(blow: Followed, bodies: Sequence[Modes], errors: dict[str, np.ndarray]) -> None:
    """Add the errors that poorer descriptions of a body show: of each two blows that differ by one cause.

    For each cause the worst counts, because two descriptions can agree by chance; but only the first of each shows
    whether there may be other impacts. They run in fine steps, because the fastest modes of two descriptions differ,
    and so do their step errors.
    """
    for i, body in enumerate(bodies):
        (itself, _), *others = body.descriptions().items()
        runs: dict[frozenset[str], History | None] = {itself: blow.runs.fine}
        for lacking, other in others:
            runs[lacking] = None
            with suppress(SimulationError):
                runs[lacking] = blow.again(blow.changed(i, blow.parts[i].described_by(other)), finely=True)
        for cause, found in worst_differences(runs, functools.partial(_description_error, blow)).items():
            errors[cause] = errors.get(cause, 0.0) + found


def worst_differences(
    runs: Mapping[frozenset[str], Any], difference: Callable[[Any, Any, bool], np.ndarray]
) -> dict[str, np.ndarray]:
    """The largest difference by cause of any two runs, kept by what they lack, of which one lacks nothing else.

    ``difference`` of the better and the poorer run is given, too, whether they are the first for their cause.
    """
    worst: dict[str, np.ndarray] = {}
    for lacking, run in runs.items():
        for cause in lacking:
            if lacking - {cause} in runs:
                found = difference(runs[lacking - {cause}], run, cause not in worst)
                worst[cause] = np.maximum(worst.get(cause, 0.0), found)
    return worst


def _description_error(blow: Followed, better: History | None, poorer: History | None, first: bool) -> np.ndarray:
    """The error of a description of a body as another shows it; those that cannot be followed show nothing.

    One for every doubt about the number of impacts, and what else differs, is the part below a whole number.
    """
    n, one_more = blow.options.n_quantities, np.ones(len(blow.runs.error))
    if better is None or poorer is None:
        return 1.99 * one_more * first
    found = distance.of_runs(poorer, better, blow.options.quantities, pace=blow.pace)
    number = len(blow.runs.fine.contacts)
    if not first:
        same = len(better.contacts) == len(poorer.contacts) == number
        return np.append(found[:n] if same else np.zeros(n), np.zeros(len(one_more) - n))
    if len(better.contacts) != len(poorer.contacts):
        whole = distance.of_whole_runs(poorer, better, blow.pace)
        found[:n] += min(0.99, max((whole.get(name, 0.0) for name in blow.options.quantities), default=0.0))
    if len(better.contacts) != number:  # other impacts, of which nothing is known
        found = np.append(found[: n + 1], one_more[n + 1 :])
    if _may_touch(better, poorer, blow.pace.duration):
        found[:n] = 1.0 + max(found[:n].tolist())
        found[n:] += 1.0
    return found


def _may_touch(history: History, other: History, duration: float) -> bool:
    """Whether two descriptions of a blow differ so much in some flight that one more impact cannot be ruled out.

    Wherever the open contacts of the first come nearest, the gap must exceed the largest difference of the two motions
    since both ended the first impact. Looks ahead until all modes together cannot bridge the gap. ``duration`` [s] is
    that of one contact.
    """
    if history.bias.any() or history.status != other.status or not len(history.contacts) or not len(other.contacts):
        return False
    end = history.end_time
    if history.status == record.FINISHED:
        ahead = history.bridged()
        end += float(ahead[np.isfinite(ahead)].max(initial=0.0))
    start = max(float(found.contacts[:, 1].min()) for found in (history, other))
    end = max(start, end)
    times = np.linspace(start, end, int(min(engine.LOOKS[1], engine.LOOKS[0] * (end - start) / duration)) + 2)
    surface, opened = history.surfaces(times)
    approach, doubt = history.motion(times) - surface, np.zeros((len(times), 1))
    doubt[:, 0] = np.maximum.accumulate(np.abs(approach - other.motion(times) + other.surfaces(times)[0]).max(axis=1))
    nearest = np.zeros(approach.shape, bool)
    nearest[1:-1] = (approach[1:-1] >= approach[:-2]) & (approach[1:-1] >= approach[2:])
    nearest &= opened
    return bool((nearest & (approach > -doubt)).any())
