"""A blow read back is the blow that was written; what is damaged or planted is refused in one sentence."""

import json
import pickle
import shutil
import zipfile
from typing import ClassVar

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import BAR, QUICK, SMALL

import fem_impact as fi
from fem_impact import cli
from fem_impact.scenes import results

FE = SMALL.replace('"analytic"', '"fe"') + "[observe]\npoints = [[0.2, 0.1], [0.3, 0.2]]\n"
STICK = 'kind = "stick"\nmass = 0.03\nfirst_frequency = 500.0'


def other(old, new, text=SMALL):
    assert old in text
    return text.replace(old, new)


def contact(text):
    head, rest = SMALL.split("[contact]")
    return f"{head}[contact]\n{text}\n[strike]{rest.partition('[strike]')[2]}"


SCENES = {
    "modes in closed form": SMALL,
    "vectors of elements": FE,
    "a bar": BAR,
    "a stick in a hand": other(
        'kind = "rigid"\nmass = 0.03', f"{STICK}\nhand = {{ stiffness = 200.0, damping = 0.5 }}"
    ).replace("[strike]", "[strike]\nmax_impacts = 2"),
    "two layers": contact('kind = "layers"\nstiffness = 1e5\nexponent = 1.5\ndepth = 1e-4\nhard_stiffness = 1e7'),
    "felt": contact('kind = "felt"\nstiffness = 1e7\nexponent = 2.5\nhysteresis = 0.5\nrelaxation = 1e-3'),
}


@pytest.fixture
def written(tmp_path, capsys):
    """Strike a scene with the command; its folder, and the response that Python gets."""

    def written(text, *words):
        (tmp_path / "scene.toml").write_text(text)
        assert cli.main(["strike", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out"), *words]) in (0, 3)
        capsys.readouterr()
        return tmp_path / "out"

    return written


@pytest.mark.parametrize("name", SCENES)
def test_a_blow_read_back_is_the_blow_that_was_struck(written, tmp_path, name):
    folder = written(SCENES[name])
    scene = fi.load_scene(tmp_path / "scene.toml")
    run = scene.run()
    hit = run.response.on(run.response.target) if run.plan.target == "vectors" else run.response
    read = fi.load_response(folder)
    assert fi.export.numbers(read) == fi.export.numbers(hit)  # to the bit, as all that follows
    assert read.summary() == hit.summary() and read.impacts == hit.impacts and read.notes == hit.notes
    assert (read.time == hit.time).all() and (read.force == hit.force).all()
    assert (read.spectrum([100.0, 900.0]) == hit.spectrum([100.0, 900.0])).all()
    times = np.linspace(0.0, 2.0 * hit.history.end_time, 40)
    for points in ([hit.at], scene.points):
        for motion in ("displacement", "velocity"):
            want = getattr(hit, motion)(points, times)
            assert_allclose(getattr(read, motion)(points, times), want, rtol=0, atol=1e-12 * np.abs(want).max())
    assert read.to_xarray().identical(hit.to_xarray())
    assert fi.load_response(folder / "response.json").restitution == hit.restitution


def test_what_changes_a_blow_read_back_is_known_too(written, tmp_path):
    read, hit = fi.load_response(written(SMALL)), fi.load_scene(tmp_path / "scene.toml").strike()
    mine, its = (each.gradient("contact_time", wrt="striker.mass") for each in (read, hit))
    assert_allclose([*mine.slopes, *mine.error], [*its.slopes, *its.error], rtol=1e-9)


def test_a_rigid_body_and_a_flexible_striker_come_back(written):
    folder = written(other('kind = "rigid"\nmass = 0.03', STICK), "--target", "rigid", "--tolerance", "0.5")
    read = fi.load_response(folder)
    told = json.loads((folder / "response.json").read_text())["response"]
    assert read.restitution == told["restitution"] and read.striker.modes.n_modes > 1
    assert read.energies["striker"] == told["energies"]["striker"]


STROKES = """
[observe]
points = [[0.2, 0.1], [0.3, 0.2]]
[[stroke]]
when = 0.03
[[stroke]]
when = 0.0
at = [0.2, 0.15]
speed = 0.5
striker = { kind = "stick", mass = 0.03, first_frequency = 500.0 }
[[stroke]]
when = 0.001
lasts = 0.02
"""


def test_strokes_read_back_are_those_that_were_played(written, tmp_path):
    read = fi.load_response(written(SMALL + STROKES, "--duration", "0.01"))
    scene = fi.load_scene(tmp_path / "scene.toml")
    played = scene.play()
    assert max(map(len, played.strikers)) == 2  # two strikers meet on the body
    assert read.summary() == played.summary() and read.impacts == played.impacts and read.energies == played.energies
    assert (read.time == played.time).all() and (read.force == played.force).all()
    assert (read.spectrum([100.0, 900.0]) == played.spectrum([100.0, 900.0])).all()
    assert [each.striker.felt_mass for each in read.strokes] == [each.striker.felt_mass for each in played.strokes]
    times = np.linspace(0.0, 0.06, 50)
    for points in ([read.at], scene.points, [each.at for each in read.strokes]):
        for motion in ("displacement", "velocity"):
            want = getattr(played, motion)(points, times)
            assert_allclose(getattr(read, motion)(points, times), want, rtol=0, atol=1e-12 * np.abs(want).max())


def test_motion_elsewhere_is_refused(written):
    read = fi.load_response(written(SMALL))
    with pytest.raises(ValueError, match="points must lie on the body"):
        read.displacement([(0.01, 0.01)], [0.0])


@pytest.mark.parametrize("name", ["response.npz", "response.json"])
def test_any_flipped_bit_is_refused_in_one_sentence(written, name):
    folder = written(SMALL)
    raw = (folder / name).read_bytes()
    for place in np.random.default_rng(1).integers(0, len(raw), 25):
        bad = bytearray(raw)
        bad[place] ^= 1
        (folder / name).write_bytes(bytes(bad))
        with pytest.raises(ValueError, match=r"damaged, or not of the response\.json beside it") as said:
            fi.load_response(folder)
        assert "\n" not in str(said.value)
    (folder / name).write_bytes(raw[: len(raw) // 2])
    with pytest.raises(ValueError, match="damaged"):
        fi.load_response(folder)


def test_what_is_missing_is_named(written, tmp_path):
    folder = written(SMALL)
    (folder / "response.npz").unlink()
    with pytest.raises(ValueError, match=r"response.npz: there is no such file.*; strike the scene again"):
        fi.load_response(folder)
    with pytest.raises(ValueError, match="there is no such folder"):
        fi.load_response(tmp_path / "none")
    with pytest.raises(ValueError, match=r"response.json: there is no such file"):
        fi.load_response(tmp_path)


class Bomb:
    """Runs when it is unpickled."""

    ran: ClassVar[list] = []

    def __reduce__(self):
        return Bomb.ran.append, (1,)


def repacked(folder, **changes):
    """Response.npz with other arrays, and a digest that fits: by somebody who knows the format."""
    key = results._key(folder)
    arrays = results.kept.read_arrays(folder / results.SAVED, key)
    results.kept.write_arrays(folder / results.SAVED, key, {**arrays, **changes})


def test_nothing_planted_runs_and_arrays_that_do_not_fit_are_refused(written, tmp_path):
    folder = written(SMALL)
    shutil.copytree(folder, tmp_path / "good")
    told = json.loads(str(results.kept.read_arrays(folder / results.SAVED, results._key(folder))["told"]))
    steps = told["response"]["fields"]["history"]["fields"]["steps"]["array"]

    def spoilt(change):
        other = json.loads(json.dumps(told))
        change(other["response"])
        return {"told": np.array(json.dumps(other))}

    plans = [
        {steps: np.zeros((3, 2))}, {steps: np.zeros((3, 9), int)}, {steps: np.array([Bomb()], object)},
        {"told": np.array(Bomb(), object)}, {"told": np.array("[" * 5000)}, {"told": np.array("{}")},
        spoilt(lambda r: r.update(kind="Popen")),
        spoilt(lambda r: r["fields"].update(history={"kind": "Hand", "fields": {"stiffness": 1.0}})),
        spoilt(lambda r: r["fields"].update(bodies=[])),
    ]  # fmt: skip
    for plan in plans:
        shutil.rmtree(folder)
        shutil.copytree(tmp_path / "good", folder)
        repacked(folder, **plan)
        Bomb.ran.clear()  # pickling does not run it, but be sure
        with pytest.raises(ValueError, match=r"damaged, or not of the response\.json beside it"):
            fi.load_response(folder)
        assert Bomb.ran == []
    with zipfile.ZipFile(folder / results.SAVED, "w") as file:
        file.writestr("told.npy", pickle.dumps(Bomb()))
    with pytest.raises(ValueError, match="damaged"):
        fi.load_response(folder)
    shutil.rmtree(folder)
    shutil.copytree(tmp_path / "good", folder)
    repacked(folder, **spoilt(lambda r: r["fields"].update(rings="os.system")))  # no field of a file
    assert fi.load_response(folder).rings is None
    assert Bomb.ran == [] and fi.load_response(tmp_path / "good").n_impacts > 0


def said(capsys, *words):
    assert cli.main([*words]) == 0
    return " ".join(capsys.readouterr().out.split())


def test_show_tells_what_a_folder_holds(written, capsys, tmp_path):
    folder = written(SMALL)
    text = said(capsys, "show", str(folder))
    assert text.startswith("strike: ") and "fi.load_response(" in text and "response.npz" in text
    hit = fi.load_response(folder)
    assert hit.verdict in text and f"restitution {hit.restitution:.5g}" in text
    (tmp_path / "map.toml").write_text(QUICK)
    assert cli.main(["map", str(tmp_path / "map.toml"), "--out", str(folder)]) == 0
    capsys.readouterr()
    both = json.loads(said(capsys, "show", str(folder), "--json"))
    assert both["holds"] == ["strike", "map"] and "hit once" in " ".join(both["summary"])
    assert both["response"]["restitution"] == hit.restitution


def test_the_folder_that_is_advised_is_read(written, capsys):
    folder = written(SMALL)
    for wrong in (folder.parent, folder.parent / "none"):
        with pytest.raises(ValueError, match=r"give the (?:folder|one) that `fem-impact strike` wrote"):
            fi.load_response(wrong)
    assert cli.main(["show", str(folder.parent)]) == 2
    named = capsys.readouterr().err.split("give one in it, such as ")[1].strip()
    assert named == str(folder) and said(capsys, "show", named) and fi.load_response(named).n_impacts > 0


def test_show_tells_how_far_a_store_is(capsys, tmp_path):
    pytest.importorskip("zarr", reason="stores are an extra: fem-impact[cluster]")
    (tmp_path / "map.toml").write_text(QUICK)
    words = ["map", str(tmp_path / "map.toml"), "--out", str(tmp_path / "out"), "--store", str(tmp_path / "store")]
    assert cli.main(words) == 0
    capsys.readouterr()
    text = said(capsys, "show", str(tmp_path / "store"))
    assert "a store of a map or a spread" in text and "blocks are finished" in text
    done, total = results.store.finished(tmp_path / "store")
    assert done == total > 0


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("", "", "no results of fem-impact are in it"),
        ("response.json", "[]", "it is damaged: not the JSON"),
        ("response.json", '{"scene": 3}', "it has neither response nor sequence"),
        ("response.json", "9" * 5000, "it is damaged"),
        ("map.nc", "CDF", "it is damaged: not the map"),
        ("fit.json", "[" * 100_000, "it is damaged"),
    ],
)
def test_show_refuses_other_folders_in_one_sentence(tmp_path, capsys, name, text, why):
    if name:
        (tmp_path / name).write_text(text)
    assert cli.main(["show", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert why in error and error.count("\n") == 1
