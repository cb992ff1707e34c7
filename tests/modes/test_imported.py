"""Files of other programs are read as bodies, and what they lack is said."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from test_body import STEEL, body_of, hinged

import fem_impact as fi

FILES = Path(__file__).parents[1] / "bodies"
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


def test_what_files_lack_is_said(tmp_path):
    plate, points = hinged(5)
    body = body_of(plate, points)
    with pytest.raises(ValueError, match="direction must be one of normal, x, y, z"):
        body.modes("up")
    with pytest.raises(ValueError, match="direction must not be zero"):
        body.modes((0.0, 0.0, 0.0))
    line = fi.Body([1.0], np.ones((3, 3, 1)), np.eye(3)[[0, 0, 0]] * [[0], [1], [2]], mass=1.0)
    with pytest.raises(ValueError, match="neither cells nor a plane tell the normals"):
        line.modes()
    with pytest.raises(ValueError, match=r"files must be one of \.uff, .* got 'body.odb'; convert it"):
        fi.Body.load(tmp_path / "body.odb", mass=1.0)
    with pytest.raises(ValueError, match="files must hold modes"):
        fi.Body.load(FILES / "plate.inp", mass=1.0)
    paths = [tmp_path / "one.npz", tmp_path / "two.npz"]
    body.save(paths[0])
    fi.Body(body.frequencies, body.shapes[:-1], body.nodes[:-1], mass=1.0, cells=np.zeros((0, 3), int)).save(paths[1])
    with pytest.raises(ValueError, match="files must be about the same nodes; export all results of one"):
        fi.Body.load(paths)
    told = {"shapes": (("n", "x", "m"), body.shapes), "nodes": (("n", "x"), body.nodes)}
    with pytest.raises(ValueError, match="files must hold modes"):
        fi.Body.load(xr.Dataset(told), mass=1.0)
    with pytest.raises(ValueError, match="mass must be given in kg"):
        fi.Body.load(xr.Dataset(told | {"frequencies": ("m", body.frequencies)}))
