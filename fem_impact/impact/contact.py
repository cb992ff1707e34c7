"""Contact laws: the force between two bodies as a function of how far they are pressed together."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import gamma

from .._base import check
from .._base.rounding import HALVINGS
from .compiled.law import FELT, LAYERS, PLASTIC, POWER

from .compiled.layout import (  # isort: skip
    DEPTH, EXPONENT, FIRST_YIELD, HARD, HARD_EXPONENT, KIND, RELAXATION, SHARE, STIFFNESS, WIDTH,
)  # fmt: skip

LOWEST_EXPONENT, HIGHEST_EXPONENT = 0.5, 100.0  # [-] limits: below, no longer a spring; above, a wall

MOST_LOSS = 1e12  # [s/m] far above that of a contact that swallows the slowest blow whole
YIELDS = 1.6  # [-] fact: pressure at which a round contact first yields, over the yield strength, for nu = 0.3
STIFFEST = 1e200  # [N/m**exponent] upper limit, 1/STIFFEST the lower: high exponents need huge stiffnesses


@dataclass(frozen=True)
class Contact:
    """A spring that only pushes: ``F = stiffness d**exponent (1 + loss d')`` for an approach d > 0, else zero.

    `layers` makes a soft layer over a hard one, `elastic_plastic` a contact that yields, `felt` one that remembers;
    their numbers are fields too, zero where a law has nothing of the kind.

    The approach is the first body's displacement minus the second's, minus the gap. A negative gap is a preload: the
    bodies start pressed together. Valid while the contact area is small compared with both bodies and the speed is far
    below their wave speeds.

    References
    ----------
    Hertz (1882), J. reine angew. Math. 92, 156; Hunt and Crossley (1975), J. Appl. Mech. 42, 440-445.
    """

    stiffness: float  # [N/m**exponent]
    exponent: float = 1.0  # [-]
    loss: float = 0.0  # [s/m] Hunt and Crossley's damping factor
    gap: float = 0.0  # [m] distance the bodies travel before they touch
    depth: float = 0.0  # [m] approach at which a hard layer is reached
    hard_stiffness: float = 0.0  # [N/m**hard_exponent] of the hard layer; 0: there is none
    hard_exponent: float = 1.5  # [-] of the hard layer
    yield_approach: float = 0.0  # [m] approach at first yield; 0: it never yields
    hysteresis: float = 0.0  # [-] the share of the force that felt loses if it is held pressed; 0: it is no felt
    relaxation: float = 0.0  # [s] time in which felt loses it

    def __post_init__(self) -> None:
        check.settle(
            self,
            stiffness=check.positive("stiffness", self.stiffness, "N/m**exponent", reach=STIFFEST),
            exponent=check.between("exponent", self.exponent, LOWEST_EXPONENT, HIGHEST_EXPONENT),
            loss=check.between("loss", check.non_negative("loss", self.loss, "s/m"), 0.0, MOST_LOSS, "s/m"),
            gap=check.number("gap", self.gap, "m"),
            depth=check.non_negative("depth", self.depth, "m"),
            hard_stiffness=check.between("hard_stiffness", self.hard_stiffness, 0.0, STIFFEST, "N/m**hard_exponent"),
            hard_exponent=check.between("hard_exponent", self.hard_exponent, 1.0, HIGHEST_EXPONENT),
            yield_approach=check.non_negative("yield_approach", self.yield_approach, "m"),
            hysteresis=check.between("hysteresis", self.hysteresis, 0.0, 1.0),
            relaxation=check.non_negative("relaxation", self.relaxation, "s"),
        )
        kinds = [name for name in ("loss", "yield_approach", "hysteresis", "hard_stiffness") if getattr(self, name)]
        if len(kinds) > 1 and kinds != ["loss", "hard_stiffness"]:
            raise ValueError(
                f"{' and '.join(kinds)} cannot be given together: a contact has a loss factor, yields or is felt, and "
                "a hard layer goes with a loss factor only"
            )
        if self.remembers and self.exponent < 1.0:
            raise ValueError(f"exponent must be at least 1 for a contact that yields or is felt, got {self.exponent:g}")
        if self.hysteresis and not self.relaxation:
            raise ValueError("relaxation must be positive for felt with hysteresis, got 0 s")

    @classmethod
    def linear(cls, stiffness: float, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """A linear spring, stiffness in N/m.

        Examples
        --------
        >>> fi.Contact.linear(1e5).force([-1e-3, 1e-3]).tolist()
        [0.0, 100.0]
        """
        return cls(stiffness, 1.0, loss, gap)

    @classmethod
    def hertz(cls, stiffness: float, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """Hertz's law for smooth round bodies, stiffness in N/m**1.5.

        Examples
        --------
        >>> fi.Contact.hertz(1e6, loss=0.1).force([1e-4, 4e-4], rate=1.0).round(6).tolist()
        [1.1, 8.8]
        """
        return cls(stiffness, 1.5, loss, gap)

    @classmethod
    def power(cls, stiffness: float, exponent: float, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """Any power of the approach, stiffness in N/m**exponent.

        Examples
        --------
        >>> felt = fi.Contact.power(1e9, 2.5)
        >>> felt.force([1e-3, 2e-3]).round(3).tolist()
        [31.623, 178.885]
        """
        return cls(stiffness, exponent, loss, gap)

    @classmethod
    def restituting(
        cls, stiffness: float, exponent: float, *, restitution: float, speed: float, gap: float = 0.0
    ) -> "Contact":
        """A contact with the loss that gives a mass the stated restitution on a rigid wall.

        Parameters
        ----------
        restitution : float [-]
            From 1e-6 to 1.
        speed : float [m/s]
            Approach speed at which this restitution holds.

        Notes
        -----
        Solves ``L (1 + e) = ln((1 + L) / (1 - e L))`` with ``L = loss speed``. The equation holds for any mass,
        stiffness and exponent.

        Examples
        --------
        >>> law = fi.Contact.restituting(1e6, 1.5, restitution=0.8, speed=2.0)
        >>> hit = fi.strike(fi.Modes.rigid(1e3), fi.Striker.rigid(1e-3), law, at=None, speed=2.0)
        >>> round(hit.restitution, 3)
        0.8
        """
        e = check.between("restitution", restitution, 1e-6, 1.0)
        speed = check.positive("speed", speed, "m/s")
        return cls(stiffness, exponent, loss_number(e) / speed, gap)

    @classmethod
    def layers(
        cls,
        stiffness: float,
        exponent: float,
        *,
        depth: float,
        hard_stiffness: float,
        hard_exponent: float = 1.5,
        loss: float = 0.0,
        gap: float = 0.0,
    ) -> "Contact":
        """A soft layer over a hard one: ``F = stiffness d**exponent + hard_stiffness (d - depth)**hard_exponent``.

        The second term acts where the approach d exceeds ``depth`` [m], at which the soft layer bottoms.

        Examples
        --------
        >>> tip = fi.Contact.layers(1e5, 1.0, depth=1e-3, hard_stiffness=1e9)
        >>> tip.force([1e-3, 2e-3]).round(3).tolist()
        [100.0, 31822.777]
        """
        return cls(stiffness, exponent, loss, gap, depth, hard_stiffness, hard_exponent)

    @classmethod
    def elastic_plastic(
        cls,
        stiffness: float,
        exponent: float = 1.5,
        *,
        yield_speed: float | None = None,
        mass: float | None = None,
        yield_approach: float | None = None,
        gap: float = 0.0,
    ) -> "Contact":
        """A contact that yields: elastic up to first yield, beyond it along the tangent; it unloads from a dent.

        Well beyond first yield the restitution on a rigid wall falls as ``speed**(-1/4)``. Pressed again, the contact
        is elastic up to the deepest approach so far.

        Parameters
        ----------
        stiffness : float [N/m**exponent]
        exponent : float [-]
            At least 1; 1.5 for round bodies. With exponent 1 nothing yields.
        yield_speed : float [m/s]
            Speed of first yield of a mass on a rigid wall.
        mass : float [kg]
            This mass; of two free bodies, product over sum.
        yield_approach : float [m]
            Approach at first yield, instead of speed and mass.

        References
        ----------
        Thornton (1997), J. Appl. Mech. 64, 383-386, for the exponent 1.5.

        Examples
        --------
        >>> law = fi.Contact.elastic_plastic(1e10, yield_speed=0.1, mass=0.004)
        >>> wall, ball = fi.Modes.rigid(1e6), fi.Striker.rigid(0.004)
        >>> [round(fi.strike(wall, ball, law, at=None, speed=v).restitution, 3) for v in (0.1, 1.6, 25.6)]
        [1.0, 0.588, 0.296]
        """
        if (yield_approach is None) == (yield_speed is None or mass is None):
            raise ValueError("yield_approach must be given, or yield_speed and mass")
        if yield_approach is not None:
            first = check.positive("yield_approach", yield_approach, "m")
            return cls(stiffness, exponent, gap=gap, yield_approach=first)
        law = cls(stiffness, exponent, gap=gap)
        energy = 0.5 * check.positive("mass", mass, "kg") * check.positive("yield_speed", yield_speed, "m/s") ** 2
        power = law.exponent + 1.0
        return replace(law, yield_approach=float((power * energy / law.stiffness) ** (1.0 / power)))

    @classmethod
    def felt(
        cls, stiffness: float, exponent: float, *, hysteresis: float, relaxation: float, gap: float = 0.0
    ) -> "Contact":
        """Felt that remembers: ``F = stiffness (d**exponent - hysteresis z)``, ``relaxation z' = d**exponent - z``.

        Pressed much faster than it relaxes it has the full stiffness, much more slowly the share 1 - hysteresis of it.
        The force never pulls: where it would, the felt stays behind and recovers on its own.

        Parameters
        ----------
        stiffness : float [N/m**exponent]
        exponent : float [-]
        hysteresis : float [-]
            From 0 to 1.
        relaxation : float [s]

        References
        ----------
        Stulov (1995), J. Acoust. Soc. Am. 97, 2577-2585.

        Examples
        --------
        >>> felt = fi.Contact.felt(1e10, 2.5, hysteresis=0.4, relaxation=1e-3)
        >>> hit = fi.strike(fi.Modes.rigid(1e3), fi.Striker.rigid(0.01), felt, at=None, speed=2.0)
        >>> 0.0 < hit.restitution < 1.0
        True
        """
        return cls(stiffness, exponent, gap=gap, hysteresis=hysteresis, relaxation=relaxation)

    @classmethod
    def between(
        cls, sphere: Any, plate: Any, *, yield_strength: float | None = None, loss: float = 0.0, gap: float = 0.0
    ) -> "Contact":
        """Hertz contact of a sphere with a flat body, stiffness ``(4/3) E* sqrt(R)``, ``1/E* = sum (1 - nu**2)/E``.

        Parameters
        ----------
        sphere : Striker
            Made by `Striker.sphere`.
        plate : Plate or Material
            The flat body; isotropic. For wood, give an isotropic `Material` with its stiffness across the thickness.
        yield_strength : float [Pa], optional
            Of the softer body. The contact then yields as soon as its largest pressure is 1.6 times this; see
            `elastic_plastic`.

        References
        ----------
        Johnson (1985), Contact Mechanics, 6.1 and 11.5.

        Examples
        --------
        >>> steel = fi.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> ball = fi.Striker.sphere(steel, radius=5e-3)
        >>> round(fi.Contact.between(ball, steel).stiffness / 1e9, 3)  # GN/m^1.5
        10.879
        """
        for name in ("material", "radius"):
            if getattr(sphere, name, None) is None:
                raise ValueError(f"sphere must be made by Striker.sphere, got {check.shown(sphere)} without {name}")
        flat = getattr(plate, "material", plate)
        compliance = sum(
            (1.0 - nu**2) / E for E, nu in (_isotropic("sphere", sphere.material), _isotropic("plate", flat))
        )
        law = cls(4.0 / 3.0 / compliance * float(np.sqrt(sphere.radius)), 1.5, loss, gap)
        if yield_strength is None:
            return law
        pressure = YIELDS * check.positive("yield_strength", yield_strength, "Pa")
        return replace(law, yield_approach=float((0.5 * np.pi * pressure * compliance) ** 2 * sphere.radius))

    @property
    def lossy(self) -> bool:
        """Whether the contact takes energy."""
        return bool(self.loss or self.remembers)

    @property
    def remembers(self) -> bool:
        """Whether the force depends on what was before: the contact yields, or is felt."""
        return bool(self.yield_approach or self.hysteresis)

    @property
    def rated(self) -> bool:
        """Whether the force depends on how fast the contact is pressed."""
        return bool(self.loss or self.hysteresis)

    @property
    def table(self) -> dict[str, Any]:
        """The table [contact] of a scene with this law."""
        law = {"stiffness": self.stiffness, "exponent": self.exponent}
        if self.hysteresis:
            return {"kind": "felt", **law, "hysteresis": self.hysteresis, "relaxation": self.relaxation}
        if self.yield_approach:
            return {"kind": "elastic_plastic", **law, "yield_approach": self.yield_approach}
        if self.hard_stiffness:
            hard = {name: getattr(self, name) for name in ("depth", "hard_stiffness", "hard_exponent")}
            return {"kind": "layers", **law, **hard, "loss": self.loss}
        return {"kind": "power", **law, "loss": self.loss}

    @property
    def numbers(self) -> list[float]:
        """The law as the compiled loops read it, see `compiled.law`: 9 numbers."""
        first = [self.stiffness, self.exponent, self.loss, 0.0]
        if self.hysteresis:
            return [*first, FELT, self.hysteresis, self.relaxation, 0.0, 0.0]
        if self.yield_approach and self.exponent > 1.0:
            return [*first, PLASTIC, self.yield_approach, 0.0, 0.0, 0.0]
        if self.hard_stiffness:
            return [*first, LAYERS, self.depth, self.hard_stiffness, self.hard_exponent, 0.0]
        return [*first, POWER, 0.0, 0.0, 0.0, 0.0]

    def force(self, approach: Any, rate: Any = 0.0) -> np.ndarray:
        """Contact force [N] for an approach [m] and its rate [m/s]; never negative.

        Of a contact that yields or is felt, the force as it is first pressed, felt so fast that it does not relax.
        """
        pressed = np.maximum(check.numbers("approach", approach, "m"), 0.0)
        rates = check.numbers("rate", rate, "m/s")
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                force = self.stiffness * pressed**self.exponent
                if self.yield_approach:
                    soft = np.minimum(pressed, self.yield_approach)
                    steep = self.exponent * self.stiffness * self.yield_approach ** (self.exponent - 1.0)
                    force = self.stiffness * soft**self.exponent + steep * (pressed - soft)
                force = force + self.hard_stiffness * np.maximum(pressed - self.depth, 0.0) ** self.hard_exponent
                force = force * (1.0 + self.loss * rates)
        except ValueError:
            raise ValueError(f"rate must have the shape of approach, {pressed.shape}, got {rates.shape}") from None
        if not np.isfinite(force).all():
            raise ValueError("approach and rate must give a finite force; check their units, m and m/s")
        return np.maximum(force, 0.0)


def _isotropic(name: str, material: Any) -> tuple[float, float]:
    E, nu = getattr(material, "E", None), getattr(material, "nu", None)
    if getattr(material, "E_across", None) is not None:
        raise ValueError(
            f"{name} must be isotropic, because the contact of an orthotropic body depends on its stiffness across the "
            "thickness; give fi.Material with that E instead, or use Contact.hertz with a measured stiffness"
        )
    if not isinstance(E, (int, float)) or not isinstance(nu, (int, float)):
        raise ValueError(
            f"{name} must have an isotropic material (E, nu), got {check.shown(material)}; use Contact.hertz"
        )
    return float(E), float(nu)


def sunk(law: np.ndarray, memory: np.ndarray) -> np.ndarray:
    """How much lower than at first the surface of each contact lies [m]: its dent, or how far felt is still pressed.

    ``law`` (n_contacts, 9 or 4) is that of the compiled loops, ``memory`` (..., n_contacts) what its contacts remember.
    """
    found = np.zeros(memory.shape)
    for i, row in enumerate(law if law.shape[1] == WIDTH else ()):
        a, z = row[EXPONENT], np.abs(memory[..., i])
        if row[KIND] == PLASTIC:
            first = row[FIRST_YIELD]
            deepest = np.maximum(z, first)
            found[..., i] = deepest - (first / deepest) ** (a - 1.0) * (a * deepest - (a - 1.0) * first)
        elif row[KIND] == FELT:
            found[..., i] = (row[SHARE] * z) ** (1.0 / a)
    return found


def wall_time(stiffness: Any, exponent: Any, mobility: Any, speed: Any, compliance: Any = 0.0) -> np.ndarray:
    """Contact times [s] of masses 1 / ``mobility`` [1/kg] on a rigid wall, without loss; the arguments broadcast.

    ``T = 2 sqrt(pi) Gamma(1 + q) / Gamma(1/2 + q) deepest / speed`` with ``q = 1 / (exponent + 1)``. A ``compliance``
    [m/N] in series counts for a linear contact only.

    References
    ----------
    Euphonics 12.1.1.
    """
    q = 1.0 / (np.asarray(exponent) + 1.0)
    # in logarithms: the direct form overflows for extreme stiffness or speed
    deepest = np.exp(q * (2.0 * np.log(speed) - np.log(2.0 * q * stiffness) - np.log(mobility)))
    series = np.sqrt(1.0 + np.where(q == 0.5, stiffness * np.asarray(compliance), 0.0))
    return np.asarray(2.0 * np.sqrt(np.pi) * gamma(1.0 + q) / gamma(0.5 + q) * deepest / speed * series)


def acting_stiffness(law: Any, mobility: Any, speed: Any) -> np.ndarray:
    """Stiffness [N/m**exponent] of the power law that stands for a law, as `Contact.numbers` gives it, in a blow.

    Of masses 1 / ``mobility`` [1/kg] on a rigid wall; mobility and speed broadcast. The power law stores the same
    energy at the same deepest approach; felt has relaxed for about the contact time.
    """
    k, a, kind = law[STIFFNESS], law[EXPONENT], law[KIND]
    whole = np.full(np.broadcast_shapes(np.shape(mobility), np.shape(speed)), k, float)
    if kind == POWER:
        return whole
    if kind == FELT:
        for _ in range(4):
            time = wall_time(whole, a, mobility, speed)
            whole = k * (law[RELAXATION] + (1.0 - law[SHARE]) * time) / (law[RELAXATION] + time)
        return whole
    energy = 0.5 * np.asarray(speed) ** 2 / np.asarray(mobility)  # [J]
    deepest = ((a + 1.0) * energy / k) ** (1.0 / (a + 1.0))  # [m] by the power law alone
    if kind == PLASTIC:
        first = law[FIRST_YIELD]
        force, steep = k * first**a, a * k * first ** (a - 1.0)
        further = np.maximum(energy - force * first / (a + 1.0), 0.0)
        beyond = first + (np.sqrt(force * force + 2.0 * steep * further) - force) / steep
        deepest = np.where(deepest > first, beyond, deepest)
    else:
        low, high = np.zeros_like(deepest), deepest
        hard, b = law[HARD], law[HARD_EXPONENT]
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            over = np.maximum(middle - law[DEPTH], 0.0)
            stored = k * middle ** (a + 1.0) / (a + 1.0) + hard * over ** (b + 1.0) / (b + 1.0)
            low, high = np.where(stored < energy, middle, low), np.where(stored < energy, high, middle)
        deepest = np.where(deepest > law[DEPTH], high, deepest)
    return np.where(deepest > 0.0, (a + 1.0) * energy / np.maximum(deepest, 1e-300) ** (a + 1.0), k)


def loss_number(restitution: float) -> float:
    """Hunt and Crossley's ``loss * speed`` [-] that gives a restitution on a rigid wall."""
    e = restitution
    if e > 1.0 - 1e-6:
        return 1.5 * (1.0 - e)

    def excess(t: float) -> float:
        number = -float(np.expm1(-t)) / e
        return float(np.log1p(number)) + t - number * (1.0 + e)

    # solve for t = -ln(1 - e number): for small e, rounding makes the number 1/e, but t stays accurate
    t = brentq(excess, -float(np.log1p(-e * (1.0 - e))), 3.0 / e + 10.0, xtol=1e-300, rtol=1e-15)
    return -float(np.expm1(-t)) / e
