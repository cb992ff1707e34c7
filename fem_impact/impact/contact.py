"""Contact laws: the force between two bodies as a function of how far they are pressed together."""

import inspect
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from .._base import check
from .compiled.law import MARKS, NUMBERS, Law, Numbers, Row, law_of, row_of
from .compiled.laws.power import wall_time as wall_time

LOWEST_EXPONENT, HIGHEST_EXPONENT = 0.5, 100.0  # [-] limits: below, no longer a spring; above, a wall
YIELDS = 1.6  # [-] fact: pressure at which a round contact first yields, over the yield strength, for nu = 0.3
# [-] loss factor times speed of a contact that hardly throws off by itself: from a wall, 0.2 of the speed
STICKY = 5.0
STIFFEST = 1e200  # [N/m**exponent] upper limit, 1/STIFFEST the lower: high exponents need huge stiffnesses


@dataclass(frozen=True)
class Contact(Numbers):
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

    def __post_init__(self) -> None:
        check.instance("knots", self.knots, tuple)
        check.settle(
            self,
            misfit=check.between("misfit", self.misfit, 0.0, 0.1),
            stiffness=check.positive("stiffness", self.stiffness, "N/m**exponent", reach=STIFFEST),
            exponent=check.between("exponent", self.exponent, LOWEST_EXPONENT, HIGHEST_EXPONENT),
            # the limit is far above that of a contact that swallows the slowest blow whole
            loss=check.between("loss", check.non_negative("loss", self.loss, "s/m"), 0.0, 1e12, "s/m"),
            gap=check.number("gap", self.gap, "m"),
            **{
                name: check.non_negative(name, getattr(self, name), unit) if most == np.inf
                else check.between(name, getattr(self, name), least or 0.0, most, unit)
                for name, (unit, _, _, least, most) in NUMBERS.items()
            },
        )  # fmt: skip
        kinds = [name for name in ("loss", *reversed(MARKS)) if getattr(self, name)]
        if len(kinds) > 1 and not (len(kinds) == 2 and self.loss and MARKS[kinds[1]].damped):
            raise ValueError(
                f"{' and '.join(kinds)} cannot be given together: a contact has a loss factor, yields or is felt, and "
                "a hard layer goes with a loss factor only"
            )
        law_of(self).check(self)

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
    def between(
        cls, sphere: Any, plate: Any, *, yield_strength: float | None = None, loss: float = 0.0, gap: float = 0.0
    ) -> "Contact":
        """Hertz contact of a sphere with a flat body, stiffness ``(4/3) E* sqrt(R)``, ``1/E* = sum (1 - nu**2)/E``.

        Parameters
        ----------
        sphere : Striker
            Made by `Striker.sphere`.
        plate : Plate, Beam or Material
            The flat body; isotropic. For wood, give an isotropic `Material` with its stiffness across the thickness.
        yield_strength : float [Pa], optional
            Of the softer body. The contact then yields as soon as its largest pressure is 1.6 times this; far beyond,
            its mean pressure is 2.8 times this. See `elastic_plastic`.

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
        if getattr(plate, "round", False):
            raise ValueError(
                "plate must be flat, not a round beam; use Contact.hertz with the stiffness of round bodies"
            )
        compliance = 0.0
        for name, material in (("sphere", sphere.material), ("plate", getattr(plate, "material", plate))):
            E, nu = getattr(material, "E", None), getattr(material, "nu", None)
            if getattr(material, "E_across", None) is not None:
                raise ValueError(
                    f"{name} must be isotropic, because the contact of an orthotropic body depends on its stiffness "
                    "across the thickness; give fi.Material with that E instead, or use Contact.hertz with a measured "
                    "stiffness"
                )
            if not isinstance(E, (int, float)) or not isinstance(nu, (int, float)):
                raise ValueError(
                    f"{name} must have an isotropic material (E, nu), got {check.shown(material)}; use Contact.hertz"
                )
            compliance += pressed_compliance(float(E), float(nu))
        law = cls(hertz_stiffness(compliance, sphere.radius), 1.5, loss, gap)
        if yield_strength is None:
            return law
        pressure = YIELDS * check.positive("yield_strength", yield_strength, "Pa", reach=1e20)  # its square counts
        return replace(law, yield_approach=float((0.5 * np.pi * pressure * compliance) ** 2 * sphere.radius))

    @property
    def law(self) -> Law:
        """Which of the laws it follows; see `compiled.law`."""
        return law_of(self)

    @property
    def lossy(self) -> bool:
        """Whether the contact takes energy."""
        return bool(self.loss or self.remembers)

    @property
    def remembers(self) -> bool:
        """Whether the force depends on what was before: the contact yields, or is felt."""
        return self.law.remembers

    @property
    def rated(self) -> bool:
        """Whether the force depends on how fast the contact is pressed."""
        return bool(self.loss or self.law.rated)

    @property
    def special(self) -> bool:
        """Whether it is more than a power law with or without loss."""
        return bool(self.law.mark)

    @property
    def table(self) -> dict[str, Any]:
        """The table [contact] of a scene with this law."""
        taken = inspect.signature(getattr(Contact, self.law.name)).parameters
        names = [name for name in taken if hasattr(self, name) and name != "gap"]
        return {"kind": self.law.name, **{name: getattr(self, name) for name in names}}

    @property
    def numbers(self) -> Any:
        """The law as the compiled loops read it, by name; see `compiled.law`."""
        return row_of(self)

    def force(self, approach: Any, rate: Any = 0.0) -> np.ndarray:
        """Contact force [N] for an approach [m] and its rate [m/s]; never negative.

        Of a contact that yields or is felt, the force as it is first pressed, felt so fast that it does not relax.
        """
        pressed = np.maximum(check.numbers("approach", approach, "m"), 0.0)
        rates = check.numbers("rate", rate, "m/s")
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                force = self.law.force(self, pressed) * (1.0 + self.loss * rates)
        except ValueError:
            raise ValueError(f"rate must have the shape of approach, {pressed.shape}, got {rates.shape}") from None
        if not np.isfinite(force).all():
            raise ValueError("approach and rate must give a finite force; check their units, m and m/s")
        return np.maximum(force, 0.0)


def pressed_compliance(E: float, nu: float) -> float:
    """``(1 - nu**2) / E`` [1/Pa] of a half space; those of both bodies add up to one over Hertz's modulus ``E*``."""
    return (1.0 - nu**2) / E


def hertz_stiffness(compliance: float, radius: float) -> float:
    """Stiffness [N/m**1.5] of a contact of two bodies of that compliance [1/Pa] together and a radius [m]."""
    return 4.0 / 3.0 / compliance * float(np.sqrt(radius))


def depths_of_surfaces(law: np.ndarray, memory: np.ndarray, left: np.ndarray) -> np.ndarray:
    """How much lower than at first the surface of each contact lies [m]: its dent, or how far felt is still pressed.

    ``law`` (n_contacts,) is that of the compiled loops, ``memory`` (..., n_contacts) what its contacts remember, and
    ``left`` the time since bodies parted from them [s].
    """
    found = np.zeros(memory.shape)
    for i, row in enumerate(map(Row._make, law.tolist())):
        if row.kind:
            found[..., i] = law_of(row).sunk(row, memory[..., i], left[..., i])
    return found


def acting_stiffness(row: Any, mobility: Any, speed: Any) -> np.ndarray:
    """Stiffness [N/m**exponent] of the power law that stands for a law, as `Contact.numbers` gives it, in a blow.

    Of masses 1 / ``mobility`` [1/kg] on a rigid wall; mobility and speed broadcast. The power law stores the same
    energy at the same deepest approach; felt has relaxed for about the contact time.
    """
    return law_of(row).acting(row, mobility, speed)


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
