"""Which assumption of the model itself fails first where, and by how much; and the audits of the everyday scenes.

    python studies/verification/is_the_model_right.py [--points 11] [--only steel stretching everyday ...] [--out DIR]

Three bodies are struck by a ball from 1 mm/s to 30 m/s: a hinged steel plate of 0.4 m by 0.3 m from 0.2 mm to 30 mm by
a steel ball of 10 mm, a free bar of spruce of 0.35 m from 2 mm to 60 mm by a wooden ball of 30 mm, and a flat bronze
disk of 0.4 m from 0.3 mm to 5 mm, a cymbal without its hole, by the same wooden ball. All materials are stated, with
typical values, so that nothing is unknown. A plate that has too many modes for a blow is infinite above a frequency.
Each blow is examined (`Response.assumptions`); the picture shows the assumption that changes the blow most and the
contours of that change; another one shows a plate with and without stretching. Then prints what every assumption
changes in the everyday scenes (`scenes/everyday/`): the largest change of a quantity asked for, "?" where it is not
known. Writes a CSV and the pictures.
"""

import sys
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap

import fem_impact as fi
from fem_impact.impact.assumption import ALL
from fem_impact.scenes.scene import scene_of

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

SPEEDS = 1e-3, 30.0  # [m/s]
TOLERANCE = 1e-2  # [-] of every blow
FELT = 1e-4  # [-] a change below this is not drawn: the model is right
TICKS = 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0  # [mm]
LEVELS = 1e-3, 1e-2, 0.1, 1.0
COLOURS = [
    "#0072b2",
    "#56b4e9",
    "#009e73",
    "#d55e00",
    "#e69f00",
    "#f0e442",
    "#cc79a7",
    "#332288",
    "#117733",
    "#999999",
]  # one for each of ALL
BALL = {"kind": "sphere", "radius": 0.015, "E": 1.5e9, "nu": 0.3, "rho": 700.0, "yield_strength": 1e7}  # maple
BODIES = {  # name: title, range of thickness [m], tables of the scene
    "steel": ("hinged steel plate of 0.4 m by 0.3 m, steel ball of 10 mm", (0.2e-3, 30e-3), {
        "mesh": {"shape": "rectangle", "length": 0.4, "width": 0.3},
        "material": {"E": 210e9, "nu": 0.3, "rho": 7850.0, "yield_strength": 235e6},
        "section": {"kind": "plate"},
        "target": {"damping_ratio": 0.001},
        "supports": {"boundary": "hinged"},
        "striker": {"kind": "sphere", "radius": 5e-3, "E": 210e9, "nu": 0.3, "rho": 7850.0, "yield_strength": 2e9},
        "contact": {"kind": "between"},
        "strike": {"at": [0.13, 0.11]},
    }),
    "wood": ("free spruce bar of 0.35 m by 50 mm, wooden ball of 30 mm", (2e-3, 60e-3), {
        "mesh": {"shape": "line", "length": 0.35},
        "material": {"E": 11e9, "nu": 0.37, "rho": 450.0, "E_across": 0.85e9, "G": 0.7e9, "yield_strength": 5e6},
        "section": {"kind": "beam", "width": 0.05},
        "target": {"damping_ratio": 0.005},
        "supports": {"left": "free", "right": "free"},
        "striker": BALL,
        "contact": {"kind": "hertz", "stiffness": 9.7e7},
        "strike": {"at": [0.15]},
    }),
    "cymbal": ("free bronze disk of 0.4 m, wooden ball of 30 mm", (0.3e-3, 5e-3), {
        "mesh": {"shape": "disk", "radius": 0.2},
        "material": {"E": 110e9, "nu": 0.34, "rho": 8700.0, "yield_strength": 2.5e8},
        "section": {"kind": "plate"},
        "target": {"damping_ratio": 0.001},
        "supports": {"boundary": "free"},
        "striker": BALL,
        "contact": {"kind": "between"},
        "strike": {"at": [0.12, 0.05]},
    }),
}  # fmt: skip


def scene(name: str, thickness: float, speed: float) -> fi.Scene:
    """The blow on a body of a thickness [m] at a speed [m/s]."""
    tables = {table: dict(values) for table, values in BODIES[name][2].items()}
    size = "height" if tables["section"]["kind"] == "beam" else "thickness"
    tables["section"] |= {size: float(thickness)}
    tables["strike"] |= {"speed": float(speed), "tolerance": TOLERANCE}
    return scene_of(tables, Path(name), folder=shared.STUDIES)


def effects(hit: fi.Response) -> dict[str, float]:
    """Largest change of a quantity of the blow by each assumption [-]; NaN where it is not known.

    The number of impacts counts only if nothing else was asked for: one more touch that changes nothing else is no
    matter.
    """
    found, asked = {}, set(hit.quantities) - {"n_impacts"} or {"n_impacts"}
    for each in hit.assumptions:
        known = [change for name, change in each.effect.items() if change is not None and name in asked]
        found[each.name] = max(known) if each.known else np.nan
    return found


def examine(name: str, points: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Thicknesses [m] and speeds [m/s], (points,) each, and effects (points, points, 8) [speed, thickness, assumption].

    A blow that cannot be computed is NaN.
    """
    thickness, speed = np.geomspace(*BODIES[name][1], points), np.geomspace(*SPEEDS, points)
    found = np.full((points, points, len(ALL)), np.nan)
    for i, j in np.ndindex(points, points):
        blow = scene(name, thickness[j], speed[i])
        try:
            found[i, j] = list(effects(blow.strike()).values())
        except fi.SimulationError as error:
            print(f"{name}, {1e3 * thickness[j]:.2g} mm at {speed[i]:.2g} m/s: {str(error).partition(';')[0]}")
    return thickness, speed, found


def draw(results: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]], path: Path) -> None:
    """One panel for each body: the assumption that fails first, and how much it changes."""
    figure, panels = plt.subplots(
        1, len(results), figsize=(5.2 * len(results), 5.0), squeeze=False, layout="constrained"
    )
    drawn: set[int] = set()
    colours = ListedColormap(COLOURS)
    for axes, (name, (thickness, speed, found)) in zip(panels[0], results.items()):
        size, missing = np.nan_to_num(found), np.isnan(found).all(axis=2)
        worst, which = np.ma.masked_where(missing, size.max(axis=2)), size.argmax(axis=2)
        felt = ~missing & (size.max(axis=2) >= FELT)
        silent = ~felt & np.isnan(found).any(axis=2)  # nothing that is known matters, but not all is known
        shown = np.ma.masked_where(~felt, which)
        drawn |= set(which[felt].tolist())
        axes.set_facecolor("#e6e6e6")  # where nothing is drawn
        limits = {"vmin": -0.5, "vmax": len(ALL) - 0.5}
        axes.pcolormesh(1e3 * thickness, speed, shown, cmap=colours, shading="nearest", **limits)
        unknown = np.ma.masked_where(~silent, silent.astype(float))
        axes.pcolormesh(1e3 * thickness, speed, unknown, cmap=ListedColormap(["white"]), shading="nearest")
        if np.ptp(worst) > 0.0:
            lines = axes.contour(1e3 * thickness, speed, worst, levels=LEVELS, colors="black", linewidths=0.9)
            axes.clabel(lines, fmt=lambda level: f"{100.0 * level:g} %", fontsize=8)
        axes.set(xscale="log", yscale="log", xlabel="thickness [mm]", ylabel="speed [m/s]")
        ticks = [x for x in TICKS if 0.99e3 * thickness[0] <= x <= 1.01e3 * thickness[-1]]
        axes.set_xticks(ticks, [f"{x:g}" for x in ticks])
        axes.set_xticks([], minor=True)
        axes.set_title(BODIES[name][0], fontsize=9)
    patches = [plt.Rectangle((0, 0), 1, 1, color=COLOURS[i]) for i in sorted(drawn)]
    patches.append(plt.Rectangle((0, 0), 1, 1, color="#e6e6e6"))
    patches.append(plt.Rectangle((0, 0), 1, 1, facecolor="white", edgecolor="#999999"))
    names = [*(ALL[i] for i in sorted(drawn)), "below 0.01 %", "not known"]
    figure.legend(patches, names, loc="outside lower center", ncols=len(names), frameon=False, fontsize=9)
    shared.save(path, figure, dpi=130)


def stretched(path: Path) -> None:
    """A hinged steel plate of 0.2 m by 0.3 m and 1 mm with and without stretching, from 3 cm/s to 3 m/s."""
    plate = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 1e-3)
    modes = fi.analytic.rectangle(0.2, 0.3, section=plate, n_modes=60, damping_ratio=0.002)
    hammer, law, at = fi.Striker.rigid(0.1), fi.Contact.linear(1e5), (0.09, 0.13)
    rows = []
    for speed in np.geomspace(0.03, 3.0, 13):
        how = {"at": at, "speed": float(speed), "tolerance": 1e-3, "quantity": ("restitution", "impulse", "force")}
        plain, better = (fi.strike(modes, hammer, law, stretching=on, **how) for on in (False, True))
        told, left = (next(x for x in hit.assumptions if x.name == "small deflections") for hit in (plain, better))
        true = abs(better.restitution - plain.restitution)
        changes = (np.nan if x.effect["restitution"] is None else x.effect["restitution"] for x in (told, left))
        rows.append((speed, told.value, left.value, true, *changes))
    speed, linear, true_depth, true, told, left = np.array(rows, float).T
    print(
        "speed [m/s], deflection over thickness without and with stretching, change of the restitution: by stretching,"
    )
    print("as estimated without it, and as estimated for the stress fields left out")
    for row in rows:
        print("  " + "  ".join(f"{x:8.3g}" for x in row))
    figure, (one, two) = plt.subplots(1, 2, figsize=(10.0, 4.0), layout="constrained")
    one.loglog(speed, linear, "--", label="without stretching")
    one.loglog(speed, true_depth, label="with stretching")
    one.axhline(1.0, color="grey", linewidth=0.8)
    one.set(xlabel="speed [m/s]", ylabel="deflection over thickness [-]")
    two.loglog(speed, true, label="by stretching")
    two.loglog(speed, told, "--", label="estimated without it")
    two.loglog(speed, left, ":", label="estimated: stress fields left out")
    two.set(xlabel="speed [m/s]", ylabel="change of the restitution [-]", ylim=(0.1 * true.min(), 2.0))
    for axes in (one, two):
        axes.legend(frameon=False, fontsize=9)
    shared.save(path, figure, dpi=130)


def everyday() -> list[dict[str, str]]:
    """A row for each everyday scene: the model's own error, and the largest change by each assumption."""
    rows = []
    for path in sorted((shared.SCENES / "everyday").glob("*.toml")):
        scene = fi.load_scene(path)
        if scene.stroke:  # a sequence is not audited as a whole
            continue
        hit = scene.strike()
        changes = {name: "?" if np.isnan(size) else _percent(size) for name, size in effects(hit).items()}
        rows.append({"scene": path.stem, "impacts": str(hit.n_impacts), **changes})
    return rows


def _percent(size: float) -> str:
    return "-" if size < FELT else f"{100.0 * size:.2g} %"


def table(rows: list[dict[str, str]]) -> str:
    """Rows as a table in Markdown."""
    names = list(rows[0])
    lines = [names, ["---"] * len(names), *(list(row.values()) for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """Examine the bodies and scenes asked for; print, write and draw what was found."""
    parser = shared.parser(__doc__, shared.OUT)
    parser.add_argument("--points", type=int, default=11, help="thicknesses, and speeds")
    parser.add_argument(
        "--only", nargs="+", choices=[*BODIES, "stretching", "everyday"], default=[*BODIES, "stretching", "everyday"]
    )
    options = parser.parse_args()
    warnings.simplefilter("ignore", fi.ToleranceWarning)
    results = {name: examine(name, options.points) for name in BODIES if name in options.only}
    for name, (_, _, found) in results.items():
        worst, which = np.nan_to_num(found).max(axis=2), np.nan_to_num(found).argmax(axis=2)
        right, beyond, failed = np.mean(worst < 1e-2), np.mean(worst > 0.2), np.isnan(found).all(axis=2).sum()
        print(f"{BODIES[name][0]}: {right:.0%} of the blows are right to 1 %, {beyond:.0%} are beyond 20 %,")
        print(f"  {failed} could not be computed. First of all fails")
        for i, assumption in enumerate(ALL):
            mine = (which == i) & (worst >= 1e-2)
            if mine.any():
                print(f"  {assumption} in {mine.mean():.0%}, up to {worst[mine].max():.0%}")
    if results:
        draw(results, options.out / "is_the_model_right.png")
        rows = []
        for name, (thickness, speed, found) in results.items():
            for i, j in np.ndindex(found.shape[:2]):
                row = {"body": name, "thickness [m]": f"{thickness[j]:.4g}", "speed [m/s]": f"{speed[i]:.4g}"}
                rows.append(row | {each: f"{x:.3g}" for each, x in zip(ALL, found[i, j])})
        shared.write_rows(options.out / "is_the_model_right.csv", rows)
    if "stretching" in options.only:
        stretched(options.out / "stretching.png")
    if "everyday" in options.only:
        print(table(everyday()))


if __name__ == "__main__":
    main()
