"""Maps of scenes: finds what they need of the body, adds resonance and threshold, writes pictures and files."""

import json
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from .._base import check, markup
from ..fe import plausible
from ..impact import threshold
from ..impact.contact import acting_stiffness, wall_time
from ..model.target import Stages
from ..show import export, figures, plots
from ..sweeps import cases, grid
from ..sweeps.borders import PREFIX, read_borders
from ..sweeps.cells import ALIASES, AXES, LAW, Case, computed_together, is_logarithmic, laid_out
from .scene import Scene
from .schema import Part
from .whole import check_axes, for_many

FORMATS = ("nc", "zarr")
FILES = (".nc", ".zarr", ".csv", ".png", ".pdf", ".svg")  # a folder name must not end like this
MOST_ROWS = 10**6  # [-] a larger map gets no CSV file: spreadsheets end there, and it would have a hundred megabytes
PICTURED = {name: words for name, words in figures.NAMES.items() if name != "impulse"}  # layers drawn with two axes


@check.typed
def map_scene(
    scene: Scene,
    *,
    over: Mapping[str, Any] | None = None,
    max_frequency: float | None = None,
    tolerance: float | None = None,
    **wanted: Any,
) -> xarray.Dataset:
    """Strike a scene for every combination of parameters.

    Parameters
    ----------
    scene : Scene
    over : mapping of key to values, optional
        Axes as in `sweep`, or any other number of the scene, written ``section.thickness``; the body is rebuilt for
        each of its values. By default the axes of the scene's table [map].
    max_frequency : float [Hz], optional
        Upper end of the band of the spectral centroid.
    tolerance : float [-], optional
        Replaces the tolerance of the scene.
    **wanted
        ``workers``, ``client``, ``store``, ``watch``, ``max_cells``, ``tell``, ``borders``, ``cells`` and ``refine`` of
        `sweep`; and ``stage``, called with the name of each stage before the blows, which returns a context manager.
        Beside a store, a file keeps what was found of the body.

    Returns
    -------
    xarray.Dataset
        As from `sweep`, with two more layers: ``contact_resonance`` [Hz], one over twice the contact time of a rigid
        striker on a rigid wall; and ``threshold`` [Hz], the contact resonance above which the body stops the striker
        by the kinetic-energy criterion (NaN if the striker never rebounds or is never stopped).
    """
    table = {} if scene.map is None else scene._make("map", scene.map)
    over = table.get("over", {}) if over is None else over
    if not isinstance(over, Mapping) or not all(isinstance(name, str) for name in over):
        raise ValueError(f"over must map the names of axes to their values, got {check.shown(over)}")
    band = table.get("max_frequency") if max_frequency is None else max_frequency
    with scene.blame("strike", () if tolerance is None else ("tolerance",)):
        limit = check.tolerance(scene.blow.values.get("tolerance", grid.TOLERANCE) if tolerance is None else tolerance)
    if not over:
        raise ValueError(
            f'{scene.path}: [map] is missing; add it and name the axes, as in over = {{ "striker.mass" = [0.01, 0.1] }}'
        )
    scene, model = for_many(scene, limit, wanted.get("stage"))
    law, stretches = scene.make_contact(), bool(scene.target.values.get("stretching"))
    anew = check_axes(scene, over)
    with scene.blame("map", ("cells",)):
        over, ours = laid_out(over, law, alone=stretches, cells=wanted.pop("cells", None))
    slow = {name: list(over[name]) for name in anew}
    quick = {name: values for name, values in over.items() if name not in slow}
    shared = quick or {"strike.speed": [scene.blow.values["speed"]]}
    if slow:
        for name in ("borders", "refine"):
            if wanted.get(name):
                raise ValueError(f"{name} must be left out for axes that need another body, got {', '.join(slow)}")
        wanted, ours = {**wanted, "borders": False}, False
    tell = wanted.pop("tell", None)
    grid.admit_size(
        math.prod(len(values) for values in over.values()), len(cases.LAYERS),
        wanted.pop("max_cells", grid.MOST_CELLS),
        quick=computed_together(law, over) and not (law.lossy or stretches or {"loss", "contact.loss"} & set(over)),
        tell=tell,
    )  # fmt: skip
    pieces = []
    store = wanted.pop("store", None)
    for number, chosen in enumerate(product(*slow.values())):
        changed = scene
        for name, value in zip(slow, chosen):
            changed = changed_scene(changed, AXES.get(name, ("", "", name))[2], value)
        own = store if store is None or not slow else Path(store).with_name(f"{Path(store).name}-{number}")
        pieces.append(_quick_map(changed, shared, band, limit, {**wanted, "store": own, "ours": ours, "tell": tell}))
    result = _joined(pieces, slow)
    result = result if quick else result.isel(speed=0, drop=True)
    result = result.transpose(*(ALIASES.get(name, name) for name in over), ...)
    result.attrs["scene"] = json.dumps(
        {**scene.data(), "map": {name: list(map(export.plain, v)) for name, v in over.items()}}
    )
    notes = (piece.attrs["notes"].splitlines() for piece in pieces)
    result.attrs["notes"] = "\n".join(plausible.together(model, *notes))
    result.attrs["title"] = scene.title or str(scene.path.name)
    return result


def changed_scene(scene: Scene, key: str, value: Any) -> Scene:
    """The scene with one number replaced; ``key`` is table.key."""
    table, name = key.split(".", 1)
    field = "blow" if table == "strike" else table
    part = getattr(scene, field) or Part()
    change: dict[str, Any] = {field: Part(part.kind, {**part.values, name: export.plain(value)})}
    return replace(scene, **change)


def _quick_map(
    scene: Scene, over: Mapping[str, Any], band: float | None, tolerance: float, wanted: Mapping[str, Any]
) -> xarray.Dataset:
    """A map whose axes do not need a new body."""
    stages, residual = Stages(wanted.get("stage")), scene.blow.values.get("residual", True)
    given = {name: value for name, value in wanted.items() if name != "stage"}
    job = grid.Job(tolerance, band, residual=residual, audit=True, **given)
    with scene.blame("map"):
        case, axes = job.described(scene.built, over, stages)
        return with_theory(grid.compute_map(job.cases(case, axes), job), case, axes)


def with_theory(table: xarray.Dataset, case: Case, axes: Mapping[str, np.ndarray]) -> xarray.Dataset:
    """Add ``contact_resonance`` and ``threshold`` [Hz] to a map, each along the axes it depends on."""
    striker = _part(axes, ("mass", "striker_frequency"))
    felt = np.array([cell.striker.felt_mass for cell in _cells(case, striker)])
    law, body = _part(axes, set(LAW) - {"loss", "gap"}), _part(axes, ("at", "target_mass", "target_frequency"))
    speed = _part(axes, ("speed",))
    speeds = speed.get("speed", np.array([case.speed]))
    resonance = [
        0.5 / wall_time(acting_stiffness(numbers, 1.0 / felt[:, None], speeds), exponent, 1.0 / felt[:, None], speeds)
        for numbers, exponent in ((cell.contact.numbers, cell.contact.exponent) for cell in _cells(case, law))
    ]
    limit = np.array([threshold.thresholds(cell.modes, cell.at, felt) for cell in _cells(case, body)])
    limit[~((limit > 0.0) & np.isfinite(limit))] = math.nan
    on_a_wall = "one over twice the contact time on a rigid wall"
    for name, found, mine, meaning in (
        ("contact_resonance", resonance, {**law, **striker, **speed}, on_a_wall),
        ("threshold", limit, {**body, **striker}, "contact resonance above which the struck body stops the striker"),
    ):
        values = np.reshape(found, [len(values) for values in mine.values()])
        layer = xarray.DataArray(values, dims=tuple(mine)).transpose(*(axis for axis in axes if axis in mine))
        table[name] = layer.assign_attrs(units="Hz", long_name=meaning)
    return table


def _part(axes: Mapping[str, np.ndarray], names: Collection[str]) -> dict[str, np.ndarray]:
    return {axis: values for axis, values in axes.items() if axis in names}


def _cells(case: Case, axes: Mapping[str, np.ndarray]) -> list[Case]:
    """The blow with every combination of values of some axes; the last varies fastest."""
    return [case.with_values(dict(zip(axes, values))) for values in product(*axes.values())]


def _joined(pieces: Sequence[xarray.Dataset], slow: Mapping[str, Sequence[Any]]) -> xarray.Dataset:
    """Join the pieces along the axes that rebuild the body; the last of these axes varies fastest."""
    rows = list(pieces)
    for name, values in reversed(list(slow.items())):
        numeric = all(isinstance(value, (int, float, np.number)) for value in values)
        axis, found = ALIASES.get(name, name), np.asarray(values, float) if numeric else np.arange(len(values))
        index = xarray.IndexVariable(axis, found, grid.axis_attributes(axis) if axis in AXES else {})
        count = len(values)
        rows = [
            xarray.concat(
                rows[i : i + count], index, data_vars="all", coords="minimal", join="override", combine_attrs="override"
            )
            for i in range(0, len(rows), count)
        ]
    return rows[0]


def draw(
    table: xarray.Dataset,
    layer: str,
    marks: Sequence[plots.Mark] = (),
    *,
    limits: tuple[float | None, float | None] = (None, None),
    **wanted: Any,
) -> figures.Figure:
    """Draw one layer of a map with two axes in colour, with contours of contact resonance and threshold.

    Parameters
    ----------
    table : xarray.Dataset
        From `map_scene` or `with_theory`; its title becomes that of the picture.
    layer : str
    marks : sequence of Mark
    limits : (low, high), optional
        Values at the ends of the colour scale; by default the extremes of the layer.
    **wanted
        Arguments of `plots.colour_map` that replace those chosen here.
    """
    values = table[layer]
    if values.ndim != 2:
        raise ValueError(f"layer must have two axes to be drawn, got {', '.join(map(str, values.dims))}; select two")
    size = np.asarray(values, float)
    size = size[np.isfinite(size) & (size > 0.0)]
    log = layer != "n_impacts" and size.size == values.size and size.max() > 5.0 * size.min()
    label = PICTURED.get(layer, layer)
    if "max_frequency" in values.attrs:
        label += f" up to {values.max_frequency:g} Hz"
    borders = []  # as curves over the picture: values along x and y
    if values.dims == table.n_impacts.dims and "borders" in table.attrs:
        # in grams, because SI prefixes do not go with kg
        rows, columns = (1e3 if name in table.coords and _unit(table[name]) == "g" else 1.0 for name in values.dims)
        borders = [(columns * border.points[:, 1], rows * border.points[:, 0]) for border in read_borders(table)]
    chosen: dict[str, Any] = {
        "x": _axis(table, values.dims[1]),
        "y": _axis(table, values.dims[0]),
        "colour": plots.Axis(markup.literal(label), _unit(values), log=bool(log), limits=limits),
        "contours": _contours(table, values),
        "borders": borders,
        "shades": [],
        "marks": marks,
        "title": markup.literal(str(table.attrs.get("title", ""))),
    }
    if "doubtful" in table and layer == "n_impacts" and bool(table.doubtful.any()):
        chosen["shades"] = [(table.doubtful, plots.PURPLE, "number in doubt")]
    shown = values.where(table.n_impacts >= 0)
    heavy = {name: 1e3 * shown[name] for name in shown.dims if name in shown.coords and _unit(shown[name]) == "g"}
    return plots.colour_map(shown.assign_coords(heavy), **{**chosen, **wanted})


def _contours(table: xarray.Dataset, values: xarray.DataArray) -> list[Any]:
    """Contours of contact resonance, and of where it equals the threshold, as far as they cross the map."""
    resonance = table.contact_resonance.broadcast_like(values).transpose(*values.dims)
    steps = [np.sign(np.diff(np.asarray(table[name], float))) for name in values.dims if name in table.coords]
    ordered = all(each.any() and (each == each[0]).all() for each in steps)  # no value twice, none out of turn
    if np.ptp(resonance.values) == 0.0 or min(values.shape) == 1 or not ordered:
        return []
    low, high = float(resonance.min()), float(resonance.max())
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)))
    shown = [float(f) for f in np.outer(decades, (1.0, 2.0, 5.0)).ravel() if low < f < high]
    found: list[Any] = [(resonance, shown, "Hz", "contact resonance")]
    limit = (resonance / table.threshold).transpose(*values.dims)
    if float(limit.min()) < 1.0 < float(limit.max()):
        found.append((limit, [1.0], "", "threshold: the body stops the striker"))
    return found


def _axis(table: xarray.Dataset, name: Any) -> plots.Axis:
    """How to draw an axis: logarithmic if its values are evenly spaced in the logarithm."""
    if name not in table.coords:  # points of a plate have two coordinates each
        parts = [table[f"{name}_{letter}"].values for letter in "xyz" if f"{name}_{letter}" in table.coords]
        names = [f"({', '.join(f'{x:.3g}' for x in point)})" for point in zip(*parts)]
        return plots.Axis("strike point [m]", names=tuple(names or map(str, range(table.sizes[name]))))
    place = table[name]
    values = np.asarray(place, float)
    return plots.Axis(str(place.attrs.get("long_name", name)), _unit(place), log=is_logarithmic(values))


def _unit(values: xarray.DataArray) -> str:
    unit = str(values.attrs.get("units", ""))
    power = unit.partition("**")[2]
    return {"1": "", "kg": "g"}.get(unit, unit.replace(f"**{power}", f"$^{{{power}}}$") if power else unit)


def can_write(form: str, folder: Path | None = None) -> str:
    """Check that a map can be written, before any work is done; return the format."""
    if folder is not None and folder.suffix.lower() in FILES:
        raise ValueError(
            f"--out must name a folder for map.nc, map.csv and pictures, got {folder}; "
            f"give {folder.with_suffix('')}, and --format zarr for map.zarr"
        )
    if check.one_of("format", form, FORMATS) == "zarr":
        check.extra("zarr", "cluster", "format zarr")
    return form


def write_map(folder: Path, table: xarray.Dataset, form: str = "nc", picture: str = "png") -> list[str]:
    """Write map.nc or map.zarr, map.csv, borders.csv and, for two axes, a picture of each layer; return the names.

    A map of more than MOST_ROWS cells gets no CSV file: it would be slow to write and useless.
    """
    form = can_write(form)
    names = [f"map.{form}"]
    if form == "nc":
        table.to_netcdf(folder / names[0], engine="scipy")
    else:
        table.to_zarr(folder / names[0], zarr_format=2)  # version 3 has no standard for text yet
    if table.n_impacts.size <= MOST_ROWS:
        names.append("map.csv")
        table.drop_dims(PREFIX, errors="ignore").to_dataframe().to_csv(folder / "map.csv")  # what each cell has
    if PREFIX in table.sizes:
        names.append("borders.csv")
        table[[name for name in table.data_vars if table[name].dims == (PREFIX,)]].to_dataframe().to_csv(
            folder / "borders.csv", index=False
        )
    if len(table.n_impacts.dims) == 2:
        for layer in PICTURED:
            if layer in table and bool((table.n_impacts >= 0).any()):
                figures.save(folder / f"{layer}.{picture}", draw(table, layer))
                names.append(f"{layer}.{picture}")
    return names
