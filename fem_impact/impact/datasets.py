"""A response as labelled arrays of xarray, for notebooks and files."""

from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import check
from .error import CAUSES
from .quantities import UNITS

if TYPE_CHECKING:
    from .response import Response

SCALARS = "n_impacts", "margin", "contact_time", "impulse", "peak_force", "restitution", "speed", "energy_error"
PARTS = {  # of an impact: unit
    "start": "s", "end": "s", "peak_force": "N", "impulse": "N s", "contact": "1", "restitution": "1",
}  # fmt: skip


def dataset(hit: "Response", points: Any = None, times: Any = None, max_frequency: float | None = None) -> Any:
    """The response as an `xarray.Dataset`, see `Response.to_xarray`; NaN where there is no restitution."""
    import xarray  # takes as long to load as a blow to compute

    dims = ("time",) if hit.force.ndim == 1 else ("time", "contact")
    about = {"units": "N", "long_name": "contact force"}
    data: dict[str, Any] = {"force": (dims, hit.force, about)}
    for name in SCALARS:
        value = getattr(hit, name)
        data[name] = ((), np.nan if value is None else value, {"units": UNITS[name] or "1"})
    for name, unit in PARTS.items():
        values = np.array([getattr(impact, name) for impact in hit.impacts], int if name == "contact" else float)
        data[f"impact_{name}"] = (("impact",), values, {"units": unit})
    errors = np.array(hit.restitution_errors, float)
    data["impact_restitution_error"] = (("impact",), errors, {"units": "1"})
    for part in (*CAUSES, "total"):
        data[f"error_{part}"] = ((), getattr(hit.error, part), {"units": "1"})
    data |= {f"energy_{name}": ((), value, {"units": "J"}) for name, value in hit.energies.items()}
    places: dict[str, Any] = {"time": ("time", hit.time, {"units": "s", "long_name": "time"})}
    if points is not None:
        moments = check.array("times", hit.time if times is None else times, (None,), "s", lift=True)
        points = check.places("points", points, hit.bodies[-1].dimension)
        places["moment"] = "moment", moments, {"units": "s", "long_name": "time"}
        places |= {axis: ("point", column, {"units": "m", "long_name": axis}) for axis, column in zip("xy", points.T)}
        for name, unit in (("displacement", "m"), ("velocity", "m/s")):
            motion = getattr(hit, name)(points, moments)
            data[name] = ("moment", "point"), motion, {"units": unit, "long_name": name}
    elif times is not None:
        raise ValueError("times must come with points, where the motion is wanted")
    if max_frequency is not None:
        highest = check.positive("max_frequency", max_frequency, "Hz")
        frequencies, spectrum = hit.band_spectrum(highest)
        places["frequency"] = "frequency", frequencies, {"units": "Hz", "long_name": "frequency"}
        data["spectrum"] = "frequency", abs(spectrum), {"units": "N s", "long_name": "spectrum of the force"}
    head: dict[str, Any] = {"tolerance": hit.tolerance, "tolerance_met": int(hit.tolerance_met), "verdict": hit.verdict}
    head |= {"trusted": int(hit.trusted), "outcome": hit.outcome, "in_contact": int(hit.in_contact)}
    return xarray.Dataset(data, places, head | {"notes": "\n".join(hit.notes)})
