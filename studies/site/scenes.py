"""The everyday scenes as a page, as a table of their laws, and as sounds."""

import subprocess
import sys
import tomllib
import warnings
from functools import cache
from pathlib import Path

from shared import SCENES, STUDIES

import fem_impact as fi

EVERYDAY = sorted((SCENES / "everyday").glob("*.toml"))
SOUNDING = {
    "beyond_sounds": "figures",
    "tutorial_outline_to_sound": "tutorials",
}  # studies that write sounds in seconds
HEARD = (
    "glockenspiel_brass",
    "glockenspiel_plastic",
    "marimba_bar_on_cords",
    "marimba_rubber",
    "marimba_yarn",
)  # quick
LENGTH = 2.0  # [s] of a sound
POWERS = {"linear": 1.0, "hertz": 1.5, "between": 1.5}


@cache
def read(path):
    """The tables of a scene."""
    return tomllib.loads(path.read_text(encoding="utf-8"))


def said(value):
    """A number of a scene, or the middle of one that says how well it is known, in a few characters."""
    value = value.get("value", "by frequency") if isinstance(value, dict) else value
    return f"{value:g}" if isinstance(value, (int, float)) else str(value)


def table():
    """Law, exponent, stiffness, loss and damping of every everyday scene, as Markdown."""
    text = "\n| scene | law | exponent | stiffness | loss [s/m] | damping ratio |\n|---|---|---|---|---|---|\n"
    for path in EVERYDAY:
        tables = read(path)
        law, damping = tables["contact"], tables.get("target", {}).get("damping_ratio", "-")
        power = law.get("exponent", POWERS.get(law["kind"], "-"))
        numbers = [power, law.get("stiffness", "of the bodies"), law.get("loss", "-"), damping]
        place = f"[{path.stem}](../../gallery/scenes.md#{anchor(path)})"
        text += f"| {place} | {law['kind']} | {' | '.join(said(each) for each in numbers)} |\n"
    return text


def anchor(path):
    """The anchor of a scene on its page."""
    return read(path)["title"].lower().replace(",", "").replace(".", "").replace(" ", "-")


def page(player, sounds):
    """The page of all everyday scenes: what they are, their sound and their file."""
    text = "# Everyday scenes\n\nBlows as people strike them. [What they give](../studies/README.md#everyday-scenes).\n"
    for path in EVERYDAY:
        place = path.relative_to(STUDIES.parent).as_posix()
        text += f"\n## {read(path)['title']}\n\n```sh\nfem-impact strike {place}\n```\n\n"
        text += "".join(player(each) for each in sounds.get(path.stem, []))
        code = path.read_text(encoding="utf-8")
        text += f"<details><summary>{path.name}</summary>\n\n```toml\n{code}```\n\n</details>\n"
    return text


def sounds(folder):
    """Sounds of studies and scenes in a folder, by the stem of their file; takes about half a minute."""
    found = {}
    for stem, place in SOUNDING.items():
        script, out = STUDIES / place / f"{stem}.py", Path(folder) / stem
        subprocess.run([sys.executable, str(script), str(out)], check=True, capture_output=True)
        found[stem] = sorted(path.rename(Path(folder) / f"{stem}_{path.name}") for path in out.glob("*.wav"))
    for path in EVERYDAY:
        if path.stem in HEARD:
            scene = fi.load_scene(path)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", fi.ToleranceWarning)
                hit = scene.strike()
            file = Path(folder) / f"{path.stem}.wav"
            fi.export.write_wav(file, hit, at=read(path)["strike"]["at"], duration=LENGTH, normalise=True)
            found[path.stem] = [file]
    return found
