"""A hinged rectangle in a baffle, surrounded by air: Rayleigh's double integral by Gauss points, of coupled modes.

The integrand depends on two places by their difference alone, so that the integral over both rectangles is one over
all differences, of the shapes' correlations, which are closed forms. In polar coordinates 1 / R cancels.
"""

import numpy as np
from scipy.linalg import eigh


def hinged_modes(length, width, stiffness, weight, count):
    """Numbers (count, 2) of half waves and frequencies (count,) [rad/s] of the lowest modes in vacuum."""
    number = np.arange(1, 2 * count + 1)
    m, n = (x.ravel() for x in np.meshgrid(number, number, indexing="ij"))
    omega = np.pi**2 * ((m / length) ** 2 + (n / width) ** 2) * np.sqrt(stiffness / weight)
    lowest = np.argsort(omega, kind="stable")[:count]
    return np.column_stack([m, n])[lowest], omega[lowest]


def correlation(m, p, length, shift):
    """Integral of sin(m pi s / length) sin(p pi (s + x) / length) over all s, for shifts x and -x together."""

    def one(first, second):
        rest, turn = length - shift, np.sin(second * shift)
        even = rest * np.cos(second * shift)
        if first != second:
            even = (np.sin((first - second) * rest - second * shift) + turn) / (first - second)
        return 0.5 * (even - (np.sin((first + second) * rest + second * shift) - turn) / (first + second))

    waves = np.array([m, p]) * np.pi / length
    return one(*waves) + one(*waves[::-1])


def differences(length, width, points):
    """Gauss points of all differences of two places: x, y and weights over R; (n,) each."""
    node, gauss = np.polynomial.legendre.leggauss(points)
    diagonal, parts = np.arctan2(width, length), []
    for low, high, end in (
        (0.0, diagonal, lambda t: length / np.cos(t)),
        (diagonal, 0.5 * np.pi, lambda t: width / np.sin(t)),
    ):
        angle = low + 0.5 * (high - low) * (node[:, None] + 1.0)
        r = 0.5 * end(angle) * (node + 1.0)
        weight = 0.25 * (high - low) * end(angle) * gauss[:, None] * gauss
        parts.append([part.ravel() for part in (r * np.cos(angle), r * np.sin(angle), weight)])
    return np.hstack(parts)


def in_air(length, width, mass, numbers, omega, *, density, speed, sides):
    """Frequencies [rad/s] in ascending order and damping ratios of the modes given, each solved at its own frequency.

    ``numbers`` (n, 2) of half waves, ``omega`` (n,) [rad/s] in vacuum, ``mass`` [kg] of the plate.
    """
    extent = np.hypot(length, width)
    points = int(20 + (omega.max() / speed * extent + 2.0 * np.pi * numbers.max()) / 1.5)
    x, y, weight = differences(length, width, points)
    R, found = np.hypot(x, y), []
    for parity in {tuple(row % 2) for row in numbers}:  # others do not couple, by symmetry
        family = np.flatnonzero((numbers % 2 == parity).all(axis=1))
        along, across = (
            {
                (m, p): correlation(m, p, size, shift)
                for m in np.unique(numbers[family, axis])
                for p in np.unique(numbers[family, axis])
            }
            for axis, size, shift in ((0, length, x), (1, width, y))
        )
        pairs = np.array([
            [along[m, p] * across[n, q] * weight for p, q in numbers[family]] for m, n in numbers[family]
        ])  # fmt: skip
        pairs *= 4.0 / mass  # of mass-normalised shapes
        for place, own in enumerate(omega[family]):
            before = 0.0
            while abs(own - before) > 1e-12 * own:
                added = sides * density / (2.0 * np.pi) * (pairs @ np.cos(own / speed * R))
                value, vector = eigh(np.diag(omega[family] ** 2), np.eye(len(family)) + added)
                before, own = own, np.sqrt(value[place])
            mix = vector[:, place]
            lost = mix @ (pairs @ np.sin(own / speed * R)) @ mix
            found.append((own, sides * density / (4.0 * np.pi) * lost))
    return np.array(sorted(found)).T
