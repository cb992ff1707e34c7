"""What blows are compared by, the slopes of their quantities, and what is printed."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.fe.variation import DIFFERENCES, SectionChange

QUANTITIES = ("impulse", "contact_time", "peak_force")


def difference(hit, other):
    """What the tolerance speaks of: the largest of four differences."""
    relative = (abs(getattr(hit, name) / getattr(other, name) - 1.0) for name in QUANTITIES)
    return max(abs(hit.restitution - other.restitution), *relative)


def worst(hit, other):
    """The same; 1 if they differ in the number of impacts."""
    return difference(hit, other) if hit.n_impacts == other.n_impacts else 1.0


def changes(blow, numbers, name, quantities, step=1e-4):
    """Changes of quantities per relative change of a number, from blows with the number a step smaller and larger."""
    low, high = (blow(numbers | {name: numbers[name] * (1.0 + side * step)}) for side in (-1.0, 1.0))
    return [(getattr(high, quantity) - getattr(low, quantity)) / (2.0 * step) for quantity in quantities]


def along(made, value, step):
    """How a section changes with the number it is made from."""
    multiples, weights = DIFFERENCES[0]
    return SectionChange(tuple(made(value + step * k) for k in multiples), tuple(w / step for w in weights))


def assert_printed(printed, stated, number=r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", **how):
    """The words of two texts are the same, in columns as wide as their numbers, and these are close."""
    assert re.sub(number, "#", printed).split() == re.sub(number, "#", stated).split(), printed
    numbers = [[float(each) for each in re.findall(number, text)] for text in (printed, stated)]
    np.testing.assert_allclose(*numbers, **how)


def parsed(html):
    """HTML that is XML as well: whatever is not closed or escaped fails here."""
    return ElementTree.fromstring(f"<div>{html}</div>")


def examined(hit, name):
    """One assumption of a blow; a name may go on behind a comma."""
    return next(each for each in hit.assumptions if each.name == name.partition(",")[0])


def stretched(test):
    """A slow test of bodies that stretch: one worker compiles their kernels."""
    return pytest.mark.slow(pytest.mark.xdist_group("stretched")(test))


def refusing(cases, call=lambda make: make(), error=ValueError):
    """A test that each case, arguments of ``call`` and a pattern of the message, is refused in these words."""

    @pytest.mark.parametrize("case", cases, ids=lambda case: str(case[-1]))
    def refused(case):
        *given, words = case
        with pytest.raises(error, match=words):
            call(*given)

    return refused


def follow_advice(advised, *given):
    """What is refused in some words, of which a pattern to their end may go on to the page of notes, then works."""
    wrong, words, right = advised
    pointer = r"( \(notes.md#[a-z-]+\))?$" if words.endswith("$") else ""
    refusals = ValueError, OSError, fi.SimulationError, fi.ToleranceWarning
    with pytest.raises(refusals, match=words.removesuffix("$") + pointer):
        wrong(*given)
    right(*given)
