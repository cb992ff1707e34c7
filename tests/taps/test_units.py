"""Units of channels."""

import pytest

from fem_impact.taps import units


@pytest.mark.parametrize(
    "text, si, factor",
    [("N", "N", 1.0), ("Newtons", "N", 1.0), ("kN", "N", 1e3), ("mN", "N", 1e-3), ("lbf", "N", 4.4482216152605),
     ("g", "m/s^2", 9.80665), ("m/s²", "m/s^2", 1.0), ("mm/s", "m/s", 1e-3), ("μm", "m", 1e-6)],
)  # fmt: skip
def test_known_units(text, si, factor):
    assert units.known(text) == (si, factor)


def test_headings():
    assert units.label("Hammer [mV]") == ("Hammer", "mV") and units.known("mV") is None
    assert units.label("Force [N]") == ("Force", "N") and units.label("Hammer (lbf)") == ("Hammer", "lbf")
    assert units.label("Force (Trigger)") == ("Force (Trigger)", "") and units.known("furlong") is None
