"""The pages: links and anchors resolve, pages made by scripts are current, what they quote is still said."""

import re
from functools import cache

import api
import catalogue
import commands
import pytest
import scene_keys
from scenes import ROOT

import fem_impact as fi
from fem_impact._base import explained
from fem_impact.impact import assumption

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "studies").rglob("*.md")])
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
SAYS = re.compile(r"\*Says\*((?:\s+(?:or, on a map, |or )?`[^`]+`,?)+)")


@cache
def prose(path):
    """A page without its blocks of code."""
    return FENCE.sub("", path.read_text(encoding="utf-8"))


@cache
def anchors(path):
    """The anchors of a page's headings, as sites make them: lower case, hyphens, repeated ones numbered."""
    found = []
    for title in re.findall(r"^#+ (.+)$", prose(path), flags=re.MULTILINE):
        slug = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        found.append(slug if slug not in found else f"{slug}-{found.count(slug)}")
    return set(found)


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def test_the_pages_are_there():
    expected = {"README", "CHANGELOG", "CONTRIBUTING", "guide", "scene_keys", "limits", "notes", "theory", "api"}
    assert expected <= {path.stem for path in PAGES}


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_a_page_begins_with_its_one_title_and_its_links_lead_to_files_and_headings(path):
    titles = re.findall(r"^# .+$", prose(path), flags=re.MULTILINE)
    assert len(titles) == 1 and prose(path).startswith(titles[0])
    for link in LINK.findall(re.sub(r"`[^`\n]*`", "", prose(path))):
        if link.startswith("https://"):
            continue
        place, _, anchor = link.partition("#")
        target = (path.parent / place).resolve() if place else path
        assert target.exists() and target.is_relative_to(ROOT), f"{name_of(path)}: {link}"
        assert not anchor or anchor in anchors(target), f"{name_of(path)}: {link}"


@pytest.mark.parametrize("name", ["README", "studies/README", "studies/guide", "studies/limits", "studies/notes"])
def test_files_named_in_sentences_exist(name):
    text = prose(ROOT / f"{name}.md")
    named = re.findall(r"`((?:studies|tests|meshes)/[\w./]+)`", text)
    within = re.findall(r"`((?:figures|tutorials|verification|benchmarks)/[\w.]+)`", text)
    assert [each for each in [*named, *(f"studies/{each}" for each in within)] if not (ROOT / each).exists()] == []


def test_tests_named_on_pages_exist():
    code = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    named = re.findall(r"`(test_\w+)`", "".join(prose(path) for path in PAGES))
    assert len(named) > 50 and [each for each in named if f"def {each}(" not in code] == []


@pytest.mark.parametrize("script", [api, catalogue, commands, scene_keys], ids=lambda script: script.__name__)
def test_pages_made_by_scripts_are_current(script):
    assert script.PAGE.read_text(encoding="utf-8") == script.page(), f"run python studies/{script.__name__}.py"


def test_the_page_of_public_names_has_every_name_once_says_what_it_is_and_does_not_depend_on_the_run():
    text = api.page()
    heads = re.findall(r"^##+ fi\.([\w.]+)$", text, re.MULTILINE)
    assert len(heads) == len(set(heads)) and set(fi.__all__) - {"__version__"} <= set(heads)
    assert {"mesh.rectangle", "figures.spread", "export.write_vtk", "hammers.choose"} <= set(heads)
    for head, told in re.findall(r"^### (fi\.\S+)\n\n`[^`]*`\n\n```text\n(.*?)```", text, re.MULTILINE | re.DOTALL):
        assert len(told.split()) >= 3, head
    assert not re.search(rf"0x[0-9a-f]{{6}}|{re.escape(str(ROOT))}|/home/|/tmp/", text)  # no addresses, no folders


def sayings():
    """The phrases that the page of notes quotes, by the anchor of their heading."""
    page = (ROOT / "studies" / "notes.md").read_text(encoding="utf-8")
    found = {}
    for part in page.split("\n### ")[1:]:
        title, _, text = part.partition("\n")
        said = [" ".join(each.split()) for list_ in SAYS.findall(text) for each in re.findall(r"`([^`]+)`", list_)]
        found[title.lower().replace(" ", "-")] = tuple(said or [f"{title.lower()}: "])
    return found


def test_messages_name_each_heading_of_the_page_of_notes_by_the_phrases_that_it_quotes():
    assert sayings() == explained.HEADINGS
    assert set(explained.HEADINGS) <= anchors(ROOT / "studies" / "notes.md")
    # every assumption is explained under its name
    assert {name.replace(" ", "-") for name in assumption.ALL} <= set(explained.HEADINGS)


def test_messages_that_the_page_of_notes_quotes_are_said_so():
    places = [path for path in (ROOT / "fem_impact").rglob("*.py") if path.name != "explained.py"]
    code = " ".join(path.read_text(encoding="utf-8") for path in places)
    code = re.sub(r'"\s*\n\s*f?"', "", code)  # texts that go on in the next line
    names = {f"{name}: " for name in assumption.ALL}
    quoted = [each for said in sayings().values() for each in said if each not in names]
    assert len(quoted) > 25
    assert [each for each in quoted if each not in code] == []


def test_the_pages_on_theory_and_on_reading_name_what_exists():
    theory = (ROOT / "studies" / "theory.md").read_text()
    text = theory.split("## 25. How to read this program")[1].split("## References")[0]
    named = r"`((?:[a-z_]+/)+[a-z_]+\.py)`(?:\s+\(((?:`\w+`,?\s*)+)\))?"
    assert len(re.findall(named, text)) > 60
    for path, inside in re.findall(named, theory):
        if path.startswith(("studies/", "tests/")):
            assert (ROOT / path).exists(), path
            continue
        code = (ROOT / "fem_impact" / path).read_text()
        for name in re.findall(r"\w+", inside):
            assert re.search(rf"^\s*(def|class) {name}\b|^{name}\b", code, re.MULTILINE), (path, name)
    words = re.findall(r"^\| (?!word|-)([^|]+) \|", text, re.MULTILINE)
    assert len(words) == len(set(words)) >= 40
