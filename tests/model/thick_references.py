"""Frequencies of thick beams and plates by other means: Ritz's method with polynomials for Timoshenko and Mindlin.

Deflection and rotation are independent polynomials, which do not lock at these degrees. Nothing here comes from the
package.
"""

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh, null_space

KAPPA = 5.0 / 6.0
DEGREE = 24  # of beams and along the radius; squares take half of it in each direction


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


def square(side, h, E, nu, rho, edges, count):
    """Angular frequencies of a Mindlin square; ``edges`` are those at x = 0, x = side, y = 0 and y = side."""
    n = DEGREE // 2
    x, w = legendre.leggauss(2 * n)
    P, dP = legendre.legval(x, np.eye(n)).T, legendre.legval(x, legendre.legder(np.eye(n))).T * 2.0 / side
    w = 0.5 * w * side
    one, d, mixed = P.T * w @ P, dP.T * w @ dP, dP.T * w @ P
    mass, along, across = np.kron(one, one), np.kron(d, one), np.kron(one, d)
    D, G = E * h**3 / (12.0 * (1.0 - nu**2)), E / (2.0 * (1.0 + nu))
    S, B = KAPPA * G * h, 0.5 * D * (1.0 - nu)
    x_w, y_w = np.kron(mixed, one), np.kron(one, mixed)  # slope of the row's function times the column's
    xy = np.kron(mixed, mixed.T)  # x slope of the row's times y slope of the column's
    K = np.block([
        [S * (along + across), -S * x_w, -S * y_w],
        [-S * x_w.T, D * along + B * across + S * mass, D * nu * xy + B * xy.T],
        [-S * y_w.T, D * nu * xy.T + B * xy, D * across + B * along + S * mass],
    ])  # fmt: skip
    M = np.kron(np.diag([rho * h, rho * h**3 / 12.0, rho * h**3 / 12.0]), mass)
    held, eye = [], np.eye(n)
    for side_of, kind in enumerate(edges):
        if kind == "free":
            continue
        at = legendre.legval(-1.0 if side_of % 2 == 0 else 1.0, eye)[None]
        rows = np.kron(at, eye) if side_of < 2 else np.kron(eye, at)
        normal = 1 if side_of < 2 else 2
        fields = [0, 1, 2] if kind == "clamped" else [0, 3 - normal]
        held += [np.kron(np.eye(3)[field][None], rows) for field in fields]
    return _lowest(K, M, np.vstack(held) if held else np.zeros((0, len(K))), count)
