"""Blows one after another on a body that goes on moving: rolls, flams, ruffs and ostinati."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .._base.explained import heading_line, lines_of_notes
from .._base.threads import one_thread
from ..impact import collision, promise
from ..impact.collision import Touch
from ..impact.compiled import layout, record
from ..impact.contact import Contact
from ..impact.engine import TOLERANCE
from ..impact.error import Error
from ..impact.history import Impact
from ..impact.quantities import words
from ..impact.response import Response, Totals
from ..impact.state import State
from ..impact.striker import Striker
from ..modes.modal import Modes
from . import audit, planner
from .budget import Budget

LOG = logging.getLogger(__name__)
EACH = 0.5  # [-] of the tolerance for each blow by itself; as much is left for what it inherits from those before
LISTED = 20  # [-] impacts listed in a summary


class Stroke(NamedTuple):
    """One blow of a sequence."""

    when: float  # [s] time at which the striker is at the surface
    striker: Striker
    contact: Contact
    at: Any  # (dimension,) [m] strike point
    speed: float  # [m/s] of the striker's contact point towards the body
    # [s] after which the striker is lifted, as soon as it does not touch; None: when it has parted for good
    lasts: float | None = None

    @property
    def lifted(self) -> float:
        """When the striker is to be lifted [s]."""
        return np.inf if self.lasts is None else self.when + self.lasts


@dataclass(frozen=True, eq=False, repr=False)
class Strokes(Totals, check.Locked):
    """Blows one after another on one body: what `fi.strokes` found."""

    target: Modes
    strokes: tuple[Stroke, ...]  # in order of time
    starts: np.ndarray  # (n_hits,) [s] when each of `hits` begins
    hits: tuple[Response, ...]  # the blows; one for several strikers that are on the body together
    strikers: tuple[tuple[int, ...], ...]  # the strokes that make up each of `hits`, in the order of its contacts
    tolerance: float  # [-] requested
    notes: tuple[str, ...] = field(default=(), repr=False)

    @property
    def at(self) -> np.ndarray:
        """The first strike point, (dimension,) [m]."""
        return self.target.point("at", self.strokes[0].at)[0]

    @cached_property
    def impacts(self) -> tuple[Impact, ...]:
        """All impacts in order of their start; the number of the stroke stands for the contact."""
        found: list[Impact] = []
        for start, hit, strokes in zip(self.starts.tolist(), self.hits, self.strikers):
            for each in hit.impacts:
                stroke, begin, end = strokes[each.contact], start + each.start, start + each.end
                pressed = (i for i, old in enumerate(found) if old.contact == stroke and old.separation_speed is None)
                i = next(pressed, None)  # the run was cut while this one lasted
                if i is None or each.start > 0.0:
                    found.append(replace(each, start=begin, end=end, contact=stroke))
                else:
                    peak = max(found[i].peak_force, each.peak_force)
                    whole = found[i].impulse + each.impulse
                    last = each.separation_speed
                    found[i] = replace(found[i], end=end, peak_force=peak, impulse=whole, separation_speed=last)
        return tuple(sorted(found, key=lambda impact: (impact.start, impact.contact)))

    @cached_property
    def time(self) -> np.ndarray:
        """Times [s] of `force`, (n_times,)."""
        return np.concatenate([start + hit.time for start, hit in zip(self.starts, self.hits)])

    @cached_property
    def force(self) -> np.ndarray:
        """Sum of the contact forces [N] at `time`, (n_times,)."""
        return np.concatenate([hit.force if hit.force.ndim == 1 else hit.force.sum(axis=1) for hit in self.hits])

    def spectrum(self, frequencies: Any) -> np.ndarray:
        """Fourier transform of `force` [N s], (n_frequencies,), complex."""
        asked = check.array("frequencies", frequencies, (None,), "Hz", lift=True)
        turns = np.exp(-2j * np.pi * np.outer(self.starts, asked))
        return np.einsum("hf,hf->f", turns, np.array([hit.spectrum(asked) for hit in self.hits]))

    def parts(self, times: np.ndarray) -> list[tuple[Response, slice, np.ndarray]]:
        """The blow that determines the motion at each of ascending times: it, its times, and these from its start."""
        edges = np.append(np.searchsorted(times, self.starts[1:]), len(times))
        first, found = 0, []
        for start, hit, last in zip(self.starts, self.hits, edges.tolist()):
            if last > first:
                found.append((hit, slice(first, last), np.maximum(times[first:last] - start, 0.0)))
            first = last
        return found

    def _ascending(self, times: Any) -> tuple[np.ndarray, np.ndarray]:
        """Times in ascending order, and the order that leads back."""
        asked = check.array("times", times, (None,), "s", lift=True)
        if asked.size and asked.min() < self.starts[0]:
            raise ValueError(f"times must not be before the first stroke at {self.starts[0]:g} s, got {asked.min():g}")
        order = np.argsort(asked, kind="stable")
        return asked[order], np.argsort(order, kind="stable")

    def _moved(self, times: Any, width: int, motion: Callable[[Response, np.ndarray], np.ndarray]) -> np.ndarray:
        """A motion (n_times, width) put together from those of the blows, each at times from its start."""
        sorted_times, back = self._ascending(times)
        found = [motion(hit, part) for hit, _, part in self.parts(sorted_times)]
        return np.concatenate([np.zeros((0, width)), *found])[back]

    def modal_state(self, times: Any) -> tuple[np.ndarray, np.ndarray]:
        """Modal displacements and velocities of the body, (n_times, n_modes); see `Response.modal_state`."""
        n = self.target.n_modes
        both = self._moved(times, 2 * n, lambda hit, part: np.hstack(hit.modal_state(part)))
        return both[:, :n], both[:, n:]

    @check.typed
    def displacement(self, points: Any, times: Any, *, residual: bool = True) -> np.ndarray:
        """Displacement [m] of the body, (n_times, n_points); see `Response.displacement`."""
        place = self.target.points("points", points)
        return self._moved(times, len(place), lambda hit, part: hit.displacement(place, part, residual=residual))

    @check.typed
    def velocity(self, points: Any, times: Any, *, residual: bool = True) -> np.ndarray:
        """Velocity [m/s] of the body, (n_times, n_points); see `Response.displacement`."""
        place = self.target.points("points", points)
        return self._moved(times, len(place), lambda hit, part: hit.velocity(place, part, residual=residual))

    def state(self, time: float) -> State:
        """Where the body and the strikers then on it are at a time [s]; see `Response.state`."""
        start, (hit, _, part) = self.starts[0], self.parts(self._ascending([time])[0])[0]
        return replace(hit.state(float(part[0])), time=time - start)

    @property
    def error(self) -> float:
        """The largest estimated error of a blow [-], with what it inherits from those before."""
        return max(hit.error.total for hit in self.hits)

    @property
    def tolerance_met(self) -> bool:
        """Whether the estimated error of every blow is at most the tolerance."""
        return self.error <= self.tolerance

    @property
    def promise(self) -> str:
        """One sentence: whether the tolerance is met and, if not, by which blow and what would meet it."""
        worst = max(range(len(self.hits)), key=lambda i: self.hits[i].error.total)
        hit = self.hits[worst]
        if self.tolerance_met:
            wanted = words(hit.quantities)
            return f"tolerance {self.tolerance:g} met by all: estimated error {self.error:.1e} of {wanted}"
        strokes = " and ".join(str(i) for i in self.strikers[worst])
        return f"stroke {strokes} at {self.starts[worst]:.4g} s: {hit.promise}{_instead(hit.promise)}"

    @property
    def hardest(self) -> int:
        """Index of the blow with the largest force, in which the model errs most."""
        return max(range(len(self.hits)), key=lambda i: self.hits[i].peak_force)

    @property
    def trusted(self) -> bool:
        """Whether every blow meets its tolerance and the hardest one is trusted, see `Response.trusted`."""
        return self.tolerance_met and self.hits[self.hardest].trusted

    @property
    def verdict(self) -> str:
        """The sentence of `promise`, and whether the model holds in the hardest blow."""
        which = " and ".join(map(str, self.strikers[self.hardest]))
        return f"{self.promise}; in the hardest, stroke {which}, {self.hits[self.hardest].model_verdict[0]}"

    @property
    def energies(self) -> dict[str, float]:
        """Energies [J]: of the body at the start, brought by the strikers that arrived, of the body and of its contacts
        as the last blow ends, lost to damping and contacts until then, and what is left, which the strikers have.
        """  # fmt: skip
        first, last = self.hits[0], self.hits[-1]
        arrived = [self.strokes[i] for i in {i for strokes in self.strikers for i in strokes}]
        found = {
            "start": float(first.modal_energy([0.0])[0].sum()),
            "brought": sum(0.5 * each.striker.felt_mass * each.speed**2 for each in arrived),
            "target": float(last.modal_energy([last.history.end_time])[0].sum()),
            "contact": last.energies["contact"],
            "dissipated": sum(hit.energies["dissipated"] for hit in self.hits),
        }
        for hit, after in pairwise(self.hits):  # as it swings freely until the next blow
            ends = hit.modal_energy([hit.history.end_time])[0] - after.modal_energy([0.0])[0]
            found["dissipated"] += float(ends.sum())
        rest = found["start"] + found["brought"] - sum(found[name] for name in ("target", "contact", "dissipated"))
        return {**found, "taken away": rest}

    def summary(self) -> str:
        """The sequence in a few readable lines."""
        within = "no impact"
        if self.impacts:
            n, end = self.n_impacts, self.impacts[-1].end
            within = f"{n} impact{'s' * (n != 1)} in {end - self.starts[0]:.4g} s"
        n = len(self.strokes)
        lines = [self.verdict, *heading_line(self.verdict), f"{n} stroke{'s' * (n != 1)}, {within}"]
        lines += [
            f"  {each.start * 1e3:10.4f} to {each.end * 1e3:10.4f} ms: stroke {each.contact}, peak "
            f"{each.peak_force:.5g} N, impulse {each.impulse:.5g} N s"
            for each in self.impacts[:LISTED]
        ]
        if self.n_impacts > LISTED:
            lines.append(f"  ... and {self.n_impacts - LISTED} more")
        energies = ", ".join(f"{name} {value:.4g} J" for name, value in self.energies.items())
        lines += [
            f"contact time {self.contact_time * 1e3:.5g} ms, peak force {self.peak_force:.5g} N, impulse "
            f"{self.impulse:.5g} N s",
            f"energy {energies}",
            f"after the last blow: {self.hits[-1].outcome}",
        ]
        return "\n".join([*lines, *lines_of_notes(self.notes)])


def _instead(said: object) -> str:
    """What to give to a stroke instead of a number of impacts, if words about a blow advise that."""
    return "; to a stroke, give a short lasts instead" if "max_impacts" in str(said) else ""


@dataclass(eq=False)
class _Stick:
    """A striker on the body, as it moves when the next blow begins."""

    number: int
    striker: Striker
    q: np.ndarray
    p: np.ndarray
    doubt: np.ndarray  # as one of `State.doubts`
    force: np.ndarray = field(default_factory=lambda: np.zeros(2))  # [N], [N/s] at its contact and its rate
    pressed: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))  # as in `State`
    memory: np.ndarray = field(default_factory=lambda: np.zeros(2))  # of its contact, as in `State`


@check.typed
@one_thread
def strokes(
    modes: Modes,
    strokes: Sequence[tuple[float, Striker, Contact, Any, float] | tuple[float, Striker, Contact, Any, float, float]],
    *,
    tolerance: float = TOLERANCE,
    quantity: Any = None,
    residual: bool = True,
    duration: float | None = None,
    start: State | Response | None = None,
    strict: bool = False,
) -> Strokes:
    """Strike a body again and again while it goes on moving: rolls, flams, ruffs, ostinati, two sticks at once.

    Parameters
    ----------
    modes : Modes
        The struck body.
    strokes : sequence of (when, striker, contact, at, speed) or (when, striker, contact, at, speed, lasts)
        When the striker is at the surface [s], wherever that then is, with which speed [m/s], and after which time [s]
        it is lifted, as soon as it does not touch. Without ``lasts`` it stays until it has parted for good (proved);
        then it is taken away as the next stroke begins. Strikers that are on the body together act together. A contact
        that yields or is felt remembers while its striker stays; every stroke finds it new.
    tolerance, quantity, residual, strict
        As in `fi.strike`, for every blow with what it inherits from those before.
    duration : float [s], optional
        Time after the first stroke at which everything stops at the latest.
    start : State or Response, optional
        Where an earlier blow left the body, as in `fi.strike`.

    Returns
    -------
    Strokes
        ``hits`` are the single blows; motion, force and sound are those of all.

    Examples
    --------
    >>> drum = fi.analytic.disk(0.18, edge="clamped", mass=0.1, first_frequency=150.0, n_modes=40, damping_ratio=0.01)
    >>> stick, law = fi.Striker.rigid(0.02), fi.Contact.linear(1e5)
    >>> flam = fi.strokes(drum, [(0.0, stick, law, (0.05, 0.0), 0.3), (0.03, stick, law, (0.06, 0.0), 2.0)],
    ...                   tolerance=1e-2)
    >>> len(flam.hits), flam.impacts[-1].contact, flam.peak_force > 20.0
    (2, 1, True)
    """
    if not isinstance(strokes, (list, tuple)) or not 0 < len(strokes) <= 100_000:  # above a day of drumming
        raise ValueError(
            "strokes must be a list of (when, striker, contact, at, speed) or, to be lifted, with lasts, got "
            f"{check.shown(strokes)}"
        )
    given = []
    for i, stroke in enumerate(strokes):
        name = f"strokes[{i}]"
        if not isinstance(stroke, (list, tuple)) or len(stroke) not in (5, 6):
            raise ValueError(f"{name} must be (when, striker, contact, at, speed), got {check.shown(stroke)}")
        one = Stroke(*stroke)
        check.instance(f"{name} striker", one.striker, Striker)
        check.instance(f"{name} contact", one.contact, Contact)
        when = check.between(f"{name} when", one.when, -1e5, 1e5, "s")  # a day, beside which a contact still counts
        speed = check.positive(f"{name} speed", one.speed, "m/s")
        lasts = one.lasts if one.lasts is None else check.positive(f"{name} lasts", one.lasts, "s")
        if duration is None and lasts is None and one.striker.push @ one.striker.shape > 0.0:
            raise ValueError(f"{name} must have lasts, or duration be given: a hand or its weight keeps it pressing")
        given.append(Stroke(when, one.striker, one.contact, modes.point(f"{name} at", one.at)[0], speed, lasts))
    played = tuple(sorted(given, key=lambda stroke: stroke.when))
    tolerance = check.tolerance(tolerance)
    end = np.inf if duration is None else played[0].when + check.positive("duration", duration, "s")
    if end == played[0].when:
        raise ValueError(f"duration must not vanish beside the time of the first stroke, {end:g} s, got {duration:g} s")
    begun = start.state() if isinstance(start, Response) else start
    still = np.zeros(modes.n_modes)
    game = _Game(modes, played, played[0].when, still, still, np.zeros((2, modes.n_modes)))
    if begun is not None:
        if begun.force.any():
            raise ValueError(f"start must be a time when nothing touches; at {begun.time:.4g} s a force acts")
        game.q, game.p = begun.of(-1, "modes", modes)
        game.doubt = begun.doubts[-1]
    game.play_all(end, {"tolerance": EACH * tolerance, "quantity": quantity, "residual": residual})
    notes = tuple(dict.fromkeys(note for hit in game.hits for note in hit.notes))
    hits = tuple(replace(hit, tolerance=tolerance) for hit in game.hits)
    found = Strokes(modes, played, np.array(game.starts), hits, tuple(game.who), tolerance, notes)
    return promise.warn_if_missed(found, strict)


@dataclass(eq=False)
class _Game:
    """A sequence as it is played: the body and the strikers on it at the time reached, and the blows so far."""

    modes: Modes
    played: tuple[Stroke, ...]
    now: float  # [s]
    q: np.ndarray
    p: np.ndarray
    doubt: np.ndarray  # as one of `State.doubts`
    late: float = 0.0  # as `State.late`
    sticks: list[_Stick] = field(default_factory=list)
    starts: list[float] = field(default_factory=list)
    hits: list[Response] = field(default_factory=list)
    who: list[tuple[int, ...]] = field(default_factory=list)

    def play_all(self, end: float, rule: dict[str, Any]) -> None:
        """Follow all strokes until the last has parted for good or ``end`` [s]."""
        n_begun = 0
        while self.now < end:
            fresh = [i for i in range(n_begun, len(self.played)) if self.played[i].when <= self.now]
            n_begun += len(fresh)
            on = (*(stick.number for stick in self.sticks), *fresh)
            lifts = [self.played[i].lifted for i in on]
            to_come = [stroke.when for stroke in self.played[n_begun : n_begun + 1]]
            until = min([end, *to_come, *(lift for lift in lifts if lift > self.now)])
            limit = {
                "duration": None if np.isinf(until) else until - self.now,
                "max_impacts": 1 if any(lift <= self.now for lift in lifts) else None,
            }
            try:
                hit = self._blow(fresh, {**rule, **limit}) if lifts else self._alone()
            except SimulationError as problem:
                raise SimulationError(
                    f"stroke {' and '.join(map(str, on))} at {self.now:.4g} s: {problem}{_instead(problem)}"
                ) from None
            who = tuple(stick.number for stick in self.sticks)
            LOG.info("stroke %s at %.4g s: %d impacts", " and ".join(map(str, who)) or "none", self.now, hit.n_impacts)
            self.starts.append(self.now)
            self.hits.append(hit)
            self.who.append(who)
            over = self.hits[-1].history.status in (record.FINISHED, record.SETTLED)
            if (over and not to_come) or not self._go_on(until, over):
                return

    def _go_on(self, until: float, over: bool) -> bool:
        """Move on to where the last blow ended; False if nothing follows."""
        hit = self.hits[-1]
        length = until - self.now if over else hit.history.end_time
        self.now = self.now + length if hit.history.status == record.IMPACTS else until
        state = hit.state(length if over else None)
        self.q, self.p, self.doubt = state.displacements[-1], state.velocities[-1], state.doubts[-1]
        self.late = state.late
        found = []  # the strikers that stay on the body, as they move now
        for i, stick in enumerate(() if over else self.sticks):
            stroke = self.played[stick.number]
            if stroke.lifted <= self.now and not state.force[i].any():
                continue
            moving = state.displacements[i], state.velocities[i], state.doubts[i], state.force[i], state.pressed[i]
            found.append(_Stick(stick.number, stick.striker, *moving, state.memory[:, i]))
        self.sticks = found
        return bool(np.isfinite(self.now))

    def _blow(self, fresh: list[int], rule: dict[str, Any]) -> Response:
        """Run the strikers still on the body together with those that arrive now."""
        if not self.sticks and len(fresh) == 1:
            one = self.played[fresh[0]]
            start = None
            if self.hits or self.q.any() or self.p.any():
                free = np.zeros((0, 2))
                start = State(0.0, (self.modes,), (self.q,), (self.p,), free, 0.0, doubts=(self.doubt,))
            blow = partial(
                collision.strike, self.modes, one.striker, one.contact, at=one.at, speed=one.speed, start=start
            )
            hit = audit.with_examiner(planner.strike_by_plan(blow, rule))
            assert hit.striker is not None
            none = np.zeros(0)
            self.sticks = [_Stick(fresh[0], hit.striker, none, none, none)]
        else:
            sticks = [*self.sticks, *(self._arriving(i, rule) for i in fresh)]
            laws = tuple(self.played[stick.number].contact for stick in sticks)
            touches = [
                Touch(law, i, len(sticks), stick.striker.at[None], self.played[stick.number].at[None])
                for i, (law, stick) in enumerate(zip(laws, sticks))
            ]
            bodies = (*(stick.striker.body for stick in sticks), self.modes)
            q, p = (*(stick.q for stick in sticks), self.q), (*(stick.p for stick in sticks), self.p)
            forces = np.array([stick.force for stick in sticks])
            pressed = np.array([stick.pressed for stick in sticks])
            doubts = (*(stick.doubt for stick in sticks), self.doubt)
            memory = np.array([stick.memory for stick in sticks]).T
            start = State(0.0, bodies, q, p, forces, 0.0, None, laws, None, pressed, doubts, memory, self.late)
            movers = (*(stick.striker for stick in sticks), self.modes)
            hit = planner.strike_by_plan(partial(collision.collide_unjudged, movers, touches, start=start), rule)
            self.sticks = sticks
        return hit

    def _arriving(self, number: int, rule: dict[str, Any]) -> _Stick:
        """A striker at the surface, wherever that is now, with the modes that it needs."""
        one = self.played[number]
        striker = one.striker
        if not striker.fixed and rule["residual"]:
            tolerance = Budget(rule["tolerance"]).cheap
            needed = collision.striker_modes(striker, contact=one.contact, speed=one.speed, tolerance=tolerance)[0]
            striker = collision.shortened_striker(striker, needed)
        row, doubt = self.modes.shape_at(one.at[None])[0], np.zeros((2, len(striker.motion)))
        surface, doubt[0] = float(row @ self.q), (row @ self.doubt[0]) * striker.motion
        if self.hits:  # with the static deflection under those that press now
            surface = float(self.hits[-1].displacement(one.at[None], [self.now - self.starts[-1]])[0, 0])
        return _Stick(number, striker, surface * striker.motion, one.speed * striker.motion, doubt)

    def _alone(self) -> Response:
        """The body moving freely, as a blow without a touch."""
        hit, n = self.hits[-1], self.modes.n_modes
        h = hit.history
        history = replace(
            h, omega=self.modes.omega, zeta=self.modes.damping_ratio, shape=np.zeros((1, n)), offset=np.zeros(1),
            bias=np.zeros(n), law=h.law[:1].copy(), start_q=self.q, start_p=self.p, end_q=self.q, end_p=self.p,
            steps=h.steps[:0, : layout.HEAD + layout.WIDTH + 1], now=np.zeros((6, 1)), work=np.zeros(1), end_time=0.0,
            status=record.FINISHED,
        )  # fmt: skip
        q, p = self.q + self.doubt[0], self.p + self.doubt[1]
        moved = replace(history, start_q=q, start_p=p, end_q=q, end_p=p)
        error = Error(0.0, 0.0, 0.0, hit.error.resolvable, inherited=hit.error.total)
        return Response(
            (self.modes,), hit.contacts[:1], history, 0.0, hit.tolerance, hit.scheme, error,
            quantities=hit.quantities, runs=(history, moved),
        )  # fmt: skip
