"""A response as labelled arrays of xarray, for notebooks and files."""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .response import Response

SCALARS = {  # attribute of a response: unit
    "n_impacts": "1",
    "margin": "1",
    "contact_time": "s",
    "impulse": "N s",
    "peak_force": "N",
    "restitution": "1",
    "speed": "m/s",
    "energy_error": "1",
}
PARTS = {  # of an impact: unit
    "start": "s", "end": "s", "peak_force": "N", "impulse": "N s", "contact": "1", "restitution": "1",
}  # fmt: skip


def dataset(hit: "Response") -> Any:
    """The response as an `xarray.Dataset`, see `Response.to_xarray`; NaN where there is no restitution."""
    import xarray  # takes as long to load as a blow to compute

    dims = ("time",) if hit.force.ndim == 1 else ("time", "contact")
    about = {"units": "N", "long_name": "contact force"}
    data: dict[str, Any] = {"force": (dims, hit.force, about)}
    for name, unit in SCALARS.items():
        value = getattr(hit, name)
        data[name] = ((), np.nan if value is None else value, {"units": unit})
    for name, unit in PARTS.items():
        values = np.array([getattr(impact, name) for impact in hit.impacts], int if name == "contact" else float)
        data[f"impact_{name}"] = (("impact",), values, {"units": unit})
    errors = np.array(hit.restitution_errors, float)
    data["impact_restitution_error"] = (("impact",), errors, {"units": "1"})
    for part in ("step", "truncation", "mesh", "idealisation", "measurement", "total"):
        data[f"error_{part}"] = ((), getattr(hit.error, part), {"units": "1"})
    data |= {f"energy_{name}": ((), value, {"units": "J"}) for name, value in hit.energies.items()}
    places = {"time": ("time", hit.time, {"units": "s"})}
    told = {"tolerance": hit.tolerance, "tolerance_met": int(hit.tolerance_met), "verdict": hit.verdict}
    ended = {
        "trusted": int(hit.trusted),
        "outcome": hit.outcome,
        "in_contact": int(hit.in_contact),
        "notes": "\n".join(hit.notes),
    }
    return xarray.Dataset(data, places, told | ended)
