"""Two simple targets, a rigid body and an infinite plate, and the errors of using them."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ellipkm1

from .._base.rounding import ROUNDING, SAME
from ..fe.assembly import support_of_facets
from ..fe.section import Material, Plate
from ..fe.splitting import distance
from ..impact import threshold
from ..mesh.facets import angles, cross_product
from ..mesh.meshes import Mesh
from ..modes.modal import Modes, at_rest
from ..modes.shapes import SampledShapes
from .target import FIRST_LOOK, Target

PULSE = 1.77  # [-] fact: peak response of an oscillator to a half sine, over its static response
SOFTEST = 10.2158  # [-] fact: first eigenvalue (k r)**2 of a clamped disk; a body around the disk has a lower one
HEAVIEST = 0.3  # [-] damping ratio of the contact with an infinite plate; below it, the striker always rebounds
NEAREST = 2.0  # [-] least clearance**2 / (rate contact time); below it, the echo returns during the contact


@dataclass(frozen=True)
class Estimates:
    """What is known of a target without finite elements, and the errors of simplifying it."""

    mass: float  # [kg] of the whole body
    rigid: float  # [-] error of treating it as rigid
    endless: float  # [-] error of treating it as infinite; inf if that is wrong or unknown
    mobility: float  # [m/(N s)] of the infinite plate; inf if unknown
    echo: float = 0.0  # [s] after which waves return from the nearest edge, over half the phase they return with
    # about the mobility [m/(N s)] with the free edges that waves reach during the contact, and the echo [s] from others
    local: tuple[float, float] = (np.inf, 0.0)
    notes: tuple[str, ...] = ()  # on the strike point


@dataclass(frozen=True, eq=False)
class Waves:
    """Bending waves of a plate of constant thickness: ``omega = rate(direction) k**2``, rates in m**2/s.

    An orthotropic plate is mapped to a plane that is shrunk along the stiff direction and stretched by as much across.
    There both directions are equally stiff, and a round ripple stays nearly round.
    """

    stretch: np.ndarray  # (2, 2) [-] from the plate to that plane; it keeps areas
    rate: float  # harmonic mean over all directions: the isotropic plate of this rate has the same mobility
    fastest: float  # of a group of waves in the stretched plane
    slowest: float  # in the stretched plane
    least: float  # in the plate itself

    @classmethod
    def of(cls, material: Material, thickness: float) -> "Waves":
        """Waves in a material, in a plate of a thickness [m].

        Notes
        -----
        Along and across the grain the rigidities per mass are ``A`` and ``B``, in the direction of a wave at an angle
        with sine s and cosine c ``A c**4 + 2 H c**2 s**2 + B s**4``, H = D12 + 2 D66 per mass. Stretching the plane by
        ``(A / B)**(1/8)`` makes this ``sqrt(A B) (1 - (1 - beta) / 2 sin(2 angle)**2)``, ``beta = H / sqrt(A B)``.
        """
        along = replace(material, angle=0.0).plane_stress * (thickness**2 / (12.0 * material.rho))
        a, b, h = along[0, 0], along[1, 1], along[0, 1] + 2.0 * along[2, 2]
        middle = a**0.25 * b**0.25
        inner = 0.5 * (1.0 + h / np.sqrt(a) / np.sqrt(b))  # above zero, as the rigidities are positive definite
        # the group that arrives from a distance d after t has the phase d**2 / (4 t rate (1 + (rate' / rate)**2 / 4)),
        # whose denominator is largest where the squared rate over the middle one is
        squared = np.clip(3.0 * inner / (1.0 + inner), *sorted((inner, 1.0)))
        fastest = ((1.0 + inner) * squared - inner) / squared**1.5
        cosine, sine = np.cos(material.angle), np.sin(material.angle)
        narrow = (b / a) ** 0.125
        crossing = (b - h) / (a + b - 2.0 * h) if a + b != 2.0 * h else 0.0  # c**2 of the least rate
        least = a * crossing**2 + 2.0 * h * crossing * (1.0 - crossing) + b * (1.0 - crossing) ** 2
        return cls(
            np.array([[narrow * cosine, narrow * sine], [-sine / narrow, cosine / narrow]]),
            rate=float(0.5 * np.pi * middle / ellipkm1(inner)),
            fastest=float(middle * fastest),
            slowest=float(middle * min(1.0, inner) ** 0.5),
            least=float(np.sqrt(min(a, b, least) if 0.0 < crossing < 1.0 else min(a, b))),
        )

    def mobility(self, per_area: float) -> float:
        """Mobility [m/(N s)] of the infinite plate at any point, for a mass per area [kg/m**2].

        Notes
        -----
        ``1 / (8 rate per_area)``: the integral of ``1 / (16 pi sqrt(D(angle) per_area))`` over all directions, a
        complete elliptic integral. A unit impulse starts waves of all wave vectors; the integral over their lengths
        gives a step, which is summed over their directions.
        """
        return 1.0 / (8.0 * self.rate * per_area)


@dataclass(frozen=True)
class Surroundings:
    """Area and edges of a plate around the strike point."""

    area: float  # [m**2]
    perimeter: float  # [m]
    clearance: float  # [m] from the point to the nearest edge
    edges: np.ndarray  # (n, 2) distance [m] and length [m] of every piece of the edge
    sectors: np.ndarray  # (n, 2) twice the area [m**2] and angle [rad] between the point and every piece, with signs

    @classmethod
    def of(cls, mesh: Mesh, at: np.ndarray, stretch: np.ndarray | None = None) -> "Surroundings | None":
        """The view from a point (2,) [m]; None if the point is not clearly on the body.

        ``stretch`` (2, 2) maps the plate to the plane of `Waves`; it keeps areas.
        """
        corners = mesh.points[mesh.cells]
        sides = np.roll(corners, -1, axis=1) - corners
        turns = np.sign(cross_product(sides[:, 0], sides[:, 1]))  # which way round they go
        off = at - corners
        inside = cross_product(sides, off) * turns[:, None] >= 0.0
        if not inside.all(axis=1).any():
            return None
        ends = np.stack([mesh.points[mesh.facets[:, 0]], mesh.middles, mesh.points[mesh.facets[:, 1]]], axis=1)
        if stretch is not None:
            ends, at = ends @ stretch.T, stretch @ at
        start, along = ends[:, :-1].reshape(-1, 2), np.diff(ends, axis=1).reshape(-1, 2)
        length = np.linalg.norm(along, axis=1)
        away = distance(at, start, start + along)
        one, two = start - at, start + along - at
        sectors = np.column_stack([cross_product(one, two), angles(one, two)])
        return cls(mesh.area, float(length.sum()), float(away.min()), np.column_stack([away, length]), sectors)

    def local(self, reach: float, free: np.ndarray) -> tuple[float, float]:
        """Factor [-] of the mobility by edges within a squared ``reach`` [m**2], and the squared distance of others.

        ``free`` (n_facets,) marks those that are. The waves have the mass that they meet to move, which is half at a
        free edge and a quarter at a corner. A power of 1.2 makes this the 2.3 of a free edge: Cremer, Heckl and
        Petersson, section 5.3.
        """
        near = self.edges[:, 0] ** 2 < reach
        if not near.any() or not np.repeat(free, 2)[near].all():
            return 1.0, self.clearance**2
        sign, (area, angle) = np.sign(self.sectors[:, 0]), np.abs(self.sectors.T)
        disks = reach * 1.1 ** np.arange(200)  # [m**2] squared radii, up to far beyond the plate
        share = np.minimum(area, disks[:, None] * angle) @ sign / (2.0 * np.pi * disks)  # [-] of each on the plate
        return share[0] ** -1.2, disks[np.argmax(share <= 0.9 * share[0])]

    def mirrors(self, nearness: float) -> float:
        """Number of straight edges, at least 1, that reflect as much as all edges near the nearest one."""
        zone = self.clearance * (1.0 + 0.5 / nearness)
        straight = 2.0 * self.clearance / np.sqrt(nearness)
        return max(1.0, float(self.edges[self.edges[:, 0] <= zone, 1].sum()) / straight)


def rigid_plate(point: np.ndarray, mass: float) -> Modes:
    """A rigid, fixed body of a mass [kg], struck at a point (dimension,) [m]: one mode that is zero there."""
    nothing = np.zeros((1, 1))
    return Modes(np.ones(1), np.zeros(1), SampledShapes(point[None], nothing, nothing), mass)


def infinite_plate(point: np.ndarray, mass: float, mobility: float, duration: float) -> Modes:
    """An infinite plate struck at a point (2,) [m]: the velocity there is mobility [m/(N s)] times force.

    One strongly overdamped mode, which follows the force at once and does not spring back. The displacement of an
    infinite Kirchhoff plate after a unit impulse is a step, the mobility: 1 / (8 sqrt(rigidity mass-per-area)), or
    `Waves.mobility` if orthotropic. Cremer, Heckl and Petersson, Structure-Borne Sound, 3rd ed. (2005), section 5.3;
    Zener (1941), Phys. Rev. 59, 669.
    """
    rate = 1.0 / (SAME * duration)  # 2 zeta omega
    omega = np.sqrt(ROUNDING / duration * rate)
    shape = np.sqrt(mobility * rate)
    shapes = SampledShapes(point[None], np.array([[shape]]), np.array([[(shape / omega) ** 2]]))
    return Modes(np.array([omega]), np.array([0.5 * rate / omega]), shapes, mass)


def rigid_error(modes: Modes, at: np.ndarray, mass: float, duration: float) -> float:
    """Error [-] of treating a body with known modes, up to several times the contact frequency, as rigid.

    Struck at a point (dimension,) [m] by a striker whose ``mass`` [kg] is felt at its contact point; ``duration`` [s]
    is the contact time on a rigid wall. The larger of two errors: the energy left in the body changes the restitution,
    and the body's deflection changes contact time and peak force. Each mode responds to a half-sine force with the
    least of its impulsive, quasi-static and drift responses. The result is 0.9 to 3 times the measured error, for Hertz
    and linear contacts.
    """
    omega_0 = np.pi / duration
    point = at[None]
    squared = modes.shape_at(point)[0] ** 2
    ratio = omega_0 / np.maximum(modes.omega, 1e-9 * omega_0)
    beyond = max(0.0, float(modes.residual_compliance(point)[0, 0]))
    yields = float(squared @ np.minimum(np.pi, np.minimum(2.0 * ratio, PULSE * ratio**2)) + PULSE * omega_0**2 * beyond)
    return mass * max(yields, 2.2 * threshold.required_energy(modes, at, 0.5 / duration))


def rigid_bound(view: Surroundings, body_mass: float, rate: float, free: bool, mass: float, duration: float) -> float:
    """Upper bound [-] of `rigid_error` for a plate of a mass [kg] without known modes; ``free``: some edge is.

    ``rate`` [m**2/s] is sqrt(rigidity / mass per area), in the softest direction, or less. Weyl's mode count with twice
    its edge term, plus three rigid motions; every mode has the largest possible shape at the strike point.
    """
    omega_0 = np.pi / duration
    ratio = np.geomspace(1e-6, 1e6, 4001)  # omega / omega_0
    omega = ratio * omega_0
    # the edge term is doubled, as free edges need 1.71 of it (refinement.EDGE_TERM)
    number = view.area * omega / (4.0 * np.pi * rate) + 2.0 * view.perimeter * np.sqrt(omega / rate) / (4.0 * np.pi)
    yields = np.minimum(np.pi, np.minimum(2.0 / ratio, PULSE / ratio**2))
    total = 3.0 * np.pi + float(np.sum(0.5 * (yields[1:] + yields[:-1]) * np.diff(number)))
    lively = 16.0 if free else 4.0  # squared shape times mass: 2 for each pair of hinged edges, 4 at a free beam's end
    return lively * mass / body_mass * total


def slowest_rate(view: Surroundings, first_frequency: float) -> float:
    """Lower bound [m**2/s] of sqrt(rigidity / mass per area) for a plate with this first flexible frequency [Hz].

    A disk of radius area / perimeter fits into any simply connected outline; clamped, it has a higher first frequency.
    """
    return 2.0 * np.pi * first_frequency * (view.area / view.perimeter) ** 2 / SOFTEST


def endless_error(
    view: Surroundings, mobility: float, rate: float, mass: float, duration: float, *, slowest: float | None = None
) -> float:
    """Error [-] of treating a plate as infinite, of that mobility [m/(N s)]; inf if the echo may reach the striker.

    ``rate`` [m**2/s] is sqrt(rigidity / mass per area); of an orthotropic plate `Waves.fastest`, with the view in its
    stretched plane, and ``slowest`` its `Waves.slowest`; mass and duration as in `rigid_error`. An edge at distance d
    adds the ``Si(d**2 / (rate t))`` term of its image to the displacement. The smooth pulse averages the ripple of this
    term down to the inverse square of ``d**2 / (rate T)``. The striker cannot touch again if, when the echo returns, it
    is farther away than all modes in phase could lift the plate.
    """
    ratio = 0.5 * mass * mobility * np.pi / duration  # damping ratio of a linear contact
    if ratio > HEAVIEST:
        return float("inf")
    contact = duration * (1.0 + ratio)
    nearness = view.clearance**2 / (rate * contact)
    if nearness < NEAREST:
        return float("inf")
    restitution = np.exp(-np.pi * ratio / np.sqrt(1.0 - ratio**2))
    first = 15.5 * (slowest or rate) / view.area  # [rad/s] hinged disk of this area; other supported plates are higher
    lift = mobility * (1.0 + 8.0 / np.pi * np.log(3.0 * np.pi / (duration * first)))
    echo = view.clearance**2 / rate
    if restitution * (echo - contact) < (1.0 + restitution) * mass * lift:
        return float("inf")
    # one straight edge errs by 0.1 to 0.4 times ratio / nearness**2 as measured, all round a disk's centre by 4
    return 1.2 * view.mirrors(nearness) * ratio / nearness**2


def estimate(target: Target, at: Any, mass: float, duration: float) -> Estimates | None:
    """What is known of a target struck at a point on it without finite elements; None if that is not enough.

    Mass and duration as in `rigid_error`.
    """
    mesh, section, find, at = target.mesh, target.section, target.closed, np.asarray(at, float)
    if mesh is None or section is None:
        return None
    stretch, rigid = 1.0, np.inf
    notes: tuple[str, ...] = ()
    if find is not None:
        first = find(n_modes=FIRST_LOOK)
        modes = target.finished(first)
        stretch = modes.frequencies[-1] / first.frequencies[-1]
        notes = at_rest(modes, at[None])
        # modes up to 20 times the contact frequency decide if it is rigid: one there gives 1 / 400 as much; but a plan
        # should take no time, and looks at 5000 at most
        most = modes.frequencies[-1] * (5000 / FIRST_LOOK) ** (2.0 / modes.dimension)
        limit = min(20.0 * 0.5 / duration, most)
        if limit > modes.frequencies[-1]:
            with target.blame("mesh"):
                modes = target.finished(find(max_frequency=limit / stretch))
        rigid = rigid_error(modes, at, mass, duration)
        if modes.dimension == 1:
            return Estimates(modes.mass, rigid, np.inf, np.inf, notes=notes)
    attached = target.point_masses or target.point_supports
    if not isinstance(section, Plate) or callable(section.thickness) or not section.uniform or attached:
        return None
    kinds = support_of_facets(mesh, dict(target.supports))
    free = np.array([kind not in ("clamped", "hinged") for kind in kinds])
    view = Surroundings.of(mesh, at)
    if view is None:
        return None
    waves = Waves.of(section.material, section.thickness)
    whole = target.scale.get("mass", section.thickness * section.material.rho * view.area)
    if find is None:
        first_frequency = target.scale.get("first_frequency")
        low = waves.least if first_frequency is None else slowest_rate(view, first_frequency)
        rigid = rigid_bound(view, whole, low, bool(free.any()), mass, duration)
        if first_frequency is not None or section.tension:
            return Estimates(whole, rigid, np.inf, np.inf, notes=notes)
    mobility = waves.mobility(stretch * whole / view.area)
    round_view = Surroundings.of(mesh, at, waves.stretch)
    assert round_view is not None
    far = endless_error(round_view, mobility, stretch * waves.fastest, mass, duration, slowest=stretch * waves.slowest)
    echo = round_view.clearance**2 / (stretch * waves.fastest)
    factor, away = round_view.local(NEAREST * stretch * waves.fastest * duration, free)
    return Estimates(whole, rigid, far, mobility, echo, (factor * mobility, away / (stretch * waves.fastest)), notes)
