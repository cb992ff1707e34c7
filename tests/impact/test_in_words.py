"""A blow in words."""

from dataclasses import replace

import pytest

import fem_impact as fi


def half_sine():
    """A mass of 0.1 kg on a plate of 1000 t: pi ms half sine of 100 N."""
    return fi.strike(fi.Modes.rigid(1e6), fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=None, speed=1.0)


def test_summary_speaks_of_what_counts():
    text = half_sine().summary()
    for word in ("1 impact", "proven not to touch again", "peak 100", "restitution", "estimated error", "energy"):
        assert word in text


@pytest.mark.parametrize(("growth", "chaotic"), [(300.0, False), (3000.0, True)])
def test_a_blow_that_loses_three_digits_is_called_chaotic(growth, chaotic):
    wall = fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), at=None, speed=1.0)
    summary = replace(wall, error=replace(wall.error, sensitivity=growth)).summary()
    assert ("chaotic" in summary) == chaotic
