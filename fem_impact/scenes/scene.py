"""A strike in a text file: reads a TOML scene, checks all of it, builds it with the public functions and strikes."""

import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, markup
from ..fe import assembly, refinement
from ..fe.section import Beam, Material, Plate
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.striker import Striker
from ..mesh.meshes import Mesh
from ..model import planner
from ..model.plan import Plan
from ..model.planner import Run, Stages, Watch
from ..modes import analytic, modal
from ..modes.modal import Modes
from .schema import MAKERS, PATHS, REQUIRED, TABLES, Part, fault, read_part, read_tables, target_values

WORST_FREQUENCY = 0.1  # [-] largest frequency error that `find_modes` accepts as a tolerance
NOTHING = Part()  # stands for a missing table
ANALYTIC = {"rectangle": ("left", "right", "bottom", "top"), "line": ("left", "right"), "disk": ("outer",)}

Finder = Callable[..., Modes]  # takes a number of modes or a frequency [Hz], and the first modes


@dataclass(frozen=True)
class Scene:
    """A complete description of a strike; `load_scene` reads one from TOML. Missing tables are empty parts."""

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

    __repr__ = check.brief

    def strike(self, **changes: Any) -> Response:
        """Build everything and strike; ``changes`` as in `plan`. A ValueError names the wrong file, table and key."""
        return self.run(**changes).response

    def modes(self, count: int | None = None) -> Modes:
        """Modes of the struck body: the first ``count``, or as many as the blow needs to meet its tolerance."""
        if count is None:
            return planner.target(self.plan(target="modal"), Stages())
        most = planner.MOST_MODES[self.source]
        if check.count("count", count) > most:
            raise fault(self.path, f"count must be at most {most} modes for this scene, got {count}; ask for fewer")
        found = self.finder(Stages(), planner.tolerance_of(self))(count)
        return found.scaled(**self.scale).damped(self.damping_ratio)

    @check.typed
    def plan(self, *, watch: Watch | None = None, **changes: Any) -> Plan:
        """Decide how to model the blow, without striking.

        Parameters
        ----------
        watch : callable, optional
            Called with the name of each stage; returns a context manager that is open during the stage.
        **changes
            Arguments of `strike` that replace those of the scene, such as ``tolerance`` and ``quantity``; and parts of
            the plan to fix by hand: ``target`` ("rigid", "infinite" or "modal"), ``size`` [m] of the elements,
            ``n_modes`` or ``max_frequency`` [Hz] of the target, ``n_striker_modes``.

        Returns
        -------
        Plan
            If the target needs modes, this finds the first twenty to estimate how many.
        """
        return planner.make(self, changes, Stages(watch))

    @check.typed
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
        """Strike, and time every stage.

        Parameters
        ----------
        watch : as in `plan`
        plan : Plan, optional
            Plan to carry out; by default a new one is made.
        before : callable, optional
            Called with the plan before it is carried out.
        verify : bool
            Whether to strike again with every setting one step finer and report the true differences.
        keep : path of an .npz file, optional
            Saves the modes of a costly plan there, so that an interrupted run can resume from them.
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
        """Points to observe, (n_points, dimension) [m]: those of [observe], otherwise the strike point."""
        return list(self.watched or [self.blow.values["at"]])

    @property
    def listener(self) -> list[float] | None:
        """Position of the listener to the sound of the plate, (3,) [m]; None if [observe] has none."""
        return None if self.observe is None else self.observe.values.get("listener")

    @property
    def watched(self) -> list[Any]:
        """The points of [observe], (n_points, dimension) [m]; empty if it has none."""
        return [] if self.observe is None else self.observe.values.get("points", [])

    def heard_from(self, listener: Any) -> "Scene":
        """The same scene with a listener at (3,) [m]; the third coordinate is the distance from the plate's plane."""
        part = Part("", {**(NOTHING if self.observe is None else self.observe).values, "listener": listener})
        scene = replace(self, observe=part)
        _check_whole(scene)
        return scene

    def picture(self) -> str:
        """The target with its supports, strike point and observed points, as SVG."""
        at = np.atleast_1d(np.asarray(self.blow.values["at"], float))
        points = [np.atleast_1d(np.asarray(point, float)) for point in self.watched]
        title = f"Outline of the struck body, struck at ({', '.join(f'{x:.4g}' for x in at)}) m"
        title += f", observed at {len(points)} point{'s' * (len(points) > 1)}" if points else ""
        return markup.body(self.body(), supports=self.supports.values, at=at, points=points, title=title)

    def _repr_html_(self) -> str:
        """For notebooks: the picture and the contents of each table."""
        rows = []
        for table, values in self.data().items():
            if isinstance(values, dict) and table != "map":
                rows.append((table, ", ".join(f"{key} {value}" for key, value in values.items())))
        title = markup.table([(self.title or self.path.name,)])
        return title + markup.side_by_side(self.picture(), markup.table(rows))

    def data(self, **changes: Any) -> dict[str, Any]:
        """The scene as tables of a TOML file, with arguments of the strike replaced by ``changes``."""
        tables: dict[str, Any] = {"title": self.title} if self.title else {}
        for table in TABLES:
            part = self.blow if table == "strike" else getattr(self, table)
            if part is not None and (part.kind or part.values):
                selector = MAKERS[table][0] if table in MAKERS else ""
                tables[table] = {**({selector: part.kind} if selector else {}), **part.values}
        tables["strike"] |= changes
        return tables

    def kept(self, folder: str | Path, **changes: Any) -> tuple[dict[str, Any], list[str]]:
        """Copy the scene's mesh or drawing into a folder; return `data` with the new paths, and the file names."""
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
        """Source of the target's modes, "fe" or "analytic": closed formulas if there are any, unless stated."""
        told = self._target["source"]
        if told != "auto":
            return told
        return "fe" if self.size_stated or self.closed_form() is None else "analytic"

    @property
    def scale(self) -> Mapping[str, float]:
        """Mass [kg] and first frequency [Hz] of the target, if the scene gives them."""
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
        """Function that finds the target's modes, before mass, first frequency and damping are set (see `Finder`)."""
        if self.source == "analytic" and (size is None or self._target["source"] == "analytic"):
            return self._analytic()
        return self._finite_elements(stages, tolerance, size)

    def closed_form(self) -> Finder | None:
        """The same from closed formulas, whatever the source; None if there are none for this body."""
        try:
            return self._analytic()
        except ValueError:
            return None

    def body(self, size: float | None = None) -> Mesh:
        """Mesh of the target, with elements of the given size [m] or as the scene defines it."""
        if size is None:
            return self._body
        if self.mesh.kind == "file":
            with self.blame("mesh"):
                return self._body.refined(self._body.size / check.positive("size", size, "m"))
        return self._make("mesh", Part(self.mesh.kind, {**self.mesh.values, "size": size}))

    @cached_property
    def _body(self) -> Mesh:
        return self._make("mesh", self.mesh)

    @property
    def size_stated(self) -> bool:
        """Whether the scene fixes the element size."""
        return "size" in self.mesh.values

    def _finite_elements(self, stages: Stages, tolerance: float, size: float | None) -> Finder:
        def find(n_modes: int, max_frequency: float | None = None, first: Any = None, keep: Any = None) -> Modes:
            whole = self._system(stages, size) if first is None else None
            insisted = size is not None or self.size_stated
            with self.blame("mesh"), np.errstate(all="ignore"):
                if whole is not None:
                    wanted = None if insisted else min(tolerance, WORST_FREQUENCY)
                    return modal.find_modes(whole, n_modes=n_modes, tolerance=wanted)
                # Start from the mesh of the first modes and refine it if it cannot resolve the shortest wave.
                system = first.shapes.system
                enough = insisted or (max_frequency is not None and refinement.resolves(system, max_frequency))
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
                    f"{check.nearest(lost, held)}"
                )
            if self.mesh.kind == "rectangle" and set(held.values()) == {"hinged"}:
                make: Callable[..., Modes] = analytic.rectangle
            elif self.mesh.kind == "line":
                make, values["ends"] = analytic.beam, (held["left"], held["right"])
            elif self.mesh.kind == "disk" and not values.pop("hole", 0.0):
                make, values["edge"] = analytic.disk, held["outer"]
            else:
                raise ValueError(
                    f"source = 'analytic' covers rectangles hinged all round, beams and disks without a hole, "
                    f"not this {self.mesh.kind}; use source = 'fe'"
                )
        section = self.make_section("beam" if self.mesh.kind == "line" else "plate")
        with self.blame("section"):
            analytic.check_uniform(section)

        def find(n_modes: int, max_frequency: float | None = None, first: Any = None, keep: Any = None) -> Modes:
            wanted = {"n_modes": n_modes} if max_frequency is None else {"max_frequency": max_frequency}
            with self.blame("mesh"), np.errstate(all="ignore"):
                return make(**values, section=section, **wanted)

        return find

    def make_section(self, kind: str) -> Plate | Beam:
        """The section; without a material, any of the right kind, as mass and first frequency set the scale."""
        if self.section is None or self.material is None:
            with self.blame("target"):
                material = Material(E=1e10, nu=target_values(**self.target.values)["nu"], rho=1e3)
                thin = 1e-9  # [m] thinner than any body is wide
                return Plate(material, thin) if kind == "plate" else Beam.rectangular(material, width=thin, height=thin)
        material = self._make("material", self.material)
        section = self._make("section", self.section, material=material)
        if self.section.kind != kind:
            raise fault(self.path, f"[section] kind must be '{kind}' for this mesh, got {self.section.kind!r}")
        return section

    def make_striker(self) -> Striker:
        return self._striker

    @cached_property
    def _striker(self) -> Striker:
        return self._make("striker", self.striker)  # cached: a stick needs finite elements

    def make_contact(self) -> Contact:
        if self.contact.kind != "between":
            return self._make("contact", self.contact)
        return self._make("contact", self.contact, sphere=self.make_striker(), plate=self.make_section("plate"))

    def _make(self, table: str, part: Part, **supplied: Any) -> Any:
        with self.blame(table), np.errstate(all="ignore"):  # an overflow becomes inf, which the checks refuse
            return MAKERS[table][1][part.kind](**supplied, **part.values)

    def fault(self, text: str) -> ValueError:
        """A ValueError that names the file."""
        return fault(self.path, text)

    @contextmanager
    def blame(self, table: str, changes: Iterable[str] = ()) -> Iterator[None]:
        """Put the file and the table in front of an error about a table's numbers, unless ``changes`` set them."""
        try:
            yield
        except ValueError as error:
            if str(error).partition(" ")[0] in changes:
                raise
            raise fault(self.path, f"[{table}] {error}") from None
        except (OverflowError, ZeroDivisionError):
            raise fault(self.path, f"[{table}] has a number too large or too small; check its units") from None


@check.typed
def load_scene(path: str | Path) -> Scene:
    """Read a scene from TOML and check its tables and keys.

    Parameters
    ----------
    path : path of a TOML file

    Returns
    -------
    Scene
        File names in the TOML file are relative to its folder.

    Raises
    ------
    ValueError
        If anything in the file is wrong: one line that names file, table, key and rule. `Scene.modes` and
        `Scene.strike` find errors that need the finished body, such as a strike point off the plate.
    OSError
        If the file cannot be read.
    """
    path = check.path("path", path)
    return scene_of(read_tables(path), path, folder=path.parent)


def scene_of(tables: Mapping[str, Any], path: Path, *, folder: Path) -> Scene:
    """Build a scene from tables and check it; errors name ``path``, and file names are relative to ``folder``."""
    tables = dict(tables)
    title = tables.pop("title", "")
    if not isinstance(title, str):
        raise fault(path, f"title must be text, got {check.shown(title)}")
    title = "".join(c if c.isprintable() else " " for c in title)  # terminals obey control characters
    for name, table in tables.items():
        if name not in TABLES:
            raise fault(path, f"[{name}] is not a table of a scene{check.nearest(name, TABLES)}")
        if not isinstance(table, dict):
            raise fault(path, f"{name} must be a table, written [{name}]")
    for name in REQUIRED:
        if name not in tables:
            raise fault(path, f"[{name}] is missing")
    parts = {name: read_part(path, name, table, folder) for name, table in tables.items()}
    scene = Scene(path, title, blow=parts.pop("strike"), **parts)
    _check_whole(scene)
    return scene


@check.typed
def plan(scene: Scene | str | Path, **changes: Any) -> Plan:
    """Decide how to model a scene, or a scene file, without striking (see `Scene.plan`)."""
    return (scene if isinstance(scene, Scene) else load_scene(scene)).plan(**changes)


def _check_whole(scene: Scene) -> None:
    """Build whatever is cheap, so that a wrong number fails at once, and check that the tables fit together."""
    target = {} if scene.target is None else scene.target.values
    with scene.blame("target"):
        target_values(**target)
    if (scene.material is None) != (scene.section is None):
        missing, there = ("material", "section") if scene.material is None else ("section", "material")
        raise fault(scene.path, f"[{missing}] is missing; [{there}] needs it")
    if scene.section is None and not {"mass", "first_frequency"} <= set(target):
        raise fault(scene.path, "[target] needs mass and first_frequency if there is no [material]")
    for table in ("observe", "map"):
        part = getattr(scene, table)
        if part is not None:
            scene._make(table, part)
    if scene.listener is not None and scene.mesh.kind == "line":
        raise fault(scene.path, "[observe] listener must be left out for a beam: only plates radiate sound here")
    if scene.section is not None:
        scene.make_section(scene.section.kind)
    if scene.contact.kind == "between" and (scene.striker.kind != "sphere" or scene.section is None):
        raise fault(scene.path, "[contact] kind 'between' needs a striker of kind 'sphere' and a [section]")
    scene.make_striker()
    scene.make_contact()
