"""A plate seen from several points: each as if alone, and factorised once for all."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.model.target import Elements, Stages, Target
from fem_impact.model.views import Krylovs, Views
from fem_impact.modes import ritz

POINTS = np.array([(0.2, 0.11), (0.1, 0.2), (0.33, 0.08)])
PLATE = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)


def body():
    return fi.assemble(fi.mesh.rectangle(0.465, 0.3), PLATE, {"boundary": "hinged"}, near=POINTS)


@pytest.mark.slow
def test_each_point_has_the_vectors_that_it_would_have_alone(monkeypatch):
    system, shift, made = body(), 2e4, []
    once = ritz.factorise
    monkeypatch.setattr(ritz, "factorise", lambda matrix: made.append(1) or once(matrix))
    shared = Krylovs(system, POINTS, shift)
    assert len(made) == 1
    for point, found in zip(POINTS, shared.each):
        alone = ritz.Krylov(system, point[None], shift).modes(30, 0.01)
        assert_allclose(found.modes(30, 0.01).omega, alone.omega, rtol=1e-12)  # the same operations
        assert_allclose(found.modes(30, 0.01).shape_at([point]), alone.shape_at([point]), rtol=1e-9)


@pytest.mark.slow
def test_views_of_a_body_are_as_soft_as_the_body_is_there():
    """Vectors start with the static deflection under the load, so that the compliance is that of the mesh."""
    target = Target.of(body())
    seen = Views(target, POINTS, 300.0, 1e-2, Elements(0.03), False, Stages())
    closed = fi.analytic.closed_form(target.mesh, PLATE, {"boundary": "hinged"})(n_modes=20)
    assert not seen.at_rest
    for i, point in enumerate(POINTS):
        modes = seen.of(i, lambda modes, margin: modes.frequencies[-1])
        # 1e-5 by the elements that shrink towards the blow
        assert_allclose(modes.modal_compliance([point]), closed.shapes.compliance(point[None]), rtol=1e-4)
        assert list(modes.poorer) == ["mesh", "truncation"]
