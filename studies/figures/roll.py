"""A stiffer hand buzzes faster on drumhead and table, a damped one stops sooner; a cymbal's waves rule its own buzz.

A stick pressed into a body comes back after each bounce, because the hand's spring and force send it back. Without
losses and with a body that hardly yields, a bounce of speed v takes ``2/w arctan(v w m / F)`` with ``w**2 = k / m``:
stiffness or force make the buzz fast. Each bounce is shorter than the one before by what body, tip and damper take.

python studies/figures/roll.py [FOLDER]   writes roll.png, roll.csv and a WAV file for each body, and prints the table
"""

import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact.show import plots

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

# A stick of 50 g (typical of a 5A) with a rubber tip, which loses a fifth of the speed of a slow blow on a hard wall.
STICK, BENDING = 0.05, 400.0  # [kg], [Hz] mass and first bending frequency
TIP = fi.Contact.restituting(3e6, 1.5, restitution=0.8, speed=0.5)  # [N/m^1.5]
SPEED, FORCE = 1.0, 1.5  # [m/s] of the tip as the buzz begins, [N] of the hand at the tip
LASTS = 0.3  # [s] of each buzz
STIFFNESSES = np.geomspace(10.0, 1000.0, 7)  # [N/m] of the hand at the tip
DAMPINGS = {"loose": 0.02, "firm": 1.0}  # [N s/m] of the hand at the tip
APART = 4e-3  # [s] impacts closer than this belong to one bounce
REST = 20e-3  # [s] the stick rests once it is in contact for this long
STEP = 2e-5  # [s] in contact: a bounce's own numbers to 1 %, while single later bounces are chaotic
STYLES = {"loose": (plots.BLUE, "-"), "firm": (plots.VERMILION, "--")}


def bodies(highest=2e3):
    """The struck bodies by name: their modes up to a frequency [Hz], and where they are struck and heard [m].

    A head of 14 inches of Mylar, 0.25 mm, at 3 kN/m; a flat bronze plate of 16 inches on its washer; an oak table top
    on four feet. Sizes, tension and damping are typical values.
    """
    mylar = fi.Plate(fi.Material(E=3.5e9, nu=0.3, rho=1390.0), thickness=0.25e-3, tension=3e3)
    head = fi.assemble(fi.mesh.disk(0.178), mylar, {"boundary": "hinged"})
    bronze = fi.Plate(fi.Material(E=110e9, nu=0.34, rho=8700.0), thickness=1e-3)
    cymbal = fi.assemble(fi.mesh.disk(0.203, hole=0.006), bronze, {"outer": "free", "inner": "hinged"})
    oak = fi.Plate(fi.Material(E=5e9, nu=0.3, rho=700.0), thickness=0.025)  # as stiff as along and across on average
    feet = [((x, y), "hinged") for x in (0.1, 1.1) for y in (0.1, 0.6)]
    table = fi.assemble(fi.mesh.rectangle(1.2, 0.7), oak, {}, point_supports=feet)
    return {
        "drumhead": (fi.find_modes(head, max_frequency=highest, damping_ratio=0.02), (0.05, 0.03)),
        "cymbal": (fi.find_modes(cymbal, max_frequency=highest, damping_ratio=0.001), (0.12, 0.05)),
        "table": (fi.find_modes(table, max_frequency=highest, damping_ratio=0.02), (0.5, 0.4)),
    }


@dataclass(frozen=True)
class Buzz:
    """What one hand does on one body."""

    hit: fi.Response
    bounces: np.ndarray  # (n_bounces,) [s] when each begins, until the stick rests

    @property
    def rate(self) -> float:
        """Bounces per second, from the first to the last; 0 if there is only one."""
        span = self.bounces[-1] - self.bounces[0]
        return (len(self.bounces) - 1) / span if span else 0.0


def buzz(modes, at, stiffness, damping, lasts=LASTS):
    """A buzz of the held stick on a body."""
    stick = fi.Striker.stick(STICK, BENDING, n_modes=3).held(fi.Hand(stiffness, damping, FORCE))
    rule = {"quantity": "n_impacts", "scheme": "A4", "dt": STEP, "tolerance": 1.0}
    with warnings.catch_warnings():  # later bounces are chaotic: only their rate and number are read, see `main`
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        hit = fi.strike(modes, stick, TIP, at=at, speed=SPEED, duration=lasts, **rule)
    begins, until = [], -np.inf
    for impact in hit.impacts:
        if impact.start > until + APART:
            begins.append(impact.start)
        until = impact.end
        if impact.duration > REST:
            break
    return Buzz(hit, np.array(begins))


def alone(stiffness):
    """Rate [Hz] of the first bounces on a body that gives back all speed."""
    omega = np.sqrt(stiffness / (STICK / 3.0))
    return 0.5 * omega / np.arctan(SPEED * omega * (STICK / 3.0) / FORCE)


def compute(struck, stiffnesses=STIFFNESSES, lasts=LASTS):
    """Every body with every hand: (name, damping's name) -> list of Buzz over stiffness."""
    found = {}
    for name, (modes, at) in struck.items():
        for grip, damping in DAMPINGS.items():
            found[name, grip] = [buzz(modes, at, k, damping, lasts) for k in stiffnesses]
    return found


def draw(found):
    """Draw the rate of the bounces over the stiffness of the hand, a panel for each body."""
    drawn, columns = [], {"stiffness [N/m]": STIFFNESSES, "lossless [Hz]": alone(STIFFNESSES)}
    for (name, grip), row in found.items():
        rates, counts = np.array([each.rate for each in row]), np.array([len(each.bounces) for each in row])
        drawn.append(plots.Curve(STIFFNESSES, rates, f"{grip} hand", *STYLES[grip], panel=name))
        columns |= {f"{name}, {grip} [Hz]": rates, f"{name}, {grip} [-]": counts}
    drawn += [
        plots.Curve(STIFFNESSES, alone(STIFFNESSES), "first bounce, nothing lost", plots.GREY, ":", panel=name)
        for name in dict.fromkeys(name for name, _ in found)
    ]
    figure = plots.curves(
        drawn,
        x=plots.Axis("stiffness of the hand at the tip", "N/m", log=True),
        y=plots.Axis("bounces", "Hz", limits=(0.0, 130.0)),
        title="Buzz of a stick of 50 g, pressed with 1.5 N",
    )
    return figure, columns


def main() -> None:
    """Write picture, table and sounds; print the rates."""
    folder = shared.folder()
    struck = bodies()
    found = compute(struck)
    for (name, grip), row in found.items():
        told = ", ".join(f"{each.rate:.0f} Hz ({len(each.bounces)})" for each in row)
        sure = sum(each.hit.tolerance_met for each in row)
        print(f"{name}, {grip}: {told}; the number of impacts is certain in {sure} of {len(row)}")
    source.publish("roll", *draw(found))
    for name, (_, at) in struck.items():
        each = found[name, "loose"][3]
        written = fi.export.write_wav(folder / f"roll_{name}.wav", each.hit, at=at, duration=1.5)
        print(f"roll_{name}.wav: {written.stated}")


if __name__ == "__main__":
    main()
