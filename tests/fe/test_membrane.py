from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import eye_array

import fem_impact as fi
from fem_impact.fe import membrane, plane

E, NU, H, SIDE = 210e9, 0.3, 1e-3, 0.2
PLATE = fi.Plate(fi.Material(E=E, nu=NU, rho=7850.0), H)
SQUARE = np.pi**2 / 2.0  # int |grad w|**2 of w = sin sin on any square


def sheet(size=0.05, sides=(SIDE, SIDE), section=PLATE, plane="held"):
    mesh = fi.mesh.rectangle(*sides, size=size)
    return membrane.Sheet.of(fi.assemble(mesh, section, {"boundary": "clamped"}, in_plane={"boundary": plane}))


def sines(numbers, side=SIDE):
    """Slopes of the products of sines of a square, whose frame has its origin in the middle."""
    m, n = np.transpose(numbers) * np.pi

    def steep(_, x):
        x, y = (x[..., :1] + 0.5) * m, (x[..., 1:] + 0.5) * n
        return np.stack([m * np.cos(x) * np.sin(y), n * np.sin(x) * np.cos(y)], 2) / side

    return steep


def energies(forms, q):
    return 0.5 * np.einsum("kij,i,j->k", forms, q, q) ** 2


def over_berger(energy):
    return energy / (E * H / (8.0 * SIDE**2 * (1.0 - NU**2)) * SQUARE**2)


def test_a_square_whose_edges_slide_along_themselves_is_that_of_chu_and_herrmann():
    # their energy is the mean stress's 3/4 (1 + nu) and Airy's 12 (1 - nu**2) / 32, where Berger has 3/2
    system = fi.assemble(fi.mesh.rectangle(SIDE, SIDE, size=0.05), PLATE, {"boundary": "clamped"})
    whole = membrane.Sheet.of(system)
    x = np.zeros((whole.dofs.max() + 1, 2))
    x[whole.dofs[:, :15]] = x[whole.dofs[:, 15:]] = plane.nodes(system.space)
    n, ends = len(x) // 2, np.abs(x) > 0.5 - 1e-9
    slides = replace(whole, loose=eye_array(2 * n, format="csr")[:, ~np.concatenate([ends[:n, 0], ends[n:, 1]])])
    wanted = (0.75 * (1.0 + NU) + 12.0 * (1.0 - NU**2) / 32.0) / 1.5
    assert over_berger(stretched(slides, sines([(1, 1)]))) == pytest.approx(wanted, rel=3e-5)  # 2e-6 with half the size


def stretched(sheet, slopes):
    """Energy of one mode of unit amplitude."""
    return energies(membrane.stretching_forms(sheet, slopes, np.ones(1))[0], np.ones(1)).sum()


def test_a_square_held_all_round_is_a_little_stiffer():
    coarse, fine = (over_berger(stretched(sheet(size), sines([(1, 1)]))) for size in (0.05, 0.025))
    assert 0.877 < fine < 0.883  # 1.316 / 1.5 where the edges slide, 1.323 / 1.5 computed on twice as many triangles
    assert fine < coarse < (1.0 + 1e-4) * fine  # the plane settles where its energy is least: always from above


# of unit square and unit norm, E h / 4 times the fourth power of the amplitude: spectra of Airy's function (VK-Gong)
FREE = {(1, 1): 25.29581, (1, 2): 143.0341, (2, 2): 559.480}


@pytest.mark.parametrize("numbers", list(FREE))
def test_a_square_that_may_move_in_its_plane_is_that_of_airys_function(numbers):
    wanted = 0.25 * E * H * FREE[numbers] * (0.5 / SIDE**0.5) ** 4  # of sines of amplitude one
    coarse, fine = (stretched(sheet(size, plane="free"), sines([numbers])) / wanted for size in (0.05, 0.02))
    assert fine == pytest.approx(1.0, rel=2e-5)  # of the triangles: 1e-6 in the first mode
    assert fine < coarse < 1.01  # from above, as ever


def test_fields_of_stress_are_kept_in_order_and_each_adds_energy():
    numbers = [(1, 1), (1, 2), (2, 1), (2, 2), (1, 3), (3, 1)]
    omega = np.square(numbers).sum(axis=1).astype(float)
    found = membrane.stretching_forms(sheet(), sines(numbers), omega)[0]
    assert len(found) == 21  # every pair of modes
    mean = sum(energies(found, q / omega) for q in np.random.default_rng(1).normal(size=(2000, 6)))
    assert (mean[:3] > mean[3:].max()).all()
    assert energies(found, np.eye(6)[0]).sum() == pytest.approx(stretched(sheet(), sines(numbers[:1])), rel=1e-9)


def test_the_softer_part_of_a_plate_takes_the_stretch():
    # bent in one wave along x, and alike along y, it is a beam: N = mean of w'**2 / 2 over the mean of 1 / (E h)
    wedge = fi.Plate(fi.Material(E=E, nu=0.0, rho=7850.0), lambda x: H * (1.0 + 2.0 * x[:, 0] / SIDE))
    strip = fi.assemble(fi.mesh.rectangle(SIDE, SIDE, size=0.05), wedge, {"left": "clamped", "right": "clamped"})

    def steep(_, x):
        slope = np.pi / SIDE * np.cos(np.pi * (x[..., 0] + 0.5))
        return np.stack([slope, 0.0 * slope], 2)[..., None]

    soft = SIDE * np.log(3.0) / (2.0 * E * H)  # int dx / (E h)
    stretch = SIDE * (np.pi / SIDE) ** 2 / 4.0  # int w'**2 / 2
    assert stretched(membrane.Sheet.of(strip), steep) == pytest.approx(0.5 * SIDE * stretch**2 / soft, rel=1e-6)
