"""The dent of unit loads on solid meshes: counted once if the solid is stated, an error if not, and never silent."""

import dents_of_solids as solids
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipe, ellipk, j0

import fem_impact as fi
from fem_impact.modes import dents

E, NU = solids.STEEL.E, solids.STEEL.nu


def half_space(spacing=1e-3, patch=0.4e-3, slope=2e-7):
    """Points on a half space, and its deflection [m/N] under a unit load, plus a plane."""
    x, y = np.meshgrid(*2 * [np.arange(-8, 9) * spacing], indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel()])
    r = np.maximum(np.linalg.norm(points, axis=1), patch)
    return points, (1.0 - NU**2) / (np.pi * E * r) + 3e-9 + slope * points[:, 0]


def known(points, column, **more):
    """A body with one mode and one unit load, at the middle."""
    middle = len(points) // 2
    told = {"points": points, "mass": 1.0, "compliance": column[:, None], "loads": [middle]} | more
    return fi.Modes.from_arrays([900.0], np.full((len(points), 1), 0.1), **told), points[[middle]]


@pytest.mark.parametrize("patch", [0.9e-3, 0.1e-3])
def test_what_is_left_of_a_half_space_is_nothing(patch):
    """However large the load's patch is: 3e-9 m/N was added, a plane and rounding do not count."""
    points, column = half_space(patch=patch)
    modes, at = known(points, column, solid=solids.STEEL)
    assert_allclose(modes.shapes.compliance(at), 3e-9, rtol=1e-6)
    assert modes.shapes.compliance_error(at)[0] < 1e-4  # rounding of files in single precision, 1e-6 of the dent
    assert "dent of a half space was taken out of 1 of 1 unit loads" in modes.notes[-1]
    turned = np.column_stack([points[:, 0], 0.6 * points[:, 1], 0.8 * points[:, 1]])
    assert_allclose(known(turned, column, solid=(E, NU))[0].shapes.dents, modes.shapes.dents, rtol=1e-9)


def test_a_dent_that_nobody_stated_is_an_error():
    points, column = half_space()
    modes, at = known(points, column)
    dent = column[len(points) // 2] - 3e-9
    assert_allclose(modes.shapes.compliance(at), dent + 3e-9)
    assert modes.shapes.dent(at)[0, 1] > dent and "dent" in modes.unstated
    assert "1 of 1 unit loads dent the mesh as they would a solid" in modes.notes[-1]
    shell, _ = known(points, column, solid=False)
    assert not shell.shapes.dent(at).any() and not any("dent" in note for note in shell.notes)


def slab(spacing, rows, spread):
    """Nodes on a solid square on shear diaphragms, 1 m wide and 5 cm thick, around a load some rows off its edge.

    The load is a Gaussian of ``spread`` times the spacing. Also its deflection [m/N], its node, and the dent of a half
    space under it, by Navier's series of elastic waves.
    """
    steps, at, thick = np.arange(-8, 9) * spacing, np.array([0.45, rows * spacing]), 0.05
    points = np.stack(np.meshgrid(steps, steps[steps > -(rows + 0.5) * spacing], indexing="ij"), axis=-1)
    points = at + points.reshape(-1, 2)
    k = np.pi * np.arange(1, int(5.0 / (np.pi * spread * spacing)))
    size = np.hypot(k[:, None], k)
    q, e = 2.0 * size * thick, np.exp(-2.0 * size * thick)
    yields = 2.0 * (1.0 - NU**2) / (E * size) * (1.0 - e**2 + 2.0 * q * e) / ((1.0 - e) ** 2 - q**2 * e)
    weight = (
        4.0 * yields * np.exp(-0.5 * (size * spread * spacing) ** 2) * np.outer(np.sin(k * at[0]), np.sin(k * at[1]))
    )
    x, y = (np.sin(np.outer(points[:, i], k)) for i in range(2))
    dent = (1.0 - NU**2) / (np.pi * E) * (0.5 * np.pi) ** 0.5 / (spread * spacing)
    return points, ((x @ weight) * y).sum(axis=1), int(np.linalg.norm(points - at, axis=1).argmin()), dent


@pytest.mark.parametrize(("size", "rows"), [(0.4, 1), (0.33, 1), (0.33, 2), (0.5, 2), (0.5, 9)])
def test_beside_an_edge_the_error_of_what_is_left_covers_it(size, rows):
    """Nodes ``size`` thicknesses apart, an edge one or two rows away: all fits err alike, once 1.8 times more."""
    points, column, at, dent = slab(size * 0.05, rows, 0.1)
    shapes, told = np.full((len(points), 1), 0.1), {"mass": 1.0, "compliance": column[:, None], "loads": [at]}
    modes = fi.Modes.from_arrays([900.0], shapes, points=points, solid=(E, NU), **told)
    assert abs(modes.shapes.static[at, 0] - (column[at] - dent)) < modes.shapes.dents[at, 1]


@pytest.mark.parametrize(("size", "rows"), [(0.25, 9), (0.4, 3), (0.5, 3), (0.5, 9), (0.7, 9)])
def test_a_slab_of_few_elements_over_its_thickness_is_no_membrane(size, rows):
    """From 0.4 thicknesses on, ``log r`` fits better than ``1 / r``, of membranes and thick shells far better."""
    points, column, at, dent = slab(size * 0.05, rows, 0.3)
    found = dents.hidden_dent(dents.of_points(points, column[:, None], np.array([at]))[0].on_surface())
    assert dent < found < 1.7 * dent


def test_plates_and_beams_have_no_dent():
    """At any of their points, near edges too: closed forms."""
    x, y = np.meshgrid(np.linspace(0.0, 0.4, 15), np.linspace(0.0, 0.3, 12), indexing="ij")
    plate = fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(solids.STEEL, 2e-3), n_modes=8)
    beam = fi.Beam.rectangular(solids.STEEL, width=0.03, height=0.01)
    bar = fi.analytic.beam(0.4, ends=("clamped", "free"), section=beam, n_modes=8)
    for modes, points in ((plate, np.column_stack([x.ravel(), y.ravel()])), (bar, np.linspace(0.0, 0.4, 41)[:, None])):
        loads = dents.of_points(points, modes.shapes.compliance(points), np.arange(len(points)))
        assert all(dents.hidden_dent(each.on_surface()) == 0.0 for each in loads)


def test_where_nothing_tells_the_dent_all_is_an_error():
    """A load on a slant, and one among too few nodes."""
    body = solids.known("bar", 0, solids.STEEL)
    for n, normals in ((len(body.nodes), np.tile([0.6, 0.0, 0.8], (len(body.nodes), 1))), (9, None)):
        told = {"static": body.static[:n], "loads": body.loads, "solid": solids.STEEL, "normals": normals}
        each = fi.Body(body.frequencies, body.shapes[:n], body.nodes[:n], body.mass, **told)
        hit = solids.struck(each.modes("z"), each.at(1))
        assert "around 1 of 1 unit loads too few nodes" in hit.summary()
        assert not hit.tolerance_met and hit.error.total > 0.1


def test_a_wrong_modulus_is_an_error():
    """Ten times too stiff: nine tenths of the dent stay, and the fits disagree."""
    right, wrong = (solids.of_solid("block", 2, (stiff * E, NU)) for stiff in (1.0, 10.0))
    assert right.tolerance_met and not wrong.tolerance_met
    assert solids.apart(wrong, right) < wrong.error.total


def spread(r, patch):
    """Deflection [m/N] of a half space under a uniform pressure on a disk; Johnson, equation 3.29."""
    inside, k = r <= patch, patch / np.maximum(r, patch * (1.0 + 1e-9))
    ways = 2.0 * ellipe(np.minimum(r / patch, 1.0) ** 2), 2.0 * (ellipe(k**2) - (1.0 - k**2) * ellipk(k**2)) / k
    ways = ways[0], np.where(inside, 0.0, ways[1])
    return 2.0 * (1.0 - NU**2) / (np.pi**2 * patch * E) * np.where(inside, *ways)


@pytest.mark.parametrize("thick", [6.25e-3, 2.5e-3, 1.8e-3])
def test_where_elements_are_nearly_as_large_as_the_body_is_thick_the_error_says_so(thick):
    """A layer of nodes 1 mm apart that slides on a rigid floor: its deflection is that of a half space and a rest.

    By Hankel's transform; all fits err to one side, by up to 1.5 times what they differ.
    """
    q = np.linspace(1e-6, 40.0, 20001)
    lacks = 1.0 - (np.cosh(2.0 * q) - 1.0) / (np.sinh(2.0 * q) + 2.0 * q)
    points, _ = half_space()
    r = np.linalg.norm(points, axis=1)
    scale = (1.0 - NU**2) / (np.pi * E)
    rest = -scale / thick * np.array([np.trapezoid(lacks * j0(q * x / thick), q) for x in r])
    modes, _ = known(points, scale / np.maximum(r, 0.4e-3) + rest, solid=(E, NU))
    left, error = modes.shapes.static[len(r) // 2, 0], modes.shapes.dents[len(r) // 2, 1]
    assert abs(left - rest[len(r) // 2]) < error < 0.4 * abs(rest[len(r) // 2])


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize("patch", [0.5e-3, 1.2e-3, 4.2e-3])
def test_a_dent_in_solid_elements_is_an_error_where_deflections_hide_it(patch, beside):
    """Loads spread over up to four elements, and at the side of a flat cloud of points, by elements alone."""
    points, _ = half_space()
    at = len(points) // 2
    column = spread(np.linalg.norm(points - points[at], axis=1), patch) + 3e-9 + 2e-7 * points[:, 0]
    if beside:
        kept = points[:, 0] >= -1e-3
        points, column, at = points[kept], column[kept], int(np.count_nonzero(kept[:at]))
    told = {"points": points, "mass": 1.0, "compliance": column[:, None], "loads": [at]}
    shapes = np.full((len(points), 1), 0.1)
    modes, blind = (fi.Modes.from_arrays([900.0], shapes, solid=each, **told) for each in (True, None))
    dent = column[at] - 3e-9 - 2e-7 * points[at, 0]
    assert dent <= modes.shapes.dent(points[[at]])[0, 1] <= column[at] and "dent" in modes.unstated
    assert "1 of 1 unit loads dent the mesh, whose elements are solid" in modes.notes[-1]
    seen = bool(blind.shapes.dent(points[[at]])[0, 1] > 0.0)
    assert seen is (patch != 1.2e-3 and not beside)  # without it, not all are seen


def test_a_solid_of_unknown_material_counts_the_dent_that_it_has():
    """On three meshes each; on the coarsest twice as much, as the bar is not wide enough for the farthest fit."""
    for name in solids.BRICKS:
        for mesh in range(3):
            dents_of = [solids.known(name, mesh, each).modes("z").shapes.dents[0] for each in (solids.STEEL, True)]
            assert 0.98 * dents_of[0][0] <= dents_of[1][1] <= 2.2 * dents_of[0][0]


WOOD = fi.Material.orthotropic(E_along=11e9, E_across=0.85e9, nu=0.37, G=0.7e9, rho=450.0)


@pytest.mark.parametrize("solid", ["steel", (E,), (E, 0.7), (-E, NU), 1.0, WOOD])
def test_what_is_no_solid_is_refused(solid):
    with pytest.raises(ValueError, match="solid must be an isotropic material" if solid is WOOD else "solid must"):
        known(*half_space(), solid=solid)


def test_the_solid_is_kept_in_files(tmp_path):
    body = solids.known("bar", 0, solids.STEEL)
    for solid in (solids.STEEL, True, False, None):
        path = fi.Body.load(body.save(tmp_path / "bar"), solid=solid).save(tmp_path / "again")
        assert fi.Body.load(path).solid == dents.stated_material(solid) or solid is None  # None: as the file says


@pytest.mark.slow
def test_maps_count_what_a_blow_counts():
    """Of a dent taken out, and of one that nobody stated."""
    law, over = fi.Contact.between(solids.BALL, solids.STEEL), {"speed": [0.05, solids.SPEED]}
    for solid in (solids.STEEL, None):
        body = solids.known("bar", 0, solid)
        modes, at = body.modes("z"), body.at(1)
        hit, table = solids.struck(modes, at), fi.sweep(modes, solids.BALL, law, over=over, at=at, speed=0.1)
        assert_allclose(table.restitution[1], hit.restitution, atol=1e-4)
        assert_allclose(table.truncation[1], hit.error.total, rtol=0.02)


def test_fewer_modes_hold_less_of_the_dent():
    """What modes of short waves yield more than the rest is an error, and none if they are left out."""
    body = solids.known("bar", 2, solids.STEEL)
    modes, at = body.modes("z"), body.at(1)
    few = modes.truncated(n_modes=16)
    assert few.residual_compliance(at)[0, 0] > 0.0 == modes.residual_compliance(at)[0, 0]
    many, less = solids.struck(modes, at), solids.struck(few, at)
    assert many.bodies[1].shapes.dent(np.array([at]))[0, 0] > 0.0
    assert solids.apart(many, less) < many.error.total + less.error.total
