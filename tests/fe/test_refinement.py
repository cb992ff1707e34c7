"""The size of elements from the waves wanted, the steps of refinement, and a kept spectrum."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact._base import identity
from fem_impact.fe import refinement

PLATE = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thickness=2e-3)


def wavenumber(frequency):
    """Of free bending waves [rad/m]: k**4 = m'' omega**2 / D."""
    D = 70e9 * 2e-3**3 / 12.0 / (1.0 - 0.33**2)
    return (2700.0 * 2e-3 / D) ** 0.25 * np.sqrt(2.0 * np.pi * frequency)


@pytest.mark.parametrize(("edge", "n_modes"), [("clamped", 200), ("hinged", 200), ("free", 200), ("free", 1000)])
def test_the_wave_of_the_last_mode_follows_weyls_law_with_its_edge_term(edge, n_modes):
    exact = wavenumber(fi.analytic.disk(0.4, edge=edge, section=PLATE, n_modes=n_modes).frequencies[-1])
    found = refinement._wave(fi.assemble(fi.mesh.disk(0.4), PLATE, {"boundary": edge}), n_modes, None)
    assert_allclose(found, exact, rtol=3.0 / n_modes**0.75)  # the remainder of the law; without the edge 6 % at 200


def test_the_wave_of_a_frequency_is_that_of_bending_waves():
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3), PLATE, {"left": "clamped"})
    assert_allclose(refinement._wave(system, None, 2e3), wavenumber(2e3), rtol=1e-12)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_elements_of_the_size_for_a_tolerance_meet_it_on_a_smooth_plate(tolerance):
    """The hinged rectangle, exact; its elements are not a hundred times finer than needed either."""
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3), PLATE, {"boundary": "hinged"})
    size = refinement.size_for(system, 30, None, refinement.side_for(system.rules, tolerance))
    fine = fi.assemble(fi.mesh.rectangle(0.5, 0.3, size=size), PLATE, {"boundary": "hinged"})
    found = refinement.solve_on_mesh(fine, 30, None)
    exact = 2.0 * np.pi * fi.analytic.rectangle(0.5, 0.3, section=PLATE, n_modes=30).frequencies
    error = np.abs(found.omega / exact - 1.0)
    assert 1e-3 * tolerance < error.max() <= tolerance
    assert (error <= 3.0 * found.error).all()


@pytest.mark.parametrize("angle", [0.0, 1.2])
def test_the_shortest_wave_in_wood_runs_across_the_grain_whatever_its_angle(angle):
    wood = fi.Material.orthotropic(E_along=140e9, E_across=10e9, nu=0.3, G=5e9, rho=1600.0, angle=angle)
    system = fi.assemble(fi.mesh.disk(0.2), fi.Plate(wood, 2e-3), {"boundary": "clamped"})
    bending = 10e9 * 2e-3**2 / 12.0 / (1.0 - 0.3**2 * 10.0 / 140.0) / 1600.0  # over mass per area, across the grain
    expected = ((2.0 * np.pi * 1000.0) ** 2 / bending) ** 0.25
    assert_allclose(refinement._wave(system, None, 1000.0), expected, rtol=2e-3)  # directions are 5 degrees apart
    modes = fi.find_modes(system, n_modes=40)
    shortest = refinement._wave(system, None, modes.frequencies[-1])
    assert_allclose(refinement._wave(system, 40, None), shortest, rtol=0.05)  # Weyl's law for 40 modes: 2 %


def test_the_step_of_refinement_solves_the_law_of_the_error():
    parts, (smooth, curved, step_of_thickness) = np.zeros((4, 4)), refinement.ORDERS
    parts[0] = [1e-7, 1e-6, 1e-5, 1e-4]
    assert_allclose(refinement._needed_factor(parts, 1e-6), 100.0 ** (1.0 / smooth), rtol=1e-9)
    parts[1] = parts[0] * 100.0
    step = refinement._needed_factor(parts, 1e-6)
    assert_allclose(1e-4 * step**-smooth + 1e-2 * step**-curved, 1e-6, rtol=1e-9)
    assert refinement._needed_factor(parts, 1.0) == refinement.LEAST_STEP
    parts[2, 0] = 1e-5
    assert refinement._needed_factor(parts[:, :1], 1e-6) > 10.0**step_of_thickness
    parts[3, 0] = 2e-6  # no mesh cures that
    assert refinement._needed_factor(parts, 1e-6) == np.inf


def test_a_frequency_limit_counts_by_inertia_and_below_the_first_mode_is_told():
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.5, size=0.125), PLATE, {"boundary": "hinged"})
    first = fi.analytic.rectangle(0.5, 0.5, section=PLATE, n_modes=1).frequencies[0]
    # m**2 + n**2 < 10.5: (1,1), (1,2) twice, (2,2), (1,3) twice
    assert len(refinement.solve_on_mesh(system, None, 10.5 / 2.0 * first).omega) == 6
    with pytest.raises(ValueError, match="max_frequency must reach the first mode; there is none below"):
        refinement.solve_on_mesh(system, None, 0.9 * first)


def test_elements_for_a_frequency_shrink_with_its_root():
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3), PLATE, {"boundary": "hinged"})
    sizes = [refinement.size_for(system, None, frequency, 1.8) for frequency in (1e3, 4e3)]
    assert_allclose(sizes[0] / sizes[1], 2.0, rtol=1e-12)


def test_a_kept_spectrum_is_read_and_a_damaged_or_foreign_one_replaced(tmp_path, monkeypatch):
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3, size=0.1), PLATE, {"left": "clamped"})
    path = tmp_path / "modes.npz"
    solved, real = [], refinement.solve_on_mesh
    monkeypatch.setattr(refinement, "solve_on_mesh", lambda *what: solved.append(what) or real(*what))
    first, second = (refinement.solve_or_read(system, 6, None, path) for _ in range(2))
    assert len(solved) == 1
    assert (first.omega == second.omega).all() and (first.vectors == second.vectors).all()
    refinement.solve_or_read(system, 7, None, path)  # other modes
    path.write_bytes(path.read_bytes()[:1000])  # cut off
    again = refinement.solve_or_read(system, 7, None, path)
    other = fi.assemble(fi.mesh.rectangle(0.5, 0.3, size=0.1), PLATE, {"left": "hinged"})
    assert refinement.solve_or_read(other, 7, None, path).omega[0] < again.omega[0]  # another body
    assert len(solved) == 4
    monkeypatch.setattr(identity, "program", lambda: "another version")
    refinement.solve_or_read(other, 7, None, path)
    assert len(solved) == 5


def test_the_kept_spectrum_of_a_body_of_another_size_is_not_taken(tmp_path):
    """In the frame of the body, the matrices of all these plates are the same numbers."""

    def omega(thickness=2e-3, size=1.0, rho=2700.0):
        section = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=rho), thickness)
        plate = fi.assemble(fi.mesh.rectangle(0.5 * size, 0.3 * size, size=0.1 * size), section, {"left": "clamped"})
        return fi.find_modes(plate, n_modes=3, keep=tmp_path / "modes.npz").omega

    first = omega()
    for other, factor in (({"thickness": 4e-3}, 2.0), ({"size": 2.0}, 0.25), ({"rho": 2800.0}, (27 / 28) ** 0.5)):
        assert_allclose(omega(**other), factor * first, rtol=1e-9)  # by the law of thin plates; rounding


def test_a_place_where_no_file_can_be_is_refused_before_modes_are_solved(tmp_path, monkeypatch):
    monkeypatch.setattr(refinement, "solve_on_mesh", None)
    plate = fi.assemble(fi.mesh.rectangle(0.5, 0.3, size=0.1), PLATE, {"left": "clamped"})
    for path in (tmp_path, tmp_path / "none" / "modes.npz"):
        with pytest.raises(ValueError, match="keep must be a file in a folder that exists, got "):
            refinement.solve_or_read(plate, 3, None, path)


@pytest.mark.parametrize(("element", "size", "median"), [("argyris", 0.06, (0.8, 2.0)), ("morley", 0.02, (1.7, 4.0))])
def test_stated_errors_are_those_of_a_smooth_plate_within_a_factor(element, size, median):
    """Stated over true: 0.8 to 2.5 for quintics, 2.4 to 3.3 for Morley elements, whose clamped plates err more."""
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3, size=size), PLATE, {"boundary": "hinged"}, element=element)
    exact = 2.0 * np.pi * fi.analytic.rectangle(0.5, 0.3, section=PLATE, n_modes=20).frequencies
    found = refinement.solve_on_mesh(system, 20, None)
    low, high = median
    assert low < np.median(found.error / np.abs(found.omega / exact - 1.0)) < high


@pytest.mark.parametrize("theory", ["kirchhoff", "mindlin", "euler", "timoshenko"])
def test_the_number_of_unknowns_is_foretold(theory):
    """To a quarter, as the edges of a small mesh hold many of them."""
    if theory in ("kirchhoff", "mindlin"):
        mesh, section = fi.mesh.rectangle(0.5, 0.3, size=0.04), PLATE
    else:
        mesh, section = fi.mesh.line(1.0, size=0.1), fi.Beam.rectangular(PLATE.material, width=0.02, height=0.01)
    system = fi.assemble(mesh, section, {"boundary": "hinged"}, theory=theory)
    assert_allclose(refinement.unknowns(system.element, mesh, mesh.size), system.n_dofs, rtol=0.25)


@pytest.mark.parametrize("n_modes", [40])
def test_some_modes_are_found_to_a_few_millionths_if_nothing_is_asked(n_modes):
    """Elements are finer than the wave of the last mode asks, as few of them cost little."""
    system = fi.assemble(fi.mesh.rectangle(0.5, 0.3), PLATE, {"boundary": "hinged"})
    fine = refinement.fine_enough(system, refinement.size_for(system, n_modes, None))
    found = refinement.solve_on_mesh(fine, n_modes, None)
    exact = 2.0 * np.pi * fi.analytic.rectangle(0.5, 0.3, section=PLATE, n_modes=n_modes).frequencies
    assert np.abs(found.omega / exact - 1.0).max() < 4e-6  # 2e-7 and 2.3e-6 were measured


def test_the_edge_layer_of_a_stretched_plate_is_resolved():
    """A clamped disk under so much tension that its edge bends over a hundredth of its radius."""
    plate = fi.Plate(PLATE.material, thickness=5e-4, tension=2e4)
    system = fi.assemble(fi.mesh.disk(0.3), plate, {"boundary": "clamped"})
    chosen = system.mesh.size / refinement.size_for(system, 4, None)
    coarse, fine = (
        refinement.solve_on_mesh(refinement.reassemble(system, system.mesh.refined(factor)), 4, None).omega
        for factor in (chosen, 1.7 * chosen)
    )
    assert_allclose(coarse, fine, rtol=4e-4)  # 2.6e-4 was measured


@pytest.mark.parametrize("mesh", [fi.mesh.rectangle(0.5, 0.3, size=0.1), fi.mesh.disk(0.3, size=0.06)])
def test_errors_fall_as_the_step_of_refinement_assumes(mesh):
    """A mesh made to have a fiftieth of the error has that, or up to three times as much: then a third one follows."""
    found = refinement.solve_on_mesh(fi.assemble(mesh, PLATE, {"boundary": "hinged"}), 12, None)
    goal = found.error.max() / 50.0
    step = refinement._needed_factor(found.parts, goal)
    finer = refinement.solve_on_mesh(refinement.reassemble(found.system, mesh.refined(step)), 12, None)
    assert 0.3 * goal < finer.error.max() < 3.0 * goal


def test_what_is_to_come_is_foretold_by_the_faster_of_the_rates_seen():
    assert refinement._predicted_step([(1.0, 1e-3)], 1e-9) == 1.0  # one mesh shows no rate
    assert_allclose(refinement._predicted_step([(1.0, 1e-2), (0.5, 1e-2 / 16)], 1e-2 / 256), 2.0)  # fourth order
    slow = [(1.0, 1e-2), (0.5, 5e-3), (0.25, 2.5e-3 / 8)]  # first order, then fourth
    assert_allclose(refinement._predicted_step(slow, slow[-1][1] / 16.0), 2.0)
    assert refinement._predicted_step([(1.0, 1e-6), (0.5, 2e-6)], 1e-7) == np.inf


def test_a_tolerance_that_corners_do_not_allow_is_refused_after_few_meshes(monkeypatch):
    """Errors at a free notch do not fall; five more meshes up to 125 000 unknowns took twenty seconds to say so."""
    notched = fi.mesh.polygon([(0, 0), (1, 0), (1, 0.5), (0.5, 0.5), (0.5, 1), (0, 1)])
    seen, solve = [], refinement.solve_on_mesh
    monkeypatch.setattr(
        refinement, "solve_on_mesh", lambda system, *how: seen.append(system.n_dofs) or solve(system, *how)
    )
    with pytest.raises(fi.SimulationError, match=r"uncertain by .* a tolerance of .* is met, or ask for fewer modes$"):
        fi.find_modes(fi.assemble(notched, PLATE), n_modes=8, tolerance=1e-7)
    assert len(seen) <= 3 and seen[-1] < 0.1 * refinement.MOST_UNKNOWNS


@pytest.mark.parametrize(("thickness", "words"), [
    (2e-3, "no tolerance up to 1e-09 is, or ask"), (2.0, "check the units, as thickness 2 m "),
])  # fmt: skip
def test_units_are_doubted_only_where_one_looks_like_a_slip(monkeypatch, thickness, words):
    monkeypatch.setattr(refinement, "MOST_UNKNOWNS", 100)
    monkeypatch.setattr(refinement, "LOOSEST", 1e-9)  # whatever is uncertain is too uncertain
    body = fi.assemble(fi.mesh.rectangle(0.3, 0.2), fi.Plate(PLATE.material, thickness), {"left": "clamped"})
    with pytest.raises(fi.SimulationError, match=words):
        fi.find_modes(body, n_modes=4, tolerance=1e-9)
