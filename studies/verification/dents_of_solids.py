"""Solid bodies of three meshes, struck by a ball: is the dent of their unit loads counted once, and no mesh seen?

A free steel bar and a thick steel plate are elastic solids of quadratic tetrahedra, by NGSolve, on three meshes that
get finer about the point struck. Their modes and the static solution under a unit load on one node, with inertia
relief, are what any program of finite elements would hand over. A steel ball strikes them, in Hertz's contact, with

    "as a shell"  nothing taken out (solid=False), as if the load left no dent,
    "unsaid"      nothing taken out, and its error stated (solid=None),
    "as a solid"  the dent taken out (solid=STEEL),

and, "own", the Timoshenko beam or Mindlin plate of this program in their place.

    python studies/verification/dents_of_solids.py --solve     # solves the solids, writes dents_of_solids.npz (NGSolve)
    python studies/verification/dents_of_solids.py [--out DIR] # strikes them, prints a table and writes a CSV
"""

import sys
import warnings
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared
import solids

TABLE = Path(__file__).with_suffix(".npz")
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
BALL = fi.Striker.sphere(STEEL, radius=0.01)
SPEED = 0.2  # [m/s] contacts of 90 us, whose radius is 0.11 mm
KEPT = 96, 32  # nodes of the top and others nearest to the load that are in the file


@dataclass(frozen=True)
class Brick:
    """A free brick, struck on its top at a point."""

    sides: tuple[float, float, float]  # [m]
    at: tuple[float, float]  # [m]
    meshes: tuple[tuple[float, float], ...]  # [m] size of elements anywhere and under the load
    n_modes: int  # with the rigid ones

    @property
    def struck(self) -> np.ndarray:
        return np.array([*self.at, self.sides[2]])


BRICKS = {
    "bar": Brick((0.16, 0.012, 0.012), (0.056, 0.006), ((6e-3, 4e-3), (5e-3, 2e-3), (4e-3, 1e-3)), 40),
    "block": Brick((0.12, 0.09, 0.018), (0.048, 0.04), ((12e-3, 6e-3), (10e-3, 3e-3), (8e-3, 1.5e-3)), 50),
}


# Solving them


def solved(body: Brick, size: float, near: float) -> dict[str, np.ndarray]:
    """Frequencies [Hz], and shapes and unit load's deflection along z at nodes around the load."""
    import ngsolve as ng
    from netgen.occ import Box, Glue, Pnt

    (a, b, h), (x, y) = body.sides, body.at
    pairs = [((0.0, x), (0.0, y)), ((x, a), (0.0, y)), ((0.0, x), (y, b)), ((x, a), (y, b))]
    shape = Glue([Box(Pnt(x0, y0, 0.0), Pnt(x1, y1, h)) for (x0, x1), (y0, y1) in pairs])
    mesh = solids.meshed(shape, size, [(body.struck, near)])
    found = solids.solve(mesh, STEEL, body.n_modes, [(body.struck, (0.0, 0.0, 1.0))])
    nodes, moved = at_nodes(mesh, ng.GridFunction(found.space), found.columns, body.struck)
    values = found.frequencies
    print(f"{len(found.columns)} unknowns, {size:g} m, {near:g} m at the load: {values[6]:.6g} to {values[-1]:.6g} Hz")
    return {
        "frequencies": values, "nodes": nodes, "shapes": moved[:, :-1].astype(np.float32), "static": moved[:, -1],
    }  # fmt: skip


def at_nodes(mesh: Any, field: Any, columns: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes around a point, corners and middles of edges, and the motions along z there."""
    corners = np.array([mesh[each].point for each in mesh.vertices])
    ends = np.array([[end.nr for end in each.vertices] for each in mesh.edges])
    nodes = np.vstack([corners, corners[ends].mean(axis=1)])
    order, top = np.argsort(np.linalg.norm(nodes - at, axis=1), kind="stable"), np.abs(nodes[:, 2] - at[2]) < 1e-9
    nodes = nodes[np.concatenate([order[top[order]][: KEPT[0]], order[~top[order]][: KEPT[1]]])]
    found, places = np.zeros((len(nodes), columns.shape[1])), [mesh(*node) for node in nodes]
    for k, column in enumerate(columns.T):
        field.vec.FV().NumPy()[:] = column
        found[:, k] = [field(place)[2] for place in places]
    return nodes, found


def solve() -> None:
    """Solve all bodies on all meshes and keep what the blows need."""
    import ngsolve as ng

    ng.ngsglobals.msg_level = 0
    ng.SetNumThreads(1)
    kept = {}
    for name, body in BRICKS.items():
        for i, (size, near) in enumerate(body.meshes):
            kept |= {f"{name} {i} {what}": values for what, values in solved(body, size, near).items()}
    np.savez_compressed(TABLE, **kept)


# Striking them


def known(name: str, mesh: int, solid: Any, table: Any = TABLE) -> fi.Body:
    """A body on one of its meshes, as it comes from elsewhere; node 1 is struck."""
    with np.load(table) as kept:
        frequencies, nodes, along, under = (
            kept[f"{name} {mesh} {what}"] for what in ("frequencies", "nodes", "shapes", "static")
        )
    shapes, static = np.zeros((len(nodes), 3, len(frequencies))), np.zeros((len(nodes), 3, 1))
    shapes[:, 2], static[:, 2, 0] = along, under
    mass = STEEL.rho * float(np.prod(BRICKS[name].sides))
    return fi.Body(frequencies, shapes, nodes, mass, static=static, loads=[(1, (0.0, 0.0, 1.0))], solid=solid)


def struck(body: Any, at: Any, tolerance: float = 1e-2) -> fi.Response:
    """The first impact of the ball."""
    law = fi.Contact.between(BALL, STEEL)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        return fi.strike(body, BALL, law, at=at, speed=SPEED, tolerance=tolerance, max_impacts=1)


def of_solid(name: str, mesh: int, solid: Any) -> fi.Response:
    """The blow on a solid."""
    body = known(name, mesh, solid)
    return struck(body.modes("z"), body.at(1))


@cache
def own(name: str) -> fi.Response:
    """The blow on the beam or plate of this program."""
    body = BRICKS[name]
    (a, b, h), (x, y) = body.sides, body.at
    if name == "bar":
        beam = fi.Beam.rectangular(STEEL, width=b, height=h)
        return struck(fi.assemble(fi.mesh.line(a), beam, theory="timoshenko"), [x], 1e-3)
    return struck(fi.assemble(fi.mesh.rectangle(a, b), fi.Plate(STEEL, h), theory="mindlin"), (x, y), 1e-3)


def local(hit: fi.Response) -> float:
    """What the assumption of a small contact, which plates and beams need, changes in it [-], as far as is known."""
    return float(sum(each.worst for each in hit.assumptions if each.name == "local contact"))


def apart(one: fi.Response, two: fi.Response) -> float:
    """Largest difference of two blows in restitution, and relatively in contact time and peak force."""
    relative = [abs(getattr(one, each) / getattr(two, each) - 1.0) for each in ("contact_time", "peak_force")]
    return max(abs(one.restitution - two.restitution), *relative)


def main() -> None:
    """Strike all bodies on all meshes; print a table and write a CSV."""
    parser = shared.parser(__doc__, shared.OUT)
    parser.add_argument("--solve", action="store_true", help="solve the solids first, by NGSolve")
    options = parser.parse_args()
    if options.solve:
        solve()
    rows: list[dict[str, Any]] = []
    ways = {"own": None, "as a shell": False, "unsaid": None, "as a solid": STEEL}
    print(f"{'':29}restitution  contact time  peak force   claimed  from own   its local contact")
    for name in BRICKS:
        truth = own(name)
        for way, solid in ways.items():
            for mesh in range(1 if way == "own" else 3):
                hit = truth if way == "own" else of_solid(name, mesh, solid)
                rows.append({
                    "body": name, "way": way, "mesh": mesh, "restitution": hit.restitution,
                    "contact_time": hit.contact_time, "peak_force": hit.peak_force, "claimed": hit.error.total,
                    "from_own": apart(hit, truth), "local": local(truth), "verdict": hit.verdict,
                })  # fmt: skip
                print(
                    f"{name:6} {way:11} mesh {mesh + 1}{hit.restitution:16.4f}{1e6 * hit.contact_time:11.2f} us"
                    f"{hit.peak_force:10.2f} N{hit.error.total:10.1e}{apart(hit, truth):10.1e}{local(truth):10.1e}"
                )
    shared.write_rows(options.out / "dents_of_solids.csv", rows)


if __name__ == "__main__":
    main()
