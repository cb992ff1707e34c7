"""Beyond the source: a phone is dropped on its corner; the first contact throws it back and makes it turn.

The phone is a block of rounded corners (`solids.py`), alike everywhere, with the stiffness of aluminium and the mass of
a phone: not its screen, gaps and joints. It falls in its own plane, a corner first. Seen from the phone a floor of
granite comes at it, a fifth of its thickness off its middle; its six rigid motions hold fall and turn. The corner bends
over 8 mm in the plane and, in the contact law alone, over 4 mm across. Friction, which would turn the phone otherwise,
is left out. The script prints the motion after the contact beside that of a rigid block with the same impulse, and what
the sound of its back holds, at the corner that is up.

    python studies/figures/beyond_dropped_phone.py [folder]
"""

import sys
from pathlib import Path

import numpy as np
import source_scenes as source

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `solids`
import solids

SIDES = np.array([0.15, 0.072, 0.008])  # [m]
ROUND, CROWN = 8e-3, 4e-3  # [m] radii of the corner in the plane and across it
FRAME = fi.Material(E=70e9, nu=0.33, rho=2200.0)  # 0.19 kg
GRANITE = fi.Material(E=60e9, nu=0.25, rho=2700.0)  # typical
YIELD = 250e6  # [Pa] of aluminium 6061-T6
DROP, GRAVITY = 0.3, 9.81  # [m], [m/s^2]
OFF = 0.2  # [-] of the thickness: how far from its middle the corner meets the floor
MIDDLE = SIDES * (0.5, 0.5, -OFF)
WAY = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)  # in which the floor comes, from the corner inwards
DAMPING = 0.01  # [-] typical of a phone, between its parts
FLOOR = 1e6  # [kg] so heavy that it keeps its speed to 2e-7
SIZES = 5e-3, 5e-4  # [m] of tetrahedra anywhere, and at the corner
SECONDS = 0.5


def shape():
    """The block, of two halves across and with a corner of theirs in the middle of the rounding; and that place."""
    from netgen.occ import ArcOfCircle, Face, Glue, Pnt, Segment, Vec, Wire

    (a, b, h), r = SIDES, ROUND

    def arc(x, y, *eighths):
        """A corner's piece of circle, about a point, between multiples of an eighth of a turn."""
        angles = 0.25 * np.pi * np.array([eighths[0], np.mean(eighths), eighths[1]])
        return ArcOfCircle(*(Pnt(x + r * np.cos(each), y + r * np.sin(each), 0.0) for each in angles))

    rim = [
        arc(r, r, 4, 5), arc(r, r, 5, 6), Segment(Pnt(r, 0.0, 0.0), Pnt(a - r, 0.0, 0.0)), arc(a - r, r, 6, 8),
        Segment(Pnt(a, r, 0.0), Pnt(a, b - r, 0.0)), arc(a - r, b - r, 0, 2),
        Segment(Pnt(a - r, b, 0.0), Pnt(r, b, 0.0)), arc(r, b - r, 2, 4),
        Segment(Pnt(0.0, b - r, 0.0), Pnt(0.0, r, 0.0)),
    ]  # fmt: skip
    face = Face(Wire(rim))
    place = r * (1.0 - np.sqrt(0.5))
    return Glue([face.Extrude(Vec(0.0, 0.0, z)) for z in ((0.5 - OFF) * h, -(0.5 + OFF) * h)]), np.array(
        [place, place, 0.0]
    )


def solve(sizes=SIZES, n_modes=60):
    """The phone as a `fi.Body`, and its corner (3,) [m]."""
    glued, corner = shape()
    loads = [(corner, WAY)]
    solved = solids.solve(solids.meshed(glued, sizes[0], [(corner, sizes[1])], 0.3), FRAME, n_modes, loads)
    return solids.body(solved, loads, solid=FRAME, damping_ratio=DAMPING), corner


def strike(phone, corner, **more):
    """The first contact with the floor."""
    law = fi.Contact.between(fi.Striker.sphere(FRAME, np.sqrt(ROUND * CROWN)), GRANITE, yield_strength=YIELD)
    speed = np.sqrt(2.0 * GRAVITY * DROP)
    more = {"tolerance": 1e-2} | more
    return fi.strike(
        phone.modes(WAY), fi.Striker.rigid(FLOOR), law, at=phone.at(corner), speed=speed, max_impacts=1, **more
    )


def rigid(phone, moved):
    """Velocity (3,) of the middle and turning (3,) of motions (n_nodes, 3), as far as they are rigid."""
    apart = phone.nodes - phone.nodes.mean(axis=0)
    rows = np.zeros((len(apart), 3, 6))
    rows[:, :, :3] = np.eye(3)
    rows[:, :, 3:] = np.cross(np.eye(3)[None], apart[:, None, :]).swapaxes(1, 2)
    found = np.linalg.lstsq(rows.reshape(-1, 6), moved.ravel(), rcond=None)[0]
    return found[:3] + np.cross(found[3:], MIDDLE - phone.nodes.mean(axis=0)), found[3:]


def inertia():
    """Moments of inertia (3,) [kg m^2] of the block about its middle, its rounded corners left out."""
    (a, b, h), cut = SIDES, (1.0 - 0.25 * np.pi) * ROUND**2
    out = ROUND * (1.0 - 1.0 / 6.0 / (1.0 - 0.25 * np.pi))  # from each side to the middle of what is cut off
    far = np.array([0.5 * a, 0.5 * b]) - out
    x, y = FRAME.rho * h * (np.array([a**3 * b, a * b**3]) / 12.0 - 4.0 * cut * far**2)
    flat = FRAME.rho * (a * b - 4.0 * cut) * h**3 / 12.0
    return np.array([y + flat, x + flat, x + y])


def main():
    """Print the motion after the contact; write picture and sound."""
    phone, corner = solve()
    hit = strike(phone, corner)
    speed, impulse = np.sqrt(2.0 * GRAVITY * DROP), hit.impulse
    print(hit.verdict)
    print(f"phone {1e3 * phone.mass:.0f} g, {speed:.2f} m/s: contact {1e6 * hit.contact_time:.0f} us, peak "
          f"{hit.peak_force:.0f} N, impulse {impulse:.4f} N s, error {hit.error.total:.1e}")  # fmt: skip
    state = hit.modal_state([hit.impacts[-1].end])[1]
    moving, turning = rigid(phone, phone.shapes @ np.where(phone.frequencies > 0.0, 0.0, state[0]))
    turned = impulse * np.cross(corner - MIDDLE, WAY) / inertia()
    print(f"{'':18}{'by six modes':>14}{'rigid block':>14}")
    print(f"{'kick [m/s]':18}{moving @ WAY:14.4f}{impulse / phone.mass:14.4f}")
    for axis, one, other in zip("xyz", turning, turned):
        print(f"{'turning ' + axis + ' [1/s]':18}{one:14.3f}{other:14.3f}")
    print(
        f"its middle leaves the floor at {moving @ WAY - speed:.2f} m/s and turns in its plane once in "
        f"{1e3 * 2.0 * np.pi / abs(turning[2]):.0f} ms"
    )
    back = phone.nodes[np.linalg.norm(phone.nodes - SIDES * (1.0, 1.0, -0.5 - OFF), axis=1).argmin()]
    near = phone.frequencies[6:9]
    path, heard = solids.listened(hit, phone, back, "normal", "dropped_phone", near, SECONDS)
    print(f"modes at {', '.join(f'{each:.0f}' for each in near)} Hz; {path.name} holds "
          + ", ".join(f"{each:.0f}" for each in heard))  # fmt: skip
    times = np.array([0.5 * hit.contact_time, 2.0 * hit.contact_time, 4e-3])
    panels = [("as it falls", np.zeros_like(phone.nodes))]
    for time in times:
        q = hit.modal_state([time])[0][0]
        panels.append((f"after {1e3 * time:.2f} ms", phone.shapes @ q - speed * time * WAY))
    columns = {"time_s": times, "mode_Hz": near, "heard_Hz": heard}
    figure = solids.drawn(phone, panels, "A phone falls on its corner", (90.0, -45.0), None)
    source.publish("beyond_dropped_phone", figure, columns)


if __name__ == "__main__":
    main()
