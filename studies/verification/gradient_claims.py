"""Checks gradients of random blows against central differences, and the error that each states against the true one.

    python studies/verification/gradient_claims.py [--scenes 500]     writes gradient_claims.csv, draws a picture

Sticks that bend strike damped plates through power laws with and without loss, once to three times. All 13 numbers of
a blow change together, along a random direction; slopes are told relative to the sum of what each number contributes.
Differences are of fourth order, of blows told to 1e-10. They are in doubt by as much as differences of one and of two
steps disagree, and by what telling the same blow to 2e-10 or 4e-10 changes, as each blow has steps of its own. A slope
counts as right if it is within 1e-6 and that doubt; those judged by differences sharper than 1e-6 count apart. The same
blow told to 1e-4 gives slopes with larger errors, which are compared with what they state. Blows whose gradient is
refused, as next to a grazing contact, are listed with the reason.
"""

import sys
import warnings
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import fem_impact as fi
from fem_impact.impact import engine, force_spectrum, gradient
from fem_impact.show import plots
from fem_impact.show.figures import styled

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

TIGHT, USUAL = 1e-10, 1e-4  # [-] tolerances of the blows whose differences are taken, and of usual ones
STEP = 2e-4  # [-] relative change
BAND = 2000.0  # [Hz] of the centroid
QUANTITIES = ("restitution", "impulse", "contact_time", "peak_force", "peak_time", f"spectral_centroid={BAND:g}")
RIGHT = 1e-6  # [-] accuracy claimed
UNTOLD = "no differences, as a blow with a changed number is not told to 1e-10"


def random_numbers(rng):
    """Numbers of a random blow on a plate; its stick bends or not, its law has loss or not."""
    exponent = rng.choice([1.0, 1.5, float(rng.uniform(1.2, 3.0))])
    mass, speed = 10.0 ** rng.uniform(-2, -0.5), 10.0 ** rng.uniform(-0.5, 0.5)
    duration = 10.0 ** rng.uniform(-3.5, -2.3)
    stiffness = mass / 3.0 * (np.pi / duration) ** 2 * (speed * duration / np.pi) ** (1.0 - exponent)
    return {
        "target.mass": mass * 10.0 ** rng.uniform(-0.3, 1.5), "target.first_frequency": 10.0 ** rng.uniform(1.3, 2.3),
        "target.damping_ratio": float(rng.choice([0.0, 0.01, 0.2])), "striker.mass": mass,
        "striker.first_frequency": 10.0 ** rng.uniform(2.8, 4), "striker.damping_ratio": 0.02,
        "contact.stiffness": stiffness, "contact.exponent": exponent,
        "contact.loss": float(rng.choice([0.0, 0.3 / speed])), "contact.gap": 0.02 * speed * duration,
        "strike.x": rng.uniform(0.3, 1.2), "strike.y": rng.uniform(0.2, 0.8), "strike.speed": speed,
    }  # fmt: skip


def strike(numbers, tolerance=TIGHT, n_modes=20):
    """The blow that numbers make."""
    plate = fi.analytic.rectangle(
        1.55, 1.0, mass=numbers["target.mass"], first_frequency=numbers["target.first_frequency"], n_modes=n_modes,
        damping_ratio=numbers["target.damping_ratio"],
    )  # fmt: skip
    stick = fi.Striker.stick(numbers["striker.mass"], numbers["striker.first_frequency"], n_modes=2)
    stick = fi.Striker.flexible(stick.modes.damped(numbers["striker.damping_ratio"]), at=stick.at)
    law = fi.Contact.power(
        numbers["contact.stiffness"], numbers["contact.exponent"], loss=numbers["contact.loss"],
        gap=numbers["contact.gap"],
    )  # fmt: skip
    at = (numbers["strike.x"], numbers["strike.y"])
    return fi.strike(plate, stick, law, at=at, speed=numbers["strike.speed"], tolerance=tolerance, max_impacts=4)


def told(hit, frequencies):
    """The quantities as numbers, the centroid from its spectrum at the same frequencies whatever the blow.

    The largest force and its time are those of finer steps.
    """
    centroid = force_spectrum.centroid(frequencies, hit.spectrum(frequencies))
    when, force = gradient.peak_of_force(engine.follow_again(hit.history, gradient.step_of(hit) / 4.0))
    return np.array([hit.restitution, hit.impulse, hit.contact_time, force, when, centroid])


@dataclass(frozen=True)
class Case:
    """One blow: slopes by gradient and by differences, all over their scale, and the errors stated."""

    seed: int
    n_impacts: int
    lossy: bool
    why: str  # why there is no gradient; "" if there is one
    slopes: np.ndarray  # (6,) of the blow told to TIGHT
    differences: np.ndarray  # (6,)
    doubt: np.ndarray  # (6,) of the differences
    usual: np.ndarray  # (6,) of the blow told to USUAL
    stated: np.ndarray  # (6,) their stated errors

    @property
    def off(self):
        """How far slopes and differences are apart."""
        return np.abs(self.slopes - self.differences)


def touched(hit):
    """Number of impacts at each contact."""
    return np.bincount([impact.contact for impact in hit.impacts], minlength=len(hit.contacts)).tolist()


def examine(seed, random_numbers=random_numbers, strike=strike, most=3):
    """One random blow; None if it misses a contact, hits more than ``most`` times, or cannot be told to 1e-10."""
    rng = np.random.default_rng(seed)
    numbers, none = random_numbers(rng), np.full(6, np.nan)
    try:
        hit = strike(numbers)
    except fi.SimulationError:
        return None
    if not all(touched(hit)) or hit.n_impacts > most:
        return None
    lossy = any(value > 0.0 for name, value in numbers.items() if name.endswith(".loss"))
    try:
        found = hit.gradient(QUANTITIES)
    except fi.SimulationError as error:
        why = str(error).removeprefix("no gradient ").partition(",")[0].partition(":")[0]
        return Case(seed, hit.n_impacts, lossy, why, none, none, none, none, none)
    names = found["impulse"].names
    turn = dict(zip(names, rng.uniform(-1.0, 1.0, len(names))))
    along = np.array([numbers[name] * turn[name] for name in names])
    frequencies = hit.band_spectrum(BAND)[0]

    def value(step):
        changed = {name: numbers[name] * (1.0 + step * part) for name, part in turn.items()}
        other = strike(numbers | changed)
        if touched(other) != touched(hit):
            raise fi.SimulationError("another count within the step")
        return told(other, frequencies)

    parts = np.array([each.slopes * along for each in found.values()])
    scale = np.abs(parts).sum(axis=1)
    try:
        near, far = (value(size) - value(-size) for size in (STEP, 2.0 * STEP))
        again = [told(strike(numbers, loosely * TIGHT), frequencies) for loosely in (2.0, 4.0)]
    except fi.SimulationError as error:
        why = "another count within the step" if "another count" in str(error) else UNTOLD
        return Case(seed, hit.n_impacts, lossy, why, none, none, none, none, none)
    near, far = near / (2.0 * STEP * scale), far / (4.0 * STEP * scale)
    doubt = np.abs(near - far) + np.abs(np.array(again) - told(hit, frequencies)).max(axis=0) / (STEP * scale)
    usual, stated = none, none
    try:
        rough = strike(numbers, USUAL).gradient(QUANTITIES, names)
        usual = np.array([each.slopes @ along for each in rough.values()]) / scale
        stated = np.array([each.error @ np.abs(along) for each in rough.values()]) / scale
    except fi.SimulationError:
        pass  # told so roughly, the counts of its runs differ, or it grazes
    return Case(
        seed, hit.n_impacts, lossy, "", parts.sum(axis=1) / scale, (4.0 * near - far) / 3.0, doubt, usual,
        stated,
    )  # fmt: skip


def summary(cases):
    """What became of the claims, in lines."""
    judged = [case for case in cases if not case.why]
    most = max(case.n_impacts for case in cases)
    lines = [f"{len(cases)} blows of one to {most} impacts, {len(judged)} with gradient and differences"]
    lines += [f"  {count} without: {why}" for why, count in Counter(c.why for c in cases if c.why).most_common()]
    for i, name in enumerate(QUANTITIES):
        off, doubt = np.array([case.off[i] for case in judged]), np.array([case.doubt[i] for case in judged])
        true = np.array([abs(case.usual[i] - case.slopes[i]) for case in judged])
        stated = np.array([case.stated[i] for case in judged])
        known = np.isfinite(true) & (true > 1e-9)
        ratio = stated[known] / true[known]
        sharp = doubt < RIGHT
        lines.append(
            f"{name}: median off {np.median(off):.1e}, within 1e-6 and the doubt {np.mean(off <= RIGHT + doubt):.1%}, "
            f"or three times the doubt {np.mean(off <= RIGHT + 3.0 * doubt):.1%}, "
            f"worst beyond the doubt {np.max(off - doubt):.1e}; of {sharp.sum()} judged more sharply than 1e-6, "
            f"{np.mean(off[sharp] <= RIGHT):.1%} within 1e-6; stated error at least a third of the true one "
            f"{np.mean(ratio > 1 / 3):.1%} of {known.sum()}"
        )
    return lines


def draw(cases):
    """Distances from differences, and stated over true errors."""
    judged = [case for case in cases if not case.why]
    colours = (plots.BLUE, plots.SKY, plots.GREEN, plots.VERMILION, plots.ORANGE, plots.PURPLE)
    with styled(6.4, 6.4) as figure:
        off, errors = figure.subplots(2)
        for i, (name, colour) in enumerate(zip(QUANTITIES, colours)):
            beyond = np.sort([max(case.off[i], 1e-12) for case in judged])
            off.plot(beyond, np.arange(1, len(beyond) + 1) / len(beyond), color=colour,
                     label=name.partition("=")[0].replace("_", " "))  # fmt: skip
            true = np.array([abs(case.usual[i] - case.slopes[i]) for case in judged])
            stated = np.array([case.stated[i] for case in judged])
            errors.plot(np.maximum(true, 1e-10), np.maximum(stated, 1e-10), ".", ms=3, color=colour)
        off.axvline(RIGHT, color=plots.GREY, ls="--", lw=0.8)
        off.set(xscale="log", xlabel="slope by gradient minus by differences (relative)", ylabel="share of blows",
                xlim=(1e-12, 1e-2))  # fmt: skip
        off.set_title(f"Gradients of {len(judged)} random blows")
        off.legend(loc="lower right", fontsize=8)
        errors.plot([1e-10, 1.0], [1e-10, 1.0], color=plots.GREY, lw=0.8)
        errors.set(xscale="log", yscale="log", xlabel="true error of slopes, of blows told to 1e-4 (relative)",
                   ylabel="stated error", xlim=(1e-10, 1.0), ylim=(1e-10, 1.0))  # fmt: skip
    return figure


def publish(cases, name):
    """Write all cases, print the summary and draw."""
    parts, rows = ("slope", "difference", "doubt", "usual", "stated"), []
    for case in cases:
        columns = np.stack([case.slopes, case.differences, case.doubt, case.usual, case.stated], axis=1)
        names = [f"{q} {part}" for q in QUANTITIES for part in parts]
        row = {"seed": case.seed, "impacts": case.n_impacts, "lossy": int(case.lossy), "refused": case.why}
        rows.append(row | {name: f"{x:.9g}" for name, x in zip(names, columns.ravel())})
    shared.write_rows(Path(__file__).with_name(f"{name}.csv"), rows)
    print("\n".join(summary(cases)))
    shared.save(shared.PICTURES / f"{name}.png", draw(cases))


def main(about, one, scenes, name):
    """Examine with ``one`` that many random blows, as many as asked for; print, write and draw."""
    parser = shared.parser(about)
    parser.add_argument("--scenes", type=int, default=scenes)
    warnings.simplefilter("ignore", fi.ToleranceWarning)  # of modes left out: here the plate has 20
    wanted, cases, seed = parser.parse_args().scenes, [], 0
    while len(cases) < wanted:
        found = one(seed)
        cases += [] if found is None else [found]
        seed += 1
    publish(cases, name)


if __name__ == "__main__":
    main(__doc__, examine, 500, "gradient_claims")
