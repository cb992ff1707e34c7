"""Bodies and blows made from numbers, and how they change with these: the chain rule from a design to its blow."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .._base.rounding import ROUNDING, SAME
from ..fe.assembly import System
from ..fe.section import Beam, Plate, size_at
from ..fe.variation import DIFFERENCES, STEP, SectionChange
from ..impact import collision
from ..impact.contact import Contact
from ..impact.parameters import LAW, numbers_of
from ..impact.response import Response
from ..impact.striker import Striker
from ..mesh.meshes import Mesh
from ..model.planner import Blow
from ..model.target import Target
from ..modes.modal import Modes
from ..scenes.scene import SECTIONS, Scene, load_scene
from ..taps.unknowns import Values

BODY = "mesh", "section", "supports", "theory", "point_masses", "point_supports"  # a body that is not assembled yet
BLOW = "damping_ratio", *list(inspect.signature(collision.strike).parameters)[1:]  # arguments of a blow on it
CONTACT = ("gap", *LAW)  # numbers of a contact that a gradient follows
BODY_TABLES = "mesh", "material", "section", "layer", "rib", "rise", "supports", "in_plane", "target"  # of a scene
Build = Callable[[dict[str, float]], Any]


@dataclass(frozen=True, eq=False, repr=False)
class Piece(check.Brief):
    """A body and, if there is one, the blow on it."""

    target: Target
    blow: Blow | None = None
    key: Any = None  # bodies of the same key are the same

    def strike(self, modes: Modes, tolerance: float, once: bool = False) -> Response:
        """The blow on these modes of the body, or only its first impact; a tolerance of its own counts if smaller."""
        assert self.blow is not None
        given = {**self.blow.arguments, "tolerance": min(tolerance, self.blow.arguments.get("tolerance", tolerance))}
        given |= {"max_impacts": 1} if once else {}
        return collision.strike(modes, self.blow.striker, self.blow.contact, **given)

    @cached_property
    def numbers(self) -> dict[str, float]:
        """The numbers of the blow that a gradient can be taken in, but for those of an assembled body."""
        found, target, blow = {}, self.target, self.blow
        if blow is not None:
            found = {f"contact.{name}": float(getattr(blow.contact, name)) for name in CONTACT}
            found["strike.speed"] = float(blow.arguments["speed"])
            at = blow.arguments["at"]
            place = np.atleast_1d(np.asarray([] if at is None else at, float))
            found |= {f"strike.{name}": float(x) for name, x in zip("xy", place)}
            found |= numbers_of("striker", blow.striker.modes)
        if isinstance(target.damping_ratio, (int, float)):
            found["target.damping_ratio"] = float(target.damping_ratio)
        if target.modes is not None:
            found = {**numbers_of("target", target.modes), **found}
        return found | {f"target.{name}": float(value) for name, value in target.scale.items()}

    @property
    def section(self) -> Plate | Beam | None:
        """The section of a body of elements; None if its modes were given."""
        return self.target.section if self.target.modes is None else None


@dataclass(frozen=True, eq=False, repr=False)
class Maker(check.Brief):
    """Makes the pieces of a design from the values of its free numbers."""

    build: Build
    names: tuple[str, ...]
    scene: Scene | None = None

    @classmethod
    def of(cls, objects: Any, names: tuple[str, ...]) -> "Maker":
        """From a scene, the path of one, or a function; ValueError for anything else."""
        if isinstance(objects, (str, Path)):
            objects = load_scene(check.path("objects", objects))
        if isinstance(objects, Scene):
            return cls(objects.changed, names, objects)
        if not callable(objects) or isinstance(objects, type):
            raise ValueError(
                "objects must be a scene, the path of one, or a function that makes body and blow from a dict of "
                f"values, got {check.shown(objects)}"
            )
        return cls(objects, names)

    def pieces(self, values: Mapping[str, float]) -> dict[str, Piece]:
        """Body and blow by the name of the blow, "" if there is only one."""
        made = self.build(Values({name: float(values[name]) for name in self.names}))
        if isinstance(made, Scene):
            blow = made.built
            key = repr([made.data().get(table) for table in BODY_TABLES])
            return {"": Piece(blow.target, blow, key)}
        if isinstance(made, Mapping) and made and not {"target", "mesh"} & set(made):
            return {str(name): _piece(each, f"{name}: ") for name, each in made.items()}
        return {"": _piece(made, "")}

    def rates(self, values: Mapping[str, float], name: str, scale: float) -> "dict[str, Rate]":
        """How every piece changes with one free number, of which ``scale`` is a large change."""
        step = STEP * scale
        now = self.pieces(values)
        for multiples, weights in DIFFERENCES:
            try:
                sides = [now if k == 0 else self.pieces({**values, name: values[name] + step * k}) for k in multiples]
            except ValueError:
                continue
            return {
                blow: Rate.of(name, piece, [side[blow] for side in sides], np.array(weights) / step)
                for blow, piece in now.items()
            }
        raise ValueError(f"free[{name!r}]: nothing can be made on either side of {values[name]:g}; change its range")


@dataclass(frozen=True, eq=False, repr=False)
class Rate(check.Brief):
    """How a piece changes per unit of a free number."""

    numbers: Mapping[str, float]  # those that change
    section: SectionChange | None  # how the section does; None if it stays

    @classmethod
    def of(cls, name: str, now: Piece, sides: list[Piece], weights: np.ndarray) -> "Rate":
        """From the pieces at the values of a difference; SimulationError where something else changes."""
        found = {}
        for key, value in now.numbers.items():
            column = [side.numbers.get(key, value) for side in sides]
            if np.ptp(column) > ROUNDING * abs(value):
                found[key] = float(weights @ column)
        for side in sides:
            _check_alike(name, now, side)
        section = None
        if now.section is not None and any(_sections_differ(now, side) for side in sides):
            sections = tuple(side.section for side in sides if side.section is not None)
            section = SectionChange(sections, tuple(weights.tolist()))
        return cls(found, section)


def _sections_differ(one: Piece, two: Piece) -> bool:
    """Whether the sections of two bodies differ at any of many places; functions of place are new each time."""
    mesh = one.target.mesh
    if one.section is two.section or mesh is None or one.section is None or two.section is None:
        return one.section is not two.section
    points = np.vstack([mesh.points, mesh.points[mesh.cells].mean(axis=1)])
    if mesh.dimension == 1:
        points = np.linspace(mesh.points.min(), mesh.points.max(), SECTIONS)[:, None]
    return not all(map(np.array_equal, _numbers_at(points, one.section), _numbers_at(points, two.section)))


def _numbers_at(points: np.ndarray, section: Plate | Beam) -> list[Any]:
    """All that a section gives the energies of a body at points (n_points, dimension) [m]."""
    found = [section.inertia(points), section.shear(points)]
    if isinstance(section, Beam):
        return [*found, section.stiffness(points)]
    thickness = size_at(section, "thickness", points)
    ribs = [each for rib in section.ribs for each in rib.rigidity(points, thickness)]
    return [*found, section.walls(points), section.tension, section.rise and section.rise(points), *ribs]


def _check_alike(name: str, now: Piece, side: Piece) -> None:
    """Raise SimulationError if a number changes what no derivative follows."""
    one, two = now.target, side.target
    if one.mesh is None or two.mesh is None:
        same = one.mesh is two.mesh
    else:
        a, b = one.mesh.points, two.mesh.points
        same = a.shape == b.shape and bool(np.allclose(a, b, rtol=0.0, atol=1e-12 * np.ptp(a)))
    if not same:
        raise SimulationError(f"no derivative in {name}: it changes the mesh; free numbers of the section instead")
    for what in ("supports", "point_masses", "point_supports", "theory", "air", "source"):
        if repr(getattr(one, what)) != repr(getattr(two, what)):
            raise SimulationError(
                f"no derivative in {name}: it changes the {what.replace('_', ' ')} of the body; keep them"
            )
    modes = [each.modes for each in (one, two)]
    if modes[0] is not None and modes[1] is not None:
        _check_scaled(name, "target", modes[0], modes[1])
    if now.blow is not None and side.blow is not None:
        _check_scaled(name, "striker", now.blow.striker.modes, side.blow.striker.modes)
        law, other = now.blow.contact, side.blow.contact
        for each in fields(law):
            if each.name not in CONTACT and getattr(law, each.name) != getattr(other, each.name):
                raise SimulationError(f"no derivative in {name}: it changes the contact's {each.name}; keep that")


def _check_scaled(name: str, body: str, one: Modes, two: Modes) -> None:
    """Raise SimulationError unless modes differ by a factor in their frequencies and one in their shapes."""
    if one is two:
        return
    alike = one.n_modes == two.n_modes
    if alike:
        flexible = one.omega > 0.0
        ratio = two.omega[flexible] / one.omega[flexible]
        alike = not flexible.any() or bool(np.ptp(ratio) <= SAME * ratio.max())
    if not alike:
        raise SimulationError(
            f"no derivative in {name}: it changes the modes of the {body} one by one; make the body of a mesh and a "
            "section"
        )


def _piece(made: Any, where: str) -> Piece:
    """One body and blow from what a function returned."""
    if isinstance(made, (System, Modes)):
        made = {"target": made}
    if not isinstance(made, Mapping):
        raise ValueError(
            f"objects: {where}must return a System, Modes, a dict of arguments of strike with 'target', or a dict of "
            f"such dicts; got {check.shown(made)}"
        )
    values = dict(made)
    for name in values:
        check.one_of(f"objects: {where}each argument", name, ("target", *BODY, *BLOW))
    damping = values.pop("damping_ratio", None)
    if "target" in values:
        body = values.pop("target")
        check.instance("target", body, System, Modes)
        target, key = Target.of(body, damping), id(body)
    else:
        given = {name: values.pop(name) for name in BODY if name in values}
        check.instance("mesh", given.get("mesh"), Mesh)
        check.instance("section", given.get("section"), Plate, Beam)
        target = Target(**given, damping_ratio=damping, source="fe")
        key = None
    striker, contact = values.pop("striker", None), values.pop("contact", None)
    if striker is None and contact is None and not values:
        return Piece(target, key=key)
    check.instance("striker", striker, Striker)
    check.instance("contact", contact, Contact)
    for name in ("at", "speed"):
        if name not in values:
            raise ValueError(f"objects: {where}needs {name}, an argument of strike")
    return Piece(target, Blow(target, striker, contact, values), key)
