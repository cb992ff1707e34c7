"""A strike as a text file: a TOML scene is checked as a whole, then built with the public functions and struck."""

import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from . import _check, analytic, assembly, modal, planner, spectrum, svg
from .contact import Contact
from .mesh import Mesh
from .modal import Modes
from .planner import Run, Stages, Watch
from .plans import Plan
from .response import Response
from .section import Beam, Material, Plate
from .striker import Striker
from .tables import MAKERS, PATHS, REQUIRED, TABLES, Part, fault, read_part, read_tables, target_values

WORST_FREQUENCY = 0.1  # [-] error of a frequency that `find_modes` accepts at most
NOTHING = Part()  # a table left out
ANALYTIC = {"rectangle": ("left", "right", "bottom", "top"), "line": ("left", "right"), "disk": ("outer",)}

Finder = Callable[..., Modes]  # from a number of modes, or a frequency [Hz], and the modes found first


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

    def strike(self, **changes: Any) -> Response:
        """Build everything and strike; ``changes`` as in `plan`. ValueError names file, table and key at fault."""
        return self.run(**changes).response

    def modes(self, count: int | None = None) -> Modes:
        """Modes of the struck body: the first ``count``, or as many as the blow and its tolerance need."""
        if count is None:
            return planner.target(self.plan(target="modal"), Stages())
        most = planner.MOST_MODES[self.source]
        if _check.count("count", count) > most:
            raise fault(self.path, f"count must be at most {most} modes of this scene, got {count}")
        found = self.finder(Stages(), planner.tolerance_of(self))(count)
        return found.scaled(**self.scale).damped(self.damping_ratio)

    @_check.typed
    def plan(self, *, watch: Watch | None = None, **changes: Any) -> Plan:
        """Decide how to model the blow, without striking.

        Parameters
        ----------
        watch : callable, optional
            Called with the name of each stage; returns a context manager that is held while the stage lasts.
        **changes
            Arguments of `strike` that replace those of the scene, such as ``tolerance`` and ``quantity``; and pieces of
            the plan set by hand: ``target`` ("rigid", "infinite" or "modal"), ``size`` [m] of the elements,
            ``n_modes`` or ``max_frequency`` [Hz] of the target, ``n_striker_modes``.

        Returns
        -------
        Plan
            Where the target needs modes, its first twenty are found to tell how many.
        """
        return planner.make(self, changes, Stages(watch))

    @_check.typed
    def run(
        self,
        watch: Watch | None = None,
        *,
        plan: Plan | None = None,
        before: Callable[[Plan], object] | None = None,
        verify: bool = False,
        keep: str | Path | None = None,
        **changes: Any,
    ) -> Run:
        """Strike, timing every stage.

        Parameters
        ----------
        watch : as in `plan`
        plan : Plan, optional
            To carry out instead of the one made now.
        before : callable, optional
            Called with the plan before it is carried out.
        verify : bool
            Whether to strike again with everything one notch finer and note the true differences.
        keep : path of an .npz file, optional
            Where the modes of a costly plan are kept once they are found, so that a run broken off goes on from there.
        **changes : as in `plan`

        Returns
        -------
        Run
        """
        stages = Stages(watch)
        plan = planner.make(self, changes, stages) if plan is None else plan
        if before is not None:
            before(plan)
        run = planner.carry_out(plan, stages, keep)
        return planner.verify(run, watch) if verify else run

    @property
    def points(self) -> list[Any]:
        """Where one looks and listens, (n_points, dimension) [m]: those of [observe], else the strike point."""
        return list(self.watched or [self.blow.values["at"]])

    @property
    def listener(self) -> list[float] | None:
        """Where the sound radiated by the plate is heard, (3,) [m]; None where [observe] names no listener."""
        return None if self.observe is None else self.observe.values.get("listener")

    @property
    def watched(self) -> list[Any]:
        """The points of [observe], (n_points, dimension) [m]; none where it names none."""
        return [] if self.observe is None else self.observe.values.get("points", [])

    def heard_from(self, listener: Any) -> "Scene":
        """The same scene with a listener (3,) [m] beside the plate, whose third coordinate is off its plane."""
        part = Part("", {**(NOTHING if self.observe is None else self.observe).values, "listener": listener})
        scene = replace(self, observe=part)
        _check_whole(scene)
        return scene

    def picture(self) -> str:
        """The target with its supports, the strike point and the points of observation, as SVG."""
        at = np.atleast_1d(np.asarray(self.blow.values["at"], float))
        points = [np.atleast_1d(np.asarray(point, float)) for point in self.watched]
        title = f"Outline of the struck body, struck at ({', '.join(f'{x:.4g}' for x in at)}) m"
        title += f", observed at {len(points)} point{'s' * (len(points) > 1)}" if points else ""
        return svg.body(self.body(), supports=self.supports.values, at=at, points=points, title=title)

    def _repr_html_(self) -> str:
        """In a notebook: the picture and what each table says."""
        rows = []
        for table, values in self.data().items():
            if isinstance(values, dict) and table != "map":
                rows.append((table, ", ".join(f"{key} {value}" for key, value in values.items())))
        title = svg.table([(self.title or self.path.name,)])
        return title + svg.side_by_side(self.picture(), svg.table(rows))

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

    def kept(self, folder: str | Path, **changes: Any) -> tuple[dict[str, Any], list[str]]:
        """As `data`, with the mesh or drawing it reads copied into a folder; and the names of the copies."""
        tables, names = self.data(**changes), []
        for key in PATHS:
            if key in self.mesh.values:
                source = Path(self.mesh.values[key])
                shutil.copyfile(source, Path(folder) / source.name)
                tables["mesh"][key] = source.name
                names.append(source.name)
        return tables, names

    @cached_property
    def source(self) -> str:
        """Where the target's modes come from, "fe" or "analytic": closed formulas where there are any, unless told."""
        told = self._target["source"]
        if told != "auto":
            return told
        return "fe" if self.size_stated or self.closed_form() is None else "analytic"

    @property
    def scale(self) -> Mapping[str, float]:
        """Mass [kg] and first frequency [Hz] of the target, where they are given."""
        return self._target["scale"]

    @property
    def damping_ratio(self) -> float:
        """Damping ratio [-] of the target's modes."""
        return self._target["damping_ratio"]

    @property
    def _target(self) -> dict[str, Any]:
        with self.blame("target"):
            return target_values(**self.target.values)

    def finder(self, stages: Stages, tolerance: float, size: float | None = None) -> Finder:
        """What finds the target's modes, before mass, first frequency and damping are set (see `Finder`)."""
        if self.source == "analytic" and (size is None or self._target["source"] == "analytic"):
            return self._analytic()
        return self._finite_elements(stages, tolerance, size)

    def closed_form(self) -> Finder | None:
        """The same by closed formulas, whatever the source; None where there are none."""
        try:
            return self._analytic()
        except ValueError:
            return None

    def body(self, size: float | None = None) -> Mesh:
        """The mesh of the target, its elements of a size [m] or as the scene has it."""
        if size is None:
            return self._body
        if self.mesh.kind == "file":
            with self.blame("mesh"):
                return self._body.refined(self._body.size / _check.positive("size", size, "m"))
        return self._make("mesh", Part(self.mesh.kind, {**self.mesh.values, "size": size}))

    @cached_property
    def _body(self) -> Mesh:
        return self._make("mesh", self.mesh)

    @property
    def size_stated(self) -> bool:
        """Whether the scene insists on a size of the elements."""
        return "size" in self.mesh.values

    def _finite_elements(self, stages: Stages, tolerance: float, size: float | None) -> Finder:
        def find(n_modes: int, max_frequency: float | None = None, first: Any = None, keep: Any = None) -> Modes:
            whole = self._system(stages, size) if first is None else None
            insisted = size is not None or self.size_stated
            with self.blame("mesh"), np.errstate(all="ignore"):
                if whole is not None:
                    wanted = None if insisted else min(tolerance, WORST_FREQUENCY)
                    return modal.find_modes(whole, n_modes=n_modes, tolerance=wanted)
                # The mesh that was fine enough for the first modes, finer still where the shortest wave asks for it.
                system = first.shapes.system
                enough = insisted or (max_frequency is not None and spectrum.resolves(system, max_frequency))
                system = replace(system, mesh=replace(system.mesh, size_stated=enough))
                reach = {"n_modes": n_modes} if max_frequency is None else {"max_frequency": max_frequency}
                return modal.find_modes(system, **reach, keep=keep)

        return find

    def _system(self, stages: Stages, size: float | None) -> assembly.System:
        with stages("mesh"):
            body = self.body(size)
        with stages("assembly"):
            section = self.make_section("beam" if body.dimension == 1 else "plate")
            with self.blame("supports"), np.errstate(all="ignore"):
                return assembly.assemble(body, section, supports=dict(self.supports.values))

    def _analytic(self) -> Finder:
        edges = dict(self.supports.values)
        values = {key: value for key, value in self.mesh.values.items() if key != "size"}
        with self.blame("supports"):
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
        section = self.make_section("beam" if self.mesh.kind == "line" else "plate")

        def find(n_modes: int, max_frequency: float | None = None, first: Any = None, keep: Any = None) -> Modes:
            wanted = {"n_modes": n_modes} if max_frequency is None else {"max_frequency": max_frequency}
            with self.blame("mesh"), np.errstate(all="ignore"):
                return make(**values, section=section, **wanted)

        return find

    def make_section(self, kind: str) -> Plate | Beam:
        """The section, or any of the right kind where mass and first frequency set the scale."""
        if self.section is None or self.material is None:
            with self.blame("target"):
                material = Material(E=1.0, nu=target_values(**self.target.values)["nu"], rho=1.0)
                return Plate(material, 1.0) if kind == "plate" else Beam.rectangular(material, width=1.0, height=1.0)
        material = self._make("material", self.material)
        section = self._make("section", self.section, material=material)
        if self.section.kind != kind:
            raise fault(self.path, f"[section] kind must be '{kind}' for this mesh, got {self.section.kind!r}")
        return section

    def make_striker(self) -> Striker:
        return self._striker

    @cached_property
    def _striker(self) -> Striker:
        return self._make("striker", self.striker)  # a stick is found by finite elements

    def make_contact(self) -> Contact:
        if self.contact.kind != "between":
            return self._make("contact", self.contact)
        return self._make("contact", self.contact, sphere=self.make_striker(), plate=self.make_section("plate"))

    def _make(self, table: str, part: Part, **supplied: Any) -> Any:
        with self.blame(table), np.errstate(all="ignore"):  # what overflows is not finite, and refused as such
            return MAKERS[table][1][part.kind](**supplied, **part.values)

    def fault(self, text: str) -> ValueError:
        """An error that names the file."""
        return fault(self.path, text)

    @contextmanager
    def blame(self, table: str) -> Iterator[None]:
        """Put file and table in front of an error in the numbers of one table."""
        try:
            yield
        except ValueError as error:
            raise fault(self.path, f"[{table}] {error}") from None
        except (OverflowError, ZeroDivisionError):
            raise fault(self.path, f"[{table}] has numbers too large or too small to reckon with") from None


@_check.typed
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
    path = _check.path("path", path)
    return scene_of(read_tables(path), path, folder=path.parent)


def scene_of(tables: Mapping[str, Any], path: Path, *, folder: Path) -> Scene:
    """The scene that tables describe, checked; ``path`` is named in errors, file names are relative to ``folder``."""
    tables = dict(tables)
    title = tables.pop("title", "")
    if not isinstance(title, str):
        raise fault(path, f"title must be text, got {_check.shown(title)}")
    title = "".join(c if c.isprintable() else " " for c in title)  # it is printed to terminals, which obey some
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


@_check.typed
def plan(scene: Scene | str | Path, **changes: Any) -> Plan:
    """Decide how a scene, or the file it is in, will be modelled, without striking (see `Scene.plan`)."""
    return (scene if isinstance(scene, Scene) else load_scene(scene)).plan(**changes)


def _check_whole(scene: Scene) -> None:
    """Build what is cheap to build, so that a wrong number is told at once, and check what two tables share."""
    target = {} if scene.target is None else scene.target.values
    with scene.blame("target"):
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
    if scene.listener is not None and scene.mesh.kind == "line":
        raise fault(scene.path, "[observe] listener hears plates only; this beam has no surface to radiate")
    if scene.section is not None:
        scene.make_section(scene.section.kind)
    if scene.contact.kind == "between" and (scene.striker.kind != "sphere" or scene.section is None):
        raise fault(scene.path, "[contact] kind 'between' needs a striker of kind 'sphere' and a [section]")
    scene.make_striker()
    scene.make_contact()
