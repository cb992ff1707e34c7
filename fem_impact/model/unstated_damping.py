"""Does the answer depend on a damping that nobody stated? Every body has some, whatever a scene says."""

import numpy as np

from ..impact.assumption import Assumption
from .restrike import Struck

PLAUSIBLE = 0.01  # [-] damping ratio tried: bare metal has a hundredth of it, wood as much, felt and rubber more
NUMBER = "damping ratio tried"


def of_both(struck: Struck) -> Assumption:
    """The struck body, unless its damping is stated, and a flexible striker."""
    hit, quantities = struck.hit, struck.quantities
    history = hit.history
    zeta, unstated = history.zeta.copy(), []
    for name, body in (("striker", 0), ("struck body", len(hit.bodies) - 1)):
        columns = hit.body_slice(body)
        flexible = history.omega[columns] > 0.0
        bare = flexible.any() and not history.zeta[columns][flexible].any()
        if bare and not (body and struck.ideal) and hit.bodies[body].dimension:
            zeta[columns] = np.where(flexible, PLAUSIBLE, 0.0)
            unstated.append(name)
    if not unstated:
        return Assumption("stated damping", None, None, dict.fromkeys(quantities, 0.0), quantities, "", NUMBER)
    effect = struck.changes(zeta=zeta)
    if "sound" in quantities:
        effect["sound"] = 1.0 if "struck body" in unstated else effect["sound"]  # it would ring for ever
    remedy = f"state the damping ratio of the {' and of the '.join(unstated)}"
    return Assumption("stated damping", PLAUSIBLE, None, effect, quantities, remedy, NUMBER)
