"""Does the answer depend on a damping that nobody stated? Every body has some, whatever a scene says."""

import numpy as np

from ..impact.assumption import Assumption
from .restrike import Doubt, Struck

# [-] damping ratio tried, on the side of caution: bare metal has a hundredth of it, wood as much, felt more
PLAUSIBLE = 0.01
DAMPING = Doubt("stated damping", "damping ratio tried", None)


def examine_damping(struck: Struck) -> Assumption:
    """The struck body, unless its damping is stated, and a flexible striker."""
    hit, zeta, unstated = struck.hit, struck.hit.history.zeta.copy(), []
    for name, body, modes in zip(("striker", "struck body"), (0, len(hit.bodies) - 1), struck.bodies):
        flexible = modes.omega > 0.0
        simple = body and struck.ideal and not struck.foreseen
        if modes.dimension and flexible.any() and not modes.damping_ratio[flexible].any() and not simple:
            unstated.append(name)
            if not struck.foreseen:
                zeta[hit.body_slice(body)] = np.where(flexible, PLAUSIBLE, 0.0)
    if not unstated:
        return DAMPING.holds(struck)
    remedy = f"state the damping ratio of the {' and of the '.join(unstated)}"
    if struck.foreseen:
        return DAMPING.unknown(struck, "what a damping that nobody stated would change", remedy, PLAUSIBLE)
    effect = struck.changes(zeta=zeta)
    if "sound" in effect and "struck body" in unstated:
        effect["sound"] = 1.0  # it would ring for ever
    return DAMPING.judged(struck, PLAUSIBLE, effect, remedy)
