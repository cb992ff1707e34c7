"""Tutorial: will my hammer test double-hit? Tries a hammer with three tips on a plate, for a given bandwidth.

python studies/tutorials/tutorial_hammer_test.py [FOLDER]
"""

import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import fem_impact as fi
from fem_impact.fe.assembly import System
from fem_impact.impact import accuracy
from fem_impact.show import plots
from fem_impact.sweeps import hammers

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

BANDWIDTH, DROP = 800.0, 10.0  # [Hz], and [dB] by which the force may fall within it
HAMMER = 0.1  # [kg]
TIPS = {"rubber": 3e5, "nylon": 3e6, "steel": 3e7}  # [N/m] linear, as data sheets state them
PLACES = {"middle": (0.3, 0.2), "corner": (0.02, 0.02)}  # [m]
SPEED = 0.5  # [m/s]
TOLERANCE = 1e-2  # [-] enough to count impacts and to read a bandwidth
DAMPING = 0.002  # [-]


@dataclass(frozen=True)
class Verdict:
    """The result of one tip at one place."""

    place: str
    tip: str
    n_impacts: int
    reach: float  # [Hz] bandwidth
    ratio: float  # [-] contact resonance over the threshold of the kinetic-energy criterion
    trusted: bool  # whether the blow met its tolerance

    @property
    def good(self) -> bool:
        """Whether the tip hits once and reaches the bandwidth."""
        return self.trusted and self.n_impacts == 1 and self.reach >= BANDWIDTH

    @property
    def said(self) -> str:
        """The verdict in words; a blow that missed its tolerance has none."""
        if not self.trusted:
            return "not resolved: tip too hard for the model"
        return "good" if self.good else f"hits {self.n_impacts} times" if self.n_impacts > 1 else "too soft"


def plate() -> System:
    """An aluminium plate with free edges, as if hung on soft cords."""
    aluminium = fi.Material(E=70e9, nu=0.33, rho=2700.0)
    return fi.assemble(fi.mesh.rectangle(0.6, 0.4), fi.Plate(aluminium, thickness=4e-3))


def structure(max_frequency: float = 8e3) -> fi.Modes:
    """The modes of the plate."""
    return fi.find_modes(plate(), max_frequency=max_frequency, damping_ratio=DAMPING)


def strike(body: fi.Modes | System, at: tuple[float, float], stiffness: float) -> fi.Response:
    """One blow; whether it met the tolerance is looked at where it is shown."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        tip = fi.Contact.linear(stiffness)
        return fi.strike(body, fi.Striker.rigid(HAMMER), tip, at=at, speed=SPEED, tolerance=TOLERANCE)


def judge(body: fi.Modes | System, modes: fi.Modes) -> list[Verdict]:
    """Strike every place with every tip; the threshold is found with modes."""
    found = []
    for place, at in PLACES.items():
        limit = fi.threshold_frequency(modes, at, HAMMER)
        for tip, stiffness in TIPS.items():
            hit = strike(body, at, stiffness)
            resonance = accuracy.contact_resonance(fi.Contact.linear(stiffness), HAMMER, SPEED)
            ratio = resonance / limit if limit else np.inf
            reach = hammers.bandwidth_of(hit, DROP)
            found.append(Verdict(place, tip, hit.n_impacts, reach, ratio, hit.tolerance_met))
    return found


def draw(body: fi.Modes | System) -> object:
    """Draw the force spectra of the tips at the middle, relative to zero frequency, of all blows that are resolved."""
    frequencies = np.linspace(1.0, 4.0 * BANDWIDTH, 400)
    curves = []
    for (tip, stiffness), paint in zip(TIPS.items(), (plots.BLUE, plots.GREEN, plots.VERMILION)):
        hit = strike(body, PLACES["middle"], stiffness)
        if not hit.tolerance_met:
            continue
        size = np.abs(hit.spectrum(frequencies))
        count = "one impact" if hit.n_impacts == 1 else f"{hit.n_impacts} impacts"
        curves.append(plots.Curve(frequencies, 20.0 * np.log10(size / size[0]), f"{tip}, {count}", paint))
    curves.append(plots.Curve(np.array([0.0, BANDWIDTH]), np.full(2, -DROP), "wanted", plots.GREY, "--"))
    frequency, level = plots.Axis("frequency", "Hz"), plots.Axis("force spectrum", "dB", limits=(-40.0, 6.0))
    return plots.curves(curves, x=frequency, y=level, title="Three tips on one hammer, struck at the middle")


def main(folder: Path, max_frequency: float = 8e3) -> list[Verdict]:
    """Say which tip to use and where to strike."""
    folder.mkdir(parents=True, exist_ok=True)
    modes = structure(max_frequency)
    print(f"A free plate of {modes.mass:.2f} kg, {modes.n_modes} modes up to {modes.frequencies[-1]:.0f} Hz; "
          f"a hammer of {1e3 * HAMMER:g} g; {BANDWIDTH:g} Hz required, {DROP:g} dB down at most.")  # fmt: skip
    verdicts = judge(plate(), modes)
    print(f"{'place':<8}{'tip':<8}{'impacts':>8}{'reaches':>10}{'of threshold':>14}   verdict")
    for one in verdicts:
        numbers = f"{one.n_impacts:8d}{one.reach:7.0f} Hz" if one.trusted else f"{'?':>8}{'?':>10}"
        print(f"{one.place:<8}{one.tip:<8}{numbers}{one.ratio:14.2f}   {one.said}")
    chosen = hammers.choose(modes, PLACES["middle"], BANDWIDTH, [0.01, HAMMER], drop=DROP)
    for hammer in chosen:
        end = (
            f"at least {hammer.limit:.2g} N/m, where the model ends,"
            if hammer.unlimited
            else f"{hammer.hardest:.3g} N/m"
        )
        advice = f"tips from {hammer.softest:.3g} N/m to {end} work" if hammer.works else "no tip works"
        print(f"In the middle, with a hammer of {1e3 * hammer.mass:g} g: {advice}.")
    print(shared.save(folder / "hammer_test.png", draw(plate())))
    return verdicts


if __name__ == "__main__":
    main(shared.folder())
