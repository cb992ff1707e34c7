"""Numbers that the pages quote, found again: constants of the package, and what small computations give.

The build puts them below their section of the theory, and ends where one differs. The other numbers quoted there are
asserted by the tests that each section names.
"""

import re
from collections.abc import Callable
from fractions import Fraction
from importlib import import_module
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from shared import STUDIES

import fem_impact as fi
from fem_impact.fe import corners

PAGE = STUDIES / "theory.md"
NUMBER = r"(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?:/\d+)?)"
PLATE = (1.0, 0.3, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0, 0.35)  # bending stiffness, isotropic with nu = 0.3
FAST = 1e6  # [-] speed over that of first yield: the power of the speed is then alone to 1e-3


def hinged(degrees: float) -> float:
    """Exponent of a corner between hinged edges."""
    return corners.exponent(np.radians(degrees), ("hinged", "hinged"), PLATE)


def yields() -> float:
    """Restitution of a fast mass on a wall times the fourth root of its speed over that of first yield."""
    law = fi.Contact.elastic_plastic(1e9, yield_speed=1.0, mass=1.0)
    hit = fi.strike(fi.Modes.rigid(1e12), fi.Striker.rigid(1.0), law, at=None, speed=FAST, tolerance=1e-3)
    return hit.restitution * FAST**0.25


def steep() -> float:
    """Slope of the force far beyond first yield, over that at first yield."""
    law, near = fi.Contact.elastic_plastic(1.0, yield_approach=1.0), 1.0 - 1e-6
    far, first = (np.diff(law.force([x, x + 1e-7 * x]))[0] / (1e-7 * x) for x in (1e4, near))
    return far / first


def tail(power: float) -> float:
    """Squared frequency, over that of the last mode, of one mode for a tail whose squared shapes fall as a power."""
    sums = [quad(lambda w, n=n: w ** (power - n), 1.0, np.inf)[0] for n in (2, 4)]
    return sums[0] / sums[1]


def stays(exponent: float) -> float:
    """Contact time of ten times the speed over that of the speed."""
    law = fi.Contact.power(1e7, exponent)
    times = [fi.strike(fi.Modes.rigid(1e9), fi.Striker.rigid(0.1), law, at=None, speed=v).contact_time for v in (1, 10)]
    return times[1] / times[0]


class Quote(NamedTuple):
    """A phrase of a section, each number a #, and where each number comes from: a constant by its name, or a value."""

    section: int
    phrase: str
    sources: tuple[str | tuple[str, Callable[[], float]], ...]


def quote(section, phrase, *sources):
    """A quote, its sources one after another."""
    return Quote(section, phrase, sources)


QUOTES = (
    quote(2, "elements of degree #", "fe.beam_elements.DEGREE"),
    quote(
        2, "# bubbles", ("degree + 1 unknowns, less four at the ends", lambda: constant("fe.beam_elements.DEGREE") - 3)
    ),
    quote(2, "polynomial of degree # follows", "fe.beam_elements.SMOOTH"),
    quote(5, "taken apart by #,", "fe.corners.APART"),
    quote(5, "$z = #$ at 120 degrees", ("exponent of the corner", lambda: hinged(120.0))),
    quote(5, "$#$ at 270", ("exponent of the corner", lambda: hinged(270.0))),
    quote(5, r"$z \ge #$ (# between free edges)", "fe.corners.MILD", "fe.corners.MILD_FREE"),
    quote(5, "falls below #, but stop at # of the extent", "fe.corners.CORNER_ERROR", "fe.corners.SMALLEST"),
    quote(5, "(# at free corners)", "fe.corners.SMALLEST_FREE"),
    quote(6, "relative residual of #;", "fe.eigenvalues.RESIDUAL"),
    quote(7, "The constant # is calibrated", "fe.residual.CALIBRATION"),
    quote(7, "where that exceeds #.", "fe.corners.SAY"),
    quote(
        7,
        "orders #, # and #.",
        *((f"fe.refinement.ORDERS[{i}]", lambda i=i: constant("fe.refinement.ORDERS")[i]) for i in range(3)),
    ),
    quote(7, "c = #,", "fe.refinement.MORLEY"),
    quote(8, "until no side exceeds # of its distance", "fe.splitting.GROWTH"),
    quote(8, "That size is $2^{#}$", ("log2 of fe.splitting.DEPTH", lambda: np.log2(constant("fe.splitting.DEPTH")))),
    quote(
        8, r"$\sqrt{#} \omega_N$ on plates", ("both sums of the tail, squared shapes as omega**0", lambda: tail(0.0))
    ),
    quote(8, r"$\sqrt{#} \omega_N$ on beams", ("both sums of the tail, as omega**-1/2", lambda: tail(-0.5))),
    quote(10, r"$\ell = # y$ is chosen", "impact.compiled.laws.plastic.REACH"),
    quote(10, r"2 \cdot # / 1.6", "fe.material.TABOR"),
    quote(10, "/ 1.6 = #$", ("slope of the law far beyond first yield", steep)),
    quote(10, "ends at $# (v / v_y)^{-1/4}$", ("a blow at a million times v_y", yields)),
    quote(12, "settles within # rounds", "impact.compiled.rounding.ITERATIONS"),
    quote(12, "matches the change of stored energy to #", "impact.compiled.schemes.WORK_ERROR"),
    quote(13, "until the approach is below # of its size", "impact.compiled.events.LOCATED"),
    quote(13, "After # events", "impact.compiled.events.EVENT_LIMIT"),
    quote(13, "an approach below # of the deepest", "impact.history.TOUCH"),
    quote(13, "a push that stays below # both of the largest force", "impact.history.FAINT"),
    quote(14, "for at most # looks", "impact.compiled.flight.LASTING"),
    quote(17, "2 x_n, # x_n^2", "model.idealisation.PULSE"),
    quote(
        17, r"refused where $z \gt #$, where $\chi \lt #$", "model.idealisation.HEAVIEST", "model.idealisation.NEAREST"
    ),
    quote(18, "Up to # tolerances of it are allowed", "model.vectors.DIP"),
    quote(18, "by up to # instead of #", "fe.splitting.STEEPEST", "fe.splitting.GROWTH"),
    quote(21, r"disk of $#\, h$", "fe.thick.PATCH"),
    quote(21, "up to #) that matter most when the # lowest", "fe.membrane.MOST", "fe.membrane.SWINGING"),
    quote(21, "known and at most #, or the tolerance", "impact.assumption.ENOUGH"),
    quote(26, "less than # of the thickness (kink", "fe.shallow.KINK"),
)
CHOOSING = tuple(
    quote(0, phrase, *(("two blows on a wall", lambda a=a: stays(a)) for a in exponents))
    for phrase, exponents in (
        ("after Hertz | # times", (1.5,)),
        ("soft rubber | # to # times", (2.0, 2.5)),
        ("measured | # to # times", (2.1, 5.0)),
    )
)


def constant(path):
    """A constant of the package by its name from there."""
    module, _, name = path.rpartition(".")
    return getattr(import_module(f"fem_impact.{module}"), name)


def found(source):
    """Where a number comes from, and what it is there."""
    name, value = (source, constant(source)) if isinstance(source, str) else (source[0], source[1]())
    return name, float(value)


def read(text, quoted):
    """The numbers of a quote as a page writes them; None if the page does not hold the phrase."""
    pattern = r"\s+".join(re.escape(word).replace(r"\#", NUMBER) for word in quoted.phrase.split())
    match = re.search(pattern, text)
    return match and match.groups()


def same(written, value):
    """Whether a number, rounded as it is written, is the one that was found."""
    if "/" in written:
        return abs(float(Fraction(written)) - value) < 1e-6
    digits, _, power = written.partition("e")
    last = 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))
    return abs(float(written) - value) <= (0.5 + 1e-9) * last


def again(quotes, text):
    """Of each number of some quotes: its phrase, how the page writes it, where it comes from, what it is there."""
    rows = []
    for each in quotes:
        numbers = read(text, each)
        if numbers is None:
            raise ValueError(f"the page does not say {each.phrase!r}: mend the page or studies/site/quoted.py")
        for written, source in zip(numbers, each.sources, strict=True):
            name, value = found(source)
            if not same(written, value):
                raise ValueError(f"{each.phrase!r} says {written}, but {name} is {value:g}: mend the page")
            rows.append((each, written, name, value))
    return rows


def theory(text):
    """The page of theory, below each section the numbers that were found again."""
    parts = re.split(r"(?m)^(?=## \d+\. )", text)
    for i, part in enumerate(parts[1:], 1):
        rows = again([each for each in QUOTES if each.section == int(part.split(".")[0][3:])], part)
        if rows:
            lines = "".join(f"| {written} | {value:.6g} | {name} |\n" for _, written, name, value in rows)
            head = "| quoted | found | from |\n|---|---|---|\n"
            about = f"{len(rows)} numbers of this section, found again as this page was built"
            parts[i] = f"{part}\n<details><summary>{about}</summary>\n\n{head}{lines}\n</details>\n\n"
    return "".join(parts)
