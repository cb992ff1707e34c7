"""The site is built without a warning, a link that leads nowhere, or anything from a network."""

import os
import re
import subprocess
import sys
from pathlib import Path

import gallery
import links
import names
import pytest

import fem_impact as fi

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site, and what the command that built it ended with and said."""
    pytest.importorskip("sphinx", reason="Sphinx is not installed: pip install -e '.[site]'")
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
    assert set("".join(f" {each}" for each in names.TASKS.values()).split()) <= set(fi.__all__)


def test_every_picture_is_in_the_gallery_or_on_a_page():
    scripts = [path for paths in gallery.studies().values() for path in paths]
    shown = {picture.name for path in scripts for picture in gallery.pictures(path)}
    pages = "".join(path.read_text(encoding="utf-8") for path in [ROOT / "README.md", *ROOT.glob("studies/**/*.md")])
    missing = {path.name for path in gallery.PICTURES.glob("*.png")} - shown
    assert [name for name in missing if name not in pages] == []
    assert len(shown) > 50


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
