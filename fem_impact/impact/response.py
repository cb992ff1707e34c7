"""The result of a blow: the force history, the scalars derived from it, and the motion of all bodies at any time."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from .._base import check
from .._base.rounding import SAME
from ..fe import plausible
from ..modes.modal import Modes, SampledShapes, at_rest
from ..modes.stretching import stretch
from . import assumption, datasets, force_spectrum, gradient, in_words, promise, trust
from .assumption import Assumption
from .balance import Balance, momentum_error
from .compiled import record
from .contact import Contact
from .error import Error
from .history import History, Impact, mode_energy
from .quantities import USUAL
from .state import State
from .striker import Striker

# [-] two descriptions of one body may differ by this in mass and compliance: meshes do by less, other bodies by more
ONE_BODY = 1e-2
# [-] largest difference of descriptions up to which Ritz vectors tell a motion: as much as modes err that are found
# as far as the force reaches
MOVED = {"displacement": 1e-2, "velocity": 3e-2}
LASTS = 2.0  # [-] and no longer than this many times the run, as later echoes may be missing from all of them
LOOKED_AT = 200  # [-] times at which this error is estimated, evenly among those asked for; more only cost time


@dataclass(frozen=True, eq=False, repr=False)
class Ends(check.Locked):
    """Where the contacts of a blow act on a body, and what its kept modes lack of its static compliance there."""

    points: np.ndarray  # (n_ends, dimension) [m]
    touched: tuple[tuple[int, float], ...]  # contact, and sign: 1 for its first body, -1 for its second
    force: float  # [N] constant force at the first point
    rest: np.ndarray  # (n_ends, n_ends) [m/N] compliance of the modes left out; zero if the modes are complete
    forms: slice = field(default_factory=lambda: slice(0))  # modes of the run that stand for these; empty for a spring
    dip_force: float = 0.0  # [N] that constant force if it makes a spring that stands for them deflect
    speed: float = 0.0  # [m/s] with which the body arrives in rigid motion, at its first point
    doubtful: bool = False  # whether more than rounding is estimated of what is left out there


class Totals:
    """What the impacts of a blow, or of several, add up to."""

    impacts: Any  # of Impact, in order of their start

    @property
    def n_impacts(self) -> int:
        """Number of impacts."""
        return len(self.impacts)

    @property
    def contact_time(self) -> float:
        """Total contact time [s]."""
        return float(sum(impact.duration for impact in self.impacts))

    @property
    def impulse(self) -> float:
        """Total impulse of the contact forces [N s]."""
        return float(sum(impact.impulse for impact in self.impacts))

    @property
    def peak_force(self) -> float:
        """Largest contact force [N]."""
        return max((impact.peak_force for impact in self.impacts), default=0.0)


@dataclass(frozen=True, eq=False, repr=False)
class Response(Totals, check.Locked):
    """The result of `strike` or `collide`. Histories are exact between steps and after the end."""

    bodies: tuple[Modes, ...]
    contacts: tuple[Contact, ...]
    history: History
    speed: float  # [m/s] of the striker's contact point at the start; in `collide`, of the first moving body
    tolerance: float  # [-] requested
    scheme: str  # the scheme used
    error: Error
    striker: Striker | None = None
    at: np.ndarray | None = None  # (dimension,) [m] strike point
    ends: tuple[Ends, ...] = ()  # one per body
    quantities: Mapping[str, float | None] = field(default_factory=lambda: USUAL)  # that must meet it; bands [Hz]
    ringing: Modes | None = None  # modes of the target driven by the force, see `on`
    rings: Callable[["Response"], Modes] | None = field(default=None, repr=False)  # finds them when they are needed
    # examines whether the model itself is right, when that is asked for
    audit: Callable[["Response"], tuple[Assumption, ...]] | None = field(default=None, repr=False)
    vectors: Modes | None = field(default=None, repr=False)  # all Ritz pairs of the target, if it is described by them
    rebounds: np.ndarray | None = None  # (n_impacts,) [-] estimated errors of the restitutions of the impacts

    @check.typed
    def on(self, modes: Modes) -> "Response":
        """The same blow with the motion of the target, and its sound, from these modes, driven by the force found.

        Errors, energies and every number of the blow stay as they are.

        Parameters
        ----------
        modes : Modes of the target, at its own mass and scale

        Examples
        --------
        >>> plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
        >>> system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), plate, {"boundary": "hinged"})
        >>> hit = fi.strike(system, fi.Striker.rigid(0.03), fi.Contact.hertz(1e7), at=(0.1, 0.1), speed=1.0)
        >>> hit = hit.on(fi.find_modes(system, max_frequency=2000.0, damping_ratio=0.01))
        >>> hit.displacement([(0.2, 0.2)], [0.5]).shape  # half a second later
        (1, 1)
        """
        if self.at is None:
            raise ValueError("on needs a blow of `strike`, with one strike point")
        if self.moving:
            raise ValueError("on needs a blow on a body at rest: only its own modes know how this one moved before")
        point = modes.point("at", self.at)
        whole, softness = self.bodies[-1].shapes.compliance(point)[0, 0], modes.shapes.compliance(point)[0, 0]
        sampled = isinstance(modes.shapes, SampledShapes)  # it may not know the modes left out
        if not np.isclose(modes.mass, self.bodies[-1].mass, rtol=ONE_BODY) or not (
            sampled or np.isclose(softness, whole, rtol=ONE_BODY)
        ):
            raise ValueError(
                f"modes must be of the body struck, {self.bodies[-1].mass:g} kg that yield {whole:.4g} m/N, got "
                f"{modes.mass:g} kg and {softness:.4g} m/N"
            )
        return replace(self, ringing=modes, rings=None, vectors=None)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What the bodies assumed, and numbers that are allowed but probably a slip of a unit, in plain words."""
        striker = () if self.striker is None else self.striker.notes
        place = () if self.at is None else at_rest(self.bodies[-1], self.at[None])
        speed = tuple(plausible.number("speed", abs(self.speed)))
        return plausible.together(*(modes.notes for modes in reversed(self.bodies)), striker, speed, place)

    @property
    def margin(self) -> float:
        """How near the number of impacts is to another [-].

        Over the deepest approach: how far the bodies at least come apart between contacts, press each other in one, or
        stay apart where they nearly touch once more. Told up to 0.05; that much, too, for blows under constant forces.
        A margin below its error counts as a missed tolerance.
        """
        return float(self.history.margin)

    @property
    def tolerance_met(self) -> bool:
        """Whether the estimated error is at most the tolerance."""
        return self.error.total <= self.tolerance

    @property
    def promise(self) -> str:
        """One sentence on the computation: whether the tolerance is met and, if not, why and what would meet it."""
        return promise.sentence(self)

    @cached_property
    def trust(self) -> trust.Trust:
        """How far to trust each quantity asked for: errors of computation and model, what dominates, what to do.

        Examples
        --------
        >>> alloy = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thickness=1e-3)
        >>> sheet = fi.analytic.rectangle(0.6, 0.4, section=alloy, n_modes=200, damping_ratio=0.01)
        >>> hit = fi.strike(sheet, fi.Striker.rigid(0.05), fi.Contact.hertz(1e6), at=(0.2, 0.15), speed=0.5)
        >>> hit.tolerance_met, hit.trusted, hit.trust["restitution"].dominant
        (True, False, 'small deflections')
        """
        return trust.examine(self)

    @property
    def trusted(self) -> bool:
        """Whether the answer holds, and not only its computation.

        The tolerance is met, and the error of the model is known and at most 0.05, or the tolerance if that is larger,
        in every quantity asked for: what it stands on, such as contact law and speed, is seldom known better. A contact
        law given by its numbers is taken as stated, as material and damping are.
        """
        return self.trust.trusted

    @property
    def verdict(self) -> str:
        """The answer in one line: how well it is computed, whether the model holds, and what would help."""
        return trust.verdict(self)

    @cached_property
    def assumptions(self) -> tuple[Assumption, ...]:
        """Is the model itself right? What the blow assumes, and what each assumption does to the quantities asked for.

        Examples
        --------
        >>> block = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), thickness=0.05)
        >>> modes = fi.analytic.rectangle(0.1, 0.1, section=block, n_modes=50)
        >>> hit = fi.strike(modes, fi.Striker.rigid(0.1), fi.Contact.hertz(1e9), at=(0.05, 0.05), speed=1.0)
        >>> [(each.name, each.doubtful, each.state) for each in hit.assumptions][0]
        ('thin target', True, 'estimated')
        """
        return assumption.unexamined(tuple(self.quantities)) if self.audit is None else self.audit(self)

    @property
    def model_error(self) -> float:
        """Largest error of a quantity asked for by the assumptions [-]; what is not known is not in it, see `trust`."""
        return assumption.total(self.assumptions)

    @property
    def model_verdict(self) -> tuple[str, ...]:
        """Whether the model itself is right, as in `verdict`, and a line for each assumption that matters."""
        return tuple(assumption.lines(self.assumptions, self.tolerance))

    @property
    def target(self) -> Modes:
        """The struck body; in `collide` the last one.

        After a blow by Ritz vectors (see `strike`) these are its modes as far as the force found makes them ring; they
        are found when they are first needed.
        """
        return self._ringing or self.bodies[-1]

    @cached_property
    def _ringing(self) -> Modes | None:
        return self.rings(self) if self.ringing is None and self.rings is not None else self.ringing

    def _moved(self, body: int) -> Modes:
        """The modes whose motion is that of a body."""
        return self.target if body in (-1, len(self.bodies) - 1) else self.bodies[body]

    @cached_property
    def _rung(self) -> History:
        """The history of the modes that ring, under the same force."""
        modes = self._ringing
        assert modes is not None and self.at is not None
        still = np.zeros(modes.n_modes)
        shape = -modes.shape_at(self.at[None])
        bias = -self._push * shape[0]
        rest = {"start_q": still, "start_p": still, "end_q": still, "end_p": still, "bias": bias}
        driven: dict[str, Any] = {"omega": modes.omega, "zeta": modes.damping_ratio, "shape": shape, **rest}
        if self.history.stretched is not None:
            driven["stretched"] = replace(self.history.stretched, forms=stretch(modes).forms, first=0)
        return replace(self.history, **driven)

    @property
    def contact(self) -> Contact:
        """The contact law; in `collide` the first one."""
        return self.contacts[0]

    @property
    def impacts(self) -> tuple[Impact, ...]:
        """All impacts in order of their start."""
        return self.history.impacts

    @property
    def restitution_errors(self) -> tuple[float | None, ...]:
        """Estimated error of `Impact.restitution` of each impact, absolute [-]; None where there is no restitution.

        The tolerance does not count these: points part as fast as the bodies ring there, which is known less well than
        the restitution of the blow. None, too, of a simplified target, which does not ring, and where the modes left
        out govern the contact.
        """
        if self.rebounds is None or not self.error.resolvable or self.error.idealisation:
            return (None,) * self.n_impacts
        pairs = zip(self.impacts, self.rebounds.tolist())
        return tuple(None if impact.restitution is None else error for impact, error in pairs)

    @property
    def contact_times(self) -> tuple[float, ...]:
        """Time in contact [s] of each contact; they add up to `contact_time`."""
        return tuple(
            sum(impact.duration for impact in self.impacts if impact.contact == i)
            for i in range(self.history.n_contacts)
        )

    @property
    def touching_time(self) -> float:
        """Time [s] during which at least one contact is closed."""
        total, until = 0.0, -np.inf
        for impact in self.impacts:  # in order of their start
            total += max(0.0, impact.end - max(impact.start, until))
            until = max(until, impact.end)
        return float(total)

    @cached_property
    def _samples(self) -> tuple[np.ndarray, np.ndarray]:
        return self.history.samples(self.tolerance)

    @property
    def time(self) -> np.ndarray:
        """Times [s] of `force`, (n_times,)."""
        return self._samples[0]

    @property
    def force(self) -> np.ndarray:
        """Contact force [N] at `time`, (n_times,); for several contacts (n_times, n_contacts)."""
        force = self._samples[1]
        return force[:, 0] if force.shape[1] == 1 else force

    def spectrum(self, frequencies: Any) -> np.ndarray:
        """Fourier transform of the force, integral of F exp(-i omega t) [N s], (n_frequencies,), complex.

        Exact to rounding for a force that is linear between the samples.
        """
        asked = check.array("frequencies", frequencies, (None,), "Hz", lift=True)
        return force_spectrum.of_pieces(force_spectrum.pieces(*self._samples), asked)

    def spectral_centroid(self, max_frequency: float) -> float:
        """Mean frequency [Hz] of the force spectrum's magnitude from zero to ``max_frequency`` [Hz]."""
        return force_spectrum.centroid(*self.band_spectrum(max_frequency))

    def band_spectrum(self, max_frequency: float) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies [Hz] from zero, dense enough for the spectrum of this blow, and the spectrum there [N s]."""
        frequencies = self._band(max_frequency)
        return frequencies, self.spectrum(frequencies)

    def _band(self, max_frequency: float) -> np.ndarray:
        """Frequencies [Hz] from zero, dense enough for the spectrum of this blow."""
        limit = check.positive("max_frequency", max_frequency, "Hz")
        span = max((impact.end for impact in self.impacts), default=0.0)
        if span == 0.0:
            raise ValueError("spectral_centroid needs a contact, but the bodies never touched; check gap and speed")
        if limit * span > force_spectrum.MOST_PERIODS:
            most = force_spectrum.MOST_PERIODS / span
            raise ValueError(f"max_frequency must be at most {most:.4g} Hz for a blow of {span:.4g} s")
        return np.linspace(0.0, limit, int(np.clip(32.0 * limit * span, 512, 65536)))

    @check.typed
    def gradient(self, quantity: Any, wrt: Any = None, *, sections: Mapping[str, Any] | None = None) -> Any:
        """Derivatives of what the blow does in the numbers that make it.

        Parameters
        ----------
        quantity : str or sequence of str
            "restitution", "impulse", "contact_time", "peak_force", "peak_time", "spectral_centroid=5000" (its band in
            Hz), "spectral_level=800" (of the force at 800 Hz, in dB re 0 Hz) or "modal_energy" (the energy left in each
            mode of the target at the last separation). Of several contacts they are those of the blow as a whole:
            impulse, contact time and spectrum add up, the peak is the largest.
        wrt : str or sequence of str, optional
            Names of numbers as in a scene file: "striker.mass", "striker.first_frequency", "striker.damping_ratio",
            "contact.stiffness", "contact.exponent", "contact.loss", "contact.gap", "strike.speed", "strike.x",
            "strike.y", "target.mass", "target.first_frequency", "target.damping_ratio", "section.thickness",
            "material.E", "material.rho", "target.scale" and others. Of `collide`, by its arguments: "speeds.0",
            "contacts.0.stiffness" and the other numbers of each contact, "bodies.1.mass", "bodies.1.first_frequency",
            "bodies.1.damping_ratio". By default all in which this blow has a gradient.
            A mass changes at fixed frequencies and damping ratios, a first frequency takes all others of its body with
            it, a damping ratio is added to all of them. Numbers of section and material change at a fixed contact law;
            the scale multiplies all lengths along the target, the strike point moves along. A body that moves already
            keeps its displacement and velocity at the start.
        sections : mapping of name to (value, function), optional
            Further numbers that the target's section depends on, such as the thickness of a patch or the depth of an
            undercut: of each its value, and a function of the number that makes the section. For modes of finite
            elements, of `find_modes`; also for modes that share a frequency.

        Returns
        -------
        Gradient, or for several quantities a dictionary of them
            Each derivative with its estimated error from the time steps; a smaller tolerance makes it smaller. As
            everything else, they are those of the modes kept.

        Raises
        ------
        SimulationError
            Where there is no derivative: next to a contact that barely happens or barely does not, to a later push that
            barely makes a contact yield further, and where two maxima of the force are alike.

        Notes
        -----
        The blow is run again with each number a hundred-thousandth larger and smaller, in steps of its own; runs in
        other steps tell the error.

        Examples
        --------
        >>> plate = fi.analytic.rectangle(1.55, 1.0, mass=2.0, first_frequency=50.0, n_modes=60)
        >>> ball, law = fi.Striker.rigid(0.03), fi.Contact.hertz(1e7)
        >>> hit = fi.strike(plate, ball, law, at=(0.45, 0.3), speed=1.0)
        >>> slopes = hit.gradient("contact_time", wrt=("striker.mass", "contact.stiffness"))
        >>> slopes.relative.round(3).tolist()  # 0.4 and -0.4 on a rigid wall
        [0.423, -0.355]
        """
        found = gradient.gradients(self, quantity, wrt, gradient.section_changes(sections))
        return next(iter(found.values())) if isinstance(quantity, str) else found

    def body_slice(self, body: int) -> slice:
        """The columns of a body's modes in the history's arrays."""
        start = sum(modes.n_modes for modes in self.bodies[:body])
        return slice(start, start + self.bodies[body].n_modes)

    @property
    def constant_forces(self) -> np.ndarray:
        """Constant modal forces on the target, (n_modes,) [N kg**-0.5]."""
        if self._ringing is not None:
            return self._rung.bias
        return self.history.bias[self.body_slice(len(self.bodies) - 1)]

    @property
    def _push(self) -> float:
        """Constant force [N] on the target at the strike point."""
        part = self.body_slice(len(self.bodies) - 1)
        row = self.history.shape[0, part]
        return -float(self.history.bias[part] @ row) / (float(row @ row) or 1.0)

    def modal_state(self, times: Any, *, body: int = -1) -> tuple[np.ndarray, np.ndarray]:
        """Modal displacements and velocities of the target at any times, in any order.

        Parameters
        ----------
        times : array_like, shape (n_times,) [s]
            Not negative; after the end of the run the bodies move freely.
        body : int
            Index of the body; the target is the last.

        Returns
        -------
        q, p : ndarray, shape (n_times, n_modes) [m kg**0.5], [m kg**0.5/s]
        """
        n = len(self.bodies)
        check.count("body", body, low=-n, high=n - 1)
        times = check.array("times", times, (None,), "s", lift=True)
        if times.size and times.min() < 0.0:
            raise ValueError(f"times must not be before the blow at 0 s, got {times.min():g} s")
        order = np.argsort(times, kind="stable")
        rung = self._ringing is not None and self._moved(body) is self._ringing
        q, p = (self._rung if rung else self.history).states(times[order])
        part = slice(None) if rung else self.body_slice(body % n)
        if np.all(order[:-1] < order[1:]):
            return q[:, part], p[:, part]
        back = np.empty_like(order)
        back[order] = np.arange(len(order))
        return q[:, part][back], p[:, part][back]

    def state(self, time: float | None = None) -> State:
        """Where all bodies are at a time and how they move, for another blow to start from.

        Parameters
        ----------
        time : float [s], optional
            By default the end of the run. After the end only if the bodies separated for good.

        Examples
        --------
        >>> drum = fi.analytic.disk(0.18, edge="clamped", mass=0.1, first_frequency=150.0, n_modes=40)
        >>> stick, law = fi.Striker.rigid(0.02), fi.Contact.linear(1e5)
        >>> first = fi.strike(drum, stick, law, at=(0.05, 0.0), speed=1.0)
        >>> second = fi.strike(drum, stick, law, at=(0.05, 0.0), speed=1.0, start=first.state(0.02))
        >>> round(float(first.peak_force / second.peak_force), 1) != 1.0  # the head moves
        True
        """
        end = self.history.end_time
        time = end if time is None else check.non_negative("time", time, "s")
        over = self.history.status in (record.FINISHED, record.SETTLED)
        if time > end and not over:
            raise ValueError(f"time must be at most {end:g} s, where the run stopped before its end, got {time:g} s")
        bodies = tuple(self._moved(body) for body in range(len(self.bodies)))
        found = [self.modal_state([time], body=body) for body in range(len(bodies))]
        forces = np.array([self.history.force_at(np.array([time]), i) for i in range(len(self.contacts))])[:, :, 0]
        forces[forces[:, 0] <= SAME * self.peak_force] = 0.0  # the rounding of a release
        remembers = any(law.remembers for law in self.contacts)
        return State(
            time,
            bodies,
            tuple(q[0] for q, _ in found),
            tuple(p[0] for _, p in found),
            forces,
            min(self.error.total, 1.0),
            self.striker,
            self.contacts,
            self.at,
            remembers and any(impact.start < time for impact in self.impacts),
        )

    @property
    def moving(self) -> bool:
        """Whether the target moved when the blow began."""
        part = self.body_slice(len(self.bodies) - 1)
        return bool(self.history.start_q[part].any() or self.history.start_p[part].any())

    def modal_energy(self, times: Any, *, body: int = -1) -> np.ndarray:
        """Energy [J] of each mode of the target at any times, (n_times, n_modes); parameters as in `modal_state`."""
        q, p = self.modal_state(times, body=body)
        return mode_energy(self._moved(body).omega, q, p)

    @check.typed
    def displacement(self, points: Any, times: Any, *, body: int = -1, residual: bool = True) -> np.ndarray:
        """Displacement [m] of the target, (n_times, n_points); positive in the direction of the blow.

        After a blow by Ritz vectors these give the motion as long as they can (`motion_error`); otherwise modes do.

        Parameters
        ----------
        points : array_like, shape (n_points, dimension) [m]
        times : array_like, shape (n_times,) [s]
        body : int
            Index of the body; the target is the last.
        residual : bool
            Whether to add the static deflection of the left-out modes under the contact forces, if the blow used it.
            It matters within about one wavelength of the last mode from a contact, and costs one static solution per
            point.
        """
        if residual and self._told(points, times, body, "displacement"):
            return self._seen[0].displacement(points, times)
        q, _ = self.modal_state(times, body=body)
        motion = q @ self._moved(body).shape_at(points).T  # (n_times, n_modes) @ (n_modes, n_points)
        return motion + self._dip(points, times, body)[0] if residual else motion

    @check.typed
    def velocity(self, points: Any, times: Any, *, body: int = -1, residual: bool = True) -> np.ndarray:
        """Velocity [m/s] of the target, (n_times, n_points); parameters as in `displacement`."""
        if residual and self._told(points, times, body, "velocity"):
            return self._seen[0].velocity(points, times)
        _, p = self.modal_state(times, body=body)
        motion = p @ self._moved(body).shape_at(points).T
        return motion + self._dip(points, times, body)[1] if residual else motion

    @cached_property
    def _seen(self) -> tuple["Response", ...]:
        """The same blow with the motion of its own Ritz vectors, and with that of each poorer description."""
        assert self.vectors is not None
        each = self.vectors, *self.vectors.poorer.values()
        return tuple(replace(self, rings=None, ringing=modes, vectors=None) for modes in each)

    @check.typed
    def motion_error(self, points: Any, times: Any, *, velocity: bool = False) -> float:
        """Estimated error [-] of the target's motion as its Ritz vectors tell it, over the largest motion asked for.

        The error of the blow, and the difference from the motion told by fewer vectors and by those of a coarser mesh
        under the same force. Infinite where vectors do not tell the motion: after a blow by modes, later than twice the
        duration of the run, and where that difference exceeds 1e-2 (3e-2 in the velocity).

        Parameters
        ----------
        points, times : as in `displacement`
        velocity : bool
            Whether the error is that of `velocity`.
        """
        name = "velocity" if velocity else "displacement"
        apart = self._largest_difference(points, times, name)
        return apart + self.error.total if apart <= MOVED[name] else float("inf")

    def _largest_difference(self, points: Any, times: Any, name: str) -> float:
        """Largest difference [-] of the motions told by the descriptions of the target, over the largest motion."""
        times = check.array("times", times, (None,), "s", lift=True)
        lasting = not times.size or times.max() <= LASTS * self.history.end_time
        if self.vectors is None or not self.vectors.poorer or not lasting:
            return float("inf")
        if len(times) > LOOKED_AT:
            times = times[np.linspace(0, len(times) - 1, LOOKED_AT).astype(int)]
        told = [getattr(blow, name)(points, times) for blow in self._seen]
        largest = float(np.abs(told[0]).max(initial=0.0))
        apart = sum(float(np.abs(one - other).max(initial=0.0)) for one, other in pairwise(told))
        return apart / largest if largest else 0.0

    def _told(self, points: Any, times: Any, body: int, name: str) -> bool:
        """Whether Ritz vectors tell a motion well enough."""
        mine = self.vectors is not None and body in (-1, len(self.bodies) - 1)
        return mine and self._largest_difference(points, times, name) <= MOVED[name]

    def _dip(self, points: Any, times: Any, body: int) -> tuple[Any, Any]:
        """Static deflection [m] of the left-out modes and its rate [m/s], (n_times, n_points); 0 if there are none."""
        ends = self.ends[body] if self.ends and self.ends[body].rest.any() else None
        if self._moved(body) is self._ringing and self.at is not None:
            ends = Ends(self.at[None], ((0, -1.0),), self._push, np.zeros((1, 1)), dip_force=self._push)
        if ends is None:
            return 0.0, 0.0
        modes = self._moved(body)
        times = check.array("times", times, (None,), "s", lift=True)
        found = [self.history.force_at(times, i) for i, _ in ends.touched]
        sign = np.array([sign for _, sign in ends.touched])
        force, rate = (-sign * np.stack([pair[k] for pair in found], axis=1) for k in (0, 1))  # (n_times, n_ends)
        force[:, 0] += ends.dip_force
        asked = modes.points("points", points)
        if not force.any() or not len(asked):
            return 0.0, 0.0
        swings = modes.omega > 0.0
        pushed, moved = (modes.shapes.at(place)[:, swings] / modes.omega[swings] for place in (ends.points, asked))
        rest = modes.shapes.deflection(ends.points, asked) - moved @ pushed.T  # (n_points, n_ends)
        return force @ rest.T, rate @ rest.T

    @property
    def speeds(self) -> tuple[float, ...]:
        """Final speed [m/s] of each body's rigid motion at its first contact point."""
        return tuple(float(row @ self.history.end_p) for row in map(self._rigid_row, range(len(self.bodies))))

    def _rigid_row(self, body: int) -> np.ndarray:
        """Shape (n_modes,) of a body's rigid motion at its first contact point, zero in all other modes."""
        h, part, found = self.history, self.body_slice(body), np.zeros(len(self.history.omega))
        rows = self._touched(body)
        if rows:
            n_rigid = 1 if self._held and body == 0 else self.bodies[body].n_rigid
            rigid = slice(part.start, part.start + n_rigid)
            found[rigid] = self._sign(body, rows[0]) * h.shape[rows[0], rigid]
        return found

    def _touched(self, body: int) -> list[int]:
        """The contacts of a body."""
        h = self.history
        return [i for i in range(h.n_contacts) if (h.shape[i, self.body_slice(body)] != 0.0).any()]

    @property
    def _held(self) -> bool:
        return self.striker is not None and self.striker.hand is not None

    def _sign(self, body: int, contact: int) -> float:
        later = any((self.history.shape[contact, self.body_slice(other)] != 0.0).any() for other in range(body))
        return -1.0 if later else 1.0

    @property
    def in_contact(self) -> bool:
        """Whether the striker, or the first body, still presses another at the end of the run."""
        mine = self._touched(0)
        return any(each.separation_speed is None for each in self.impacts if each.contact in mine)

    @cached_property
    def _pushed(self) -> bool:
        """Whether a constant force or a hand changes the speed of the first body's rigid motion in flight."""
        return self._held or bool((self._rigid_row(0) * self.history.bias).any())

    @cached_property
    def restitution(self) -> float | None:
        """Minus the striker's speed after its last separation over that before its first contact [-].

        Both are those of its rigid motion at its contact point; a constant force or a hand that acts in flight does not
        count. On a body that moved before it may exceed 1. None while the striker is still in contact (`in_contact`),
        and for one that did not arrive. See `Impact.restitution` for that of each impact.
        """
        if self.in_contact:
            return None
        before, after = self.speed, self.speeds[0]
        if self._pushed:
            mine = [each for each in self.impacts if each.contact in self._touched(0)]
            if not mine:
                return -1.0 if before else None
            times = np.array([mine[0].start, max(each.end for each in mine)])
            before, after = (self.history.states(times)[1] @ self._rigid_row(0)).tolist()
        return -after / before if before else None

    @cached_property
    def _balance(self) -> Balance:
        return Balance.of(self.history, self.contacts)

    @property
    def energies(self) -> dict[str, float]:
        """Final energies [J]: striker and target (or body 0, 1, ...), contact, and the dissipated energy.

        They add up to the initial energy to within `energy_error`.
        """
        found = self._of_bodies(self.history.end_q, self.history.end_p)
        rest = slice(self.body_slice(len(self.bodies) - 1).stop, None)  # modes that replace the left-out ones
        found["contact"] = self._balance.contact + self.history.energy(self.history.end_q, self.history.end_p, rest)
        return found | {"dissipated": sum(self.dissipated.values())}

    @property
    def start_energies(self) -> dict[str, float]:
        """Energies [J] at the start, of the same parts: what the blow began with."""
        found = self._of_bodies(self.history.start_q, self.history.start_p)
        return found | {"contact": self._balance.start - sum(found.values()), "dissipated": 0.0}

    def _of_bodies(self, q: np.ndarray, p: np.ndarray) -> dict[str, float]:
        """Energy [J] of each body in a state."""
        names = ["striker", "target"] if len(self.bodies) == 2 else [f"body {i}" for i in range(len(self.bodies))]
        return {name: self.history.energy(q, p, self.body_slice(body)) for body, name in enumerate(names)}

    @property
    def energy_gains(self) -> dict[str, float]:
        """Energy [J] that each part gained in the blow; negative what it lost. They add up to zero."""
        start = self.start_energies
        return {name: energy - start[name] for name, energy in self.energies.items()}

    @property
    def dissipated(self) -> dict[str, float]:
        """Energy [J] lost to modal damping and to the contacts; exactly zero without damping or contact loss."""
        return self._balance.dissipated

    @property
    def energy_error(self) -> float:
        """Energy that numerical error created or destroyed, over the largest energy in the blow [-]."""
        return self._balance.error

    @property
    def momentum_error(self) -> float:
        """Largest momentum change of a rigid motion that the forces do not explain, over the largest momentum [-]."""
        return momentum_error(self.history)

    @property
    def finished(self) -> bool:
        """Whether the run proved that the bodies never touch again."""
        return self.history.status == record.FINISHED

    def _repr_html_(self) -> str:
        """For notebooks: the force curve and a table of results."""
        return in_words.page(self)

    def summary(self) -> str:
        """The blow in a few readable lines."""
        return in_words.lines(self)

    def to_xarray(self) -> Any:
        """The response as an `xarray.Dataset`: force [N] over time [s], impacts, scalars, errors and energies.

        For several contacts the force has a column for each; units are in the attributes of every variable.
        """
        return datasets.dataset(self)

    @property
    def outcome(self) -> str:
        """How the run ended, in words."""
        words = {
            record.FINISHED: "proven not to touch again",
            record.HORIZON: "stopped at the given duration",
            record.IMPACTS: "stopped after max_impacts",
            record.SETTLED: "everything came to rest",
        }
        return words[self.history.status]
