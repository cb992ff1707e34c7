"""The quantities a user can ask of a blow, and how to name them."""

import copyreg
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from .._base import check

QUANTITIES = ("restitution", "impulse", "contact_time", "force", "n_impacts", "spectrum", "sound")
BANDED = ("spectrum", "sound")  # quantities that need an upper frequency
USUAL = MappingProxyType(dict.fromkeys(("restitution", "impulse", "contact_time", "force", "n_impacts")))
UNITS = {  # of numbers of a blow, by their names as quantities and as attributes; "" of what has none
    **dict.fromkeys(("restitution", "n_impacts", "margin", "energy_error"), ""),
    **dict.fromkeys(("contact_time", "peak_time"), "s"), **dict.fromkeys(("force", "peak_force"), "N"),
    **dict.fromkeys(("impulse", "spectrum"), "N s"), "speed": "m/s", "spectral_centroid": "Hz",
    "spectral_level": "dB", "modal_energy": "J", "sound": "",
}  # fmt: skip
# [-] number of frequencies at which spectra are looked at: several per lobe of a single pulse are enough
BAND_POINTS = 257


def _locked(values: dict) -> MappingProxyType:
    return MappingProxyType(values)


# so that plans and responses, which hold such mappings, can be pickled
copyreg.pickle(MappingProxyType, lambda mapping: (_locked, (dict(mapping),)))


def asked_for(quantity: Any) -> Mapping[str, float | None]:
    """The quantities asked for, each with its upper frequency [Hz], or None if it has no band.

    Parameters
    ----------
    quantity : None, str, sequence of str or mapping of str to frequency [Hz]
        Names from QUANTITIES; ``"spectrum=5000"`` is the spectrum up to 5 kHz. None means all without a band.
    """
    if quantity is None:
        return USUAL
    if isinstance(quantity, str):
        quantity = (quantity,)
    if not isinstance(quantity, (Mapping, Sequence)):
        raise ValueError(f"quantity must be names of {', '.join(QUANTITIES)}, got {check.shown(quantity)}")
    pairs = quantity.items() if isinstance(quantity, Mapping) else map(name_and_band, quantity)
    found: dict[str, float | None] = {}
    for name, limit in pairs:
        check.one_of("quantity", name, QUANTITIES)
        found[name] = checked_band(name, limit, name in BANDED)
    if not found:
        raise ValueError(f"quantity must name one of {', '.join(QUANTITIES)}, got none")
    return MappingProxyType(found)


def rebound(hit: Any, digits: int) -> str:
    """The restitution of a response with so many digits, or why there is none."""
    if hit.restitution is None:
        still = "none, the first body did not arrive" if hit.speed else "none, nothing arrived"
        return "none, still in contact" if hit.in_contact else still
    return f"{round(hit.restitution, digits) + 0.0:.{digits}f}"


NAMES = {"contact_time": "contact time", "force": "peak force", "n_impacts": "number of impacts"}


def words(quantities: Mapping[str, float | None]) -> str:
    """The quantities as a list in words, with their bands."""
    known = [(NAMES.get(name, name), band) for name, band in quantities.items()]
    said = [name if band is None else f"{name} to {band:g} Hz" for name, band in known]
    return said[0] if len(said) == 1 else f"{', '.join(said[:-1])} and {said[-1]}"


def checked_band(name: str, limit: Any, banded: bool) -> float | None:
    """The band [Hz] of a quantity, which must have one if it is ``banded``, and else none."""
    if banded != (limit is not None):
        rule = "needs a frequency, such as" if banded else "has no frequency, write"
        raise ValueError(f"quantity {name} {rule} '{name}{'=5000' if banded else ''}'")
    return None if limit is None else check.positive(f"frequency of {name}", limit, "Hz")


def name_and_band(item: Any) -> tuple[str, float | None]:
    """The name of a quantity and its band [Hz], from "spectrum=5000" and the like."""
    if not isinstance(item, str):
        raise ValueError(f"quantity must be names of {', '.join(QUANTITIES)}, got {check.shown(item)}")
    name, equals, limit = item.partition("=")
    if not equals:
        return name.strip(), None
    try:
        return name.strip(), float(limit)
    except ValueError:
        raise ValueError(
            f"frequency of {name.strip()} must be a number in Hz, got {check.shown(limit.strip())}"
        ) from None
