"""Blows of one scene with other hammers, contacts and strike points, fast enough to follow a hand."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from . import accuracy, atlas, maps, planner, threshold
from .contact import Contact
from .integrator import strike
from .mesh import Mesh
from .modal import Modes, SampledShapes
from .response import Response
from .scene import Scene

TOLERANCE = 1e-3  # [-] of the blows shown: finer than a picture
MAP_TOLERANCE = 1e-2  # [-] of those on the map, which only counts impacts
FIRST_LOOK = 30  # [-] modes found first, from which the number needed is estimated
MOST_MODES = 100  # [-] at most; the residual compliance stands for the rest, and the error is shown
CELLS = {False: 24, True: 10}  # [-] of the map along an axis; contacts with loss are struck one by one
SPANS = {"mass": 20.0, "stiffness": 1000.0, "speed": 10.0, "bending": 20.0}  # [-] a slider's end over the scene's value
EXPONENTS = (1.0, 3.0)  # [-] from a linear spring to a felt-covered head


@dataclass(frozen=True)
class Settings:
    """What one can turn: the hammer, the contact and the strike point."""

    mass: float  # [kg] of the striker
    stiffness: float  # [-] of the contact, over that which on a rigid wall lasts as long as the scene's
    exponent: float  # [-]
    speed: float  # [m/s]
    bending: float | None  # [Hz] first bending mode of a stick; None: another striker
    at: tuple[float, ...]  # [m]


@dataclass(frozen=True, eq=False)
class Picture:
    """How many impacts each hammer and contact gives at one strike point, and the threshold over them."""

    mass: np.ndarray  # (n,) [kg]
    stiffness: np.ndarray  # (n,) [-] as in `Settings`
    n_impacts: np.ndarray  # (n, n) by stiffness and mass; -1 where a blow failed
    threshold: np.ndarray  # (n,) [Hz] contact resonance above which the body, by the kinetic-energy criterion, stops it
    limit: np.ndarray  # (n,) [-] stiffness at which the contact resonates there; not a number where there is none


@dataclass(frozen=True, eq=False)
class Bench:
    """A struck body and everything that may strike it."""

    scene: Scene
    mesh: Mesh
    base: maps.Case

    @classmethod
    def of(cls, scene: Scene) -> "Bench":
        """The bench of a scene, with modes enough for the quickest blow on it where `MOST_MODES` reach."""
        plan = scene.plan(target="modal", n_modes=FIRST_LOOK)
        first = planner.target(plan, planner.Stages())
        at = np.atleast_1d(np.asarray(scene.blow.values["at"], float))
        case = maps.Case(first, scene.make_striker(), scene.make_contact(), at, float(scene.blow.values["speed"]))
        bench = cls(scene, scene.body(), case)
        hard = replace(bench.start, stiffness=SPANS["stiffness"] ** 0.5, mass=bench.start.mass / SPANS["mass"] ** 0.5)
        needed = atlas.number_of_modes(first, atlas.needed_frequency(bench.case(hard), TOLERANCE))
        if needed <= first.n_modes:
            return bench
        more = planner.target(plan.but(n_modes=min(needed, MOST_MODES)), planner.Stages())
        return replace(bench, base=replace(case, modes=more))

    @cached_property
    def start(self) -> Settings:
        """The scene as it stands."""
        striker, law = self.base.striker, self.base.contact
        flexible = striker.modes.frequencies[striker.modes.omega > 0.0]
        bending = float(flexible[0]) if self.scene.striker.kind == "stick" else None
        return Settings(striker.mass, 1.0, law.exponent, self.base.speed, bending, tuple(self.base.at.tolist()))

    def range(self, name: str) -> tuple[float, float]:
        """Ends of a slider."""
        if name == "exponent":
            return min(EXPONENTS[0], self.start.exponent), max(EXPONENTS[1], self.start.exponent)
        value = getattr(self.start, name)
        return value / SPANS[name], value * SPANS[name]

    def law(self, settings: Settings) -> Contact:
        """The contact law of settings."""
        start, law = self.start, self.base.contact
        wanted = accuracy.contact_duration(
            Contact(law.stiffness, law.exponent), self.base.striker.felt_mass, start.speed
        )
        unit = accuracy.contact_duration(Contact(1.0, settings.exponent), self.base.striker.felt_mass, start.speed)
        same = (unit / wanted) ** (settings.exponent + 1.0)  # durations fall with the power 1 / (exponent + 1)
        return replace(law, stiffness=settings.stiffness * same, exponent=settings.exponent)

    def case(self, settings: Settings, rest: float | None = None) -> maps.Case:
        """What `strike` is called with; ValueError where the strike point is not on the body.

        ``rest`` [m/N] is taken for the residual compliance at the strike point where the true one, a static solution,
        would take too long for a moving hand.
        """
        case = replace(self.base.changed("mass", settings.mass), contact=self.law(settings))
        if settings.bending is not None:
            case = case.changed("striker_frequency", settings.bending)
        if rest is not None:
            case = replace(case, modes=self._sampled(settings.at, rest))
        return case.changed("speed", settings.speed).changed("at", settings.at)

    def _sampled(self, at: tuple[float, ...], rest: float) -> Modes:
        modes, point = self.base.modes, np.array([at])
        static = modes.modal_compliance(point) + rest
        return replace(modes, shapes=SampledShapes(point, modes.shape_at(point), static))

    def residual(self, settings: Settings) -> float:
        """The residual compliance [m/N] at the strike point."""
        return float(self.base.modes.residual_compliance([settings.at])[0, 0])

    def picture(self, settings: Settings) -> Picture:
        """The map behind the settings: every mass and stiffness the sliders reach."""
        case = self.case(settings)
        count = CELLS[case.contact.loss > 0.0]
        mass, stiffness = (np.geomspace(*self.range(name), count) for name in ("mass", "stiffness"))
        over = {"stiffness": stiffness * case.contact.stiffness / settings.stiffness, "mass": mass}
        table = maps.sweep(
            case.modes, case.striker, case.contact, at=case.at, speed=case.speed, over=over, tolerance=MAP_TOLERANCE,
            workers=1,
        )  # fmt: skip
        there = [self.case(replace(settings, mass=float(value), stiffness=1.0)) for value in mass]
        found = np.array([limit_of(one) for one in there])
        ratio = found / np.array([resonance_of(one) for one in there])
        ratio[~((ratio > 0.0) & (ratio < math.inf))] = math.nan
        # the resonance rises with the power 1 / (exponent + 1) of the stiffness
        return Picture(mass, stiffness, np.asarray(table.n_impacts), found, ratio ** (settings.exponent + 1.0))

    def place(self, x: float, y: float) -> tuple[float, ...] | None:
        """The strike point under a click; None beside the body."""
        point = (x, y)[: self.base.modes.dimension]
        try:
            return tuple(self.base.modes.points("at", point)[0].tolist())
        except ValueError:
            return None


def blow(case: maps.Case) -> Response:
    """The blow of a case; SimulationError where it cannot be followed."""
    return strike(case.modes, case.striker, case.contact, at=case.at, speed=case.speed, tolerance=TOLERANCE)


def resonance_of(case: maps.Case) -> float:
    """Half the reciprocal of the contact time on a rigid wall [Hz]."""
    law = Contact(case.contact.stiffness, case.contact.exponent)
    return 0.5 / accuracy.contact_duration(law, case.striker.felt_mass, case.speed)


def limit_of(case: maps.Case) -> float:
    """Contact resonance [Hz] above which the body stops the striker; zero or infinite where there is none."""
    found = threshold.threshold_frequency(case.modes, case.at, case.striker.felt_mass)
    return 0.0 if found is None else found


def spectrum(hit: Response, frequencies: np.ndarray) -> np.ndarray:
    """Size of a blow's force spectrum [N s], by the trapezoidal rule: three times as fast as the exact one."""
    weights = np.zeros(len(hit.time))
    weights[1:] = 0.5 * np.diff(hit.time)
    weights[:-1] += 0.5 * np.diff(hit.time)
    used = hit.force > 0.0
    turns = np.exp(-2j * np.pi * np.outer(frequencies, hit.time[used]))  # (n_frequencies, n_times)
    return np.abs(turns @ (weights * hit.force)[used])
