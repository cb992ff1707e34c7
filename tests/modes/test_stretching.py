"""Stretching of bent bodies: closed forms, Airy's function, beams between walls, elements against formulas."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.modes.stretching import stretch

E, NU, RHO, H = 210e9, 0.3, 7850.0, 1e-3
STEEL = fi.Material(E=E, nu=NU, rho=RHO)
PLATE = fi.Plate(STEEL, H)


def energy(modes, q):
    """V = 1/4 sum (q' B q)**2."""
    return 0.25 * sum(float(q @ form @ q) ** 2 for form in stretch(modes).forms)


def softness(modes, at):
    """Coordinates of the flexible modes in the static dent under a force of 1 N."""
    soft = np.divide(1.0, modes.omega**2, out=np.zeros(modes.n_modes), where=modes.omega > 0.0)
    return modes.shape_at([at])[0] * soft


def dent(modes, at):
    """The energy in the static dent under a force of 1 N; signs and turns of equal modes do not matter."""
    return energy(modes, softness(modes, at))


def test_modes_remember_how_they_stretch():
    modes = fi.analytic.rectangle(0.3, 0.2, section=PLATE, n_modes=4)
    assert stretch(modes) is stretch(modes) is not stretch(modes.truncated(n_modes=3))


def test_energy_of_a_hinged_square_is_that_of_chu_and_herrmann():
    # 1.316 / 1.5 of Berger's E h / (8 A (1 - nu**2)) (int |grad w|**2)**2, and 0.5 % more as no edge slides
    side, a = 0.2, 0.7e-3
    modes = fi.analytic.rectangle(side, side, section=PLATE, n_modes=1)
    q = np.array([a / modes.shape_at([(side / 2, side / 2)])[0, 0]])
    berger = E * H / (8.0 * side**2 * (1.0 - NU**2)) * (a**2 * np.pi**2 / 2.0) ** 2
    assert energy(modes, q) == pytest.approx(1.316 / 1.5 * berger, rel=6e-3)


def radial(modes):
    """Energy of stretching of the first mode of a held disk of 0.2 m, by the equation of its radial motion.

    ``(r u')' - u / r = -r w' w'' - (1 - nu) / 2 w'**2`` with u = 0 in the middle and at the edge (Timoshenko and
    Woinowsky-Krieger, art. 96), by polynomials.
    """
    radius, n = 0.2, 24
    grow = np.arange(n + 1)

    def powers(r):
        """Powers of r / radius, and their slopes."""
        power = np.vander(r / radius, n + 1, increasing=True)
        return power, np.hstack([np.zeros((len(r), 1)), power[:, :-1] * grow[1:]]) / radius

    r = 0.5 * radius * (1.0 - np.cos(np.pi * grow / n))
    power, rise = powers(r)
    bend = np.hstack([np.zeros((n + 1, 2)), power[:, :-2] * (grow[2:] * (grow[2:] - 1))]) / radius**2
    shape = np.linalg.solve(power, modes.shape_at(np.column_stack([r, 0.0 * r]))[:, 0])
    w1, w2 = rise @ shape, bend @ shape
    rows, right = r[:, None] ** 2 * bend + r[:, None] * rise - power, -(r**2) * w1 * w2 - 0.5 * (1.0 - NU) * r * w1**2
    rows[[0, -1]], right[[0, -1]] = power[[0, -1]], 0.0
    u = np.linalg.solve(rows, right)
    x, weight = np.polynomial.legendre.leggauss(40)
    r = 0.5 * radius * (x + 1.0)
    power, rise = powers(r)
    out, around = rise @ u + 0.5 * (rise @ shape) ** 2, power @ u / r
    density = E * H / (1.0 - NU**2) * (out**2 + around**2 + 2.0 * NU * out * around)
    return float(0.5 * np.pi * radius * (weight * r) @ density)


@pytest.mark.parametrize("edge", ["clamped", "hinged"])
def test_the_first_mode_of_a_disk_stretches_as_its_radial_equation_says(edge):
    modes = fi.analytic.disk(0.2, edge=edge, section=PLATE, n_modes=1)
    assert energy(modes, np.ones(1)) == pytest.approx(radial(modes), rel=1e-4)  # of the triangles


def cubic(modes, mode):
    """Force of a mode over its cube, as Airy's function gives it of unit norm: over E / rho and mass per area."""
    return float((stretch(modes).forms[:, mode, mode] ** 2).sum()) * RHO**2 * H / E


# free disks: Poisson's ratio -> modes (2, 0), (0, 1), (3, 0) (Touze, Thomas and Chaigne 2002; spectra of VK-Gong)
DISKS = {
    0.38: [1.898356, 8.574675, 17.03105],
    0.33: [1.896553, 8.528755, 16.93346],
    0.3: [1.895421, 8.501230, 16.87594],
}


@pytest.mark.parametrize("nu", list(DISKS))
def test_a_free_disk_has_the_cubic_coefficients_of_airys_function(nu):
    section = fi.Plate(fi.Material(E=E, nu=nu, rho=RHO), H)
    modes = fi.analytic.disk(1.0, edge="free", section=section, n_modes=8)
    assert [cubic(modes, mode) for mode in (3, 5, 6)] == pytest.approx(DISKS[nu], rel=1e-5)  # of the triangles
    tilted = np.array([3.0, 1.0, -2.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    assert energy(modes, tilted) == energy(modes, np.eye(8)[5])  # the plane follows a disk that tilts


def panel(radius, n_modes=1, in_plane="sliding", sides=(0.3, 0.2), size=0.05):
    """A paraboloid on hinged edges."""
    middle = 0.5 * np.array(sides)
    system = fi.assemble(
        fi.mesh.rectangle(*sides, size=size), PLATE, {"boundary": "hinged"}, in_plane={"boundary": in_plane},
        rise=lambda x: -((x - middle) ** 2).sum(axis=1) / (2.0 * radius),
    )  # fmt: skip
    return fi.find_modes(system, n_modes=n_modes)


def energies(modes, q):
    """Quadratic, cubic and quartic energy of stretching."""
    found = stretch(modes)
    lead = found.linear @ q if len(found.linear) else np.zeros(len(found.forms))
    bent = np.einsum("kij,i,j->k", found.forms, q, q)
    return 0.25 * lead @ lead, 0.5 * lead @ bent, 0.25 * bent @ bent


@pytest.mark.parametrize(
    "n_modes, radius, size, rel",  # of the triangles, and of fields left out
    [
        (1, 2.0, 0.05, 2e-5),
        (4, -2.0, 0.05, 2e-5),
        pytest.param(24, 2.0, 0.05, 1e-3, marks=pytest.mark.slow),
        pytest.param(1, -1.5, 0.03, 2e-6, marks=pytest.mark.slow),
    ],
)
def test_a_spherical_panel_on_shear_diaphragms_is_that_of_its_closed_form(n_modes, radius, size, rel):
    """Airy's function of w = a sin sin is -E h w / (R k**2): its stresses stretch by E / (rho R**2), and work on w'**2.

    The blow's deflection is away from the striker, into the dome, which it shortens first, or out of the bowl. Of the
    fourth order Airy's function is a series of sines over E h a**2 kx**2 ky**2 (cos 2 kx x + cos 2 ky y) / 2.
    """
    sides = 0.3, 0.2
    modes = panel(radius, n_modes, size=size)
    middle = modes.shape_at([(0.15, 0.1)])[0]
    wave = np.pi / np.array(sides)
    top = 2.0 / np.sqrt(RHO * H * sides[0] * sides[1])
    assert abs(middle[0]) == pytest.approx(top, rel=2e-5)
    q = np.eye(n_modes)[0] * np.sign(middle[0])
    square, cube, fourth = energies(modes, q)
    assert square == pytest.approx(0.5 * E / (RHO * radius**2), rel=rel)
    assert cube == pytest.approx(-4.0 / 3.0 * E * H * wave.prod() * top**3 / (radius * (wave @ wave)), rel=rel)
    m, n = np.meshgrid(*2 * [np.arange(1.0, 200.0, 2.0)])
    series = 8.0 / np.pi**2 * (m / (m**2 - 4.0) / n + n / (n**2 - 4.0) / m) / ((m * wave[0]) ** 2 + (n * wave[1]) ** 2)
    wanted = E * H * top**4 * wave.prod() ** 4 * sides[0] * sides[1] / 8.0 * np.square(series).sum()
    assert fourth == pytest.approx(wanted, rel=rel if size < 0.05 else max(rel, 1e-4))


@pytest.mark.parametrize("supports", [{}, {"left": "clamped"}])
def test_where_a_layer_weighs_and_bears_nothing_the_plate_is_as_without_it(supports):
    """Only the plane that its displacements count in lies elsewhere, which no edge holds."""
    ghost = fi.Material(E=1e-3, nu=NU, rho=1e-6)
    sections = PLATE, fi.Plate.laminate([(ghost, 2e-3, 0.0), (STEEL, H, 0.0)])
    shape, found = fi.mesh.rectangle(0.3, 0.2, size=0.05), []
    for section in sections:
        modes = fi.find_modes(fi.assemble(shape, section, supports, in_plane={"boundary": "free"}), n_modes=9)
        found.append(energies(modes, softness(modes, (0.07, 0.03))))
    (*_, plain), (square, cube, fourth) = found
    assert fourth == pytest.approx(plain, rel=1e-6, abs=0.0)  # P4 holds the slopes that the other plane adds
    assert abs(square) < 1e-9 * fourth and abs(cube) < 1e-9 * fourth


@pytest.mark.parametrize("offset", [4e-3, None])
def test_a_ribbed_strip_between_walls_stretches_as_a_t_beam(offset):
    """Along the common centroid, z above the middle that the walls hold: E A (mean of w'**2 / 2 - z w'')**2 / 2.

    The blow's deflection is -w: a rib on the struck side is shortened first, as a dome is.
    """
    length, wide, deep = 0.3, 0.01, 5e-3
    steel = fi.Material(E=E, nu=0.0, rho=RHO)
    rib = fi.Rib([(0.0, 0.5 * wide), (length, 0.5 * wide)], fi.Beam.rectangular(steel, width=2e-3, height=deep), offset)
    system = fi.assemble(
        fi.mesh.rectangle(length, wide, size=0.02), fi.Plate(steel, H), {"left": "hinged", "right": "hinged"},
        ribs=[rib],
    )  # fmt: skip
    modes = fi.find_modes(system, n_modes=1)
    x = np.linspace(0.0, length, 2001)
    w = modes.shape_at(np.column_stack([x, np.full(2001, 0.5 * wide)]))[:, 0]
    sign = np.sign(w[1000])
    slope = np.gradient(sign * w, x, edge_order=2)
    area, own = H * wide, 2e-3 * deep
    z = own * (-0.5 * (H + deep) if offset is None else offset) / (area + own)
    lead, mean = -z * (slope[-1] - slope[0]) / length, 0.5 * np.trapezoid(slope**2, x) / length
    _, cube, fourth = energies(modes, np.array([sign]))
    stiff = E * (area + own) * length
    # across a strip of a thirtieth of its length stresses are all but even
    assert (cube, fourth) == pytest.approx((-stiff * lead * mean, 0.5 * stiff * mean**2), rel=2e-4)


@pytest.mark.slow
def test_a_strip_that_rolls_up_does_not_stretch():
    """A cantilever's first mode is all but a cylinder; between walls a strip stretches as a beam."""
    length, wide, energies = 0.3, 0.05, []
    for supports in ({"left": "clamped"}, {"left": "clamped", "right": "clamped"}):
        system = fi.assemble(fi.mesh.rectangle(length, wide), PLATE, supports)
        modes = fi.find_modes(system, n_modes=1)
        top = np.abs(modes.shape_at(np.column_stack([np.linspace(0.0, length, 31), np.full(31, 0.5 * wide)]))).max()
        energies.append(energy(modes, np.array([1e-3 / top])))
    bar = fi.Beam.rectangular(STEEL, width=wide, height=H)
    beam = fi.analytic.beam(length, ends=("clamped", "clamped"), section=bar, n_modes=1)
    top = np.abs(beam.shape_at(np.linspace(0.0, length, 31)[:, None])).max()
    assert energies[1] == pytest.approx(energy(beam, np.array([1e-3 / top])), rel=0.05)  # the walls also hold its width
    assert energies[0] < 1e-3 * energies[1]


@pytest.mark.parametrize("ends, theory, height", [
    (("hinged", "hinged"), "euler", 3e-3),
    (("clamped", "hinged"), "timoshenko", 3e-3),
    (("hinged", "hinged"), "timoshenko", 0.05),
    (("clamped", "clamped"), "timoshenko", 0.05),
])  # fmt: skip
def test_beams_by_elements_and_by_formulas(ends, theory, height):
    bar = fi.Beam.rectangular(STEEL, width=0.02, height=height)
    closed = fi.analytic.beam(0.3, ends=ends, section=bar, n_modes=8, theory=theory)
    system = fi.assemble(fi.mesh.line(0.3), bar, {"left": ends[0], "right": ends[1]}, theory=theory)
    # forms may differ by signs and turns of equal modes, their eigenvalues may not
    one, other = (np.linalg.eigvalsh(stretch(modes).forms[0]) for modes in (closed, fi.find_modes(system, n_modes=8)))
    assert one == pytest.approx(other, rel=1e-9, abs=1e-12 * other.max())  # a stout beam only turns in one


def test_a_beam_between_walls_stretches_as_woinowsky_krieger_says():
    bar, length, a = fi.Beam.rectangular(STEEL, width=0.02, height=3e-3), 0.3, 1e-3
    modes = fi.analytic.beam(length, ends=("hinged", "hinged"), section=bar, n_modes=1)
    q = np.array([a / abs(modes.shape_at([length / 2])[0, 0])])
    tension = E * 0.02 * 3e-3 * (np.pi * a / (2.0 * length)) ** 2  # E A times the mean of w'**2 / 2
    assert energy(modes, q) == pytest.approx(0.25 * tension * a**2 * np.pi**2 / (2.0 * length), rel=1e-10)


# of more modes of disks, other fields may be left out: 4e-3
@pytest.mark.parametrize(("mesh", "closed", "edge", "at", "rel"), [
    (fi.mesh.rectangle(0.2, 0.3), fi.analytic.rectangle(0.2, 0.3, section=PLATE, n_modes=12), "hinged", (0.09, 0.13),
     3e-5),
    *((fi.mesh.disk(0.2), fi.analytic.disk(0.2, edge=edge, section=PLATE, n_modes=8), edge, (0.05, 0.03), 1e-4)
      for edge in ("clamped", "hinged", "free")),
])  # fmt: skip
def test_plates_by_elements_and_by_formulas(mesh, closed, edge, at, rel):
    found = fi.find_modes(fi.assemble(mesh, PLATE, {"boundary": edge}), n_modes=closed.n_modes)
    assert dent(found, at) == pytest.approx(dent(closed, at), rel=rel)


def test_grain_along_and_across():
    # a wooden rectangle turned with its grain is the same; across it, the stretch is softer by far
    found = []
    for angle, (a, b) in ((0.0, (0.2, 0.3)), (np.pi / 2.0, (0.3, 0.2)), (np.pi / 2.0, (0.2, 0.3))):
        wood = fi.Material.orthotropic(E_along=11e9, E_across=0.8e9, nu=0.37, G=0.7e9, rho=430.0, angle=angle)
        modes = fi.find_modes(
            fi.assemble(fi.mesh.rectangle(a, b), fi.Plate(wood, H), {"boundary": "hinged"}), n_modes=4
        )
        found.append(energy(modes, np.eye(4)[0]))
    assert found[1] == pytest.approx(found[0], rel=1e-4) and found[2] < 0.5 * found[0]


def test_modes_in_air_stretch_as_their_mixture():
    modes = fi.analytic.rectangle(0.2, 0.3, section=PLATE, n_modes=5)
    mixed = fi.in_air(modes, density=300.0)  # dense enough to mix them visibly
    q = np.array([0.3, -0.2, 0.5, 0.1, 0.4])
    assert np.abs(mixed.shapes.mix - np.diag(mixed.shapes.mix.diagonal())).max() > 1e-3
    assert energy(mixed, q) == pytest.approx(energy(modes, mixed.shapes.mix @ q), rel=1e-5)  # of the fields left out


@pytest.mark.parametrize(("supports", "n_rigid"), [({"boundary": "hinged"}, 0), ({}, 3)])
def test_the_first_ritz_vector_that_bends_stretches_as_its_mode_does(supports, n_rigid):
    system = fi.assemble(fi.mesh.rectangle(0.2, 0.3, size=0.1), PLATE, supports, near=[(0.08, 0.05)])
    n = n_rigid + 1
    vectors = fi.ritz_modes(system, [(0.08, 0.05)], max_frequency=300.0, n_vectors=20).truncated(n_modes=n)
    modes = fi.find_modes(system, n_modes=n)
    assert vectors.n_rigid == n_rigid and not stretch(vectors).forms[:, :n_rigid].any()
    one, two = (energy(each, np.eye(n)[-1]) for each in (vectors, modes))
    assert one == pytest.approx(two, rel=1e-3)  # 20 vectors
