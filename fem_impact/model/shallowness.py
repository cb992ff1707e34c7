"""Is a curved or ribbed plate shallow? What the inertia in its plane, and slopes, do to a blow.

A mode has kinetic energy besides that of its deflection: in the plane, of ribs as they swing about the middle of the
plate, and of the surface that is larger than its outline (`fe.shallow.plane_mass`). To first order its omega**2 drops
by the share of that. Strains measured on the outline are of the same order, the square of the slope. Elastic bodies of
three dimensions are 0.4 to 1.3 of that drop lower where slopes are 0.09 to 0.5 (`tests/independent/test_solids.py`);
with ribs, most of it is in the frequencies already.

References
----------
Leissa (1973), Vibration of shells, NASA SP-288, 1.6 and 2.3; Soedel (2004), Vibrations of shells and plates, 6.8.
"""

from typing import Any

import numpy as np

from ..fe import shallow
from ..impact.assumption import Assumption
from ..modes.ritz import RitzShapes
from ..modes.shapes import FieldShapes
from .bending import LOW, unwrapped
from .restrike import Doubt, Struck
from .thinness import lowered

LIMIT = 0.1  # [-] slope whose square, 1 %, is what frequencies may be off
SHALLOW = Doubt("shallow target", "steepest slope", LIMIT)
FLATTER = "the body is too steep for shallow theory; take its modes from a program for shells, `fi.Modes.from_arrays`"
FLAT = "ribs and layers move in the plane, too; take modes of a program for shells or solids, `fi.Modes.from_arrays`"


def examine(struck: Struck) -> Assumption:
    """The struck body."""
    shapes: Any = unwrapped(struck.bodies[1].shapes)[0]
    system = getattr(shapes, "system", None)
    if system is None or system.rules is not shallow.SHALLOW or not isinstance(shapes, (FieldShapes, RitzShapes)):
        return SHALLOW.holds(struck)
    curved = system.section.rise is not None
    value, remedy = (shallow.steepest(system), FLATTER) if curved else (None, FLAT)
    if struck.foreseen:
        return SHALLOW.judged(struck, value, {}, remedy)
    drop = _drop(struck, system, shapes)
    omega = struck.hit.history.omega[struck.mine]
    return SHALLOW.judged(struck, value, struck.changes(omega=struck.with_target(omega * lowered(drop))), remedy)


def _drop(struck: Struck, system: Any, shapes: FieldShapes | RitzShapes) -> np.ndarray:
    """Relative drop of omega**2 (n_modes,) [-]; that of modes above the first is that of the last of these."""
    modes = struck.bodies[1]
    n = min(LOW, modes.n_modes - modes.n_rigid)
    if isinstance(shapes, FieldShapes):
        vectors = shapes.vectors[:, modes.n_rigid : modes.n_rigid + n]
    else:
        vectors = shapes.basis.T @ shapes.turn[:, :n]
    found = np.einsum("ij,ij->j", vectors, shallow.plane_mass(system, vectors))  # of a whole mass of one
    every = np.full(modes.n_modes, np.median(found[-max(1, n // 4) :]))
    every[: modes.n_rigid], every[modes.n_rigid : modes.n_rigid + n] = 0.0, found
    return every
