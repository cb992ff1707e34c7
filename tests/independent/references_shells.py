"""Frequencies of shallow shells and laminates by formulas, sharing no code with fem_impact.

Shallow theory (Marguerre 1938, Donnell 1933): curvatures are second derivatives of the rise; mass and area are those of
the plan. Without inertia in the plane both are one theory; with it, Donnell's moves along the surface and Marguerre's
along the plane, which differs by the square of the slope. Units are SI throughout.
"""

import numpy as np
from scipy import special
from scipy.optimize import brentq

NEAR = 0.3  # [-] of xi, below which J and I of xi r are alike in too many digits

# Stiffness of laminates


def isotropic(E, nu, thickness):
    """Stiffnesses A [N/m], B [N] and D [N m], each (3, 3), of one layer."""
    return stack([((E, E, nu, E / 2.0 / (1.0 + nu)), thickness, 0.0)])


def stack(layers):
    """Stiffnesses A, B and D of layers ((E1, E2, nu12, G12), thickness, degrees from x to 1), the lowest first.

    Forces and moments of strains e0 - z d2w off the middle of the stack: N = A e0 + B k and M = B e0 + D k, where
    k = -(w_xx, w_yy, 2 w_xy), strains (xx, yy, 2 xy) (Jones, Mechanics of composite materials, ch. 2 and 4).
    """
    A, B, D = np.zeros((3, 3, 3))
    z = -0.5 * sum(thickness for _, thickness, _ in layers)
    for (E1, E2, nu12, G12), thickness, degrees in layers:
        nu21 = nu12 * E2 / E1
        Q = np.array([[E1, nu12 * E2, 0.0], [nu12 * E2, E2, 0.0], [0.0, 0.0, G12 * (1.0 - nu12 * nu21)]])
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        to_layer = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]])
        Q = to_layer.T @ (Q / (1.0 - nu12 * nu21)) @ to_layer
        A += Q * thickness
        B += Q * ((z + thickness) ** 2 - z**2) / 2.0
        D += Q * ((z + thickness) ** 3 - z**3) / 3.0
        z += thickness
    return A, B, D


# Rectangles


def diaphragm_panel(sides, stiffness, per_area, waves, curvature=(0.0, 0.0), inertia=False):
    """Frequency [rad/s] of a cross-ply panel on shear diaphragms (hinged, held along each edge, free across it).

    Exact for u, v, w = (U cos sin, V sin cos, W sin sin) of half waves (m, n), with curvatures (z_xx, z_yy) [1/m];
    A_16 = A_26 = 0 and so on. With ``inertia`` all three frequencies (3,), of motion along the surface (Donnell).
    Jones, ch. 5; Leissa, Vibration of shells, NASA SP-288, ch. 2.
    """
    A, B, D = stiffness
    p, q = np.pi * waves[0] / sides[0], np.pi * waves[1] / sides[1]
    strain = np.array([[-p, 0.0, -curvature[0]], [0.0, -q, -curvature[1]], [q, p, 0.0]])
    bent = np.array([[0.0, 0.0, p * p], [0.0, 0.0, q * q], [0.0, 0.0, -2.0 * p * q]])
    return _three(strain, bent, A, B, D, per_area, inertia)


def angle_ply_panel(sides, stiffness, per_area, waves, inertia=False):
    """Frequency [rad/s] of a plane antisymmetric angle-ply plate, hinged, held across each edge and free along it.

    Exact for u, v, w = (U sin cos, V cos sin, W sin sin); A_16 = A_26 = D_16 = D_26 = 0 and B has nothing but B_16 and
    B_26 (Whitney and Leissa 1969, J. Appl. Mech. 36, 261-266; Jones, ch. 5).
    """
    A, B, D = stiffness
    p, q = np.pi * waves[0] / sides[0], np.pi * waves[1] / sides[1]
    # with xx and yy of the plane and xy of bending as cos cos, the others as sin sin
    strain = np.array([[p, 0.0, 0.0], [0.0, q, 0.0], [-q, -p, 0.0]])
    bent = np.array([[0.0, 0.0, p * p], [0.0, 0.0, q * q], [0.0, 0.0, -2.0 * p * q]])
    return _three(strain, bent, A, B, D, per_area, inertia)


def _three(strain, bent, A, B, D, per_area, inertia):
    K = strain.T @ A @ strain + strain.T @ B @ bent + bent.T @ B @ strain + bent.T @ D @ bent
    if inertia:
        return np.sqrt(np.linalg.eigvalsh(K) / per_area)
    return np.sqrt((K[2, 2] - K[2, :2] @ np.linalg.solve(K[:2, :2], K[:2, 2])) / per_area)


def isotropic_panel(sides, E, nu, rho, thickness, waves, curvature):
    """As `diaphragm_panel` of one isotropic layer without inertia in the plane, in its closed form."""
    p, q = np.pi * waves[0] / sides[0], np.pi * waves[1] / sides[1]
    bending = E * thickness**2 / 12.0 / (1.0 - nu**2) * (p * p + q * q) ** 2
    return np.sqrt((bending + E * ((curvature[0] * q * q + curvature[1] * p * p) / (p * p + q * q)) ** 2) / rho)


def t_beam(length, waves, E, rho, plate, rib):
    """Frequency [rad/s] of a hinged beam of two rectangles (width, height), one upon the other, as one section."""
    areas = np.array([plate[0] * plate[1], rib[0] * rib[1]])
    heights = np.array([0.0, 0.5 * (plate[1] + rib[1])])
    own = areas * np.array([plate[1], rib[1]]) ** 2 / 12.0
    axis = areas @ heights / areas.sum()
    second = own.sum() + areas @ (heights - axis) ** 2
    return (np.pi * waves / length) ** 2 * np.sqrt(E * second / rho / areas.sum())


# Spherical caps


def cap_roots(k, chi, nu, edge, reach):
    """Squared frequencies over D / (rho h a**4), up to ``reach``, of a shallow spherical cap with k nodal diameters.

    ``chi`` = 12 (1 - nu**2) (a**2 / R / h)**2 for edge radius a and thickness h; the edge is "free" or "clamped", also
    in the plane, whose inertia is left out. Accurate to 1e-11. Roots within NEAR**4 of chi are not looked for: there
    the four solutions are hard to tell apart. Reissner (1946), Q. Appl. Math. 4, 279-290; Johnson
    and Reissner (1958), Q. Appl. Math. 15, 367-380; Touze and Thomas (2006), Int. J. Non-Lin. Mech. 41, 678-692.
    """
    ends = [(-(max(chi - 1e-6 * min(chi, 1.0), 0.0) ** 0.25), -NEAR), (NEAR, max(reach - chi, 0.0) ** 0.25)]  # of xi
    found = []
    for low, high in ends:
        xi = np.linspace(low, high, 3 + int(50.0 * max(high - low, 0.0))) if high > low else np.array([])
        scan = np.sign(xi) * xi**4
        values = [cap_equation(xi4, k, chi, nu, edge) for xi4 in scan]
        for i in np.flatnonzero(np.diff(np.sign(values))):
            root = brentq(cap_equation, scan[i], scan[i + 1], args=(k, chi, nu, edge), xtol=1e-13, rtol=1e-14)
            found.append(root + chi)
    return np.array([x for x in found if x < reach])


def cap_equation(xi4, k, chi, nu, edge):
    """Determinant of the edge conditions at a squared frequency of xi4 + chi (see `cap_roots`).

    With f the stress function over E h a**2 / R, del4 f = del2 w and del4 w + chi del2 f = (xi4 + chi) w. Solutions
    regular in the middle: J and I of xi r as w, with f = -w / xi**2 and w / xi**2; w = chi r**k with f of r**(k + 2);
    and f = r**k, which for k < 2 has no stress, whereupon one condition in the plane follows from the other.
    """
    if xi4 > 0.0:
        xi = xi4**0.25
        w = [_wave(special.jv, k, xi, -(xi**2)), _wave(special.ive, k, xi, xi**2)]
        f = [-w[0] / xi**2, w[1] / xi**2]
    else:  # Kelvin functions: J of a complex argument
        xi = (-xi4) ** 0.25 * np.exp(0.25j * np.pi)
        wave = _wave(special.jve, k, xi, -(xi**2))
        w, f = [wave.real, wave.imag], [(-wave / xi**2).real, (-wave / xi**2).imag]
    w += [chi * _power(k), 0.0 * _power(k)]
    f += [(xi4 + chi) * _power(k + 2) / (4.0 * (k + 1.0)), _power(k)]
    size = 4 if k > 1 else 3
    matrix = np.array([_edge(a, b, k, nu, edge)[:size] for a, b in zip(w, f)][:size])
    return np.linalg.det(matrix / np.abs(matrix).max(axis=1, keepdims=True))


def _wave(function, k, xi, factor):
    """Value and three derivatives at r = 1 of a Bessel function of xi r with Laplacian ``factor`` times itself."""
    g = function(k, xi)
    d1 = xi * function(k - 1, xi) - k * g
    d2 = -d1 + (k**2 + factor) * g
    return np.array([g, d1, d2, d1 - d2 + (k**2 + factor) * d1 - 2.0 * k**2 * g])


def _power(p):
    return np.array([1.0, p, p * (p - 1.0), p * (p - 1.0) * (p - 2.0)])


def _edge(w, f, k, nu, edge):
    """What an edge holds at zero: two of the deflection, two in the plane, from derivatives at r = 1."""
    if edge == "free":
        moment = w[2] + nu * (w[1] - k**2 * w[0])
        shear = w[3] + w[2] - w[1] - k**2 * (w[1] - 2.0 * w[0]) - (1.0 - nu) * k**2 * (w[1] - w[0])
        return moment, shear, f[1] - k**2 * f[0], k * (f[1] - f[0])
    around = f[2] - nu * (f[1] - k**2 * f[0])
    slope = f[3] - nu * (f[2] - f[1] - k**2 * f[1] + 2.0 * k**2 * f[0])
    along, sheared = f[1] - k**2 * f[0] - nu * f[2], 2.0 * (1.0 + nu) * k * (f[1] - f[0])
    return w[0], w[1], around, around + slope - along - k * sheared  # the last: the edge keeps its curvature
