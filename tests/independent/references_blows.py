"""Blows worked out apart from the package: own modes, own contact laws, own integrator, and their own error.

The motion is a sum of modes, each struck by one force F(d, d'): q'' + 2 zeta omega q' + omega**2 q = -s F and
d = sum s q, with signed shapes s; `modal_motion` follows it.

Of modes far above the contact, narrow bands of frequencies act as one mode each, with the same static compliance and
the same moment of order omega**-4; so hundreds of thousands take part. What lies beyond is one mode with the compliance
that is left. Each blow is followed twice, with other steps, bands and numbers of modes: the difference is its error.
"""

from dataclasses import dataclass
from functools import lru_cache

import modal_motion as motion
import numpy as np
from scipy import special
from scipy.optimize import brentq

import fem_impact as fi

STEPS = 4.0, 8.0  # [-] longest steps in a contact on a rigid wall
ACCURACY = 1e-9, 1e-11  # [-] share of the force on a rigid wall by which that of a longest step may depart from the law
WIDE, NARROW = 0.006, 0.003  # [-] relative width of the bands
APART = 12.0, 24.0  # [-] of the contact frequency up to which every mode stands for itself
TAIL = 1.73  # [-] frequency of the mode for the rest over the last: density of u**2 is even in omega on a plate
RECTANGLE_MODES = 150_000, 300_000
DISK_MODES = 5_000, 10_000
BEAM_MODES = 1_500, 3_000
STICK_MODES = 400, 800
DONE = motion.DONE


@dataclass(frozen=True)
class Law:
    """F = (stiffness d**exponent + hard (d - depth)**hard_exponent) (1 + loss d') while that pushes."""

    stiffness: float
    exponent: float
    loss: float = 0.0
    depth: float = 0.0
    hard: float = 0.0
    hard_exponent: float = 1.5

    def duration(self, mass, speed):
        """Time [s] a mass rests against a rigid wall by the soft layer, loss left out: from the energy integral."""
        p1 = self.exponent + 1.0
        depth = (0.5 * p1 * mass * speed**2 / self.stiffness) ** (1.0 / p1)
        return 2.0 * depth / speed * special.beta(1.0 / p1, 0.5) / p1

    def wall(self, mass, speed):
        """Force [N] and time [s] of a mass on a rigid wall, loss left out; of two layers the time is a mean of both."""
        p1, q1, energy = self.exponent + 1.0, self.hard_exponent + 1.0, 0.5 * mass * speed**2
        low, high = 0.0, (p1 * energy / self.stiffness) ** (1.0 / p1)
        for _ in range(200):
            d = 0.5 * (low + high)
            stored = self.stiffness * d**p1 / p1 + self.hard * max(d - self.depth, 0.0) ** q1 / q1
            low, high = (d, high) if stored < energy else (low, d)
        force = self.stiffness * d**self.exponent + self.hard * max(d - self.depth, 0.0) ** self.hard_exponent
        return force, np.pi * mass * speed / force


def loss_for(restitution):
    """Loss times speed that gives a restitution on a rigid wall: the speed integral of m dv/dt = -k d**p (1 + c v)."""
    e = restitution
    return brentq(lambda x: x * (1.0 + e) - np.log((1.0 + x) / (1.0 - e * x)), 1e-4, (1.0 - 1e-13) / e, xtol=1e-15)


@dataclass(frozen=True)
class Part:
    """One body at its contact point: frequencies, squared shapes, damping, and what the modes leave out."""

    omega: np.ndarray  # [rad/s]
    squared: np.ndarray  # [1/kg]
    zeta: float
    rest: float = 0.0  # [m/N]


@dataclass(frozen=True)
class Outcome:
    """What a blow comes to."""

    status: int
    restitution: float = np.nan
    impulse: float = np.nan
    contact_time: float = np.nan
    peak_force: float = np.nan
    n_impacts: int = 0

    def difference(self, other):
        """Absolute in the restitution, relative in impulse, contact time and peak force: what a tolerance is for."""
        names = "impulse", "contact_time", "peak_force"
        relative = (abs(getattr(other, name) / getattr(self, name) - 1.0) for name in names)
        return float(max(abs(other.restitution - self.restitution), *relative))


# --- bodies in closed form -------------------------------------------------------------------------------------------


def rectangle(length, width, at, mass, rate, zeta, finer):
    """Hinged plate, rate = sqrt(D / mass per area): Navier's modes; static compliance from Levy's series."""
    a, b = (length, width) if length >= width else (width, length)
    x, y = at if length >= width else at[::-1]
    number = RECTANGLE_MODES[finer]
    limit = 4.0 * np.pi * number / (a * b)  # of the squared wavenumber, after Weyl
    m, n = (np.arange(1, int(side * np.sqrt(limit) / np.pi) + 1) for side in (a, b))
    kx, ky = np.pi * m / a, np.pi * n / b
    k2 = kx[:, None] ** 2 + ky**2
    u2 = 4.0 / mass * np.outer(np.sin(kx * x) ** 2, np.sin(ky * y) ** 2)
    keep = k2 <= limit
    omega, u2 = rate * k2[keep], u2[keep]
    # over n: sum sin(ky y)**2 / (al**2 + ky**2)**2 = -b / (4 al) d/d(al) of the Green's function of (al**2 - d2/dy2)
    al = np.pi * np.arange(1, 200_001) / a
    c, s, e = np.exp(-2.0 * al * y), np.exp(-2.0 * al * (b - y)), np.exp(-2.0 * al * b)
    top, bottom = (1.0 - c) * (1.0 - s), 2.0 * al * (1.0 - e)
    top_slope = 2.0 * y * c * (1.0 - s) + 2.0 * (b - y) * s * (1.0 - c)
    slope = (top_slope * bottom - top * (2.0 * (1.0 - e) + 4.0 * al * b * e)) / bottom**2
    whole = 4.0 / mass / rate**2 * np.sum(np.sin(al * x) ** 2 * -b / (4.0 * al) * slope)
    return Part(omega, u2, zeta, max(0.0, whole - float(np.sum(u2 / omega**2))))


def beam_wavenumbers(ends, n):
    """Roots of the frequency equation times length, by bisection about their limits."""
    i = np.arange(1, n + 1)
    if ends == ("hinged", "hinged"):
        return np.pi * i
    kinds = sorted(ends)
    if kinds in (["free", "hinged"], ["clamped", "hinged"]):
        return np.array(
            [brentq(lambda k: np.sin(k) - np.cos(k) * np.tanh(k), q - 0.5, q + 0.5) for q in _near(i, 0.25)]
        )
    sign = -1.0 if kinds == ["clamped", "free"] else 1.0
    centre = _near(i, 0.5 * sign)
    return np.array([brentq(lambda k: np.cos(k) - sign / np.cosh(min(k, 700.0)), q - 0.6, q + 0.6) for q in centre])


def _near(i, shift):
    return (i + shift) * np.pi


@lru_cache
def _beam(ends, n):
    return beam_wavenumbers(ends, n)


def beam_shape(ends, k, x):
    """Shapes of unit mean square at x in 0 ... 1: cosh - cos - sigma (sinh - sin) and its kin, without overflow."""
    left, right = ends
    if left == "free" and right != "free":
        return beam_shape((right, left), k, 1.0 - x)
    if left == "hinged" and right == "clamped":
        return beam_shape((right, left), k, 1.0 - x)
    if ends == ("hinged", "hinged"):
        return np.sqrt(2.0) * np.sin(k * x)
    if ends == ("hinged", "free"):  # sin kx / sin k + sinh kx / sinh k
        near = (np.exp(k * (x - 1.0)) - np.exp(-k * (x + 1.0))) / (1.0 - np.exp(-2.0 * k))
        return np.sin(k * x) / np.sin(k) + near
    e = np.exp(-k)
    if right == "hinged":  # clamped-hinged: sigma = coth k
        s = (1.0 + e**2) / (1.0 - e**2)
    elif left == right:  # (cosh k - cos k) / (sinh k - sin k)
        s = (1.0 + e**2 - 2.0 * e * np.cos(k)) / (1.0 - e**2 - 2.0 * e * np.sin(k))
    else:  # clamped-free: (sinh k - sin k) / (cosh k + cos k)
        s = (1.0 - e**2 - 2.0 * e * np.sin(k)) / (1.0 + e**2 + 2.0 * e * np.cos(k))
    # cosh - s sinh = (1 - s) exp(kx) / 2 + (1 + s) exp(-kx) / 2, with 1 - s free of cancellation
    if right == "hinged":
        small = -2.0 * e / (1.0 - e**2) * np.exp(-k * (1.0 - x))
    elif left == right:
        small = (-2.0 * e + 2.0 * (np.cos(k) - np.sin(k))) / (1.0 - e**2 - 2.0 * e * np.sin(k)) * np.exp(-k * (1.0 - x))
    else:
        small = (2.0 * e + 2.0 * (np.cos(k) + np.sin(k))) / (1.0 + e**2 + 2.0 * e * np.cos(k)) * np.exp(-k * (1.0 - x))
    growing = 0.5 * small + 0.5 * (1.0 + s) * np.exp(-k * x)
    swing = np.cos(k * x) - s * np.sin(k * x)
    return growing + swing if left == "free" else growing - swing


def beam(length, ends, at, mass, first_frequency, zeta, finer):
    """Euler-Bernoulli beam from its first bending frequency; the compliance beyond some thousand modes is nothing."""
    k = _beam(ends, BEAM_MODES[finer])
    x = at / length
    rigid = {("free", "free"): 1.0 + 12.0 * (x - 0.5) ** 2, ("hinged", "free"): 3.0 * x**2,
             ("free", "hinged"): 3.0 * (1.0 - x) ** 2}.get(ends)  # fmt: skip
    omega = 2.0 * np.pi * first_frequency * (k / k[0]) ** 2
    squared = beam_shape(ends, k, x) ** 2 / mass
    if rigid is not None:
        omega, squared = np.append(0.0, omega), np.append(rigid / mass, squared)
    return Part(omega, squared, zeta)


def stick(mass, first_frequency, finer):
    """Hinged-free beam at its free end, where every bending mode has the squared shape 4 / mass."""
    k = _beam(("hinged", "free"), STICK_MODES[finer])
    omega = 2.0 * np.pi * first_frequency * (k / k[0]) ** 2
    return Part(np.append(0.0, omega), np.append(3.0, np.full(len(k), 4.0)) / mass, 0.0)


@lru_cache
def _unit_disk(edge, nu, number):
    return fi.analytic.disk(1.0, edge=edge, nu=nu, mass=1.0, first_frequency=1.0, n_modes=number)


def disk(radius, edge, nu, at, mass, rate, zeta, finer):
    """Round plate: shapes of many more modes of the unit disk, their frequencies from its first wavenumber."""
    modes = _unit_disk(edge, nu, DISK_MODES[finer])
    point = np.array([at]) / radius
    shape = modes.shape_at(point)[0]
    factor = rate / radius**2 * first_of_disk(edge, nu) / modes.omega[modes.omega > 0.0][0]
    few = modes.truncated(n_modes=30)
    beyond = float(few.residual_compliance(point)[0, 0]) - float(np.sum((shape[30:] / modes.omega[30:]) ** 2))
    return Part(factor * modes.omega, shape**2 / mass, zeta, max(0.0, beyond / (mass * factor**2)))


def first_of_disk(edge, nu):
    """Squared first wavenumber of the unit disk (Leissa 1969, ch. 2): no nodal diameter, or two where it is free."""

    def determinant(z):
        n = 2 if edge == "free" else 0
        j, dj, i, di = special.jv(n, z), special.jvp(n, z), special.iv(n, z), special.ivp(n, z)
        if edge == "clamped":
            return j * di - i * dj
        c = 1.0 - nu
        moment_j, moment_i = z**2 * j + c * (z * dj - n**2 * j), z**2 * i - c * (z * di - n**2 * i)
        if edge == "hinged":
            return j * moment_i + i * moment_j
        shear_j, shear_i = z**3 * dj + c * n**2 * (z * dj - j), z**3 * di - c * n**2 * (z * di - i)
        return moment_j * shear_i - moment_i * shear_j

    around = {"clamped": (3.0, 3.4), "hinged": (1.8, 2.6), "free": (1.9, 2.7)}[edge]
    return float(brentq(determinant, *around, xtol=1e-14)) ** 2


# --- bodies of finite elements: the package's own, but many more modes of a finer mesh --------------------------------

ELEMENT_MODES = 150, 350  # [-] blows on these bodies are long: ten times the modes that the package takes
OUTLINES = {
    "cantilever plate": (("rectangle", 0.4, 0.25), {"left": "clamped"}),
    "plate on two sides": (("rectangle", 0.4, 0.25), {"left": "hinged", "right": "clamped"}),
    "clamped ring": (("ring", 0.2, 0.08), {"outer": "clamped"}),
    "free ring": (("ring", 0.2, 0.05), {}),
    "free triangle": (("polygon", ((0.0, 0.0), (0.4, 0.0), (0.1, 0.3))), {}),
    "hinged L": (("polygon", ((0.0, 0.0), (0.4, 0.0), (0.4, 0.2), (0.2, 0.2), (0.2, 0.4), (0.0, 0.4))), "hinged"),
    "clamped pentagon": (("polygon", ((0.0, 0.0), (0.3, 0.0), (0.4, 0.2), (0.2, 0.35), (0.0, 0.25))), "clamped"),
}


@lru_cache
def _elements(name, finer):
    (kind, *sizes), supports = OUTLINES[name]
    if kind == "rectangle":
        mesh = fi.mesh.rectangle(*sizes)
    elif kind == "ring":
        mesh = fi.mesh.disk(sizes[0], hole=sizes[1])
    else:
        mesh = fi.mesh.polygon([list(corner) for corner in sizes[0]])
    plate = fi.Plate(fi.Material(E=1.0, nu=0.3, rho=1.0), 1.0)
    supports = {"boundary": supports} if isinstance(supports, str) else supports
    return fi.find_modes(fi.assemble(mesh, plate, supports=supports), n_modes=ELEMENT_MODES[finer])


@lru_cache
def _elements_at(name, at, finer):
    modes = _elements(name, finer)
    return modes.shape_at([at])[0] ** 2, float(modes.residual_compliance([at])[0, 0])


def elements(name, at, mass, first_frequency, zeta, finer):
    """A body of OUTLINES scaled to a mass and first frequency."""
    modes = _elements(name, finer)
    squared, rest = _elements_at(name, tuple(at), finer)
    factor = 2.0 * np.pi * first_frequency / modes.omega[modes.omega > 0.0][0]
    scale = modes.mass / mass
    omega = np.where(modes.omega > 0.0, factor * modes.omega, 0.0)
    return Part(omega, squared * scale, zeta, max(0.0, rest * scale / factor**2))


# --- few modes for many ----------------------------------------------------------------------------------------------


def gathered(part, apart, width):
    """Frequencies, squared shapes and damping with bands above ``apart`` [rad/s] taken as one mode each."""
    rigid = part.omega == 0.0
    omega, squared = part.omega[~rigid], part.squared[~rigid]
    squared = np.where(squared > 1e-25 * squared.max(initial=0.0), squared, 0.0)  # modes that rest there are left out
    band = np.where(omega < apart, -np.arange(1.0, len(omega) + 1.0), np.floor(np.log(omega / apart) / np.log1p(width)))
    _, index = np.unique(band, return_inverse=True)
    a, b = (np.bincount(index, squared / omega**power) for power in (2, 4))
    a, b = a[a > 0.0], b[a > 0.0]
    found, size = np.sqrt(a / b), a**2 / b
    if part.rest > 0.0:
        last = TAIL * omega.max()
        found, size = np.append(found, last), np.append(size, part.rest * last**2)
    if rigid.any():
        found, size = np.append(0.0, found), np.append(part.squared[rigid].sum(), size)
    return found, size, np.full(len(found), part.zeta)


def follow(one, two, law, speed, *, finer, most):
    """Follow a rigid or flexible striker on a target, all modes as they are given as (omega, squared shapes, zeta)."""
    omega, squared, zeta = (np.ascontiguousarray(np.concatenate(pair)) for pair in zip(one, two))
    order = np.argsort(np.where(np.arange(len(omega)) == 0, -1.0, omega), kind="stable")
    force, time = law.wall(1.0 / one[1][0], speed)
    status, found = motion.follow(
        omega[order], zeta[order], np.sqrt(squared[order]),
        (law.stiffness, law.exponent, law.loss, law.depth, law.hard, law.hard_exponent), speed, force,
        time / STEPS[finer], ACCURACY[finer], most, motion.ROWS, motion.TO_POWERS,
    )  # fmt: skip
    return Outcome(int(status), float(-found[0] / speed), *map(float, found[1:4]), int(found[4]))


def blow(striker, target, law, speed, *, finer, most):
    """Follow one blow until the bodies part for good; ``striker`` and ``target`` give a Part, coarse or finer."""
    parts = striker(finer), target(finer)
    apart = APART[finer] * np.pi / law.duration(1.0 / parts[0].squared[0], speed)
    few = [gathered(part, apart, NARROW if finer else WIDE) for part in parts]
    return follow(*few, law, speed, finer=finer, most=most)


def on_modes(modes, mass, law, at, speed, *, finer=1, most=30):
    """A rigid striker on the modes as they are, and nothing beyond them."""
    shape = modes.shape_at([at])[0]
    target = modes.omega, shape**2, np.broadcast_to(modes.damping_ratio, shape.shape)
    return follow((np.zeros(1), np.array([1.0 / mass]), np.zeros(1)), target, law, speed, finer=finer, most=most)


def sure(run):
    """The finer of two runs, and its error: the difference to the coarser one; ``run`` takes whether it is finer."""
    coarse = run(0)
    if coarse.status != DONE:
        return coarse, np.inf
    fine = run(1)
    if fine.status != DONE or fine.n_impacts != coarse.n_impacts:
        return fine, np.inf
    return fine, fine.difference(coarse)


def reference(striker, target, law, speed, *, most=4):
    """The finer outcome of whole bodies, and its error: the difference to the coarser one."""
    return sure(lambda finer: blow(striker, target, law, speed, finer=finer, most=most))
