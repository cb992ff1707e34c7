"""The gallery: a page for each study with its picture, words, sounds and code, and the page of what checks what."""

import ast
import re
from functools import cache

import scenes
from shared import PICTURES, STUDIES

import fem_impact as fi

ROOT = STUDIES.parent
SECTIONS = {
    "Figures of the source": "figures/fig*.py",
    "Beyond the source": "figures/[!f]*.py",
    "Tutorials and designs": "tutorials/*.py design_*.py",
    "Are numbers and their errors right?": "verification/*.py",
    "Held against reality": "verification/reality/*.py",
    "What does it cost?": "benchmarks/*.py",
}
CHECKS = ("Are numbers and their errors right?", "Held against reality", "What does it cost?")
SHARED = {"sketches", "source_scenes", "page", "record", "tapped"}  # used by other studies, and not one themselves


@cache
def studies():
    """Of each section the scripts of its studies."""
    found = {key: [path for each in told.split() for path in STUDIES.glob(each)] for key, told in SECTIONS.items()}
    return {
        section: sorted((path for path in paths if path.stem not in SHARED), key=lambda path: path.stem)
        for section, paths in found.items()
    }


def about(path):
    """The first sentence of a script, and what its docstring says besides."""
    head, _, rest = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").partition("\n\n")
    return " ".join(head.split()), rest.strip()


def name(path):
    """What the page of a script is called."""
    return re.sub(r"^fig0?", "Figure ", path.stem).replace("_", " ").capitalize()


@cache
def pictures(path):
    """The pictures of a study: those with its name, or named in its code."""
    code = path.read_text(encoding="utf-8")
    own = sorted({*PICTURES.glob(f"{path.stem}.png"), *PICTURES.glob(f"{path.stem}_middle.png")})
    own += sorted(PICTURES.glob(f"reality_{path.stem}*.png"))
    named = [each for each in sorted(PICTURES.glob("*.png")) if re.search(rf"\b{each.stem}(\.png)?[\"{{]", code)]
    return list(dict.fromkeys(own + named))


def words(text):
    """A docstring's further paragraphs as Markdown: commands and tables stay as they are."""
    parts = []
    for part in re.split(r"\n\s*\n", text):
        code = re.match(r"\s*python |\s{2,}", part) or re.search(r"\n\s", part) or re.search(r"\S {3,}\S", part)
        parts.append(f"```text\n{part}\n```" if code else part.replace("``", "`").replace("[", r"\["))
    return "\n\n".join(parts)


def page(path, sounds):
    """The page of a study."""
    title, rest = about(path)
    place = path.relative_to(ROOT).as_posix()
    text = f"---\norphan: true\n---\n\n# {name(path)}\n\n{title}\n\n"
    text += "".join(f"![{title}](../studies/pictures/{each.name})\n\n" for each in pictures(path))
    text += "".join(player(each, each.stem.removeprefix(f"{path.stem}_")) for each in sounds)
    text += f"{words(rest)}\n\n```sh\npython {place}\n```\n\n"
    return text + f"```{{literalinclude}} ../{place}\n:language: python\n```\n"


def player(path, called="its sound"):
    """A sound with its name and a player."""
    return f"""
<figure class="sound"><figcaption>{called.replace("_", " ")}</figcaption>
<audio controls preload="none" src="../sounds/{path.name}"></audio></figure>

"""


def card(path, folder=""):
    """A study in the gallery: its picture or else only its words, leading to its page."""
    title = about(path)[0]
    shown = pictures(path)
    picture = f"![{title}](../studies/pictures/{shown[0].name})\n\n" if shown else ""
    return f":::{{container}} card\n{picture}[{title}]({folder}{path.stem}.md)\n:::\n"


def write(folder, sounds):
    """Write the pages of the gallery; ``sounds`` are WAV files by the stem of the study."""
    folder.mkdir()
    text = "# Gallery\n\nEvery study with its picture and its code, and its sounds where it has any.\n"
    for section, paths in studies().items():
        shown = [path for path in paths if pictures(path)]
        text += f"\n## {section}\n\n::::{{container}} gallery\n{''.join(card(path) for path in shown)}::::\n"
        for path in paths:
            (folder / f"{path.stem}.md").write_text(page(path, sounds.get(path.stem, [])), encoding="utf-8")
    (folder / "index.md").write_text(text, encoding="utf-8")
    (folder / "scenes.md").write_text(scenes.page(player, sounds), encoding="utf-8")
    (folder / "checks.md").write_text(checks() + verified(fi.verify()), encoding="utf-8")


def checks():
    """The page of what checks what: every study of accuracy with the data that it keeps."""
    text = """# What checks what

Each study below says in its first sentence what it checks; its numbers are in [Limits](../studies/limits.md) and
[Studies](../studies/README.md). Tests hold what they show.
"""
    for section in CHECKS:
        text += f"\n## {section}\n\n| study | what it does | kept data |\n|---|---|---|\n"
        for path in studies()[section]:
            kept = [
                len(each.read_text(encoding="utf-8").splitlines()) - 1 for each in path.parent.glob(f"{path.stem}*.csv")
            ]
            lines = f"{sum(kept)} lines" if kept else "-"
            text += f"| [{name(path)}]({path.stem}.md) | {about(path)[0]} | {lines} |\n"
    return text


def verified(verdicts):
    """The table of reference cases as they came out while the site was built; ValueError if an error did not hold."""
    missed = [each.name for each in verdicts if not each.holds]
    if missed:
        raise ValueError(f"reference cases must hold, got {', '.join(missed)} beyond their errors")
    text = f"""
## Reference cases

What `fem-impact verify` prints, as it came out while this page was built: of each case the number that takes the
largest share of what both errors allow. All {len(verdicts)} hold.

| case | what | number | source | ours | difference | stated error | reference within |
|---|---|---|---|---|---|---|---|
"""
    for each in verdicts:
        worst = each.worst
        text += f"| {each.name} | {each.kind}: {each.source} | {worst.quantity} | {worst.reference:.9g} {worst.unit} | "
        text += f"{worst.ours:.9g} | {worst.difference:.1e} | {worst.error:.1e} | {worst.within:.1e} |\n"
    return text.replace("[1/", "\\[1/")
