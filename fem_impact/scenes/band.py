"""A blow as well as its inputs are known: beside the errors of computation and model, what the inputs leave open."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from .._base import check, markup, progress
from ..impact import promise
from ..impact.measured import ENDS, Comparison, of_blow
from ..impact.response import Response
from ..model.asked import PIECES
from ..model.planner import Run
from ..sweeps.inputs import drawn_inputs, read_inputs, shares
from .maps import changed_scene
from .scene import Scene, load_scene
from .uncertainty import MOST_BLOWS, spread

BLOWS = 1024  # [-] where one body serves all blows: the ends of a band are then good to a tenth of its width
ANEW = 48  # [-] where each blow needs a body of its own: two of them lie beyond each end
NAMES = {name: name for name in ("n_impacts", "contact_time", "restitution", "impulse")} | {"force": "peak_force"}


@dataclass(frozen=True)
class Quantity:
    """One quantity of a blow and how well it is known."""

    name: str
    value: float  # in SI units, with the values of the scene
    computation: float | None  # [-] estimated error, as in `Response.trust`
    model: float  # [-] as far as it is known
    unknown: tuple[str, ...]  # assumptions whose effect is not known and may matter
    low: float  # what the inputs leave open: nine tenths of all blows lie between low and high
    high: float
    mostly: str  # the input it depends on most, "" if on none by itself

    @property
    def ends(self) -> tuple[float, float]:
        """Low and high, further apart by the errors of the computation and, where it is known, of the model."""
        size = 1.0 if self.name == "restitution" else abs(self.value)
        error = size * ((self.computation or 0.0) + self.model)
        return self.low - error, self.high + error


@dataclass(frozen=True, eq=False, repr=False)
class Band(check.Brief):
    """A blow as well as its inputs are known; from `fem_impact.band`."""

    hit: Response  # with the values of the scene
    inputs: Mapping[str, str]  # name -> distribution
    values: Mapping[str, np.ndarray]  # inputs and quantities of the blows drawn at random, (n_blows,)
    failed: int  # blows without a result
    anew: bool  # whether every blow had a body of its own

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """Every quantity that the scene asks for, but sound and spectra."""
        found = []
        for each in self.hit.trust:
            name = NAMES.get(each.quantity)
            values = self.values.get(name or "", np.empty(0))
            ended = np.isfinite(values)  # there is no restitution of a blow that ends in contact
            if name is None or each.value is None or not ended.any():
                continue
            low, high = np.quantile(values[ended], ENDS).tolist()
            mostly = ""
            if np.ptp(values[ended]) > 0.0:
                ranks = {key: stats.spearmanr(self.values[key][ended], values[ended])[0] for key in self.inputs}
                best = max(ranks, key=lambda key: float(ranks[key] ** 2))
                mostly = best if ranks[best] ** 2 > 1.0 / ended.sum() ** 0.5 else ""
            known = name, each.value, each.computation, each.known, each.unknown
            found.append(Quantity(*known, low, high, mostly))
        return tuple(found)

    def __getitem__(self, name: str) -> Quantity:
        found = {each.name: each for each in self.quantities}
        return found[check.one_of("quantity", name, found)]

    def against(self, measured: Any) -> Comparison:
        """Measured quantities beside their bands, as of `Response.against`, which here hold what the inputs leave open,
        too."""
        values = {quantity: self.values[name] for quantity, name in NAMES.items()}
        return of_blow(self.hit.trust, measured, values)

    def summary(self) -> str:
        """The quantities in a table, and the inputs."""
        rows = [
            (
                each.name, f"{each.value:.4g}", "not known" if each.computation is None else f"{each.computation:.1g}",
                f"{each.model:.1g}{' and what is not known' if each.unknown else ''}",
                f"{each.low:.4g} to {each.high:.4g}", each.mostly,
            )
            for each in self.quantities
        ]  # fmt: skip
        head = "quantity", "value", "computation errs by", "model errs by", "inputs leave open", "mostly by"
        lines = markup.columns(rows, head)
        lines += [f"{name}: {said}" for name, said in self.inputs.items()]
        count = len(next(iter(self.values.values())))
        how = ", each with a body of its own" if self.anew else ""
        lost = f", {self.failed} more failed" if self.failed else ""
        return "\n".join([*lines, f"Nine tenths of {count} blows lie within what the inputs leave open{how}{lost}."])

    def data(self) -> dict[str, Any]:
        """The quantities and inputs as plain data."""
        return {
            "inputs": dict(self.inputs), "blows": len(next(iter(self.values.values()))), "failed": self.failed,
            "quantities": {each.name: vars(each) | {"ends": list(each.ends)} for each in self.quantities},
        }  # fmt: skip


@check.typed
def band(scene: Scene | str | Path, *, n: int | None = None, seed: int = 0, **changes: Any) -> Band:
    """Strike a scene as well as its inputs are known.

    Parameters
    ----------
    scene : Scene or path of a scene file
        At least one of its numbers is written as ``{ value = 70e9, about = 0.03 }``, which nine tenths of all values
        lie within (lognormal), or as ``{ value = 70e9, low = 68e9, high = 72e9 }`` (uniform).
    n : int, optional
        Number of blows drawn at random: by default 1024 where one body serves all of them, as in `spread`, and 48 where
        every blow needs a body of its own.
    seed : int
        Of the random numbers.
    **changes
        As in `Scene.strike`: ``tolerance``, ``quantity``, ...

    Returns
    -------
    Band

    Raises
    ------
    ValueError
        If no number of the scene has an interval, or one reaches values that are not allowed.

    Examples
    --------
    >>> known = fi.load_scene("studies/scenes/ball_as_known.toml")
    >>> found = fi.band(known, n=256)
    >>> found["contact_time"].low < found.hit.contact_time < found["contact_time"].high
    True
    """
    known = scene if isinstance(scene, Scene) else load_scene(scene)
    check_known(known)
    strict = changes.pop("strict", False)
    run = known.run(**changes)
    promise.warn_if_missed(run.response, strict)
    return band_around(known, run, n=n, seed=seed)


def check_known(scene: Scene) -> None:
    """ValueError unless the scene is a single blow and says of at least one number how well it is known."""
    scene.check_single()
    if not scene.known:
        raise scene.fault(
            "no number says how well it is known; write one as { value = 70e9, about = 0.03 } or { value, low, high }"
        )


def band_around(scene: Scene, run: Run, *, n: int | None = None, seed: int = 0) -> Band:
    """The band around a blow of a scene; where inputs need another body, with a scene of its own for each blow.

    Its blows differ from the scene as the one of ``run`` does.
    """
    count, seed = (None if n is None else check.count("n", n, high=MOST_BLOWS)), check.count("seed", seed, low=0)
    hit = run.response
    pieces = {**run.plan.changes, "tolerance": hit.tolerance}
    for name in set(pieces) - {*PIECES, "tolerance", "quantity"} | {"model"} & set(pieces):
        key = f"{'target' if name in ('model', 'stretching') else 'strike'}.{name}"
        scene = changed_scene(scene, key, pieces.pop(name))
        scene = replace(scene, known={other: how for other, how in scene.known.items() if other != key})
    check_known(scene)
    inputs = read_inputs(scene.known)
    said = {each.name: each.said for each in inputs}
    found = None
    if not set(PIECES) & set(pieces):  # which say how the body of one blow is described
        # an input may need a body of its own; a wrong one is refused by the scenes below
        with suppress(ValueError):
            found = spread(scene, scene.known, n=count or BLOWS, sobol=False, seed=seed, tolerance=hit.tolerance)
    if found is not None and max(found.rescaled.values(), default=0.0) <= hit.tolerance:
        values = {name: found.values(name) for name in (*said, *NAMES.values())}
        return Band(hit, said, values, found.n_failed, anew=False)
    n, rows, failed = count or ANEW, [], 0
    for done, row in enumerate(drawn_inputs(inputs, shares(n, len(inputs), seed), None)):
        given = {each.name: float(value) for each, value in zip(inputs, row)}
        try:
            one = scene.changed(given).strike(**pieces)
            numbers = np.array([getattr(one, name) for name in NAMES.values()], float)  # None becomes NaN
            rows.append(given | dict(zip(NAMES.values(), numbers.tolist())))
        except check.SimulationError:
            failed += 1
        progress.report("blows", done + 1, n)
    if not rows:
        raise check.SimulationError("no blow succeeded, so nothing has a band; narrow the intervals")
    values = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return Band(hit, said, values, failed, anew=True)
