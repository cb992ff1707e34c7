"""What a flat body in place of the one built does to a blow: cymbals, guitar top, panels, floor and soundboard.

    python studies/verification/flatness.py [--only NAME ...] [--out DIR]

Strikes the everyday scenes of curved and ribbed bodies as they are, and without rise and ribs. The floor on ribs is
compared with a solid one of 200 mm, which weighs twice as much and which the scene had before. Prints a table of both
blows and the first modes, writes the same as CSV, and draws modes of the cymbal and of the guitar top on their true
shape (`flatness.png`).
"""

import re
import sys
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

EVERYDAY = shared.SCENES / "everyday"
NAMES = (
    "cymbal_splash_10_maple", "cymbal_crash_16_hickory", "cymbal_ride_20_oak", "guitar_fingertip", "guitar_fingernail",
    "hammer_car_door", "hammer_car_bonnet", "hammer_concrete_floor", "hammer_piano_soundboard",
)  # fmt: skip
DRAWN = "cymbal_crash_16_hickory", "guitar_fingertip"
FIRST, SHOWN = 3, 8  # [-] modes in the table and in the picture
CURVED = re.compile(r"^rise = [^\n]*\n|^\[\[rib\]\].*?\n\n|^\[in_plane\]\n.*?\n\n", re.MULTILINE | re.DOTALL)
SOLID = {"hammer_concrete_floor": ("thickness = 0.07 ", "thickness = 0.2 ")}  # another body stands for this one


@dataclass(frozen=True)
class Row:
    """One blow on one body."""

    scene: str
    body: str  # "flat" or "as built"
    restitution: float  # [-]
    contact_time: float  # [s]
    peak_force: float  # [N]
    n_impacts: int
    modes: str  # [Hz] the first ones that bend
    error: float  # [-] estimated, of the computation


def flat(name: str) -> str:
    """The text of an everyday scene without rise and ribs."""
    text = (EVERYDAY / f"{name}.toml").read_text(encoding="utf-8").replace("../../../meshes", shared.MESHES.as_posix())
    return CURVED.sub("", text).replace(*SOLID.get(name, ("", "")))


def blows(name: str) -> Iterator[Row]:
    """The blow of a scene on the flat body and on that which is built."""
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / f"{name}.toml"
        plain.write_text(flat(name), encoding="utf-8")
        for body, path in (("flat", plain), ("as built", EVERYDAY / plain.name)):
            scene = fi.load_scene(path)
            hit = scene.strike()
            modes = scene.modes(FIRST, elastic=True)
            first = modes.frequencies[modes.n_rigid :][:FIRST]
            yield Row(
                name, body, hit.restitution, hit.contact_time, hit.peak_force, hit.n_impacts,
                " ".join(f"{x:.0f}" if x >= 100.0 else f"{x:.1f}" for x in first), hit.error.total,
            )  # fmt: skip


def line(row: Row) -> str:
    """A row of the table in Markdown."""
    cells = [f"`{row.scene}`", row.body, f"{row.restitution:.3f}", f"{1e3 * row.contact_time:.2f}"]
    return "| " + " | ".join([*cells, f"{row.peak_force:.3g}", f"{row.n_impacts}", row.modes]) + " |"


def draw(out: Path) -> None:
    """Modes of the cymbal and of the guitar top with their rise, one picture above the other."""
    figure, axes = plt.subplots(len(DRAWN), 1, figsize=(10.0, 8.6), layout="constrained")
    for ax, name in zip(axes, DRAWN):
        path = out / f"modes_{name}.png"
        said = fi.pictures.mode_shapes(path, fi.load_scene(EVERYDAY / f"{name}.toml").modes(SHOWN), count=SHOWN)
        if said:
            print(said)
        picture = plt.imread(path)
        inked = (picture[..., :3] < 1.0).any(axis=2).any(axis=1).nonzero()[0]
        ax.imshow(picture[max(0, inked[0] - 20) : inked[-1] + 20])
        ax.set_axis_off()
        path.unlink()
    print(shared.save(out / "flatness.png", figure, dpi=150))


def main() -> None:
    """Run the study from the command line."""
    parser = shared.parser(__doc__, shared.OUT)
    parser.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, help="scenes to strike")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", fi.ToleranceWarning)
    print("| scene | body | restitution | contact time [ms] | peak force [N] | impacts | first modes [Hz] |")
    print("|---|---|---|---|---|---|---|", flush=True)
    rows = []
    for name in options.only:
        for row in blows(name):
            rows.append(row)
            print(line(row), flush=True)
    shared.write_rows(options.out / "flatness.csv", rows)
    draw(options.out)


if __name__ == "__main__":
    main()
