"""Blows worked out apart from the package: own modes, own contact laws, own integrator, and their own error.

The motion is a sum of modes, each struck by one force F(d, d'): q'' + 2 zeta omega q' + omega**2 q = -s F and
d = sum s q, with signed shapes s. In contact F is a quartic in each step, found by collocation of the law at Lobatto
points, and every mode answers to it in closed form; steps shrink towards onset and release, where F is not smooth. In
flight all modes move exactly and every step is searched for a touch.

Of modes far above the contact, narrow bands of frequencies act as one mode each, with the same static compliance and
the same moment of order omega**-4; so hundreds of thousands take part. What lies beyond is one mode with the compliance
that is left. Each blow is followed twice, with other steps, bands and numbers of modes: the difference is its error.
"""

from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np
from scipy import special
from scipy.optimize import brentq

import fem_impact as fi

NODES = np.array([0.0, 0.5 - np.sqrt(21.0) / 14.0, 0.5, 0.5 + np.sqrt(21.0) / 14.0, 1.0])  # Lobatto on 0 ... 1
TO_POWERS = np.linalg.inv(np.vander(NODES, increasing=True))  # (5, 5) from values at the nodes to coefficients
LEVELS = 15  # [-] sizes of step, each half of the one before: the least is 1e-6 of a contact
COARSE, FINE = 40.0, 80.0  # [-] longest steps in a contact on a rigid wall
WIDE, NARROW = 0.006, 0.003  # [-] relative width of the bands
APART = 12.0, 24.0  # [-] of the contact frequency up to which every mode stands for itself
FLIGHT = 48.0  # [-] steps of free flight per contact
MOST_FLIGHT = 60_000  # [-] of them
TAIL = 1.73  # [-] frequency of the mode for the rest over the last: density of u**2 is even in omega on a plate
RECTANGLE_MODES = 150_000, 300_000
DISK_MODES = 5_000, 10_000
BEAM_MODES = 1_500, 3_000
STICK_MODES = 400, 800
DONE, UNDECIDED, MANY, CUT, STUCK = range(5)  # how a run ends; CUT: the loss would pull although still pressed


@dataclass(frozen=True)
class Law:
    """F = stiffness d**exponent (1 + loss d') while that pushes."""

    stiffness: float
    exponent: float
    loss: float = 0.0

    def duration(self, mass, speed):
        """Time [s] a mass rests against a rigid wall, loss left out: from the energy integral."""
        p1 = self.exponent + 1.0
        depth = (0.5 * p1 * mass * speed**2 / self.stiffness) ** (1.0 / p1)
        return 2.0 * depth / speed * special.beta(1.0 / p1, 0.5) / p1


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


def blow(striker, target, law, speed, *, finer, most):
    """Follow one blow until the bodies part for good; ``striker`` and ``target`` give a Part, coarse or finer."""
    one, two = striker(finer), target(finer)
    felt = 1.0 / one.squared[0]
    duration = law.duration(felt, speed)
    parts = [gathered(part, APART[finer] * np.pi / duration, NARROW if finer else WIDE) for part in (one, two)]
    omega, squared, zeta = (np.concatenate(pair) for pair in zip(*parts))
    order = np.argsort(np.where(np.arange(len(omega)) == 0, -1.0, omega), kind="stable")
    shape = np.sqrt(squared)
    status, found = _follow(
        omega[order], zeta[order], shape[order], law.stiffness, law.exponent, law.loss, speed,
        duration / (FINE if finer else COARSE), duration / FLIGHT, most, NODES, TO_POWERS,
    )  # fmt: skip
    return Outcome(int(status), -found[0] / speed, *found[1:4], int(found[4]))


def reference(striker, target, law, speed, *, most=4):
    """The finer outcome, and its error: the difference to the coarser one."""
    coarse = blow(striker, target, law, speed, finer=0, most=most)
    if coarse.status != DONE:
        return coarse, np.inf
    fine = blow(striker, target, law, speed, finer=1, most=most)
    if fine.status != DONE or fine.n_impacts != coarse.n_impacts:
        return fine, np.inf
    return fine, fine.difference(coarse)


# --- the integrator --------------------------------------------------------------------------------------------------


@numba.njit(cache=True, error_model="numpy")
def _advance(w, z, t):
    """State transition of one mode over a time: q = c q + s p, p = e q + f p."""
    if w == 0.0:
        return 1.0, t, 0.0, 1.0
    root = np.sqrt(1.0 - z * z)
    decay = np.exp(-z * w * t)
    cos, sin = decay * np.cos(w * root * t), decay * np.sin(w * root * t) / root
    return cos + z * sin, sin / w, -w * sin, cos - z * sin


@numba.njit(cache=True, error_model="numpy")
def _answer(w, z, h, x, out_q, out_p):
    """Motion at the fraction x of a step h after rest, to forces (t/h)**m, m = 0 ... 4."""
    big = w * h
    for m in range(5):
        if big < 2.0:  # Taylor series in t/h, to rounding
            previous, current = 0.0, 0.0
            q, p, power = 0.0, 0.0, 1.0
            for j in range(34):
                following = ((1.0 if j == m else 0.0) - 2.0 * z * big * (j + 1.0) * current - big * big * previous) / (
                    (j + 1.0) * (j + 2.0)
                )
                p += following * (j + 2.0) * power * x
                power *= x
                q += following * power * x
                previous, current = current, following
            out_q[m], out_p[m] = h * h * q, h * p
            continue
        a = np.zeros(7)  # the polynomial solution, then the free motion that brings it to rest at the start
        for j in range(m, -1, -1):
            a[j] = (
                (1.0 if j == m else 0.0) - 2.0 * z * big * (j + 1.0) * a[j + 1] - (j + 2.0) * (j + 1.0) * a[j + 2]
            ) / big**2
        q, p = 0.0, 0.0
        for j in range(m, -1, -1):
            p = p * x + q
            q = q * x + a[j]
        c, s, e, f = _advance(w, z, x * h)
        out_q[m] = h * h * (q - c * a[0] - s * a[1] / h)
        out_p[m] = h * (p - h * e * a[0] - f * a[1])


@numba.njit(cache=True, error_model="numpy")
def _tables(omega, zeta, shape, h, nodes):
    """Of one step size: free motion to the nodes, answer at its end, and the approach's answer at the nodes."""
    n = len(omega)
    free = np.empty((n, 16))
    end = np.empty((n, 10))
    d, v = np.zeros((4, 5)), np.zeros((4, 5))
    q, p = np.empty(5), np.empty(5)
    for k in range(n):
        for i in range(4):
            x = nodes[i + 1]
            free[k, 4 * i], free[k, 4 * i + 1], free[k, 4 * i + 2], free[k, 4 * i + 3] = _advance(
                omega[k], zeta[k], x * h
            )
            _answer(omega[k], zeta[k], h, x, q, p)
            d[i] += shape[k] ** 2 * q
            v[i] += shape[k] ** 2 * p
        end[k, :5], end[k, 5:] = q, p
    return free, end, d, v


@numba.njit(cache=True, error_model="numpy")
def _law(k, exponent, loss, d, v):
    """Force, its slopes in approach and rate, and whether the loss would pull."""
    if d <= 0.0:
        return 0.0, 0.0, 0.0, False
    force = k * d**exponent
    factor = 1.0 + loss * v
    if factor <= 0.0:
        return 0.0, 0.0, 0.0, True
    return force * factor, exponent * force / d * factor, force * loss, False


@numba.njit(cache=True, error_model="numpy")
def _at(omega, zeta, shape, q, p, t):
    """Approach and rate after a time of free flight."""
    d, v = 0.0, 0.0
    for k in range(len(omega)):
        c, s, e, f = _advance(omega[k], zeta[k], t)
        d += shape[k] * (c * q[k] + s * p[k])
        v += shape[k] * (e * q[k] + f * p[k])
    return d, v


@numba.njit(cache=True, error_model="numpy")
def _fly(omega, zeta, shape, q, p, t):
    """Move all modes freely by a time, in place."""
    for k in range(len(omega)):
        c, s, e, f = _advance(omega[k], zeta[k], t)
        q[k], p[k] = c * q[k] + s * p[k], e * q[k] + f * p[k]


@numba.njit(cache=True, error_model="numpy")
def _touch(omega, zeta, shape, q, p, low, high):
    """Time of the crossing of d from below to above zero between two times, by bisection and then to rounding."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _at(omega, zeta, shape, q, p, middle)[0] > 0.0:
            high = middle
        else:
            low = middle
    return high


@numba.njit(cache=True, error_model="numpy")
def _next_touch(omega, zeta, shape, q, p, h, most):
    """Fly to the next touch; 1 there, 0 where the bodies part for good, -1 where neither comes in time."""
    n = len(omega)
    move = np.empty((n, 4))
    for k in range(n):
        move[k, 0], move[k, 1], move[k, 2], move[k, 3] = _advance(omega[k], zeta[k], h)
    before, rate = _at(omega, zeta, shape, q, p, 0.0)
    for step in range(most):
        if step % 32 == 0:
            away, speed, swing = 0.0, 0.0, 0.0
            for k in range(n):
                if omega[k] == 0.0:
                    away += shape[k] * q[k]
                    speed += shape[k] * p[k]
                else:  # the envelope of a damped mode is at most 1.06 times this for damping up to 0.05
                    swing += 1.06 * shape[k] * np.sqrt(q[k] ** 2 + (p[k] / omega[k]) ** 2)
            if speed < 0.0 and away + swing < 0.0:
                return 0
        after, later = 0.0, 0.0
        for k in range(n):
            after += shape[k] * (move[k, 0] * q[k] + move[k, 1] * p[k])
            later += shape[k] * (move[k, 2] * q[k] + move[k, 3] * p[k])
        if after > 0.0:
            _fly(omega, zeta, shape, q, p, _touch(omega, zeta, shape, q, p, 0.0, h))
            return 1
        # nearer than the step can bridge, or turning within it: look at eight points in between
        if max(before, after) + 0.5 * h * (abs(rate) + abs(later)) > 0.0 or (rate > 0.0 and later < 0.0):
            for i in range(1, 8):
                if _at(omega, zeta, shape, q, p, i * h / 8.0)[0] > 0.0 and (i > 1 or step > 0):
                    _fly(omega, zeta, shape, q, p, _touch(omega, zeta, shape, q, p, (i - 1) * h / 8.0, i * h / 8.0))
                    return 1
        for k in range(n):
            q[k], p[k] = move[k, 0] * q[k] + move[k, 1] * p[k], move[k, 2] * q[k] + move[k, 3] * p[k]
        before, rate = after, later
    return -1


@numba.njit(cache=True, error_model="numpy")
def _solve(k, exponent, loss, d_free, v_free, d_table, v_table, to_powers, first, force, d, v):
    """Forces at the nodes by Newton, into ``force``; approach and rate there. False where it does not settle."""
    d_nodes, v_nodes = d_table @ to_powers, v_table @ to_powers  # (4, 5) answers to forces at the nodes
    force[0] = first
    for i in range(4):
        force[i + 1] = _law(k, exponent, loss, d_free[i], v_free[i])[0]
    jacobian, miss = np.empty((4, 4)), np.empty(4)
    cut = False
    for _ in range(60):
        largest, size = 0.0, 1e-300
        cut = False
        for i in range(4):
            d[i], v[i] = d_free[i], v_free[i]
            for j in range(5):
                d[i] -= d_nodes[i, j] * force[j]
                v[i] -= v_nodes[i, j] * force[j]
            value, by_d, by_v, pulls = _law(k, exponent, loss, d[i], v[i])
            cut |= pulls
            miss[i] = force[i + 1] - value
            for j in range(4):
                jacobian[i, j] = (1.0 if i == j else 0.0) + by_d * d_nodes[i, j + 1] + by_v * v_nodes[i, j + 1]
            largest, size = max(largest, abs(miss[i])), max(size, abs(force[i + 1]))
        change = np.linalg.solve(jacobian, miss)
        for i in range(4):
            force[i + 1] -= change[i]
        if largest <= 1e-13 * size:
            return True, cut
    return largest <= 1e-9 * size, cut


@numba.njit(cache=True, error_model="numpy")
def _follow(omega, zeta, shape, stiffness, exponent, loss, speed, longest, flight, most, nodes, to_powers):
    """All contacts; status and (striker's speed, impulse, contact time, peak force, number of impacts)."""
    n = len(omega)
    q, p = np.zeros(n), np.zeros(n)
    p[0] = speed / shape[0]
    tables = [_tables(omega, zeta, shape, longest * 0.5**level, nodes) for level in range(LEVELS)]
    result = np.zeros(5)
    force, d, v = np.zeros(5), np.zeros(4), np.zeros(4)
    d_free, v_free = np.empty(4), np.empty(4)
    while True:
        result[4] += 1.0
        if result[4] > most:
            return MANY, result
        elapsed, before, level, steps = 0.0, 0.0, LEVELS - 1, 0
        here, rate = 0.0, _at(omega, zeta, shape, q, p, 0.0)[1]
        while True:
            steps += 1
            if steps > 20_000:
                return STUCK, result
            limit = 0.5 * elapsed
            if rate < 0.0:
                limit = min(limit, -0.5 * here / rate)
            level = 0
            while level < LEVELS - 1 and longest * 0.5**level > limit:
                level += 1
            done = False
            while True:
                h = longest * 0.5**level
                free, end, d_table, v_table = tables[level]
                d_free[:], v_free[:] = 0.0, 0.0
                for k in range(n):
                    x, y, s = q[k], p[k], shape[k]
                    for i in range(4):
                        d_free[i] += s * (free[k, 4 * i] * x + free[k, 4 * i + 1] * y)
                        v_free[i] += s * (free[k, 4 * i + 2] * x + free[k, 4 * i + 3] * y)
                settled, cut = _solve(
                    stiffness, exponent, loss, d_free, v_free, d_table, v_table, to_powers, before, force, d, v
                )
                if settled and not cut and d.min() > 0.0:
                    break
                if level < LEVELS - 1:
                    level += 1
                    continue
                if cut:
                    return CUT, result
                if not settled and d.min() > 0.0:
                    return STUCK, result
                done = True
                break
            if done:  # the release: the last step is 1e-6 of the contact, a straight line does
                low, high, at_low = 0.0, h, here
                for i in range(4):
                    if d[i] <= 0.0:
                        high = nodes[i + 1] * h
                        part = low + (high - low) * at_low / max(at_low - d[i], 1e-300)
                        break
                    low, at_low = nodes[i + 1] * h, d[i]
                kick = 0.5 * before * part
                for k in range(n):
                    p[k] -= shape[k] * kick
                _fly(omega, zeta, shape, q, p, part)
                result[1] += kick
                result[2] += elapsed + part
                break
            power = to_powers @ force
            for k in range(n):
                dq, dp = 0.0, 0.0
                for m in range(5):
                    dq += end[k, m] * power[m]
                    dp += end[k, 5 + m] * power[m]
                x, y = q[k], p[k]
                q[k] = free[k, 12] * x + free[k, 13] * y - shape[k] * dq
                p[k] = free[k, 14] * x + free[k, 15] * y - shape[k] * dp
            for m in range(5):
                result[1] += h * power[m] / (m + 1.0)
            for i in range(65):
                x = i / 64.0
                value = power[0] + x * (power[1] + x * (power[2] + x * (power[3] + x * power[4])))
                result[3] = max(result[3], value)
            elapsed += h
            before, here, rate = force[4], d[3], v[3]
        result[0] = shape[0] * p[0]
        found = _next_touch(omega, zeta, shape, q, p, flight, MOST_FLIGHT)
        if found == 0:
            return DONE, result
        if found < 0:
            return UNDECIDED, result
