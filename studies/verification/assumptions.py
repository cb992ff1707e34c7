"""How well each estimate of the model's own error tells what the better model changes, in random scenes.

    python studies/verification/assumptions.py [--scenes 105] [--out DIR]

Plates of steel, aluminium and spruce, hinged rectangles of 0.2 m to 0.6 m, are struck by a mass, or a ball, at a random
point. Each blow is examined (`Response.assumptions`), and struck again with the better model:

* stretching: 1 mm to 5 mm thick, struck so hard that they bend by 0.05 to 0.7 of it; `stretching=True`;
* air: 0.5 mm to 3 mm thick; `fi.in_air` with both sides open;
* quasi-static contact: balls of steel, wood and rubber; the ball's lowest mode joins the blow, where the plain blow has
  the same compliance without its inertia;
* damping: no damping is stated; a damping ratio of 0.01 in all modes.

A true change is the largest one of restitution, contact time, impulse and peak force (the first absolute). Where it is
below 20 % the estimate should be within a factor of 3; above, it should say "beyond this estimate" ("hardly beyond": it
is within that factor, but below 20 % itself).
Changes below 1e-5, which two runs at 1e-6 may differ by, count as none. Prints a table and writes a CSV.
"""

import sys
import warnings
from pathlib import Path

import numpy as np

import fem_impact as fi
from fem_impact.impact.assumption import BEYOND
from fem_impact.model.local_contact import LAMB, LIVELY

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

KINDS = {  # what is examined, and the name of its assumption
    "stretching": "small deflections",
    "air": "still air",
    "quasi-static contact": "quasi-static contact",
    "damping": "stated damping",
}
METALS = (fi.Material(E=210e9, nu=0.3, rho=7850.0), fi.Material(E=70e9, nu=0.33, rho=2700.0))
SPRUCE = fi.Material(E=10e9, nu=0.3, rho=450.0)
RUBBER = fi.Material(E=5e6, nu=0.45, rho=1100.0)
QUANTITIES = ("restitution", "contact_time", "impulse", "force")
LEAST = 1e-5  # [-] a change below this is none
MODES = 40  # [-] of each plate: all of them stretch
DAMPING = 0.01  # [-] ratio that the examination tries
FASTER = 10.0  # [-] of a mode without inertia: it leaves 1 % of the change
TOLERANCE = 1e-6  # [-] of every run


def numbers(hit: fi.Response) -> np.ndarray:
    """Restitution, contact time, impulse and peak force."""
    return np.array([hit.restitution, hit.contact_time, hit.impulse, hit.peak_force])


def change(plain: fi.Response, better: fi.Response) -> float:
    """Largest change of a quantity: absolute of the restitution, relative of the others."""
    one, two = numbers(plain), numbers(better)
    return float((np.abs(two - one) / np.append(1.0, one[1:])).max())


def blows(kind: str, rng: np.random.Generator) -> tuple[fi.Response, ...]:
    """A random blow, the one to compare with, and that with the better model."""
    sides = rng.uniform(0.2, 0.6, 2)
    material = METALS[rng.integers(2)] if kind != "air" or rng.uniform() < 0.3 else SPRUCE
    thickness = float(np.exp(rng.uniform(*np.log([0.5e-3, 3e-3] if kind == "air" else [1e-3, 5e-3]))))
    damping = 0.0 if kind == "damping" else 0.01
    body = fi.analytic.rectangle(*sides, section=fi.Plate(material, thickness), n_modes=MODES, damping_ratio=damping)
    at = tuple(rng.uniform(0.2, 0.5, 2) * sides)
    how = {"at": at, "tolerance": TOLERANCE, "residual": False, "max_impacts": 1, "quantity": QUANTITIES}
    if kind == "quasi-static contact":
        ball = fi.Striker.sphere((*METALS, SPRUCE, RUBBER)[rng.integers(4)], float(rng.uniform(5e-3, 3e-2)))
        blow = {"contact": fi.Contact.between(ball, material), "speed": float(rng.uniform(0.1, 5.0)), **how}
        strikers = ball, lively(ball, FASTER), lively(ball, 1.0)
        return tuple(fi.strike(body, striker, **blow) for striker in strikers)
    period = 1.0 / body.frequencies[0]
    mass = float(body.mass * np.exp(rng.uniform(*np.log([0.02, 1.0]))))
    law = fi.Contact.linear(mass * (np.pi / (period * rng.uniform(0.05, 0.5))) ** 2)
    striker, speed = fi.Striker.rigid(mass), 1.0
    if kind == "stretching":  # a linear blow's deflection goes with the speed
        hit = fi.strike(body, striker, law, speed=speed, **how)
        depth = np.abs(hit.displacement([at], np.linspace(0.0, hit.impacts[-1].end, 200))).max()
        speed = float(np.exp(rng.uniform(*np.log([0.05, 0.7]))) * thickness / depth)
    better = fi.in_air(body) if kind == "air" else body.damped(DAMPING) if kind == "damping" else body
    plain = fi.strike(body, striker, law, speed=speed, **how)
    return plain, plain, fi.strike(better, striker, law, speed=speed, stretching=kind == "stretching", **how)


def lively(ball: fi.Striker, faster: float) -> fi.Striker:
    """A ball with its lowest mode, or one so much faster that gives as much: Hertz's law has that give already."""
    assert ball.material is not None and ball.radius is not None
    E, nu, rho = ball.material.E, ball.material.nu, ball.material.rho
    own = LAMB * np.sqrt(E / (2.0 * (1.0 + nu) * rho)) / ball.radius / (2.0 * np.pi)  # [Hz]
    rows = [[ball.mass**-0.5, faster * (LIVELY / ball.mass) ** 0.5]]
    modes = fi.Modes.from_arrays([0.0, faster * own], rows, points=[[0.0]], mass=ball.mass, complete=True)
    return fi.Striker.flexible(modes, at=[0.0])


def judge(kind: str, seed: int) -> dict[str, float | str]:
    """A random scene: what the better model changes, what was estimated, and whether that is right."""
    plain, before, better = blows(kind, np.random.default_rng(seed))
    told = next(each for each in plain.assumptions if each.name == KINDS[kind])
    true, estimate = change(before, better), told.worst
    if true < LEAST and estimate < 3.0 * LEAST:
        verdict = "silent"
    elif true > BEYOND:
        verdict = "beyond" if told.beyond else "hardly beyond" if estimate > true / 3.0 else "too small"
    else:
        low, high = true / 3.0 - LEAST, 3.0 * true + LEAST
        verdict = "right" if low <= estimate <= high else "too small" if estimate < low else "too large"
    return {"kind": kind, "seed": seed, "true": true, "estimate": estimate, "value": told.value, "verdict": verdict}


def main() -> None:
    """Judge random scenes of every kind; print a table and write a CSV."""
    parser = shared.parser(__doc__, shared.OUT)
    parser.add_argument("--scenes", type=int, default=105, help="of each kind")
    options = parser.parse_args()
    warnings.simplefilter("ignore", fi.ToleranceWarning)
    rows = [judge(kind, seed) for kind in KINDS for seed in range(options.scenes)]
    for kind in KINDS:
        mine = [row for row in rows if row["kind"] == kind]
        counts = {verdict: sum(row["verdict"] == verdict for row in mine) for verdict in
                  ("right", "silent", "beyond", "hardly beyond", "too small", "too large")}  # fmt: skip
        ratio = [
            row["estimate"] / row["true"] for row in mine if row["verdict"] not in ("silent", "beyond", "hardly beyond")
        ]
        print(f"{kind}: {', '.join(f'{n} {verdict}' for verdict, n in counts.items() if n)}", end="")
        print(f"; estimate over true change {min(ratio):.2f} to {max(ratio):.2f}" if ratio else "")
    rounded = [{key: f"{x:.3g}" if isinstance(x, float) else x for key, x in row.items()} for row in rows]
    shared.write_rows(options.out / "assumptions.csv", rounded)


if __name__ == "__main__":
    main()
