"""Builds the site of all pages, studies, notebooks and names, without a network.

    python studies/site/build.py [--out FOLDER] [--sounds] [--zip]

Pages stay where they are: they are laid out in a temporary folder as in the repository, beside pages made from
docstrings, studies and tests, and Sphinx builds that folder. A warning or a link that leads nowhere ends the build.
Needs the extra `site`.
"""

import shutil
import sys
import tempfile
from pathlib import Path

from sphinx.cmd.build import build_main

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import gallery
import links
import names
import quoted
import scenes
import shared

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
QUIETLY = ("-b", "html", "-q", "-E", "-W", "--keep-going")
PARTS = {
    "Begin": [f"studies/site/hats/{hat}" for hat in ("percussionist", "test_engineer", "analyst", "teacher")],
    "Use": [
        "studies/guide",
        "studies/site/questions",
        "studies/site/choosing",
        "studies/site/doors",
        "studies/notebooks/index",
    ],
    "See and hear": ["studies/README", "gallery/index", "gallery/scenes"],
    "Look up": ["studies/api", "studies/commands", "studies/scene_keys", "studies/notes"],
    "Trust": ["studies/theory", "studies/limits", "gallery/checks", "studies/verification/reality/README"],
    "Project": ["CHANGELOG", "CONTRIBUTING", "studies/measured/README"],
}


def tree(folder):
    """The lists of pages below the front page; pages that no list names yet go with those to look up."""
    known = {page for pages in PARTS.values() for page in pages} | {"README"}
    new = sorted(path.relative_to(folder).with_suffix("").as_posix() for path in (folder / "studies").rglob("*.md"))
    parts = PARTS | {"Look up": PARTS["Look up"] + [page for page in new if page not in known]}
    lists = [f":hidden:\n:caption: {caption}\n\n" + "\n".join(pages) for caption, pages in parts.items()]
    return "".join(f"\n```{{toctree}}\n{each}\n```\n" for each in lists)


def lay_out(folder, sounds):
    """All pages of the site in a folder, as in the repository."""
    for path in [*ROOT.glob("*.md"), *(ROOT / "studies").rglob("*.md"), ROOT / "LICENSE", ROOT / "CITATION.cff"]:
        target = folder / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, target)
    for name in ("pictures", "figures", "tutorials", "verification", "benchmarks", "notebooks"):
        lend(ROOT / "studies" / name, folder / "studies" / name, ("*.png", "*.py", "*.ipynb"))
    lend(ROOT / "studies", folder / "studies", ("design_*.py",))
    front = folder / "README.md"
    front.write_text(front.read_text(encoding="utf-8") + tree(folder), encoding="utf-8")
    choosing = folder / "studies" / "site" / "choosing.md"
    text = choosing.read_text(encoding="utf-8")
    quoted.again(quoted.CHOOSING, text)
    choosing.write_text(text + scenes.table(), encoding="utf-8")
    theory = folder / "studies" / "theory.md"
    theory.write_text(quoted.theory(theory.read_text(encoding="utf-8")), encoding="utf-8")
    notebooks(folder / "studies" / "notebooks")
    names.write(folder / "studies")
    gallery.write(folder / "gallery", sounds)


def lend(source, target, kinds):
    """Copy files of some kinds into the folder."""
    for path in sorted(path for kind in kinds for path in source.rglob(kind)):
        place = target / path.relative_to(source)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, place)


def notebooks(folder):
    """The page that lists the notebooks."""
    stems = sorted(path.stem for path in folder.glob("*.ipynb"))
    text = "# Notebooks\n\nAs they are kept in `studies/notebooks/`; a test runs them anew.\n\n"
    (folder / "index.md").write_text(text + "```{toctree}\n\n" + "\n".join(stems) + "\n```\n", encoding="utf-8")


def build(out, *, heard=False):
    """Build the site into a folder; return what Sphinx and the links have to complain about."""
    names.lend()
    if (out / ".buildinfo").exists():  # an earlier site, whose pages may be gone
        shutil.rmtree(out)
    with tempfile.TemporaryDirectory() as room:
        pages = Path(room) / "pages"
        pages.mkdir()
        sounds = scenes.sounds(room) if heard else {}
        lay_out(pages, sounds)
        status = build_main([*QUIETLY, "-c", str(HERE), "-d", f"{room}/trees", str(pages), str(out)])
        (out / "sounds").mkdir(parents=True, exist_ok=True)
        for path in (path for paths in sounds.values() for path in paths):
            shutil.copy(path, out / "sounds")
    if status == 0:
        shutil.copyfile(out / "README.html", out / "index.html")
    return status, links.broken(out)


def main():
    """Build as the command says."""
    options = shared.parser(__doc__, out=shared.OUT / "site")
    options.add_argument("--sounds", action="store_true", help="strike what has players, about half a minute")
    options.add_argument("--zip", action="store_true", help="also write the folder as a zip beside it, to read offline")
    chosen = options.parse_args()
    status, broken = build(chosen.out, heard=chosen.sounds)
    if chosen.zip:
        print(shutil.make_archive(str(chosen.out), "zip", chosen.out.parent, chosen.out.name))
    print("\n".join(broken) or f"{chosen.out / 'index.html'}: all links lead somewhere")
    sys.exit(bool(status or broken))


if __name__ == "__main__":
    main()
