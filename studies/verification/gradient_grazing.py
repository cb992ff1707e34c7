"""Approaches the places where a blow has no gradient from both sides: right until it is refused, and never wrong.

    python studies/verification/gradient_grazing.py     prints a table, writes gradient_grazing.csv, draws a picture

Families of blows in one number, the target's mass. In the first a second impact begins, or is lost, at one value: the
bodies touch there without pressing, and the slope of the contact time grows as the inverse root of the distance. In
the second two impacts press equally hard at one value, and the slope of the largest force jumps. Both values are
found by bisection. At distances on either side each slope is compared with a central difference of fourth order, of
blows on that side alone.
"""

import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import gradient_claims as claims
import numpy as np

import fem_impact as fi
from fem_impact.show import plots
from fem_impact.show.figures import styled

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

TOLERANCES = 1e-10, 1e-9, 1e-8, 1e-7  # [-] of the blows: the first that can be met, which fall next to a graze
NUMBER = "target.mass"
DISTANCES = 10.0 ** np.arange(-1.0, -7.1, -0.5)  # [-] from the value, relative
PART = 0.05  # [-] of the distance, for differences: they err by 1e-5 of a slope that goes as its inverse root
LONGEST = 2e-4  # [-] step of a difference


@dataclass(frozen=True)
class Family:
    """Blows in one number, with a quantity that has no slope at one value."""

    title: str
    seed: int  # of the numbers, `gradient_claims.random_numbers`
    quantity: str
    between: tuple[float, float]  # [-] times the number drawn

    def strike(self, factor):
        """The blow with the number drawn times a factor."""
        numbers = claims.random_numbers(np.random.default_rng(self.seed))
        numbers |= {"contact.loss": 0.0, "contact.exponent": 1.5}
        numbers[NUMBER] *= factor
        for tolerance in TOLERANCES[:-1]:
            try:
                return claims.strike(numbers, tolerance)
            except fi.SimulationError:
                pass
        return claims.strike(numbers, TOLERANCES[-1])

    def side(self, hit):
        """What is different on both sides: how many impacts there are, and which of them is the hardest."""
        if self.quantity == "peak_force":
            return int(np.argmax([impact.peak_force for impact in hit.impacts]))
        return hit.n_impacts

    def value(self, precision=1e-9):
        """Where the side changes, by bisection to a relative precision."""
        low, high = self.between
        first = self.side(self.strike(low))
        while high - low > precision * high:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.side(self.strike(middle)) == first else (low, middle)
        return 0.5 * (low + high)


FAMILIES = (
    Family("a second impact begins", 3, "contact_time", (1.0, 30.0)),
    Family("two impacts press equally hard", 31, "peak_force", (0.725, 0.85)),
)


@dataclass(frozen=True)
class Look:
    """One blow: its slope relative to value over number, the difference, and why the slope is refused."""

    family: str
    distance: float  # [-] signed
    slope: float
    error: float  # stated
    difference: float
    why: str

    @property
    def off(self):
        """How far slope and difference are apart, relative to the latter; of slopes below 0.1 to 0.1."""
        return abs(self.slope - self.difference) / max(abs(self.difference), 0.1)


def look(family, value, distance):
    """Slope and difference at a signed distance from the value."""
    factor = value * (1.0 + distance)
    hit = family.strike(factor)
    step = min(LONGEST, PART * abs(distance))

    def at(k):
        other = family.strike(factor * (1.0 + k * step))
        return getattr(other, family.quantity) if family.side(other) == family.side(hit) else np.nan

    near, far = (at(k) - at(-k) for k in (1, 2))
    difference = (8.0 * near - far) / (12.0 * step) / getattr(hit, family.quantity)
    try:
        found = hit.gradient(family.quantity, NUMBER)
    except fi.SimulationError as error:
        return Look(family.title, distance, np.nan, np.nan, difference, str(error))
    scale = found.numbers[0] / found.value
    return Look(family.title, distance, found.slopes[0] * scale, found.error[0] * abs(scale), difference, "")


def examine(family, distances=DISTANCES):
    """Looks from both sides, far to near and near to far."""
    value = family.value()
    return [look(family, value, sign * d) for sign, row in ((-1, distances), (1, distances[::-1])) for d in row]


def draw(looks):
    """Slopes and differences over the distance, either side of each value."""
    with styled(6.4, 5.2) as figure:
        panels = figure.subplots(len(FAMILIES), 2, sharey="row")
        for family, row in zip(FAMILIES, panels):
            for sign, panel in zip((-1.0, 1.0), row):
                own = [each for each in looks if each.family == family.title and each.distance * sign > 0.0]
                x = np.array([abs(each.distance) for each in own])
                panel.plot(x, [each.difference for each in own], "o", color=plots.GREY, ms=6, mfc="none",
                           label="central difference")  # fmt: skip
                panel.plot(x, [each.slope for each in own], ".", color=plots.BLUE, label="gradient")
                refused = x[[bool(each.why) for each in own]]
                if len(refused):
                    panel.axvspan(0.5 * x.min(), refused.max() * 1.78, color=plots.ORANGE, alpha=0.25, lw=0,
                                  label="refused")  # fmt: skip
                panel.set(xscale="log", xlim=(0.5 * x.min(), 2.0 * x.max()))
                if family.quantity == "contact_time":
                    panel.set_yscale("symlog", linthresh=0.1)
                if sign < 0.0:
                    panel.invert_xaxis()
                    panel.set_ylabel(f"slope of {family.quantity.replace('_', ' ')} [-]")
                side = "below" if sign < 0.0 else "above"
                panel.set_title(f"{family.title}: {side}", fontsize=9)
        for panel in panels[-1]:
            panel.set_xlabel("distance in the target's mass (relative)")
        panels[0][0].legend(fontsize=8)
    return figure


def main():
    """Examine, print, write and draw."""
    warnings.simplefilter("ignore", fi.ToleranceWarning)  # of modes left out: here the plate has 20
    looks = [each for family in FAMILIES for each in examine(family)]
    for each in looks:
        what = f"slope {each.slope:+.6e}, off {each.off:.1e}" if not each.why else f"refused: {each.why[:70]}..."
        print(f"{each.family}, distance {each.distance:+.1e}: difference {each.difference:+.6e}, {what}")
    given = [each for each in looks if not each.why and np.isfinite(each.difference)]
    print(
        f"{len(given)} given, off by at most {max(each.off for each in given):.1e}; {len(looks) - len(given)} refused"
    )
    names = {"slope": "slope", "stated error": "error", "difference": "difference"}
    rows = [{"family": each.family, "distance": f"{each.distance:.3g}",
             **{name: f"{getattr(each, key):.9g}" for name, key in names.items()}, "refused": each.why}
            for each in looks]  # fmt: skip
    shared.write_rows(Path(__file__).with_suffix(".csv"), rows)
    shared.save(shared.PICTURES / "gradient_grazing.png", draw(looks))


if __name__ == "__main__":
    main()
