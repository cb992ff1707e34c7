"""From four measured taps to a double hit: what a hammer's file tells about the hammer, and what it does not.

    python studies/tutorials/tutorial_fit.py [folder]

Reads the taps in `measured/acceleration_multi.lvm`, compares models by how well they predict a tap from the other
three, among them one that gives every tap a stiffness of its own (a hand strikes no spot twice), shows which values the
taps tell, and asks which plate this hammer would hit twice. Writes fit_pulses.png, fit_profiles.png and
fit_double_hits.png.
"""

import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import resample

import fem_impact as fi
from fem_impact.pages import fit_page
from fem_impact.show import plots
from fem_impact.taps.found import Found
from fem_impact.taps.predictions import Prediction

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

MASS = 0.15  # [kg] of the hammer: nobody wrote it down, and the taps cannot tell it
MASSES = 0.05, 0.15, 0.45  # [kg] that explain the taps equally well
SPEED = 0.2  # [m/s] of the taps, for 0.15 kg
STIFFNESS = {"contact.stiffness": (1e2, 1e18)}
POWER = STIFFNESS | {"contact.exponent": (1.0, 4.0), "contact.loss": (0.0, 20.0)}
HEAD = {"striker.first_frequency": (1e3, 2e4), "striker.mode_ratio": (0.1, 100.0), "striker.damping": (0.01, 2.0)}
SPRINGY = POWER | {"contact.loss": (0.1, 1e3)} | HEAD
EACH = ("contact.stiffness",)
MODELS = {  # name -> law to begin with, unknowns, those with a value for each tap
    "linear spring": (fi.Contact.linear(1e6), STIFFNESS, ()),
    "Hertz": (fi.Contact.hertz(1e7), STIFFNESS, ()),
    "Hertz, a stiffness for each tap": (fi.Contact.hertz(1e7), STIFFNESS, EACH),
    "power law with loss": (fi.Contact.hertz(1e7), POWER, ()),
    "power law with loss, a stiffness for each tap": (fi.Contact.hertz(1e7), POWER, EACH),
    "power law with loss, a loss for each tap": (fi.Contact.hertz(1e7), POWER, ("contact.loss",)),
    "power law behind a springy tip": (fi.Contact.hertz(1e7), SPRINGY, ()),
    "power law behind a springy tip, a stiffness for each tap": (fi.Contact.hertz(1e7), SPRINGY, EACH),
}
BEST = "power law with loss, a stiffness for each tap"
PLATE = {"length": 0.4, "width": 0.3, "mass": 1.62, "first_frequency": 190.0}  # 5 mm of aluminium, hinged
AT = (0.2, 0.15)  # m, its middle
HEADS = np.geomspace(0.02, 1.0, 25)  # [kg] of other hammers
FINE = 16  # [-] points per sample of the interpolation of a pulse
QUIET = 12  # [samples] before the onset that are not taken for noise: the filter rings there
TIPS = np.geomspace(1e-3, 10.0, 33)  # [-] stiffness of other tips over the one found


@dataclass(frozen=True)
class Verdict:
    """One model of the four taps."""

    name: str
    error: float  # [-] rms of all taps over their force
    left_out: float  # [-] worst tap predicted from the others, over the rms of its force
    of_peak: float  # [-] the same over its peak
    fall: float  # [-] worst fall of a pulse, predicted from the other taps and its own rise, over the rms of its force
    found: Found

    def bic(self, freedom: int) -> float:
        """Bayesian information criterion [-] with so many independent samples, besides those for the values found."""
        count = self.found.problem.n_values
        return (freedom + count) * float(np.log(self.found.best.cost)) + count * float(np.log(freedom + count))


def read() -> fi.Taps:
    """The four taps, force only."""
    return fi.read_taps(shared.STUDIES / "measured" / "acceleration_multi.lvm", response=())


def fitted(name: str, taps: fi.Taps, extra: dict | None = None, profiles: bool = False):
    """One model of the taps."""
    law, unknown, per_tap = MODELS[name]
    return fi.fit(
        taps, striker=fi.Striker.rigid(MASS), contact=law, unknown=unknown | (extra or {}), per_tap=per_tap,
        profiles=profiles, robust=False,
        starts=8 if HEAD.items() <= unknown.items() else 4,
    )  # fmt: skip


def compare(taps: fi.Taps) -> list[Verdict]:
    """All models, by the tap that each predicts worst."""
    found = []
    for name in MODELS:
        made = fitted(name, taps)
        left_out = made.left_out()
        found.append(
            Verdict(
                name, made.error, max(one.error for one in left_out), max(one.error_of_peak for one in left_out),
                max(fall(one) for one in made.left_out(rise_only=True)), made,
            )
        )  # fmt: skip
    return found


def fall(one: Prediction) -> float:
    """Error after the largest force, over the rms of the force there [-]."""
    after = slice(int(one.measured.argmax()) + 1, None)
    return float(np.linalg.norm(one.residual[after]) / np.linalg.norm(one.measured[after]))


def width(tap: np.ndarray, rate: float) -> float:
    """Time [s] for which a tap (n_times,) exceeds half its peak, of its band-limited interpolation."""
    fine = resample(tap, FINE * len(tap))
    return float(np.count_nonzero(fine > 0.5 * fine.max()) / (FINE * rate))


def leftover(found, taps: fi.Taps) -> list[str]:
    """What is left of every tap predicted from the others: where in the pulse, at which frequencies, above what noise;
    and how much two taps of nearly the same peak differ, whatever the law."""
    lines = []
    for i, one in enumerate(found.left_out()):
        square, peak = one.residual**2, int(one.measured.argmax())
        inside = one.measured > 0.05 * one.measured[peak]
        places = np.arange(len(square))
        shares = [float(square[part].sum() / square.sum()) for part in
                  (inside & (places <= peak), inside & (places > peak), ~inside)]  # fmt: skip
        power = np.cumsum(np.abs(np.fft.rfft(one.residual)) ** 2)
        frequency = np.fft.rfftfreq(len(square), 1.0 / taps.rate)
        middle, high = (frequency[np.searchsorted(power, part * power[-1])] for part in (0.5, 0.9))
        whole, begin = taps.force[i], int(taps.onset[i] * taps.rate) - QUIET
        noise = float(np.std(whole[:begin])) / float(np.linalg.norm(one.measured)) * np.sqrt(len(square))
        lines.append(
            f"  {taps.labels[i]}: {100 * one.error:.2g} % of the rms force; of its square {100 * shares[0]:.0f} % "
            f"while the force rises, {100 * shares[1]:.0f} % while it falls, {100 * shares[2]:.0f} % outside; "
            f"half below {middle:.0f} Hz, 90 % below {high:.0f} Hz; before the trigger {100 * noise:.1g} % of noise; "
            f"peak {one.measured[peak]:.0f} N, {1e6 * width(one.measured, taps.rate):.0f} us above half of it"
        )
    first, second = (
        found.left_out()[i].measured for i in np.argsort([-one.measured.max() for one in found.left_out()])[:2]
    )
    one, two = (np.roll(fine, FINE * len(first) // 2 - int(fine.argmax())) for fine in
                (resample(first, FINE * len(first)), resample(second, FINE * len(second))))  # fmt: skip
    best = min(
        np.linalg.norm(one - (one @ moved) / (moved @ moved) * moved) / np.linalg.norm(one)
        for moved in (np.roll(two, shift) for shift in range(-FINE, FINE + 1))
    )
    lines.append(
        f"  The two hardest taps, moved and scaled onto each other without any law, differ by {100 * best:.1f} % rms."
    )
    return lines


def plate() -> fi.Modes:
    return fi.analytic.rectangle(**PLATE, n_modes=60, damping_ratio=0.01)


def impacts(modes: fi.Modes, law: fi.Contact, mass: float, tip: float) -> int:
    """How often a hammer of another mass, with another tip, hits the plate."""
    changed = fi.Contact.power(law.stiffness * tip, law.exponent, loss=law.loss)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        return fi.strike(
            modes, fi.Striker.rigid(mass), changed, at=AT, speed=SPEED, tolerance=1e-2, max_impacts=3, duration=0.1
        ).n_impacts


def softest(modes: fi.Modes, law: fi.Contact, mass: float) -> float | None:
    """Stiffness, over the tip found, from which on a hammer of this mass hits twice; None if no tip tried does."""
    counts = np.array([impacts(modes, law, mass, float(tip)) for tip in TIPS])
    twice = np.flatnonzero(counts > 1)
    return float(TIPS[twice[0]]) if twice.size else None


def draw_double_hits(path: Path, limits: dict[float, list[float | None]]) -> None:
    """The softest tip with which each hammer hits twice, for three laws that explain the taps equally well."""
    colours = dict(zip(limits, (plots.BLUE, plots.VERMILION, plots.GREEN)))
    curves = [
        plots.Curve(HEADS, np.array([np.nan if x is None else x for x in row]), f"if the hammer weighs {mass:g} kg",
                    colours[mass])
        for mass, row in limits.items()
    ]  # fmt: skip
    figure = plots.curves(
        curves, x=plots.Axis("mass of the head [kg]", log=True),
        y=plots.Axis("stiffness over that of the tip found", log=True, limits=(float(TIPS[0]), float(TIPS[-1]))),
        title="The softest tip with which a hammer hits the plate twice",
    )  # fmt: skip
    shared.save(path, figure)


def main(folder: Path) -> dict:
    folder.mkdir(parents=True, exist_ok=True)
    taps = read()
    print(taps.summary())
    print("\nModels, each tap predicted from the other three (worst tap):")
    verdicts = compare(taps)
    freedom = min(one.found.freedom for one in verdicts)
    lowest = min(one.bic(freedom) for one in verdicts)
    for one in verdicts:
        print(
            f"  {one.name}: {one.found.problem.n_values} values, fitted to {100 * one.error:.2g} %, left out "
            f"{100 * one.left_out:.2g} % of the rms force, {100 * one.of_peak:.2g} % of the peak; its fall, from its "
            f"rise, {100 * one.fall:.2g} %; information criterion {one.bic(freedom) - lowest:.0f} above the lowest"
        )
    by_name = {one.name: one.found for one in verdicts}
    print("\nWhat the taps tell, and what not (a stiffness for each tap, the mass of the hammer unknown too):")
    free = fitted(BEST, taps, {"striker.mass": (0.02, 1.0)}, profiles=True)
    print(free.summary())
    best = by_name[BEST]
    for name in ("power law behind a springy tip", BEST):
        print(f"\nWhat is left of each tap predicted from the other three, by the {name}:")
        print("\n".join(leftover(by_name[name], taps)))
    shared.save(folder / "fit_pulses.png", fit_page.pulses(best))
    shared.save(folder / "fit_profiles.png", fit_page.profiles(free))

    print(f"\nA hinged plate of {PLATE['mass']:g} kg, struck in its middle at {SPEED:g} m/s:")
    modes, limits = plate(), {}
    for mass in MASSES:
        made = fi.fit(
            taps, striker=fi.Striker.rigid(mass), contact=fi.Contact.hertz(1e7), unknown=POWER, per_tap=EACH,
            profiles=False, starts=3,
        )  # fmt: skip
        limits[mass] = [softest(modes, made.contact, float(head)) for head in HEADS]
        own = softest(modes, made.contact, mass)
        verdict = (
            "hits once with every tip tried" if own is None
            else f"hits twice, unless its tip is softer than {own:.2g} times the one found" if own <= 1.0
            else f"hits once; a tip {own:.2g} times as stiff would hit twice"
        )  # fmt: skip
        heavy = [head for head, tip in zip(HEADS, limits[mass]) if tip is not None and tip <= 1.0]
        above = f"; with this tip, heads from {min(heavy):.2g} kg on hit twice" if heavy else ""
        print(f"  if the hammer weighs {mass:g} kg, it {verdict}{above}")
    draw_double_hits(folder / "fit_double_hits.png", limits)
    print("Weigh the hammer: the taps alone cannot tell which of these lines is yours.")
    return {"verdicts": verdicts, "free": free, "limits": limits}


if __name__ == "__main__":
    main(shared.folder(shared.PICTURES))
