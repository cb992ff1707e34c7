"""Frequencies and static compliances of beams and plates from textbook formulas, sharing no code with fem_impact."""

import mpmath
import numpy as np
from scipy import special
from scipy.optimize import brentq

MATERIALS = ((210e9, 0.3, 7850.0), (11e9, 0.1, 450.0), (2.3e9, 0.45, 1100.0))  # steel, spruce taken isotropic, plastic
ENDS = ("clamped", "hinged", "free")


def rigidity(E, nu, thickness):
    """Bending stiffness of a plate [N m]."""
    return E * thickness**3 / (12.0 * (1.0 - nu**2))


# Frequencies


def rectangle_omegas(length, width, D, per_area, count):
    """The first circular frequencies (count,) of a hinged rectangle [rad/s] and their half waves (count, 2)."""
    most = 2 + int(np.ceil(count * max(length, width) / min(length, width)))
    m, n = (x.ravel() for x in np.meshgrid(np.arange(1, most), np.arange(1, most)))
    omega = np.pi**2 * ((m / length) ** 2 + (n / width) ** 2) * np.sqrt(D / per_area)
    order = np.argsort(omega, kind="stable")[:count]
    return omega[order], np.column_stack([m, n])[order]


def beam_roots(ends, count):
    """Roots k length (count,) of the frequency equation (Blevins, Formulas for natural frequency, table 8-1)."""
    pair = frozenset(ends)
    i = np.arange(1, count + 1)
    if pair == {"hinged"}:
        return np.pi * i
    if len(pair) == 1:  # cos z cosh z = 1
        cells, f = [(np.pi * k, np.pi * (k + 1)) for k in i], lambda z: np.cos(z) - 1.0 / np.cosh(z)
    elif "hinged" in pair:  # tan z = tanh z
        cells, f = [(np.pi * k, np.pi * (k + 0.5)) for k in i], lambda z: np.sin(z) - np.cos(z) * np.tanh(z)
    else:  # cos z cosh z = -1
        cells, f = [(np.pi * (k - 1), np.pi * k) for k in i], lambda z: np.cos(z) + 1.0 / np.cosh(z)
    return np.array([brentq(f, *cell, xtol=1e-15, rtol=1e-15) for cell in cells])


def beam_squares(ends, roots, places):
    """Squared shapes (n_places, n_roots) of unit mean square at x / length, from the same table's hyperbolic forms.

    They cancel, so fifty digits more than the largest of their terms are carried.
    """
    first, last = ends
    turned = (first, last) in {("hinged", "clamped"), ("hinged", "free"), ("free", "clamped")}
    if turned:
        first, last = last, first
    with mpmath.workdps(50 + int(np.max(roots))):
        result = np.empty((len(places), len(roots)))
        for j, start in enumerate(roots):
            z = _exact_beam_root(first, last, float(start))
            ch, sh, co, si = mpmath.cosh(z), mpmath.sinh(z), mpmath.cos(z), mpmath.sin(z)
            sign = 1 if first == "free" else -1
            if (first, last) in {("clamped", "clamped"), ("free", "free")}:
                sigma = (ch - co) / (sh - si)
            elif (first, last) == ("clamped", "free"):
                sigma = (sh - si) / (ch + co)
            else:
                sigma = co / si
            for i, place in enumerate(places):
                y = z * (1 - mpmath.mpf(float(place)) if turned else mpmath.mpf(float(place)))
                if (first, last) == ("hinged", "hinged"):
                    value = mpmath.sqrt(2) * mpmath.sin(y)
                else:
                    value = mpmath.cosh(y) + sign * mpmath.cos(y) - sigma * (mpmath.sinh(y) + sign * mpmath.sin(y))
                result[i, j] = float(value**2)
    return result


def _exact_beam_root(first, last, start):
    if first == last == "hinged":
        return mpmath.pi * round(start / np.pi)
    if first == last:
        return mpmath.findroot(lambda z: mpmath.cos(z) - mpmath.sech(z), start)
    if "hinged" in (first, last):
        return mpmath.findroot(lambda z: mpmath.sin(z) - mpmath.cos(z) * mpmath.tanh(z), start)
    return mpmath.findroot(lambda z: mpmath.cos(z) + mpmath.sech(z), start)


def disk_roots(edge, nu, reach):
    """Roots z = k radius up to a reach in ascending order and their nodal diameters (Leissa, NASA SP-160, ch. 2)."""

    def equation(z, n):
        J, J1 = special.jv(n, z), special.jv(n + 1, z)
        I, I1 = special.ive(n, z), special.ive(n + 1, z)
        if edge == "clamped":
            return J * I1 + I * J1
        if edge == "hinged":
            return (J1 * I + I1 * J) * (1.0 - nu) - 2.0 * z * J * I
        dJ, dI = n / z * J - J1, n / z * I + I1
        left = (z**2 * J + (1 - nu) * (z * dJ - n**2 * J)) * (z**3 * dI - (1 - nu) * n**2 * (z * dI - I))
        right = (z**2 * I - (1 - nu) * (z * dI - n**2 * I)) * (z**3 * dJ + (1 - nu) * n**2 * (z * dJ - J))
        return (left - right) / z**5

    return _all_roots(equation, reach, range(int(reach) + 2))


def _all_roots(equation, reach, orders):
    roots = []
    for n in orders:
        scan = np.arange(max(0.8, 0.6 * n), reach, 0.05)
        if len(scan) < 2:
            continue
        values = np.array(equation(scan, n))
        for i in np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0):
            roots.append((brentq(equation, scan[i], scan[i + 1], args=(n,), xtol=1e-15, rtol=1e-15), n))
    return sorted(roots)


def disk_radial_squares(edge, nu, z, n, r):
    """Squared radial shape at r (of unit radius), of unit mean square over the disk with both of a pair added."""

    def shape(x):
        moment_J = _bending(special.jv, special.jvp, -1.0, nu, n, z)
        moment_I = _bending(special.iv, special.ivp, 1.0, nu, n, z)
        weight = moment_J / moment_I if edge == "free" else special.jv(n, z) / special.iv(n, z)
        return special.jv(n, z * x) - weight * special.iv(n, z * x)

    node, gauss = np.polynomial.legendre.leggauss(200)
    x = 0.5 * (node + 1.0)
    mean = np.sum(gauss * x * shape(x) ** 2)  # 2 pi times half the Gauss sum over pi
    return shape(np.asarray(r)) ** 2 / mean * (1.0 if n == 0 else 2.0)  # cos**2 + sin**2 over the mean 1/2 of each


def _bending(f, df, sign, nu, n, z):
    """w'' + nu (w' - n**2 w) at r = 1 of a Bessel function of z r with Laplacian sign z**2 times itself."""
    return sign * z**2 * f(n, z) - (1.0 - nu) * (z * df(n, z) - n**2 * f(n, z))


def ring_roots(inner, outer, hole, nu, reach):
    """As `disk_roots` for an annulus of outer radius 1, from the determinant of four conditions on J, Y, I and K."""

    def rows(edge, n, z, r):
        found = []
        growth = np.exp(z * (r - 1.0)), np.exp(-z * (r - hole))
        for f, df, sign, scale in (
            (special.jv, special.jvp, -1.0, 1.0),
            (special.yv, special.yvp, -1.0, 1.0),
            (special.ive, lambda n, x: 0.5 * (special.ive(n - 1, x) + special.ive(n + 1, x)), 1.0, growth[0]),
            (special.kve, lambda n, x: -0.5 * (special.kve(n - 1, x) + special.kve(n + 1, x)), 1.0, growth[1]),
        ):
            w, dw = scale * f(n, z * r), scale * z * df(n, z * r)
            moment = sign * z**2 * w - (1.0 - nu) * (dw / r - n**2 * w / r**2)
            shear = sign * z**2 * dw - (1.0 - nu) * n**2 * (dw - w / r) / r**2
            pairs = {"clamped": (w, dw / z), "hinged": (w, moment / z**2), "free": (moment / z**2, shear / z**3)}
            found.append(pairs[edge])
        return [[found[j][i] for j in range(4)] for i in range(2)]

    def equation(z, n):
        matrix = np.array(rows(inner, n, z, hole) + rows(outer, n, z, 1.0))
        matrix = matrix / np.abs(matrix).max(axis=0)
        return np.linalg.det(np.moveaxis(matrix, (0, 1), (-2, -1)))

    return _all_roots(equation, reach, range(int(reach) + 2))


# Static compliances


def beam_compliance(ends, x):
    """Compliance of the beam of unit length and EI at x; closed products, which do not cancel, where it cannot move.

    Roark's formulas for stress and strain, table 8.1, case 1; `beam_deflection` for the others.
    """
    y = 1.0 - x
    products = {
        ("clamped", "clamped"): x**3 * y**3 / 3.0,
        ("clamped", "free"): x**3 / 3.0,
        ("free", "clamped"): y**3 / 3.0,
        ("hinged", "hinged"): x**2 * y**2 / 3.0,
        ("clamped", "hinged"): x**3 * y**2 * (3.0 + y) / 12.0,
        ("hinged", "clamped"): y**3 * x**2 * (3.0 + x) / 12.0,
    }
    return products[ends] if ends in products else beam_deflection(ends, x, x)


def beam_deflection(ends, load, place):
    """Deflection at ``place`` of the beam of unit length and EI under a unit force at ``load``, without rigid motion.

    A beam that can move balances the force by its inertia (of unit mass). Macaulay's bracket and a polynomial.
    """
    free = [end == "free" for end in ends]
    if ends == ("free", "free"):
        q0, q1 = 4.0 - 6.0 * load, 12.0 * load - 6.0  # its force and moment about any point vanish with the unit force
    elif ends == ("hinged", "free"):
        q0, q1 = 0.0, 3.0 * load
    elif ends == ("free", "hinged"):
        q0, q1 = 3.0 * (1.0 - load), -3.0 * (1.0 - load)
    else:
        q0 = q1 = 0.0

    def particular(x, order):
        """Derivatives of (x - load)_+**3 / 6 - q0 x**4 / 24 - q1 x**5 / 120."""
        right = np.maximum(x - load, 0.0)
        bracket = (right**3 / 6.0, right**2 / 2.0, right, np.heaviside(x - load, 1.0 if x == 1.0 else 0.0))[order]
        fact = special.factorial
        return bracket - q0 * x ** (4 - order) / fact(4 - order) - q1 * x ** (5 - order) / fact(5 - order)

    orders = {"clamped": (0, 1), "hinged": (0, 2), "free": (2, 3)}
    rows, right = [], []
    for x, end in zip((0.0, 1.0), ends):
        for order in orders[end]:
            rows.append([special.poch(k - order + 1, order) * x ** max(k - order, 0) * (k >= order) for k in range(4)])
            right.append(-particular(x, order))
    weights = np.linalg.lstsq(np.array(rows, float), np.array(right), rcond=None)[0]

    def bare(x):
        x = np.asarray(x, float)
        bracket = np.maximum(x - load, 0.0) ** 3 / 6.0 - q0 * x**4 / 24.0 - q1 * x**5 / 120.0
        return bracket + np.polynomial.polynomial.polyval(x, weights)

    rigid = {(True, True): [lambda x: 1.0 + 0 * x, lambda x: np.sqrt(12.0) * (x - 0.5)]}.get(tuple(free), [])
    if ends == ("hinged", "free"):
        rigid = [lambda x: np.sqrt(3.0) * x]
    elif ends == ("free", "hinged"):
        rigid = [lambda x: np.sqrt(3.0) * (1.0 - x)]
    result = bare(place)
    node, gauss = np.polynomial.legendre.leggauss(8)
    for motion in rigid:
        share = 0.0
        for low, high in ((0.0, load), (load, 1.0)):
            x = low + 0.5 * (high - low) * (node + 1.0)
            share += 0.5 * (high - low) * np.sum(gauss * bare(x) * motion(x))
        result = result - share * motion(place)
    return float(result)


def _conditions(kind, nu, jet):
    """What an edge along x holds at zero: of derivatives over beta**k of a strip's deflection."""
    w, dw, d2w, d3w = jet
    return {"clamped": (w, dw), "hinged": (w, d2w), "free": (d2w - nu * w, d3w - (2.0 - nu) * dw)}[kind]


def levy(edges, length, width, nu, load, place):
    """Deflection of a plate (D = 1) hinged at x = 0 and length, its edges y = 0 and width as told, at ``place``.

    Levy's single series (Timoshenko and Woinowsky-Krieger, Theory of plates and shells, ch. 6). The endless strip's
    part is summed to the end for two points at the same y, by polylogarithms; the rest decays off the edges.
    """
    (x0, y0), (x1, y1) = load, place
    gap = [min(y0, width - y0), min(y1, width - y1)]
    decay = max((y0 + y1) if y0 + y1 > 0 else width, 1e-9), max((2 * width - y0 - y1) or width, 1e-9)
    on_edge = min(gap) == 0.0
    apart = abs(y0 - y1) if y0 != y1 else width
    n_terms = int(min(400_000, 40 + 13.0 * length / min(*decay, 2.0 * width, apart)))
    m = np.arange(1, n_terms + 1)
    beta = m * np.pi / length

    def strip(y):
        s = y - y0
        z, sign = beta * abs(s), -1.0 if s < 0.0 or y == 0.0 else 1.0  # a force on an edge stands just inside it
        e = 0.25 * np.exp(-z)
        return (1.0 + z) * e, -sign * z * e, (z - 1.0) * e, sign * (2.0 - z) * e

    def edge_functions(y):
        """Jets at y of exp(-beta y), beta y exp(-beta y) and of the same from the other edge."""
        columns = []
        for distance, sign in ((y, 1.0), (width - y, -1.0)):
            z = beta * distance
            e = np.exp(-z)
            columns.append([(-sign) ** k * e for k in range(4)])
            columns.append([(-sign) ** k * (z - k) * e for k in range(4)])
        return columns

    matrix, right = np.empty((n_terms, 4, 4)), np.empty((n_terms, 4))
    for i, (kind, y) in enumerate(zip(edges, (0.0, width))):
        for j, column in enumerate(edge_functions(y)):
            matrix[:, 2 * i, j], matrix[:, 2 * i + 1, j] = _conditions(kind, nu, column)
        right[:, 2 * i], right[:, 2 * i + 1] = _conditions(kind, nu, strip(y))
    weights = np.linalg.solve(matrix, -right[..., None])[..., 0]
    rest = sum(weights[:, j] * column[0] for j, column in enumerate(edge_functions(y1)))
    limit = rest[-1] if on_edge else 0.0  # on an edge the rest tends to a number
    waves = np.sin(beta * x0) * np.sin(beta * x1)
    total = np.sum(waves * (rest - limit) / m**3)
    if y0 == y1:
        total += (0.25 + limit) * 0.5 * (_cosines(np.pi * (x0 - x1) / length) - _cosines(np.pi * (x0 + x1) / length))
    else:
        total += np.sum(waves * strip(y1)[0] / m**3)
    return 2.0 * length**2 / np.pi**3 * total


def _cosines(angle):
    """Sum of cos(m angle) / m**3 over all m."""
    return float(mpmath.re(mpmath.polylog(3, mpmath.expj(angle)))) if angle else float(mpmath.zeta(3))


def hinged_triangle(leg, point):
    """Compliance (D = 1) of a hinged triangle with corners (0, 0), (leg, 0), (0, leg).

    Half of a hinged square, whose deflection is odd about the diagonal when a force pulls at the mirrored point.
    """
    x, y = point
    mirror = leg - y, leg - x
    pair = ("hinged", "hinged")
    return levy(pair, leg, leg, 0.3, point, point) - levy(pair, leg, leg, 0.3, mirror, point)


def _power(n, p, nu, r=1.0, log=0):
    """Value, slope, bending moment and edge shear of r**p (log r)**log times cos(n angle) on a circle."""
    jet = [np.asarray(r, float) ** p]
    for k in range(3):
        jet.append(jet[-1] * (p - k) / r)
    if log:
        L = np.log(r)
        q = p  # (r**p L)' = p r**(p-1) L + r**(p-1), and so on
        jet = [
            r**q * L,
            r ** (q - 1.0) * (q * L + 1.0),
            r ** (q - 2.0) * (q * (q - 1) * L + 2 * q - 1),
            r ** (q - 3.0) * (q * (q - 1) * (q - 2) * L + 3 * q**2 - 6 * q + 2),
        ]
    w, d1, d2, d3 = jet
    moment = d2 + nu * (d1 / r - n**2 * w / r**2)
    shear = d3 + d2 / r - d1 / r**2 - n**2 * (d1 / r**2 - 2.0 * w / r**3) - (1.0 - nu) * n**2 * (d1 - w / r) / r**2
    return w, d1, moment, shear


HELD = {"clamped": (0, 1), "hinged": (0, 2), "free": (2, 3)}


def ring_compliance(inner, outer, hole, nu, rho):
    """Static compliance at radius rho of an annulus of outer radius 1 and D = 1, or of a disk (inner None).

    Fourier series about the axis (Timoshenko and Woinowsky-Krieger, art. 63 and 64): s**2 log s / (8 pi) of the endless
    plate, nothing under the force itself, and per order four functions that meet the edges.
    """
    distance = min(1.0 - rho, (rho - hole) / hole if inner else 1.0)
    n_terms = int(min(200_000, 60 + 20.0 / max(distance, 1e-9)))
    edges = [(outer, 1.0)] + ([(inner, hole)] if inner else [])
    total = _low_order(edges, nu, rho, 0) + _low_order(edges, nu, rho, 1)
    n = np.arange(2, n_terms).astype(float)
    size = 2 * len(edges)
    # Powers over their largest value on the ring; the endless plate's terms by r**n over r**n at the force.
    functions = [(n, 1.0), (n + 2.0, 1.0)] + ([(-n, hole), (2.0 - n, hole)] if inner else [])
    matrix, right = np.empty((len(n), size, size)), np.empty((len(n), size))
    for i, (kind, r) in enumerate(edges):
        for j, (p, base) in enumerate(functions):
            values = _unit_power(n, p, nu, r)
            scale = (r / base) ** p
            for k, which in enumerate(HELD[kind]):
                matrix[:, 2 * i + k, j] = values[which] * scale
        if r == 1.0:  # t**n (r**2 / n / (n-1) - rho**2 / n / (n+1)), t = rho / r
            first, second = _unit_power(n, 2.0 - n, nu, r), _unit_power(n, -n, nu, r)
            share = (rho / r) ** n
            parts = [r**2 * f / (n * (n - 1)) - rho**2 * s / (n * (n + 1)) for f, s in zip(first, second)]
        else:
            first, second = _unit_power(n, n, nu, r), _unit_power(n, n + 2.0, nu, r)
            share = (r / rho) ** n
            parts = [rho**2 * f / (n * (n - 1)) - r**2 * s / (n * (n + 1)) for f, s in zip(first, second)]
        for k, which in enumerate(HELD[kind]):
            right[:, 2 * i + k] = -share * parts[which]
    norm = np.abs(matrix).max(axis=2)
    weights = np.linalg.solve(matrix / norm[..., None], (right / norm)[..., None])[..., 0]
    each = sum(weights[:, j] * (rho / base) ** p for j, (p, base) in enumerate(functions))
    tail = each[-1] * n[-1] ** 3 / (2.0 * (n[-1] + 0.5) ** 2) if distance == 0.0 else 0.0  # falls as n**-3 on an edge
    return (total + each.sum() + tail) / (8.0 * np.pi)


def _unit_power(n, p, nu, r):
    """As `_power`, over r**p."""
    w = np.ones_like(n)
    moment = (p * (p - 1.0) + nu * (p - n**2)) / r**2
    shear = ((p**2 - n**2) * (p - 2.0) - (1.0 - nu) * n**2 * (p - 1.0)) / r**3
    return w, p / r, moment, shear


def _low_order(edges, nu, rho, n):
    """The same of order 0 or 1, where logarithms appear and a free disk balances the force by inertia."""
    if n == 0:
        homogeneous = [(0.0, 0), (2.0, 0), (0.0, 1), (2.0, 1)][: 2 * len(edges)]
        beyond = [(2.0, 1, 1.0), (0.0, 1, rho**2), (0.0, 0, rho**2)]
        within = [(2.0, 0, np.log(rho) + 1.0), (0.0, 0, rho**2 * np.log(rho))]
    else:
        homogeneous = [(1.0, 0), (3.0, 0), (-1.0, 0), (1.0, 1)][: 2 * len(edges)]
        beyond = [(1.0, 1, -2.0 * rho), (1.0, 0, -rho), (-1.0, 0, -(rho**3)), (-1.0, 0, 0.5 * rho**3)]
        within = [(1.0, 0, -2.0 * rho * np.log(rho) - rho), (3.0, 0, -1.0 / rho), (3.0, 0, 0.5 / rho)]
    loads, free = [], len(edges) == 1 and edges[0][0] == "free"
    if free:  # 8 pi times the deflection of inertia forces -1 / pi and -4 rho r / pi, as for the point force
        loads = [(4.0, 0, -8.0 / 64.0)] if n == 0 else [(5.0, 0, -32.0 * rho / 192.0)]
    rows, right = [], []
    for kind, r in edges:
        for which in HELD[kind]:
            rows.append([_power(n, p, nu, r, log)[which] for p, log in homogeneous])
            terms = (beyond if r == 1.0 else within) + loads
            right.append(-sum(weight * _power(n, p, nu, r, log)[which] for p, log, weight in terms))
    weights = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
    smooth = loads + [(p, log, weight) for (p, log), weight in zip(homogeneous, weights)]

    def value(terms, r):
        return sum(weight * _power(n, p, nu, r, log)[0] for p, log, weight in terms)

    result = value(smooth, rho)
    if free:  # without the rigid motion 1 or r cos(angle)
        node, gauss = np.polynomial.legendre.leggauss(60)
        share = 0.0
        for low, high, terms in ((0.0, rho, within), (rho, 1.0, beyond)):
            r = low + 0.5 * (high - low) * (node + 1.0)
            share += 0.5 * (high - low) * np.sum(gauss * r * r**n * value(terms + smooth, r))
        result -= share * (2.0 + 2.0 * n) * rho**n
    return result


# Any polygon: the mixed method of Hellan, Herrmann and Johnson in NGSolve


def polygon_compliance(corners, kinds, nu, point, *, order=4, smallest=1e-3, ratio=1.2):
    """Static compliance (D = 1) of a polygon at a point, its edges as told, by mixed elements of high degree.

    Deflection of degree ``order`` + 1 and moments of degree ``order`` on triangles that shrink towards force and
    corners (Comodi 1989, Math. Comp. 52, 17-29, for the method).
    """
    import ngsolve as ng
    from netgen.geom2d import SplineGeometry

    corners = np.asarray(corners, float)
    size = np.ptp(corners, axis=0).max()
    geometry = SplineGeometry()
    numbers = [geometry.AppendPoint(*(c / size)) for c in corners]
    for i, kind in enumerate(kinds):
        geometry.Append(["line", numbers[i], numbers[(i + 1) % len(numbers)]], bc=kind)
    mesh = ng.Mesh(geometry.GenerateMesh(maxh=0.35))
    place = np.asarray(point, float) / size
    targets = np.vstack([corners / size, place])
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    notched = before[:, 0] * after[:, 1] < before[:, 1] * after[:, 0]  # there moments are infinite
    near = 0.02 * np.linalg.norm(targets[:-1] - place, axis=1)  # a corner beside the force matters more
    floors = np.append(np.minimum(np.where(notched, 1e-7, 1e-3), np.maximum(near, 1e-7)), smallest)
    while True:
        vertices = np.array([v.point for v in mesh.vertices])
        triangles = np.array([[v.nr for v in element.vertices] for element in mesh.Elements(ng.VOL)])
        corner = vertices[triangles]
        diameter = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
        marked = np.zeros(len(triangles), bool)
        for target, floor in zip(targets, floors):
            marked |= diameter > ratio * np.maximum(_distance(corner, target), floor) + 1e-3 * floor
        marked &= diameter > 0.0
        if not marked.any():
            break
        for element, mark in zip(mesh.Elements(ng.VOL), marked):
            mesh.SetRefinementFlag(element, bool(mark))
        mesh.Refine()
    held = "|".join(sorted({kind for kind in kinds if kind != "free"}))
    unbent = "|".join(sorted({kind for kind in kinds if kind != "clamped"}))
    bending = ng.HDivDiv(mesh, order=order, dirichlet=unbent)
    space = bending * ng.H1(mesh, order=order + 1, dirichlet=held)
    (sigma, w), (tau, v) = space.TnT()
    normal = ng.specialcf.normal(2)

    def along(f):
        return ng.grad(f) - (ng.grad(f) * normal) * normal

    trace = (sigma[0, 0] + sigma[1, 1]) * (tau[0, 0] + tau[1, 1])
    form = ng.BilinearForm(space, symmetric=True)
    form += ((ng.InnerProduct(sigma, tau) * (1.0 + nu) - nu * trace) / (1.0 - nu**2)) * ng.dx
    form += (ng.div(sigma) * ng.grad(v) + ng.div(tau) * ng.grad(w)) * ng.dx
    form += -(sigma * normal * along(v) + tau * normal * along(w)) * ng.dx(element_boundary=True)
    form.Assemble()
    force = ng.LinearForm(space)
    force += v(*(float(x) for x in place))
    force.Assemble()
    solution = ng.GridFunction(space)
    solution.vec.data = form.mat.Inverse(space.FreeDofs(), inverse="umfpack") * force.vec
    return abs(ng.InnerProduct(force.vec, solution.vec)) * size**2


def _distance(corner, target):
    """Distance (n,) of triangles (n, 3, 2) from a point, zero inside."""
    start, step = corner, np.roll(corner, -1, axis=1) - corner
    off = target - start
    share = np.clip((off * step).sum(axis=2) / (step**2).sum(axis=2), 0.0, 1.0)
    nearest = np.linalg.norm(off - share[..., None] * step, axis=2).min(axis=1)
    side = step[..., 0] * off[..., 1] - step[..., 1] * off[..., 0]
    inside = (side >= 0.0).all(axis=1) | (side <= 0.0).all(axis=1)
    return np.where(inside, 0.0, nearest)
