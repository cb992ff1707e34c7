"""Frequencies of rectangular panels, curved, ribbed and layered, by Ritz's method with splines (`references_ritz`)."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from references_ritz import DEFLECTION, Order, Splines, lowest
from references_shells import isotropic
from scipy.linalg import null_space, qr

HELD = {"held": (True, True), "sliding": (False, True), "across": (True, False), "free": (False, False)}


@dataclass(frozen=True)
class Rib:
    """A straight beam along "x" or "y", from edge to edge, its axis ``offset`` above the middle surface.

    It bends and stretches in its upright plane and twists with the plate: the curvature along and the twist under it.
    """

    along: str
    at: float
    stretching: float  # E times area [N]
    bending: float  # E times second moment about its own axis [N m2]
    twisting: float  # G times torsion constant [N m2]
    per_length: float  # [kg/m], which moves with the deflection
    offset: float


def rectangular_rib(along, at, width, height, thickness, E, nu, rho, below=True):
    """A bar of upright rectangular section on one face of a plate of a thickness.

    Torsion constant by Saint-Venant's series (Timoshenko and Goodier, art. 109).
    """
    short, long = sorted((width, height))
    n = np.arange(1, 100, 2)
    ends = 192.0 / np.pi**5 * short / long * np.sum(np.tanh(0.5 * n * np.pi * long / short) / n**5)
    torsion = long * short**3 / 3.0 * (1.0 - ends)
    area, offset = width * height, (-0.5 if below else 0.5) * (thickness + height)
    return Rib(along, at, E * area, E * area * height**2 / 12.0, E / 2.0 / (1.0 + nu) * torsion, rho * area, offset)


@dataclass(frozen=True)
class Panel:
    """A rectangle from (0, 0) to ``sides``; edges at x = 0, x = a, y = 0 and y = b are told as (deflection, plane).

    In the plane an edge is "held", "free", "sliding" (held along itself) or "across" (held across itself alone).
    """

    sides: tuple
    stiffness: tuple  # A, B, D as of `references_shells.stack`
    per_area: float
    edges: tuple = (("free", "free"),) * 4
    slopes: object = None  # (z_x, z_y) of arrays x and y, or None for a plane body
    ribs: tuple = ()
    breaks: tuple = ((), ())  # in x and in y, beside those at ribs
    inertia: bool = False  # in the plane


class PanelFields:
    """Displacements u, v and deflection w of a panel at its Gauss points; unknowns in this order."""

    def __init__(self, panel, order=None):
        self.panel, order = panel, order or Order(1, 14)
        self.splines = []
        for field in range(3):
            pair = []
            for axis in range(2):
                across = {rib.at for rib in panel.ribs if rib.along != "xy"[axis]}
                inner = sorted(across | set(panel.breaks[axis]))
                conditions = []
                for end, place in enumerate((0.0, panel.sides[axis])):
                    deflection, plane = panel.edges[2 * axis + end]
                    if field == 2:
                        conditions += [(place, d) for d in DEFLECTION[deflection]]
                    elif HELD[plane][0 if field == axis else 1]:
                        conditions.append((place, 0))
                pair.append(Splines([0.0, *inner, panel.sides[axis]], order, int(field == 2)).hold(conditions))
            self.splines.append(pair)
        self.x, self.y = self.splines[2][0].points, self.splines[2][1].points
        self.weights = np.kron(self.splines[2][0].weights, self.splines[2][1].weights)
        self.sizes = [first.size * second.size for first, second in self.splines]

    def at(self, field, x, y, dx=0, dy=0):
        """A derivative of one field on the grid of points x and y, (n_x n_y, n) of all unknowns."""
        first, second = self.splines[field]
        here = np.kron(first.at(x, dx), second.at(y, dy))
        start = sum(self.sizes[:field])
        return np.pad(here, ((0, 0), (start, sum(self.sizes) - start - self.sizes[field])))

    def slopes(self, x, y):
        """z_x and z_y on the grid, each (n_x n_y, 1)."""
        if self.panel.slopes is None:
            return np.zeros((2, len(x) * len(y), 1))
        grid = np.meshgrid(x, y, indexing="ij")
        return [np.broadcast_to(s, grid[0].shape).reshape(-1, 1) for s in self.panel.slopes(*grid)]

    def strain(self):
        """Strains xx, yy, 2 xy in the middle surface and their changes -w_xx, -w_yy, -2 w_xy with height."""
        x, y = self.x, self.y
        zx, zy = self.slopes(x, y)
        wx, wy = self.at(2, x, y, 1, 0), self.at(2, x, y, 0, 1)
        plane = [self.at(0, x, y, 1, 0) + zx * wx, self.at(1, x, y, 0, 1) + zy * wy]
        plane.append(self.at(0, x, y, 0, 1) + self.at(1, x, y, 1, 0) + zx * wy + zy * wx)
        return [*plane, -self.at(2, x, y, 2, 0), -self.at(2, x, y, 0, 2), -2.0 * self.at(2, x, y, 1, 1)]

    def rib_rows(self, rib):
        """Rows of strain and of motion of a rib."""
        axis = "xy".index(rib.along)
        x, y = (self.x, np.array([rib.at])) if axis == 0 else (np.array([rib.at]), self.y)
        weight = np.sqrt(self.splines[2][axis].weights)[:, None]
        one, two = ((1, 0), (2, 0)) if axis == 0 else ((0, 1), (0, 2))
        slope, bent = self.slopes(x, y)[axis], self.at(2, x, y, *two)
        axial = self.at(axis, x, y, *one) + slope * self.at(2, x, y, *one) - rib.offset * bent
        twist = self.at(2, x, y, 1, 1)
        pairs = (rib.stretching, axial), (rib.bending, bent), (rib.twisting, twist)
        moving = [self.at(2, x, y)]
        if self.panel.inertia:
            moving += [self.at(i, x, y) - rib.offset * self.at(2, x, y, 1 - i, i) for i in range(2)]
        return [np.sqrt(k) * weight * e for k, e in pairs], [np.sqrt(rib.per_length) * weight * m for m in moving]

    def rigid(self):
        """Rows that are zero unless the panel moves in its plane as a rigid body, where it may."""
        a, b = self.panel.sides
        rows = []  # of u = p - r y, v = q + r x at the ends of held edges
        for (_, plane), (x, y), axis in zip(self.panel.edges, ((0, 0), (a, 0), (0, 0), (0, b)), (0, 0, 1, 1)):
            for place in ((x, y), (x + axis * a, y + (1 - axis) * b)):
                across, along = [[1.0, 0.0, -place[1]], [0.0, 1.0, place[0]]][:: 1 - 2 * axis]
                rows += [row for row, held in zip((across, along), HELD[plane]) if held]
        motions = null_space(np.array(rows)) if rows else np.eye(3)
        x, y = (g.ravel() for g in np.meshgrid(self.x, self.y, indexing="ij"))
        u, v = self.at(0, self.x, self.y), self.at(1, self.x, self.y)
        return [(self.weights * (p - r * y)) @ u + (self.weights * (q + r * x)) @ v for p, q, r in motions.T]

    def rows(self):
        """Rows whose squares add up to twice the energies: of strain, and of motion over frequency squared."""
        A, B, D = self.panel.stiffness
        strain = self.strain()
        law = np.linalg.cholesky(np.block([[A, B], [B, D]])).T
        root = np.sqrt(self.weights)[:, None]
        rows = [root * sum(c * e for c, e in zip(line[i:], strain[i:])) for i, line in enumerate(law)]
        fields = range(3) if self.panel.inertia else (2,)
        motion = [np.sqrt(self.panel.per_area) * root * self.at(i, self.x, self.y) for i in fields]
        for rib in self.panel.ribs:
            more, moving = self.rib_rows(rib)
            rows, motion = rows + more, motion + moving
        if not self.panel.inertia:
            rows += [np.sqrt(A[0, 0]) / max(self.panel.sides) ** 2 * row[None] for row in self.rigid()]
        return np.vstack(rows), np.vstack(motion)


def panel_modes(panel, count=12, order=None, rigid=1e-6):
    """Frequencies (count,) [rad/s] of a panel, rigid ones as 0, and vectors of unit mass in `PanelFields`."""
    strain, motion = PanelFields(panel, order).rows()
    shift = panel.stiffness[2][0, 0] / panel.per_area / max(panel.sides) ** 4
    value, x = lowest(strain, motion, count, shift)
    return np.sqrt(np.where(value > rigid * shift, value, 0.0)), x


def levy_modes(panel, waves, count=6, order=None, curvature=None):
    """Frequencies (count,) [rad/s] of ``waves`` half waves along x between two shear diaphragms, to some 1e-12.

    As `panel_modes`, where the edges at x = 0 and a are ("hinged", "sliding"), ribs go along x, layers are cross-ply,
    and the rise has constant second derivatives ``curvature`` = (z_xx, z_yy); displacements in the plane are Donnell's
    (those of Marguerre and the slope times the deflection), and without inertia.
    """
    order, (zxx, zyy), p = order or Order(2, 12), curvature or (0.0, 0.0), np.pi * waves / panel.sides[0]
    lines = [0.0, *sorted({rib.at for rib in panel.ribs} | set(panel.breaks[1])), panel.sides[1]]
    conditions = [[], [], []]
    for place, (deflection, plane) in zip((lines[0], lines[-1]), panel.edges[2:]):
        across, along = HELD[plane]
        conditions[0] += [(place, 0)] if along else []
        conditions[1] += [(place, 0)] if across else []
        conditions[2] += [(place, d) for d in DEFLECTION[deflection]]
    splines = [Splines(lines, order, int(field == 2)).hold(conditions[field]) for field in range(3)]
    sizes = [spline.size for spline in splines]

    def at(field, y, derivative=0):
        start = sum(sizes[:field])
        here = splines[field].at(y, derivative)
        return np.pad(here, ((0, 0), (start, sum(sizes) - start - sizes[field])))

    y = splines[2].points
    root = np.sqrt(0.5 * panel.sides[0] * splines[2].weights)[:, None]
    w = at(2, y)
    strain = [-p * at(0, y) - zxx * w, at(1, y, 1) - zyy * w, p * p * w, -at(2, y, 2)]
    sheared = [at(0, y, 1) + p * at(1, y), -2.0 * p * at(2, y, 1)]
    A, B, D = panel.stiffness
    rows = []
    for which, parts in (([0, 1], strain), ([2], sheared)):
        law = np.linalg.cholesky(np.block([[M[np.ix_(which, which)] for M in pair] for pair in ((A, B), (B, D))])).T
        rows += [root * sum(c * e for c, e in zip(line, parts)) for line in law]
    motion = [np.sqrt(panel.per_area) * root * w]
    half = np.sqrt(0.5 * panel.sides[0])
    for rib in panel.ribs:
        bent = p * p * at(2, rib.at)
        axial = -p * at(0, rib.at) - zxx * at(2, rib.at) + rib.offset * bent
        pairs = (rib.stretching, axial), (rib.bending, bent), (rib.twisting, p * at(2, rib.at, 1))
        rows += [half * np.sqrt(k) * e for k, e in pairs]
        motion.append(half * np.sqrt(rib.per_length) * at(2, rib.at))
    shift = D[0, 0] / panel.per_area / max(panel.sides) ** 4
    value, _ = lowest(np.vstack(rows), np.vstack(motion), count, shift)
    return np.sqrt(np.maximum(value, 0.0))


def levy_omegas(panel, count=12, order=None, curvature=None, most=8):
    """Tuples (omega, waves, n) of the lowest ``count`` modes of `levy_modes`, in ascending order."""
    each = product(range(1, most + 1), range(count))
    table = [levy_modes(panel, waves, count, order, curvature) for waves in range(1, most + 1)]
    return sorted((float(table[waves - 1][n]), waves, n) for waves, n in each)[:count]


def clamped_blade(**changes):
    """The curved clamped plate of Petyt (1971), J. Sound Vib. 15, 381-395: 3 by 4 inches, radius 30, 0.013 thick."""
    a, b, radius, thickness = 0.0762, 0.1016, 0.762, 3.302e-4

    def slopes(x, y):
        return 0.0 * x, -(y - 0.5 * b) / radius

    stiffness = isotropic(6.8948e10, 0.33, thickness)
    return Panel((a, b), stiffness, 2657.0 * thickness, (("clamped", "held"),) * 4, slopes, **changes)


# Its lowest frequencies [Hz], good to 1e-7, by `panel_modes` with Order(1, 20)
BLADE = (869.852372, 957.875041, 1287.558655, 1363.866307, 1439.763944, 1752.451874, 1777.674787, 2056.144314)


# Large deflections


def panel_stretching(panel, count=3, order=None):
    """Frequencies (count,), cubic (count,) * 3 and quartic (count,) * 4 coefficients of the energy of the first modes.

    Energy: omega**2 q q / 2 + cubic q q q + quartic q q q q, of flexible modes of unit mass, displacements in the plane
    following at once and other modes kept at rest. Strain adds grad w grad w / 2, also along ribs.
    """
    if panel.inertia:
        raise ValueError("displacements in the plane follow at once only without their inertia")
    fields = PanelFields(panel, order)
    strain, _ = fields.rows()
    omega, x = panel_modes(panel, count + 3, order)
    omega, x = omega[omega > 0.0][:count], x[:, omega > 0.0][:, :count]
    moved = _stretched(fields, x)
    moved = np.concatenate([moved, np.zeros((count, count, len(strain) - moved.shape[2]))], axis=2)
    plane = strain[:, : fields.sizes[0] + fields.sizes[1]]
    used = np.any(plane, axis=1)
    cubic = np.einsum("ri,jkr->ijk", strain @ x, moved)
    plane, moved = plane[used], moved[:, :, used]
    basis = qr(plane / np.linalg.norm(plane, axis=0), mode="economic", check_finite=False)[0]
    rest = moved - (moved @ basis) @ basis.T
    return omega, cubic, 0.5 * np.einsum("ijr,klr->ijkl", rest, rest)


def _stretched(fields, x):
    """Rows (count, count, n) of grad w_i grad w_j / 2, as those of `PanelFields.rows`."""
    A, B, D = fields.panel.stiffness
    law = np.linalg.cholesky(np.block([[A, B], [B, D]])).T[:, :3]
    one, two = (fields.at(2, fields.x, fields.y, *d) @ x for d in ((1, 0), (0, 1)))
    root = np.sqrt(fields.weights)
    pairs = [(one, one, 0.5), (two, two, 0.5), (one, two, 0.5), (two, one, 0.5)]
    xx, yy, xy, yx = (c * np.einsum("ri,rj->ijr", f, g) for f, g, c in pairs)
    rows = [root * sum(c * e for c, e in zip(line, (xx, yy, xy + yx))) for line in law]
    for rib in fields.panel.ribs:
        axis = "xy".index(rib.along)
        x_at, y_at = (fields.x, np.array([rib.at])) if axis == 0 else (np.array([rib.at]), fields.y)
        along = fields.at(2, x_at, y_at, 1 - axis, axis) @ x
        weight = np.sqrt(0.25 * rib.stretching * fields.splines[2][axis].weights)
        axial = weight * np.einsum("ri,rj->ijr", along, along)
        rows += [axial, 0.0 * axial, 0.0 * axial]  # bending and twisting follow
    return np.concatenate(rows, axis=2)


def domed_panel(plane):
    """A hinged steel panel of 1 m by 0.8 m by 1 mm that rises by 2 mm over its corners, its edges alike."""
    a, b, thickness, curvature = 1.0, 0.8, 1e-3, 8.0 * 2e-3 / (1.0 + 0.8**2)

    def slopes(x, y):
        return -curvature * (x - 0.5 * a), -curvature * (y - 0.5 * b)

    return Panel((a, b), isotropic(210e9, 0.3, thickness), 7.85, (("hinged", plane),) * 4, slopes)


# Of its first mode omega [rad/s], size of the cubic and quartic coefficient, good to 2e-6, by Order(1, 13)
DOMED = {
    "held": (85.293971, 1945367.8, 361730690.0),
    "sliding": (64.13424845, 677377.593, 94923234.8),
    "across": (84.53578896, 1919174.06, 359885155.0),
    "free": (47.62845727, 211479.53, 33902892.0),
}
