"""The site is built without a warning, a link that leads nowhere, or anything from a network."""

import os
import re
import subprocess
import sys
import tomllib
from dataclasses import replace

import gallery
import links
import names
import pytest
import quoted
import yaml
from scenes import ROOT

import fem_impact as fi


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site, and what the command that built it ended with and said."""
    folder = tmp_path_factory.mktemp("site")
    words = [sys.executable, str(ROOT / "studies" / "site" / "build.py"), "--out", str(folder)]
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(words, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}, timeout=1800)
    return folder, done


@pytest.mark.slow
def test_the_site_is_built_without_warnings_and_all_its_links_lead_somewhere(site):
    folder, done = site
    assert done.returncode == 0 and not done.stderr, done.stderr + done.stdout
    assert done.stdout.endswith("all links lead somewhere\n")
    assert len(list(folder.rglob("*.html"))) > 100


@pytest.mark.slow
def test_formulas_names_and_code_are_there(site):
    theory = (site[0] / "studies" / "theory.html").read_text(encoding="utf-8")
    assert theory.count("<math") > 300 and "$" not in re.sub(r"<(code|pre|math).*?</\1>", "", theory, flags=re.DOTALL)
    shown = "".join(path.read_text(encoding="utf-8") for path in (site[0] / "studies" / "names").glob("*.html"))
    everything = {path for named in names.tasks().values() for name in named for path in names.entries(name)}
    assert [path for path in everything if f'id="fi.{path}"' not in shown] == []
    assert "source_scenes" in (site[0] / "gallery" / "fig20.html").read_text(encoding="utf-8")


def test_every_public_name_has_one_task():
    listed = [name for named in names.tasks().values() for name in named]
    assert sorted([*listed, "__version__"]) == sorted(fi.__all__)


def test_every_picture_is_in_the_gallery_or_on_a_page():
    scripts = [path for paths in gallery.studies().values() for path in paths]
    shown = {picture.name for path in scripts for picture in gallery.pictures(path)}
    pages = "".join(path.read_text(encoding="utf-8") for path in [ROOT / "README.md", *ROOT.glob("studies/**/*.md")])
    missing = {path.name for path in gallery.PICTURES.glob("*.png")} - shown
    assert [name for name in missing if name not in pages] == []
    assert len(shown) > 50


def test_reference_cases_are_a_table_and_end_the_build_where_one_does_not_hold():
    (verdict,) = fi.verify("wall-hertz")
    text = gallery.verified([verdict])
    row = text.splitlines()[-1].split(" | ")
    assert row[0] == "| wall-hertz" and float(row[4]) == pytest.approx(verdict.worst.ours, rel=1e-8)
    wrong = replace(verdict, lines=[replace(line, reference=2.0 * line.ours) for line in verdict.lines])
    with pytest.raises(ValueError, match="reference cases must hold, got wall-hertz beyond their errors"):
        gallery.verified([verdict, wrong])


def test_links_that_lead_nowhere_and_files_from_elsewhere_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<h1 id="top">A</h1><a href="b.html#there">b</a><a href="b.html#gone">b</a><a href="c.html">c</a>'
        '<a href="../x.html">x</a><a href="https://far/away">far</a><script src="https://far/s.js"></script>'
        '<img alt="" src="data:image/png;base64,AA=="/><a href="#top">top</a>'
    )
    (tmp_path / "b.html").write_text('<p id="there">B</p>')
    assert links.broken(tmp_path) == [
        "a.html leads to b.html#gone, which has no such place",
        "a.html leads to c.html, which does not exist",
        "a.html leads to ../x.html, which does not exist",
        "a.html loads https://far/s.js",
    ]


def test_numbers_of_the_theory_are_found_again():
    text = quoted.PAGE.read_text(encoding="utf-8")
    told = quoted.theory(text)
    assert told.count("<details>") >= 12 and told.count("\n| ") >= len(quoted.again(quoted.QUOTES, text)) > 40
    assert quoted.again(quoted.CHOOSING, (ROOT / "studies" / "site" / "choosing.md").read_text(encoding="utf-8"))


def test_a_number_that_is_no_longer_right_ends_the_build():
    text = quoted.PAGE.read_text(encoding="utf-8")
    with pytest.raises(ValueError, match=r"says 34, but fe\.residual\.CALIBRATION is 33: mend the page"):
        quoted.theory(text.replace("The constant 33 is", "The constant 34 is"))
    with pytest.raises(ValueError, match="the page does not say 'ends at"):
        quoted.theory(text.replace("So the restitution of a ball ends at", "It has"))


@pytest.mark.parametrize(
    ("written", "value", "right"),
    [("2.18", 2.1802, True), ("2.18", 2.1751, True), ("2.18", 2.1749, False), ("3e-4", 3.4e-4, True),
     ("1e-7", 2e-7, False), ("7/3", 2.3333333, True), ("7/3", 2.34, False), ("-8", -8.0, True)],
)  # fmt: skip
def test_a_number_is_right_as_it_is_rounded(written, value, right):
    assert quoted.same(written, value) == right


def test_the_lines_of_python_on_choosing_print_what_the_page_says(capsys):
    text = (ROOT / "studies" / "site" / "choosing.md").read_text(encoding="utf-8")
    code, printed = (
        re.findall(rf"^```{kind}\n(.*?)^```", text, re.MULTILINE | re.DOTALL) for kind in ("python", "text")
    )
    for lines, said in zip(code, printed, strict=True):
        exec(compile(lines, "choosing.md", "exec"), {})
        assert capsys.readouterr().out == said


def test_the_recipe_asks_for_what_the_project_asks_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    recipe = yaml.safe_load((ROOT / "studies" / "site" / "recipe.yaml").read_text(encoding="utf-8"))
    about = project["project"]
    wanted = [re.sub(r"^matplotlib\b", "matplotlib-base", each) for each in about["dependencies"]]
    wanted = ["python" + about["requires-python"], *wanted]
    assert [each.replace(" ", "") for each in recipe["requirements"]["run"]] == wanted
    assert recipe["requirements"]["host"][2].replace(" ", "") == project["build-system"]["requires"][0]
    assert recipe["context"]["version"] == about["version"] and recipe["about"]["license"] == about["license"]
    assert recipe["build"]["python"]["entry_points"] == [f"fem-impact = {about['scripts']['fem-impact']}"]


def test_binder_installs_the_repository_with_extras_that_exist():
    (line,) = (ROOT / ".binder" / "requirements.txt").read_text(encoding="utf-8").splitlines()
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert set(re.fullmatch(r"\.\[(.+)\]", line)[1].split(",")) <= set(extras)
