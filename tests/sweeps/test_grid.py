"""Maps: cells against single blows, axes, units, failures and input errors."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.sweeps import cases, cells

AT = (0.465, 0.3)


def plate(**wanted):
    return fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=80, **wanted)


def stick(mass=0.1, first_frequency=10e3):
    return fi.Striker.stick(mass, first_frequency)


def test_a_map_as_the_design_says_it():
    over = {"mass": [0.05, 0.1], "stiffness": [2e4, 1e5, 5e5]}
    table = fi.sweep(plate(), stick(), fi.Contact.linear(1e5), at=AT, speed=1.0, over=over, tolerance=1e-3)
    assert table.n_impacts.dims == ("mass", "stiffness")
    assert table.n_impacts.dtype.kind == "i"
    assert {name: table[name].attrs["units"] for name in ("mass", "stiffness", "contact_time", "restitution")} == {
        "mass": "kg",
        "stiffness": "N/m",
        "contact_time": "s",
        "restitution": "1",
    }
    scene = json.loads(table.attrs["scene"])
    assert scene["target"]["mass"] == 0.2
    assert len(scene["target"]["frequencies"]) == 80
    assert (table.failure == "").all()


@pytest.mark.parametrize("also", [{}, {"loss": [0.0, 0.3]}, {"target_mass": [0.1, 2.0]}, {"at": [AT, (0.7, 0.45)]}])
def test_a_cell_has_the_same_bits_whatever_is_computed_with_it(also):
    base = cells.Case(plate(), stick(), fi.Contact.linear(1e5), np.array(AT), 1.0)
    axes = cells.checked_axes(base, {"mass": np.geomspace(0.01, 0.2, 8), **also})
    whole = cases.Cases(base, axes, 1e-3, band=5e3)
    expected, _ = cases.solve_cases(whole, 0, whole.n_cases)
    starts = range(0, whole.n_cases, 3)
    parts = [cases.solve_cases(replace(whole, kernels={}), i, min(i + 3, whole.n_cases))[0] for i in starts]
    assert np.hstack(parts).tobytes() == expected.tobytes()


VALUES = {
    "mass": [0.03, 0.15],
    "striker_frequency": [800.0, 5e3],
    "stiffness": [3e4, 4e5],
    "exponent": [1.0, 1.3],
    "loss": [0.0, 0.2],
    "gap": [0.0, 1e-3],
    "speed": [0.3, 4.0],
    "at": [(0.465, 0.3), (0.7, 0.45)],
    "target_mass": [0.1, 2.0],
    "target_frequency": [60.0, 150.0],
    "damping_ratio": [0.0, 0.03],
}


def single(name, value, tolerance, law):
    """The blow of one cell by `strike` alone."""
    change = {name: value}
    target = plate().scaled(mass=change.get("target_mass", 0.2), first_frequency=change.get("target_frequency", 100.0))
    target = target.damped(change.get("damping_ratio", 0.0))
    striker = stick(change.get("mass", 0.1), change.get("striker_frequency", 10e3))
    terms = {key: change.get(key, getattr(law, key)) for key in ("stiffness", "exponent", "loss", "gap")}
    return fi.strike(
        target,
        striker,
        fi.Contact(**terms),
        at=change.get("at", AT),
        speed=change.get("speed", 1.0),
        tolerance=tolerance,
    )


@pytest.mark.parametrize("law", [fi.Contact.linear(1e5), fi.Contact.hertz(2e6)], ids=["linear", "hertz"])
@pytest.mark.parametrize("name", VALUES)
def test_every_axis_gives_the_single_blow(name, law):
    table = fi.sweep(plate(), stick(), law, at=AT, speed=1.0, over={name: VALUES[name]}, max_frequency=3e3)
    for i, value in enumerate(VALUES[name]):
        hit = single(name, value, 1e-5, law)
        cell = table.isel({name: i})
        assert int(cell.n_impacts) == hit.n_impacts
        assert_allclose(float(cell.restitution), hit.restitution, atol=1e-3)
        for layer in ("contact_time", "impulse", "peak_force"):
            assert_allclose(float(cell[layer]), getattr(hit, layer), rtol=1e-3)
        assert_allclose(float(cell.centroid), hit.spectral_centroid(3e3), rtol=2e-3)  # 1e-3 each of the two


LOSING = {  # axis: its values, and the contact whose number they replace
    "depth": ([1e-4, 1e-3], fi.Contact.layers(1e5, 1.2, depth=5e-4, hard_stiffness=1e8)),
    "hard_stiffness": ([0.0, 1e8], fi.Contact.layers(1e5, 1.2, depth=1e-4, hard_stiffness=1e8)),
    "hard_exponent": ([1.0, 2.0], fi.Contact.layers(1e5, 1.2, depth=1e-4, hard_stiffness=1e7)),
    "yield_approach": ([0.0, 1e-4], fi.Contact.elastic_plastic(2e6, yield_approach=1e-4)),
    "hysteresis": ([0.0, 0.4], fi.Contact.felt(2e6, 1.5, hysteresis=0.2, relaxation=1e-3)),
    "relaxation": ([1e-4, 1e-2], fi.Contact.felt(2e6, 1.5, hysteresis=0.2, relaxation=1e-3)),
}


@pytest.mark.parametrize("name", LOSING)
def test_contacts_that_lose_vary_by_name(name):
    values, law = LOSING[name]
    striker = fi.Striker.rigid(0.03)
    table = fi.sweep(plate(), striker, law, at=AT, speed=1.0, over={f"contact.{name}": values})
    for i, value in enumerate(values):
        hit = fi.strike(plate(), striker, replace(law, **{name: value}), at=AT, speed=1.0, tolerance=1e-3)
        cell = table.isel({name: i})
        assert int(cell.n_impacts) == hit.n_impacts
        assert_allclose(float(cell.restitution), hit.restitution, atol=1e-3)
        assert_allclose(float(cell.impulse), hit.impulse, rtol=1e-3)
    assert abs(float(table.restitution[0]) - float(table.restitution[1])) > 2e-3  # the number does matter
    assert (table.failure == "").all()


def test_speed_matters_under_a_hard_layer():
    """A linear contact scales with the speed; not one that bottoms."""
    law = fi.Contact.layers(1e5, 1.0, depth=2e-4, hard_stiffness=1e7, hard_exponent=1.0)
    table = fi.sweep(plate(), fi.Striker.rigid(0.03), law, at=AT, speed=1.0, over={"speed": [0.1, 2.0]})
    force = table.peak_force.values
    assert force[1] > 1.5 * 20.0 * force[0]


def test_speed_only_scales_the_forces_of_linear_springs():
    over = {"speed": [0.5, 1.0, 3.0], "stiffness": [5e4, 8e5]}
    table = fi.sweep(plate(), stick(), fi.Contact.linear(1e5), at=AT, speed=7.0, over=over)
    direct = fi.sweep(plate(), stick(), fi.Contact.linear(1e5), at=AT, speed=3.0, over={"stiffness": [5e4, 8e5]})
    assert_allclose(table.contact_time.sel(speed=3.0), direct.contact_time, rtol=1e-12)
    assert_allclose(table.peak_force.sel(speed=3.0), direct.peak_force, rtol=1e-12)
    assert_allclose(table.impulse.sel(speed=0.5) * 6.0, direct.impulse, rtol=1e-12)


def test_layers_of_ones_own():
    layers = {"kept": lambda hit: hit.energies["striker"]}
    table = fi.sweep(
        plate(), stick(), fi.Contact.linear(1e5), at=AT, speed=1.0, over={"strike.speed": [1.0, 2.0]}, layers=layers
    )
    assert_allclose(table.kept[1], 4.0 * table.kept[0], rtol=1e-3)  # energy goes with the square of the speed


def test_points_are_an_axis_with_coordinates():
    table = fi.sweep(plate(), stick(), fi.Contact.linear(1e5), at=AT, speed=1.0, over={"at": [(0.2, 0.3), (0.4, 0.5)]})
    assert_allclose(table.at_x, [0.2, 0.4])
    assert_allclose(table.at_y, [0.3, 0.5])


def test_bodies_known_at_their_points_only_give_the_same():
    case = cells.Case(plate(), stick(), fi.Contact.linear(4e5), np.array(AT), 1.0)
    table = cases.Cases(case, {"mass": np.array([0.05, 0.1])}, 1e-3)
    whole, few = cases.solve_cases(table, 0, 2)[0], cases.solve_cases(table.sampled(), 0, 2)[0]
    assert_allclose(few, whole, rtol=1e-9)  # the same numbers but for rounding in the compliance
    one, two = (each.row(each.blow(1)) for each in (table.sampled(), table))
    assert_allclose(one, two, rtol=1e-9)


@pytest.mark.parametrize(
    ("over", "message"),
    [
        ({}, "over must name at least one axis"),
        ({"masss": [1.0]}, "over must be one of .*did you mean 'mass'"),
        ({"mass": [0.1, -1.0]}, "mass must be positive, got -1 kg"),
        ({"mass": []}, "must contain at least one value"),
        ({"mass": [0.1], "striker.mass": [0.1]}, "names the axis mass twice"),
        ({"stiffness": [1e5, np.nan]}, r"over\['stiffness'\] must be finite"),
        ({"exponent": [0.1]}, "exponent must lie between"),
        ({"at": [(9.0, 0.1)]}, "must lie on the body"),
    ],
)
def test_wrong_axes_are_told_at_once(over, message):
    with pytest.raises(ValueError, match=message):
        fi.sweep(plate(), stick(), fi.Contact.linear(1e5), at=AT, speed=1.0, over=over)


def test_sweep_stays_a_function_whatever_was_imported():
    import fem_impact.sweeps.grid  # noqa: F401

    assert callable(fi.sweep)


@pytest.mark.parametrize("seed", range(6))
def test_random_cells_over_four_axes_of_random_scenes(seed):
    """Plates, bars and disks, sticks and masses, all laws, light and heavy, near the threshold and far."""
    rng = np.random.default_rng(seed)
    size = {"mass": 10.0 ** rng.uniform(-1.2, 1.0), "first_frequency": 10.0 ** rng.uniform(1.5, 2.7)}
    modes, at = (
        (fi.analytic.rectangle(1.55, 1.0, n_modes=120, damping_ratio=0.01 * (seed % 2), **size), (0.4, 0.35)),
        (fi.analytic.beam(1.0, ends=("free", "free"), n_modes=40, **size), [rng.uniform(0.0, 1.0)]),
        (fi.analytic.disk(0.5, edge="clamped", n_modes=60, **size), rng.uniform(-0.3, 0.3, 2)),
    )[seed % 3]
    striker = fi.Striker.rigid(0.02) if seed % 2 else fi.Striker.stick(0.05, 10.0 ** rng.uniform(2.5, 4.0))
    exponent, stiffness = (1.0, 1.2, 1.5)[seed // 2], 10.0 ** rng.uniform(4.0, 6.0)
    over = {
        "mass": 10.0 ** rng.uniform(-2.3, -0.5, 3),
        "stiffness": stiffness * np.array([0.3, 1.0, 3.0, 100.0]),
        "speed": [0.5, 3.0],
        "target_mass": size["mass"] * np.array([1.0, 3.0]),
    }
    law = fi.Contact(stiffness, exponent, gap=1e-3 * (seed % 2))
    table = fi.sweep(modes, striker, law, at=at, speed=1.0, over=over)
    for _ in range(10):
        cell = table.isel({name: int(rng.integers(len(values))) for name, values in over.items()})
        hit = fi.strike(
            modes.scaled(mass=float(cell.target_mass)),
            fi.Striker.flexible(striker.modes.scaled(mass=float(cell.mass)), at=striker.at),
            replace(law, stiffness=float(cell.stiffness)),
            at=at,
            speed=float(cell.speed),
            tolerance=1e-4,
        )
        assert int(cell.n_impacts) == hit.n_impacts
        assert_allclose(float(cell.restitution), hit.restitution, atol=1.1e-3)  # 1e-3, and 1e-4 of the single blow
        for layer in ("contact_time", "impulse", "peak_force"):
            assert_allclose(float(cell[layer]), getattr(hit, layer), rtol=1.1e-3)


STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
L_SHAPE = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.15), (0.2, 0.15), (0.2, 0.3), (0.0, 0.3)]  # [m]
BODIES = {  # mesh, section, supports, modes kept, point struck
    "L-shaped plate": lambda: (fi.mesh.polygon(L_SHAPE), fi.Plate(STEEL, 1.5e-3), "boundary=hinged", 100, (0.1, 0.12)),
    "free plate": lambda: (fi.mesh.rectangle(0.3, 0.2), fi.Plate(STEEL, 3e-3), "boundary=free", 100, (0.13, 0.08)),
    "free bar": lambda: (
        fi.mesh.line(0.35), fi.Beam.rectangular(STEEL, width=0.05, height=0.02), "left=free right=free", 30, (0.11,)
    ),
    "cantilever": lambda: (
        fi.mesh.line(0.35), fi.Beam.rectangular(STEEL, width=0.02, height=0.003), "left=clamped right=free", 30, (0.3,)
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_cells_on_finite_element_modes_are_single_strikes(body, exponent):
    """From the outline to the map: hammers of 0.1 to 100 g, springs over six decades, chatter among them."""
    mesh, section, edges, n_modes, at = BODIES[body]()
    system = fi.assemble(mesh, section, supports=dict(edge.split("=") for edge in edges.split()))
    modes = fi.find_modes(system, n_modes=n_modes)
    over = {
        "mass": np.geomspace(1e-4, 0.5, 9),
        "stiffness": np.geomspace(1e3, 1e9, 13) * 10.0 ** (4.0 * exponent - 4.0),
    }
    law, tolerance = fi.Contact.power(1.0, exponent), 1e-3
    table = fi.sweep(modes, fi.Striker.rigid(0.01), law, at=at, speed=1.0, over=over, tolerance=tolerance)
    rng, apart = np.random.default_rng(7), []
    for place in rng.integers((9, 13), size=(12, 2)):
        cell = table.isel(dict(zip(over, place)))
        striker, spring = fi.Striker.rigid(float(cell.mass)), fi.Contact.power(float(cell.stiffness), exponent)
        try:
            hit = fi.strike(modes, striker, spring, at=at, speed=1.0, tolerance=tolerance)
        except fi.SimulationError as error:
            assert "the step error stays" in str(error) and (str(cell.failure.values) or not cell.tolerance_met)
            continue
        if hit.error.total > 100.0 * tolerance:  # chatter whose small errors grow; the cell says so too
            assert not cell.tolerance_met
            continue
        assert not str(cell.failure.values)
        assert int(cell.n_impacts) == hit.n_impacts
        layers = ("contact_time", "peak_force", "impulse")
        relative = [float(cell[layer]) / getattr(hit, layer) - 1.0 for layer in layers]
        apart.append(np.abs([float(cell.restitution) - hit.restitution, *relative]).max() / tolerance)
    assert max(apart) < 2.0  # each within one tolerance of the truth
    assert np.mean(np.array(apart) < 1.0) > 0.9  # two of 1300 cells were more than one apart, by 1.3
