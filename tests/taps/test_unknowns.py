"""Names, ranges and coordinates of unknowns."""

import numpy as np
import pytest
from comparing import refusing

import fem_impact as fi
from fem_impact.taps import unknowns
from fem_impact.taps.rig import Rig

HAMMER, LAW = fi.Striker.rigid(0.1), fi.Contact.hertz(1e7)


def setting(target=None, at=None, ranges=()):
    return unknowns.Setting(target, at, HAMMER, LAW, Rig(25600.0), ranges, None, 0, 0.2)


test_wrong_ranges_are_refused = refusing([
    ({}, "at least one range"), ({"contact.stifness": (1, 2)}, "did you mean 'contact.stiffness'"),
    ({"contact.stiffness": (2.0, 1.0)}, "must be a range"), ({"contact.stiffness": 3.0}, "must be a range"),
    ({"contact.stiffness": (0.0, 1.0)}, "must begin above zero"), ({"striker.mass": (-1.0, 1.0)}, "below zero"),
    ({"mode1.frequency": (1.0, 2.0)}, "mode1.mass too"), ({"striker.damping": (0.01, 0.1)}, "first_frequency too"),
    ({"mode2.frequency": (1.0, 2.0), "mode2.mass": (1.0, 2.0)}, "number its modes from 1"),
    ({"target.x": (0.0, 1.0)}, "unknown must be one of"),
], lambda ranges: unknowns.checked(ranges, None, HAMMER, LAW))  # fmt: skip


def test_coordinates_go_there_and_back():
    for each in (unknowns.Unknown("striker.mass", 0.01, 1.0), unknowns.Unknown("contact.loss", 0.0, 2.0)):
        for value in (each.low, 0.3, each.high):
            assert each.outside(each.inside(value)) == pytest.approx(value, rel=1e-12, abs=1e-12)
    assert each.floor and each.bounds == (0.0, 1.0)


def test_a_rigid_hammer_gets_a_mode_and_a_wall_gets_modes():
    hammer = setting().hammer({"striker.mass": 0.2, "striker.first_frequency": 2e3, "striker.mode_ratio": 4.0})
    assert hammer.rows[0].tolist() == pytest.approx([0.2**-0.5, 2.0 * 0.2**-0.5])
    assert not len(setting().structure({}).omega)
    body = setting().structure({"target.mass": 2.0, "mode1.frequency": 300.0, "mode1.mass": 0.5})
    assert body.omega.tolist() == pytest.approx([0.0, 600.0 * np.pi])


def test_a_strike_point_within_its_range_has_the_compliance_of_the_body():
    plate = fi.analytic.rectangle(0.5, 0.4, mass=1.5, first_frequency=90.0, n_modes=30)
    ranges = unknowns.Unknown("target.x", 0.15, 0.25), unknowns.Unknown("target.y", 0.1, 0.2)
    near = setting(plate, (0.2, 0.15), ranges)
    for x, y in ((0.16, 0.12), (0.2, 0.2), (0.25, 0.1)):
        body = near.structure({"target.x": x, "target.y": y})
        exact, whole = plate.residual_compliance((x, y))[0, 0], plate.shapes.compliance(np.array([[x, y]]))[0, 0]
        assert abs(body.rest[0, 0] - exact) < 2e-4 * whole  # polynomials of degree 4; 4e-5 measured
    with pytest.raises(ValueError, match="range of target"):
        setting(plate, (0.2, 0.15), (unknowns.Unknown("target.x", 0.2, 3.0),)).structure({"target.x": 0.3})
