"""Maps of plates by elements, told by Ritz vectors: against closed forms and single blows, and when modes serve."""

import numpy as np
import pytest
from comparing import QUANTITIES, refusing
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact._base import identity
from fem_impact.model.planner import Blow
from fem_impact.model.target import Target
from fem_impact.sweeps import bodies

WOOD = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
AT = (0.2, 0.11)
BALL = fi.Striker.rigid(0.03)


def plate(**more):
    return fi.assemble(fi.mesh.rectangle(0.465, 0.3), WOOD, {"boundary": "hinged"}, **more)


def closed(n_modes=1500):
    body = plate()
    return fi.analytic.closed_form(body.mesh, WOOD, {"boundary": "hinged"})(n_modes=n_modes)


def apart(table, truth):
    """Error of each cell; 1 where the number of impacts differs."""
    relative = [np.abs(table[name] / truth[name] - 1.0).values for name in QUANTITIES]
    found = np.max([np.abs(table.restitution - truth.restitution).values, *relative], axis=0)
    return np.where((table.n_impacts == truth.n_impacts).values, found, 1.0)


@pytest.mark.parametrize(
    ("law", "soft", "hard", "tolerance"),
    [
        (fi.Contact.hertz(1e6), 1e5, 1e7, 1e-2),
        pytest.param(fi.Contact.linear(1e5), 1e4, 1e6, 1e-2, marks=pytest.mark.slow),
        pytest.param(fi.Contact.hertz(1e6), 1e5, 1e8, 1e-3, marks=pytest.mark.slow),
    ],
)
def test_a_map_of_elements_is_that_of_the_closed_form(law, soft, hard, tolerance):
    over = {"stiffness": np.geomspace(soft, hard, 8), "mass": np.geomspace(3e-3, 0.06, 8)}
    table = fi.sweep(plate(), BALL, law, at=AT, speed=1.0, over=over, tolerance=tolerance)
    truth = fi.sweep(closed(), BALL, law, at=AT, speed=1.0, over=over, tolerance=tolerance / 20.0)
    found, met = apart(table, truth), table.tolerance_met.values
    # one cell in 64 may hold a touch of 1e-5 of the impulse, which decides the number of impacts
    assert (found > (table.error + table.truncation).values).sum() <= 1
    assert (found[met] > tolerance).sum() <= 1 and met.mean() > 0.5  # blows of several impacts may miss, and say so
    assert (table.truncation > 0.0).all()


@pytest.mark.slow
def test_cells_at_several_points_are_single_blows_there():
    over = {"mass": [5e-3, 0.03], "at": [(0.2, 0.11), (0.1, 0.2), (0.33, 0.08)]}
    law, how = fi.Contact.hertz(3e6), {"speed": 1.0, "tolerance": 1e-2, "damping_ratio": 0.01}
    table = fi.sweep(plate(), BALL, law, at=AT, over=over, **how)
    for mass, i in ((5e-3, 0), (0.03, 1), (5e-3, 2)):
        hit = fi.strike(plate(), fi.Striker.rigid(mass), law, at=over["at"][i], **how)
        cell = table.sel(mass=mass).isel(at=i)
        assert int(cell.n_impacts) == hit.n_impacts
        assert float(cell.restitution) == pytest.approx(hit.restitution, abs=2e-2)  # 1e-2 each
        assert float(cell.peak_force) == pytest.approx(hit.peak_force, rel=2e-2)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("target_mass", [0.05, 0.3]),
        pytest.param("target_frequency", [80.0, 200.0], marks=pytest.mark.slow),
        pytest.param("damping_ratio", [0.0, 0.05], marks=pytest.mark.slow),
        ("loss", [0.0, 0.3]),
    ],
)
def test_axes_of_body_and_contact_are_those_of_the_closed_form(name, values):
    shared = {"at": AT, "speed": 1.0, "over": {name: values}}
    table = fi.sweep(plate(), BALL, fi.Contact.hertz(2e6), tolerance=1e-2, **shared)
    truth = fi.sweep(closed(600), BALL, fi.Contact.hertz(2e6), tolerance=1e-3, **shared)
    assert apart(table, truth).max() < 1e-2 and table.tolerance_met.all()


def test_what_vectors_cannot_tell_is_told_by_modes():
    section = fi.Beam.rectangular(WOOD.material, width=0.02, height=0.01)
    beam = fi.assemble(fi.mesh.line(0.4), section, {"left": "clamped"})
    blow = {"at": 0.3, "speed": 1.0, "over": {"mass": [5e-3, 0.02]}, "tolerance": 1e-2}
    table = fi.sweep(beam, BALL, fi.Contact.linear(1e4), **blow)
    modes = fi.sweep(fi.find_modes(beam, n_modes=60), BALL, fi.Contact.linear(1e4), **blow)
    assert apart(table, modes).max() < 1e-2
    alone = {"speed": 1.0, "over": {"mass": [0.03]}}
    resting = fi.sweep(plate(), BALL, fi.Contact.hertz(1e6), at=(0.0, 0.1), **alone)
    assert float(resting.restitution[0]) == pytest.approx(1.0, abs=1e-6)  # as a wall
    far = {"far": lambda hit: float(hit.displacement([(0.1, 0.1)], [1e-3], residual=False)[0, 0])}
    layered = fi.sweep(plate(), BALL, fi.Contact.hertz(1e5), at=AT, tolerance=1e-2, layers=far, **alone)
    assert abs(float(layered.far[0])) > 1e-6  # of a body that is known everywhere


test_points_off_the_body_and_wrong_axes_are_told_before_the_work = refusing([
    ((9.0, 9.0), {"mass": [0.1]}, "at must lie on the body, got"),
    (AT, {"at": [(9.0, 9.0)]}, r"over\['at'\] must lie on the body"),
    (AT, {"weight": [0.1]}, "over"),
], lambda at, over: fi.sweep(plate(), BALL, fi.Contact.hertz(1e6), at=at, over=over, speed=1.0))  # fmt: skip


@pytest.mark.slow
def test_kept_vectors_serve_the_same_map_only(tmp_path, monkeypatch):
    store, keep = tmp_path / "map", tmp_path / "map.modes.npz"

    def found(mass=0.03):
        over = {"mass": [0.01, mass], "at": [AT, (0.1, 0.2)]}
        blow = Blow(Target.of(plate()), BALL, fi.Contact.hertz(1e6), {"at": AT, "speed": 1.0})
        return bodies.body_of(blow, over, tolerance=1e-2, store=store)[0]

    first, again = found(), found()
    assert keep.stat().st_size < 1e6  # only what the strike points show
    for place, modes in first.views.items():
        kept = again.views[place]
        for one, other in ((modes, kept), *zip(modes.poorer.values(), kept.poorer.values())):
            assert_allclose(one.omega, other.omega, rtol=0.0)
            assert_allclose(one.shape_at([place]), other.shape_at([place]), rtol=0.0)
    assert list(modes.poorer) == ["mesh", "truncation"]
    before = keep.read_bytes()
    found(mass=0.02)
    assert keep.read_bytes() != before
    keep.write_bytes(before[:100])
    assert_allclose(found().modes.omega, first.modes.omega, rtol=1e-9)
    monkeypatch.setattr(identity, "program", lambda: "another version")
    before = keep.read_bytes()
    found()
    assert keep.read_bytes() != before
