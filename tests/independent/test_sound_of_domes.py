"""Curved plates in a wall by boundary elements: the bound that `fi.sound.radiate` states for taking them as flat."""

import numpy as np
import pytest
from scipy.spatial import Delaunay
from scipy.special import jn_zeros, jv

RADIUS, SPEED, RINGS = 0.2, 343.2, 9
LISTENERS = np.array([[0.0, 0.0, 1.0], [0.5, 0.2, 0.8], [0.9, 0.0, 0.4], [0.0, 1.0, 0.15]])
MIRROR = np.array([1.0, 1.0, -1.0])  # in the wall


def triangles(height):
    """Triangles (n, 3, 3) of a dome over a disk, counter-clockwise from above."""
    rings = [i / RINGS * np.exp(2j * np.pi * np.arange(6 * i) / (6 * i)) for i in range(1, RINGS + 1)]
    z = RADIUS * np.concatenate([[0.0], *rings])
    places = np.column_stack([z.real, z.imag, height * (1.0 - np.abs(z / RADIUS) ** 2)])
    found = places[Delaunay(places[:, :2]).simplices]
    twice = np.linalg.det(found[:, 1:, :2] - found[:, :1, :2])
    found[twice < 0.0] = found[twice < 0.0][:, ::-1]
    return found[np.abs(twice) > 1e-9]


def quartered(tri):
    a, b, c = np.moveaxis(tri, 1, 0)
    d, e, f = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    return np.concatenate([np.stack(each, axis=1) for each in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))])


def motions(at):
    """Deflections (n, n_motions): a piston, a bow, and modes with circles and diameters at rest."""
    r, turn = np.hypot(*at.T) / RADIUS, np.arctan2(at[:, 1], at[:, 0])
    circles = [jv(0, jn_zeros(0, 4)[i] * r) for i in (1, 3)]
    lines = [jv(m, jn_zeros(m, i)[-1] * r) * np.cos(m * turn) for m, i in ((2, 2), (5, 1))]
    return np.column_stack([np.ones(len(at)), 1.0 - r**2, *circles, *lines])


def solved(tri, k):
    """Pressure (n_listeners, n_motions) of a dome in a wall that moves along z at a unit rho * acceleration."""
    normal = 0.5 * np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])
    area, n = np.linalg.norm(normal, axis=1), len(tri)
    normal, centre = normal / area[:, None], tri.mean(axis=1)
    source, own = quartered(quartered(tri)).mean(axis=1), np.tile(np.arange(n), 16)

    def kernels(x):
        """Of a source and its mirror image, and its slope along the normal there, (n_x, n) each."""
        whole = np.zeros((2, len(x), n), complex)
        for turn in (np.ones(3), MIRROR):
            away = source * turn - x[:, None]
            r = np.maximum(np.linalg.norm(away, axis=2), 1e-12)
            wave = np.exp(1j * k * r) / (4.0 * np.pi * r) * area[own] / 16.0
            slope = wave * (1j * k - 1.0 / r) / r * (away * (normal[own] * turn)).sum(axis=2)
            whole += np.stack([wave, slope]).reshape(2, len(x), 16, n).sum(axis=2)
        return whole

    G, D = kernels(centre)
    R, d = np.sqrt(area / np.pi), 2.0 * centre[:, 2]  # each triangle on itself and on its image, as a disk
    image = np.hypot(R, d)
    np.fill_diagonal(G, (np.exp(1j * k * R) - 1.0 + np.exp(1j * k * image) - np.exp(1j * k * d)) / (2j * k))
    np.fill_diagonal(D, -0.5 * np.sign(d) * (1.0 - d / image) * normal[:, 2])
    push = motions(centre[:, :2]) * normal[:, 2:]
    surface = np.linalg.solve(0.5 * np.eye(n) - D, G @ push)
    G, D = kernels(LISTENERS)
    return D @ surface + G @ push


def flat(tri, k):
    """Rayleigh's integral over the outline, and what all its parts in step would give."""
    area = 0.5 * np.linalg.det(tri[:, 1:, :2] - tri[:, :1, :2])
    centre = tri.mean(axis=1) * [1.0, 1.0, 0.0]
    r = np.linalg.norm(centre - LISTENERS[:, None], axis=2)
    weight, moved = area / (2.0 * np.pi * r), motions(centre[:, :2])
    return (weight * np.exp(1j * k * r)) @ moved, weight @ np.abs(moved)


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [200.0, 700.0, 1500.0])
def test_domes_sound_as_flat_ones_within_the_stated_bound(frequency):
    """At most 2 pi h / wavelength of what all parts in step would give: 0.37, 0.87 and 0.72 times that of a bow."""
    k = 2.0 * np.pi * frequency / SPEED
    nothing = triangles(2e-5)  # 1e-4 of the radius: nearly flat
    assert np.abs(solved(nothing, k) - flat(nothing, k)[0]).max() < 5e-3 * flat(nothing, k)[1].max()
    for height in (0.01, 0.02, 0.04):
        dome = triangles(height)
        heard, in_step = flat(dome, k)
        apart = np.abs(solved(dome, k) - heard) / in_step / (k * height)
        assert apart.max() < 1.0
