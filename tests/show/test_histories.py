"""The force of a blow and what it moves, read back by the libraries of other programs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi

TIMES = np.linspace(0.0, 4e-3, 81)  # s
POINTS = [(0.1, 0.1), (0.3, 0.2)]  # m


def force(hit):
    return hit.history.force_at(TIMES, 0)[0]


@pytest.fixture(autouse=True)
def in1d(monkeypatch):
    """Numpy 2.4 lacks it, and pyNastran asks for it."""
    if not hasattr(np, "in1d"):
        monkeypatch.setattr(np, "in1d", np.isin, raising=False)


def test_matrices_of_nastran_hold_all_digits(tmp_path, hit):
    op4 = pytest.importorskip("pyNastran.op4.op4", reason="the nastran extra is not installed")
    fi.export.write_history(tmp_path / "blow.op4", hit, TIMES, at=POINTS)
    read = {name: found[1] for name, found in op4.read_op4(str(tmp_path / "blow.op4"), debug=False).items()}
    assert list(read) == ["TIME", "FORCE", "MOVE", "VELO"]
    assert_allclose(read["TIME"][:, 0], TIMES, rtol=1e-15)
    assert_allclose(read["FORCE"][:, 0], force(hit), rtol=1e-15)
    assert_allclose(read["MOVE"], hit.displacement(POINTS, TIMES), rtol=1e-15)
    assert_allclose(read["VELO"], hit.velocity(POINTS, TIMES), rtol=1e-15)
    fi.export.write_history(tmp_path / "own.op4", hit)
    own = op4.read_op4(str(tmp_path / "own.op4"), debug=False)
    assert_allclose(own["FORCE"][1][:, 0].max(), hit.peak_force, rtol=1e-3)


def test_universal_files_hold_force_and_motion(tmp_path, hit):
    """Six digits of single numbers in text; names, nodes, directions and units are there."""
    pyuff = pytest.importorskip("pyuff", reason="the uff extra is not installed")
    with pytest.raises(ValueError, match="times must be even for a universal file"):
        fi.export.write_history(tmp_path / "blow.uff", hit, [0.0, 1e-3, 1.5e-3])
    fi.export.write_history(tmp_path / "blow.uff", hit, TIMES, at=POINTS, node=17, direction="-z", numbers=[5, 9])
    sets = pyuff.UFF(str(tmp_path / "blow.uff")).read_sets()
    told = [(each["id1"], each["rsp_node"], each["rsp_dir"], each["ref_node"], each["ordinate_axis_units_lab"].strip())
            for each in sets]  # fmt: skip
    assert told == [("force", 17, -3, 17, "N"), ("displacement", 5, -3, 17, "m"), ("displacement", 9, -3, 17, "m"),
                    ("velocity", 5, -3, 17, "m/s"), ("velocity", 9, -3, 17, "m/s")]  # fmt: skip
    wanted = [force(hit), *hit.displacement(POINTS, TIMES).T, *hit.velocity(POINTS, TIMES).T]
    for each, values in zip(sets, wanted):
        assert_allclose(each["x"], TIMES, rtol=1e-5, atol=1e-9)
        assert_allclose(each["data"], values, rtol=1e-5, atol=1e-5 * np.abs(values).max())


def test_nastran_loads_a_node_with_the_force(tmp_path, hit):
    """Nine digits after the point."""
    bdf = pytest.importorskip("pyNastran.bdf.bdf", reason="the nastran extra is not installed")
    fi.export.write_history(tmp_path / "blow.bdf", hit, TIMES, node=17, direction="-y")
    deck = bdf.read_bdf(str(tmp_path / "blow.bdf"), xref=False, validate=False, punch=True, debug=False)
    (load,), (way,) = deck.dloads[1], deck.loads[1000]
    assert load.load_ids == [10] and deck.dload_entries[10][0].tid == 100
    assert way.node == 17 and way.mag * way.xyz[1] == -1.0
    table = deck.tables_d[100]
    assert_allclose(table.x, TIMES, rtol=1e-9)
    assert_allclose(table.y, force(hit), rtol=1e-9)


def test_abaqus_loads_a_node_with_the_force(tmp_path, hit):
    fi.export.write_history(tmp_path / "blow.inp", hit, TIMES, node=17, direction="-z")
    text = (tmp_path / "blow.inp").read_text()
    head, rest = text.split("*AMPLITUDE, NAME=BLOW1\n")
    rows, load = rest.split("*CLOAD, AMPLITUDE=BLOW1\n")
    assert head.startswith("**") and load == "17, 3, -1.\n"
    table = np.array([line.split(",") for line in rows.splitlines()], float)
    assert_allclose(table, np.column_stack([TIMES, force(hit)]), rtol=1e-9)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"direction": "up"}, "direction must be one of x, y, z"),
        ({"node": 0}, "node must be"),
        ({"times": [[0.0]]}, "times"),
    ],
)
def test_what_cannot_be_written_is_said(tmp_path, hit, options, said):
    with pytest.raises(ValueError, match=said):
        fi.export.write_history(tmp_path / "blow.bdf", hit, **options)
    with pytest.raises(ValueError, match=r"path ending must be one of \.op4, \.uff"):
        fi.export.write_history(tmp_path / "blow.csv", hit)
    assert not (tmp_path / "blow.bdf").exists()
