"""Maps: one blow at every point of a grid of parameters, as an xarray Dataset."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray

from . import _check
from ._check import SimulationError
from .contact import Contact
from .integrator import strike
from .modal import Modes
from .response import Response
from .striker import Striker

TOLERANCE = 1e-3  # [-] the default promise of a map
AXES = {  # name: unit, what it is
    "mass": ("kg", "mass of the striker"),
    "striker_frequency": ("Hz", "lowest flexible frequency of the striker"),
    "stiffness": ("N/m**exponent", "stiffness of the contact"),
    "exponent": ("", "exponent of the contact"),
    "loss": ("s/m", "loss factor of the contact"),
    "gap": ("m", "free way before the contact"),
    "speed": ("m/s", "speed of the striker's contact point"),
    "at": ("m", "point struck"),
    "target_mass": ("kg", "mass of the struck body"),
    "target_frequency": ("Hz", "lowest flexible frequency of the struck body"),
    "damping_ratio": ("", "damping ratio of the struck body"),
}
ALIASES = {  # the same parameters by their place in a scene file
    "striker.mass": "mass",
    "striker.first_frequency": "striker_frequency",
    "contact.stiffness": "stiffness",
    "contact.exponent": "exponent",
    "contact.loss": "loss",
    "contact.gap": "gap",
    "strike.speed": "speed",
    "strike.at": "at",
    "target.mass": "target_mass",
    "target.first_frequency": "target_frequency",
    "target.damping_ratio": "damping_ratio",
}
LAYERS: dict[str, tuple[str, str]] = {  # name: unit, what it is
    "n_impacts": ("", "number of unbroken contacts"),
    "contact_time": ("s", "total time in contact"),
    "restitution": ("", "minus speed after over speed before, at the contact point"),
    "impulse": ("N s", "total impulse of the contact force"),
    "peak_force": ("N", "largest contact force"),
    "error": ("", "estimated error of the time steps: absolute in restitution, relative in the others"),
    "centroid": ("Hz", "mean frequency of the force spectrum's magnitude"),
}


@dataclass(frozen=True, eq=False)
class Case:
    """One cell of a map: what `strike` is called with."""

    modes: Modes
    striker: Striker
    contact: Contact
    at: np.ndarray  # (dimension,) [m]
    speed: float  # [m/s]

    def changed(self, name: str, value: Any) -> "Case":
        """The same blow with one parameter of `AXES` replaced."""
        if name == "at":
            return replace(self, at=self.modes.points("at", value)[0])
        if name == "speed":
            return replace(self, speed=_check.positive("speed", value, "m/s"))
        if name in ("stiffness", "exponent", "loss", "gap"):
            return replace(self, contact=replace(self.contact, **{name: float(value)}))
        if name in ("mass", "striker_frequency"):
            key = "mass" if name == "mass" else "first_frequency"
            return replace(self, striker=replace(self.striker, modes=self.striker.modes.scaled(**{key: value})))
        if name == "damping_ratio":
            return replace(self, modes=self.modes.damped(value))
        key = "mass" if name == "target_mass" else "first_frequency"
        return replace(self, modes=self.modes.scaled(**{key: value}))

    def strike(self, tolerance: float, residual: bool) -> Response:
        """The single blow."""
        return strike(
            self.modes, self.striker, self.contact,
            at=self.at, speed=self.speed, tolerance=tolerance, residual=residual,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Grid:
    """The blow all cells start from and the axes that change it."""

    base: Case
    axes: Mapping[str, np.ndarray]  # name: (n,) values, for `at` (n, dimension)

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(values) for values in self.axes.values())

    @property
    def n_cases(self) -> int:
        return int(np.prod(self.shape, dtype=int))

    def case(self, index: int) -> Case:
        """The blow of one cell, counted along the last axis first."""
        case = self.base
        for (name, values), i in zip(self.axes.items(), np.unravel_index(index, self.shape)):
            case = case.changed(name, values[i])
        return case


def sweep(
    modes: Modes,
    striker: Striker,
    contact: Contact,
    *,
    at: Any,
    speed: float,
    over: Mapping[str, Any],
    tolerance: float = TOLERANCE,
    max_frequency: float | None = None,
    layers: Mapping[str, Callable[[Response], float]] | None = None,
    residual: bool = True,
) -> xarray.Dataset:
    """Strike once for every combination of parameters.

    Parameters
    ----------
    modes, striker, contact, at, speed
        The blow that all cells share, as in `strike`, but for what the axes change.
    over : mapping of axis name to values
        Names are those of `AXES` (``mass`` is the striker's), or their place in a scene (``striker.mass``). Values of
        ``at`` are points, shape (n_points, dimension) [m]; all others one-dimensional, SI units.
    tolerance : float [-]
        As in `strike`, in every cell.
    max_frequency : float [Hz], optional
        Adds the layer ``centroid``, the spectral centroid from zero to this frequency.
    layers : mapping of name to function of a Response, optional
        More scalars to keep. Every cell is then struck one by one.
    residual : bool
        As in `strike`.

    Returns
    -------
    xarray.Dataset
        One dimension per axis, in the order given; variables as in `LAYERS` with their units, and ``failure``, the
        error text of a cell that could not be struck (its numbers are then not a number, its n_impacts is -1).
        ``attrs["scene"]`` holds the blow all cells share as JSON.

    Raises
    ------
    ValueError
        Where an axis is unknown or a value cannot be.
    """
    tolerance = _check.between("tolerance", tolerance, 1e-12, 1.0)
    base = Case(modes, striker, contact, modes.points("at", at)[0], _check.positive("speed", speed, "m/s"))
    grid = Grid(base, _axes(base, over))
    band = None if max_frequency is None else _check.positive("max_frequency", max_frequency, "Hz")
    extra = dict(layers or {})
    names = [name for name in LAYERS if name != "centroid" or band is not None]
    numbers = np.full((len(names) + len(extra), grid.n_cases), np.nan)
    failures = np.full(grid.n_cases, "", dtype=object)
    for index in range(grid.n_cases):
        row, failures[index] = strike_cell(grid.case(index), tolerance, residual, band, extra)
        numbers[:, index] = row
    return _dataset(grid, [*names, *extra], numbers, failures, tolerance, band, residual)


def strike_cell(
    case: Case, tolerance: float, residual: bool, band: float | None, extra: Mapping[str, Callable[[Response], float]]
) -> tuple[np.ndarray, str]:
    """The layers of one cell by the modal engine, and its error text ('' where there is none)."""
    width = len(LAYERS) - (band is None) + len(extra)
    try:
        hit = case.strike(tolerance, residual)
        row = [hit.n_impacts, hit.contact_time, hit.restitution, hit.impulse, hit.peak_force, hit.error.step]
        row += [hit.spectral_centroid(band)] if band is not None else []
        row += [function(hit) for function in extra.values()]
    except SimulationError as error:
        return np.full(width, np.nan), str(error)
    return np.array(row, float), ""


def _axes(base: Case, over: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Checked values of every axis under its proper name."""
    if not isinstance(over, Mapping) or not over:
        raise ValueError(f"over must name at least one axis, such as {{'mass': [...]}}, got {over!r:.80}")
    axes: dict[str, np.ndarray] = {}
    for given, values in over.items():
        name = ALIASES.get(given, given)
        _check.one_of("over", name, AXES)
        if name in axes:
            raise ValueError(f"over names the axis {name} twice")
        if name == "at":
            axes[name] = base.modes.points("over['at']", values)
        else:
            axes[name] = _check.array(f"over[{given!r}]", values, (None,), AXES[name][0])
        if not len(axes[name]):
            raise ValueError(f"over[{given!r}] must hold at least one value")
        for value in axes[name]:
            base.changed(name, value)  # raises ValueError where the value cannot be
    return axes


def _dataset(
    grid: Grid,
    names: Sequence[str],
    numbers: np.ndarray,
    failures: np.ndarray,
    tolerance: float,
    band: float | None,
    residual: bool,
) -> xarray.Dataset:
    """Layers and axes with their units."""
    dims = tuple(grid.axes)
    data: dict[str, Any] = {}
    for name, values in zip(names, numbers):
        unit, meaning = LAYERS.get(name, ("", name))
        attributes: dict[str, Any] = {"units": unit or "1", "long_name": meaning}
        if name == "n_impacts":
            values = np.where(np.isnan(values), -1, values).astype(np.int32)
        if name == "centroid":
            attributes["max_frequency"] = band
        data[name] = (dims, values.reshape(grid.shape), attributes)
    data["failure"] = (dims, failures.reshape(grid.shape).astype(str), {"long_name": "why the cell failed"})
    table = xarray.Dataset(data, attrs={"title": "Map of blows", "scene": json.dumps(_scene(grid.base))})
    table.attrs |= {"tolerance": tolerance, "residual": int(residual)}
    for name, values in grid.axes.items():
        attributes = {"units": AXES[name][0] or "1", "long_name": AXES[name][1]}
        if name != "at":
            table[name] = (name, values, attributes)
        elif values.shape[1] == 1:
            table["at"] = ("at", values[:, 0], attributes)
        else:
            table = table.assign_coords(
                {f"at_{letter}": ("at", values[:, i], attributes) for i, letter in enumerate("xyz"[: values.shape[1]])}
            )
    return table


def _scene(base: Case) -> dict[str, Any]:
    """The blow that all cells share, in plain numbers."""

    def body(modes: Modes, at: np.ndarray) -> dict[str, Any]:
        place = at[None] if modes.dimension else None
        return {
            "mass": modes.mass,
            "frequencies": modes.frequencies.tolist(),
            "damping_ratios": modes.damping_ratio.tolist(),
            "at": at.tolist(),
            "shape": modes.shape_at(place)[0].tolist(),
            "residual_compliance": float(modes.residual_compliance(place)[0, 0]) if modes.dimension else 0.0,
        }

    law = base.contact
    return {
        "target": body(base.modes, base.at),
        "striker": body(base.striker.modes, base.striker.at),
        "contact": {"stiffness": law.stiffness, "exponent": law.exponent, "loss": law.loss, "gap": law.gap},
        "speed": base.speed,
    }
