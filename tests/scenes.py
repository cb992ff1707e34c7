"""Scenes that strike at once, as text, for tests of everything around the strike, and where those of files are."""

from pathlib import Path

import fem_impact as fi

ROOT = Path(__file__).parents[1]
BODIES = ROOT / "tests" / "bodies"
MESHES, MEASURED, SHIPPED = ROOT / "meshes", ROOT / "studies" / "measured", ROOT / "studies" / "scenes"

QUICK = """
[mesh]
shape = "rectangle"
length = 0.465
width = 0.3
[target]
mass = 0.2
first_frequency = 100.0
source = "analytic"
[supports]
boundary = "hinged"
[striker]
kind = "rigid"
mass = 0.03
[contact]
kind = "linear"
stiffness = 1e4
[strike]
at = [0.1395, 0.09]
tolerance = 1e-2
speed = 2.0
[map]
over = { "striker.mass" = [0.03, 0.05] }
"""
SMALL = (  # the same through a Hertz spring, damped, with no map
    QUICK.partition("[map]")[0]
    .replace("first_frequency = 100.0", "first_frequency = 100.0\ndamping_ratio = 0.01")
    .replace('"linear"\nstiffness = 1e4', '"hertz"\nstiffness = 695e3')
)
TITLED = 'title = "A small test"' + SMALL
BAR = """
[mesh]
shape = "line"
length = 0.35
[material]
E = 12e9
nu = 0.3
rho = 800.0
[section]
kind = "beam"
width = { x = [0.0, 0.175], values = [0.05, 0.04] }
height = 0.02
[target]
damping_ratio = 0.005
[striker]
kind = "rigid"
mass = 0.03
[contact]
kind = "linear"
stiffness = 1e5
[strike]
at = [0.17]
speed = 1.0
tolerance = 1e-2
"""
LEAF = """<svg xmlns="http://www.w3.org/2000/svg" width="90mm" height="60mm" viewBox="0 0 90 60">
<path d="M 5 30 C 25 0, 65 0, 85 30 C 65 60, 25 60, 5 30 Z"/></svg>"""


def edited(old, new, text=TITLED):
    """A scene in which a piece of its text is another."""
    assert old in text
    return text.replace(old, new)


def load_text(folder, text=SMALL):
    """The scene of a text, in a file of its own."""
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return fi.load_scene(path)
