"""How far the force of a step is from its law: two runs may agree on a ripple of the force that both miss."""

from .build import inner
from .cubics import cubic
from .law import POWER, point_at, steepness, with_compliance
from .laws.felt import growth, memory_within_step

# [-] nodes and weights of Gauss and Legendre for a step: a spring that sets in like x**1.5 is integrated 13 times as
# well as by Simpson's rule
GAUSS = (0.5 - 0.6**0.5 / 2.0, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.5 + 0.6**0.5 / 2.0, 5.0 / 18.0)


@inner()
def force_on(d0, v0, d1, v1, h, part, spring):
    """Force of a spring [N] and its rate [N/s] at a fraction of a step; never negative.

    The approach is the cubic through both ends (d0, d1 [m], from the dent) with the rates there.
    """
    d, way = cubic(d0, h * v0, d1, h * v1, part)
    if d <= 0.0:
        return 0.0, 0.0
    rate = way / h
    point = point_at(d, spring)
    factor = 1.0 + spring.loss * rate
    if not point.force * factor > 0.0:
        return 0.0, 0.0
    turn = ((6.0 - 12.0 * part) * (d1 - d0) / h + (6.0 * part - 4.0) * v0 + (6.0 * part - 2.0) * v1) / h
    steep = steepness(point.compression, point.force, spring)
    if spring.relaxation > 0.0:
        g0, r0, _ = growth(point_at(d0, spring), v0, spring)
        g1, r1, _ = growth(point_at(d1, spring), v1, spring)
        z = memory_within_step(h, part, g0, g1, r0, r1, spring)[0]
        fade = (point.force / spring.stiffness - z) / spring.relaxation
        return max(0.0, point.force - spring.hard * z), steep * rate - spring.hard * fade
    return point.force * factor, with_compliance(steep, spring) * rate * factor + point.force * spring.loss * turn


@inner()
def misfit(mean, d0, v0, d1, v1, h, spring, peak):
    """Error of the peak force [N] that a step with that mean force suggests, if it is near the peak; see `force_on`."""
    smooth = spring.loss == 0.0 and spring.kind == POWER  # without loss, layers or memory
    if not mean > (0.8 if smooth else 0.35) * peak:
        return 0.0
    miss = mean
    for part, weight in GAUSS:
        miss -= weight * force_on(d0, v0, d1, v1, h, part, spring)[0]
    return (1.5 if smooth else 5.0) * abs(miss)
