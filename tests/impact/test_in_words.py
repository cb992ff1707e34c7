"""A blow in words."""

from dataclasses import replace

import pytest

import fem_impact as fi


@pytest.mark.parametrize(("growth", "chaotic"), [(300.0, False), (3000.0, True)])
def test_a_blow_that_loses_three_digits_is_called_chaotic(growth, chaotic):
    wall = fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), at=None, speed=1.0)
    summary = replace(wall, error=replace(wall.error, sensitivity=growth)).summary()
    assert ("chaotic" in summary) == chaotic
