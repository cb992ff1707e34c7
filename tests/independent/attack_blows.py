"""Random blows meant to break a promise: what is struck, what it truly comes to, and what the package says of it.

Each area is a family of blows with its number as seed; the truths can be kept in a folder, as they cost more than the
blows and do not depend on the package's engine. ``studies/attack.py`` runs as many as wanted, the tests beside this
file a share.
"""

import json
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import references_blows as reference

import fem_impact as fi

SURE = 0.1  # [-] of the tolerance that the reference may err by; a blow where it may err by more is not judged
SHARP = 0.5  # [-] of the difference found that it may err by for the true error to be known, to a factor of two
TOLERANCES = 1e-1, 1e-2, 1e-3, 1e-4, 1e-5
OFFSETS = 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 5e-2  # [-] of stiffness from where the number of impacts changes
MOST_IMPACTS = 12  # [-] beyond, digits are lost to the growth of small differences
FEW_IMPACTS = 4  # [-] on the richer side of a threshold that is sought
SCANNED = 14  # [-] stiffnesses tried for a change of the number of impacts
HALVINGS = 34  # [-] of the interval, each a seventh of a decade, in which it is sought
CELLS = 10  # [-] values on either axis of a map
CELLS_JUDGED = 30  # [-] of one map
EDGES = ("hinged", "hinged"), ("hinged", "free"), ("clamped", "free"), ("clamped", "clamped"), ("free", "free")


@dataclass(frozen=True)
class Blow:
    """A rigid mass on the modes of a closed form, and nothing beyond them, or on a body of which all modes count."""

    body: tuple  # name and arguments of `modes_of`
    mass: float
    law: reference.Law
    at: tuple
    speed: float
    whole: bool = False  # the modes stand for the complete body
    elements: bool = False  # struck as a body of finite elements, truth by closed form


@dataclass(frozen=True)
class Verdict:
    """What a blow came to: a row of the study's table."""

    area: str
    number: int
    place: str  # of the blow among those of its number
    kind: str  # "kept", "silent miss", "loud", "failed", "unsure" or "endless": the last two are not judged
    tolerance: float
    truth: float = np.nan  # error of the answer
    claim: float = np.nan
    floor: float = np.nan  # error of the reference
    impacts: int = 0  # told
    impacts_truly: int = 0
    met: bool = False
    margin: float = np.nan  # told, if the response has one
    blow: str = ""

    @property
    def judged(self) -> bool:
        """Whether the reference was sure enough."""
        return self.kind not in ("unsure", "endless")

    @property
    def caution(self) -> float:
        """The error claimed over the true one; NaN where the reference is not sharp enough to know that."""
        return self.claim / self.truth if self.floor <= SHARP * self.truth else np.nan

    @property
    def miscounted(self) -> bool:
        """A wrong number of impacts without a word."""
        return self.judged and self.met and self.impacts != self.impacts_truly


# --- bodies, laws ----------------------------------------------------------------------------------------------------


@cache
def modes_of(kind: str, *numbers: Any) -> fi.Modes:
    """Closed forms of 0.2 kg and 100 Hz: "rectangle" by sides, "beam" of 1 m by ends; number of modes, damping."""
    *shape, n_modes, zeta = numbers
    options = {"mass": 0.2, "first_frequency": 100.0, "n_modes": n_modes, "damping_ratio": zeta}
    if kind == "rectangle":
        return fi.analytic.rectangle(*shape, **options)
    return fi.analytic.beam(1.0, ends=tuple(shape), **options)


def contact(law: reference.Law) -> fi.Contact:
    """The package's contact of a law."""
    if law.hard:
        hard = {"depth": law.depth, "hard_stiffness": law.hard, "hard_exponent": law.hard_exponent}
        return fi.Contact.layers(law.stiffness, law.exponent, loss=law.loss, **hard)
    return fi.Contact(law.stiffness, law.exponent, law.loss)


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm to base ten is uniform."""
    return float(10.0 ** rng.uniform(low, high))


def random_body(rng: np.random.Generator) -> tuple[tuple, tuple]:
    """A hinged rectangle or, less often, a beam; and a point of it."""
    n_modes, zeta = int(rng.choice([30, 60, 120, 200, 300])), float(rng.choice([0.0, 0.005, rng.uniform(0.0, 0.03)]))
    if rng.uniform() < 0.75:
        a, b = float(rng.choice([1.0, rng.uniform(0.5, 1.0)])), float(rng.uniform(0.5, 1.0))
        return ("rectangle", a, b, n_modes, zeta), (a * rng.uniform(0.03, 0.97), b * rng.uniform(0.03, 0.97))
    ends = EDGES[rng.integers(len(EDGES))]
    return ("beam", *ends, min(n_modes, 60), zeta), (float(rng.uniform(0.05, 0.95)),)


def random_law(rng: np.random.Generator, mass: float, speed: float, *, steep: bool) -> reference.Law:
    """A power law, plain unless ``steep``, that gives the mass a random time on a wall; perhaps lossy or of layers."""
    exponent = float(rng.uniform(1.0, 3.0)) if steep else float(rng.choice([1.0, 1.5, rng.uniform(1.0, 3.0)]))
    time = 0.005 / log_uniform(rng, -0.5, 1.2)  # [s] on a wall: 1.6 to 0.03 of a period of the first mode
    law = reference.Law(1.0, exponent)
    law = replace(law, stiffness=float((law.duration(mass, speed) / time) ** (exponent + 1.0)))
    if rng.uniform() < (0.5 if steep else 0.1):  # the soft layer bottoms at 0.2 to 0.9 of its depth on a wall
        p1 = exponent + 1.0
        deepest = (0.5 * p1 * mass * speed**2 / law.stiffness) ** (1.0 / p1)
        depth = float(deepest * rng.uniform(0.2, 0.9))
        hard_exponent = float(rng.choice([1.5, 1.0, 2.0], p=[0.8, 0.1, 0.1]))
        hard = law.stiffness * deepest**exponent / deepest**hard_exponent * log_uniform(rng, 0.0, 1.7)
        law = replace(law, depth=depth, hard=float(hard), hard_exponent=hard_exponent)
    if rng.uniform() < 0.15:
        law = replace(law, loss=log_uniform(rng, -2.0, -0.5) / speed)
    return law


# --- truths ----------------------------------------------------------------------------------------------------------


class Truths:
    """Outcomes of the reference by name, kept in a folder if there is one: a line of JSON each."""

    def __init__(self, folder: Path | None = None):
        self.folder, self.known = folder, {}
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            for path in sorted(folder.glob("*.jsonl")):
                self.known |= dict(json.loads(line) for line in path.read_text().splitlines())

    def get(self, area: str, name: str, find: Callable[[], Any]) -> Any:
        """What was found under this name, or is found now."""
        key = f"{area} {name}"
        if key not in self.known:
            self.known[key] = find()
            if self.folder is not None:
                with (self.folder / f"{area}.jsonl").open("a") as file:
                    file.write(json.dumps([key, self.known[key]]) + "\n")
        return self.known[key]

    def of(self, area: str, name: str, blow: Blow) -> tuple[reference.Outcome, float]:
        """The outcome of a blow, and the reference's own error."""

        def find() -> list:
            outcome, floor = truth(blow)
            return [[getattr(outcome, each.name) for each in fields(outcome)], floor]

        numbers, floor = self.get(area, name, find)
        return reference.Outcome(*numbers), floor


def truth(blow: Blow) -> tuple[reference.Outcome, float]:
    """The outcome by the reference, and its own error."""
    if not (blow.whole or blow.elements):
        run = partial(reference.on_modes, modes_of(*blow.body), blow.mass, blow.law, blow.at, blow.speed)
        return reference.sure(lambda finer: run(finer=finer, most=MOST_IMPACTS))
    kind, *numbers, _, zeta = blow.body

    def target(finer: int) -> reference.Part:
        if kind == "rectangle":
            a, b = numbers
            rate = 200.0 * np.pi / (np.pi**2 * (a**-2 + b**-2))
            return reference.rectangle(a, b, blow.at, 0.2, rate, zeta, finer)
        if kind == "beam":
            return reference.beam(1.0, tuple(numbers), blow.at[0], 0.2, 100.0, zeta, finer)
        radius, thickness, E, nu, rho, edge = numbers
        rate = np.sqrt(E * thickness**2 / (12.0 * rho * (1.0 - nu**2)))
        mass = np.pi * radius**2 * thickness * rho
        return reference.disk(radius, edge, nu, blow.at, mass, rate, zeta, finer)

    def striker(finer: int) -> reference.Part:
        return reference.Part(np.zeros(1), np.array([1.0 / blow.mass]), 0.0)

    return reference.reference(striker, target, blow.law, blow.speed, most=MOST_IMPACTS)


# --- answers ---------------------------------------------------------------------------------------------------------


def strike(blow: Blow, tolerance: float, **options: Any) -> fi.Response:
    """The package's answer."""
    if blow.elements:
        _, radius, thickness, E, nu, rho, edge, _, zeta = blow.body
        plate = fi.Plate(fi.Material(E=E, nu=nu, rho=rho), thickness)
        body = fi.assemble(fi.mesh.disk(radius), plate, supports={"outer": edge})
        options["damping_ratio"] = zeta
    else:
        body = modes_of(*blow.body)
        options["residual"] = blow.whole
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        return fi.strike(
            body, fi.Striker.rigid(blow.mass), contact(blow.law), at=blow.at, speed=blow.speed, tolerance=tolerance,
            **options,
        )  # fmt: skip


def verdict(
    area: str, number: int, place: str, blow: Blow, tolerance: float, truths: Truths, answer: Callable[[], Any] | None
) -> Verdict:
    """Judge an answer: what `strike` says or, of a map's cell, what the given function returns of it."""
    true, floor = truths.of(area, f"{number} {place.split(' at ')[0]}", blow)
    found = Verdict(area, number, place, "endless", tolerance, floor=floor, blow=str(blow))
    if true.status != reference.DONE:
        return found
    found = replace(found, impacts_truly=true.n_impacts)
    if not floor <= SURE * tolerance:
        return replace(found, kind="unsure")
    try:
        hit = answer() if answer else strike(blow, tolerance)
    except (fi.SimulationError, ValueError) as error:
        return replace(found, kind="failed", blow=f"{blow} {error}")
    met, claim = bool(hit.tolerance_met), float(getattr(hit.error, "total", hit.error))
    told = reference.Outcome(0, hit.restitution, hit.impulse, hit.contact_time, hit.peak_force, int(hit.n_impacts))
    off = true.difference(told)
    kind = "loud" if not met else "kept" if off <= tolerance + floor else "silent miss"
    margin = float(getattr(hit, "margin", np.nan))
    return replace(found, kind=kind, truth=off, claim=claim, impacts=told.n_impacts, met=met, margin=margin)


# --- areas -----------------------------------------------------------------------------------------------------------


def random_blow(seed: int, number: int, *, steep: bool = False, whole: bool = False) -> tuple[Blow, float]:
    """A blow on modes and its tolerance."""
    rng = np.random.default_rng([seed, 10 * steep + whole, number])
    body, at = random_body(rng)
    mass, speed = log_uniform(rng, -2.3, 0.0), float(rng.choice([1.0, log_uniform(rng, -1.0, 1.0)]))
    law = random_law(rng, mass, speed, steep=steep)
    tolerance = log_uniform(rng, -4.0 if whole else -5.0, -1.0)
    if whole:  # as many as a tolerance may need
        body = (*body[:-2], 2000 if body[0] == "rectangle" else 100, body[-1])
    return Blow(body, mass, law, tuple(map(float, at)), speed, whole), tolerance


def single(area: str, number: int, truths: Truths, *, seed: int = 1, **how: bool) -> Iterator[Verdict]:
    """One random blow on modes."""
    blow, tolerance = random_blow(seed, number, **how)
    yield verdict(area, number, "", blow, tolerance, truths, None)


def threshold(seed: int, number: int) -> tuple[Blow, bool]:
    """A blow of a stiffness at which the number of impacts changes, and whether there is one in what was scanned."""
    rng = np.random.default_rng([seed, 100, number])
    body, at = random_body(rng)
    mass, speed = log_uniform(rng, -2.0, 0.0), float(rng.choice([1.0, log_uniform(rng, -1.0, 1.0)]))
    law = random_law(rng, mass, speed, steep=False)
    law = replace(law, hard=0.0, depth=0.0)
    blow = Blow(body, mass, law, tuple(map(float, at)), speed)
    run = partial(reference.on_modes, modes_of(*body), mass, at=at, speed=speed)
    p1 = law.exponent + 1.0

    def count(stiffness: float) -> int:
        found = run(law=replace(law, stiffness=stiffness), most=FEW_IMPACTS, finer=0)
        return found.n_impacts if found.status == reference.DONE else 0

    # contacts of 1 to a twentieth of a period of the first mode
    soft = (law.duration(mass, speed) / 0.01) ** p1 * law.stiffness
    stiffnesses = soft * 20.0 ** (p1 * np.linspace(0.0, 1.0, SCANNED))
    counts = [count(float(stiffness)) for stiffness in stiffnesses]
    changes = [i for i in range(SCANNED - 1) if counts[i] and counts[i + 1] and counts[i] != counts[i + 1]]
    if not changes:
        return blow, False
    i = int(rng.choice(changes))
    low, high = np.log(stiffnesses[i : i + 2])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if count(float(np.exp(middle))) == counts[i] else (low, middle)
    return replace(blow, law=replace(law, stiffness=float(np.exp(0.5 * (low + high))))), True


def beside(area: str, number: int, truths: Truths, *, seed: int = 1) -> Iterator[Verdict]:
    """Blows on both sides of a stiffness where the number of impacts changes, at every tolerance."""

    def find() -> list:
        blow, there = threshold(seed, number)
        return [blow.law.stiffness, there]

    stiffness, there = truths.get(area, f"{number} threshold", find)
    if not there:
        return
    rng = np.random.default_rng([seed, 100, number])  # as in `threshold`
    body, at = random_body(rng)
    mass, speed = log_uniform(rng, -2.0, 0.0), float(rng.choice([1.0, log_uniform(rng, -1.0, 1.0)]))
    law = replace(random_law(rng, mass, speed, steep=False), hard=0.0, depth=0.0)
    for offset in (-np.array(OFFSETS[::-1])).tolist() + list(OFFSETS):
        moved = replace(law, stiffness=stiffness * (1.0 + offset))
        blow = Blow(body, mass, moved, tuple(map(float, at)), speed)
        for tolerance in TOLERANCES:
            yield verdict(area, number, f"{offset:+.0e} at {tolerance:.0e}", blow, tolerance, truths, None)


def cells(area: str, number: int, truths: Truths, *, seed: int = 1) -> Iterator[Verdict]:
    """Some cells of a map of mass and stiffness or speed; each where it is wrong is struck alone, too."""
    rng = np.random.default_rng([seed, 200, number])
    body, at = random_body(rng)
    at = tuple(map(float, at))
    law = random_law(rng, 0.05, 1.0, steep=False)
    second = str(rng.choice(["stiffness", "speed"]))
    spread = 1.5 if second == "stiffness" else 0.7
    centre = law.stiffness if second == "stiffness" else 1.0
    over = {"mass": np.geomspace(0.005, 0.7, CELLS), second: centre * np.geomspace(10**-spread, 10**spread, CELLS)}
    tolerance = float(rng.choice([1e-1, 1e-2, 1e-3, 1e-4]))
    chosen = rng.choice(CELLS**2, CELLS_JUDGED, replace=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        table = fi.sweep(
            modes_of(*body), fi.Striker.rigid(0.1), contact(law), at=at, speed=1.0, over=over, tolerance=tolerance,
            residual=False, workers=1,
        )  # fmt: skip
    for index in chosen.tolist():
        i, j = divmod(index, CELLS)
        cell = table.isel(mass=i, **{second: j})
        values = {name: cell[name].item() for name in cell.data_vars}
        there = {"law": replace(law, stiffness=float(over[second][j]))} if second == "stiffness" else {}
        speed = float(over[second][j]) if second == "speed" else 1.0
        blow = Blow(body, float(over["mass"][i]), there.get("law", law), at, speed)
        yield verdict(area, number, f"{i},{j}", blow, tolerance, truths, lambda values=values: Cell(values))


class Cell:
    """A cell of a map, by the names of a response."""

    def __init__(self, values: dict[str, Any]):
        if values["failure"]:
            raise fi.SimulationError(values["failure"])
        self.__dict__.update(values)


def by_elements(area: str, number: int, truths: Truths, *, seed: int = 1) -> Iterator[Verdict]:
    """A disk of finite elements struck near its edge, against the closed form."""
    rng = np.random.default_rng([seed, 300, number])
    radius, thickness = log_uniform(rng, -1.0, -0.2), log_uniform(rng, -2.4, -1.6)
    E, nu, rho = log_uniform(rng, 9.3, 11.3), float(rng.choice([0.0, 0.2, 0.3, 0.38])), log_uniform(rng, 2.8, 3.9)
    edge = str(rng.choice(["clamped", "hinged"], p=[0.8, 0.2]))
    thickness *= radius
    period = 2.0 * np.pi * radius**2 / (10.0 * np.sqrt(E * thickness**2 / (12.0 * rho * (1.0 - nu**2))))
    angle, r = rng.uniform(0.0, 2.0 * np.pi), radius * (1.0 - log_uniform(rng, -1.7, -0.5))
    mass, speed = np.pi * radius**2 * thickness * rho * log_uniform(rng, -2.0, 0.0), log_uniform(rng, -1.0, 1.0)
    law = reference.Law(1.0, float(rng.choice([1.0, 1.5])))
    time = period / log_uniform(rng, -0.2, 0.8)
    law = replace(law, stiffness=float((law.duration(mass, speed) / time) ** (law.exponent + 1.0)))
    at = (float(r * np.cos(angle)), float(r * np.sin(angle)))
    body = ("disk", radius, thickness, E, nu, rho, edge, 0, float(rng.choice([0.0, 0.01])))
    blow = Blow(body, float(mass), law, at, speed, elements=True)
    yield verdict(area, number, "", blow, log_uniform(rng, -3.0, -1.0), truths, None)


AREAS: dict[str, Callable[..., Iterator[Verdict]]] = {
    "everyday": single,
    "layers and steep laws": partial(single, steep=True),
    "complete bodies": partial(single, whole=True),
    "beside thresholds": beside,
    "cells of maps": cells,
    "disks by elements": by_elements,
}


def attack(area: str, number: int, truths: Truths, **options: Any) -> Iterator[Verdict]:
    """All blows of a number."""
    return AREAS[area](area, number, truths, **options)


def table(verdicts: list[Verdict]) -> str:
    """What came out, by area, and every promise broken."""
    lines = [
        "| area | blows | silent misses | wrong count, met | worst truth/claim | loud | failed | not judged | "
        "claim/truth: 5, 50, 95 % | of so many |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for area in dict.fromkeys(each.area for each in verdicts):
        lines.append(_row(area, [each for each in verdicts if each.area == area]))
    wrong = [each for each in verdicts if each.kind in ("silent miss", "failed") or each.miscounted]
    return "\n".join([*lines, "", *(_sentence(each) for each in wrong)])


def _row(area: str, verdicts: list[Verdict]) -> str:
    judged = [each for each in verdicts if each.judged]
    met = [each for each in judged if each.met]
    kinds = [each.kind for each in judged]
    worst = max([(each.truth - each.floor) / each.claim for each in met], default=np.nan)
    known = [each.caution for each in met if np.isfinite(each.caution)]
    shares = " ".join(f"{x:.2g}" for x in np.percentile(known, [5, 50, 95])) if known else "-"
    miscounted = sum(each.miscounted for each in judged)
    numbers = kinds.count("silent miss"), miscounted, f"{worst:.2g}", kinds.count("loud"), kinds.count("failed")
    row = area, len(judged), *numbers, len(verdicts) - len(judged), shares, len(known)
    return f"| {' | '.join(map(str, row))} |"


def _sentence(each: Verdict) -> str:
    return (
        f"{each.kind}: {each.area} {each.number} {each.place}, tolerance {each.tolerance:.1e}: truth {each.truth:.2e}, "
        f"claim {each.claim:.2e}, margin {each.margin:.1e}, {each.impacts} impacts, truly {each.impacts_truly}: "
        f"{each.blow}"
    )
