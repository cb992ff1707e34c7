"""Numbers that are probably a slip of a unit give a note that names them; those of real materials give none."""

import re

import numpy as np
import pytest

import fem_impact as fi

STEEL = {"E": 210e9, "nu": 0.3, "rho": 7850.0}
# Ashby, Materials Selection in Mechanical Design, 4th ed., appendix A: E [Pa], density [kg/m^3]
REAL = {
    "steel": (210e9, 7850.0), "aluminium": (70e9, 2700.0), "bronze": (110e9, 8800.0), "tungsten": (400e9, 19300.0),
    "spruce": (10e9, 400.0), "balsa": (3.4e9, 130.0), "glass": (70e9, 2500.0), "cork": (20e6, 180.0),
    "Mylar": (5e9, 1390.0), "rubber": (5e6, 950.0), "alumina": (390e9, 3900.0), "carbon fibre": (130e9, 1550.0),
}  # fmt: skip


@pytest.mark.parametrize(
    "slip, words",
    [
        ({"E": 210.0}, "E = 210 Pa is softer than rubber; Pa are expected"),
        ({"E": 210e3}, "E = 210000 Pa is softer than rubber"),
        ({"E": 210e12}, "stiffer than diamond"),
        ({"rho": 7.85}, "density 7.85 kg/m\\^3 is lighter than cork; kg/m\\^3 are expected"),
        ({"rho": 7.85e6}, "heavier than osmium"),
        ({"E_across": 0.8, "G": 0.7e9}, "E_across = 0.8 Pa"),
        ({"E_across": 0.8e9, "G": 700.0}, "G = 700 Pa"),
        ({"E_across": 0.8e9, "G": 0.7e9, "angle": 90.0}, "angle = 90 rad is 14.3 turns; .* degrees are 1.571"),
    ],
)
def test_a_slip_in_a_material_is_noted(slip, words):
    (note,) = fi.Material(**{**STEEL, **slip}).notes
    assert re.search(words, note)


@pytest.mark.parametrize("name", REAL)
def test_real_materials_get_no_note(name):
    E, rho = REAL[name]
    assert fi.Material(E, 0.3, rho).notes == ()


def plate(thickness=3e-3, **changes):
    return fi.Plate(fi.Material(**{**STEEL, **changes}), thickness)


def beam(height):
    return fi.Beam.rectangular(fi.Material(**STEEL), width=0.02, height=height)


def elements(mesh, section):
    return fi.find_modes(fi.assemble(mesh, section, supports={"boundary": "hinged"}), n_modes=4)


def disk(section=None, radius=0.1, **more):
    return fi.analytic.disk(radius, section=section or plate(), n_modes=4, **more)


SMALL = fi.mesh.rectangle(0.3, 0.2)
WOOD = {"E_along": 12e9, "E_across": 1e9, "nu": 0.3, "G": 0.8e9, "rho": 700.0}
OAK = fi.Material.orthotropic(**WOOD)


@pytest.mark.parametrize("make, words", [
    (lambda: fi.analytic.rectangle(465, 300, section=plate(), n_modes=4), "465 m is larger than anything"),
    (lambda: fi.analytic.rectangle(0.465, 0.3, section=plate(0.5), n_modes=4), "thickness 0.5 m is 1.67 times"),
    (lambda: disk(radius=120.0), "240 m is larger"),
    (lambda: disk(plate(rho=7.85)), "density 7.85"),
    (lambda: disk(damping_ratio=5), "damping_ratio = 5 is more than"),
    (lambda: disk().damped(0.5), "damping_ratio = 0.5"),
    (lambda: elements(SMALL, plate(E=210.0)), "E = 210 Pa"),
    (lambda: elements(fi.mesh.rectangle(300, 200), plate()), "300 m is larger"),
    (lambda: elements(SMALL, plate(3.0)), "thickness 3 m is 15 times the shortest side"),
    (lambda: elements(fi.mesh.line(0.3), beam(height=0.2)), "height 0.2 m is 0.667 times the length, 0.3 m"),
    (lambda: elements(SMALL, fi.Plate.laminate([(OAK, 1e-3, angle) for angle in (0.0, 90.0, 0.0)])),
     "90 degrees are 1.571"),
])  # fmt: skip
def test_a_slip_in_a_body_is_noted_by_closed_forms_and_by_elements(make, words):
    (note,) = make().notes
    assert words in note


def test_everyday_bodies_get_no_note():
    bodies = elements(SMALL, plate()), elements(fi.mesh.line(0.3), beam(0.01)), disk(damping_ratio=0.02)
    replaced = disk(damping_ratio=5).damped(0.05)  # a new ratio replaces the note on the old one
    assert [each.notes for each in (*bodies, fi.Striker.sphere(fi.Material(**STEEL), 0.01), replaced)] == [()] * 5


@pytest.mark.parametrize(
    "theory, told, expected", [("kirchhoff", {}, 0), ("mindlin", {}, 1), ("mindlin", {"G_yz": 4e7}, 0)]
)
def test_wood_whose_rolling_shear_modulus_is_taken_for_that_in_the_plane_is_noted(theory, told, expected):
    wood = fi.Material.orthotropic(**WOOD, **told)
    notes = fi.assemble(fi.mesh.rectangle(0.3, 0.2, size=0.2), fi.Plate(wood, 0.01), theory=theory).notes
    assert len(notes) == expected
    assert all("G_yz is not stated and taken as that in the plane, G = 8e+08 Pa" in note for note in notes)


def test_a_blow_on_a_support_its_speed_and_its_sphere_are_noted():
    modes, law = fi.analytic.rectangle(0.3, 0.2, section=plate(), n_modes=40), fi.Contact.linear(1e6)
    rigid, ball = fi.Striker.rigid(0.01), fi.Striker.sphere(fi.Material(210.0, 0.3, 7850.0), 0.01)
    (note,) = fi.strike(modes, rigid, law, at=(0.0, 0.0), speed=1.0).notes
    assert note == "the point struck, (0, 0) m, cannot move: it lies on a support, and the blow is that on a wall"
    assert fi.strike(modes, rigid, law, at=(0.003, 0.002), speed=1.0, tolerance=0.1).notes == ()  # beside it
    hit = fi.strike(modes, ball, law, at=(0.1, 0.1), speed=2000.0, tolerance=0.1)
    assert np.array([[word in note for word in ("E = 210 Pa", "speed 2000 m/s")] for note in hit.notes]).any(0).all()
    assert "Note: speed 2000 m/s is as fast as a bullet" in hit.summary()


@pytest.mark.parametrize(("share", "thick"), [(0.25, False), (0.45, True)])
def test_a_plate_of_nearly_half_its_side_is_noted_as_thick(share, thick):
    notes = elements(SMALL, plate(0.2 * share)).notes
    assert any("times the shortest side" in note for note in notes) == thick


@pytest.mark.parametrize("slip, words", [
    ({"height": 8.0}, r"height 8 m of ribs\[1\] is 26.7 times the shortest side, 0.3 m; m are expected"),
    ({"width": 3.0}, r"width 3 m of ribs\[1\]"),
    ({"offset": -5.0}, r"offset -5 m of ribs\[1\] is 16.7 times"),
    ({"y": 0.1}, r"ribs\[1\] lies where ribs\[0\] does, and both count"),
    ({"y": 0.1, "offset": 5e-3}, None),
])  # fmt: skip
def test_a_slip_in_a_rib_is_noted(slip, words):
    def rib(y=0.2, width=3e-3, height=8e-3, offset=None):
        section = fi.Beam.rectangular(fi.Material(**STEEL), width=width, height=height)
        return fi.Rib([(0.0, y), (0.4, y)], section, offset)

    ribs = [rib(y=0.1), rib(**slip)]
    notes = fi.assemble(fi.mesh.rectangle(0.4, 0.3), plate(2e-3), {"boundary": "hinged"}, ribs=ribs).notes
    assert len(notes) == (words is not None) and all(re.search(words, note) for note in notes)


def sampled(scale=1.0, order=slice(None)):
    plate = fi.analytic.rectangle(0.4, 0.3, mass=0.5, first_frequency=100.0, n_modes=30)
    points = np.stack(np.meshgrid(np.linspace(0.0, 0.4, 13), np.linspace(0.0, 0.3, 10)), axis=-1).reshape(-1, 2)
    return fi.Modes.from_arrays(plate.frequencies, scale * plate.shape_at(points)[order], points=points, mass=0.5)


@pytest.mark.parametrize("make", [
    fi.Modes.from_arrays, lambda f, s, points, mass: flat_body(f, s, points, mass).modes("z"),
])  # fmt: skip
def test_shapes_of_another_scale_than_by_mass_are_noted(make):
    """Normalised to their maximum or to their length, or all as large as those of a quarter of the mass."""
    plate = fi.analytic.rectangle(0.4, 0.3, mass=0.5, first_frequency=100.0, n_modes=8)
    points = np.stack(np.meshgrid(np.linspace(0.0, 0.4, 13), np.linspace(0.0, 0.3, 10)), axis=-1).reshape(-1, 2)
    shapes = plate.shape_at(points)

    def noted(shapes, frequencies=plate.frequencies):
        return "; ".join(make(frequencies, shapes, points=points, mass=0.5).notes)

    assert "normalised" not in noted(shapes) and "alike" not in noted(shapes)
    for size, said in (
        (np.abs(shapes).max(axis=0), "normalised to a largest deflection of 1; they are expected mass-normalised"),
        (np.linalg.norm(shapes, axis=0), "normalised to a length of 1"),
        (0.5, "shapes are those of a uniform body of 0.125 kg, but the mass is 0.5 kg"),
    ):
        assert said in noted(shapes / size)
    twice = np.argsort(np.append(plate.frequencies, 1.002 * plate.frequencies))
    again = np.append(plate.frequencies, 1.002 * plate.frequencies)[twice]
    said = "8 pairs of modes move all points alike, as those at 100 and 100.2 Hz"
    assert said in noted(np.hstack([shapes, -1.02 * shapes])[:, twice], again)


def flat_body(frequencies, shapes, points, mass):
    vectors = np.zeros((len(points), 3, len(frequencies)))
    vectors[:, 2] = shapes
    return fi.Body(frequencies, vectors, np.column_stack([points, np.zeros(len(points))]), mass)


@pytest.mark.parametrize("body", ["hinged", "free", "clamped"])
def test_shapes_by_mass_at_random_points_are_not_noted(body):
    section = fi.Plate(fi.Material(**STEEL), lambda points: 2e-3 + 5e-3 * points[:, 0])
    modes = fi.find_modes(
        fi.assemble(fi.mesh.rectangle(0.4, 0.3), section, {} if body == "free" else {"boundary": body}), n_modes=10
    )
    for seed in range(10):
        points = np.random.default_rng(seed).uniform((0.0, 0.0), (0.4, 0.3), (12 + 4 * seed, 2))
        made = fi.Modes.from_arrays(modes.frequencies, modes.shape_at(points), points=points, mass=modes.mass)
        assert not [note for note in made.notes if note.startswith("shapes are") or "alike" in note]


def test_shapes_in_another_order_than_their_points_are_noted():
    (note,) = set(sampled(order=np.random.default_rng(0).permutation(130)).notes) - set(sampled().notes)
    assert "different at neighbouring points as at any two; they are expected in their order" in note


def test_a_blow_that_fails_says_first_that_shapes_are_of_another_scale(monkeypatch):
    monkeypatch.setattr("fem_impact.impact.engine.MAX_STEPS", 4000)
    with pytest.raises(fi.SimulationError, match=r"^shapes are 9\.1e\+02 times as large .*: no final separation"):
        fi.strike(sampled(1e3), fi.Striker.rigid(0.02), fi.Contact.linear(1e5), at=(0.2, 0.1), speed=1.0)
