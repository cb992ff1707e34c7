"""Strikes one scene with other hammers, contacts and strike points, fast enough to follow a slider."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .._base.rounding import SAME
from ..fe import refinement
from ..impact import accuracy, threshold
from ..impact.contact import Contact
from ..impact.engine import TOLERANCE
from ..impact.response import Response
from ..mesh.meshes import Mesh
from ..model import vectors
from ..model.target import Stages
from ..modes.modal import Modes
from ..modes.shapes import SampledShapes
from ..scenes.scene import Scene
from ..scenes.schema import PATHS
from ..scenes.whole import for_many
from ..sweeps import bodies, grid

MAP_TOLERANCE = 1e-2  # [-] of the blows on the map, which only counts impacts, and of vectors: seconds for each point
FIRST_LOOK = 30  # [-] modes found first, to estimate the number needed
SPANS = {  # [-] slider end over the scene's value
    "thickness": 2.0, "mass": 20.0, "stiffness": 1000.0, "speed": 10.0, "bending": 20.0
}  # fmt: skip
SIZES = "thickness", "height"  # of a section
WEIGHTS = {  # keys of a striker that grow with its mass where its frequencies stay, by kind
    "rigid": {"mass"}, "sphere": {"rho"}, "stick": {"mass"}, "hammer": {"head", "handle", "stiffness", "damping"},
    "turning": {"mass", "inertia"}, "bar": {"E", "rho"},
}  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """What the sliders set: the hammer, the contact and the strike point."""

    mass: float  # [kg] of the striker
    stiffness: float  # [-] 1 gives the scene's contact time on a rigid wall
    exponent: float  # [-]
    speed: float  # [m/s]
    bending: float | None  # [Hz] first bending mode of a stick; None for other strikers
    at: tuple[float, ...]  # [m]
    damping: float = 0.0  # [-] damping ratio of the struck body
    loss: float | None = 0.0  # [s/m] of the contact; None for one that yields or is felt
    thickness: float = 1.0  # [-] of the struck body, over the scene's


@dataclass(frozen=True, eq=False)
class Setup:
    """A struck body with the hammers and contacts of the sliders."""

    scene: Scene
    mesh: Mesh
    base: grid.Case
    loose: bool = False  # whether the files of the scene vanish with the server, so that saved scenes name no folder

    @classmethod
    def of(cls, scene: Scene, loose: bool = False, before: "Setup | None" = None) -> "Setup":
        """The setup of a scene, with enough modes for its shortest blow, but at most a hundred.

        ValueError if it has several strokes, or forces, which the page does not follow.

        If vectors can represent the body, the first few modes suffice: they bridge the seconds until the vectors of a
        new strike point are found. ``before`` is a setup of the same body, whose modes are taken as far as they reach.
        """
        plan, (scene, _) = None, for_many(scene)
        if before is not None and before.scene.target == scene.target:  # another mallet may require another model
            first, mesh = before.base.modes, before.mesh
        else:
            plan = scene.plan(target="modal", n_modes=FIRST_LOOK)
            first, mesh = plan.description.found(Stages())[1], scene.body()
        at = np.atleast_1d(np.asarray(scene.blow.values["at"], float))
        case = grid.Case(first, scene.make_striker(), scene.make_contact(), at, float(scene.blow.values["speed"]))
        setup = cls(scene, mesh, case, loose)
        if setup.by_vectors:
            return setup
        hard = replace(setup.start, stiffness=SPANS["stiffness"] ** 0.5, mass=setup.start.mass / SPANS["mass"] ** 0.5)
        limit = bodies.needed_frequency(setup.case(hard), setup.tolerance)
        needed = math.ceil(accuracy.number_of_modes(first, limit))
        if needed <= first.n_modes:
            return setup
        plan = plan or scene.plan(target="modal", n_modes=FIRST_LOOK)
        # the residual compliance replaces the rest, and the page shows the error
        _, more = plan.but(n_modes=min(needed, 100)).description.found(Stages())
        return replace(setup, base=replace(case, modes=more))

    @property
    def tolerance(self) -> float:
        """Largest error [-] accepted by the scene."""
        return float(self.scene.blow.values.get("tolerance", TOLERANCE))

    @cached_property
    def start(self) -> Settings:
        """The settings of the scene itself."""
        striker, law = self.base.striker, self.base.contact
        flexible = striker.modes.frequencies[striker.modes.omega > 0.0]
        bending = float(flexible[0]) if self.scene.striker.kind == "stick" else None
        damping = float(np.median(self.base.modes.damping_ratio))
        at, loss = tuple(self.base.at.tolist()), None if law.remembers else law.loss
        return Settings(striker.mass, 1.0, law.exponent, self.base.speed, bending, at, damping, loss)

    def range(self, name: str) -> tuple[float, float]:
        """Lowest and highest value of a slider."""
        if name == "exponent":
            # from a linear spring to a felt-covered head
            return min(1.0, self.start.exponent), max(3.0, self.start.exponent)
        if name == "damping":
            return 0.0, max(0.1, 2.0 * self.start.damping)
        if name == "loss":
            return 0.0, max(1.0 / self.start.speed, 2.0 * (self.start.loss or 0.0))
        value = getattr(self.start, name)
        return value / SPANS[name], value * SPANS[name]

    def law(self, settings: Settings) -> Contact:
        """The contact law for these settings; of two layers, stiffness and exponent are the soft one's."""
        law, hit = self.base.contact, (self.base.striker.felt_mass, self.start.speed)
        wanted = accuracy.contact_duration(Contact(law.stiffness, law.exponent), *hit)
        same = accuracy.lasting_stiffness(wanted, settings.exponent, *hit)
        return replace(law, stiffness=settings.stiffness * same, exponent=settings.exponent, loss=settings.loss or 0.0)

    def case(self, settings: Settings, rest: float | None = None, body: Modes | None = None) -> grid.Case:
        """The arguments of `strike`; raises ValueError if the strike point is not on the body.

        ``rest`` [m/N] replaces the residual compliance at the strike point: its static solution would take too long
        while a slider moves. ``body`` is that of `excited_at` this point, which replaces its modes.
        """
        case = replace(self.base.changed("mass", settings.mass), contact=self.law(settings))
        if settings.bending is not None:
            case = case.changed("striker_frequency", settings.bending)
        if body is not None:
            case = replace(case, modes=body)
        elif rest is not None:
            known, point = self.base.modes, np.array([settings.at])
            shapes = SampledShapes(point, known.shape_at(point), known.modal_compliance(point) + rest)
            case = replace(case, modes=replace(known, shapes=shapes))
        modes, ratio = case.modes, settings.thickness
        if ratio != 1.0:  # mass and all frequencies grow with the thickness, and damping may depend on these
            modes = self.scene.built.target.damped(modes.stretched(ratio, ratio))
        if settings.damping != self.start.damping:
            modes = modes.damped(settings.damping)
        case = replace(case, modes=modes)
        return case.changed("speed", settings.speed).changed("at", settings.at)

    @property
    def barred(self) -> set[str]:
        """Numbers that no slider can change: the page would show other blows than the scene that it saves."""
        target, table = self.scene.built.target, self.scene.section
        sizes = [1.0] if table is None else [table.values.get(key) for key in SIZES]
        known = any(isinstance(size, (int, float)) for size in sizes) and not getattr(target.section, "layers", ())
        alike = known and target.similar and not target.stretching
        return {name for name, bars in (("thickness", not alike), ("damping", target.air is not None)) if bars}

    @property
    def by_vectors(self) -> bool:
        """Whether Ritz vectors can represent the body, as far as is known without finding them."""
        return vectors.vectors_usable(self.scene.built.target)

    def excited_at(self, at: tuple[float, ...]) -> Modes | None:
        """The body as blows at a point excite it, by Ritz vectors; None if only modes can represent it.

        Made for blows between the softest and the hardest of the sliders, unless these ask for too fine a mesh.
        """
        target, start = self.scene.built.target, self.start
        if not self.by_vectors:
            return None
        point = self.base.modes.point("at", at)[0]
        case, unit = replace(self.base, at=point), self.base.contact.stiffness

        def harder(share: float) -> dict[str, float]:
            return {
                "mass": start.mass / SPANS["mass"] ** share, "stiffness": unit * SPANS["stiffness"] ** share,
                "speed": start.speed * SPANS["speed"] ** (share * (case.contact.exponent > 1.0)),
            }  # fmt: skip

        assert target.mesh is not None
        # of the sliders' logarithmic way to the hardest blow that vectors are made for
        for share in (1.0, 0.75, 0.5, 0.25, 0.0):
            hard = harder(share)
            size = vectors.size_for(target, case.with_values(hard).resonance, MAP_TOLERANCE)
            if refinement.unknowns(target.element, target.mesh, size) <= 10_000:  # besides those nearest to the blow
                masses = start.mass, start.mass * SPANS["mass"] ** (0.5 * share)
                heavier = [{**harder(part * share), "mass": mass} for part in (0.0, 0.5, 1.0) for mass in masses]
                sized = bodies.Sized(target, case, [hard, harder(-share)], heavier, MAP_TOLERANCE)
                views = sized.views(point[None], Stages())
                return None if views is None else next(iter(views.values()))
        return None

    def residual_at(self, at: tuple[float, ...]) -> float:
        """The residual compliance [m/N] at a strike point."""
        return float(self.base.modes.residual_compliance([at])[0, 0])

    def saved(self, settings: Settings) -> dict[str, Any]:
        """The tables of a scene file with these settings."""
        tables = self.scene.data()
        tables.pop("map", None)
        files = {key: Path(tables["mesh"][key]) for key in PATHS if key in tables["mesh"]}
        tables["mesh"] |= {key: file.name if self.loose else str(file.resolve()) for key, file in files.items()}
        law = self.law(settings)
        tables["contact"] = law.table
        tables["contact"]["gap"] = law.gap
        striker, heavier = self.scene.striker, settings.mass / self.start.mass
        grown = {key: heavier * value for key, value in striker.values.items() if key in WEIGHTS[striker.kind]}
        tables["striker"] |= grown | ({} if settings.bending is None else {"first_frequency": settings.bending})
        tables["strike"].pop("residual", None)  # on the page what modes left out yield acts in any case
        tables["strike"] |= {"at": list(settings.at), "speed": settings.speed}
        target = tables.setdefault("target", {})
        if settings.damping != self.start.damping:
            target |= {"damping_ratio": settings.damping}
        target |= {key: settings.thickness * target[key] for key in ("mass", "first_frequency") if key in target}
        if "section" in tables:
            for key in SIZES:
                if key in tables["section"] and settings.thickness != 1.0:
                    tables["section"] = {**tables["section"], key: settings.thickness * tables["section"][key]}
        return tables

    def at_rest(self, point: tuple[float, ...]) -> bool:
        """Whether the body does not move at a point, as on an edge that is held, but for rounding."""
        shape = self.base.modes.shape_at([point]) if point else np.ones(1)
        return bool(np.abs(shape).max() * np.sqrt(self.base.modes.mass) < SAME)

    def place(self, *clicked: float) -> tuple[float, ...] | None:
        """The strike point under a click, of which a beam takes x; None if the click misses the body."""
        point = clicked[: self.base.modes.dimension]
        try:
            return tuple(self.base.modes.points("at", point)[0].tolist())
        except ValueError:
            return None


def strike_quickly(case: grid.Case, most: int = 6) -> Response:
    """The same in a few milliseconds, whatever the case: in coarse steps, with few impacts and no mesh error."""
    wall = accuracy.contact_duration(case.contact, case.striker.felt_mass, case.speed)
    alone = replace(case, modes=replace(case.modes, poorer={}))
    return alone.blow(tolerance=MAP_TOLERANCE, scheme="A4", dt=wall / 16.0, max_impacts=most)


def limit_of(case: grid.Case) -> float:
    """Contact resonance [Hz] above which the body stops the striker; 0: always stops, inf: never stops."""
    found = threshold.threshold_frequency(case.modes, case.at, case.striker.felt_mass)
    return 0.0 if found is None else found
