"""Strikers: a rigid mass, a sphere, a stick or any body with modes, its contact point, and the hand that holds it."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .._base import check
from .._base.remembered import Remembered
from ..fe import plausible
from ..fe.section import Material
from ..modes import free_body
from ..modes.body import Body
from ..modes.modal import Modes, left_out
from ..modes.shapes import REMEMBERED, WrappedShapes
from ..modes.slender import SHEAR_RATIO, beam
from .accuracy import left_out_density

STICK_MODES = 96  # [-] bending modes of a stick, known in closed form; each blow keeps as many of them as it needs
GRAVITY = 9.80665  # [m/s^2] standard; the true one is within 0.3 % of it everywhere
STIFF_HAND = 0.3  # [-] highest frequency in the hand over the first bending frequency: the squares add to some 10 %


@dataclass(frozen=True)
class Hand:
    """What holds a striker: a spring, a damper and a constant force, as felt at its contact point.

    They act along the blow on the rigid motion of the striker, not on its bending. Of a stick that turns about its
    fulcrum, they are the hand's torques divided by the distance of the tip, stiffness and damping by its square. The
    spring is slack with the striker at the surface; the force then presses or, if negative, draws back, so that the
    striker would rest at ``force / stiffness`` beyond the surface.

    Examples
    --------
    >>> grip = fi.Hand(stiffness=200.0, damping=0.5, force=2.0)  # would rest a centimetre beyond the surface
    >>> round(fi.Striker.stick(mass=0.06, first_frequency=500.0).held(grip).hand_frequency, 1)  # Hz
    15.9
    """

    stiffness: float  # [N/m]
    damping: float = 0.0  # [N s/m]
    force: float = 0.0  # [N] towards the struck body: grip or weight

    def __post_init__(self) -> None:
        check.settle(
            self,
            stiffness=check.positive("stiffness", self.stiffness, "N/m"),
            damping=check.non_negative("damping", self.damping, "N s/m"),
            force=check.number("force", self.force, "N"),
        )


@dataclass(frozen=True, eq=False, repr=False)
class HeldShapes(WrappedShapes):
    """The shapes of a body whose rigid motion is held by a spring."""

    omega: float  # [rad/s] of that motion

    def at(self, points: np.ndarray) -> np.ndarray:
        return self.base.at(points)

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        own = self.base.at(points)[:, :1] @ self.base.at(loads)[:, :1].T / self.omega**2
        return self.base.deflection(loads, points) + own

    def dent(self, points: np.ndarray) -> np.ndarray:
        return self.base.dent(points)

    def across(self, points: np.ndarray) -> np.ndarray | None:
        return self.base.across(points)


@dataclass(frozen=True, eq=False, repr=False)
class Striker(check.Brief):
    """A body and the point it strikes with; it arrives in rigid motion, undeformed.

    Its speed is the speed of its contact point: a body hinged at its far end turns about the hinge, a free body moves
    in a straight line unless it is said to turn (`of`, `turning`).
    """

    modes: Modes
    at: np.ndarray  # (dimension,) [m] the contact point
    material: Material | None = None  # of a sphere, for `Contact.between`
    radius: float | None = None  # [m] of a sphere
    fixed: bool = True  # True: a blow keeps all modes; False: only those its tolerance needs
    hand: Hand | None = None  # what holds it, see `held`
    gravity: float = 0.0  # [m/s^2] that pulls it towards the struck body, see `falling`
    arrival: np.ndarray | None = None  # (n_rigid,) modal velocities on arrival, of any size; None: as said above
    aslant: bool = False  # whether it comes turning, or not along the blow

    def __post_init__(self) -> None:
        check.instance("modes", self.modes, Modes)
        if self.material is not None:
            check.instance("material", self.material, Material)
        if self.radius is not None:
            check.settle(self, radius=check.positive("radius", self.radius, "m"))
        if self.modes.n_rigid == 0:
            raise ValueError(
                f"striker must be able to move rigidly, but its lowest mode is at {self.modes.frequencies[0]:g} Hz; "
                "leave it free or support it by one hinge"
            )
        at = self.modes.point("at", self.at)[0]
        object.__setattr__(self, "at", at)
        shape = self.modes.shape_at(at[None])[0]
        if not (shape[: self.modes.n_rigid] != 0.0).any():
            raise ValueError(
                "at must be a point that moves when the striker moves rigidly, got one at rest; move it off the hinge"
            )
        if self.arrival is not None:
            coming = check.array("arrival", self.arrival, (self.modes.n_rigid,))
            check.settle(self, arrival=coming)
            if shape[: self.modes.n_rigid] @ coming <= 0.0:
                raise ValueError("arrival must move the contact point towards the struck body")
        check.lock_arrays(self)
        gravity = check.non_negative("gravity", self.gravity, "m/s^2")
        check.settle(self, aslant=check.flag("aslant", self.aslant), gravity=gravity)
        if self.gravity:
            self._check_free("fall")
        if self.hand is not None:
            check.instance("hand", self.hand, Hand)
            if self.modes.n_rigid != 1:
                raise ValueError(
                    f"hand needs a striker with one rigid motion, got {self.modes.n_rigid}; hinge it where it is held"
                )
            bending = float(self.modes.frequencies[1]) if self.modes.n_modes > 1 else np.inf
            if self.hand_frequency > STIFF_HAND * bending:
                raise ValueError(
                    f"stiffness of the hand must keep the striker below {STIFF_HAND:g} of its bending at {bending:.4g} "
                    f"Hz, got {self.hand_frequency:.4g} Hz; a hand that stiff bends it"
                )

    @classmethod
    def rigid(cls, mass: float) -> "Striker":
        """A rigid mass [kg].

        Examples
        --------
        >>> fi.Striker.rigid(0.03).mass
        0.03
        """
        return cls(Modes.rigid(mass), np.zeros(0))

    @classmethod
    def sphere(cls, material: Material, radius: float) -> "Striker":
        """A rigid solid sphere, radius in m; `Contact.between` computes its Hertz stiffness from the material.

        Examples
        --------
        >>> ball = fi.Striker.sphere(fi.Material(E=210e9, nu=0.3, rho=7850.0), radius=5e-3)
        >>> round(1e3 * ball.mass, 3)  # g
        4.11
        """
        check.instance("material", material, Material)
        radius = check.between("radius", radius, 1e-9, 1e9, "m")  # from a few atoms to a star
        return cls(Modes.rigid(4.0 / 3.0 * np.pi * radius**3 * material.rho), np.zeros(0), material, radius)

    @classmethod
    def stick(
        cls, mass: float, first_frequency: float, *, n_modes: int | None = None, slenderness: float | None = None,
        shear_ratio: float = SHEAR_RATIO,
    ) -> "Striker":  # fmt: skip
        """A uniform stick, hinged at its far end, that strikes with its free end like a drumstick.

        Parameters
        ----------
        mass : float [kg]
            The mass felt at the tip of a rigid stick is a third of this.
        first_frequency : float [Hz]
            Frequency of its first bending mode.
        n_modes : int, optional
            Number of bending modes kept, besides the rigid rotation; the others act by their residual compliance. By
            default, each blow keeps as many as its tolerance needs.
        slenderness : float [-], optional
            Length over diameter. The stick is then a Timoshenko beam, with shear and rotary inertia: at 20, its tenth
            bending mode is a fifth lower than that of a slender one with the same first mode.
        shear_ratio : float [-]
            E / G, only with slenderness: 2.6 if isotropic, some 10 to 20 for wood along the grain.

        Examples
        --------
        >>> stick = fi.Striker.stick(mass=0.1, first_frequency=10e3)
        >>> round(stick.felt_mass, 6)  # kg
        0.033333
        """
        # higher modes than the thousandth have wavelengths as short as its thickness, where beam theory fails
        kept = STICK_MODES if n_modes is None else check.count("n_modes", n_modes, high=1000)
        thick: dict[str, Any] = {}
        if slenderness is not None:
            thick = {"theory": "timoshenko", "slenderness": slenderness, "shear_ratio": shear_ratio}
        ends = ("hinged", "free")
        modes = beam(1.0, ends=ends, mass=mass, first_frequency=first_frequency, n_modes=1 + kept, **thick)
        return cls(modes, np.ones(1), fixed=n_modes is not None)

    @classmethod
    def hammer(cls, head: float, handle: float, *, stiffness: float, damping: float = 0.0) -> "Striker":
        """Two masses with a spring and a damper in between: head and handle, or head and hand; the head strikes.

        Parameters
        ----------
        head, handle : float [kg]
            The handle's mass is that felt at the joint.
        stiffness : float [N/m]
        damping : float [N s/m]

        Examples
        --------
        >>> mallet = fi.Striker.hammer(head=0.03, handle=0.06, stiffness=2e4, damping=5.0)
        >>> round(mallet.mass, 3), mallet.modes.frequencies.round(1).tolist()  # kg, Hz
        (0.09, [0.0, 159.2])
        """
        head, handle = check.positive("head", head, "kg"), check.positive("handle", handle, "kg")
        stiffness = check.positive("stiffness", stiffness, "N/m")
        damping = check.non_negative("damping", damping, "N s/m")
        mass, reduced = head + handle, head * (handle / (head + handle))
        omega = float(np.sqrt(stiffness / reduced))
        apart = np.sqrt(handle / head / mass), -np.sqrt(head / handle / mass)
        modes = Modes.from_arrays(
            [0.0, omega / (2.0 * np.pi)],
            [[mass**-0.5, apart[0]], [mass**-0.5, apart[1]]],
            points=[[0.0], [1.0]],  # head and handle
            mass=mass,
            damping_ratio=[0.0, 0.5 * damping / (reduced * omega)],
            complete=True,
        )
        return cls(replace(modes, thick=True), np.zeros(1))  # nothing bends: no shear is left out

    @classmethod
    def flexible(cls, modes: Modes, *, at: Any) -> "Striker":
        """Any body that can move rigidly; it strikes with its point ``at`` [m].

        Examples
        --------
        >>> bar = fi.analytic.beam(0.2, ends=("free", "free"), mass=0.1, first_frequency=2e3, n_modes=12)
        >>> round(fi.Striker.flexible(bar, at=[0.0]).felt_mass, 6)  # kg: a quarter, at its end
        0.025
        """
        return cls(modes, at)

    @classmethod
    def of(
        cls, body: Body, where: Any, *, direction: Any = "normal", along: Any = None, pivot: Any = None,
        material: Material | None = None, radius: float | None = None,
    ) -> "Striker":  # fmt: skip
        """A body of another program, such as a bat or a hammer; its rigid motions are among its modes.

        Parameters
        ----------
        body : Body
        where : node, by number, name or point (3,) [m], that strikes
        direction : "normal", "x", "y", "z" or a vector (3,)
            From this body into the struck one, square to both at their contact.
        along : vector (3,), optional
            In which it moves if that is not the direction: an oblique blow. Its speed is that along the direction.
        pivot : array_like, shape (3,) [m], optional
            Point about which it turns as it arrives; from then on it is free. About a hinge that goes on holding it
            turn modes of a body hinged there.
        material, radius : Material, float [m], optional
            Of a round tip, for `Contact.between`.

        Raises
        ------
        ValueError
            If the rigid motions do not allow this arrival, or move another mass than that of the body.

        Examples
        --------
        >>> nodes = [(x, 0.0, 0.0) for x in (-0.3, 0.0, 0.3)]
        >>> rod = fi.Body.rigid(0.12, (0.0, 3.6e-3, 3.6e-3), nodes, names={"tip": 3})
        >>> swung = fi.Striker.of(rod, "tip", direction="z", pivot=(-0.3, 0.0, 0.0))
        >>> hit = fi.strike(fi.Modes.rigid(0.03), swung, fi.Contact.linear(1e5), at=None, speed=2.0)
        >>> rod.displacement(hit.modal_state([0.0], body=0)[1], 1)[0, 0].round(9).tolist()  # m/s, of the other end
        [0.0, 0.0, 0.0]
        """
        check.instance("body", body, Body)
        way, row = body.way(where, direction), body.node(where)
        coming = free_body.arrival_velocities(body, row, way, along, pivot)
        aslant = along is not None or pivot is not None
        return cls(body.modes(way), body.nodes[row, body.axes], material, radius, arrival=coming, aslant=aslant)

    @classmethod
    def turning(cls, mass: float, inertia: float, arm: Any, *, pivot: Any = None) -> "Striker":
        """A free rigid body that strikes beside its centre of mass, and so begins to turn.

        It is felt as ``1 / (1 / mass + across**2 / inertia)``. Its points are the centre of mass, the contact point and
        the pivot, as (across, ahead), without a coordinate in which none of them differ.

        Parameters
        ----------
        mass : float [kg]
        inertia : float [kg m^2]
            About the centre of mass, around the axis at right angles to the blow and to its arm.
        arm : (across, ahead) [m]
            The contact point from the centre of mass: beside the line of the blow, and towards the struck body.
        pivot : (across, ahead) [m], optional
            The point, from the centre of mass, about which it turns as it arrives: the grip of a hammer. By default it
            moves straight.

        Examples
        --------
        >>> club = fi.Striker.turning(0.3, inertia=2e-4, arm=(0.02, 0.05), pivot=(-0.9, 0.0))
        >>> round(club.felt_mass, 4), round(1.0 / (1.0 / 0.3 + 0.02**2 / 2e-4), 4)  # kg
        (0.1875, 0.1875)
        """
        inertia = check.positive("inertia", inertia, "kg m^2")
        places = {"arm": arm} if pivot is None else {"arm": arm, "pivot": pivot}
        nodes = np.zeros((1 + len(places), 3))
        nodes[1:, [0, 2]] = [check.array(name, place, (2,), "m") for name, place in places.items()]
        body = Body.rigid(mass, inertia, nodes)
        return cls.of(body, 2, direction="z", pivot=None if pivot is None else nodes[2])

    def held(self, hand: Hand) -> "Striker":
        """The same striker held by a hand, which brings it back after each bounce.

        Such a blow may never end by itself: give it a duration, or a number of impacts. The ``restitution`` counts the
        speed at its last separation.

        Examples
        --------
        >>> stick = fi.Striker.stick(mass=0.06, first_frequency=500.0).held(fi.Hand(stiffness=100.0, force=1.0))
        >>> table, law = fi.Modes.rigid(50.0), fi.Contact.restituting(1e7, 1.5, restitution=0.8, speed=0.5)
        >>> buzz = fi.strike(table, stick, law, at=None, speed=0.5, max_impacts=5, tolerance=1e-2)
        >>> buzz.n_impacts
        5
        """
        return replace(self, hand=hand)

    def falling(self, gravity: float = GRAVITY) -> "Striker":
        """The same striker with its weight, which brings it back after each bounce.

        Flights are exact. Such a blow may never end by itself: give it a number of impacts, or a duration, in which it
        may come to rest; the last impact then goes on, and has no restitution. Each other has its ``restitution``,
        `Response.restitution_errors` says how exact it is, and `Response.striker_speeds` how fast the striker itself
        came and left, which decides how high it rises. Where the struck body still moves, each bounce depends on when
        it comes: small errors grow from bounce to bounce, and the blow says so.

        Parameters
        ----------
        gravity : float [m/s^2]
            Towards the struck body; of an inclined one, its part along the blow.

        Examples
        --------
        >>> ball = fi.Striker.rigid(0.02).falling()
        >>> law = fi.Contact.restituting(1e8, 1.5, restitution=0.8, speed=2.0)
        >>> hit = fi.strike(fi.Modes.rigid(1e6), ball, law, at=None, speed=ball.dropped(0.2), max_impacts=3)
        >>> [round(impact.restitution, 2) for impact in hit.impacts]
        [0.8, 0.83, 0.86]
        >>> (hit.striker_speeds[:, 1] ** 2 / (2 * 9.80665)).round(3).tolist()  # m
        [0.128, 0.089, 0.066]
        """
        return replace(self, gravity=gravity)

    @property
    def returns(self) -> bool:
        """Whether a hand or its weight brings the striker back after each bounce."""
        return self.hand is not None or self.gravity > 0.0

    def dropped(self, height: float) -> float:
        """Speed [m/s] with which the striker arrives after a fall from rest, for the ``speed`` of a blow.

        ``sqrt(2 g h)``: the air slows a steel ball of 1 cm by 0.3 % over the first metre, a hollow or light one by far
        more. A striker that turns about a hinge or is held by a hand does not fall freely. For what the weight does
        after the first impact see `falling`.

        Parameters
        ----------
        height : float [m]
            From the contact point at rest to the surface.

        Examples
        --------
        >>> ball = fi.Striker.sphere(fi.Material(E=210e9, nu=0.3, rho=7850.0), radius=5e-3)
        >>> round(ball.dropped(0.3), 3)  # m/s
        2.426
        """
        height = check.positive("height", height, "m")
        self._check_free("be dropped")
        return float(np.sqrt(2.0 * (self.gravity or GRAVITY) * height))

    def _check_free(self, what: str) -> None:
        """Raise ValueError if the striker does not fall freely."""
        if self.hand is not None:
            raise ValueError(f"striker must fall freely to {what}, a hand holds this one; leave gravity or hand out")
        if self.aslant or (self.modes.n_rigid == 1 and self.felt_mass < (1.0 - 1e-9) * self.mass):
            advice = "give its speed" if what == "be dropped" else "leave gravity out"
            raise ValueError(f"striker must fall freely to {what}, but this one turns or comes aslant; {advice}")

    def let_go(self, what: str) -> None:
        """Raise ValueError if a hand or the weight brings the striker back, for ``what`` cannot follow it."""
        if self.returns:
            how = "be held by a hand" if self.hand is not None else "fall"
            raise ValueError(f"striker must not {how} in {what}, which follows single blows; leave it free")

    @cached_property
    def body(self) -> Modes:
        """The modes of the striker as it is held; without a hand its own."""
        if self.hand is None:
            return self.modes
        omega, damping = self.modes.omega.copy(), self.modes.damping_ratio.copy()
        omega[0] = 2.0 * np.pi * self.hand_frequency
        damping[0] = 0.5 * self.hand.damping / (self.felt_mass * omega[0])
        return replace(self.modes, omega=omega, damping_ratio=damping, shapes=HeldShapes(self.modes.shapes, omega[0]))

    @property
    def hand_frequency(self) -> float:
        """Frequency [Hz] of the striker swinging in the hand; 0 if nothing holds it."""
        stiffness = 0.0 if self.hand is None else self.hand.stiffness
        return float(np.sqrt(stiffness / self.felt_mass)) / (2.0 * np.pi)

    @cached_property
    def push(self) -> np.ndarray:
        """Constant modal forces of the hand, or of the weight, (n_modes,) [N kg**-0.5]."""
        push = self.gravity * self.motion
        if self.hand is not None:
            push[0] = self.hand.force * self.shape[0]
        return push

    @property
    def mass(self) -> float:
        """Mass of the body [kg]."""
        return self.modes.mass

    @cached_property
    def shape(self) -> np.ndarray:
        """Mass-normalised shapes at the contact point, (n_modes,) [kg**-0.5]."""
        return self.modes.shapes.at(self.at[None])[0]

    @cached_property
    def motion(self) -> np.ndarray:
        """Modal velocities per unit speed of the contact point on arrival, (n_modes,) [kg**0.5]."""
        if self.arrival is None:
            return self.modes.rigid_motion(self.at[None])
        n = self.modes.n_rigid
        return np.append(self.arrival / (self.shape[:n] @ self.arrival), np.zeros(self.modes.n_modes - n))

    @cached_property
    def left_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Residual compliance at the contact point, (1, 1) [m/N], and its estimated error, (1,)."""
        return left_out(self.modes, self.at[None], self.shape[None])

    @cached_property
    def bending_compliance(self) -> tuple[float, float, float]:
        """Compliance of all bending at the contact point [m/N], and `accuracy.left_out_density` there."""
        rigid = self.modes.truncated(n_modes=self.modes.n_rigid)
        whole = rigid.residual_compliance(self.at[None])[0, 0]
        return float(whole), *left_out_density(self.modes, self.at[None])

    @cached_property
    def known(self) -> Remembered:  # the striker with fewer modes, and as blows take it
        return Remembered(REMEMBERED)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed, and numbers that are probably a slip of a unit."""
        return plausible.together(self.modes.notes, () if self.material is None else self.material.notes)

    @property
    def felt_mass(self) -> float:
        """Mass felt at the contact point if the striker is rigid [kg]."""
        rigid = self.shape[: self.modes.n_rigid]
        return 1.0 / float(rigid @ rigid)
