"""Frequencies of curved, ribbed and layered plates by Ritz's method with splines, sharing no code with fem_impact.

One strain throughout (Marguerre 1938): e = sym grad u + sym(grad z grad w) in the middle surface, less the height times
the second derivatives of w off it; z is the rise, w the deflection, u the displacements in the plane. Splines break
where a rib or a corner of the rise needs it and are smooth elsewhere, so that errors fall exponentially with `Order`.
Mass and area are those of the plan, as in any shallow theory. Units are SI throughout.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import null_space, qr, solve_triangular, svd

DEFLECTION = {"clamped": (0, 1), "hinged": (0,), "free": ()}  # derivatives across an edge that are held


@dataclass(frozen=True)
class Order:
    """How fine the splines are: pieces between two breaks, and degree of the deflection (one more in the plane)."""

    pieces: int = 4
    degree: int = 9


class Splines:
    """Splines on a line, orthonormal under its Gauss points; ``smooth`` = 1 if slopes go through breaks, else 0."""

    def __init__(self, breaks, order, smooth):
        self.degree = order.degree + 1 - smooth
        ends = [np.full(self.degree + 1, breaks[0]), np.full(self.degree + 1, breaks[-1])]
        inner = [np.full(self.degree - smooth, x) for x in breaks[1:-1]]
        between = [np.linspace(a, b, order.pieces + 1)[1:-1] for a, b in pairwise(breaks)]
        self.knots = np.sort(np.concatenate([*ends, *inner, *between]))
        self.turn = np.eye(len(self.knots) - self.degree - 1)
        cells = np.unique(self.knots)
        node, gauss = np.polynomial.legendre.leggauss(order.degree + 3)
        half = 0.5 * np.diff(cells)[:, None]
        self.points = (cells[:-1, None] + half * (node + 1.0)).ravel()
        self.weights = (half * gauss).ravel()
        upper = qr(np.sqrt(self.weights)[:, None] * self.at(self.points), mode="r")[0][: self.size]
        self.turn = solve_triangular(upper, np.eye(self.size))

    @property
    def size(self):
        return self.turn.shape[1]

    def hold(self, conditions):
        """Keep those splines alone whose derivatives (place, which) are zero."""
        if conditions:
            self.turn = self.turn @ null_space(np.vstack([self.at(x, d) for x, d in conditions]))
        return self

    def at(self, points, derivative=0):
        """Values or derivatives (n_points, n)."""
        return BSpline(self.knots, self.turn, self.degree)(np.atleast_1d(points), nu=derivative)


def lowest(strain, motion, count, shift):
    """Lowest eigenvalues (count,) of K x = lambda M x, K = strain^T strain and M = motion^T motion, and their vectors.

    ``shift`` makes K + shift M definite. By a QR decomposition of the rows and singular values: the digits lost go with
    the root of the condition number of K. Vectors have x M x = 1.
    """
    scale = 1.0 / np.sqrt((strain**2).sum(axis=0) + shift * (motion**2).sum(axis=0))
    upper = qr(np.vstack([strain * scale, np.sqrt(shift) * motion * scale]), mode="r", check_finite=False)[0]
    upper = upper[: len(scale)]
    rows = qr(motion * scale, mode="r", check_finite=False)[0] if len(motion) > len(scale) else motion * scale
    each = solve_triangular(upper, rows.T, trans="T", check_finite=False).T
    _, s, right = svd(each, full_matrices=False, check_finite=False)
    x = scale[:, None] * solve_triangular(upper, right[:count].T, check_finite=False)
    return 1.0 / s[:count] ** 2 - shift, x / s[:count]


# Bodies of revolution, by the number of nodal diameters


@dataclass(frozen=True)
class Round:
    """A disk, or a ring around a hole, of one isotropic material; edges are told as (deflection, plane)."""

    E: float
    nu: float
    rho: float
    thickness: float
    radius: float
    slope: object = None  # z'(r), or None for a plane body
    breaks: tuple = ()  # radii at which the slope or its derivatives jump
    edge: tuple = ("free", "free")
    hole: float = 0.0
    hole_edge: tuple = ("free", "free")
    inertia: bool = False  # of displacements in the plane

    @property
    def stretching(self):
        return self.E * self.thickness / (1.0 - self.nu**2)

    @property
    def bending(self):
        return self.stretching * self.thickness**2 / 12.0

    @property
    def per_area(self):
        return self.rho * self.thickness


class RoundFields:
    """Displacements U cos(k angle), V sin(k angle) and deflection W cos(k angle), as far as edges and axis leave them.

    U = s + t and V = t - s, since s and t are regular where r**(k - 1) and r**(k + 1) are.
    """

    def __init__(self, body, k, order=None):
        order = order or Order()
        breaks = [body.hole, *body.breaks, body.radius]
        self.body, self.k = body, k
        self.plane, self.normal = Splines(breaks, order, 0), Splines(breaks, order, 1)
        self.r = self.normal.points
        self.weights = (np.pi if k else 2.0 * np.pi) * self.r * self.normal.weights
        n, m = self.plane.size, self.normal.size
        join = np.eye(2 * n + m)
        if k == 0:  # turning about the axis is apart from the rest: V = 0
            join = np.hstack([join[:, :n] + join[:, n : 2 * n], join[:, 2 * n :]])
        rows = np.array(self._held()).reshape(-1, 2 * n + m) @ join
        size = np.linalg.norm(rows, axis=1, keepdims=True)
        self.kept = join @ (null_space(rows / size) if len(rows) else np.eye(join.shape[1]))

    def _row(self, field, r, derivative=0):
        blocks = [np.zeros(self.plane.size), np.zeros(self.plane.size), np.zeros(self.normal.size)]
        blocks[field] = (self.normal if field == 2 else self.plane).at(r, derivative)[0]
        return np.concatenate(blocks)

    def _held(self):
        body, k = self.body, self.k
        ends = [(body.radius, body.edge)] + ([(body.hole, body.hole_edge)] if body.hole else [])
        rows = []
        for r, (deflection, plane) in ends:
            rows += [self._row(2, r, d) for d in DEFLECTION[deflection]]
            s, t = self._row(0, r), self._row(1, r)
            around = [t - s] if k else []
            rows += {"held": [s + t, *around], "sliding": around, "free": []}[plane]
        if not body.hole:
            rows += [self._row(0, 0.0)] if k != 1 else []
            rows += [self._row(1, 0.0)] if k else []
            rows += [self._row(2, 0.0)] if k else []
            rows += [self._row(2, 0.0, 1)] if k != 1 else []
        if k == 1 and not body.inertia and all(plane == "free" for _, (_, plane) in ends):
            rows.append(self._row(0, body.radius) + self._row(1, body.radius))  # the body may not go off sideways
        return rows

    def motion(self):
        """U, V and W at the Gauss points, each (n_r, n)."""
        a, w = self.plane.at(self.r), self.normal.at(self.r)
        zero, none = np.zeros_like(a), np.zeros_like(w)
        return [x @ self.kept for x in (np.hstack([a, a, none]), np.hstack([-a, a, none]), np.hstack([zero, zero, w]))]

    def strain(self):
        """Strains e_r, e_t and g_rt in the plane, and second derivatives w_rr, w_tt and w_rt, each (n_r, n)."""
        r, k = self.r[:, None], self.k
        slope = np.zeros_like(r) if self.body.slope is None else np.asarray(self.body.slope(self.r))[:, None]
        a, da = self.plane.at(self.r), self.plane.at(self.r, 1)
        w, dw, ddw = (self.normal.at(self.r, d) for d in range(3))
        zero = np.zeros_like(a)
        fields = [
            (da, da, slope * dw),
            ((1.0 - k) * a / r, (1.0 + k) * a / r, np.zeros_like(w)),
            (-da + (1.0 - k) * a / r, da - (1.0 + k) * a / r, -slope * k * w / r),
            (zero, zero, ddw),
            (zero, zero, dw / r - k**2 * w / r**2),
            (zero, zero, k * (w / r - dw) / r),
        ]
        return [np.hstack(field) @ self.kept for field in fields]

    def rows(self):
        """Rows whose squares add up to twice the energies: of strain, and of motion over frequency squared."""
        body, q = self.body, self.weights[:, None]
        er, et, g, wrr, wtt, wrt = self.strain()
        more, less = 0.5 * (1.0 + body.nu), 0.5 * (1.0 - body.nu)
        plane, bent = np.sqrt(body.stretching * q), np.sqrt(body.bending * q)
        strain = [np.sqrt(more) * plane * (er + et), np.sqrt(less) * plane * (er - et), np.sqrt(less) * plane * g]
        strain += [np.sqrt(more) * bent * (wrr + wtt), np.sqrt(less) * bent * (wrr - wtt)]
        strain += [2.0 * np.sqrt(less) * bent * wrt]
        motion = self.motion()[0 if body.inertia else 2 :]
        return np.vstack(strain), np.sqrt(body.per_area) * np.vstack([np.sqrt(q) * x for x in motion])


def round_modes(body, k, count=6, order=None):
    """Frequencies (count,) [rad/s] with k nodal diameters, rigid ones as 0; vectors of unit mass for `RoundFields`.

    Of a free body without inertia in its plane, one motion is rigid for k = 0 and one, a tilt, for k = 1.
    """
    strain, motion = RoundFields(body, k, order).rows()
    shift = body.bending / body.per_area / body.radius**4
    value, x = lowest(strain, motion, count, shift)
    return np.sqrt(np.where(value > 1e-6 * shift, value, 0.0)), x


def round_omegas(body, count=6, most=6, order=None):
    """Tuples (omega, k, n) of flexible modes with n circles, in ascending order: ``count`` of each k up to ``most``."""
    rows = []
    for k in range(most + 1):
        omega = round_modes(body, k, count, order)[0]
        rows += [(float(value), k, n) for n, value in enumerate(omega[omega > 0.0])]
    return sorted(rows)


# Large deflections


def round_stretching(body, k, n, order=None):
    """Cubic and quartic coefficients (a, b) of the energy omega**2 q**2 / 2 + a q**3 + b q**4 in one mode (k, n).

    Of unit mass, without inertia in the plane, whose displacements follow at once; for k > 0 a is zero. Deflections of
    other modes, which a curved body's q**2 sets off, are not let go. Strain adds grad w grad w / 2.
    """
    fields = RoundFields(body, k, order)
    omega, x = round_modes(body, k, n + 2, order)
    vector = x[:, omega > 0.0][:, n]
    w, slope = (fields.normal.at(fields.r, d) @ fields.kept[2 * fields.plane.size :] @ vector for d in range(2))
    turn = -k * w / fields.r  # w_r goes with cos(k angle), w_t / r with sin(k angle)
    if k == 0:
        moved = _plane_rows(body, fields.weights, 0.5 * slope**2, 0.0 * slope, 0.0 * slope)
        stretched = _plane_rows(body, fields.weights, *(e @ vector for e in fields.strain()[:3]))
        return float(stretched @ moved), _least(fields, moved)
    rest = 0.0
    for waves, sign in ((0, 1.0), (2 * k, -1.0)):
        strain = 0.25 * slope**2, sign * 0.25 * turn**2, 0.5 * (waves > 0) * slope * turn
        fields = RoundFields(body, waves, order)
        rest += _least(fields, _plane_rows(body, fields.weights, *strain))
    return 0.0, rest


def _plane_rows(body, weights, er, et, g):
    """Rows whose squares add up to twice the energy of strains (n_r, ...) in the plane."""
    root = np.sqrt(body.stretching * weights).reshape(-1, *[1] * (np.ndim(er) - 1))
    more, less = np.sqrt(0.5 * (1.0 + body.nu)), np.sqrt(0.5 * (1.0 - body.nu))
    return np.concatenate([more * root * (er + et), less * root * (er - et), less * root * g])


def _least(fields, moved):
    """Energy of a stretching (n_rows,) after the plane has given way as far as its edges let it."""
    still = null_space(fields.kept[2 * fields.plane.size :])  # no deflection
    rows = _plane_rows(fields.body, fields.weights, *fields.strain()[:3]) @ still
    basis = qr(rows, mode="economic")[0]
    return 0.5 * float(np.sum((moved - basis @ (basis.T @ moved)) ** 2))
