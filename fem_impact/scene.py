"""A strike as a text file: a TOML scene is checked as a whole, then built with the public functions and struck."""

import inspect
import math
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from . import _check, accuracy, analytic, assembly, integrator, mesh, modal
from .contact import Contact
from .modal import Modes
from .response import Response
from .section import Beam, Material, Plate
from .striker import Striker

LARGEST_FILE = 1_000_000  # [byte] a scene is written by hand; more is a mistake, refused before it is read
SHARE = 0.45  # [-] of the tolerance each for the modes left out and for the time steps; the rest is the mesh's
FIRST_LOOK = 20  # [-] modes found first: enough to set the scale and to tell how densely the others follow

Watch = Callable[[str], AbstractContextManager[Any]]


def _beam(material: Material, *, width: Any = None, height: Any = None, diameter: Any = None) -> Beam:
    if diameter is not None and width is None and height is None:
        return Beam.circular(material, diameter=diameter)
    if diameter is not None or width is None or height is None:
        raise ValueError("width and height must both be given, or diameter alone")
    return Beam.rectangular(material, width=width, height=height)


def _sphere(*, radius: float, E: float, nu: float, rho: float) -> Striker:
    return Striker.sphere(Material(E=E, nu=nu, rho=rho), radius)


def _target(*, mass=None, first_frequency=None, nu=0.3, damping_ratio=0.0, source="fe") -> dict[str, Any]:
    _check.between("nu", nu, -1.0, 0.5)
    _check.non_negative("damping_ratio", damping_ratio)
    scale = {"mass": (mass, "kg"), "first_frequency": (first_frequency, "Hz")}
    given = {name: _check.positive(name, value, unit) for name, (value, unit) in scale.items() if value is not None}
    return {
        "scale": given,
        "nu": nu,
        "damping_ratio": damping_ratio,
        "source": _check.one_of("source", source, SOURCES),
    }


def _observe(*, points: Any) -> Any:
    if not isinstance(points, list) or not points:
        raise ValueError(f"points must be a list of points such as [[0.1, 0.2]], got {points!r:.80}")
    return points


SOURCES = ("fe", "analytic")
# What makes each part of a scene: the keys of its table are the arguments of these functions, no list is kept twice.
# A table whose first entry is not empty names its maker by that key.
MAKERS: dict[str, tuple[str, dict[str, Callable[..., Any]]]] = {
    "mesh": (
        "shape",
        {
            name: getattr(mesh, maker)
            for name, maker in {
                "rectangle": "rectangle",
                "disk": "disk",
                "polygon": "polygon",
                "outline": "outline",
                "line": "line",
                "file": "load",
            }.items()
            if hasattr(mesh, maker)
        },
    ),
    "material": ("", {"": Material}),
    "section": ("kind", {"plate": Plate, "beam": _beam}),
    "target": ("", {"": _target}),
    "striker": ("kind", {"rigid": Striker.rigid, "sphere": _sphere, "stick": Striker.stick}),
    "contact": (
        "kind",
        {
            "linear": Contact.linear,
            "hertz": Contact.hertz,
            "power": Contact.power,
            "restituting": Contact.restituting,
            "between": Contact.between,
        },
    ),
    "strike": ("", {"": integrator.strike}),
    "observe": ("", {"": _observe}),
}
TABLES = [*MAKERS, "supports"]
REQUIRED = ("mesh", "striker", "contact", "strike")
SUPPLIED = {"material", "modes", "striker", "contact", "sphere", "plate"}  # arguments that come from other tables
SUPPORTS = ("clamped", "hinged", "free")
ANALYTIC = {"rectangle": ("left", "right", "bottom", "top"), "line": ("left", "right"), "disk": ("outer",)}
PATHS = ("source", "path")  # keys that name a file, relative to the scene


@dataclass(frozen=True)
class Part:
    """One table of a scene: which public function it stands for and the arguments it gives."""

    kind: str = ""
    values: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True)
class Run:
    """One strike of a scene with what it took."""

    response: Response
    seconds: Mapping[str, float]  # [s] wall time of each stage, by its name


@dataclass(frozen=True)
class Scene:
    """A strike described completely; `load_scene` reads one from TOML. Missing tables are empty parts."""

    path: Path
    title: str
    mesh: Part
    striker: Part
    contact: Part
    blow: Part  # the table [strike]
    material: Part | None = None
    section: Part | None = None
    target: Part = Part()
    supports: Part = Part()
    observe: Part | None = None

    def strike(self) -> Response:
        """Build everything and strike; ValueError names file, table and key of what cannot be."""
        return self.run().response

    def modes(self, count: int | None = None) -> Modes:
        """Modes of the struck body: the first ``count``, or as many as the blow and its tolerance need."""
        return self._modes(_Stages(None), None if count is None else _check.count("count", count))

    def run(self, watch: Watch | None = None, **changes: Any) -> Run:
        """Strike, timing every stage.

        Parameters
        ----------
        watch : callable, optional
            Called with the name of each stage; returns a context manager that is held while the stage lasts.
        **changes
            Arguments of `strike` that replace those of the scene, such as ``tolerance``.

        Returns
        -------
        Run
        """
        stages = _Stages(watch)
        blow = {**self.blow.values, **changes}
        modes = self._modes(stages, None, blow)
        with self._blame("observe"):
            for point in self.points:
                modes.points("points", [point])
        with stages("strike"), self._blame("strike"):
            tolerance = _check.positive("tolerance", blow.get("tolerance", integrator.TOLERANCE))
            blow = {**blow, "tolerance": SHARE * tolerance}
            response = integrator.strike(modes, self._striker(), self._contact(), **blow)
            response = replace(response, tolerance=tolerance)
        return Run(response, MappingProxyType(stages.seconds))

    @property
    def points(self) -> list[Any]:
        """Where one looks and listens, (n_points, dimension) [m]: those of [observe], else the strike point."""
        return [self.blow.values["at"]] if self.observe is None else list(self.observe.values["points"])

    def data(self, **changes: Any) -> dict[str, Any]:
        """The scene as its file would say it, with arguments of the strike replaced by ``changes``."""
        tables: dict[str, Any] = {"title": self.title} if self.title else {}
        for table in TABLES:
            part = self.blow if table == "strike" else getattr(self, table)
            if part is not None and (part.kind or part.values):
                selector = MAKERS[table][0] if table in MAKERS else ""
                tables[table] = {**({selector: part.kind} if selector else {}), **part.values}
        tables["strike"] |= changes
        return tables

    def _modes(self, stages: "_Stages", count: int | None, blow: Mapping[str, Any] | None = None) -> Modes:
        blow = self.blow.values if blow is None else blow
        with self._blame("target"):
            target = _target(**self.target.values)
        find = self._analytic(stages) if target["source"] == "analytic" else self._finite_elements(stages, blow)
        with stages("modes"):
            first = find(n_modes=FIRST_LOOK if count is None else count)
            scaled = first.scaled(**target["scale"])
            with self._blame("strike"):
                scaled.points("at", blow["at"])
                if count is None:
                    limit = self._cutoff(scaled, blow) * first.frequencies[-1] / scaled.frequencies[-1]
            if count is None and limit > first.frequencies[-1]:
                first = find(max_frequency=limit)
            return first.scaled(**target["scale"]).damped(target["damping_ratio"])

    def _cutoff(self, modes: Modes, blow: Mapping[str, Any]) -> float:
        """Frequency [Hz] beyond which the residual compliance may stand for the modes."""
        tolerance = _check.positive("tolerance", blow.get("tolerance", integrator.TOLERANCE))
        return accuracy.cutoff_frequency(
            modes,
            blow["at"],
            contact=self._contact(),
            mass=self._striker().felt_mass,
            speed=_check.positive("speed", blow["speed"], "m/s"),
            tolerance=SHARE * tolerance,
        )

    def _finite_elements(self, stages: "_Stages", blow: Mapping[str, Any]) -> Callable[..., Modes]:
        with stages("mesh"), self._blame("mesh"):
            body = self._make("mesh", self.mesh)
        with stages("assembly"):
            section = self._section("beam" if body.dimension == 1 else "plate")
            with self._blame("supports"):
                system = assembly.assemble(body, section, supports=dict(self.supports.values))
        tolerance = blow.get("tolerance", integrator.TOLERANCE)
        return lambda **wanted: modal.find_modes(system, tolerance=tolerance, **wanted)

    def _analytic(self, stages: "_Stages") -> Callable[..., Modes]:
        edges = dict(self.supports.values)
        values = {key: value for key, value in self.mesh.values.items() if key != "size"}
        with stages("mesh"), self._blame("supports"):
            held = {name: edges.pop(name, edges.get("boundary", "free")) for name in ANALYTIC.get(self.mesh.kind, ())}
            edges.pop("boundary", None)
            if edges:
                lost = next(iter(edges))
                raise ValueError(
                    f"{lost} is not an edge of a {self.mesh.kind}, which has {', '.join(held)}"
                    f"{_check.nearest(lost, held)}"
                )
            if self.mesh.kind == "rectangle" and set(held.values()) == {"hinged"}:
                make: Callable[..., Modes] = analytic.rectangle
            elif self.mesh.kind == "line":
                make, values["ends"] = analytic.beam, (held["left"], held["right"])
            elif self.mesh.kind == "disk" and not values.pop("hole", 0.0):
                make, values["edge"] = analytic.disk, held["outer"]
            else:
                raise ValueError(
                    f"source = 'analytic' knows rectangles hinged all round, beams and disks without hole, "
                    f"not this {self.mesh.kind}; use source = 'fe'"
                )
        section = self._section("beam" if self.mesh.kind == "line" else "plate")

        def find(**wanted: Any) -> Modes:
            with self._blame("mesh"):
                return make(**values, section=section, **wanted)

        return find

    def _section(self, kind: str) -> Plate | Beam:
        """The section, or any of the right kind where mass and first frequency set the scale."""
        if self.section is None or self.material is None:
            with self._blame("target"):
                material = Material(E=1.0, nu=_target(**self.target.values)["nu"], rho=1.0)
                return Plate(material, 1.0) if kind == "plate" else Beam.rectangular(material, width=1.0, height=1.0)
        material = self._make("material", self.material)
        section = self._make("section", self.section, material=material)
        if self.section.kind != kind:
            raise ValueError(f"{self.path}: [section] kind must be '{kind}' for this mesh, got {self.section.kind!r}")
        return section

    def _striker(self) -> Striker:
        return self._make("striker", self.striker)

    def _contact(self) -> Contact:
        if self.contact.kind != "between":
            return self._make("contact", self.contact)
        return self._make("contact", self.contact, sphere=self._striker(), plate=self._section("plate"))

    def _make(self, table: str, part: Part, **supplied: Any) -> Any:
        with self._blame(table):
            return MAKERS[table][1][part.kind](**supplied, **part.values)

    @contextmanager
    def _blame(self, table: str) -> Iterator[None]:
        """Put file and table in front of an error in the numbers of one table."""
        try:
            yield
        except ValueError as error:
            raise ValueError(f"{self.path}: [{table}] {error}") from None


class _Stages:
    """Wall time of each stage, and whoever watches."""

    def __init__(self, watch: Watch | None) -> None:
        self.watch = watch or (lambda name: nullcontext())
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            with self.watch(name):
                yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


def load_scene(path: str | Path) -> Scene:
    """Read a scene from TOML and check its tables and keys.

    Parameters
    ----------
    path : path of a TOML file

    Returns
    -------
    Scene
        File names in it are relative to the scene file.

    Raises
    ------
    ValueError
        One line naming file, table, key and rule, where anything in the file is not as it must be. What depends on
        the finished body, such as a strike point off the plate, is found by `Scene.modes` and `Scene.strike`.
    OSError
        Where the file cannot be read.
    """
    path = Path(path)
    tables = _read(path)
    title = tables.pop("title", "")
    if not isinstance(title, str):
        raise ValueError(f"{path}: title must be text, got {title!r:.80}")
    for name, table in tables.items():
        if name not in TABLES:
            raise ValueError(f"{path}: [{name}] is not a table of a scene{_check.nearest(name, TABLES)}")
        if not isinstance(table, dict):
            raise ValueError(f"{path}: {name} must be a table, written [{name}]")
    for name in REQUIRED:
        if name not in tables:
            raise ValueError(f"{path}: [{name}] is missing")
    parts = {name: _part(path, name, table) for name, table in tables.items()}
    scene = Scene(path, title, blow=parts.pop("strike"), **parts)
    _check_whole(scene)
    return scene


def _read(path: Path) -> dict[str, Any]:
    with open(path, "rb") as file:
        raw = file.read(LARGEST_FILE + 1)
    if len(raw) > LARGEST_FILE:
        raise ValueError(f"{path}: a scene must be smaller than {LARGEST_FILE} bytes")
    try:
        return tomllib.loads(raw.decode("utf-8"))
    except UnicodeDecodeError:
        raise ValueError(f"{path}: a scene must be UTF-8 text") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: not valid TOML: {error}".replace("\n", " ")) from None


def _part(path: Path, table: str, values: dict[str, Any]) -> Part:
    def wrong(text: str) -> ValueError:
        return ValueError(f"{path}: [{table}] {text}")

    bad = _not_finite(values)
    if bad:
        raise wrong(f"{bad[0]} must be finite, got {bad[1]}")
    if table == "supports":
        for edge, support in values.items():
            if support not in SUPPORTS:
                raise wrong(f"{edge} must be one of {', '.join(SUPPORTS)}, got {support!r:.80}")
        return Part("", MappingProxyType(values))
    selector, makers = MAKERS[table]
    values = dict(values)
    kind = ""
    if selector:
        if selector not in values:
            raise wrong(f"{selector} is missing; it is one of {', '.join(makers)}")
        kind = values.pop(selector)
        try:
            _check.one_of(selector, kind, makers)
        except ValueError as error:
            raise wrong(str(error)) from None
    arguments = {n: p for n, p in inspect.signature(makers[kind]).parameters.items() if n not in SUPPLIED}
    for key in values:
        if key not in arguments:
            known = [selector, *arguments] if selector else list(arguments)
            raise wrong(
                f"{key} is not a key of this table{_check.nearest(key, known) or '; it has ' + ', '.join(known)}"
            )
    for key, argument in arguments.items():
        if argument.default is inspect.Parameter.empty and key not in values:
            raise wrong(f"{key} is missing" + (f" for {selector} = {kind!r}" if selector else ""))
    for key in PATHS:
        if table == "mesh" and key in values:
            if not isinstance(values[key], str):
                raise wrong(f"{key} must be the name of a file, got {values[key]!r:.80}")
            values[key] = str(path.parent / values[key])
    return Part(kind, MappingProxyType(values))


def _not_finite(value: Any, name: str = "") -> tuple[str, float] | None:
    """Name and value of the first number in nested data that is not finite."""
    if isinstance(value, dict):
        found = (_not_finite(item, f"{name}.{key}" if name else str(key)) for key, item in value.items())
    elif isinstance(value, list):
        found = (_not_finite(item, f"{name}[{i}]") for i, item in enumerate(value))
    else:
        return (name, value) if isinstance(value, float) and not math.isfinite(value) else None
    return next((hit for hit in found if hit), None)


def _check_whole(scene: Scene) -> None:
    """Build what is cheap to build, so that a wrong number is told at once, and check what two tables share."""
    target = {} if scene.target is None else scene.target.values
    with scene._blame("target"):
        _target(**target)
    if (scene.material is None) != (scene.section is None):
        missing, there = ("material", "section") if scene.material is None else ("section", "material")
        raise ValueError(f"{scene.path}: [{missing}] is missing; [{there}] needs it")
    if scene.section is None and not {"mass", "first_frequency"} <= set(target):
        raise ValueError(f"{scene.path}: [target] needs mass and first_frequency where there is no [material]")
    if scene.observe is not None:
        scene._make("observe", scene.observe)
    if scene.section is not None:
        scene._section(scene.section.kind)
    if scene.contact.kind == "between" and (scene.striker.kind != "sphere" or scene.section is None):
        raise ValueError(f"{scene.path}: [contact] kind 'between' needs a striker of kind 'sphere' and a [section]")
    scene._striker()
    scene._contact()
