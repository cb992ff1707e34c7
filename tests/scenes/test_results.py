"""A blow read back is the blow that was written; what is damaged or planted is refused in one sentence."""

import json
import pickle
import shutil
import zipfile
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import BAR, QUICK, SMALL, edited, load_text

import fem_impact as fi
from fem_impact import cli
from fem_impact.scenes import results

FE = SMALL.replace('"analytic"', '"fe"') + "[observe]\npoints = [[0.2, 0.1], [0.3, 0.2]]\n"
RIGID = 'kind = "rigid"\nmass = 0.03'
STICK = 'kind = "stick"\nmass = 0.03\nfirst_frequency = 500.0'


def contact(text):
    return edited('kind = "hertz"\nstiffness = 695e3', text)


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
HELD = f"{STICK}\nhand = {{ stiffness = 200.0, damping = 0.5 }}"
SCENES = {
    "modes in closed form": SMALL,
    "vectors of elements": FE,
    "a bar": BAR,
    "a stick in a hand": edited(RIGID, HELD).replace("[strike]", "[strike]\nmax_impacts = 2"),
    "two layers": contact('kind = "layers"\nstiffness = 1e5\nexponent = 1.5\ndepth = 1e-4\nhard_stiffness = 1e7'),
    "felt": contact('kind = "felt"\nstiffness = 1e7\nexponent = 2.5\nhysteresis = 0.5\nrelaxation = 1e-3'),
    "strokes": SMALL + STROKES,
}


def saved(folder, text, **how):
    """The scene of a text, its blow or strokes, and what is read back of them."""
    scene = load_text(folder, text)
    found = scene.play(**how) if scene.stroke else scene.run(**how).response
    results.save_response(folder, found, scene.points, {"response": {}})
    return scene, found, fi.load_response(folder)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """What the command wrote of a blow."""
    folder = tmp_path_factory.mktemp("small")
    load_text(folder, SMALL)
    assert cli.main(["strike", str(folder / "scene.toml"), "--out", str(folder / "out")]) == 0
    return folder / "out"


@pytest.fixture
def written(small, tmp_path):
    """A copy of what a blow left, to be damaged."""
    shutil.copytree(small, tmp_path / "out")
    return tmp_path / "out"


@pytest.mark.parametrize("name", SCENES)
def test_a_blow_read_back_is_the_blow_that_was_struck(tmp_path, name):
    """To the bit, but for motion, which goes through the modes again."""
    scene, hit, read = saved(tmp_path, SCENES[name])
    points = [each.at for each in read.strokes] if scene.stroke else scene.points
    if scene.stroke:
        assert max(map(len, hit.strikers)) == 2  # two strikers meet on the body
        assert [each.striker.felt_mass for each in read.strokes] == [each.striker.felt_mass for each in hit.strokes]
        assert read.energies == hit.energies
    else:
        hit = hit.on(hit.target) if hit.vectors else hit
        assert fi.export.numbers(read) == fi.export.numbers(hit) and read.to_xarray().identical(hit.to_xarray())
        assert fi.load_response(tmp_path / "response.json").restitution == hit.restitution
    assert read.summary() == hit.summary() and read.impacts == hit.impacts and read.notes == hit.notes
    assert (read.time == hit.time).all() and (read.force == hit.force).all()
    assert (read.spectrum([100.0, 900.0]) == hit.spectrum([100.0, 900.0])).all()
    times = np.linspace(0.0, 2.0 * hit.impacts[-1].end, 40)
    for places in ([hit.at], scene.points, points):
        for motion in ("displacement", "velocity"):
            want = getattr(hit, motion)(places, times)
            assert_allclose(getattr(read, motion)(places, times), want, rtol=0, atol=1e-12 * np.abs(want).max())


def test_what_changes_a_blow_read_back_is_known_too(small):
    read, hit = fi.load_response(small), fi.load_scene(small.parent / "scene.toml").strike()
    mine, its = (each.gradient("contact_time", wrt="striker.mass") for each in (read, hit))
    assert_allclose([*mine.slopes, *mine.error], [*its.slopes, *its.error], rtol=1e-9)


def test_a_rigid_body_and_a_flexible_striker_come_back_from_the_command(tmp_path, prompt):
    load_text(tmp_path, edited(RIGID, STICK))
    said = prompt("strike scene.toml --target rigid --tolerance 0.5 --out out")
    assert said.status in (0, 3) and "no modes and no sound (use --target modal" in " ".join(said.out.split())
    read, told = fi.load_response("out"), json.loads(Path("out/response.json").read_text())["response"]
    assert read.restitution == told["restitution"] and read.striker.modes.n_modes > 1
    assert read.energies["striker"] == told["energies"]["striker"]


def test_a_blow_by_vectors_is_kept_with_the_motion_of_its_modes(tmp_path, prompt):
    load_text(tmp_path, FE)
    assert prompt("strike scene.toml --tolerance 0.1 --out out").status in (0, 3)
    read, told = fi.load_response("out"), json.loads(Path("out/response.json").read_text())["response"]
    assert read.vectors is None and read.restitution == told["restitution"] and read.target.n_modes > 1


def test_motion_elsewhere_is_refused(small):
    with pytest.raises(ValueError, match="points must lie on the body"):
        fi.load_response(small).displacement([(0.01, 0.01)], [0.0])


DAMAGED = r"damaged, or not of the response\.json beside it"


@pytest.mark.parametrize("name", ["response.npz", "response.json"])
def test_any_flipped_bit_is_refused_in_one_sentence(written, name):
    raw = (written / name).read_bytes()
    for place in np.random.default_rng(1).integers(0, len(raw), 25):
        bad = bytearray(raw)
        bad[place] ^= 1
        (written / name).write_bytes(bytes(bad))
        with pytest.raises(ValueError, match=rf"^[^\n]*{DAMAGED}[^\n]*$"):
            fi.load_response(written)
    (written / name).write_bytes(raw[: len(raw) // 2])
    with pytest.raises(ValueError, match="damaged"):
        fi.load_response(written)


def test_what_is_missing_is_named_and_the_folder_that_is_advised_is_read(written, tmp_path, prompt):
    for wrong in (tmp_path, tmp_path / "none"):
        with pytest.raises(ValueError, match=r"give the (?:folder|one) that `fem-impact strike` wrote"):
            fi.load_response(wrong)
    said = prompt("show", tmp_path)
    named = said.err.split("give one in it, such as ")[1].strip()
    assert said.status == 2 and named == str(written)
    assert prompt("show", named).out and fi.load_response(named).n_impacts > 0
    (written / "response.npz").unlink()
    for folder, text in (
        (written, r"response.npz: there is no such file.*; strike the scene again"),
        (tmp_path / "none", "there is no such folder"),
        (Path(__file__), "it is a file and no folder"),
        (tmp_path, r"response.json: there is no such file"),
    ):
        with pytest.raises(ValueError, match=text):
            fi.load_response(folder)


class Bomb:
    """Runs when it is unpickled."""

    ran: ClassVar[list] = []

    def __reduce__(self):
        return Bomb.ran.append, (1,)


def test_nothing_planted_runs_and_arrays_that_do_not_fit_are_refused(small, tmp_path):
    key = results._key(small)
    arrays = results.kept.read_arrays(small / results.SAVED, key)
    told = json.loads(str(arrays["told"]))
    steps = told["response"]["fields"]["history"]["fields"]["steps"]["array"]

    def planted(**changes):
        shutil.copytree(small, tmp_path / "bad", dirs_exist_ok=True)
        # by somebody who knows the format: a digest that fits
        results.kept.write_arrays(tmp_path / "bad" / results.SAVED, key, {**arrays, **changes})
        return tmp_path / "bad"

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
        folder = planted(**plan)
        Bomb.ran.clear()  # pickling does not run it, but be sure
        with pytest.raises(ValueError, match=DAMAGED):
            fi.load_response(folder)
        assert Bomb.ran == []
    with zipfile.ZipFile(folder / results.SAVED, "w") as file:
        file.writestr("told.npy", pickle.dumps(Bomb()))
    with pytest.raises(ValueError, match="damaged"):
        fi.load_response(folder)
    assert (
        fi.load_response(planted(**spoilt(lambda r: r["fields"].update(rings="os.system")))).rings is None
    )  # no field
    assert Bomb.ran == [] and fi.load_response(small).n_impacts > 0


def test_show_tells_what_a_folder_holds(written, prompt, tmp_path):
    text, hit = " ".join(prompt("show", written).out.split()), fi.load_response(written)
    assert text.startswith("strike: ") and "fi.load_response(" in text and "response.npz" in text
    assert hit.verdict in text and f"restitution {hit.restitution:.5g}" in text
    (tmp_path / "map.toml").write_text(QUICK)
    assert prompt("map map.toml --out", written).status == 0
    both = prompt("show --json", written).json
    assert both["holds"] == ["strike", "map"] and "hit once" in " ".join(both["summary"])
    assert both["response"]["restitution"] == hit.restitution


def test_show_tells_how_far_a_store_is(prompt, tmp_path):
    (tmp_path / "map.toml").write_text(QUICK)
    assert prompt("map map.toml --out out --store store").status == 0
    text = " ".join(prompt("show store").out.split())
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
def test_show_refuses_other_folders_in_one_sentence(tmp_path, prompt, name, text, why):
    if name:
        (tmp_path / name).write_text(text)
    said = prompt("show", tmp_path)
    assert said.status == 2 and why in said.err and said.err.count("\n") == 1
