"""Is the air negligible? Its mass, which moves with the body, and the sound that carries energy away.

Each side of a plate whose bending waves are shorter than those of sound moves rho_0 / sqrt(k**2 - k_0**2) of air per
area, and a finite plate some more; longer ones radiate with the efficiency 1 / sqrt(1 - k**2 / k_0**2). Below
coincidence a finite plate in a baffle radiates from its edges, and its lowest modes as sources of their volume. Without
a baffle it radiates less where its edges are held; free ones radiate little with a baffle or without. A strip of width
b moves pi rho_0 b**2 / 4 per length. A damping that was stated stands for all of it, the sound included.

References
----------
Cremer, Heckl and Petersson (2005), Structure-Borne Sound, ch. 6; Leppington, Broadbent and Heron (1982), Proc. R. Soc.
London A 382, 245-271; Wallace (1972), J. Acoust. Soc. Am. 51, 946-952.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ..impact.assumption import Assumption
from ..modes.air import DENSITY, SPEED
from .bending import Bending, Known
from .restrike import Doubt, Struck
from .thinness import wavenumber

# [-] of k**2: k**2 - k_0**2 does not get smaller, as the waves of a finite plate are not straight; a choice
ROUNDED = 0.1
IN_AIR = 'take the modes in air: air = "both sides" under [target], or `fi.in_air`'
# from 0.02 on frequencies drop by 1 %; a damping ratio so large takes a fifth of the energy in each period
CARRIED = Doubt("still air", "mass of the air moved over that of the body", 0.02, "give material and section")
RADIATED = replace(CARRIED, number="damping ratio by the sound radiated, beyond that stated")


def examine_air(struck: Struck) -> Assumption:
    """The struck body."""
    body, modes = struck.target, struck.bodies[1]
    if modes.air or modes.dimension == 0 or struck.ideal == "rigid":
        return CARRIED.holds(struck)
    remedy = IN_AIR if modes.dimension == 2 else "the air around beams is not modelled"
    history, mine, integrals = struck.hit.history, struck.mine, struck.bending
    if struck.planned or struck.ideal:  # the air along the waves of the contact's own frequency
        wave = None if body is None else wavenumber(body, integrals, struck.omega)
        if body is None or wave is None:
            return CARRIED.unknown(struck, "the waves of the body")
        mass = _moved_along(body, wave)
        if mass is None:
            return CARRIED.unknown(struck, "the width of the body")
        row = history.shape[:, mine] / (1.0 + mass) ** 0.25
        return CARRIED.judged(struck, float(mass), struck.changes(shape=struck.with_target(row, "shape")), remedy)
    found = None if body is None or integrals is None else loading(body, integrals)
    if found is None:
        return CARRIED.unknown(struck, "the shapes of the body" if body is None else "the width of the body")
    carried, sound = found
    changed = {
        "omega": struck.with_target(history.omega[mine] / np.sqrt(1.0 + carried)),
        "shape": struck.with_target(history.shape[:, mine] / np.sqrt(1.0 + carried), "shape"),
        "zeta": struck.with_target(np.maximum(history.zeta[mine], sound), "zeta"),
    }

    def shift(body: Known, integrals: Bending) -> np.ndarray | None:
        loaded = loading(body, integrals)
        return None if loaded is None else 1.0 - 1.0 / np.sqrt(1.0 + loaded[0])

    effect = struck.add_sound(struck.changes(**changed), shift)
    weight = struck.target_energy / (struck.target_energy.sum() or 1.0)
    mass, radiated = float(weight @ carried), float(weight @ np.maximum(sound - history.zeta[mine], 0.0))
    doubt = CARRIED if mass >= radiated else RADIATED
    return doubt.judged(struck, max(mass, radiated), effect, remedy)


def _moved_along(body: Known, wave: Any) -> Any:
    """Mass of the air over that of a body with waves of some wavenumbers [rad/m]; None for a beam of unknown width."""
    both = 2.0 * DENSITY / (body.per_extent * wave)
    if body.modes.dimension == 2:
        return both
    width = width_of(body)
    return None if width is None else np.minimum(0.25 * np.pi * DENSITY * width**2 / body.per_extent, width * both)


def loading(body: Known, integrals: Bending) -> tuple[np.ndarray, np.ndarray] | None:
    """Mass of the air over that of the body, and damping ratio by sound, (n_modes,) [-] each; None if not known.

    For a plate in a baffle; without one it moves less air, its lowest modes up to half as much. Free edges radiate less
    than this estimates, by a factor of 10 and more below coincidence, where that is little beside the mass.
    """
    rho, c = DENSITY, SPEED
    omega, per_extent = body.modes.omega, body.per_extent
    moving = (omega > 0.0) & (integrals.wave > 0.0)
    k, k0 = np.where(moving, integrals.wave, 1.0), np.where(moving, omega, c) / c
    if body.modes.dimension == 1:
        mass, width = _moved_along(body, k), width_of(body)
        if width is None:
            return None
        sound = 0.25 * np.pi * mass * (0.5 * k0 * width) ** 2
        return np.where(moving, mass, 0.0), np.where(moving, sound, 0.0)
    short = np.sqrt(np.maximum(k**2 - k0**2, ROUNDED * k**2))
    # what a finite plate moves beside its waves and by its volume: within 11 % of `in_air`, seven bodies
    finite = 1.0 + 0.5 * body.perimeter / (k * body.extent) + 0.6 * integrals.volume**2 * per_extent / body.extent
    # and of all motions a disk's that is stiff moves most, Rayleigh, section 302
    most = 8.0 * np.sqrt(body.extent / np.pi) / (3.0 * np.pi)
    mass = np.where(k > k0, 2.0 * rho / per_extent * np.minimum(finite / short, most), 0.0)
    share = np.maximum(k / k0, 1.0 + 0.5 * ROUNDED)  # k / k_0 below coincidence
    edges = body.perimeter / (2.0 * np.pi * k * body.extent * np.sqrt(share**2 - 1.0))
    edges *= np.log((share + 1.0) / (share - 1.0)) + 2.0 * share / (share**2 - 1.0)
    swells = k0**2 * integrals.volume**2 * per_extent / (2.0 * np.pi)
    above = 1.0 / np.sqrt(np.maximum(1.0 - (k / k0) ** 2, ROUNDED))
    small = np.minimum(1.0, k0 * body.perimeter / (2.0 * np.pi))  # edges that are shorter than sound cancel
    efficiency = np.where(k > k0, np.minimum(1.0, np.maximum(swells, edges * small)), above)
    sound = rho * c * efficiency / (per_extent * np.where(moving, omega, 1.0))
    return np.where(moving, mass, 0.0), np.where(moving, sound, 0.0)


def width_of(body: Known) -> float | None:
    """Mean width [m] of a beam."""
    section = body.section
    if section is None or body.thickness is None:
        return None
    return body.per_extent / section.material.rho / body.thickness
