"""Frequencies of thick beams and plates by other means: Ritz's method with polynomials for Timoshenko and Mindlin.

Deflection and rotation are independent polynomials, which do not lock at these degrees. Nothing here comes from the
package.
"""

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh, null_space

KAPPA = 5.0 / 6.0
DEGREE = 24  # of beams and along the radius


def wang(omega, h, E, nu, rho):
    """Mindlin's frequencies of a hinged polygon from Kirchhoff's; Wang (1994), J. Vib. Acoust. 116, 536."""
    D, G = E * h**3 / (12.0 * (1.0 - nu**2)), E / (2.0 * (1.0 + nu))
    a = 1.0 + omega * h**2 / 12.0 * np.sqrt(rho * h / D) * (1.0 + 2.0 / (KAPPA * (1.0 - nu)))
    root = np.sqrt(a**2 - rho * h**2 * omega**2 / (3.0 * KAPPA * G))
    return np.sqrt(6.0 * KAPPA * G / (rho * h**2) * (a - root))


def _lowest(K, M, held, count):
    """Square roots of the lowest eigenvalues under the constraints ``held`` (n, n_dofs), without rigid motions."""
    free = null_space(held) if len(held) else np.eye(len(K))
    values = eigh(free.T @ K @ free, free.T @ M @ free, eigvals_only=True)
    values = values[values > 1e-7 * values[8]]
    return np.sqrt(values[:count])


def timoshenko(length, EI, rhoA, rhoI, kGA, ends, count):
    """Angular frequencies of a Timoshenko beam."""
    x, w = legendre.leggauss(2 * DEGREE)
    x, w = 0.5 * (x + 1.0), 0.5 * w * length
    eye = np.eye(DEGREE)
    P = legendre.legval(2.0 * x - 1.0, eye).T
    dP = legendre.legval(2.0 * x - 1.0, legendre.legder(eye)).T * 2.0 / length
    none = np.zeros_like(P)
    turn, shear, move, spin = (np.hstack(pair) for pair in ((none, dP), (dP, -P), (P, none), (none, P)))
    K = EI * turn.T * w @ turn + kGA * shear.T * w @ shear
    M = rhoA * move.T * w @ move + rhoI * spin.T * w @ spin
    held, still = [], np.zeros(DEGREE)
    for end, kind in zip((-1.0, 1.0), ends):
        at = legendre.legval(end, eye)
        held += [np.append(at, still)] * (kind != "free") + [np.append(still, at)] * (kind == "clamped")
    return _lowest(K, M, np.array(held), count)


def disk(radius, h, E, nu, rho, edge, order, count):
    """Angular frequencies of a Mindlin disk with ``order`` nodal diameters."""
    x, w = legendre.leggauss(3 * DEGREE)
    r, w = 0.5 * (x + 1.0), 0.25 * w * (x + 1.0)
    n, half = order, DEGREE // 2
    P = legendre.legval(2.0 * r**2 - 1.0, np.eye(half)).T
    dP = legendre.legval(2.0 * r**2 - 1.0, legendre.legder(np.eye(half))).T * 4.0 * r[:, None]
    R = r[:, None]

    def times(power):
        return P * R**power, dP * R**power + power * P * R ** (power - 1)

    D, G = E * h**3 / (12.0 * (1.0 - nu**2)) / radius**2, E / (2.0 * (1.0 + nu))
    (f, df), (g, dg), none = times(n), times(abs(n - 1)), np.zeros_like(P)
    two = (none, none) if n == 0 else (g, dg)
    stack = np.hstack
    bend_r, bend_t = stack([none, dg, none]), stack([none, g / R, n * two[0] / R])
    twist = stack([none, -n * g / R, two[1] - two[0] / R])
    shear_r, shear_t = stack([-df / radius, g, none]), stack([n * f / R / radius, none, two[0]])
    K = D * (bend_r.T * w @ bend_r + bend_t.T * w @ bend_t + nu * (bend_r.T * w @ bend_t + bend_t.T * w @ bend_r))
    K += 0.5 * D * (1.0 - nu) * twist.T * w @ twist + KAPPA * G * h * (
        shear_r.T * w @ shear_r + shear_t.T * w @ shear_t
    )
    parts = [(stack([f, none, none]), rho * h), (stack([none, g, none]), rho * h**3 / 12.0)]
    parts += [(stack([none, none, two[0]]), rho * h**3 / 12.0)]
    M = sum(inertia * part.T * w @ part for part, inertia in parts)
    rim = np.eye(3)[:, :, None] * np.ones(half)  # every polynomial is 1 at the rim
    rows = [rim[i].ravel() for i in range(3) if edge == "clamped" or (edge == "hinged" and i != 1)]
    keep = slice(0, 2 * half) if n == 0 else slice(None)
    held = np.array([row[keep] for row in rows if row[keep].any()])
    return _lowest(K[keep, keep], M[keep, keep], held, count)
