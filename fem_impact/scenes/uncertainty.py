"""Blows whose inputs are uncertain: from distributions of numbers of a scene to distributions of the answer."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from .._base import check, progress
from .._base.threads import one_thread
from ..fe import plausible
from ..fe.assembly import System, reassemble
from ..fe.section import Beam, Plate
from ..impact.contact import Contact
from ..impact.measured import ENDS
from ..impact.parameters import BAR, PLATE, ROD
from ..impact.striker import Striker
from ..model.planner import Blow
from ..model.target import Target
from ..modes.modal import Damping, Modes
from ..show import export, figures
from ..sweeps import bodies, grid
from ..sweeps.cases import Cases, fewer_values, solve_all, try_each
from ..sweeps.cells import ALIASES, AXES, LAW, REACH, Case, rescales
from ..sweeps.inputs import Input, correlating_matrix, drawn_inputs, read_inputs, shares, sobol_points
from ..sweeps.spreads import DOUBLE, QUANTITIES, Checks, Spread
from ..sweeps.store import Texts
from .maps import MOST_ROWS, changed_scene
from .scene import Scene, load_scene
from .whole import for_many, is_tied

# [-] default limit of a spread, to limit the work to some minutes and 1 GB of numbers
MOST_BLOWS = 10**7
PLACES = ("strike.x", "strike.y")  # inputs that move the strike point
POSITIVE = ("mass", "stiffness", "speed", "target_mass", "target_frequency", "striker_frequency")  # axes above zero
SIZE = "target.size"  # [-] factor on all lengths in the plane of a plate, or along a beam
# Inputs of the body's modes by dimension: powers of its frequencies and of its mass; Kirchhoff, Euler and Bernoulli
BODY = {
    dimension: {SIZE if name == "target.scale" else name: each for name, each in powers.items()}
    for dimension, powers in ((2, PLATE), (1, BAR | ROD))
}


@check.typed
@one_thread
def spread(
    scene: Scene | str | Path | System | Modes,
    vary: Mapping[str, Any],
    striker: Striker | None = None,
    contact: Contact | None = None,
    *,
    n: int = 10_000,
    correlation: Any = None,
    sobol: bool | None = None,
    seed: int = 0,
    tolerance: float | None = None,
    max_frequency: float | None = None,
    at: Any = None,
    speed: float | None = None,
    damping_ratio: Damping | None = None,
    workers: int | None = None,
    client: Any = None,
    store: str | Path | None = None,
    watch: Callable[[int, int], Any] | None = None,
    max_blows: float = MOST_BLOWS,
) -> Spread:
    """Strike with uncertain inputs: how every quantity of the blow is distributed, and which input matters.

    Parameters
    ----------
    scene : Scene, path of a scene file, System or Modes
        A scene says everything else. A body needs striker, contact, ``at`` and ``speed``, as in `strike`.
    vary : mapping of input to distribution
        Inputs are the axes of a map (``contact.stiffness``, ``striker.mass``, ``strike.speed``, ...), the strike point
        (``strike.x``, ``strike.y``), the body (``section.thickness``, ``material.E``, ``material.rho``, and
        ``target.size``, a factor on its lengths, whose modes are rescaled), and in a scene any other number of a rigid
        striker or of the contact. Distributions are ``("normal", mean, deviation)``, ``("lognormal", median, sigma)``
        with the deviation of the logarithm, ``("uniform", low, high)``, ``("loguniform", low, high)``,
        ``("triangular", low, mode, high)``, the same as text, or a frozen distribution of scipy.stats.
    n : int
        Number of blows, those for Sobol indices included.
    correlation : matrix or mapping of pairs of inputs to numbers, optional
        Correlations of the inputs' normal scores (a Gaussian copula).
    sobol : bool, optional
        Whether Sobol indices are wanted, for which blows share inputs in groups; by default wherever they exist: for
        independent inputs, if SALib is installed (``pip install 'fem-impact[spread]'``).
    seed : int
        Of the scrambled points; the same seed gives the same blows.
    tolerance : float [-], optional
        Largest error of each blow; by default the scene's, or 1e-3.
    max_frequency : float [Hz], optional
        Adds the spectral centroid up to this frequency; that takes far longer than all other quantities.
    at, speed, damping_ratio : as in `strike`, for a body
    workers, client, store, watch : as in `sweep`
    max_blows : float
        More blows are refused before the start.

    Returns
    -------
    Spread

    Raises
    ------
    ValueError
        If an input is unknown, reaches values that are not allowed, or Sobol indices are asked for where there are
        none.
    SimulationError
        If the body cannot be described well enough for the hardest of the blows.

    Notes
    -----
    What needs kernels of its own for each value (strike point, damping ratio, and a flexible striker's frequency over
    that of the body) takes at most 256 values together. ``checks`` says what that changes.

    Examples
    --------
    >>> wall, law = fi.Modes.rigid(1e9), fi.Contact.linear(1e5)
    >>> blow = {"at": None, "speed": 1.0}
    >>> found = fi.spread(wall, {"striker.mass": ("lognormal", 0.1, 0.2)}, fi.Striker.rigid(0.1), law, n=256, **blow)
    >>> abs(found.quantile("contact_time", 0.5).value / (3.14159 * (0.1 / 1e5) ** 0.5) - 1.0) < 1e-2
    True
    """
    inputs = read_inputs(vary)
    model: tuple[str, ...] = ()
    if isinstance(scene, (System, Modes)):
        given = check.instance("striker", striker, Striker), check.instance("contact", contact, Contact)
        arguments = {"at": at, "speed": check.positive("speed", speed, "m/s", reach=REACH)}
        loaded: Scene | None = None
        blow = Blow(Target.of(scene, damping_ratio), *given, arguments)
    else:
        own: dict[str, Any] = {"striker": striker, "contact": contact, "at": at, "speed": speed}
        for name, value in {**own, "damping_ratio": damping_ratio}.items():
            if value is not None:
                raise ValueError(f"{name} must be left out for a scene, which has its own")
        loaded, model = for_many(scene if isinstance(scene, Scene) else load_scene(scene), tolerance)
        blow = loaded.built
    n = check.count("n", n)
    if n > (most := check.number("max_blows", max_blows)):
        raise ValueError(f"n must be at most {most:g} blows, got {n}; raise max_blows")
    mixer = correlating_matrix(inputs, correlation)
    seed = check.count("seed", seed, low=0)
    workers = None if workers is None else check.count("workers", workers)
    groups, why = _grouped(sobol, mixer, n, len(inputs))
    band = None if max_frequency is None else check.positive("max_frequency", max_frequency, "Hz")
    with blow.target.blame("strike", () if tolerance is None else ("tolerance",)):
        limit = check.tolerance(blow.arguments.get("tolerance", grid.TOLERANCE) if tolerance is None else tolerance)
    d = len(inputs)
    points = sobol_points(shares(n // (d + 2), 2 * d, seed)) if groups else shares(n, d, seed)
    values = drawn_inputs(inputs, points, mixer)
    if not np.isfinite(values).all() or np.abs(values).max() > REACH:
        raise ValueError(f"vary must stay finite and below {REACH:g}; choose distributions with shorter tails")
    asked = _SpreadAsked(blow, loaded, inputs, values, limit, store)
    exact = replace(asked.cases(), band=band)
    base, rough = exact.base, fewer_values(exact)
    numbers, texts = solve_all(rough, workers, client, store, watch or partial(progress.report, "blows"))
    checks, rescaled = _checked(exact, numbers, workers), asked.rescaled(base)
    notes = plausible.together(model, base.modes.notes, base.striker.notes)
    table = _table(inputs, values, rough, numbers, texts, d + 2 if groups else 1)
    title = loaded.title or loaded.path.name if loaded is not None else ""
    return Spread(inputs, table, limit, groups, mixer, seed, checks=checks, rescaled=rescaled, title=title, notes=notes,
                  why_no_shares=why)  # fmt: skip


def _grouped(sobol: bool | None, mixer: Any, n: int, n_inputs: int) -> tuple[bool, str]:
    """Whether blows come in groups for Sobol indices and, if not, why."""
    if sobol is False:
        return False, ""
    if mixer is not None:
        why = "the inputs are correlated, so no share of the variance belongs to one input alone"
    elif n < 2 * (n_inputs + 2):
        why = f"n must be at least {2 * (n_inputs + 2)} for {n_inputs} inputs"
    else:
        why = ""
        try:
            check.extra("SALib.analyze.sobol", "spread", "a Sobol index")
        except ValueError as error:
            why = str(error)
    if why and sobol:
        raise ValueError(f"sobol must be left out: {why}")
    return not why, why


@dataclass(frozen=True, eq=False)
class _SpreadAsked:
    """A blow and the values of its inputs: which axes of a map they are."""

    blow: Blow
    scene: Scene | None
    inputs: Sequence[Input]
    values: np.ndarray  # (n_cases, n_inputs)
    tolerance: float
    store: str | Path | None
    own: dict[str, np.ndarray] = field(default_factory=dict)  # what `_sort` finds: axis of a map -> values
    body: dict[str, np.ndarray] = field(default_factory=dict)  # input of the body -> value over its own [-]
    parts: dict[str, np.ndarray] = field(default_factory=dict)  # other number of the scene -> values
    places: dict[int, np.ndarray] = field(default_factory=dict)  # coordinate of the strike point -> values [m]

    def __post_init__(self) -> None:
        for each, column in zip(self.inputs, self.values.T):
            self._sort(each.name, ALIASES.get(each.name, each.name), column)
        if self.body and {"target_mass", "target_frequency"} & set(self.own):
            raise ValueError("vary must name the mass and frequency of the body, or what makes them, but not both")

    def _sort(self, name: str, axis: str, column: np.ndarray) -> None:
        dimension, (table, _, key) = self.dimension, name.partition(".")
        part = getattr(self.scene, table, None) if table in ("striker", "contact") else None
        if self.scene is not None and axis in AXES and is_tied(self.scene, axis):
            self.parts[AXES[axis][2]] = column
        elif name in PLACES[:dimension]:
            self.places[PLACES.index(name)] = column
        elif name in BODY.get(dimension, {}):
            self.body[name] = column / self._of_body(name)
            if not (self.body[name] > 0.0).all():
                raise _below(name, column)
        elif axis in AXES and axis != "at":
            target = self.blow.target
            if not rescales(axis, target.air or (target.modes and target.modes.air), target.damping_ratio):
                advice = (
                    "leave it out" if self.scene is None else "write it in the scene as { value, about } for `fi.band`"
                )
                raise ValueError(f"vary: {name} does not rescale air, nor damping that depends on frequency; {advice}")
            if axis in self.own:
                raise ValueError(f"vary names {axis} twice")
            self.own[axis] = column
        elif part is not None and isinstance(part.values.get(key), (int, float)):
            self.parts[name] = column
        else:
            known = [*ALIASES, *AXES, *PLACES[:dimension], *BODY.get(dimension, {})]
            raise ValueError(f"vary: {check.shown(name)} is not an input{check.nearest(name, known)}")
        if name == "material.E" and self.scene is not None and self.scene.contact.kind == "between":
            self.parts[name] = column  # the contact's stiffness comes from the material, too

    @property
    def dimension(self) -> int:
        """2 for a plate, 1 for a beam, 0 for a rigid body."""
        target = self.blow.target
        return target.mesh.dimension if target.mesh is not None else target.modes.dimension if target.modes else 0

    def _of_body(self, name: str) -> float:
        """The body's own value of an input, which must be one number."""
        target, section = self.blow.target, self.blow.target.section
        if name == SIZE:
            if not target.similar or target.scale:
                raise ValueError(
                    f"vary: {SIZE} needs a thin body of stated size, flat, without springs, tension, ribs, point "
                    "masses or air; vary target.mass and target.first_frequency"
                )
            return 1.0
        if section is None:
            raise ValueError(f"vary: {name} needs a body with a section; vary target.mass and target.first_frequency")
        table, key = name.split(".")
        if isinstance(section, Plate) and (section.ribs or section.layers or (section.rise and table == "section")):
            raise ValueError(
                f"vary: {name} rescales the modes of flat plates of one material, which this is not; write it in the "
                "scene as { value, about } for `fi.band`, or vary target.mass and target.first_frequency"
            )
        round_ = isinstance(section, Beam) and section.round
        if (key == "diameter") != round_ and key in ("diameter", "width", "height"):
            raise ValueError(f"vary: {name} is not a number of this section")
        value = getattr(section.material if table == "material" else section, "height" if round_ and key == "diameter"
                        else key)  # fmt: skip
        if callable(value):
            raise ValueError(f"vary: {name} varies in space already; vary target.mass and target.first_frequency")
        return float(value)

    def cases(self) -> Cases:
        """All blows by row, on a body that serves all of them."""
        blow, axes, residual = self.blow, dict(self.own), self.blow.arguments.get("residual", True)
        self._add_parts(axes)
        target, at, speed = blow.target, blow.arguments["at"], blow.arguments["speed"]
        first = None
        if self.body:
            first = target.modes or target.surrounded(target.first_flexible)
        wide = axes | self._of_modes(first)
        ends: dict[str, Any] = {name: np.unique([column.min(), column.max()]) for name, column in wide.items()}
        if self.places:
            points = self._points(at)
            ends["at"] = points[np.unique([points.argmin(axis=0), points.argmax(axis=0)])]
        for each in self.inputs:
            axis = ALIASES.get(each.name, each.name)
            if axis in axes and axis in POSITIVE and axes[axis].min() <= 0.0:
                raise _below(each.name, axes[axis])
        try:
            base, _ = bodies.body_of(
                blow, ends or {"speed": np.array([speed])}, tolerance=self.tolerance, store=self.store,
                alone=residual and not self.places,
            )  # fmt: skip
        except ValueError as error:  # a fault of an axis is reported as one of the inputs
            if re.split(r"[ \[]", str(error))[0] not in (*AXES, "over", "first_frequency"):
                raise
            said = str(error).replace("over['at']", "the strike point")
            raise ValueError(f"vary reaches values that are not allowed: {said}") from None
        axes |= self._of_modes(base.modes if self.body else None, base.first)
        if self.places:
            axes["at"] = base.modes.points("vary: strike point", self._points(at))
        return Cases(replace(base, speed=speed), axes, self.tolerance, residual, by_row=True)

    def _factors(self, body: Mapping[str, Any]) -> list[Any]:
        """Factors of the body's mass and of its frequencies from those of its inputs; 1 where the scene states them."""
        found: list[Any] = [1.0, 1.0]
        for i, stated in enumerate(("mass", "first_frequency")):
            for name, ratio in body.items() if stated not in self.blow.target.scale else ():
                found[i] = found[i] * ratio ** BODY[self.dimension][name][1 - i]
        return found

    def _of_modes(self, modes: Modes | None, first: float | None = None) -> dict[str, np.ndarray]:
        """The axes that rescale a body of which modes are known, and perhaps its first frequency [Hz]."""
        if modes is None:
            return {}
        first = first or float(modes.frequencies[modes.omega > 0.0][0])
        mass, frequency = self._factors(self.body)
        one = np.ones(len(self.values))
        return {"target_mass": modes.mass * mass * one, "target_frequency": first * frequency * one}

    def _points(self, at: Any) -> np.ndarray:
        """The strike points (n_cases, dimension) [m]."""
        points = np.tile(np.atleast_1d(np.asarray(at, float)), (len(self.values), 1))
        for i, column in self.places.items():
            points[:, i] = column
        return points

    def _add_parts(self, axes: dict[str, np.ndarray]) -> None:
        """Add the masses of strikers and the laws of contacts that are made anew for each blow."""
        if not self.parts or self.scene is None:
            return
        laws, masses = np.empty((len(self.values), len(LAW))), np.empty(len(self.values))
        for i, row in enumerate(zip(*self.parts.values())):
            scene = self.scene
            for name, value in zip(self.parts, row):
                scene = changed_scene(scene, name, float(value))
            striker, law = scene.make_striker(), scene.make_contact()
            other = next((name for name in self.parts if name.startswith("striker.")), None)
            if striker.modes.dimension and other:
                raise ValueError(
                    f"vary: {other} needs a rigid striker that does not turn; write it in the scene as "
                    "{ value, about } for `fi.band`, or vary striker.mass and striker.first_frequency of one that bends"
                )
            laws[i], masses[i] = [getattr(law, name) for name in LAW], striker.mass
        for name, column in zip(LAW, laws.T):
            if name not in axes and np.ptp(column) > 0.0:
                axes[name] = column
        if "mass" not in axes and np.ptp(masses) > 0.0:
            axes["mass"] = masses

    def rescaled(self, base: Case) -> dict[str, float]:
        """Error [-] of rescaling the modes for each input of the body: against a body made anew near both tails.

        `SIZE` is missing, as for the bodies that allow it the rescaled modes are the exact ones.
        """
        found: dict[str, float] = {}
        residual = self.blow.arguments.get("residual", True)
        alone = Cases(base, {}, self.tolerance, residual)
        for each in self.inputs:
            if each.name not in self.body or each.name == SIZE:
                continue
            found[each.name] = 0.0
            for ratio in (each.distribution.ppf(np.array(ENDS)) / self._of_body(each.name)).tolist():
                mass, frequency = self._factors({each.name: ratio})
                changes = {
                    "target_mass": base.modes.mass * mass, "target_frequency": base.first_frequency * frequency,
                }  # fmt: skip
                blow = replace(self.blow, target=_made(self.blow.target, each.name, ratio))
                other, _ = bodies.body_of(blow, {"speed": [base.speed]}, tolerance=self.tolerance, alone=residual)
                try:
                    one, two = (alone.row(alone.strike(case)) for case in (base.with_values(changes), other))
                    off = max(alone.apart(one, two).values()) if one[0] == two[0] else math.inf
                except check.SimulationError:
                    off = math.inf
                found[each.name] = max(found[each.name], off)
        return found


def _below(name: str, column: np.ndarray) -> ValueError:
    return ValueError(
        f"vary[{name!r}] must stay positive, but it reaches {column.min():g}; "
        "give lognormal, or uniform with a positive low"
    )


def _made(target: Target, name: str, ratio: float) -> Target:
    """The target with one number of its section or material multiplied."""
    section = target.section
    assert section is not None
    table, key = name.split(".")
    if table == "material":
        changed: Any = replace(
            section, material=replace(section.material, **{key: getattr(section.material, key) * ratio})
        )
    else:
        keys = ("width", "height") if key == "diameter" else (key,)
        changed = replace(section, **{each: getattr(section, each) * ratio for each in keys})
    if target.system is None:
        return replace(target, section=changed)
    other = reassemble(replace(target.system, section=changed), target.system.mesh)
    return Target.of(other, target.damping_ratio)


def _checked(exact: Cases, numbers: np.ndarray, workers: int | None) -> Checks:
    """Strike a few blows again one by one, with the values they really have."""
    # so many that the worst of them shows an error that many have
    some = [int(i) for i in np.unique(np.linspace(0, exact.n_cases - 1, 16).astype(int))]
    hits = {i: hit for i, (hit, _) in zip(some, try_each(some, exact.blow, workers)) if hit is not None}
    apart: dict[str, float] = {}
    others = 0
    for i, hit in hits.items():
        row = exact.row(hit)
        if row[0] != numbers[0, i]:
            others += 1
            continue
        for name, value in exact.apart(row, numbers[:, i]).items():
            apart[name] = max(apart.get(name, 0.0), value)
    unknown = {each.name: None for hit in hits.values() for each in hit.assumptions if not each.known}
    return Checks(
        len(hits), apart, others,
        max((hit.error.truncation + hit.error.mesh for hit in hits.values()), default=math.nan),
        max((hit.model_error for hit in hits.values()), default=math.nan), tuple(unknown),
    )  # fmt: skip


def _table(
    inputs: Sequence[Input], values: np.ndarray, cases: Cases, numbers: np.ndarray, texts: Texts, n_parts: int
) -> xarray.Dataset:
    """All blows as a Dataset along one dimension."""
    data: dict[str, Any] = {}
    power = cases.base.contact.exponent
    for each, column in zip(inputs, values.T):
        unit = AXES.get(ALIASES.get(each.name, each.name), ("",))[0].replace("exponent", f"{power:g}")
        data[each.name] = ("blow", column, {"units": unit or "1", "distribution": each.said})
    data |= {name: ("blow", *column) for name, column in cases.labelled(numbers).items()}
    if np.isnan(data["truncation"][1]).all():  # known of blows struck alone only
        del data["truncation"]
    counts = data["n_impacts"][1]
    data[DOUBLE] = ("blow", (counts > 1).astype(np.int8), {"units": "1", "long_name": QUANTITIES[DOUBLE][1]})
    part = np.arange(len(counts)) % n_parts
    meaning = "0: all inputs from A, the last: all from B, others: one from B"
    data["part"] = ("blow", part.astype(np.int32), {"long_name": meaning})
    data["failure"] = ("blow", grid.error_texts(texts, len(counts)), {"long_name": "error text of a failed blow"})
    return xarray.Dataset(data)


def write_spread(folder: Path, found: Spread, picture: str = "png") -> list[str]:
    """Write spread.json, spread.nc, spread.csv and spread.png, or another format; return the names.

    A spread of more than `maps.MOST_ROWS` blows gets no CSV file: it would be slow to write and useless.
    """
    names = ["spread.json", "spread.nc"]
    export.write_json(folder / names[0], {**found.data(), "versions": export.versions()})
    found.table.to_netcdf(folder / names[1], engine="scipy")
    if found.n_blows <= MOST_ROWS:
        names.append("spread.csv")
        found.table.to_dataframe().to_csv(folder / "spread.csv")
    if len(found.own):
        names.append(f"spread.{picture}")
        figures.save(folder / f"spread.{picture}", figures.spread(found))
    return names
