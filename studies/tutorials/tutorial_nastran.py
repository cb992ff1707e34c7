"""Tutorial: from Nastran to the sound of it. Reads a car door from its files, taps it with a hammer and hears it.

python studies/tutorials/tutorial_nastran.py [FOLDER]

You have a model in Nastran; ask it for SOL 103 with `DISPLACEMENT(PLOT)=ALL` and mass-normalised modes, and for SOL 101
with a unit load at each point that will be struck (with PARAM,INREL,-1 if the body is free), both with PARAM,POST,-1.
Here this program stands in for Nastran: the first step writes the files that it would leave, of a door whose skin is
curved and stiffened, by elements of our own, so that the last step can say what the way through the files cost.
"""

import sys
from pathlib import Path

import numpy as np

import fem_impact as fi
from fem_impact.modes import viewing

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared
import solids

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
SKIN, BEND = 0.7e-3, 3.0  # [m] thickness and radius
AT, LISTEN = (0.5, -0.3), (0.75, -0.42)  # [m] below the sill, and nearer to the lock
STIFFENERS = [[(0.1, -0.48), (1.0, -0.44)], [(0.1, -0.2), (1.0, -0.2)]]  # [m] side impact bar and sill
HAMMER, TIP, SPEED = 0.1, fi.Contact.hertz(5e5), 1.0  # [kg], of soft plastic, [m/s]
FREQUENCY, DAMPING = 600.0, 0.005  # [Hz] highest mode; typical of a painted panel


def door(max_frequency: float = FREQUENCY) -> fi.Modes:
    """The skin of a door, hemmed around its rim, with two hats of steel glued behind it."""
    hat = fi.Beam.rectangular(STEEL, width=0.02, height=4e-3)
    bent = fi.rise.cylinder(BEND, centre=(0.55, -0.33))
    system = fi.assemble(
        fi.mesh.outline(shared.MESHES / "car_door.svg"), fi.Plate(STEEL, SKIN), {"rim": "clamped"}, rise=bent,
        ribs=[fi.Rib(path, hat) for path in STIFFENERS],
    )  # fmt: skip
    return fi.find_modes(system, max_frequency=max_frequency, damping_ratio=DAMPING)


def stand_in(modes: fi.Modes, at: np.ndarray, folder: Path) -> tuple[list[Path], int]:
    """Write door.bdf and door.op2 as Nastran would; return their paths and the number of the loaded node."""
    if not hasattr(np, "in1d"):  # numpy 2.4 lacks it, and pyNastran 1.3 asks for it
        setattr(np, "in1d", np.isin)  # noqa: B010
    from pyNastran.op2.op2 import OP2
    from pyNastran.op2.tables.oug.oug_displacements import RealDisplacementArray
    from pyNastran.op2.tables.oug.oug_eigenvectors import RealEigenvectorArray

    points, cells = modes.shapes.grid()
    loaded = int(np.linalg.norm(points - at, axis=1).argmin())
    places = viewing.places_in_space(modes, points)
    lines = [f"GRID*   {i:16d}{'':16}{x:16.9e}{y:16.9e}\n*       {z:16.9e}" for i, (x, y, z) in enumerate(
        places.tolist(), 1)]  # fmt: skip
    lines += [f"CTRIA3,{i},1,{a},{b},{c}" for i, (a, b, c) in enumerate((cells + 1).tolist(), 1)]
    lines += [f"PSHELL,1,1,{SKIN:g},1", f"MAT1,1,{STEEL.E:.4g},,{STEEL.nu:g},{STEEL.rho:.1f}"]
    deck, results = folder / "door.bdf", OP2(debug=False)
    deck.write_text("\n".join(lines) + "\n")
    nodes = np.column_stack([np.arange(1, len(points) + 1), np.ones(len(points))]).astype("int32")
    static, shapes = np.zeros((1, len(points), 6), "float32"), np.zeros((modes.n_modes, len(points), 6), "float32")
    static[0, :, 2] = modes.shapes.deflection(points[[loaded]], points)[:, 0]
    shapes[:, :, 2] = modes.shape_at(points).T
    results.is_nx = False
    results.displacements[1] = RealDisplacementArray.add_static_case("OUGV1", nodes, static, 1)
    order = list(range(1, modes.n_modes + 1)), (modes.omega**2).tolist(), modes.frequencies.tolist()
    results.eigenvectors[2] = RealEigenvectorArray.add_modal_case("OUGV1", nodes, shapes, 2, *order)
    results.eigenvectors[2].table_code = 7  # not that of displacements
    results.write_op2(str(folder / "door.op2"))
    return [folder / "door.op2", deck], loaded + 1


def main(folder: Path, max_frequency: float = FREQUENCY) -> tuple[fi.Response, fi.Response]:
    """Go from the files to the sound; return the blow on what was read and that on what had been written."""
    folder.mkdir(parents=True, exist_ok=True)

    print("1. The files. Nastran has left door.op2 and door.bdf; here our own shell stands in for it.")
    own = door(max_frequency)
    files, number = stand_in(own, np.array(AT), folder)
    print(f"   {own.n_modes} modes up to {own.frequencies[-1]:.0f} Hz, and the deflection under 1 N on node {number}")

    print("2. Read them. They hold neither the mass nor the load; say both, and that shells have no dent.")
    loads = [(number, (0.0, 0.0, 1.0))]
    body = fi.Body.load(files, mass=own.mass, loads=loads, damping_ratio=DAMPING, solid=False, names={"sill": number})
    print(f"   {len(body.nodes)} nodes, {body.mass:.2f} kg, the lowest at "
          f"{', '.join(f'{f:.1f}' for f in body.frequencies[:4])} Hz")  # fmt: skip

    print("3. Strike it at a node, along z or its normal; a hammer of 0.1 kg with a soft tip.")
    hammer = fi.Striker.rigid(HAMMER)
    hit = fi.strike(body.modes("z", free=False), hammer, TIP, at=body.at("sill"), speed=SPEED, tolerance=1e-2)
    print(f"   {hit.verdict}")
    print(f"   {1e3 * hit.contact_time:.3f} ms in contact, {hit.peak_force:.1f} N, error {hit.error.total:.0e}")

    print("4. Hear it at another node.")
    ear = body.nodes[np.linalg.norm(body.nodes[:, :2] - LISTEN, axis=1).argmin()]
    near = body.frequencies[np.argsort(-np.abs(body.along(ear) * body.along("sill")) / body.frequencies)[:3]]
    path, heard = solids.listened(hit, body, ear, "z", "door", near, 2.0, folder)
    pairs = ", ".join(f"{f:.1f} Hz for a mode at {g:.1f} Hz" for f, g in zip(heard, near))
    print(f"   {path.name} holds {pairs}")
    motion = body.shapes @ hit.modal_state([0.5 * hit.contact_time])[0][0]
    lowest = [(f"mode {i + 1}, {body.frequencies[i]:.0f} Hz", body.shapes[:, :, i]) for i in range(2)]
    figure = solids.drawn(body, [*lowest, ("in the blow", motion)], "A car door and a blow on it", (40.0, -80.0))
    shared.save(folder / "nastran_door.png", figure)

    print("5. What the way through the files cost: the same blow on what was written.")
    truth = fi.strike(own, hammer, TIP, at=body.nodes[number - 1, :2], speed=SPEED, tolerance=1e-2)
    for name in ("restitution", "contact_time", "peak_force"):
        one, two = getattr(hit, name), getattr(truth, name)
        print(f"   {name:13} {one:.6g} of the files, {two:.6g} of our own")
    print(f"   both are right to {hit.error.total + truth.error.total:.0e}. Everything is in {folder}.")
    return hit, truth


if __name__ == "__main__":
    main(shared.folder())
