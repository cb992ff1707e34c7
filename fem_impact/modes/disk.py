"""Modes of a circular plate: Bessel functions, with the static deflection by Boggio's formula and what edges add."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special
from scipy.optimize import elementwise

from .._base import check
from .._base.rounding import EPSILON
from ..fe import plausible
from ..fe.section import KINDS, Plate
from .modal import Damping, Modes
from .request import check_beyond_rigid, check_number, request
from .shapes import ClosedShapes, gauss

MOST_OF_DISK = 50_000  # [-] largest number of modes of a disk; each needs a root search


def bessel(n: Any, z: Any) -> tuple[Any, ...]:
    """J, J', I exp(-z), I' exp(-z) of order n at z."""
    j, dj = special.jv(n, z), special.jvp(n, z)
    i = special.ive(n, z)
    di = 0.5 * (special.ive(n - 1, z) + special.ive(n + 1, z))
    return j, dj, i, di


def _edge_rows(edge: str, nu: float, n: Any, z: Any) -> tuple[Any, ...]:
    """The two edge conditions on J and on I exp(-z): (first_j, first_i, second_j, second_i)."""
    j, dj, i, di = bessel(n, z)
    moment_j = -(1 - nu) * z * dj + ((1 - nu) * n**2 - z**2) * j
    moment_i = -(1 - nu) * z * di + ((1 - nu) * n**2 + z**2) * i
    if edge == "clamped":
        return j, i, dj, di
    if edge == "hinged":
        return j, i, moment_j / z**2, moment_i / z**2
    shear_j = -(z**3) * dj - (1 - nu) * n**2 * (z * dj - j)
    shear_i = z**3 * di - (1 - nu) * n**2 * (z * di - i)
    return moment_j / z**2, moment_i / z**2, shear_j / z**3, shear_i / z**3


def _roots(edge: str, nu: float, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All roots z = k radius up to ``reach``, ascending, with their order n and weight, (n_roots,) each.

    The shape is J(z r) + weight I(z r) exp(-z).
    """

    def determinant(z, n):
        a, b, c, d = _edge_rows(edge, nu, n, z)
        return a * d - b * c

    found = []
    for n in range(int(reach) + 3):
        low = max(0.3, 0.5 * n)  # there is no root below, and J underflows
        scan = np.linspace(low, reach, 16 + int(max(0.0, reach - low) / 0.5))  # roots are about pi apart, six steps
        values = determinant(scan, n)
        turns = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0)
        found.append(np.column_stack([scan[turns], scan[turns + 1], np.full(len(turns), n)]))
    low, high, order = np.vstack(found).T
    z = elementwise.find_root(determinant, (low, high), args=(order,)).x
    a, b, c, d = _edge_rows(edge, nu, order, z)
    weight = np.where(np.abs(b) > np.abs(d), -a / b, -c / d)
    rank = np.lexsort((order, z))
    return z[rank], order[rank], weight[rank]


@dataclass(frozen=True, eq=False, repr=False)
class DiskShapes(ClosedShapes, check.Brief):
    """Bessel shapes of a disk of unit mass and rigidity centred at the origin, computed on the unit disk."""

    radius: float  # [m]
    edge: str
    nu: float
    z: np.ndarray  # (n_modes,) wavenumber times radius; 0 for rigid motions
    order: np.ndarray  # (n_modes,) nodal diameters
    weight: np.ndarray  # (n_modes,) of I exp(-z) relative to J
    phase: np.ndarray  # (n_modes,) 0 for cos, pi/2 for sin
    scale: np.ndarray  # (n_modes,)

    def at(self, points: np.ndarray) -> np.ndarray:
        r = np.hypot(points[:, 0], points[:, 1])[:, None] / self.radius
        angle = np.arctan2(points[:, 1], points[:, 0])[:, None]
        z, n = self.z, self.order
        growth = np.exp(z * (r - 1.0))
        radial = special.jv(n, z * r) + self.weight * special.ive(n, z * r) * growth
        radial = np.where(z == 0.0, np.where(n == 0, 1.0, r), radial)
        return self.scale * radial * np.cos(n * angle - self.phase)

    def slopes(self, points: np.ndarray) -> np.ndarray:
        """Slopes (n, n_q, 2, n_modes) at points (n, n_q, 2), none of them in the middle."""
        z, n = self.z, self.order
        r = np.hypot(points[..., :1], points[..., 1:]) / self.radius
        along = points / (r * self.radius)
        angle = n * np.arctan2(points[..., 1:], points[..., :1]) - self.phase
        grown = self.weight * np.exp(z * (r - 1.0))
        j, dj, i, di = bessel(n, z * r)
        out, around = z * (dj + di * grown) * np.cos(angle), -n * (j + i * grown) / r * np.sin(angle)
        c, s = along[..., :1], along[..., 1:]
        return self.scale / self.radius * np.stack([c * out - s * around, s * out + c * around], 2)

    def contains(self, points: np.ndarray) -> np.ndarray:
        return np.hypot(points[:, 0], points[:, 1]) <= (1 + 1e-9) * self.radius

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        x, y = points / self.radius, loads / self.radius
        return np.array([[_green(self.edge, self.nu, place, load) for load in y] for place in x])

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

    def quadrature(self, wave: float) -> tuple[np.ndarray, np.ndarray]:
        r, dr = gauss(self.radius, wave)
        spokes = 16 + math.ceil(1.2 * wave * self.radius)
        angle = 2.0 * np.pi * np.arange(spokes) / spokes
        places = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle))], axis=-1)
        return places.reshape(-1, 2), np.repeat(2.0 * np.pi / spokes * r * dr, spokes)


def _green(edge: str, nu: float, place: np.ndarray, load: np.ndarray) -> float:
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
    # at the edge terms only fall as n**-3; so many leave an error of 5e-11
    terms = min(100_000, int(np.log(1e-17) / np.log(np.clip(decay, 1e-3, 1.0 - EPSILON))) + 6)
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
    # coefficient of r**3 cos(gamma) in the correction
    first = 8.0 * (1.0 - rho**2) * rho / (16.0 * np.pi) - 4.0 * rho / np.pi * (20.0 + 4.0 * nu) / 192.0
    turn += -first / (6.0 + 2.0 * nu) * np.pi / 6.0
    return bent - mean / np.pi - 4.0 * turn * r * cosine / np.pi


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
    asked = request(
        section, Plate, np.pi * radius**2, mass=mass, first_frequency=first_frequency, unit=radius,
        n_modes=n_modes, max_frequency=max_frequency, damping_ratio=damping_ratio,
    )  # fmt: skip
    ratio = section.material.nu if section is not None else 0.3 if nu is None else check.between("nu", nu, -0.99, 0.5)
    n_rigid = 3 if edge == "free" else 0
    root_area = np.sqrt(np.pi)
    first = _roots(edge, ratio, 5.0)[0][0] ** 2 * root_area
    count, reach = asked.count(first, MOST_OF_DISK)
    if np.isfinite(reach):
        limit = np.sqrt(reach / root_area)
        check_number(0.25 * limit**2 - limit, MOST_OF_DISK, radius=radius)  # Weyl, and what a clamped edge takes
        z, n, weight = _roots(edge, ratio, max(5.0, limit))
        count = n_rigid + int(np.where(n == 0, 1, 2)[z <= limit].sum())  # two modes for any order but 0
    else:
        limit = 2.0 * np.sqrt(count) + 5.0  # Weyl's law: about z**2 / 4 modes, plus an edge term
        z, n, weight = _roots(edge, ratio, limit)
        while n_rigid + int(np.where(n == 0, 1, 2).sum()) < count:
            limit *= 1.2
            z, n, weight = _roots(edge, ratio, limit)
    check_beyond_rigid(count, n_rigid, "flexible")
    rigid = np.array([(0.0, 0, 0.0, 0.0), (0.0, 1, 0.0, 0.0), (0.0, 1, 0.0, np.pi / 2)][:n_rigid]).reshape(-1, 4)
    twice = np.repeat(np.arange(len(z)), np.where(n == 0, 1, 2))
    second = np.append(False, twice[1:] == twice[:-1])
    rows = np.column_stack([z[twice], n[twice], weight[twice], np.where(second, np.pi / 2, 0.0)])
    wavenumber, order, weights, phases = np.vstack([rigid, rows])[:count].T.copy()
    z, n, weight = (x[n_rigid:] for x in (wavenumber, order, weights))
    j, dj, i, di = bessel(n, z)
    i, di = weight * i, weight * di
    ring = (n / z) ** 2
    # at unit mass, from Lommel's integrals of squares; cos**2 and sin**2 average to one half over the circle
    square = 0.5 * (dj**2 + (1.0 - ring) * j**2 + (1.0 + ring) * i**2 - di**2) + (j * di - i * dj) / z
    scale = np.concatenate([[1.0, 2.0, 2.0][:n_rigid], 1.0 / np.sqrt(np.where(n == 0, 2.0, 1.0) * square)])
    shapes = DiskShapes(radius, edge, ratio, wavenumber, order, weights, phases, scale)
    notes = plausible.doubted_sizes((2.0 * radius, 2.0 * radius), section)
    return asked.answered(shapes, (wavenumber**2 * root_area) ** 2, notes)
