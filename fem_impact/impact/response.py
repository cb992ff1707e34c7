"""The result of a blow: the force history, the scalars derived from it, and the motion of all bodies at any time."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from .._base import check
from ..fe import plausible
from ..modes.modal import Modes, at_rest
from . import assumption, balance, datasets, force_spectrum, gradient, in_words, motion, promise, trust
from .assumption import Assumption
from .compiled import record
from .contact import Contact
from .error import Error
from .history import History, Impact, mode_energy
from .measured import Comparison, of_blow
from .motion import BodyMotion
from .quantities import USUAL
from .reduced_body import Ends
from .state import State, state_at
from .striker import Striker


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
    # the run in coarser steps, and that from where the blow before would have left the bodies, had it erred
    runs: tuple[History, ...] = field(default=(), repr=False)
    late: float = field(default=0.0, repr=False)  # [s] by how much the latter begins later
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
        motion.check_same_body(self, modes)
        return replace(self, ringing=modes, rings=None, vectors=None)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What the bodies assumed, and numbers that are allowed but probably a slip of a unit, in plain words."""
        striker = () if self.striker is None else self.striker.notes
        place = () if self.at is None else at_rest(self.bodies[-1], self.at[None])
        speed = tuple(plausible.note_number("speed", abs(self.speed)))
        return plausible.together(*(modes.notes for modes in reversed(self.bodies)), striker, speed, place)

    @property
    def margin(self) -> float:
        """How near the number of impacts is to another [-].

        Over the deepest approach: how far the bodies at least come apart between contacts, press each other in one, or
        stay apart where they nearly touch once more or where the run is cut off as they close. Given up to 0.05. A
        margin below its error counts as a missed tolerance.
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

    def against(self, measured: Any) -> Comparison:
        """Measured quantities of this blow beside the bands that the program states for them; `fi.figures.against`
        draws both.

        A band holds the errors of computation and model, as of `trust`, and that of the measurement. What the inputs
        leave open is in `fi.band`, which compares alike.

        Parameters
        ----------
        measured : mapping of quantity to value or (value, error)
            Of the quantities asked for: ``{"contact_time": (5.1e-3, 0.1e-3)}``. The error is half the width of the
            measurement's own interval of 90 %, in its unit.

        Examples
        --------
        >>> wall, ball = fi.Modes.rigid(1e3), fi.Striker.rigid(0.1)
        >>> hit = fi.strike(wall, ball, fi.Contact.linear(4e6), at=None, speed=1.0)
        >>> found = hit.against({"contact_time": (5e-4, 5e-6), "force": (700.0, 7.0)})
        >>> [(each.point.name, each.said) for each in found.verdicts]
        [('contact time', 'inside'), ('peak force', 'outside: 8.7 % above the band')]
        """
        return of_blow(self.trust, measured)

    @property
    def verdict(self) -> str:
        """The answer in one line: how well it is computed, whether the model holds, and what would help."""
        return trust.in_one_line(self)

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

    @cached_property
    def target(self) -> Modes:
        """The struck body; in `collide` the last one.

        After a blow by Ritz vectors (see `strike`) these are its modes as far as the force found makes them ring; they
        are found when they are first needed.
        """
        found = self.rings(self) if self.ringing is None and self.rings is not None else self.ringing
        return found or self.bodies[-1]

    @cached_property
    def _target(self) -> BodyMotion:
        if self.ringing is None and self.rings is None:
            return motion.of_run(self, len(self.bodies) - 1)
        return motion.driven_motion(self, self.target)

    @cached_property
    def _descriptions(self) -> tuple[BodyMotion, ...]:
        """The motion of the target by its own Ritz vectors or modes, and by each poorer description."""
        if self.vectors is None:
            return motion.by_other_modes(self)
        return tuple(motion.driven_motion(self, modes) for modes in self.vectors.descriptions().values())

    def _is_target(self, body: int) -> bool:
        n = len(self.bodies)
        return check.count("body", body, low=-n, high=n - 1) % n == n - 1

    def _motion(self, body: int) -> BodyMotion:
        return self._target if self._is_target(body) else motion.of_run(self, body % len(self.bodies))

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
        return force_spectrum.of_pieces(force_spectrum.straight_pieces(*self._samples), asked)

    def spectral_centroid(self, max_frequency: float) -> float:
        """Mean frequency [Hz] of the force spectrum's magnitude from zero to ``max_frequency`` [Hz]."""
        return force_spectrum.centroid(*self.band_spectrum(max_frequency))

    def band_spectrum(self, max_frequency: float) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies [Hz] from zero, dense enough for the spectrum of this blow, and the spectrum there [N s]."""
        span = max((impact.end for impact in self.impacts), default=0.0)
        frequencies = force_spectrum.dense_frequencies(max_frequency, span)
        return frequencies, self.spectrum(frequencies)

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
        other steps estimate the error.

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
        return self._target.history.bias[self._target.part]

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
        return self._motion(body).states(_times(times))

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
        return state_at(self, time)

    @property
    def moving(self) -> bool:
        """Whether the target moved when the blow began."""
        part = self.body_slice(len(self.bodies) - 1)
        return bool(self.history.start_q[part].any() or self.history.start_p[part].any())

    def modal_energy(self, times: Any, *, body: int = -1) -> np.ndarray:
        """Energy [J] of each mode of the target at any times, (n_times, n_modes); parameters as in `modal_state`."""
        return mode_energy(self._motion(body).modes.omega, *self.modal_state(times, body=body))

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
        return self._moved(points, times, body, residual, "displacement")

    @check.typed
    def velocity(self, points: Any, times: Any, *, body: int = -1, residual: bool = True) -> np.ndarray:
        """Velocity [m/s] of the target, (n_times, n_points); parameters as in `displacement`."""
        return self._moved(points, times, body, residual, "velocity")

    def _moved(self, points: Any, times: Any, body: int, residual: bool, name: str) -> np.ndarray:
        """A motion by Ritz vectors, if they give it well enough, or else by modes."""
        rate, asked, mine = name == "velocity", _times(times), self._is_target(body)
        if residual and mine and self.vectors is not None and np.isfinite(self._apart(points, asked, rate)):
            return self._descriptions[0].at(points, asked, rate)
        return self._motion(body).at(points, asked, rate, residual)

    def _apart(self, points: Any, times: np.ndarray, rate: bool) -> float:
        until = None if self.vectors is None else self.history.end_time
        return motion.largest_difference(self._descriptions, points, times, rate, until)

    @check.typed
    def motion_error(self, points: Any, times: Any, *, velocity: bool = False) -> float:
        """Estimated error [-] of the target's motion at points, over the largest motion asked for.

        The error of the blow, and the difference from the motion by fewer Ritz vectors and by those of a coarser mesh
        under the same force. After a blow by modes, that from the motion by half of them, by modes softer by their
        errors and in coarser steps, all added up; infinite then if the body moved before, and after `collide`.
        Infinite, too, where vectors do not give the motion, but modes found later do: after twice the duration of the
        run, and where that difference exceeds 1e-2 (3e-2 in the velocity).

        Parameters
        ----------
        points, times : as in `displacement`
        velocity : bool
            Whether the error is that of `velocity`.
        """
        return self._apart(points, _times(times), velocity) + self.error.total

    @property
    def speeds(self) -> tuple[float, ...]:
        """Final speed [m/s] of each body's rigid motion at its first contact point."""
        return tuple(float(balance.rigid_row(self, i) @ self.history.end_p) for i in range(len(self.bodies)))

    @property
    def in_contact(self) -> bool:
        """Whether the striker, or the first body, still presses another at the end of the run."""
        mine = balance.contacts_of_striker(self)
        return any(each.separation_speed is None for each in self.impacts if each.contact in mine)

    @property
    def striker_speeds(self) -> np.ndarray:
        """Speed [m/s] of the striker's rigid motion at its contact point before and after each impact, (n_impacts, 2).

        Positive towards the struck body; a falling striker rises by the square of the second over twice the gravity.
        """
        times = np.array([[each.start, each.end] for each in self.impacts]).reshape(-1, 2)
        return (self.history.states(times.ravel())[1] @ balance.rigid_row(self, 0)).reshape(-1, 2)

    @cached_property
    def restitution(self) -> float | None:
        """Minus the striker's speed after its last separation over that before its first contact [-].

        Both are those of its rigid motion at its contact point; a constant force or a hand that acts in flight does not
        count. On a body that moved before it may exceed 1. None while the striker is still in contact (`in_contact`),
        and for one that did not arrive. See `Impact.restitution` for that of each impact.
        """
        return balance.restitution(self)

    @cached_property
    def _balance(self) -> balance.Balance:
        return balance.Balance.of(self.history, self.contacts)

    @property
    def energies(self) -> dict[str, float]:
        """Final energies [J]: striker and target (or body 0, 1, ...), contact, and the dissipated energy.

        They add up to the initial energy to within `energy_error`.
        """
        found = balance.of_bodies(self, self.history.end_q, self.history.end_p)
        rest = slice(self.body_slice(len(self.bodies) - 1).stop, None)  # modes that replace the left-out ones
        found["contact"] = self._balance.contact + self.history.energy(self.history.end_q, self.history.end_p, rest)
        return found | {"dissipated": sum(self.dissipated.values())}

    @property
    def start_energies(self) -> dict[str, float]:
        """Energies [J] at the start, of the same parts: what the blow began with."""
        found = balance.of_bodies(self, self.history.start_q, self.history.start_p)
        return found | {"contact": self._balance.start - sum(found.values()), "dissipated": 0.0}

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
        return balance.momentum_error(self.history)

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

    def to_xarray(self, points: Any = None, times: Any = None, *, max_frequency: float | None = None) -> Any:
        """The response as an `xarray.Dataset`: force [N] over time [s], impacts, scalars, errors and energies.

        For several contacts the force has a column for each. Every variable has its unit and name in its attributes, so
        that ``found.force.plot()`` and its like label their axes.

        Parameters
        ----------
        points : array_like, shape (n_points, dimension) [m], optional
            Where ``displacement`` [m] and ``velocity`` [m/s] of the target are wanted, over ``moment`` and ``point``.
        times : array_like, shape (n_times,) [s], optional
            The moments of the motion; by default those of the force.
        max_frequency : float [Hz], optional
            With it there is ``spectrum``, the magnitude of the force's Fourier transform [N s] over ``frequency`` [Hz].

        Examples
        --------
        >>> plate = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=40)
        >>> hit = fi.strike(plate, fi.Striker.rigid(0.05), fi.Contact.linear(1e6), at=(0.13, 0.1), speed=1.0)
        >>> found = hit.to_xarray([(0.3, 0.2)], [1e-3, 2e-3], max_frequency=5e3)
        >>> found.velocity.dims, found.spectrum.attrs["units"]
        (('moment', 'point'), 'N s')
        """
        return datasets.dataset(self, points, times, max_frequency)

    @property
    def outcome(self) -> str:
        """How the run ended, in words."""
        return in_words.OUTCOMES[self.history.status]


def _times(times: Any) -> np.ndarray:
    """Times (n_times,) [s] of a motion, none of them before the blow."""
    found = check.array("times", times, (None,), "s", lift=True)
    if found.size and found.min() < 0.0:
        raise ValueError(f"times must not be before the blow at 0 s, got {found.min():g} s")
    return found
