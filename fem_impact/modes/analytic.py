"""Modes from closed formulas, in the same type as FE modes, so that each can check the other."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from scipy import special
from scipy.optimize import elementwise

from .._base import check
from .._base.rounding import EPSILON
from ..fe import plausible
from ..fe.assembly import support_of_facets
from ..fe.section import KINDS, Beam, Plate
from ..mesh.meshes import Mesh
from . import timoshenko
from .modal import BeamlikeShapes, Damping, Modes, Shapes, damping_ratios
from .timoshenko import ENDS

# [-] fact: image forces beyond each shorter side of a hinged plate until rounding, as the n-th gives exp(-2 pi n)
IMAGES = math.ceil(-math.log(EPSILON) / (2.0 * np.pi))
# [-] distance x below which polylogarithms are summed as power series, as (x / 2 pi)**n, beyond as exp(-n x)
NEAR_POLE = 1.0
POWERS = np.append(2, np.arange(3, 60, 2))  # [-] fact: exponents of these series; all other coefficients are zero
SERIES: np.ndarray = (
    (-1.0) ** POWERS * special.bernoulli(60)[POWERS - 1] / (POWERS - 1.0) / special.factorial(POWERS)
)  # zeta(2-k)/k!
DISK_TERMS = 100_000  # [-] most terms summed at the edge of a disk, where they only fall as n**-3; error 5e-11
MOST_MODES = 1_000_000  # [-] largest number of modes of a rectangle or beam; they take a few seconds
MOST_OF_DISK = 50_000  # [-] largest number of modes of a disk; each needs a root search
SHEAR_RATIO = 2.6  # [-] fact: E / G of an isotropic material with nu = 0.3
ROUND = 0.886  # [-] shear coefficient of a round section, nu = 0.3 (Cowper 1966); 0.857 at nu = 0, 0.9 at 0.5
LIMIT = 1e5  # [-] largest slenderness of a Timoshenko beam: beyond, shear is below rounding
DISK_SCAN = 0.5  # [-] step in z = k radius when scanning for roots; roots of one order are about pi apart, six steps


def closed_form(
    mesh: Mesh, section: Plate | Beam, supports: dict[str, Any], theory: str | None = None
) -> Callable[..., Modes] | None:
    """Function of ``n_modes`` or ``max_frequency`` [Hz] that finds the modes of this body; None if no formula does.

    There are formulas for beams of constant section, and for thin isotropic plates of constant thickness without
    tension that are rectangles hinged all round or disks with the same support all round.
    """
    if theory == "mindlin":
        return None
    kinds, (form, *sizes) = support_of_facets(mesh, supports), mesh.form or ("",)
    held = {kind if isinstance(kind, str) else "elastic" for kind in kinds}
    if "elastic" in held:
        return None
    if isinstance(section, Beam):
        uniform = form == "line" and not callable(section.width) and not callable(section.height)
        ends = str(kinds[0]), str(kinds[-1])
        return partial(beam, *sizes, ends=ends, section=section, theory=theory or "euler") if uniform else None
    if callable(section.thickness) or section.material.E_across is not None or section.tension or len(held) > 1:
        return None
    if form == "rectangle" and held == {"hinged"}:
        return partial(rectangle, *sizes, section=section)
    if form == "disk":
        return partial(disk, *sizes, edge=held.pop(), section=section)
    return None


def _finished(
    shapes: Any,
    values: np.ndarray,
    mass: float | None,
    first_frequency: float | None,
    physical: tuple[float, float] | None,
    damping_ratio: Damping,
    notes: tuple[str, ...],
    section: Plate | Beam | None,
) -> Modes:
    """Modes for a section, or for a mass and first frequency, scaled from omega**2 at unit mass and rigidity."""
    if physical is not None:
        mass, factor = physical
    else:
        mass = check.positive("mass", mass, "kg")
        first = check.positive("first_frequency", first_frequency, "Hz")
        factor = 2.0 * np.pi * first / np.sqrt(values[values > 0.0][0])
    omega = np.sqrt(values)
    if not omega[-1] <= check.REACH:
        raise ValueError(f"size gives frequencies beyond all numbers, {omega[-1]:g} rad/s at unit mass and rigidity")
    unit = Modes(omega, np.zeros(len(omega)), shapes, mass=1.0, notes=notes)
    scaled = unit.scaled(mass=mass, first_frequency=factor * unit.frequencies[omega > 0.0][0])
    return replace(scaled.damped(damping_ratios(damping_ratio, scaled.omega)), section=section)


def _physical(
    section: Any, kind: type, mass: float | None, first_frequency: float | None, size: float
) -> tuple[float, float] | None:
    """Mass [kg] of a body of a section, and the factor from omega at unit mass and rigidity to omega.

    ``size`` is its area [m^2] or length [m]. None without a section: then mass and first frequency must both be given.
    """
    given = mass is not None, first_frequency is not None
    if (section is None and not all(given)) or (section is not None and any(given)):
        raise ValueError("give either section, or both mass [kg] and first_frequency [Hz]")
    if section is None:
        return None
    check.instance("section", section, kind)
    if kind is Beam:
        if callable(section.width) or callable(section.height):
            raise ValueError("section must be constant along the beam; else use find_modes")
        point = np.zeros((1, 1))
        rigidity = section.stiffness(point)[0] / size**3
    else:
        if callable(section.thickness) or section.material.E_across is not None or section.tension:
            raise ValueError(
                "section must be isotropic, of constant thickness and without tension; else use find_modes"
            )
        point = np.zeros((1, 2))
        rigidity = section.stiffness(point)[0, 0, 0]
    mass = float(section.inertia(point)[0]) * size
    return mass, float(np.sqrt(rigidity / mass))


def _check_number(about: float, most: int) -> None:
    """Raise ValueError if more than ``most`` modes lie below max_frequency."""
    if about > most:
        raise ValueError(f"max_frequency must give at most {most} modes of this body, got about {about:.2g}; lower it")


def _enough(
    n_modes: int | None,
    max_frequency: float | None,
    physical: tuple[float, float] | None,
    first_frequency: float | None,
    first: float,
    most: int,
) -> tuple[int, float]:
    """Largest number of modes and largest omega (at unit mass and rigidity); the one not asked for is no limit.

    ``first`` is the lowest omega at unit mass and rigidity.
    """
    if (n_modes is None) == (max_frequency is None):
        raise ValueError("give either n_modes or max_frequency [Hz]")
    if n_modes is not None:
        return check.count("n_modes", n_modes, high=most), np.inf
    frequency = check.positive("max_frequency", max_frequency, "Hz")
    if physical is not None:
        return check.MOST, 2.0 * np.pi * frequency / physical[1]
    return check.MOST, frequency / check.positive("first_frequency", first_frequency, "Hz") * first


@dataclass(frozen=True, eq=False, repr=False)
class RectangleShapes(Shapes, check.Brief):
    """Sine shapes of a hinged rectangle of unit mass and rigidity with one corner at the origin."""

    length: float  # [m]
    width: float  # [m]
    numbers: np.ndarray  # (n_modes, 2) half waves along length and width
    dimension: int = 2

    def at(self, points: np.ndarray) -> np.ndarray:
        phase = np.pi * points / (self.length, self.width)  # (n_points, 2)
        return (
            2.0 * np.sin(np.outer(phase[:, 0], self.numbers[:, 0])) * np.sin(np.outer(phase[:, 1], self.numbers[:, 1]))
        )

    def contains(self, points: np.ndarray) -> np.ndarray:
        slack = 1e-9 * max(self.length, self.width)
        inside = (points >= -slack) & (points <= np.array([self.length, self.width]) + slack)
        return np.asarray(inside.all(axis=1))

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Sum of closed-form deflections of an infinite strip (`_strip`); images make the shorter sides hinged."""
        sides = np.array([self.length, self.width])
        across, along = (1, 0) if self.width < self.length else (0, 1)  # the strip runs along the longer sides
        scale = sides[across]
        place, load = points[:, None, None] / scale, loads[None, :, None] / scale  # (n_points, n_loads, n_images, 2)
        images = 2.0 * sides[along] / scale * np.arange(-IMAGES, IMAGES + 1)
        shift = np.stack([place[..., along] + sign * load[..., along] + images for sign in (-1.0, 1.0)])
        once, mirrored = _strip(shift, place[..., across], load[..., across])
        total = once - mirrored
        return np.where(_inside(points, sides)[:, None] & _inside(loads, sides), scale**2 * total, 0.0)

    def take(self, n_modes: int) -> "RectangleShapes":
        return replace(self, numbers=self.numbers[:n_modes])

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        return _grid(self.length, self.width)


@lru_cache(maxsize=4)  # [-] rectangles; a gradient asks for one several times
def _grid(length: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Points [m] and triangles over a rectangle."""
    n = (48, 32)
    x, y = np.meshgrid(np.linspace(0, length, n[0] + 1), np.linspace(0, width, n[1] + 1), indexing="ij")
    node = np.arange(x.size).reshape(x.shape)
    a, b, c, d = node[:-1, :-1].ravel(), node[1:, :-1].ravel(), node[1:, 1:].ravel(), node[:-1, 1:].ravel()
    found = np.column_stack([x.ravel(), y.ravel()]), np.vstack([np.c_[a, b, c], np.c_[a, c, d]])
    for each in found:
        each.setflags(write=False)
    return found


def _inside(points: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Whether points (n, 2) lie strictly inside a rectangle, (n,) bool."""
    return np.asarray((np.minimum(points, sides - points) > 0.0).all(axis=1))


def _strip(shift: np.ndarray, place: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Deflection of an infinite hinged strip of unit width and rigidity under forces, summed over the last axis.

    ``shift`` is the distance along the strip. Each force adds the sum over m of 2 sin(m pi place) sin(m pi load)
    (1 + z) exp(-z) / (4 (m pi)**3), z = m pi shift. This is a difference of polylogarithms in which the constant and
    linear terms cancel.
    """
    x = np.pi * np.abs(shift)
    far = np.pi * (place + load)
    angles = np.stack(np.broadcast_arrays(np.pi * np.abs(place - load), np.minimum(far, 2.0 * np.pi - far), x)[:2])
    near, far = _decaying_cosines(np.broadcast_to(x, angles.shape), angles)
    return (near - far).sum(axis=-1) / (4.0 * np.pi**3)


def _decaying_cosines(x: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Sum over m of cos(m angle) (1 + m x) exp(-m x) / m**3, without the part that does not depend on the angle.

    The sum is Re Li3(exp(mu)) + x Re Li2(exp(mu)), mu = -x + i angle, for angles from 0 to pi and x >= 0.

    References
    ----------
    Wood (1992), The computation of polylogarithms, eq. 9.3, for the power series about mu = 0.
    """
    result = np.empty(x.shape)
    near = x < NEAR_POLE
    gap, u = x[near], -x[near] + 1j * angle[near]
    log = np.log(np.where(u == 0.0, 1.0, -u))
    powers = np.empty((len(POWERS), len(u)), complex)  # by products, many times as fast as by powers
    powers[0], powers[1] = u**2, u**3
    powers[2:] = u**2
    np.multiply.accumulate(powers[1:], out=powers[1:])
    series = gap * (SERIES @ powers) + u * ((SERIES / (POWERS + 1.0)) @ powers)
    result[near] = (0.5 * u**2 * (1.5 - log) + gap * u * (1.0 - log) + series).real
    octave = np.floor(np.log2(np.where(near, 1.0, x)))
    for each in np.unique(octave[~near]):
        part = ~near & (octave == each)  # where terms fall at least as exp(-m 2**each), to rounding
        result[part] = _falling_cosines(x[part], angle[part], math.ceil(-math.log(EPSILON) / 2.0**each))
    return result


def _falling_cosines(x: np.ndarray, angle: np.ndarray, n_terms: int) -> np.ndarray:
    """The sum of `_decaying_cosines` itself over so many terms, at (n,) places."""
    m = np.arange(1.0, n_terms + 1.0)[:, None]
    waves = np.empty((n_terms, 2, len(x)), complex)
    waves[:, 0], waves[:, 1] = np.exp(-x + 1j * angle), np.exp(-x)
    waves = np.multiply.accumulate(waves).real
    return np.asarray(((1.0 + m * x) * (waves[:, 0] - waves[:, 1]) / m**3).sum(axis=0))


def rectangle(
    length: float,
    width: float,
    *,
    mass: float | None = None,
    first_frequency: float | None = None,
    section: Any = None,
    n_modes: int | None = None,
    max_frequency: float | None = None,
    damping_ratio: Damping = 0.0,
) -> Modes:
    """Modes of a hinged (simply supported) rectangular Kirchhoff plate with corners (0, 0) and (length, width) [m].

    Parameters
    ----------
    length, width : float [m]
    mass, first_frequency : float [kg], [Hz]
        Give both of these, or a section.
    section : Plate, isotropic and of constant thickness
    n_modes : int, or max_frequency : float [Hz]
    damping_ratio : float, array (n_modes,) or function of frequency [Hz]

    Returns
    -------
    Modes, with frequencies exact to rounding

    Raises
    ------
    ValueError
        If a size is not positive, or if both or neither of two alternatives are given.

    References
    ----------
    Leissa (1969), Vibration of plates, NASA SP-160, eq. 4.20; Timoshenko and Woinowsky-Krieger, art. 35 (static sum).

    Examples
    --------
    >>> modes = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=3)
    >>> modes.frequencies.round(2).tolist()
    [100.0, 188.17, 311.83]
    """
    length, width = check.positive("length", length, "m"), check.positive("width", width, "m")
    physical = _physical(section, Plate, mass, first_frequency, length * width)
    # with unit mass and unit D the mass per area is 1 / area, so omega = wavenumber**2 * sqrt(area)
    root_area = np.sqrt(length * width)

    def omega(m, n):
        return np.pi**2 * ((m / length) ** 2 + (n / width) ** 2) * root_area

    count, reach = _enough(n_modes, max_frequency, physical, first_frequency, float(omega(1, 1)), MOST_MODES)
    if not np.isfinite(reach):  # start from Weyl's law, then raise the limit until there are enough modes
        reach = 4.0 * np.pi * (count + 2.0) / root_area
        while _lattice(length, width, reach / root_area, count)[0].size < count:
            reach *= 1.3
    m, n = _lattice(length, width, reach / root_area, count)
    _check_number(min(len(m), count), MOST_MODES)
    order = np.lexsort((n, m, omega(m, n)))[:count]
    if not order.size:
        raise ValueError(f"max_frequency must reach the first mode, got {max_frequency:g} Hz")
    numbers = np.column_stack([m[order], n[order]])
    values = omega(*numbers.T) ** 2
    notes = plausible.body((length, width), section)
    shapes = RectangleShapes(length, width, numbers)
    return _finished(shapes, values, mass, first_frequency, physical, damping_ratio, notes, section)


def _lattice(length: float, width: float, wavenumber_squared: float, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Half-wave numbers (m, n), each at most ``most``, with wavenumber**2 up to ``wavenumber_squared`` [1/m^2]."""
    limit = wavenumber_squared * (1.0 + 1e-12)
    size = [int(min(most, side * np.sqrt(limit) / np.pi + 1.0)) for side in (length, width)]
    if size[0] * size[1] > 4 * MOST_MODES:  # more than `rectangle` tries for as many modes as are allowed
        _check_number(size[0] * size[1], MOST_MODES)
    m, n = (grid.ravel() for grid in np.meshgrid(*(np.arange(1, k + 1) for k in size), indexing="ij"))
    keep = np.pi**2 * ((m / length) ** 2 + (n / width) ** 2) <= limit
    return m[keep], n[keep]


def _beam_roots(ends: tuple[str, str], n: int) -> np.ndarray:
    """The first n flexible roots kL, from cos kL = +-1/cosh kL, tan kL = tanh kL or sin kL = 0."""
    i = np.arange(1, n + 1)
    pair = frozenset(ends)
    if pair == {"hinged"}:
        return i * np.pi
    if pair in ({"clamped", "hinged"}, {"hinged", "free"}):
        root = (i + 0.25) * np.pi
        for _ in range(4):  # Newton on sin - cos tanh, whose slope is about sqrt(2)
            root = root - (np.sin(root) - np.cos(root) * np.tanh(root)) / (np.cos(root) + np.sin(root) * np.tanh(root))
        return root
    sign = -1.0 if len(pair) == 2 else 1.0  # clamped-free against clamped-clamped and free-free
    root = (i + 0.5 * sign) * np.pi
    for _ in range(6):
        sech = 1.0 / np.cosh(np.minimum(root, 700.0))
        root = root - (np.cos(root) - sign * sech) / (-np.sin(root) + sign * sech * np.tanh(root))
    return root


@dataclass(frozen=True, eq=False, repr=False)
class BeamShapes(BeamlikeShapes, check.Brief):
    """Shapes of a uniform Euler-Bernoulli beam of unit mass, length and rigidity over x / length in 0 ... 1.

    A flexible shape is A cos kx + B sin kx + C exp(-kx) + D exp(k (x - 1)): bounded terms, so that mode 1000 keeps
    its digits where cosh and sinh would cancel.
    """

    k: np.ndarray  # (n_modes,) wavenumber times length; 0 for rigid motions
    weights: np.ndarray  # (n_modes, 4)

    def at(self, points: np.ndarray) -> np.ndarray:
        x = points[:, :1] / self.length  # (n_points, 1)
        flexible = self.k > 0.0
        k, (a, b, c, d) = self.k[flexible], self.weights[flexible].T
        values = np.empty((len(points), len(self.k)))
        values[:, flexible] = a * np.cos(k * x) + b * np.sin(k * x) + c * np.exp(-k * x) + d * np.exp(k * (x - 1.0))
        values[:, ~flexible] = self.weights[~flexible, 0] + x * self.weights[~flexible, 1]
        return values

    def green(self, load: float, x: np.ndarray) -> np.ndarray:
        return _beam_green(self.ends, load)(x)


def _beam_rigid(ends: tuple[str, str]) -> np.ndarray:
    """Rigid shapes c0 + c1 x of a beam of unit mass and length, (n_rigid, 2)."""
    if ends == ("free", "free"):
        return np.array([[1.0, 0.0], [-np.sqrt(3.0), np.sqrt(12.0)]])
    if ends == ("hinged", "free"):
        return np.array([[0.0, np.sqrt(3.0)]])
    if ends == ("free", "hinged"):
        return np.array([[np.sqrt(3.0), -np.sqrt(3.0)]])
    return np.zeros((0, 2))


@lru_cache(maxsize=64)
def _beam_green(ends: tuple[str, str], load: float) -> Callable[[np.ndarray], np.ndarray]:
    """Deflection of the unit beam under a unit force at ``load`` in 0 ... 1, without its rigid motion.

    The deflection is a polynomial that meets the conditions at the left end, plus a cubic in the distance beyond the
    force. The beam is mirrored if need be so that the force is in its left half: near a clamped end the deflection is
    of the order of the distance cubed, and mirroring keeps its digits.
    """
    if load > 0.5:
        mirrored = _beam_green(ends[::-1], 1.0 - load)
        return lambda x: mirrored(1.0 - x)
    rigid = _beam_rigid(ends)
    carried = -rigid.T @ (rigid @ [1.0, load])  # inertia force c0 + c1 x that balances the unit force
    powers = np.array([0.0, 0.0, 0.0, 0.0, carried[0] / 24.0, carried[1] / 120.0])
    beyond = np.polynomial.Polynomial([-load, 1.0]) ** 3 / 6.0

    def slopes(coefficients: np.ndarray) -> np.ndarray:
        """Derivatives of the polynomial at the right end that must vanish there."""
        whole = np.polynomial.Polynomial(coefficients)
        return np.array([whole.deriv(k)(1.0) if k else whole(1.0) for k in ENDS[ends[1]]])

    free = np.setdiff1d(np.arange(4), ENDS[ends[0]])
    matrix = np.column_stack([slopes(np.eye(4)[k]) for k in free])
    powers[free] = np.linalg.lstsq(matrix, -slopes(powers) - slopes(beyond.coef), rcond=None)[0]
    poly = np.polynomial.Polynomial(powers)

    def bare(x):
        return poly(x) + (x - load).clip(0.0) ** 3 / 6.0

    node, weight = np.polynomial.legendre.leggauss(6)  # exact to degree 11 on either side of the force
    x = np.concatenate([0.5 * load * (node + 1.0), load + 0.5 * (1.0 - load) * (node + 1.0)])
    w = np.concatenate([0.5 * load * weight, 0.5 * (1.0 - load) * weight])
    share = (rigid @ np.vstack([np.ones_like(x), x])) @ (w * bare(x))  # (n_rigid,)
    return lambda x: bare(x) - (share @ rigid) @ np.vstack([np.ones_like(x), x])


def beam(
    length: float,
    *,
    ends: tuple[str, str] = ("hinged", "free"),
    mass: float | None = None,
    first_frequency: float | None = None,
    section: Any = None,
    n_modes: int | None = None,
    max_frequency: float | None = None,
    damping_ratio: Damping = 0.0,
    theory: str = "euler",
    slenderness: float | None = None,
    shear_ratio: float = SHEAR_RATIO,
) -> Modes:
    """Modes of a uniform beam from x = 0 to x = length [m], including rigid motions.

    Parameters
    ----------
    length : float [m]
    ends : two of "clamped", "hinged", "free", for x = 0 and x = length
    mass, first_frequency : float [kg], [Hz] of the lowest bending mode
        Give both of these, or a section.
    section : Beam of constant section
    n_modes : int (rigid motions included), or max_frequency : float [Hz]
    damping_ratio : float, array (n_modes,) or function of frequency [Hz]
    theory : "euler" (slender) or "timoshenko" (with shear and rotary inertia, see `timoshenko`)
    slenderness : float [-], only for "timoshenko" without a section
        Length over the diameter of a round beam, at least 1.
    shear_ratio : float [-], goes with slenderness
        E / G: 2.6 if isotropic with nu = 0.3, some 10 to 20 for wood along the grain.

    Returns
    -------
    Modes, with frequencies exact to rounding; at a free end of a slender beam the squared shape is 4 / mass for every
    bending mode

    Raises
    ------
    ValueError
        If a size is not positive, an end is unknown, or both or neither of two alternatives are given.

    References
    ----------
    Bishop and Johnson (1960), The mechanics of vibration, ch. 7; Huang (1961), J. Appl. Mech. 28, 579-584.

    Examples
    --------
    >>> modes = fi.analytic.beam(0.4, ends=("clamped", "free"), mass=0.1, first_frequency=100.0, n_modes=3)
    >>> modes.frequencies.round(2).tolist()
    [100.0, 626.69, 1754.75]
    """
    length = check.positive("length", length, "m")
    if not isinstance(ends, (list, tuple)) or len(ends) != 2:
        raise ValueError(f"ends must be two words, one for each end, got {check.shown(ends)}")
    pair = (check.one_of("ends", ends[0], KINDS), check.one_of("ends", ends[1], KINDS))
    physical = _physical(section, Beam, mass, first_frequency, length)
    stout = _stoutness(theory, section, length, slenderness, shear_ratio)
    notes = plausible.body((length,), section)
    if stout is not None:
        found = _timoshenko(stout, pair, length, n_modes, max_frequency, physical, first_frequency)
        modes = _finished(*found, mass, first_frequency, physical, damping_ratio, notes, section)
        return replace(modes, thick=True)
    rigid = _beam_rigid(pair)
    first = float(_beam_roots(pair, 1)[0] ** 2)
    count, reach = _enough(n_modes, max_frequency, physical, first_frequency, first, MOST_MODES)
    if np.isfinite(reach):
        _check_number(np.sqrt(reach) / np.pi, MOST_MODES)
        count = len(rigid) + int(np.count_nonzero(_beam_roots(pair, int(np.sqrt(reach) / np.pi) + 2) ** 2 <= reach))
    if count <= len(rigid):
        raise ValueError(f"n_modes must exceed the {len(rigid)} rigid motions; max_frequency must reach a bending mode")
    k = _beam_roots(pair, count - len(rigid))
    weights = np.vstack([np.column_stack([rigid, np.zeros_like(rigid)]), _beam_weights(pair, k)])
    shapes = BeamShapes(length, pair, np.concatenate([np.zeros(len(rigid)), k]), weights)
    values = np.concatenate([np.zeros(len(rigid)), k**4])
    return _finished(shapes, values, mass, first_frequency, physical, damping_ratio, notes, section)


def _stoutness(
    theory: str, section: Any, length: float, slenderness: float | None, shear_ratio: float
) -> timoshenko.Stoutness | None:
    """What tells a Timoshenko beam from a slender one; None for the latter."""
    if check.one_of("theory", theory, ("euler", "timoshenko")) == "euler":
        if slenderness is not None:
            raise ValueError("slenderness needs theory = 'timoshenko'")
        return None
    if (slenderness is None) == (section is None):
        raise ValueError("slenderness must be given if there is no section, and only then")
    if section is not None:
        point = np.zeros((1, 1))
        bend, mass = section.stiffness(point)[0], section.inertia(point)[0]
        square = length**2
        stout = timoshenko.Stoutness(section.rotary(point)[0] / mass / square, bend / section.shear(point)[0] / square)
    else:
        square = 1.0 / (16.0 * check.between("slenderness", slenderness, 1.0, LIMIT) ** 2)
        ratio = check.between("shear_ratio", shear_ratio, 2.0, 1e3)
        stout = timoshenko.Stoutness(square, square * ratio / ROUND)
    if not min(stout.R, stout.S) >= LIMIT**-2 / 16.0:
        raise ValueError(f"length must be at most {LIMIT:g} times the height for theory = 'timoshenko'; use 'euler'")
    return stout


def _timoshenko(
    stout: timoshenko.Stoutness, ends: tuple[str, str], length: float, n_modes: int | None,
    max_frequency: float | None, physical: tuple[float, float] | None, first_frequency: float | None,
) -> tuple[timoshenko.TimoshenkoShapes, np.ndarray]:  # fmt: skip
    """Shapes and omega**2 of a Timoshenko beam at unit mass and rigidity."""
    rigid = timoshenko.rigid(ends, stout)
    first = float(np.sqrt(stout.values(ends, len(rigid), 1)[0]))
    count, reach = _enough(n_modes, max_frequency, physical, first_frequency, first, timoshenko.MOST)
    if np.isfinite(reach):
        count = int(stout.count(ends, np.array([reach**2]))[0])
        _check_number(count, timoshenko.MOST)
    if count <= len(rigid):
        raise ValueError(f"n_modes must exceed the {len(rigid)} rigid motions; max_frequency must reach a bending mode")
    p = stout.values(ends, len(rigid), count - len(rigid))
    weights = np.vstack([np.column_stack([rigid, np.zeros_like(rigid)]), stout.weights(ends, p)])
    values = np.concatenate([np.zeros(len(rigid)), p])
    return timoshenko.TimoshenkoShapes(length, ends, stout, values, weights), values


def _beam_weights(ends: tuple[str, str], k: np.ndarray) -> np.ndarray:
    """Weights (n, 4) of cos, sin and the two exponentials that meet the end conditions, for unit mass."""
    far = np.exp(-k)
    one, nought = np.ones_like(k), np.zeros_like(k)
    c, s = np.cos(k), np.sin(k)
    left = [  # derivatives 0 to 3 over k**order, at x = 0
        [one, nought, one, far],
        [nought, one, -one, far],
        [-one, nought, one, far],
        [nought, -one, -one, far],
    ]
    right = [[c, s, far, one], [-s, c, -far, one], [-c, -s, far, one], [s, -c, -far, one]]
    rows = [left[i] for i in ENDS[ends[0]]] + [right[i] for i in ENDS[ends[1]]]
    matrix = np.moveaxis(np.array(rows), 2, 0)  # (n, 4, 4)
    weights = np.linalg.svd(matrix)[2][:, 3, :]
    value, slope, curve, shear = (np.einsum("in,ni->n", np.array(r), weights) for r in right)
    norm = 0.25 * (value**2 - 2.0 * slope * shear + curve**2)  # Rayleigh's identity for the integral of the square
    weights = weights / np.sqrt(norm)[:, None]
    start = np.einsum("in,ni->n", np.array(left[0]), weights)
    turn = np.einsum("in,ni->n", np.array(left[1]), weights)
    clear = np.where(np.abs(start) > 1e-6, start, np.where(np.abs(turn) > 1e-6, turn, weights[:, 0]))
    return weights * np.where(clear < 0.0, -1.0, 1.0)[:, None]


def _bessel(n: Any, z: Any) -> tuple[Any, ...]:
    """J, J', I exp(-z), I' exp(-z) of order n at z."""
    j, dj = special.jv(n, z), special.jvp(n, z)
    i = special.ive(n, z)
    di = 0.5 * (special.ive(n - 1, z) + special.ive(n + 1, z))
    return j, dj, i, di


def _disk_rows(edge: str, nu: float, n: Any, z: Any) -> tuple[Any, ...]:
    """The two edge conditions on J and on I exp(-z): (first_j, first_i, second_j, second_i)."""
    j, dj, i, di = _bessel(n, z)
    moment_j = -(1 - nu) * z * dj + ((1 - nu) * n**2 - z**2) * j
    moment_i = -(1 - nu) * z * di + ((1 - nu) * n**2 + z**2) * i
    if edge == "clamped":
        return j, i, dj, di
    if edge == "hinged":
        return j, i, moment_j / z**2, moment_i / z**2
    shear_j = -(z**3) * dj - (1 - nu) * n**2 * (z * dj - j)
    shear_i = z**3 * di - (1 - nu) * n**2 * (z * di - i)
    return moment_j / z**2, moment_i / z**2, shear_j / z**3, shear_i / z**3


def _disk_roots(edge: str, nu: float, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All roots z = k radius up to ``reach``, ascending, with their order n and weight, (n_roots,) each.

    The shape is J(z r) + weight I(z r) exp(-z).
    """

    def determinant(z, n):
        a, b, c, d = _disk_rows(edge, nu, n, z)
        return a * d - b * c

    found = []
    for n in range(int(reach) + 3):
        low = max(0.3, 0.5 * n)  # there is no root below, and J underflows
        scan = np.linspace(low, reach, 16 + int(max(0.0, reach - low) / DISK_SCAN))
        values = determinant(scan, n)
        turns = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0)
        found.append(np.column_stack([scan[turns], scan[turns + 1], np.full(len(turns), n)]))
    low, high, order = np.vstack(found).T
    z = elementwise.find_root(determinant, (low, high), args=(order,)).x
    a, b, c, d = _disk_rows(edge, nu, order, z)
    weight = np.where(np.abs(b) > np.abs(d), -a / b, -c / d)
    rank = np.lexsort((order, z))
    return z[rank], order[rank], weight[rank]


def _disk_count(z: np.ndarray, order: np.ndarray, reach: float = np.inf) -> int:
    """Number of modes for the roots up to ``reach``: one for a root of order 0, two for any other."""
    return int(np.sum(np.where(order == 0, 1, 2)[z <= reach]))


@dataclass(frozen=True, eq=False, repr=False)
class DiskShapes(Shapes, check.Brief):
    """Bessel shapes of a disk of unit mass and rigidity centred at the origin, computed on the unit disk."""

    radius: float  # [m]
    edge: str
    nu: float
    z: np.ndarray  # (n_modes,) wavenumber times radius; 0 for rigid motions
    order: np.ndarray  # (n_modes,) nodal diameters
    weight: np.ndarray  # (n_modes,) of I exp(-z) relative to J
    phase: np.ndarray  # (n_modes,) 0 for cos, pi/2 for sin
    scale: np.ndarray  # (n_modes,)
    dimension: int = 2

    def at(self, points: np.ndarray) -> np.ndarray:
        r = np.hypot(points[:, 0], points[:, 1])[:, None] / self.radius
        angle = np.arctan2(points[:, 1], points[:, 0])[:, None]
        z, n = self.z, self.order
        growth = np.exp(z * (r - 1.0))
        radial = special.jv(n, z * r) + self.weight * special.ive(n, z * r) * growth
        radial = np.where(z == 0.0, np.where(n == 0, 1.0, r), radial)
        return self.scale * radial * np.cos(n * angle - self.phase)

    def contains(self, points: np.ndarray) -> np.ndarray:
        return np.hypot(points[:, 0], points[:, 1]) <= (1 + 1e-9) * self.radius

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        x, y = points / self.radius, loads / self.radius
        return np.array([[_disk_green(self.edge, self.nu, place, load) for load in y] for place in x])

    def take(self, n_modes: int) -> "DiskShapes":
        kept = {name: getattr(self, name)[:n_modes] for name in ("z", "order", "weight", "phase", "scale")}
        return replace(self, **kept)

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        rings, spokes = 20, 72
        r = np.repeat(np.arange(1, rings + 1) / rings, spokes) * self.radius
        angle = np.tile(2 * np.pi * np.arange(spokes) / spokes, rings)
        points = np.vstack([np.zeros((1, 2)), np.column_stack([r * np.cos(angle), r * np.sin(angle)])])
        here = np.arange(spokes)
        there = (here + 1) % spokes
        cells = [np.column_stack([np.zeros(spokes, int), 1 + here, 1 + there])]
        for ring in range(rings - 1):
            a, b = 1 + ring * spokes + here, 1 + ring * spokes + there
            cells += [np.column_stack([a, a + spokes, b + spokes]), np.column_stack([a, b + spokes, b])]
        return points, np.vstack(cells)


def _disk_green(edge: str, nu: float, place: np.ndarray, load: np.ndarray) -> float:
    """Deflection of the unit disk (D = 1) at ``place`` under a unit force at ``load``; if free, with inertia relief."""
    r, rho = min(1.0, float(np.hypot(*place))), min(1.0, float(np.hypot(*load)))
    gamma = float(np.arctan2(place[1], place[0]) - np.arctan2(load[1], load[0]))
    s = float(np.sum((place - load) ** 2))
    t = 1.0 + (r * rho) ** 2 - 2.0 * r * rho * np.cos(gamma)
    q = 1.0 - rho**2
    clamped = ((1.0 - r**2) * q + (s * np.log(s / t) if s > 0.0 else 0.0)) / (16.0 * np.pi)  # Boggio 1905
    if edge == "clamped":
        return clamped
    decay = r * rho
    terms = min(DISK_TERMS, int(np.log(1e-17) / np.log(np.clip(decay, 1e-3, 1.0 - EPSILON))) + 6)
    n = np.arange(terms)
    wave = np.where(n == 0, 1.0, 2.0) * rho**n * np.cos(n * gamma)
    if edge == "hinged":
        return clamped + q * (1.0 - r**2) / (4.0 * np.pi) * float(np.sum(wave * r**n / (4.0 * n + 2.0 + 2.0 * nu)))
    # free edge: terms in r**n and r**(n+2) cancel the clamped solution's edge moment and Kirchhoff shear
    moment = 4.0 * q * wave / (16.0 * np.pi)
    shear = moment + 4.0 * (n * q + 1.0 + rho**2) * wave / (16.0 * np.pi)
    cosine = np.cos(gamma)
    uniform, linear = -1.0 / np.pi, -4.0 * rho / np.pi  # inertia load uniform + linear r cos(gamma)
    moment[0] += uniform * (12.0 + 4.0 * nu) / 64.0
    moment[1] += linear * cosine * (20.0 + 4.0 * nu) / 192.0
    shear[0] += uniform / 2.0
    shear[1] += linear * cosine * (3.0 / 8.0 - (1.0 - nu) * 4.0 / 192.0)
    m1, v1 = (1 - nu) * n * (n - 1.0), -(1 - nu) * n**2 * (n - 1.0)
    m2 = (n + 2.0) * (n + 1.0) + nu * (n + 2.0 - n**2)
    v2 = (4.0 * n + 4.0) * n - (1 - nu) * n**2 * (n + 1.0)
    a, b = np.zeros(terms), np.zeros(terms)
    det = m1[2:] * v2[2:] - m2[2:] * v1[2:]
    a[2:] = -(moment[2:] * v2[2:] - m2[2:] * shear[2:]) / det
    b[2:] = -(m1[2:] * shear[2:] - v1[2:] * moment[2:]) / det
    b[:2] = -moment[:2] / m2[:2]
    bent = clamped + uniform * r**4 / 64.0 + linear * cosine * r**5 / 192.0 + float(np.sum((a + b * r**2) * r**n))
    # remove the rigid motion: project `bent` on 1 and on r cos; reciprocity gives the clamped parts
    mean = q**2 / 64.0 + uniform * 2.0 * np.pi / (64.0 * 6.0) + b[0] * 2.0 * np.pi / 4.0
    turn = (rho**5 - 2.0 * rho**3 + rho) / 192.0 + linear * np.pi / (192.0 * 8.0)
    turn += _first_order(nu, rho) * np.pi / 6.0
    return bent - mean / np.pi - 4.0 * turn * r * cosine / np.pi


def _first_order(nu: float, rho: float) -> float:
    """Coefficient of r**3 cos(gamma) in the free disk's correction."""
    moment = 8.0 * (1.0 - rho**2) * rho / (16.0 * np.pi) - 4.0 * rho / np.pi * (20.0 + 4.0 * nu) / 192.0
    return -moment / (6.0 + 2.0 * nu)


def disk(
    radius: float,
    *,
    edge: str = "clamped",
    nu: float | None = None,
    mass: float | None = None,
    first_frequency: float | None = None,
    section: Any = None,
    n_modes: int | None = None,
    max_frequency: float | None = None,
    damping_ratio: Damping = 0.0,
) -> Modes:
    """Modes of a circular Kirchhoff plate centred at the origin, including the rigid motions of a free one.

    Parameters
    ----------
    radius : float [m]
    edge : "clamped", "hinged" or "free"
    nu : float [-]
        Poisson's ratio if no section is given, 0.3 by default; the shapes of a clamped disk do not depend on it.
    mass, first_frequency : float [kg], [Hz] of the lowest flexible mode
        Give both of these, or a section.
    section : Plate, isotropic and of constant thickness
    n_modes : int (rigid motions included), or max_frequency : float [Hz]
    damping_ratio : float, array (n_modes,) or function of frequency [Hz]

    Returns
    -------
    Modes; of two modes with the same nodal diameters the cosine (largest along x) comes first, then the sine

    Raises
    ------
    ValueError
        If a size is not positive, the edge is unknown, or both or neither of two alternatives are given.

    References
    ----------
    Leissa (1969), NASA SP-160, ch. 2; Boggio (1905) for the static deflection of the clamped disk.

    Examples
    --------
    >>> modes = fi.analytic.disk(0.15, edge="clamped", mass=0.2, first_frequency=100.0, n_modes=3)
    >>> modes.frequencies.round(2).tolist()
    [100.0, 208.11, 208.11]
    """
    radius = check.positive("radius", radius, "m")
    check.one_of("edge", edge, KINDS)
    if section is not None and nu is not None:
        raise ValueError("give nu or section, not both: the section's material has its own nu")
    physical = _physical(section, Plate, mass, first_frequency, np.pi * radius**2)
    if physical is not None:  # the shapes belong to the unit disk
        physical = physical[0], physical[1] / radius
    ratio = section.material.nu if section is not None else 0.3 if nu is None else check.between("nu", nu, -0.99, 0.5)
    n_rigid = 3 if edge == "free" else 0
    root_area = np.sqrt(np.pi)
    first = _disk_roots(edge, ratio, 5.0)[0][0] ** 2 * root_area
    count, reach = _enough(n_modes, max_frequency, physical, first_frequency, first, MOST_OF_DISK)
    if np.isfinite(reach):
        limit = np.sqrt(reach / root_area)
        _check_number(0.25 * limit**2, MOST_OF_DISK)  # Weyl
        z, n, weight = _disk_roots(edge, ratio, max(5.0, limit))
        count = n_rigid + _disk_count(z, n, limit)
    else:
        limit = 2.0 * np.sqrt(count) + 5.0  # Weyl's law: about z**2 / 4 modes, plus an edge term
        z, n, weight = _disk_roots(edge, ratio, limit)
        while n_rigid + _disk_count(z, n) < count:
            limit *= 1.2
            z, n, weight = _disk_roots(edge, ratio, limit)
    if count <= n_rigid:
        raise ValueError(f"n_modes must exceed the {n_rigid} rigid motions; max_frequency must reach a flexible mode")
    rigid = np.array([(0.0, 0, 0.0, 0.0), (0.0, 1, 0.0, 0.0), (0.0, 1, 0.0, np.pi / 2)][:n_rigid]).reshape(-1, 4)
    twice = np.repeat(np.arange(len(z)), np.where(n == 0, 1, 2))
    second = np.append(False, twice[1:] == twice[:-1])
    rows = np.column_stack([z[twice], n[twice], weight[twice], np.where(second, np.pi / 2, 0.0)])
    wavenumber, order, weights, phases = np.vstack([rigid, rows])[:count].T.copy()
    scale = np.concatenate(
        [[1.0, 2.0, 2.0][:n_rigid], _disk_norm(*(x[n_rigid:] for x in (wavenumber, order, weights)))]
    )
    shapes = DiskShapes(radius, edge, ratio, wavenumber, order, weights, phases, scale)
    notes = plausible.body((2.0 * radius, 2.0 * radius), section)
    return _finished(
        shapes, (wavenumber**2 * root_area) ** 2, mass, first_frequency, physical, damping_ratio, notes, section
    )


def _disk_norm(z: np.ndarray, n: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Factors (n_modes,) that normalise flexible shapes at unit mass, from Lommel's integrals of their squares."""
    j, dj, i, di = _bessel(n, z)
    i, di = weight * i, weight * di
    ring = (n / z) ** 2
    square = 0.5 * (dj**2 + (1.0 - ring) * j**2 + (1.0 + ring) * i**2 - di**2) + (j * di - i * dj) / z
    return 1.0 / np.sqrt(np.where(n == 0, 2.0, 1.0) * square)  # cos**2 and sin**2 average to one half over the circle
