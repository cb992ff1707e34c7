"""A clamped spherical cap under pressure, through its snap, against an axisymmetric solution of its own.

Deflection and radial displacement are polynomials that minimise Marguerre's energy; the depth of the middle is given,
and the pressure found, so that the way goes on beyond the limit point.
"""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.modes.stretching import stretch

E, NU, H, RADIUS, TOP = 210e9, 0.3, 1e-3, 0.1, 2.42e-3  # 2 (3 (1 - nu**2))**(1/4) (TOP / H)**(1/2) = 4
STEEL = fi.Material(E=E, nu=NU, rho=7850.0)
DEPTHS = H * np.concatenate([[-0.5], np.linspace(0.1, 4.0, 40)])  # negative: pulled, or pressed from below


def pressures(energy, load, middle):
    """Pressures (n,) [Pa] at the depths; ``energy`` gives forces and stiffness of a state."""
    found = []
    for depth in DEPTHS:
        if depth <= 0.1 * H:
            q, p = np.zeros(len(load)), 0.0
        for _ in range(50):
            force, stiffness = energy(q)
            left = np.append(force - p * load, middle @ q - depth)
            matrix = np.block([[stiffness, -load[:, None]], [middle[None], np.zeros((1, 1))]])
            *step, more = np.linalg.solve(matrix, -left)
            q, p = q + np.array(step), p + more
            if np.abs(step).max() < 1e-10 * np.abs(q).max():
                break
        found.append(p)
    return np.array(found)


def by_modes(n_modes):
    """By the modes and their forms of stretching."""
    system = fi.assemble(
        fi.mesh.disk(RADIUS), fi.Plate(STEEL, H), {"boundary": "clamped"},
        rise=lambda x: TOP * (1.0 - (x**2).sum(axis=1) / RADIUS**2),
    )  # fmt: skip
    modes = fi.find_modes(system, n_modes=n_modes)
    own = stretch(modes)
    r, weight = np.polynomial.legendre.leggauss(30)
    r, angle = 0.5 * RADIUS * (r + 1.0), 2.0 * np.pi * np.arange(32) / 32
    points = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle))], axis=-1)
    mean = modes.shape_at(points.reshape(-1, 2)).reshape(30, 32, n_modes).mean(axis=1)

    def energy(q):
        bent, lead = own.forms @ q, own.linear @ q
        pull = bent @ q
        force = modes.omega**2 * q + (lead + pull) @ bent + 0.5 * pull @ own.linear
        mixed = own.linear.T @ bent
        added = mixed + mixed.T + 2.0 * bent.T @ bent + np.einsum("k,kij->ij", lead + pull, own.forms)
        return force, np.diag(modes.omega**2) + added

    return pressures(energy, np.pi * RADIUS * (weight * r) @ mean, modes.shape_at([(0.0, 0.0)])[0])


def by_polynomials(n=10):
    """By w = (1 - x**2)**2 P(x**2) and u = x (1 - x**2) Q(x**2) at r = x times the radius."""
    x, weight = np.polynomial.legendre.leggauss(60)
    x = 0.5 * (x + 1.0)
    X = np.polynomial.Polynomial([0.0, 1.0])
    shapes = [(1.0 - X**2) ** 2 * X ** (2 * i) for i in range(n)]
    slides = [X * (1.0 - X**2) * X ** (2 * i) for i in range(n)]

    def values(functions, order):
        found = [f.deriv(order)(x) if order else f(x) for f in functions]
        return np.stack(found, axis=1) / RADIUS**order

    zero, slope, r = np.zeros((60, n)), np.hstack([np.zeros((60, n)), values(shapes, 1)]), RADIUS * x[:, None]
    rise = 2.0 * TOP * r / RADIUS**2  # of the surface along the blow
    linear = np.stack(
        [np.hstack([values(slides, 1), rise * values(shapes, 1)]), np.hstack([values(slides, 0) / r, zero])], axis=1
    )
    bends = np.stack([np.hstack([zero, values(shapes, 2)]), np.hstack([zero, values(shapes, 1) / r])], axis=1)
    area, C = np.pi * RADIUS * weight * r[:, 0], np.array([[1.0, NU], [NU, 1.0]])
    A = E * H / (1.0 - NU**2)
    bending = A * H**2 / 12.0 * np.einsum("q,qik,ij,qjl->kl", area, bends, C, bends)

    def energy(y):
        steep = slope @ y
        strain, gradient = linear @ y, linear.copy()
        strain[:, 0] += 0.5 * steep**2
        gradient[:, 0] += steep[:, None] * slope
        stress = A * strain @ C
        stiff = A * np.einsum("q,qik,ij,qjl->kl", area, gradient, C, gradient)
        stiff += np.einsum("q,qk,ql->kl", area * stress[:, 0], slope, slope)
        return bending @ y + np.einsum("q,qik,qi->k", area, gradient, stress), bending + stiff

    load = np.append(np.zeros(n), area @ values(shapes, 0))
    return pressures(energy, load, np.append(np.zeros(n), [shape(0.0) for shape in shapes]))


@pytest.mark.slow
def test_a_clamped_cap_snaps_at_the_pressure_of_its_axisymmetric_solution():
    found, wanted = by_modes(20), by_polynomials()
    limit = wanted[:30].argmax()
    assert 0 < limit < 20 and wanted[limit:].min() < 0.8 * wanted[limit]  # it snaps
    assert found[limit] == pytest.approx(wanted[limit], rel=1e-3)  # 2e-4 of modes and fields left out
    # twenty modes lack 1 % of the softness under a gentle pressure, 2 % from below
    assert found == pytest.approx(wanted, rel=3e-2) and found[1:] == pytest.approx(wanted[1:], rel=1.5e-2)
    from_below, pressed = -found[0], np.interp(0.5 * H, DEPTHS[1:], found[1:])
    assert from_below > 1.3 * pressed  # it hardens, while it softens when it is pressed on its top
