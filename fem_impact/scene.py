"""A strike as a text file: a TOML scene is checked as a whole, then built with the public functions and struck."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from . import _check, accuracy, analytic, assembly, integrator, modal
from .contact import Contact
from .mesh import Mesh
from .modal import Modes
from .response import Response
from .section import Beam, Material, Plate
from .striker import Striker
from .tables import MAKERS, REQUIRED, TABLES, Part, fault, read_part, read_tables, target_values

SHARE = 0.45  # [-] of the tolerance each for the modes left out and for the time steps; the rest is the mesh's
MARGINS = (1.0, 4.0, 16.0)  # [-] stricter choices of modes, taken one after another while those left out matter
FIRST_LOOK = 20  # [-] modes found first: enough to set the scale and to tell how densely the others follow

MOST_MODES = {"fe": 2000, "analytic": 50_000}  # [-] about 2 GB, and minutes
WORST_FREQUENCY = 0.1  # [-] error of a frequency that `find_modes` accepts at most
SHORT_WAVES = 1e-5  # [-] error of the frequencies that `find_modes` sets the size of its elements for
NOTHING = Part()  # a table left out
ANALYTIC = {"rectangle": ("left", "right", "bottom", "top"), "line": ("left", "right"), "disk": ("outer",)}

Watch = Callable[[str], AbstractContextManager[Any]]
Finder = Callable[..., Modes]  # from a number of modes, or a frequency [Hz] and the modes found first


@dataclass(frozen=True)
class Run:
    """One strike of a scene with what it took."""

    response: Response
    seconds: Mapping[str, float]  # [s] wall time of each stage, by its name
    notes: tuple[str, ...] = ()  # what was mended or assumed of the mesh


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
    target: Part = NOTHING
    supports: Part = NOTHING
    observe: Part | None = None
    map: Part | None = None

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
        for margin in MARGINS:
            modes = self._modes(stages, None, blow, margin)
            with self._blame("observe"):
                for point in self.points:
                    modes.points("points", [point])
            with stages("strike"), self._blame("strike"):
                tolerance = _check.positive("tolerance", blow.get("tolerance", integrator.TOLERANCE))
                asked = {**blow, "tolerance": SHARE * tolerance}
                response = integrator.strike(modes, self._striker(), self._contact(), **asked)
                response = replace(response, tolerance=tolerance)
            if response.error.truncation <= SHARE * tolerance or not blow.get("residual", True):
                break
        return Run(response, MappingProxyType(stages.seconds), stages.notes)

    def body(self) -> Mesh:
        """The struck body's outline with its named edges."""
        return self._make("mesh", self.mesh)

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

    def _modes(
        self, stages: "_Stages", count: int | None, blow: Mapping[str, Any] | None = None, margin: float = 1.0
    ) -> Modes:
        blow = self.blow.values if blow is None else blow
        with self._blame("strike"):
            tolerance = _check.between("tolerance", blow.get("tolerance", integrator.TOLERANCE), 1e-12, 1.0)
            speed = _check.positive("speed", blow["speed"], "m/s")
        with self._blame("target"):
            target = target_values(**self.target.values)
        find = self._analytic(stages) if target["source"] == "analytic" else self._finite_elements(stages, tolerance)
        with stages("modes"):
            modes = find(count or FIRST_LOOK)
            scaled = modes.scaled(**target["scale"])
            with self._blame("strike"):
                scaled.points("at", blow["at"])
                if count is None:
                    limit = accuracy.cutoff_frequency(
                        scaled,
                        blow["at"],
                        contact=self._contact(),
                        mass=self._striker().felt_mass,
                        speed=speed,
                        tolerance=SHARE * tolerance / margin,
                    )
                    self._check_affordable(scaled, limit, target["source"])
                    if limit > scaled.frequencies[-1]:
                        modes = find(FIRST_LOOK, limit * modes.frequencies[-1] / scaled.frequencies[-1], modes)
            return modes.scaled(**target["scale"]).damped(target["damping_ratio"])

    def _check_affordable(self, first: Modes, limit: float, source: str) -> None:
        """Raise SimulationError where the modes up to a frequency [Hz] would fill the memory."""
        growth = max(1.0, limit / first.frequencies[-1]) ** (0.5 * first.dimension)  # Weyl's law
        number = first.n_modes * growth
        if number > MOST_MODES[source]:
            raise _check.SimulationError(
                f"{self.path}: this blow needs some {number:.2g} modes, up to {limit:.2g} Hz, more than "
                f"{MOST_MODES[source]}; allow a larger tolerance, a softer contact or a lower speed"
            )

    def _finite_elements(self, stages: "_Stages", tolerance: float) -> Finder:
        with stages("mesh"):
            body = self.body()
        stages.notes = body.notes
        with stages("assembly"):
            section = self._section("beam" if body.dimension == 1 else "plate")
            with self._blame("supports"), np.errstate(all="ignore"):
                system = assembly.assemble(body, section, supports=dict(self.supports.values))

        def find(n_modes: int, max_frequency: float | None = None, first: Any = None) -> Modes:
            with self._blame("mesh"), np.errstate(all="ignore"):
                if max_frequency is None:
                    return modal.find_modes(system, n_modes=n_modes, tolerance=min(tolerance, WORST_FREQUENCY))
                # The mesh that was fine enough for the first modes, finer still where the shortest wave asks for it.
                mesh = replace(first.shapes.system.mesh, size_stated=body.size_stated)
                modes = modal.find_modes(replace(first.shapes.system, mesh=mesh), max_frequency=max_frequency)
                error = np.full(modes.n_modes, max(first.frequency_error.max(), SHORT_WAVES))
                error[: first.n_modes] = first.frequency_error[: modes.n_modes]
                return replace(modes, frequency_error=error)

        return find

    def _analytic(self, stages: "_Stages") -> Finder:
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

        def find(n_modes: int, max_frequency: float | None = None, first: Any = None) -> Modes:
            wanted = {"n_modes": n_modes} if max_frequency is None else {"max_frequency": max_frequency}
            with self._blame("mesh"):
                return make(**values, section=section, **wanted)

        return find

    def _section(self, kind: str) -> Plate | Beam:
        """The section, or any of the right kind where mass and first frequency set the scale."""
        if self.section is None or self.material is None:
            with self._blame("target"):
                material = Material(E=1.0, nu=target_values(**self.target.values)["nu"], rho=1.0)
                return Plate(material, 1.0) if kind == "plate" else Beam.rectangular(material, width=1.0, height=1.0)
        material = self._make("material", self.material)
        section = self._make("section", self.section, material=material)
        if self.section.kind != kind:
            raise fault(self.path, f"[section] kind must be '{kind}' for this mesh, got {self.section.kind!r}")
        return section

    def _striker(self) -> Striker:
        return self._make("striker", self.striker)

    def _contact(self) -> Contact:
        if self.contact.kind != "between":
            return self._make("contact", self.contact)
        return self._make("contact", self.contact, sphere=self._striker(), plate=self._section("plate"))

    def _make(self, table: str, part: Part, **supplied: Any) -> Any:
        with self._blame(table), np.errstate(all="ignore"):  # what overflows is not finite, and refused as such
            return MAKERS[table][1][part.kind](**supplied, **part.values)

    @contextmanager
    def _blame(self, table: str) -> Iterator[None]:
        """Put file and table in front of an error in the numbers of one table."""
        try:
            yield
        except ValueError as error:
            raise fault(self.path, f"[{table}] {error}") from None
        except (OverflowError, ZeroDivisionError):
            raise fault(self.path, f"[{table}] has numbers too large or too small to reckon with") from None


class _Stages:
    """Wall time of each stage, and whoever watches."""

    def __init__(self, watch: Watch | None) -> None:
        self.watch = watch or (lambda name: nullcontext())
        self.seconds: dict[str, float] = {}
        self.notes: tuple[str, ...] = ()

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
    return scene_of(read_tables(path), path, folder=path.parent)


def scene_of(tables: Mapping[str, Any], path: Path, *, folder: Path) -> Scene:
    """The scene that tables describe, checked; ``path`` is named in errors, file names are relative to ``folder``."""
    tables = dict(tables)
    title = tables.pop("title", "")
    if not isinstance(title, str):
        raise fault(path, f"title must be text, got {title!r:.80}")
    for name, table in tables.items():
        if name not in TABLES:
            raise fault(path, f"[{name}] is not a table of a scene{_check.nearest(name, TABLES)}")
        if not isinstance(table, dict):
            raise fault(path, f"{name} must be a table, written [{name}]")
    for name in REQUIRED:
        if name not in tables:
            raise fault(path, f"[{name}] is missing")
    parts = {name: read_part(path, name, table, folder) for name, table in tables.items()}
    scene = Scene(path, title, blow=parts.pop("strike"), **parts)
    _check_whole(scene)
    return scene


def _check_whole(scene: Scene) -> None:
    """Build what is cheap to build, so that a wrong number is told at once, and check what two tables share."""
    target = {} if scene.target is None else scene.target.values
    with scene._blame("target"):
        target_values(**target)
    if (scene.material is None) != (scene.section is None):
        missing, there = ("material", "section") if scene.material is None else ("section", "material")
        raise fault(scene.path, f"[{missing}] is missing; [{there}] needs it")
    if scene.section is None and not {"mass", "first_frequency"} <= set(target):
        raise fault(scene.path, "[target] needs mass and first_frequency where there is no [material]")
    for table in ("observe", "map"):
        part = getattr(scene, table)
        if part is not None:
            scene._make(table, part)
    if scene.section is not None:
        scene._section(scene.section.kind)
    if scene.contact.kind == "between" and (scene.striker.kind != "sphere" or scene.section is None):
        raise fault(scene.path, "[contact] kind 'between' needs a striker of kind 'sphere' and a [section]")
    scene._striker()
    scene._contact()
