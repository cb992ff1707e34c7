"""What is put on the bench of the live page is the scene that a file would say."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from scenes import LEAF

import fem_impact as fi
from fem_impact.pages import explore_bench, explore_model
from fem_impact.scenes import adapted
from fem_impact.scenes.scene import scene_of

Order = explore_bench.Order


@pytest.fixture
def scene():
    return explore_bench.first_scene(None)[0]


@pytest.fixture
def leaf(tmp_path, read_here):
    (tmp_path / "leaf.svg").write_text(LEAF)
    return tmp_path / "leaf.svg"


def test_a_drawing_becomes_the_scene_of_new(scene, leaf):
    names = {"material": "brass", "mallet": "yarn, medium"}
    made = explore_bench.scene_of_order(scene, Order(leaf, **names))
    whole, _ = adapted.text("plate", leaf.parent, drawing=leaf, **names)
    assert made.data() == scene_of(tomllib.loads(whole), leaf, folder=leaf.parent).data()
    inches = explore_bench.scene_of_order(scene, Order(leaf, unit="in", thickness=2e-3))
    assert inches.body().points.max() == pytest.approx(85 * 0.0254, rel=1e-9)  # a reader's rounding
    assert inches.data()["section"]["thickness"] == 2e-3


def test_names_replace_tables_of_a_scene_and_nothing_is_left_of_them(scene):
    at = (0.1, 0.08)
    made = explore_bench.scene_of_order(scene, Order(material="steel, mild", mallet="steel, 10 mm", at=at))
    assert made.make_section("plate").material == fi.materials["steel, mild"]
    assert made.make_contact() == fi.strikers.entry("steel, 10 mm").contact(on=fi.materials["steel, mild"])
    assert tuple(made.blow.values["at"]) == at and made.body().points.tolist() == scene.body().points.tolist()
    assert explore_bench.scene_of_order(scene, Order()).data() == scene.data()
    tables = scene.data() | {"target": {"mass": 3.0, "damping_ratio": 0.1}}
    rescaled = scene_of(tables, scene.path, folder=scene.path.parent)
    assert explore_bench.scene_of_order(rescaled, Order(material="brass")).target.values.get("mass") is None


def test_what_the_scene_says_in_another_way_cannot_be_picked(scene):
    tables = {key: table for key, table in scene.data().items() if key not in ("material", "section")}
    tables["target"] = {"mass": 0.2, "first_frequency": 100.0, "damping_ratio": 0.01, "source": "analytic"}
    stated = scene_of(tables, Path("a.toml"), folder=Path())
    with pytest.raises(ValueError, match="material must be left to this scene"):
        explore_bench.scene_of_order(stated, Order(material="brass"))
    offered = explore_bench.pickable(stated, Order(), stated)
    assert offered["materials"] == [] and offered["thickness"] is None and offered["mallets"]


def test_the_page_offers_every_name_of_the_catalogue_once(scene):
    offered = explore_bench.pickable(scene, Order(), scene)
    for key, names in (("materials", fi.materials), ("mallets", fi.strikers)):
        assert sorted(name for _, group in offered[key] for name in group) == sorted(names)
    assert offered["units"] == [] and offered["thickness"] == 1e3 * scene.data()["section"]["thickness"]


def test_names_of_dropped_files_lead_nowhere_else():
    for name in ("../../leaf.svg", "/etc/leaf.svg", "C:\\own\\leaf.svg", ".leaf.svg"):
        assert explore_bench.safe_name(name) == "leaf.svg"
    assert explore_bench.safe_name("my leaf (2).svg") == "my_leaf_2_.svg"
    for name in ("", "leaf", "a.toml"):
        with pytest.raises(ValueError, match="or a mesh file; open a scene by"):
            explore_bench.safe_name(name)


def test_points_stay_where_the_body_stays(tmp_path):
    before, at = Order(tmp_path / "leaf.svg", material="brass", thickness=2e-3), (0.1, 0.2)

    def order(**wish):
        return explore_bench.order_of(wish, tmp_path, before, at)

    assert order(mallet="yarn, soft") == replace(before, mallet="yarn, soft", at=at)
    assert order(drawing="b.svg") == replace(before, drawing=tmp_path / "b.svg", dropped=True)
    assert order(unit="in").at is None and order(drawing="", material="").drawing is None


def test_a_saved_scene_names_a_dropped_file_without_the_folder_that_ends(scene, leaf):
    made = explore_bench.scene_of_order(scene, Order(leaf))
    base = explore_model.Setup.of(scene).base
    for loose, named in ((True, "leaf.svg"), (False, str(leaf))):
        setup = explore_model.Setup(made, made.body(), base, loose)
        assert setup.saved(replace(setup.start, at=(0.03, -0.03)))["mesh"]["source"] == named


def test_without_a_scene_a_wooden_plate_waits(tmp_path):
    scene, order = explore_bench.first_scene(None)
    assert scene.title == "A steel ball taps a wooden plate" and order == Order()
    assert explore_bench.first_scene(tmp_path / "leaf.svg")[1] == Order(tmp_path / "leaf.svg")
