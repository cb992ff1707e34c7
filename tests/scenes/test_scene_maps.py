"""Maps of scenes, their pictures and files, the choice of a hammer, and both at the prompt."""

import json
import os
import re
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray
from comparing import worst
from numpy.testing import assert_allclose
from scenes import BAR, QUICK, SHIPPED, edited, load_text

import fem_impact as fi
from fem_impact.fe import refinement
from fem_impact.model.target import Target
from fem_impact.modes import ritz
from fem_impact.scenes import maps
from fem_impact.scenes.scene import scene_of
from fem_impact.scenes.schema import Part
from fem_impact.show import plots
from fem_impact.sweeps import grid
from fem_impact.sweeps.cells import ALIASES, AXES

OVER = {"contact.stiffness": [2e4, 1e5, 4e5], "striker.mass": [0.02, 0.06, 0.1]}


@pytest.fixture(scope="module")
def scene():
    return fi.load_scene(SHIPPED / "drumstick_map.toml")


@pytest.fixture(scope="module")
def table(scene):
    return maps.map_scene(scene, over=OVER, max_frequency=3e3, borders=True)


def test_cells_of_a_scene_map_are_struck_scenes(scene, table):
    changed = maps.changed_scene(maps.changed_scene(scene, "contact.stiffness", 1e5), "striker.mass", 0.02)
    assert worst(table.sel(stiffness=1e5, mass=0.02), changed.strike()) < 2e-3  # 1e-3 each


def test_a_map_says_that_it_does_not_follow_the_quantity_of_the_single_blow(tmp_path):
    scene = load_text(tmp_path, QUICK.replace("tolerance = 1e-2", 'tolerance = 1e-2\nquantity = "spectrum=5000"'))
    assert "quantity of [strike] is of the single blow" in maps.map_scene(scene).attrs["notes"]


def test_what_fails_in_a_scene_names_its_file_once(tmp_path, monkeypatch):
    """Of a key of [target] that the strike gets, that table; of a simulation that fails, the file alone."""
    stretched = load_text(tmp_path, QUICK.replace("[target]", "[target]\nstretching = true"))
    for run in (stretched.strike, partial(maps.map_scene, stretched)):
        with pytest.raises(ValueError, match=rf"^{re.escape(str(stretched.path))}: \[target\] stretching=True works"):
            run()

    def fail(*_, **__):
        raise fi.SimulationError("no mesh is fine enough")

    monkeypatch.setattr(Target, "find", fail)
    for run in (partial(stretched.modes, 5), partial(maps.map_scene, stretched), stretched.plan):
        with pytest.raises(fi.SimulationError, match=rf"^{re.escape(str(stretched.path))}: no mesh is fine enough$"):
            run()


def test_theory_stands_beside_the_blows(table):
    felt = table.mass.values / 3.0
    expected = np.sqrt(table.stiffness.values[:, None] / felt) / (2.0 * np.pi)
    assert_allclose(table.contact_resonance, expected, rtol=1e-6)  # the stick's felt mass by finite elements
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300)
    wanted = [fi.threshold_frequency(plate, (0.465, 0.3), m) for m in felt]
    assert table.threshold.dims == ("mass",)
    assert_allclose(table.threshold, wanted, rtol=0.01)  # other numbers of modes, the rest by their tail
    assert json.loads(table.attrs["scene"])["map"]["striker.mass"] == OVER["striker.mass"]


@pytest.mark.parametrize(
    ("line", "axes"),
    [
        ('air = "both sides"', {"target.first_frequency": 150.0, "target.damping_ratio": 0.03, "target_mass": 0.3}),
        ("damping_ratio = { frequency = [10.0, 1e4], ratio = [1e-3, 0.1] }", {"target.first_frequency": 200.0}),
    ],
)
def test_axes_that_do_not_rescale_the_body_make_it_anew(line, axes, tmp_path):
    """Air does not weigh or radiate more where the plate does: rescaled modes were 2e-3 off, 4e-5 stated."""
    scene = load_text(tmp_path, edited("[target]", f"[target]\n{line}", QUICK))
    for name, value in axes.items():
        table = maps.map_scene(scene, over={name: [value]}, tolerance=1e-3)
        dimension = ALIASES.get(name, name)
        assert table.n_impacts.dims == (dimension,) and "units" in table[dimension].attrs
        hit = maps.changed_scene(scene, AXES[dimension][2], value).strike(tolerance=1e-3)
        assert worst(table.isel({dimension: 0}), hit) < 2e-3  # 1e-3 each
        with pytest.raises(ValueError, match=f"vary: {name} does not rescale air"):
            fi.spread(scene, {name: f"lognormal({value}, 0.1)"}, n=8)


def test_axes_keep_their_order_and_may_have_one_value(tmp_path, prompt):
    over = '"contact.stiffness" = [1e4, 3e4], "mesh.length" = [0.465]'
    load_text(tmp_path, QUICK.partition("[map]")[0] + f"[map]\nover = {{ {over} }}\n")
    said = prompt(f"map {tmp_path / 'scene.toml'} --out {tmp_path / 'out'}")
    assert said.status == 0 and "over stiffness (2), mesh.length (1)" in said.out


@pytest.mark.parametrize("masses", [[0.1, 0.1, 0.02], [0.1, 0.02, 0.05]])
def test_axes_with_values_twice_or_out_of_turn_are_drawn(scene, masses):
    table = maps.map_scene(scene, over={"mass": masses, "stiffness": [1e4, 1e5]})
    assert maps.draw(table, "contact_time").axes


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("at = [0.1395", "at = [9.0", "[strike] at must lie on the body"),
        ("at = [0.1395, 0.09]", "at = [[0.1395, 0.09]]", "[strike] at must be one point"),
        ("tolerance = 1e-2", "tolerance = 7.0", "[strike] tolerance must lie between"),
        ("speed = 2.0", "speed = 2.0\ndt = 1e-5", "[strike] dt must be left out here"),
        ("speed = 2.0", 'speed = 2.0\nscheme = "A"', "[strike] scheme must be left out here"),
        ("mass = 0.03", "mass = 0.03\ngravity = 9.8", "[striker] striker must not fall in a map"),
        ("OVER", "mass = [-1.0, 1.0]", "[map] over['mass'] must be positive, got -1 kg"),
        ("OVER", '"contact.hysteresis" = [2.0]', "[map] hysteresis must lie between 0 and 1, got 2"),
        ("OVER", "mass = [[1.0]]", "[map] over['mass'] must have shape"),
        ("OVER", '"target.mass" = []', "[map] over['target.mass'] must contain at least one value"),
        ("OVER", '"mesh.length" = []', "[map] over['mesh.length'] must contain at least one value"),
    ],
)
def test_errors_of_many_blows_name_the_file_and_the_table(old, new, said, tmp_path):
    text = QUICK.partition("[map]")[0] + "[map.over]\n" + ("OVER" if old == "OVER" else "mass = [0.1]")
    with pytest.raises(ValueError, match=re.escape(f"scene.toml: {said}")):
        maps.map_scene(load_text(tmp_path, edited(old, new, text)))


@pytest.mark.parametrize("line", ["", 'air = "both sides"'])
def test_an_axis_by_two_names_is_refused(line, tmp_path):
    scene = load_text(tmp_path, edited("[target]", f"[target]\n{line}", QUICK))
    with pytest.raises(ValueError, match="over names the axis target_mass twice"):
        maps.map_scene(scene, over={"target.mass": [0.2], "target_mass": [0.3]})


def test_modes_in_air_are_not_rescaled():
    plate = fi.in_air(fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=6))
    blow = fi.Striker.rigid(0.03), fi.Contact.linear(1e4)
    for name in ("target_mass", "target.first_frequency"):
        with pytest.raises(ValueError, match=f"must not name {name} for modes in air"):
            fi.sweep(plate, *blow, at=(0.14, 0.09), speed=1.0, over={name: [0.3]})
    damped = fi.sweep(plate, *blow, at=(0.14, 0.09), speed=1.0, over={"target.damping_ratio": [0.3]})
    assert worst(damped.isel(damping_ratio=0), fi.strike(plate.damped(0.3), *blow, at=(0.14, 0.09), speed=1.0)) < 2e-3


def test_many_blows_have_the_model_that_the_scene_requires(tmp_path):
    """A hard blow on a thick bar: shear changes its peak force by 4e-3, which "auto" takes in at 1e-3."""
    text = edited("{ x = [0.0, 0.175], values = [0.05, 0.04] }", "0.05", BAR).replace("1e5", "1e6")
    bar = load_text(tmp_path, text.replace("[target]", '[target]\nmodel = "auto"').replace("1e-2", "1e-3"))
    chosen = bar.strike()
    assert abs(bar.strike(model="stated").peak_force / chosen.peak_force - 1.0) > 3e-3
    table = maps.map_scene(bar, over={"strike.speed": [1.0, 2.0]})
    assert worst(table.sel(speed=1.0), chosen) < 2e-3  # 1e-3 each
    found = fi.spread(bar, {"strike.speed": "uniform(0.999999, 1.000001)"}, n=8, sobol=False)
    assert found.quantile("peak_force", 0.5).value == pytest.approx(chosen.peak_force, rel=2e-3)
    for notes in (table.attrs["notes"], "\n".join(found.notes)):
        assert "theory = timoshenko" in notes


LOSING = {  # the law, and values of one of its numbers
    "layers": ({"stiffness": 1e5, "exponent": 1.2, "depth": 2e-4, "hard_stiffness": 1e7}, "depth", [1e-4, 1e-3]),
    "felt": ({"stiffness": 2e6, "exponent": 1.5, "hysteresis": 0.4, "relaxation": 1e-3}, "hysteresis", [0.1, 0.8]),
    "elastic_plastic": ({"stiffness": 2e6, "yield_approach": 1e-4}, "yield_approach", [5e-5, 1e-3]),
}


@pytest.mark.parametrize("kind", LOSING)
def test_contacts_that_lose_are_mapped(scene, kind):
    law, key, values = LOSING[kind]
    losing = replace(scene, contact=Part(kind, law))
    table = maps.map_scene(losing, over={f"contact.{key}": values, "strike.speed": [1.0]})
    hit = maps.changed_scene(losing, f"contact.{key}", values[1]).strike()
    assert worst(table.isel({key: 1, "speed": 0}), hit) < 2e-3  # 1e-3 each
    assert set(table.contact_resonance.dims) == {key, "speed"}  # it depends on every number of the law
    assert abs(float(table.contact_resonance[0, 0] / table.contact_resonance[1, 0]) - 1.0) > 0.05


def test_any_number_of_a_scene_is_an_axis(scene):
    over = {"target.damping_ratio": [0.0, 0.01], "mesh.width": [1.0, 0.8], "strike.speed": [1.0, 2.0]}
    table = maps.map_scene(scene, over=over)
    assert dict(table.sizes) == {"mesh.width": 2, "damping_ratio": 2, "speed": 2}
    assert float(abs(table.contact_time.diff("mesh.width")).min()) > 0.0
    with pytest.raises(ValueError, match=r"mesh.widht is not an axis; did you mean 'mesh.width'"):
        maps.map_scene(scene, over={"mesh.widht": [1.0]})


def test_files_say_what_the_map_holds_and_borders_are_drawn(table, tmp_path):
    assert {"map.nc", "map.csv", "borders.csv", "n_impacts.png", "centroid.png"} <= set(maps.write_map(tmp_path, table))
    with xarray.open_dataset(tmp_path / "map.nc", engine="scipy") as read:
        assert_allclose(read.contact_time, table.contact_time)
        assert read.contact_time.attrs["units"] == "s" and read.attrs["scene"] == table.attrs["scene"]
    assert len((tmp_path / "map.csv").read_text().splitlines()) == 10
    assert (tmp_path / "restitution.png").read_bytes()[:4] == b"\x89PNG"
    curves = fi.read_borders(table)
    assert len((tmp_path / "borders.csv").read_text().splitlines()) == 1 + sum(len(each.points) for each in curves)
    drawn = maps.draw(table.assign(doubtful=table.n_impacts == 2), "n_impacts")
    lines = next(part for part in drawn.axes[0].collections if part.get_label() == "borders")
    first = curves[0].points[0]
    assert_allclose(lines.get_paths()[0].vertices[0], [1e3 * first[1], first[0]], rtol=1e-12)  # masses in grams
    said = [text.get_text() for text in drawn.legends[0].get_texts()]
    assert said[:2] == ["number in doubt", "the number of impacts changes"]


@pytest.mark.slow
def test_a_scene_that_gives_no_counts_is_a_picture(tmp_path, prompt):
    text = (
        (SHIPPED / "drumstick_map.toml").read_text().replace(", count = 20", "").replace("max_frequency", "# no band")
    )
    (tmp_path / "ranges.toml").write_text(text)
    told = prompt("map ranges.toml --cells 12 --out out --workers 1")
    assert told.status == 0 and "144 blows over stiffness (12), mass (12)" in told.out
    assert "Cells: all 144 cells computed" in told.out
    assert "between numbers of impacts, located to" in " ".join(told.out.split())
    assert "all 144 cells are expected to take" in " ".join(told.err.split())
    with xarray.open_dataset(tmp_path / "out" / "map.nc", engine="scipy") as read:
        assert len(fi.read_borders(read)) > 0 and len(json.loads(read.attrs["scene"])["map"]["striker.mass"]) == 12


def test_another_body_for_each_value_needs_a_count_and_a_store(scene, tmp_path):
    over = {"mesh.width": {"from": 0.8, "to": 1.0}, "striker.mass": {"from": 0.05, "to": 0.1}}
    with pytest.raises(ValueError, match=r"mesh\.width needs a count, because each value needs another body"):
        maps.map_scene(scene, over=over)
    over["mesh.width"]["count"] = 2
    with pytest.raises(ValueError, match=r"borders must be left out for axes that need another body, got mesh\.width"):
        maps.map_scene(scene, over=over, cells=3, borders=True)
    table = maps.map_scene(scene, over=over, cells=3, store=tmp_path / "map")
    assert dict(table.sizes) == {"mesh.width": 2, "mass": 3}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["map-0", "map-1"]


def test_contours_of_a_power_law_are_where_it_says():
    x, y = np.linspace(0.01, 0.2, 4), np.geomspace(1e4, 1e6, 3)
    finer_x, finer_y, data = plots._finer(x, y, np.sqrt(y[:, None] / x))
    assert data.shape == (17, 25)
    assert_allclose(data, np.sqrt(finer_y[:, None] / finer_x), rtol=1e-12)  # rounding of logarithms


def test_zarr_keeps_why_a_cell_failed(table, tmp_path):
    failed = table.drop_vars(["restitution", "impulse", "peak_force", "centroid"]).copy(deep=True)  # fewer pictures
    failed["failure"] = failed.failure.astype("<U40")
    failed.failure[1, 0] = "the motion may be chaotic: é"
    maps.write_map(tmp_path, failed, "zarr")
    with xarray.open_zarr(tmp_path / "map.zarr") as read:
        assert read.failure.values.tolist() == failed.failure.values.tolist()
        assert_allclose(read.contact_time, table.contact_time)


def test_too_large_a_map_is_refused_and_a_costly_one_says_so(tmp_path, prompt):
    text = (SHIPPED / "drumstick_map.toml").read_text()
    for count, words in (
        (10**6, ("over asks for 1e+12 cells: about",
                 # nine layers and two more numbers of 8 byte
                 "8.8e+04 GB of memory; give fewer values, or raise max_cells, now 1e+08")),
        (10**12, ("stiffness.count must be at most 1000000, got",)),
    ):  # fmt: skip
        (tmp_path / "large.toml").write_text(text.replace("count = 20", f"count = {count}"))
        told = prompt("map large.toml --out out")
        assert told.status == 2 and all(each in " ".join(told.err.split()) for each in words)
    said = []
    grid.admit_size(10**8, 6, 1e9, tell=said.append)
    grid.admit_size(10**4, 6, 1e9, tell=said.append)
    assert len(said) == 1 and "6.4 GB of memory" in said[0]


@pytest.mark.parametrize(("law", "over", "seconds"), [
    (fi.Contact.linear(1e5), {}, "3e-05"), (fi.Contact.linear(1e5, loss=0.3), {}, "0.006"),
    (fi.Contact.linear(1e5), {"loss": [0.1]}, "0.006"), (fi.Contact.power(1e5, 0.9), {}, "0.006"),
])  # fmt: skip
def test_a_sweep_counts_what_losses_and_steep_springs_cost_as_a_map_does(law, over, seconds, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=5)
    with pytest.raises(ValueError, match=f"3 cells: about {seconds} s"):
        fi.sweep(
            plate, fi.Striker.rigid(0.1), law, at=(0.45, 0.3), speed=1.0, over={"mass": [0.1, 0.2, 0.3], **over},
            max_cells=2,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("map drumstick_map --out map.png", "--out must name a folder for map.nc, map.csv and pictures"),
        ("hammer drumstick_map --bandwidth 0", "bandwidth must lie between 0.001 and 1e+09 Hz, got 0 Hz"),
        (
            "hammer drumstick_map --bandwidth 500 --masses 1e30 0.2",
            "masses must lie between 1e-06 and 10000 kg, got 1e+30",
        ),
        ("hammer drumstick_map --bandwidth 500 --drop 60", "drop must lie between 1 and 40 dB, got 60 dB"),
    ],
)
def test_slips_at_the_prompt_are_told_before_the_work(line, message, prompt):
    verb, name, *rest = line.split()
    said = prompt([verb, f"{SHIPPED / name}.toml", *rest])
    assert said.status == 2 and message in " ".join(said.err.split())


def test_a_map_that_needs_too_many_modes_says_what_to_leave_out():
    pieces = {
        "mesh": {"shape": "rectangle", "length": 0.3, "width": 0.2},
        "material": {"E": 11e9, "nu": 0.37, "rho": 420.0, "E_across": 0.7e9, "G": 0.7e9},
        "section": {"kind": "plate", "thickness": 2.8e-3},
        "supports": {"boundary": "clamped"},
        "striker": {"kind": "rigid", "mass": 0.005},
        "strike": {"at": [0.13, 0.08], "speed": 1.0, "tolerance": 1e-2},
        "contact": {"kind": "linear", "stiffness": 1e5},
    }
    over = {"striker.mass": [1e-4, 0.1], "contact.stiffness": [1e3, 1e9]}
    told = r"needs about \d+ modes, at most 2000 are allowed; leave out the lightest"
    with pytest.raises(fi.SimulationError, match=told):
        maps.map_scene(scene_of(pieces, Path("plate.toml"), folder=Path()), over=over, tolerance=1e-3)


@pytest.mark.slow
def test_hammer_at_the_prompt(prompt):
    words = ["hammer", SHIPPED / "drumstick_map.toml", "--bandwidth", "400", "--masses", "0.002", "0.2"]
    works = [hammer["softest"] is not None for hammer in prompt("", *words, "--json").json["hammers"]]
    assert works == [True, True, False]  # the second is the last that does
    assert "200 g: no tip reaches 400 Hz and hits once" in " ".join(prompt("", *words).out.split())


@pytest.mark.slow
@pytest.mark.parametrize("residual", [True, False])
def test_a_map_with_a_store_keeps_its_body_too(tmp_path, monkeypatch, residual):
    """The second call finds vectors, or modes, in the file beside the store: of these it only takes a first look."""
    text = QUICK.replace('source = "analytic"', 'source = "fe"').replace("mass = [0.03, 0.05]", "mass = [0.001, 0.002]")
    text = text.replace("speed = 2.0", f"speed = 2.0\nresidual = {str(residual).lower()}")
    (tmp_path / "scene.toml").write_text(text.replace("stiffness = 1e4", "stiffness = 1e6"))
    scene, solved, stages = fi.load_scene(tmp_path / "scene.toml"), [], []
    solve, grow = refinement.solve_on_mesh, ritz.Krylov.grow
    monkeypatch.setattr(refinement, "solve_on_mesh", lambda *args: solved.append(args[1]) or solve(*args))
    monkeypatch.setattr(ritz.Krylov, "grow", lambda *args: solved.append(args[1]) or grow(*args))

    def stage(name):
        stages.append(name)
        return nullcontext()

    first = maps.map_scene(scene, store=tmp_path / "store", stage=stage)
    assert (tmp_path / "store.modes.npz").is_file() and ("vectors" if residual else "modes") in stages
    before = len(solved)
    again = maps.map_scene(fi.load_scene(tmp_path / "scene.toml"), store=tmp_path / "store")
    assert len(solved) - before < before if not residual else len(solved) == before
    assert again.identical(first)
