"""Shells, ribs and layers held to elastic solids of three dimensions (`studies/verification/shell_references.py`)."""

import numpy as np
import pytest
import shell_references as solids

import fem_impact as fi
from fem_impact.fe import shallow


def assembled(body):
    if isinstance(body, solids.Cymbal):
        plate = fi.Plate(fi.Material(body.E, body.nu, body.rho), body.thickness)
        return fi.assemble(fi.mesh.disk(body.radius), plate, rise=lambda points: body.rise(np.hypot(*points.T)))
    if isinstance(body, solids.Ribbed):
        (a, b), material = body.sides, fi.Material(body.E, body.nu, body.rho)
        bar = fi.Beam.rectangular(material, width=body.rib[0], height=body.rib[1])
        curves = np.array([body.zxx, body.zyy])
        rise = (lambda points: 0.5 * (points - [a / 2.0, b / 2.0]) ** 2 @ curves) if curves.any() else None
        ribs = [fi.Rib([(0.0, body.rib_y), (a, body.rib_y)], bar), fi.Rib([(body.rib_x, 0.0), (body.rib_x, b)], bar)]
        return fi.assemble(fi.mesh.rectangle(a, b), fi.Plate(material, body.thickness), rise=rise, ribs=ribs)
    carbon = fi.Material.orthotropic(E_along=body.E1, E_across=body.E2, nu=body.nu12, G=body.G12, rho=body.rho)
    layers = [(carbon, body.layer, np.radians(angle)) for angle in reversed(body.angles)]  # theirs begin below
    return fi.assemble(fi.mesh.rectangle(*body.sides), fi.Plate.laminate(layers))


@pytest.mark.parametrize(
    "name, most",
    [  # where slopes are below 0.1, half a percent: the theories are thin and shallow, ribs are lines
        ("cap", 0.005), ("ribbed and domed", 0.005),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in (
            ("cymbal", 0.005), ("ribbed", 0.005), ("layered", 0.005), ("cymbal, steep cup", 0.01),
        )),
    ],
)  # fmt: skip
def test_solids_are_met_to_what_thin_and_shallow_theory_can(name, most):
    body = solids.BODIES[name]
    round_ = isinstance(body, solids.Cymbal)
    rows = [(mode, float(frequency)) for mode, frequency, *_ in solids.read()[name]]
    twice = [1 if not round_ or mode.startswith("(0") else 2 for mode, _ in rows]
    exact = np.sort(np.repeat([frequency for _, frequency in rows], twice))
    found = fi.find_modes(assembled(body), n_modes=len(exact) + 3, tolerance=3e-4)
    error = found.frequencies[3:] / exact - 1.0
    assert np.abs(error).max() < most
    if round_:  # steeper bodies are lower by some of the share that the plane has of their kinetic energy
        system, vectors = found.shapes.system, found.shapes.vectors[:, 3:]
        share = 0.5 * np.einsum("ij,ij->j", vectors, shallow.plane_mass(system, vectors))
        assert (error > 0.3 * share).all() and (error < 1.5 * share).all()
