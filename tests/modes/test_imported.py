"""Files of other programs are read as bodies, and what they lack is said."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scenes import BODIES
from test_body import STEEL, body_of, hinged

import fem_impact as fi

pytestmark = pytest.mark.usefixtures("read_here")


def test_universal_files_hold_bodies(tmp_path):
    pyuff = pytest.importorskip("pyuff", reason="the uff extra is not installed")
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.4, 0.3), fi.Plate(STEEL, 2e-3)), n_modes=8)
    path = tmp_path / "plate.uff"
    fi.export.write_uff(path, modes)
    body, plain = fi.Body.load(path, mass=modes.mass), fi.Modes.from_uff(path, mass=modes.mass)
    points = plain.shapes.grid()[0]
    assert_allclose(np.abs(body.modes("normal").shape_at(points)), np.abs(plain.shape_at(points)))
    assert np.array_equal(body.modes("z").shapes.grid()[1], plain.shapes.grid()[1])
    load = 1e-6 * np.random.default_rng(0).standard_normal((len(points), 3))
    head = {"type": 2414, "analysis_dataset_label": 1, "analysis_dataset_name": "unit load", "dataset_location": 1,
            "id1": "NONE", "id2": "NONE", "id3": "NONE", "id4": "NONE", "id5": "NONE", "model_type": 1,
            "data_characteristic": 2, "result_type": 8, "data_type": 2,
            "number_of_data_values_for_the_data_component": 3, "node_nums": body.numbers}  # fmt: skip
    fields = {f"record{k}_field{i}": 0 for k, n in ((10, 8), (11, 8), (12, 6), (13, 6)) for i in range(1, n + 1)}
    text = path.read_text()
    pyuff.UFF(str(path)).write_sets([head | fields | {"analysis_type": 1, "data_at_node": list(load)}], mode="add")
    assert path.read_text().startswith(text[:1000])
    again = fi.Body.load(path, mass=1.0, loads=[(3, (0.0, 0.0, 1.0))])
    assert_allclose(again.static[:, :, 0], load, rtol=1e-5)  # six digits are written
    assert again.shapes.shape == body.shapes.shape
    apart = {name: getattr(again, name) for name in ("frequencies", "shapes", "nodes", "numbers")}
    kept = [s for s in pyuff.UFF(str(path)).read_sets() if s["type"] != 55]
    pyuff.UFF(str(path)).write_sets(kept, mode="overwrite")
    both = fi.Body.load([path, apart], mass=1.0, loads=[(3, (0.0, 0.0, 1.0))])
    assert_allclose(both.static[:, :, 0], load, rtol=1e-5)


def test_what_files_lack_is_said(tmp_path):
    plate, points = hinged(5)
    body = body_of(plate, points)
    line = fi.Body([1.0], np.ones((3, 3, 1)), np.eye(3)[[0, 0, 0]] * [[0], [1], [2]], mass=1.0)
    paths = [tmp_path / "one.npz", tmp_path / "two.npz"]
    body.save(paths[0])
    fi.Body(body.frequencies, body.shapes[:-1], body.nodes[:-1], mass=1.0, cells=np.zeros((0, 3), int)).save(paths[1])
    told = {"shapes": (("n", "x", "m"), body.shapes), "nodes": (("n", "x"), body.nodes)}
    moved = xr.Dataset(told | {"frequencies": ("m", body.frequencies)})
    for call, said in (
        (lambda: body.modes("up"), "direction must be one of normal, x, y, z"),
        (lambda: body.modes((0.0, 0.0, 0.0)), "direction must not be zero"),
        (line.modes, "neither cells nor a plane define the normals"),
        (
            lambda: fi.Body.load(tmp_path / "body.odb", mass=1.0),
            r"files must be one of \.uff, .* 'body.odb'; convert it",
        ),
        (lambda: fi.Body.load(BODIES / "plate.inp", mass=1.0), "files must hold modes"),
        (lambda: fi.Body.load(paths), "files must be about the same nodes; export all results of one"),
        (lambda: fi.Body.load(xr.Dataset(told), mass=1.0), "files must hold modes"),
        (lambda: fi.Body.load(moved), "mass must be given in kg"),
    ):
        with pytest.raises(ValueError, match=said):
            call()


def test_shapes_by_tonnes_and_places_in_millimetres_are_told():
    plate, points = hinged(5)
    body = body_of(plate, points)
    told = {name: getattr(body, name) for name in ("frequencies", "shapes", "nodes", "mass")} | {"damping_ratio": 0.01}
    other = fi.Body.load(told | {"shapes": body.shapes / 1000.0**0.5, "nodes": 1000.0 * body.nodes}).modes("z")
    said = "; ".join(note for note in other.notes if note not in fi.Body.load(told).modes("z").notes)
    assert "length of 400 m is larger" in said and "they are expected mass-normalised, and 1 t**-0.5 is 0.0316" in said
    assert set(other.damping_ratio) == {0.01}


def test_models_of_sdypy_are_bodies():
    """Receptances of three modes of a hinged plate from a driving point: shapes to 1 % of the largest."""
    ema = pytest.importorskip("sdypy.EMA", reason="sdypy-EMA is not installed")
    plate, points = hinged(3, (5, 5))
    drive, frequencies = 6, 0.5 * np.arange(1401)
    omega, own = 2.0 * np.pi * frequencies[:, None], plate.omega
    below = own**2 - omega**2 + 2j * plate.damping_ratio * own * omega  # (n_frequencies, n_modes)
    rows = plate.shape_at(points)
    for form, factor in (("receptance", 1.0), ("accelerance", -(omega[:, 0] ** 2))):
        responses = (rows * rows[drive]) @ (1.0 / below).T * factor
        model = ema.Model(responses, frequencies, lower=20, upper=600, pol_order_high=40, driving_point=drive,
                          frf_form=form)  # fmt: skip
        with pytest.raises(ValueError, match=r"scaled modes: give .* driving_point and call get_constants\(\)"):
            fi.Body.load(SimpleNamespace(nat_freq=[1.0], nat_xi=[0.0]), mass=1.0)
        model.get_poles(show_progress=False)
        model.select_closest_poles(list(plate.frequencies[:3]))
        model.get_constants(f_upper=590)  # its own limit is out of its range by a line
        places = {"nodes": np.column_stack([points, np.zeros(len(points))]), "direction": "z"}
        body = fi.Body.load([model, places], mass=plate.mass)
        assert_allclose(body.frequencies, plate.frequencies[:3], rtol=1e-3)
        assert_allclose(body.damping_ratio, 0.01, rtol=0.02)
        found, wanted = body.shapes[:, 2], rows[:, :3] * np.sign(rows[drive, :3])
        assert_allclose(found, wanted, atol=0.01 * np.abs(wanted).max())
    with pytest.raises(ValueError, match=r"direction of what was measured: add {'direction': 'z'}"):
        fi.Body.load([model, {"nodes": places["nodes"]}], mass=1.0)
    model.A = model.A * np.exp(1j)
    with pytest.raises(ValueError, match=r"files must hold real modes, positive at their driving point; that at"):
        fi.Body.load([model, places], mass=1.0)


def test_models_of_pyfbs_are_bodies():
    """By the attributes of `pyfbs.Model` 1.0: unknowns by node from 1 and axis from 0, frequencies in Hz."""
    plate, points = hinged(5)
    want = body_of(plate, points)
    nodes, n = want.nodes, len(points)
    dofs = np.column_stack([np.repeat(np.arange(1, n + 1), 6), np.tile(np.arange(6), n)])
    vectors = np.zeros((6 * n, 5))
    for axis in range(3):
        vectors[axis::6] = want.shapes[:, axis]
    model = SimpleNamespace(nodes=nodes, dof_ref=dofs, eig_vec=vectors, eig_freq=plate.frequencies, mesh=None)
    body = fi.Body.load(model, mass=plate.mass)
    assert_allclose(body.shapes, want.shapes)
    assert_allclose(body.frequencies, plate.frequencies)
    model.eig_vec = vectors * 1j
    with pytest.raises(ValueError, match="files must hold real modes; solve the pyFBS model undamped"):
        fi.Body.load(model, mass=1.0)


def test_a_negative_eigenvalue_is_a_rigid_motion_only_if_it_is_tiny():
    told = {"shapes": np.ones((1, 3, 3)), "nodes": np.zeros((1, 3)), "mass": 1.0}
    assert fi.Body.load(told | {"frequencies": [-1e-6, 1e-3, 110.0]}).frequencies.tolist() == [0.0, 0.0, 110.0]
    for wrong, said in (
        ("ab", "frequencies must be numbers in Hz, got 'ab'"),
        (1.0, r"frequencies must have shape"),
        (np.ones((2, 2)), r"frequencies must have shape"),
        ([1.0, 2.0], r"shapes must be as many as the 2 frequencies, got them in shape \(1, 3, 3\)"),
        ([-40.0, 1e-3, 110.0], "a stable body, but the mode at -40 Hz has a negative eigenvalue, too large"),
    ):
        with pytest.raises(ValueError, match=said):
            fi.Body.load(told | {"frequencies": wrong})


def test_a_mount_is_no_rigid_motion():
    """At 1 % of the next mode rounding shows in what is negative; a mount of 5 Hz was taken as rigid in silence."""
    told = {"shapes": np.random.default_rng(0).normal(size=(4, 3, 3)), "nodes": np.eye(4, 3), "mass": 1.0}
    for given, n_rigid in (
        ([5.0, 6.0, 800.0], 0),
        ([0.01, 0.02, 110.0], 2),
        ([-0.3, 0.8, 110.0], 2),
        ([-1e-3, 5.0, 800.0], 1),
    ):
        assert np.count_nonzero(fi.Body.load(told | {"frequencies": given}).frequencies == 0.0) == n_rigid


def test_a_mode_told_twice_is_refused():
    """Two modes of one frequency differ at some of four nodes, and at fewer they may not."""
    shapes = np.random.default_rng(1).normal(size=(4, 3, 2))[..., [0, 1, 1]]
    told = {"nodes": np.eye(4, 3), "mass": 1.0, "frequencies": [9.0, 90.0, 90.0], "shapes": shapes}
    fi.Body.load(told | {"nodes": np.eye(1, 3), "shapes": shapes[:1]})
    with pytest.raises(ValueError, match="files must hold each mode once, but that at 90 Hz is there twice"):
        fi.Body.load(told)
