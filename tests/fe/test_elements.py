"""Shape functions of triangles: their polynomials exactly, whatever the size and place of the triangle."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact.fe.elements import ArgyrisSpace, MorleySpace, triangles

POINTS = np.array([[0.0, 0.0], [1.0, 0.1], [0.2, 0.9], [1.1, 1.2]])
CELLS = np.array([[0, 1, 2], [1, 3, 2]])


def polynomial(coefficients, x, y, dx=0, dy=0):
    """Derivative of the sum of c_ij x**i y**j."""
    for _ in range(dx):
        coefficients = np.polynomial.polynomial.polyder(coefficients, axis=0)
    for _ in range(dy):
        coefficients = np.polynomial.polynomial.polyder(coefficients, axis=1)
    return np.polynomial.polynomial.polyval2d(x, y, coefficients)


def of_degree(degree, seed):
    coefficients = np.random.default_rng(seed).normal(size=(degree + 1, degree + 1))
    powers = np.add.outer(np.arange(degree + 1), np.arange(degree + 1))
    return np.where(powers <= degree, coefficients, 0.0)


@pytest.mark.parametrize("size", [1.0, 1e-6, 1e6])
@pytest.mark.parametrize("degree", [2, 5])
def test_argyris_functions_reproduce_polynomials_up_to_degree_five(size, degree):
    mesh = triangles(size * POINTS, CELLS)
    space, exact = ArgyrisSpace(mesh), of_degree(degree, seed=degree)
    inside = np.array([[0.2, 0.3, 0.5], [0.6, 0.1, 0.3], [1.0, 0.0, 0.0]])  # in barycentric coordinates
    for cell, corners in enumerate(POINTS[mesh.t.T]):
        unknowns = [
            polynomial(exact, *corner, dx, dy) / size ** (dx + dy)
            for corner in corners
            for dx, dy in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        ]
        for middle, normal in zip(space.middles[cell] / size, space.normals[cell]):
            unknowns.append((normal @ [polynomial(exact, *middle, 1, 0), polynomial(exact, *middle, 0, 1)]) / size)
        x, y = (inside @ corners).T
        value, bend = (f[0] for f in space.functions(np.array([cell]), size * (inside @ corners)[None], (0, 2)))
        # 21 unknowns of the size of the polynomial's derivatives: rounding times some hundred
        assert_allclose(value @ unknowns, polynomial(exact, x, y), atol=1e-12)
        for row, (dx, dy) in zip(bend, ((2, 0), (1, 1), (0, 2))):
            assert_allclose((row @ unknowns) * size**2, polynomial(exact, x, y, dx, dy), atol=1e-10)


def test_argyris_functions_keep_their_digits_far_from_the_origin():
    near, far = (ArgyrisSpace(triangles(POINTS + shift, CELLS)) for shift in (0.0, 1024.0))
    inside = np.array([[[0.4, 0.3]], [[0.9, 0.8]]])
    for one, two in zip(
        near.functions(np.arange(2), inside, (0, 2)), far.functions(np.arange(2), inside + 1024.0, (0, 2))
    ):
        assert_allclose(one, two, atol=1e-10)  # 1e-13 of the coordinates, and two derivatives


def test_morley_functions_contain_the_rigid_motions():
    space = MorleySpace(triangles(POINTS, CELLS))
    rigid = space.rigid_unknowns(np.arange(12).reshape(2, 6).T, 12)
    inside = np.array([[[0.4, 0.3]], [[0.9, 0.8]]])
    value = space.functions(np.arange(2), inside, (0,))[0]
    for cell in range(2):
        functions = value[cell, 0]
        # 1, x and y from the unknowns that `rigid_unknowns` gives them
        assert_allclose(functions @ rigid.reshape(2, 6, 3)[cell], [1.0, *inside[cell, 0]], atol=1e-13)
