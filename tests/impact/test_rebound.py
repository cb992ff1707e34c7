"""How the bodies of a blow leave it."""

import fem_impact as fi


def test_a_body_that_stops_has_no_negative_restitution():
    """Two equal masses swap their speeds; what is left of the first one's is rounding of either sign."""
    touch = [fi.Touch(fi.Contact.linear(1e6), 0, 1)]
    hit = fi.collide([fi.Modes.rigid(0.1)] * 2, touch, speeds=[1.0, 0.0])
    assert abs(hit.restitution) < 1e-12 and "restitution 0.00000 at 1 m/s" in hit.summary()
