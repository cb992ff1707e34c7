"""`fit`: the hammer, contact and structure that explain measured taps."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .._base.rounding import SAME
from ..fe import plausible
from ..impact.contact import Contact
from ..impact.striker import Striker
from ..modes.modal import Modes
from . import nested, predictions, solver, triggers, windows
from .found import Found, Watch, with_profiles
from .nested import Inner
from .records import Taps
from .rig import Rig
from .solver import Problem
from .unknowns import TIME, Setting, Unknown, checked


class Starts(NamedTuple):
    """Where the searches of a fit begin, and who watches them."""

    most: int
    rng: np.random.Generator
    watch: Watch | None
    inner: Inner | None  # a smaller model, where they begin, too


@check.typed
def fit(
    taps: Any,
    *,
    target: Modes | None = None,
    at: Any = None,
    striker: Striker,
    contact: Any,
    unknown: Mapping[str, Any],
    known: Mapping[str, float] | None = None,
    per_tap: Any = (),
    response_at: Any = None,
    anti_alias: Any = "delta-sigma",
    tip_mass: float = 0.0,
    resonance: float | None = None,
    window: Any = None,
    starts: int = 5,
    smaller: Found | None = None,
    robust: bool = True,
    profiles: bool = True,
    rng: Any = 0,
    watch: Watch | None = None,
) -> Found:
    """Find the hammer, contact and structure that explain measured taps.

    Parameters
    ----------
    taps : Taps
        Of `fi.read_taps` or `fi.measure`. Speed and onset of each are found too.
    target : Modes, optional
        The struck body, from finite elements, formulas or a universal file; without it, a wall or the unknown modes.
    at : strike point on the target, (dimension,) [m]
    striker : Striker
        A hammer; a rigid one may get a mode by ``striker.first_frequency`` and ``striker.mode_ratio`` (square of its
        deflection at the tip over that of the rigid motion).
    contact : Contact or sequence of Contact
        Several laws are compared by how well they predict taps left out; the best is returned.
    unknown : mapping of name to (low, high)
        ``contact.stiffness``, ``contact.exponent``, ``contact.loss`` or any other number of a `Contact`
        (``contact.hysteresis`` and ``contact.relaxation`` of felt, ``contact.yield_approach``, ``contact.depth``, ...),
        ``striker.mass``, ``striker.first_frequency``, ``striker.mode_ratio``, ``striker.damping``,
        ``striker.tip_mass``, ``target.mass``, ``target.first_frequency``, ``target.damping``, ``target.x``,
        ``target.y`` (strike point), and for up to six modes of an unknown target ``mode1.frequency``, ``mode1.mass``
        (modal mass at the strike point), ``mode1.damping``, ``mode1.gain`` (deflection where the response is measured
        over that at the strike point). In SI units.
    known : mapping of name to value, optional
        The same names, held.
    per_tap : str or sequence of str
        Names of ``unknown`` of which every tap gets a value of its own, as it has of speed and onset, because nobody
        strikes the same spot twice: ``"contact.stiffness"``, ``"target.x"``. What is found for the name is then their
        mean (of logarithms, if the range is positive), with their spread. A tap left out is predicted with its own
        value fitted to it.
    response_at : array_like, (n_points, dimension) [m], optional
        Where the accelerations in ``taps`` were measured; with an unknown target, any value stands for its ``gain``.
        Without it, only the force is compared.
    anti_alias, tip_mass, resonance
        Of the rig, as in `fi.measure`.
    window : (before, after) [s], optional
        What is compared around each onset; by default the pulses and 1.5 times their length after them.
    starts : int
        Searches from different points of the ranges, 64 at most; up to three times as many if all of them end poorly.
        Further ones begin where the model without the last unknown mode, or without that of a springy head, ends.
    smaller : Found, optional
        The fit of a model inside this one to the same taps, where searches begin, too; in place of the former. If none
        of them gets below its sum of squares, it is what is returned, with a note.
    robust : bool
        Whether a tap that the others predict badly, beyond its own noise, is left out and named.
    profiles : bool
        Whether to follow the likelihood profiles at once; otherwise when first asked for.
    rng : seed or numpy Generator
    watch : callable, optional
        Called with the number of steps done and of all steps.

    Returns
    -------
    Found

    Raises
    ------
    ValueError
        If a name, range or tap is invalid.
    SimulationError
        If no start in the ranges makes a blow that ends.

    Examples
    --------
    >>> wall, hammer = fi.Modes.rigid(1e4), fi.Striker.rigid(0.1)
    >>> hits = [fi.strike(wall, hammer, fi.Contact.hertz(2e8), at=None, speed=v) for v in (0.5, 1.0, 1.5)]
    >>> taps = [fi.measure(hit, rate=25600.0, noise=2e-3, rng=i) for i, hit in enumerate(hits)]
    >>> law, ranges = fi.Contact.hertz(1e8), {"contact.stiffness": (1e6, 1e10)}
    >>> found = fi.fit(taps, striker=hammer, contact=law, unknown=ranges)
    >>> low, high = found.interval("contact.stiffness", 0.9)
    >>> low < 2e8 < high, round(high / low, 1)
    (True, 1.0)
    """
    striker.let_go("a fit")
    given = windows.join_tables(taps)
    levelled = windows.level_offsets(given)
    laws = [contact] if isinstance(contact, Contact) else list(check.tuple_of("contact", contact, Contact))
    held = {name: check.number(name, value) for name, value in check.table("known", known).items()}
    names = [checked(unknown, target, striker, law, held) for law in laws]
    if both := [name for name in held if name in unknown]:
        raise ValueError(f"known and unknown both name {both[0]}")
    each = check.texts("per_tap", [per_tap] if isinstance(per_tap, str) else per_tap)
    for name in each:
        check.one_of("per_tap", name, unknown)
    n_points, points = _measured_at(levelled, target, response_at)
    cut, noise, notes = _usable_taps(levelled, window, n_points)
    if target is None and at is not None:
        raise ValueError("at must be left out without a target, which is then a wall or its unknown modes")
    place = None if target is None else target.point("at", at)[0]
    rig, impulse = Rig(cut.rate, anti_alias, tip_mass, resonance), float(np.mean(cut.impulse))
    inner = None if smaller is None else _inner(smaller, cut, n_points)
    begin = Starts(check.count("starts", starts, high=solver.STARTS), check.generator(rng), watch, inner)
    settings = [
        Setting(target, place, striker, law, rig, own, points, n_points, impulse) for law, own in zip(laws, names)
    ]
    found = [
        _fit(
            setting, cut, noise, [*levelled.notes[len(given.notes) :], *notes], known=held, per_tap=each,
            robust=robust, begin=begin,
        )
        for setting in settings
    ]  # fmt: skip
    if len(found) > 1:
        scores = [predictions.rms_error(each.left_out()) for each in found]
        kinds = {1.0: "linear", 1.5: "Hertz"}
        named = {
            kinds.get(law.exponent, f"power {law.exponent:g}") + " with loss" * bool(law.loss) + law.law.words: score
            for law, score in zip(laws, scores)
        }
        found = [replace(found[int(np.argmin(scores))], compared=named)]
    return with_profiles(found[0]) if profiles else found[0]


def _measured_at(taps: Taps, target: Modes | None, response_at: Any) -> tuple[int, Any]:
    """Number of responses that are compared, and the points of a known target where they are measured."""
    if response_at is None:
        return 0, None
    n_points = taps.response.shape[2]
    if not n_points or set(taps.units) != {"m/s^2"}:
        raise ValueError(f"response_at needs accelerations among the taps, got units {taps.units}")
    points = None if target is None else target.points("response_at", response_at)
    if points is not None and len(points) != n_points:
        raise ValueError(f"response_at must be {n_points} points, one for each response, got {len(points)}")
    return n_points, points


def _usable_taps(taps: Taps, window: Any, n_points: int) -> tuple[Taps, np.ndarray, list[str]]:
    """The taps that can be compared, cut to the window; their noise over the peak; and why others are left out.

    Of each, ``n_points`` responses are compared.
    """
    notes = []

    def without(taps: Taps, bad: np.ndarray, why: str, advice: str) -> np.ndarray:
        if bad.any():
            notes.append(f"left out, because their {why}: {', '.join(taps.labels[i] for i in np.flatnonzero(bad))}")
        if bad.all():
            raise ValueError(f"taps must hold one at least whose {advice}")
        return ~bad

    def some(good: np.ndarray) -> np.ndarray:
        if not good.any():
            raise ValueError(f"taps must hold one at least that can be compared; {'; '.join(notes)}")
        return good

    good = without(
        taps, taps.impulse <= 0.0, "force never pushes", "force pushes; a negative one has the wrong sign"
    )  # fmt: skip
    good &= without(
        taps, triggers.pulls(taps.force), "force pulls as it pushes, which no contact does",
        "force pushes more than it pulls; name the channel of the force, force="
    )  # fmt: skip
    good &= without(
        taps, taps.cut_short, "record begins or ends within a pulse", "record holds its whole pulse; trigger earlier"
    )  # fmt: skip
    gaps = triggers.filled(taps.force, taps.response)[:, 0]
    good &= without(
        taps, gaps, "force stands still amid a pulse, as where lost samples were filled", "force has no gap"
    )  # fmt: skip
    taps = taps.pick(some(good))
    cut, noise = windows.cut_to_window(taps, window), taps.noise / taps.peak
    whole = without(cut, cut.overload, "force is cut off", "force is not cut off")
    still = np.count_nonzero(triggers.is_still(cut.response[:, :, :n_points]), axis=1) > 0
    whole &= without(cut, still, "response does not change", "responses all change; leave out dead channels, response=")
    return cut.pick(some(whole)), noise[whole], notes


def _fit(
    setting: Setting, cut: Taps, noise: np.ndarray, notes: list[str], *, known: Mapping[str, float],
    per_tap: list[str], robust: bool, begin: Starts,
) -> Found:  # fmt: skip
    """The fit of one contact law to taps whose noise over the peak is (n_taps,)."""
    length = solver.pulse_length(cut)
    # the contact time is sought within a factor of 30 of the measured one
    time = Unknown(TIME, length / 30.0, length * 30.0)
    free = tuple(time if each.name == "contact.stiffness" else each for each in setting.unknown)
    own = [each.name for each, given in zip(free, setting.unknown) if given.name in per_tap]
    data = windows.data(cut, setting.n_points, np.ones((1, 1 + setting.n_points)))
    problem = Problem(setting, data, free, known, tuple(own) if cut.n_taps > 1 else ())
    if data.values.size <= problem.n_values:
        raise ValueError(f"taps hold {data.values.size} samples, too few for {problem.n_values} values")
    best, minima, inner = _search(problem, cut, length, begin)
    part = problem.residual(best.x).reshape(data.values.shape)
    spread = np.sqrt(np.square(part).mean(axis=(0, 2)))  # of each channel, the force first
    # noise of a first fit beyond that of the taps (n_taps,) is the model's and counts alike for all
    model = max(0.0, float(np.median(np.square(part[:, 0]).mean(axis=1) - noise**2)))
    sureness = 1.0 / np.sqrt(np.maximum(noise**2 + model, 1e-300))
    if sureness.max() <= 1.5 * sureness.min():  # less is how well the noise of short rests is known
        sureness = np.ones(len(noise))
    sureness /= np.sqrt(np.mean(sureness**2))
    weights = sureness[:, None] * spread[0] / np.maximum(spread, 1e-300)
    if (weights != 1.0).any():
        problem = replace(problem, data=windows.data(cut, setting.n_points, weights))
        best = solver.solve(problem, best.x)
        minima = (best.cost,)
    used, outliers = list(range(cut.n_taps)), {}
    # of two taps that disagree, either may be wrong
    while robust and len(used) > max(3, (1.0 - solver.MOST_OUTLIERS) * cut.n_taps):
        alone = predictions.predict_left_out(problem, best.x, cut.pick(used))
        each, of_peak = np.array([(one.error, one.error_of_peak) for one in alone]).T
        # what a tap's own noise, known to about a half, explains is no fault of the others
        beyond = each * np.sqrt(np.maximum(0.0, 1.0 - (1.5 * noise[used] / of_peak) ** 2))
        worst = int(beyond.argmax())
        others = [i for i in range(len(used)) if i != worst]
        without, begun = problem.among(others, best.x)
        solved = solver.solve(without, begun)
        fewer = Found(cut, tuple(used[i] for i in others), {}, without, solved, (solved.cost,), (), {})
        # rare by chance: a tap that the others predict worse than this times the median of their own errors
        if beyond[worst] <= 4.0 * float(np.median(fewer.errors)):
            break
        outliers[cut.labels[used[worst]]] = float(each[worst])
        used, problem, best, minima = list(fewer.used), without, solved, fewer.minima
    stuck = False
    if inner is not None:
        problem, best, stuck = nested.never_worse(problem, best, inner.among(used, problem.data), notes)
    # ridges promise up to a hundredth of the sum of squares
    if not best.ended and solver.promised_fall(problem, best) > 0.01 * best.cost:
        notes.append(f"the search had not ended after {solver.ENOUGH} steps: narrow the ranges, or raise starts")
    notes += plausible.note_number("tap", float(np.mean(problem.speeds(best.x))))
    values = problem.values(best.x)
    notes += [
        f"{each.name} is {values[each.name]:.3g} in the best fit, outside its range of {each.low:g} to {each.high:g}"
        for each in problem.setting.unknown
        if not each.low * (1.0 - SAME) <= values[each.name] <= each.high * (1.0 + SAME)
    ]
    return Found(cut, tuple(used), outliers, problem, best, minima, tuple(notes), {}, begin.watch, stuck)


def _inner(smaller: Found, cut: Taps, n_points: int) -> Inner:
    """The model of another fit; ValueError if that is of other taps."""
    data, shape = smaller.problem.data, (cut.n_taps, 1 + n_points, len(cut.time))
    if data.values.shape != shape or not np.allclose(data.impulse, cut.impulse, rtol=SAME, atol=0.0):
        raise ValueError(
            f"smaller must be a fit to the same {cut.n_taps} taps, none of them left out, in the same window and with "
            "the same responses; fit it anew with robust=False"
        )
    return Inner("what smaller lacks", smaller.problem, smaller.best.x)


def _search(
    problem: Problem, taps: Taps, length: float, begin: Starts
) -> tuple[solver.Solution, tuple[float, ...], Inner | None]:
    """The best of several searches, the sums of squares of all, and the smaller model that some of them began with.

    They begin with what all taps share. A mode more never fits worse: searches begin where the model without the last
    mode ends, too.
    """
    common = replace(problem, own=())
    begun = solver.starts(common, length, taps.impulse, begin.rng)
    found: list[solver.Solution] = []
    # an rms of the residual of 6 % of the records' is above the noise of usual ones: after a poorer fit the search goes
    # on, up to three times as long; then the model is wrong rather than the start
    poor = 0.06**2 * float(np.square(problem.data.values).sum())
    for i, x in enumerate(begun[: 3 * begin.most]):
        if i >= begin.most and found and min(one.cost for one in found) < poor:
            break
        try:
            found.append(solver.solve(common, x, solver.QUICK, solver.NEARLY))
        except SimulationError:
            continue
        finally:
            if begin.watch is not None:
                begin.watch(min(i + 1, begin.most), begin.most)
    apart = np.zeros(len(problem.own) * taps.n_taps)
    found = [replace(one, x=np.append(one.x, apart)) for one in found]
    inner, less = begin.inner, nested.smaller_problem(common) if begin.inner is None else None
    if less is not None:
        inner = Inner(*less, _search(less[1], taps, length, Starts(1, begin.rng, None, None))[0].x)
    for x in [] if inner is None else nested.embed_fit(problem, inner):
        with suppress(SimulationError):
            found.append(solver.solve(problem, x, solver.QUICK, solver.NEARLY))
    if not found:
        raise SimulationError("no search ended: blows in the ranges of unknown do not end; narrow the ranges")
    found.sort(key=lambda one: one.cost)
    going = found[:1] + [one for one in found[1:2] if not one.ended]
    finished = [solver.solve(problem, one.x) for one in going]
    best = min(finished, key=lambda one: one.cost)
    return best, tuple(one.cost for one in [*finished, *found[len(finished) :]]), inner
