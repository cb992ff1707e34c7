"""Is the air negligible? Its mass, which moves with the body, and the sound that carries energy away.

Each side of a plate whose bending waves are shorter than those of sound moves rho_0 / sqrt(k**2 - k_0**2) of air per
area, and a finite plate some more; longer ones radiate with the efficiency 1 / sqrt(1 - k**2 / k_0**2). Below
coincidence a finite plate in a baffle radiates from its edges, and its lowest modes as sources of their volume; without
a baffle it radiates less. A strip of width b moves pi rho_0 b**2 / 4 per length. A damping that was stated stands for
all of it, the sound included.

References
----------
Cremer, Heckl and Petersson (2005), Structure-Borne Sound, ch. 6; Leppington, Broadbent and Heron (1982), Proc. R. Soc.
London A 382, 245-271; Wallace (1972), J. Acoust. Soc. Am. 51, 946-952.
"""

from typing import Any

import numpy as np

from ..impact.assumption import Assumption
from ..modes.air import DENSITY, SPEED
from ..modes.modal import Modes
from .bending import Bending, Known, known
from .restrike import Struck
from .thinness import plane_wave, wavenumber

# [-] mass of the air over that of the body at which frequencies drop by 1 %; a damping ratio so large takes a fifth of
# the energy in each period
LIMIT = 0.02
# [-] of k**2: k**2 - k_0**2 does not get smaller, as the waves of a finite plate are not straight; a choice
ROUNDED = 0.1
RIM = 0.5  # [-] of perimeter / (k area): the air that a finite plate moves beside its waves; with SWELL within 11 %
SWELL = 0.6  # [-] of (int w)**2 / (area int w**2): what its volume adds (`fi.in_air`, five rectangles and two disks)
NUMBER = "mass of the air moved over that of the body"
RADIATED = "damping ratio by the sound radiated, beyond that stated"
IN_AIR = 'take the modes in air: air = "both sides" under [target], or `fi.in_air`'


def of_target(struck: Struck) -> Assumption:
    """The struck body."""
    body, quantities = struck.target, struck.quantities
    plate = body is None or body.modes.dimension == 2

    def told(value: float | None, effect: dict, unknown: str = "", number: str = NUMBER) -> Assumption:
        remedy = "give material and section" if unknown else IN_AIR if plate else "the air around beams is not modelled"
        return Assumption("still air", value, LIMIT, effect, quantities, remedy, number, unknown)

    if struck.bodies[1].air:
        return Assumption("still air", None, None, dict.fromkeys(quantities, 0.0), quantities, "", NUMBER)
    if struck.bodies[1].dimension == 0 or struck.ideal == "rigid":
        return told(None, dict.fromkeys(quantities, 0.0))
    if struck.foreseen:
        return told(*_ahead(struck, body))
    history, mine = struck.hit.history, struck.mine
    if struck.ideal:
        section = None if body is None else body.plate
        if section is None or body is None:
            return told(None, dict.fromkeys(quantities), "the waves of the body")
        mass = 2.0 * DENSITY / (body.per_extent * plane_wave(section, struck.omega))
        row = history.shape[:, mine] / (1.0 + mass) ** 0.25
        return told(mass, struck.changes(shape=struck.of_target(row, "shape")))
    found = None if body is None or struck.bending is None else loading(body, struck.bending)
    if found is None:
        why = "the shapes of the body" if body is None else "the width of the body"
        return told(None, dict.fromkeys(quantities), why)
    carried, sound = found
    changed = {
        "omega": struck.of_target(history.omega[mine] / np.sqrt(1.0 + carried)),
        "shape": struck.of_target(history.shape[:, mine] / np.sqrt(1.0 + carried), "shape"),
        "zeta": struck.of_target(np.maximum(history.zeta[mine], sound), "zeta"),
    }

    def shift(modes: Modes, integrals: Bending | None) -> np.ndarray | None:
        of = known(modes)
        loaded = None if of is None or integrals is None else loading(of, integrals)
        return None if loaded is None else 1.0 - 1.0 / np.sqrt(1.0 + loaded[0])

    effect = struck.heard(struck.changes(**changed), shift)
    weight = struck.energy.sum()
    beyond = np.maximum(sound - history.zeta[mine], 0.0)
    mass, radiated = (float(struck.energy @ each / weight) if weight else 0.0 for each in (carried, beyond))
    unknown = "the shapes heard" if effect.get("sound", 0.0) is None else ""
    return told(mass, effect, unknown) if mass >= radiated else told(radiated, effect, unknown, RADIATED)


def _ahead(struck: Struck, body: Known | None) -> tuple[float | None, dict, str]:
    """What is known before the blow: the mass of the air along the waves of the contact's own frequency."""
    wave = None if body is None else wavenumber(body, struck.bending, struck.omega)
    if body is None or wave is None:
        return None, {}, "the waves of the body"
    if body.modes.dimension == 2:
        return 2.0 * DENSITY / (body.per_extent * wave), {}, ""
    width = width_of(body)
    return (None, {}, "the width of the body") if width is None else (float(_along(body, width, wave)), {}, "")


def _along(body: Known, width: float, wave: Any) -> Any:
    """Mass of the air over that of a beam of a width [m] whose waves have some wavenumbers [rad/m]."""
    return np.minimum(0.25 * np.pi * DENSITY * width**2, 2.0 * DENSITY * width / wave) / body.per_extent


def loading(body: Known, integrals: Bending) -> tuple[np.ndarray, np.ndarray] | None:
    """Mass of the air over that of the body, and damping ratio by sound, (n_modes,) [-] each; None if not known.

    For a plate in a baffle; one without moves as much air, but radiates less.
    """
    rho, c = DENSITY, SPEED
    omega, per_extent = body.modes.omega, body.per_extent
    moving = (omega > 0.0) & (integrals.wave > 0.0)
    k, k0 = np.where(moving, integrals.wave, 1.0), np.where(moving, omega, c) / c
    if body.modes.dimension == 1:
        width = width_of(body)
        if width is None:
            return None
        mass = _along(body, width, k)
        sound = 0.25 * np.pi * mass * (0.5 * k0 * width) ** 2
        return np.where(moving, mass, 0.0), np.where(moving, sound, 0.0)
    short = np.sqrt(np.maximum(k**2 - k0**2, ROUNDED * k**2))
    finite = 1.0 + RIM * body.perimeter / (k * body.extent) + SWELL * integrals.volume**2 * per_extent / body.extent
    mass = np.where(k > k0, 2.0 * rho / (per_extent * short) * finite, 0.0)
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


def coincidence(body: Known, integrals: Bending) -> float | None:
    """Frequency [Hz] above which the bending waves are faster than sound, c**2 / (2 pi) k**2 / omega; None if rigid."""
    moving = (body.modes.omega > 0.0) & (integrals.wave > 0.0)
    if not moving.any():
        return None
    return float(SPEED**2 / (2.0 * np.pi) * np.median(integrals.wave[moving] ** 2 / body.modes.omega[moving]))
