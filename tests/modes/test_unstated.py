"""Modes from elsewhere: what nobody says of a body is estimated, told, and added once it is stated."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.modes import unstated

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
BAR = fi.Beam.rectangular(STEEL, width=0.03, height=0.01)
POINTS = np.linspace(0.0, 0.4, 41)[:, None]
BALL, LAW = fi.Striker.rigid(0.05), fi.Contact.linear(1e6)


def bar(n_modes, *, rigid=True, **stated):
    modes = fi.analytic.beam(0.4, ends=("free", "free"), section=BAR, n_modes=n_modes + 2)
    first = 0 if rigid else 2
    shapes = modes.shape_at(POINTS)[:, first:]
    if stated.get("compliance") is True:
        stated["compliance"] = modes.shapes.compliance(POINTS)
    return fi.Modes.from_arrays(modes.frequencies[first:], shapes, points=POINTS, mass=modes.mass, **stated)


def plate(n_modes, n=9, **stated):
    modes = fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(STEEL, 2e-3), n_modes=n_modes)
    x, y = np.meshgrid(np.linspace(0.0, 0.4, n), np.linspace(0.0, 0.3, n), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel()])
    return fi.Modes.from_arrays(modes.frequencies, modes.shape_at(points), points=points, mass=modes.mass, **stated)


def struck(modes, *, law=LAW, at=(0.1,), **options):
    return fi.strike(modes, BALL, law, at=at, speed=1.0, tolerance=1e-2, **options)


def test_missing_rigid_motions_are_never_met_in_silence():
    found = struck(bar(12, rigid=False))
    truth = struck(bar(12, compliance=True))
    assert not found.tolerance_met and found.error.truncation >= abs(found.restitution - truth.restitution)
    assert "not stated of the target: static compliance, whether it moves freely" in found.verdict
    assert any("no rigid motion is given" in note for note in found.notes)


def test_residual_false_or_complete_says_that_these_modes_are_all():
    assert "not stated" not in struck(bar(12, rigid=False), residual=False).verdict
    assert "not stated" not in struck(bar(12, rigid=False, complete=True)).verdict


def test_a_free_body_gets_the_rigid_motions_of_its_points():
    """Exact for a uniform body, as areas and lines are integrated exactly: 4 / mass at the end of a bar."""
    modes = bar(3, rigid=False, free=True)
    assert modes.n_rigid == 2
    assert_allclose((modes.shape_at([0.0])[0, :2] ** 2).sum() * modes.mass, 4.0, rtol=1e-9)
    x = np.array([(0.0, 0.0), (0.3, 0.0), (0.3, 0.2), (0.0, 0.2), (0.1, 0.05)])
    square = fi.Modes.from_arrays([100.0], [[1.0], [-1.0], [1.0], [-1.0], [0.3]], points=x, mass=0.5, free=True)
    assert_allclose((square.shape_at([(0.0, 0.0)])[0, :3] ** 2).sum() * 0.5, 7.0, rtol=1e-9)  # 1 + 3 + 3


def test_a_body_whose_modes_carry_its_mass_is_held():
    assert plate(12).unstated == ("compliance",)
    assert bar(12, rigid=False).unstated == ("compliance", "free")
    assert bar(12, rigid=False, free=False).unstated == ("compliance",)


def test_where_a_unit_load_is_known_nothing_is_estimated():
    """The bar's compliance at one of its 41 points is stated: there the blow is that of the whole of it."""
    whole = bar(12, compliance=True)
    modes = bar(12, compliance=whole.shapes.deflection(POINTS[[10]], POINTS), loads=[10])
    assert_allclose(modes.residual_compliance(POINTS[[10]]), whole.residual_compliance(POINTS[[10]]), rtol=1e-9)
    here, there = struck(modes, at=(0.1,)), struck(modes, at=(0.2,))
    assert here.restitution == struck(whole, at=(0.1,)).restitution and "not stated" not in here.verdict
    assert "not stated of the target: static compliance" in there.verdict
    for wrong in (41, 10.5):
        with pytest.raises(ValueError, match="loads must be different numbers of points from 0 to 40"):
            bar(12, compliance=whole.shapes.deflection(POINTS[[10]], POINTS), loads=[wrong])


def test_a_body_in_three_dimensions_may_be_a_bar_or_a_plate():
    """The interval holds both, so it holds each."""
    omega, rows = 2.0 * np.pi * np.arange(1.0, 11.0) * 100.0, np.full((1, 10), 1.3)
    both = unstated.estimate_left_out(omega, rows, 0.5, 3)
    for dimension in (1, 2):
        # the mean squared shape is one over the mass
        mean, error = unstated.estimate_left_out(omega, rows, 1.0 / 1.3**2, dimension)
        assert both[0] + both[1] >= 0.9 * mean and both[0] - both[1] <= mean + error


def test_two_contacts_on_an_estimated_body_count_what_is_between_them():
    modes = bar(12)
    one, both = (modes.shapes.compliance_error(np.array(at)) for at in ([[0.1]], [[0.1], [0.11]]))
    assert both[0] > one[0]
    touches = [fi.Touch(LAW, 0, 2, None, [0.1]), fi.Touch(LAW, 1, 2, None, [0.11])]
    hit = fi.collide([fi.Modes.rigid(0.05)] * 2 + [modes], touches, speeds=[1.0, 1.0, 0.0], tolerance=1e-2)
    assert "not stated of body 2: static compliance" in hit.verdict


def test_a_map_counts_what_is_not_stated():
    how = {"over": {"mass": [0.02, 0.05]}, "at": [0.1], "speed": 1.0, "tolerance": 1e-2}
    loose, free = (fi.sweep(bar(12, rigid=rigid), BALL, LAW, **how) for rigid in (False, True))
    assert not loose.tolerance_met.any() and (loose.truncation > 0.05).all()
    assert free.tolerance_met.all() and free.truncation.min() > 0.0


def test_a_scaled_body_is_as_little_known():
    modes = bar(12, rigid=False)
    heavier = modes.scaled(mass=2.0 * modes.mass)
    assert heavier.unstated == modes.unstated
    assert_allclose(heavier.shapes.loose(POINTS), 2.0**-0.5 * modes.shapes.loose(POINTS))


def test_what_is_stated_as_advised_meets_the_tolerance():
    found = struck(bar(12, rigid=False))
    assert "make the target with free = True or False, as it is; give the compliance of the target" in found.verdict
    assert struck(bar(12, rigid=False, free=True, compliance=True)).tolerance_met
    hard = struck(bar(8), law=fi.Contact.linear(1e8))
    assert "give the compliance of the target" in hard.verdict and "with free" not in hard.verdict
    assert struck(bar(40, compliance=True), law=fi.Contact.linear(1e8)).tolerance_met


def test_what_contradicts_itself_works_as_advised():
    with pytest.raises(ValueError, match=r"free must be False: .* carries 6\d% of the mass along"):
        plate(12, free=True)
    assert plate(12).n_rigid == 0
    line = [[0.0, 0.0], [0.1, 0.1]]
    with pytest.raises(ValueError, match="free needs points that span the body"):
        fi.Modes.from_arrays([9.0], [[1.0], [-1.0]], points=line, mass=1.0, free=True)
    assert fi.Modes.from_arrays([0.0, 9.0], [[1.0, 1.0], [1.0, -1.0]], points=line, mass=1.0).n_rigid == 1
    with pytest.raises(ValueError, match="complete must be False"):
        bar(12, compliance=True, complete=True)
    assert not bar(12, compliance=True).unstated


def test_a_universal_file_loses_the_compliance_and_says_so(tmp_path, read_here):
    pytest.importorskip("pyuff", reason="the uff extra is not installed")
    modes = fi.analytic.beam(0.4, ends=("free", "free"), section=BAR, n_modes=14)
    fi.export.write_uff(tmp_path / "bar.uff", modes)
    again = fi.Modes.from_uff(tmp_path / "bar.uff", mass=modes.mass)
    assert "not stated of the target: static compliance" in struck(again).verdict
    points = again.shapes.grid()[0]
    known = fi.Modes.from_uff(tmp_path / "bar.uff", mass=modes.mass, compliance=modes.shapes.compliance(points))
    assert "not stated" not in struck(known).verdict


@pytest.mark.parametrize(("scale", "told"), [(1.0, False), (0.03, True), (31.6, True)])
def test_shapes_that_do_not_fit_the_mass_are_told(scale, told):
    made = bar(8)
    other = fi.Modes.from_arrays(made.frequencies, scale * made.shape_at(POINTS), points=POINTS, mass=made.mass)
    assert any("are expected mass-normalised" in note for note in other.notes) == told


def weighted(**stated):
    """A free bar of 0.94 kg with 2 kg at its end, by twelve of its modes at 41 points, and the whole of it."""
    system = fi.assemble(fi.mesh.line(0.4), BAR, point_masses=[((0.4,), 2.0)])
    whole = fi.find_modes(system, n_modes=14)
    shapes = whole.shape_at(POINTS)
    values = {"compliance": whole.shapes.compliance(POINTS)} | stated
    first = values.pop("first", 2)
    return fi.Modes.from_arrays(
        whole.frequencies[first:], shapes[:, first:], points=POINTS, mass=whole.mass, **values
    ), whole


def test_a_free_body_that_is_not_uniform_is_not_taken_as_held():
    """A free bar with a mass at its end swings as if it were held there."""
    modes, whole = weighted()
    truth = struck(whole).restitution
    assert abs(struck(modes, residual=False).restitution - truth) > 0.1  # what was said without a word
    found = struck(modes)
    assert "whether it moves freely" in found.verdict and abs(found.restitution - truth) <= found.error.total


def test_rigid_motions_of_a_body_that_is_not_uniform_count_as_an_error():
    modes, whole = weighted(free=True)
    found, truth = struck(modes), struck(whole).restitution
    assert modes.n_rigid == 2 and abs(found.restitution - truth) > 0.05
    assert "moments of inertia" in found.verdict and abs(found.restitution - truth) <= found.error.measurement
    assert "give the rigid motions of the target as modes of 0 Hz" in found.verdict
    assert struck(weighted(first=0)[0]).tolerance_met
    assert bar(12, rigid=False, free=True).unstated == ("compliance",)


def test_few_points_do_not_show_that_a_body_is_held():
    """At five places on one side of a free disk two of its modes move all alike."""
    disk = fi.analytic.disk(0.2, edge="free", mass=1.0, first_frequency=100.0, n_modes=12)
    x = 0.2 * np.array([(0.9, 0.1), (0.95, -0.1), (0.8, 0.0), (0.85, 0.2), (0.9, -0.25)])
    made = fi.Modes.from_arrays(disk.frequencies[3:], disk.shape_at(x)[:, 3:], points=x, mass=1.0)
    assert "free" in made.unstated


def test_a_shift_without_the_turns_of_a_free_body_has_a_note_until_these_are_given_or_it_is_held():
    """A bar that slides without turning rebounds its striker by half as much again at one end, with no error told."""
    made = bar(12)
    kept = [0, *range(2, made.n_modes)]
    shapes, told = made.shape_at(POINTS), []
    for which, stated in ((kept, {}), (range(made.n_modes), {}), (kept, {"free": False})):
        given = {"points": POINTS, "mass": made.mass} | stated
        other = fi.Modes.from_arrays(made.frequencies[which], shapes[:, which], **given)
        told.append([note for note in other.notes if "as modes of 0 Hz, or free = False" in note])
    assert len(told[0]) == 1 and "are 1 of the 2 of a body that nothing holds" in told[0][0] and not told[1] + told[2]


@pytest.mark.parametrize(("scale", "mass", "told"), [(1.0, 1.0, False), (3.0, 1.0, True), (1.0, 8.0, True)])
def test_rigid_motions_that_do_not_move_the_mass_are_told(scale, mass, told):
    made = bar(8)
    shapes = scale * made.shape_at(POINTS)
    other = fi.Modes.from_arrays(made.frequencies, shapes, points=POINTS, mass=mass * made.mass)
    moved = f"the rigid motions shift {made.mass / scale**2:.4g} kg by their shapes, but the mass is"
    assert any(moved in note for note in other.notes) == told
    hinged = fi.analytic.beam(0.4, ends=("hinged", "free"), section=BAR, n_modes=6)  # a turn alone, seen at one place
    there = hinged.shape_at([[0.4]]) * np.ones((2, 1))
    odd = fi.Modes.from_arrays(hinged.frequencies, there, points=[[0.0, 0.4], [0.1, 0.4]], mass=hinged.mass)
    assert not any("rigid motions shift" in note for note in odd.notes)
