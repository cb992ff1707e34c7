"""Builds the site of all pages, studies, notebooks and names, without a network.

    python studies/site/build.py [--out FOLDER]

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
import shared

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
QUIETLY = ("-b", "html", "-q", "-E", "-W", "--keep-going")
TREE = """
```{toctree}
:hidden:
:caption: Use

studies/guide
studies/notebooks/index
```

```{toctree}
:hidden:
:caption: See and hear

studies/README
gallery/index
```

```{toctree}
:hidden:
:caption: Look up

studies/api
studies/commands
studies/scene_keys
studies/notes
```

```{toctree}
:hidden:
:caption: Trust

studies/theory
studies/limits
gallery/checks
studies/verification/reality/README
studies/measured/README
```

```{toctree}
:hidden:
:caption: Project

CHANGELOG
CONTRIBUTING
```
"""


def lay_out(folder, sounds):
    """All pages of the site in a folder, as in the repository; only the front page has another name."""
    for path in [*ROOT.glob("*.md"), *(ROOT / "studies").rglob("*.md"), ROOT / "LICENSE", ROOT / "CITATION.cff"]:
        target = folder / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, target)
    for name in ("pictures", "figures", "tutorials", "verification", "benchmarks", "notebooks"):
        lend(ROOT / "studies" / name, folder / "studies" / name, ("*.png", "*.py", "*.ipynb"))
    lend(ROOT / "studies", folder / "studies", ("design_*.py",))
    front = (folder / "README.md").rename(folder / "index.md")
    front.write_text(front.read_text(encoding="utf-8") + TREE, encoding="utf-8")
    notebooks(folder / "studies" / "notebooks")
    names.write(folder / "studies")
    gallery.write(folder / "gallery", sounds)


def lend(source, target, kinds):
    """Link files of some kinds into the folder."""
    for path in sorted(path for kind in kinds for path in source.rglob(kind)):
        place = target / path.relative_to(source)
        place.parent.mkdir(parents=True, exist_ok=True)
        if not place.exists():
            place.symlink_to(path)


def notebooks(folder):
    """The page that lists the notebooks."""
    stems = sorted(path.stem for path in folder.glob("*.ipynb"))
    text = "# Notebooks\n\nAs they are kept in `studies/notebooks/`; a test runs them anew.\n\n"
    (folder / "index.md").write_text(text + "```{toctree}\n\n" + "\n".join(stems) + "\n```\n", encoding="utf-8")


def build(out, sounds=None):
    """Build the site into a folder; return what Sphinx and the links have to complain about."""
    names.lend()
    with tempfile.TemporaryDirectory() as room:
        pages = Path(room) / "pages"
        pages.mkdir()
        lay_out(pages, sounds or {})
        status = build_main([*QUIETLY, "-c", str(HERE), "-d", f"{room}/trees", str(pages), str(out)])
    return status, links.broken(out)


def main():
    """Build as the command says."""
    options = shared.parser(__doc__, out=shared.OUT / "site")
    chosen = options.parse_args()
    status, broken = build(chosen.out)
    print("\n".join(broken) or f"{chosen.out / 'index.html'}: all links lead somewhere")
    sys.exit(bool(status or broken))


if __name__ == "__main__":
    main()
