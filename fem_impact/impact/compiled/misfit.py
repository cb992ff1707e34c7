"""How far the force of a step is from its law: two runs may agree on a ripple of the force that both miss."""

from .build import inner
from .law import POWER, at, steepness
from .laws.felt import growth, soaked

# [-] error of the peak force over what steps near it miss, for a power law and for one with loss, layers or memory
MISFIT = 1.5, 5.0
NEAR_PEAK = 0.8, 0.35  # [-] steps count whose mean force is above this fraction of the peak force, for both
# [-] nodes and weights of Gauss and Legendre for a step: a spring that sets in like x**1.5 is integrated 13 times as
# well as by Simpson's rule
GAUSS = (0.5 - 0.6**0.5 / 2.0, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.5 + 0.6**0.5 / 2.0, 5.0 / 18.0)


@inner()
def force_on(d0, v0, d1, v1, h, part, spring):
    """Force of a spring [N] and its rate [N/s] at a fraction of a step; never negative.

    The approach is the cubic through both ends (d0, d1 [m], from the dent) with the rates there.
    """
    a = 2.0 * (d0 - d1) + h * (v0 + v1)
    b = 3.0 * (d1 - d0) - h * (2.0 * v0 + v1)
    d = d0 + part * (h * v0 + part * (b + part * a))
    if d <= 0.0:
        return 0.0, 0.0
    rate = v0 + part * (2.0 * b + 3.0 * a * part) / h
    point = at(d, spring)
    factor = 1.0 + spring.loss * rate
    if not point.force * factor > 0.0:
        return 0.0, 0.0
    turn = (2.0 * b + 6.0 * a * part) / (h * h)
    steep = steepness(point.compression, point.force, spring)
    if spring.relaxation > 0.0:
        g0, r0, _ = growth(at(d0, spring), v0, spring)
        g1, r1, _ = growth(at(d1, spring), v1, spring)
        z = soaked(h, part, g0, g1, r0, r1, spring)[0]
        fade = (point.force / spring.stiffness - z) / spring.relaxation
        return max(0.0, point.force - spring.hard * z), steep * rate - spring.hard * fade
    return point.force * factor, steep / (
        1.0 + spring.compliance * steep
    ) * rate * factor + point.force * spring.loss * turn


@inner()
def misfit(mean, d0, v0, d1, v1, h, spring, peak):
    """Error of the peak force [N] that a step with that mean force suggests, if it is near the peak; see `force_on`."""
    rough = int(spring.loss > 0.0 or spring.kind != POWER)
    if not mean > NEAR_PEAK[rough] * peak:
        return 0.0
    miss = mean
    for part, weight in GAUSS:
        miss -= weight * force_on(d0, v0, d1, v1, h, part, spring)[0]
    return MISFIT[rough] * abs(miss)
