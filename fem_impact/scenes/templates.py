"""Commented scenes to begin with: each runs as it stands and says what else its keys may be."""

from pathlib import Path

from .._base import check
from .._base.files import write_whole

BODIES = {
    "plate": """title = "A steel ball taps a wooden plate"

[mesh]                    # the outline of the struck body
shape = "rectangle"       # also "disk", "polygon", "outline" (an SVG or DXF file), "file" (a mesh), "line" (a beam)
length = 0.4              # m, along x from 0
width = 0.3               # m, along y from 0
# rise = { shape = "cap", radius = 2.0, centre = [0.2, 0.15] }      # m, if curved; also "cylinder", "saddle", "cymbal"

[material]
E = 10e9                  # Pa; for wood along the grain, with E_across [Pa], G [Pa] and angle [rad]
nu = 0.3                  # -
rho = 450.0               # kg/m^3

[section]
kind = "plate"
thickness = 4e-3          # m; also a table over x and y, or a list of cases; or layers as tables [[layer]]

[supports]                # edges not named are free; boundary means all of them
boundary = "hinged"       # "clamped", "hinged", "free" or springs { stiffness, rotation }

# [[rib]]                 # a bar on the side that is not struck, and any number more
# path = [[0.1, 0.0], [0.1, 0.3]]   # m; or edge = "left"
# width = 8e-3            # m, along the plate
# height = 12e-3          # m, across it; also [[distance, height], ...] along the rib
""",
    "disk": """title = "A steel ball taps a steel disk"

[mesh]
shape = "disk"            # its centre is at x = y = 0
radius = 0.15             # m
# hole = 0.02             # m, radius of a hole in the middle

[material]
E = 210e9                 # Pa
nu = 0.3                  # -
rho = 7850.0              # kg/m^3

[section]
kind = "plate"
thickness = 2e-3          # m

[supports]                # without this table the disk is free
boundary = "clamped"      # "clamped", "hinged", "free" or springs { stiffness, rotation }
""",
    "beam": """title = "A steel ball taps an aluminium bar"

[mesh]
shape = "line"            # its ends are called left (x = 0) and right
length = 0.3              # m

[material]
E = 70e9                  # Pa
nu = 0.33                 # -
rho = 2700.0              # kg/m^3

[section]
kind = "beam"
width = 0.03              # m, across the blow; or diameter alone for a round bar
height = 0.01             # m, along the blow; also a table over x

[supports]                # without this table the bar is free
left = "free"             # "clamped", "hinged", "free" or springs { stiffness, rotation }
right = "free"
""",
}
DAMPING = """
[target]
damping_ratio = 0.005     # - of critical, every mode; or { frequency = [...], ratio = [...] }
# mass = 0.2              # kg, rescales the body
# first_frequency = 100.0 # Hz, rescales it too
"""
BLOW = """
[striker]
kind = "rigid"            # also "sphere" (with its material), "stick", "hammer", "turning", "bar"
mass = 0.02               # kg

[contact]
kind = "hertz"            # also "linear", "power", "restituting", "layers", "elastic_plastic", "felt", "between"
stiffness = 1e7           # N/m^1.5; for a linear contact N/m

[strike]
at = {at}
speed = 1.0               # m/s
tolerance = 1e-3          # - largest accepted error of restitution, impulse, contact time and peak force

[observe]
points = [{at_point}]  # m, where motion and sound are computed
"""
MAP = """
[map]                     # for `fem-impact map`
max_frequency = 5e3       # Hz, upper end of the band of the spectral centroid

[map.over]                # any numbers of the scene, as a list or a range
"striker.mass" = { from = 0.005, to = 0.1, count = 12, scale = "log" }        # kg
"contact.stiffness" = { from = 1e6, to = 1e8, count = 12, scale = "log" }     # N/m^1.5
"""
PLACES = {"plate": "[0.13, 0.1]", "disk": "[0.05, 0.0]", "beam": "[0.1]"}  # [m] strike points, away from nodes
KINDS = (*BODIES, "map")


def text(kind: str) -> str:
    """The scene of a kind, one of `KINDS`, as the text of a TOML file."""
    body = "plate" if check.one_of("kind", kind, KINDS) == "map" else kind
    place = PLACES[body]
    at = f"{place}".ljust(20) + "# m, where the striker hits"
    whole = BODIES[body] + DAMPING + BLOW.format(at=at, at_point=place)
    return whole + MAP if kind == "map" else whole


def write_scene(path: Path, kind: str, whole: str | None = None) -> None:
    """Write the scene of a kind, or another text; refuses to replace a file."""
    if path.suffix.lower() != ".toml":
        raise ValueError(f"a scene must be a .toml file, got {path}")
    if path.exists():
        raise ValueError(f"{path} exists already; name another file with --out, or remove it")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, text(kind) if whole is None else whole)
