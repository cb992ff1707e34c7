"""Ribs of plates: T beams, panels by Ritz's method, masses, ends, and what is refused."""

import numpy as np
import pytest
import references_shells as reference
from references_panels import Order, Panel, levy_omegas, rectangular_rib

import fem_impact as fi
from fem_impact.fe import assembly, refinement

E, NU, RHO = 70e9, 0.3, 2700.0
ALUMINIUM = fi.Material(E=E, nu=NU, rho=RHO)
SLIDING = {"boundary": "sliding"}


def bar(width=3e-3, height=12e-3):
    return fi.Beam.rectangular(ALUMINIUM, width=width, height=height)


def omegas(system, n, monkeypatch=None):
    """Angular frequencies without the inertia of what moves in the plane, as the references have them."""
    if monkeypatch is not None:
        monkeypatch.setattr(refinement, "heavier", lambda system, values, vectors: (values, None))
    found = fi.find_modes(system, n_modes=n, tolerance=1e-5)
    return found.omega, found.frequency_error


def test_a_rib_below_a_strip_makes_a_t_beam():
    length, width, thickness, rib = 1.0, 0.04, 2e-3, (3e-3, 20e-3)
    strip = fi.mesh.rectangle(length, width)
    ends = {"left": "hinged", "right": "hinged"}
    path = [(-0.1, 0.5 * width), (length + 0.1, 0.5 * width)]  # sticks out at both ends
    system = fi.assemble(
        strip, fi.Plate(ALUMINIUM, thickness), ends, ribs=[fi.Rib(path, bar(*rib))],
        in_plane={"left": "sliding", "right": "sliding"},
    )  # fmt: skip
    exact = reference.t_beam(length, 1, E, RHO, (width, thickness), rib)
    first = fi.find_modes(system, n_modes=1, tolerance=1e-4).omega[0]
    assert first == pytest.approx(exact, rel=2e-3)  # strips bend across too, and the rib turns: 7e-4 and 9e-4
    assert system.mass == pytest.approx(RHO * length * (width * thickness + rib[0] * rib[1]), rel=1e-12)


@pytest.mark.parametrize("width", [1e-6, 3e-3, pytest.param(10e-3, marks=pytest.mark.slow)])
def test_panels_with_a_rib_are_those_of_ritzs_method(width, monkeypatch):
    sides, thickness, at = (0.4, 0.3), 2e-3, 0.12
    rib = rectangular_rib("x", at, width, 12e-3, thickness, E, NU, RHO)
    edges = (("hinged", "sliding"),) * 4
    panel = Panel(sides, reference.isotropic(E, NU, thickness), RHO * thickness, edges, None, (rib,))
    exact = np.array([row[0] for row in levy_omegas(panel, 8, Order(2, 16))])
    path = [(0.0, at), (sides[0], at)]
    system = fi.assemble(
        fi.mesh.rectangle(*sides), fi.Plate(ALUMINIUM, thickness), {"boundary": "hinged"}, in_plane=SLIDING,
        ribs=[fi.Rib(path, bar(width))],
    )  # fmt: skip
    found, claimed = omegas(system, 8, monkeypatch)
    error = np.abs(found / exact - 1.0)
    assert error.max() < 1e-5
    assert (error < np.maximum(claimed, 1e-7)).all()


def test_the_offset_decides_and_its_sign_does_not_on_a_flat_plate():
    mesh, plate, path = fi.mesh.rectangle(0.4, 0.3), fi.Plate(ALUMINIUM, 2e-3), [(0.0, 0.12), (0.4, 0.12)]
    first = {}
    for offset in (None, -7e-3, 7e-3, 0.0, lambda points: np.full(len(points), -7e-3)):
        system = fi.assemble(mesh, plate, {"boundary": "hinged"}, ribs=[fi.Rib(path, bar(), offset)])
        first[offset if not callable(offset) else "own"] = fi.find_modes(system, n_modes=1).omega[0]
    assert first[None] == pytest.approx(first[-7e-3], rel=1e-12) == pytest.approx(first["own"], rel=1e-12)
    assert first[7e-3] == pytest.approx(first[-7e-3], rel=1e-9)
    assert first[0.0] < 0.9 * first[None]


def test_a_tapered_rib_weighs_its_integral_and_a_rib_along_an_edge_its_length():
    def height(x):
        return 4e-3 + 20e-3 * x[:, 0]

    path = [(0.1, 0.05), (0.1, 0.25), (0.3, 0.25)]  # 0.4 m, with a corner
    plate = fi.Plate(ALUMINIUM, 2e-3)
    rib = fi.Rib(path, fi.Beam.rectangular(ALUMINIUM, width=3e-3, height=height))
    bare = fi.assemble(fi.mesh.rectangle(0.4, 0.3), plate)
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), plate, ribs=[rib])
    assert system.mass - bare.mass == pytest.approx(RHO * 3e-3 * 0.4 * (4e-3 + 20e-3 * 0.2), rel=1e-9)
    ring = fi.assemble(fi.mesh.disk(0.1), plate, ribs=[fi.Rib("outer", bar())])
    area = np.pi * 0.1**2 * 2e-3 + 3e-3 * 12e-3 * 2.0 * np.pi * 0.1
    assert ring.mass == pytest.approx(RHO * area, rel=1e-6)  # facets follow the circle to length**6
    assert system.rigid.shape[1] == ring.rigid.shape[1] == 3


def test_what_no_rib_can_be_is_refused_by_name():
    with pytest.raises(ValueError, match="path must have two points or more"):
        fi.Rib([(0.0, 0.0)], bar())
    with pytest.raises(ValueError, match="section must be"):
        fi.Rib([(0.0, 0.0), (1.0, 0.0)], fi.Plate(ALUMINIUM, 1e-3))
    with pytest.raises(ValueError, match="none of it lies on the body"):
        fi.assemble(
            fi.mesh.rectangle(0.4, 0.3), fi.Plate(ALUMINIUM, 2e-3), ribs=[fi.Rib([(1.0, 1.0), (2.0, 1.0)], bar())]
        )
    with pytest.raises(ValueError, match="path names edge 'rim'"):
        fi.assemble(fi.mesh.disk(0.1), fi.Plate(ALUMINIUM, 2e-3), ribs=[fi.Rib("rim", bar())])
    with pytest.raises(ValueError, match="section must not vary along a rib that follows an edge"):
        fi.Rib("outer", fi.Beam.rectangular(ALUMINIUM, width=1e-3, height=lambda x: 1e-3 + 0.0 * x[:, 0]))


@pytest.mark.parametrize("path", [[(0.2, 0.1), (0.2, 0.1 + 1e-6)], [(0.2, 0.0), (0.2, 0.3 - 1e-5)]])
def test_ribs_that_ask_for_tiny_triangles_are_refused(path):
    """A rib of a micrometre doubled the first frequency without a word, as K has lost its digits."""
    with pytest.raises(ValueError, match=r"path of a rib must lie on edges.* m beside 0.4 m; move its points"):
        fi.assemble(
            fi.mesh.rectangle(0.4, 0.3), fi.Plate(ALUMINIUM, 2e-3), {"boundary": "hinged"}, ribs=[fi.Rib(path, bar())]
        )


@pytest.mark.slow
def test_the_error_of_crossing_ribs_is_stated():
    """Ribs converge more slowly than smooth bodies; estimates are to be at least 0.3 of the error, here 0.7."""
    paths = [(0.0, 0.12), (0.4, 0.12)], [(0.17, 0.0), (0.17, 0.3)]
    system = fi.assemble(
        fi.mesh.rectangle(0.4, 0.3), fi.Plate(ALUMINIUM, 1e-3), {"boundary": "hinged"},
        ribs=[fi.Rib(list(path), bar(1e-3, 4e-3)) for path in paths],
    )  # fmt: skip
    found = fi.find_modes(system, n_modes=6, tolerance=1e-2)
    own = found.shapes.system
    finer = refinement.solve_on_mesh(assembly.reassemble(own, own.mesh.refined(3.0)), 6, None)
    assert (0.5 * np.abs(found.omega / finer.omega - 1.0) < found.frequency_error).all()
