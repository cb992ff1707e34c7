"""A strike in a text file: reads a TOML scene, checks all of it, builds it with the public functions and strikes."""

import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check, known, markup
from ..fe.assembly import System, clamped, support_of_facets, support_words
from ..fe.ribs import Rib, sides_on
from ..fe.section import Beam, Elastic, Material, Plate, size_at
from ..fe.springs import check_posts
from ..impact import promise
from ..impact.contact import Contact
from ..impact.engine import TOLERANCE
from ..impact.response import Response
from ..impact.striker import Striker
from ..mesh import sketch
from ..mesh.meshes import Mesh, mesh_along_lines, mesh_with_holes
from ..model import planner
from ..model.by_modes import MOST_MODES
from ..model.planner import Blow, Plan, Run
from ..model.playing import Strokes
from ..model.target import FIRST_LOOK, Stages, Target, Watch
from ..modes.modal import Modes
from . import sequence
from .named import fill_names
from .whole import check_whole

from .schema import (  # isort: skip
    MAKERS, NESTED, OF_TARGET, PARTS, PATHS, REPEATED, REQUIRED, TABLES, Part, scene_error, read_list, read_part,
    read_strokes, read_tables,
)  # fmt: skip

# [-] places along a beam where its section is looked at: ten in each hundredth of it, where it may change
SECTIONS = 1001
NOTHING = Part()  # stands for a missing table


@dataclass(frozen=True, repr=False)
class Scene(check.Brief):
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
    in_plane: Part = NOTHING
    rib: tuple[Part, ...] = ()
    layer: tuple[Part, ...] = ()
    observe: Part | None = None
    map: Part | None = None
    stroke: tuple[Part, ...] = ()  # blows one after another, for `Scene.play`; [strike] says what they share
    known: Mapping[str, Any] = field(default_factory=dict)  # table.key -> distribution of a number with an interval

    def strike(self, *, strict: bool = False, **changes: Any) -> Response:
        """Build everything and strike.

        ``strict`` as in `fi.strike`, ``changes`` as in `plan`. A ValueError names the wrong file, table and key.
        """
        return promise.warn_if_missed(self.run(**changes).response, strict)

    @check.typed
    def play(self, *, watch: Watch | None = None, strict: bool = False, **changes: Any) -> Strokes:
        """Play the strokes of the scene, its tables [[stroke]], with the modes that the most demanding of them needs.

        Parameters
        ----------
        watch : callable, optional
            As in `plan`.
        strict : bool
            As in `fi.strike`.
        **changes
            ``tolerance``, ``quantity``, ``residual`` and ``duration``, which replace those of the scene, and
            ``n_modes``, ``max_frequency`` or ``size``, as in `plan`.

        Returns
        -------
        Strokes
            As from `fi.strokes`.
        """
        return self.run_strokes(watch, strict=strict, **changes).response

    @check.typed
    def plan_strokes(self, *, watch: Watch | None = None, **changes: Any) -> sequence.SequencePlan:
        """Decide how to model the strokes of the scene, without playing them.

        Parameters
        ----------
        watch : callable, optional
            As in `plan`.
        **changes
            As in `play`.

        Returns
        -------
        SequencePlan
            With the `Plan` of every stroke as if it struck the body at rest; what a stroke inherits from those before
            is known after `play` only.
        """
        return sequence.plan_sequence(self, watch, **changes)

    @check.typed
    def run_strokes(
        self,
        watch: Watch | None = None,
        *,
        before: Callable[[Plan], object] | None = None,
        strict: bool = False,
        **changes: Any,
    ) -> sequence.Played:
        """Play the strokes of the scene as `play` does, and keep the plan and the time of every stage.

        ``watch`` and ``before`` as in `run`, ``before`` with the plan of the body; ``strict`` and ``changes`` as in
        `play`. `report.write` makes a page of it.
        """
        return sequence.run_sequence(self, watch, before=before, strict=strict, **changes)

    def modes(self, count: int | None = None, *, elastic: bool = False, keep: Path | None = None) -> Modes:
        """Modes of the struck body: the first ``count``, or as many as the blow needs to meet its tolerance.

        With ``elastic`` rigid motions come on top of that number. ``keep`` is an .npz file in which modes by finite
        elements are saved, and found by the same call later.
        """
        if count is None:
            return self.plan(target="modal").description.found(Stages())[1]
        target = self.built.target
        most = MOST_MODES[target.kind]
        if check.count("count", count) > most:
            raise self.fault(f"count must be at most {most} modes for this scene, got {count}; ask for fewer")
        tolerance = self.blow.values.get("tolerance", TOLERANCE)
        with self.blame("strike"):
            check.tolerance(tolerance)
        number = min(count + 3, most) if elastic else count  # a plate lifts and turns about two axes
        first = None
        with self.blame("target"):
            if keep is not None and target.kind == "fe" and number > FIRST_LOOK:
                first = target.find(FIRST_LOOK, tolerance=tolerance)  # what is kept starts from its mesh
            found = target.find(number, tolerance=tolerance, first=first, keep=keep)
        return target.surrounded(found.truncated(n_modes=count + found.n_rigid) if elastic else found)

    @check.typed
    def plan(self, *, watch: Watch | None = None, **changes: Any) -> Plan:
        """Decide how to model the blow, without striking.

        Parameters
        ----------
        watch : callable, optional
            Called with the name of each stage; returns a context manager that is open during the stage.
        **changes
            Arguments of `strike` that replace those of the scene, such as ``tolerance`` and ``quantity``; and parts of
            the plan to fix by hand: ``target`` ("rigid", "infinite", "vectors", "mixed" or "modal"), ``model``
            ("stated", or "auto": a thick theory, air and stretching where the tolerance needs them), ``size`` [m] of
            elements, ``n_modes`` or ``max_frequency`` [Hz] of the target, ``n_striker_modes``.

        Returns
        -------
        Plan
            If the target needs modes, this finds the first twenty to estimate how many.
        """
        stages = Stages(watch)
        return planner.make_plan(self._staged(stages), changes, stages)

    @check.typed
    def run(
        self,
        watch: Watch | None = None,
        *,
        plan: Plan | None = None,
        before: Callable[[Plan], object] | None = None,
        verify: bool = False,
        motion: bool = False,
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
        motion : bool
            Whether the motion of the target is wanted besides the numbers of the blow, as if points were observed.
        keep : path of an .npz file, optional
            Saves the modes of a costly plan there, so that an interrupted run can resume from them.
        **changes : as in `plan`

        Returns
        -------
        Run
        """
        stages = Stages(watch)
        if plan is None:
            blow = self._staged(stages)
            plan = planner.make_plan(replace(blow, moving=True) if motion else blow, changes, stages)
        if before is not None:
            before(plan)
        run = planner.carry_out(plan, stages, keep)
        return planner.verify(run, watch) if verify else run

    @property
    def points(self) -> list[Any]:
        """Points to observe, (n_points, dimension) [m]: those of [observe], otherwise the strike point."""
        return list(self.watched or [self.blow.values["at"]])

    @property
    def listeners(self) -> list[Any]:
        """Positions of the listeners to the sound radiated, (n_listeners, 3) [m]; empty if [observe] has none."""
        given = {} if self.observe is None else self.observe.values
        return [given["listener"]] if "listener" in given else list(given.get("listeners", []))

    @property
    def baffled(self) -> bool:
        """Whether the body fills a hole in a large rigid wall: plates do unless the scene says otherwise."""
        return self.mesh.kind != "line" and self._target["baffle"]

    @property
    def girth(self) -> tuple[float, float]:
        """Largest width and height [m] of a beam, which set how much air it moves."""
        section, points = self.make_section("beam"), self.body().points
        x = np.linspace(points.min(axis=0), points.max(axis=0), SECTIONS)
        assert isinstance(section, Beam)
        width, height = (float(size_at(section, name, x).max()) for name in ("width", "height"))
        return width, height

    @property
    def watched(self) -> list[Any]:
        """The points of [observe], (n_points, dimension) [m]; empty if it has none."""
        return [] if self.observe is None else self.observe.values.get("points", [])

    def heard_from(self, *listeners: Any) -> "Scene":
        """The same scene with listeners at (3,) [m]; the third coordinate is the distance from the plate's plane."""
        given = dict((NOTHING if self.observe is None else self.observe).values)
        others = {key: value for key, value in given.items() if key not in ("listener", "listeners")}
        places = {"listener": listeners[0]} if len(listeners) == 1 else {"listeners": list(listeners)}
        part = Part("", {**others, **places})
        scene = replace(self, observe=part)
        check_whole(scene)
        return scene

    def changed(self, values: Mapping[str, float]) -> "Scene":
        """The scene with other numbers, by names such as ``material.E`` or ``supports.left.stiffness``.

        Raises
        ------
        ValueError
            If there is no such table or key, or the scene with these numbers is invalid.
        """
        if not isinstance(values, Mapping):
            raise ValueError(f"values must be a dict of names and numbers, got {check.shown(values)}")
        tables: dict[str, Any] = {name: _opened(table) for name, table in self.data().items()}
        for name, value in values.items():
            *path, key = str(name).split(".")
            table: Any = tables
            for part in path:
                inner = dict(zip(map(str, range(len(table))), table)) if isinstance(table, list) else table
                table = inner.get(part) if isinstance(inner, dict) else None
            if not path or not isinstance(table, dict) or not isinstance(table.get(key, 0.0), (int, float)):
                raise ValueError(f"values must name numbers in tables of the scene, got {check.shown(name)}")
            table[key] = check.number(f"values[{check.shown(name)}]", value)
        try:
            made = scene_of(tables, self.path, folder=Path())
            return replace(made, known={name: how for name, how in self.known.items() if name not in values})
        except ValueError as error:
            raise ValueError(f"values must be numbers of the scene: {error}") from None

    def picture(self) -> str:
        """The target with its supports, strike point and observed points, as SVG."""
        blows = [self.alone(i).blow for i in range(len(self.stroke))] or [self.blow]
        places = dict.fromkeys(tuple(np.atleast_1d(np.asarray(blow.values["at"], float)).tolist()) for blow in blows)
        at = " and ".join(f"({', '.join(f'{x:.4g}' for x in place)})" for place in places)
        points = [np.atleast_1d(np.asarray(point, float)) for point in self.watched]
        title = f"Outline of the struck body, struck at {at} m"
        title += f", observed at {len(points)} point{'s' * (len(points) > 1)}" if points else ""
        ribs = [rib.path for rib in self.ribs]
        return sketch.draw_body(self.body(), supports=self.held, at=list(places), points=points, title=title, ribs=ribs)

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
            if isinstance(part, tuple):
                tables |= {table: [dict(each.values) for each in part]} if part else {}
            elif part is not None and (part.kind or part.values):
                selector = MAKERS[table][0] if table in MAKERS else ""
                tables[table] = {**({selector: part.kind} if selector else {}), **part.values}
        tables["strike"] |= changes
        return tables

    def kept(self, folder: str | Path, **changes: Any) -> tuple[dict[str, Any], list[str]]:
        """Copy the scene's mesh or drawing into a folder; return `data` with the new paths, and the file names."""
        tables, names = self.data(**changes), []
        mesh = tables["mesh"]
        if "table" in mesh.get("rise", ()):
            mesh["rise"] = dict(mesh["rise"])
        for table, key in [*((mesh, key) for key in PATHS), (mesh.get("rise", {}), "table")]:
            if key in table:
                source = Path(table[key])
                shutil.copyfile(source, Path(folder) / source.name)
                table[key] = source.name
                names.append(source.name)
        return tables, names

    def alone(self, number: int) -> "Scene":
        """The scene of one stroke as a single blow."""
        values = self.stroke[number].values
        called = f"[[{REPEATED}]] {number}"
        own: dict[str, Any] = {
            name: read_part(self.path, name, values[name], Path(), f"{called} {name}:")
            for name in NESTED
            if name in values
        }
        blow = {**self.blow.values, **{name: values[name] for name in ("at", "speed") if name in values}}
        own |= {"stroke": (), "blow": Part("", blow)}
        return replace(self, **own)

    def check_single(self) -> None:
        """Raise ValueError if this is a sequence, whose strokes are played together."""
        if self.stroke:
            raise self.fault(
                f"[[{REPEATED}]] must be left out here: this needs a single blow; without these tables the scene "
                "strikes once, as [strike] says, and from Python scene.alone(0) is its first stroke (the commands "
                "strike, plan and report take strokes)"
            )

    def check_unpushed(self) -> None:
        """Raise ValueError if something is given that maps, spreads and the live page do not follow.

        That is a force, an early end, or steps of one's own.
        """
        with self.blame("striker"):
            self.make_striker().let_go("a map, a spread or the live page")
        for name in ("striker_force", "target_force", "duration", "max_impacts", "dt", "scheme"):
            if self.blow.values.get(name):
                raise self.fault(
                    f"[strike] {name} must be left out here: maps, spreads and live pages follow whole blows without it"
                )

    def _staged(self, stages: Stages) -> Blow:
        """`built`, with its time."""
        self.check_single()
        with stages("mesh"):
            return self.built

    @cached_property
    def built(self) -> Blow:
        """The scene as objects."""
        mesh = self.body()
        section = self.make_section("beam" if mesh.dimension == 1 else "plate")
        section = replace(section, rise=mesh.rise, ribs=self.ribs) if isinstance(section, Plate) else section
        supports = {edge: Elastic(**kind) if isinstance(kind, dict) else kind for edge, kind in self.held.items()}
        with self.blame("supports"):
            support_of_facets(mesh, supports, support_words(self.target.values.get("theory")))
        for edge in self.in_plane.values:
            with self.blame("in_plane"):
                check.one_of("edge", edge, mesh.edges)
        options = {name: value for name, value in self._target.items() if name != "nu"}
        options["point_supports"] = tuple(entry for entry in options["point_supports"] if entry[1] != "clamped")
        with self.blame("target"):
            if isinstance(section, Plate) and not section.plain and options["theory"] not in (None, "shallow"):
                raise ValueError(
                    f"theory must be left out for a curved, ribbed or coupled plate, got {options['theory']!r}"
                )
            target = Target(mesh, section, supports, **options, blame=self.blame)
        points = tuple(self.points)
        moving = self.observe is not None
        return Blow(target, self._striker, self.make_contact(), self.blow.values, points, moving, f"{self.path}: ")

    def body(self) -> Mesh:
        """Mesh of the target."""
        return self._body

    @cached_property
    def _body(self) -> Mesh:
        mesh = self._make("mesh", self.mesh)
        with self.blame("target"):
            clamps = check_posts(self._target["point_supports"], mesh.dimension)[1]
            mesh = mesh_with_holes(mesh, clamps) if clamps else mesh
        ribs = list(self._listed("rib", within=mesh))
        paths = [rib.path for rib in ribs if not isinstance(rib.path, str)]
        with self.blame("rib"):
            mesh = mesh_along_lines(mesh, paths) if paths else mesh
        for i, rib in enumerate(ribs):
            with self.blame(f"[[rib]] {i}"):
                sides_on(mesh, rib.path)
        return mesh

    @property
    def ribs(self) -> tuple[Rib, ...]:
        """The ribs of a plate."""
        return tuple(self._listed("rib", within=self.body()))

    def _listed(self, table: str, **supplied: Any) -> Iterator[Any]:
        """What the tables that may stand several times make, with the material of the body where they state none."""
        base = None if self.material is None else self._make("material", self.material)
        for i, part in enumerate(getattr(self, table)):
            with self.blame(f"[[{table}]] {i}"), np.errstate(all="ignore"):
                yield MAKERS[table][1][""](base=base, **supplied, **part.values)

    @cached_property
    def _target(self) -> dict[str, Any]:
        return self._make("target", self.target)

    @property
    def held(self) -> dict[str, Any]:
        """The supports of the edges as written, with those around clamped points."""
        posts = self._target["point_supports"]
        return clamped(dict(self.supports.values), sum(entry[1] == "clamped" for entry in posts))

    def make_section(self, kind: str) -> Plate | Beam:
        """The section; without a material, any of the right kind, as mass and first frequency set the scale."""
        layers = tuple(self._listed("layer"))
        if not layers and (self.section is None or self.material is None):
            with self.blame("target"):
                material = Material(E=1e10, nu=self._target["nu"], rho=1e3)
                thin = 1e-9  # [m] thinner than any body is wide
                return Plate(material, thin) if kind == "plate" else Beam.rectangular(material, width=thin, height=thin)
        part = self.section or Part("plate")
        if part.kind != kind or (layers and kind != "plate"):
            raise self.fault(f"[section] kind must be '{kind}' for this mesh, got {part.kind!r}")
        material = layers[0][0] if self.material is None else self._make("material", self.material)
        supplied = {"layers": layers} if layers else {}
        section = self._make("section", part, material=material, **supplied)
        return replace(section, in_plane=dict(self.in_plane.values)) if kind == "plate" else section

    def make_striker(self) -> Striker:
        return self._striker

    @cached_property
    def _striker(self) -> Striker:
        return self._make("striker", self.striker)  # cached: a stick needs finite elements

    def make_contact(self) -> Contact:
        if self.contact.kind != "between":
            return self._make("contact", self.contact)
        section = self.make_section("plate" if self.section is None else self.section.kind)
        return self._make("contact", self.contact, sphere=self.make_striker(), plate=section)

    def _make(self, table: str, part: Part, **supplied: Any) -> Any:
        with self.blame(table), np.errstate(all="ignore"):  # an overflow becomes inf, which the checks refuse
            return MAKERS[table][1][part.kind](**supplied, **part.values)

    def fault(self, text: str) -> ValueError:
        """A ValueError that names the file."""
        return scene_error(self.path, text)

    @contextmanager
    def blame(self, table: str, changes: Iterable[str] = ()) -> Iterator[None]:
        """Put the file and the table in front of an error about a table's numbers, unless ``changes`` set them.

        Of a simulation that failed, the file.
        """
        called = table if table.startswith("[") else f"[{table}]"
        try:
            yield
        except (ValueError, check.SimulationError) as error:
            said, name = str(error), f"{check.line(str(self.path))}: "
            key = said.partition(" ")[0].partition("=")[0]
            if said.startswith(name) or key in changes:
                raise
            if isinstance(error, check.SimulationError):
                raise type(error)(name + said) from None
            raise self.fault(f"{'[target]' if key in OF_TARGET else called} {said}") from None
        except (OverflowError, ZeroDivisionError):
            raise self.fault(f"{called} has a number too large or too small; check its units") from None


def _opened(value: Any) -> Any:
    """A table with the tables in it, as dicts and lists of their own."""
    if isinstance(value, (list, tuple)):
        return [_opened(item) for item in value]
    return {key: _opened(item) for key, item in value.items()} if isinstance(value, Mapping) else value


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

    Examples
    --------
    >>> hit = fi.load_scene("studies/scenes/drumstick.toml").strike(tolerance=1e-2)
    >>> hit.n_impacts, round(hit.restitution, 2)
    (1, 0.54)
    """
    path = check.path("path", path)
    return scene_of(read_tables(path), path, folder=path.parent)


def scene_of(tables: Mapping[str, Any], path: Path, *, folder: Path) -> Scene:
    """Build a scene from tables and check it; errors name ``path``, and file names are relative to ``folder``."""
    tables = dict(tables)
    title = tables.pop("title", "")
    if not isinstance(title, str):
        raise scene_error(path, f"title must be text, got {check.shown(title)}")
    title = "".join(c if c.isprintable() else " " for c in title)  # terminals obey control characters
    for name, table in tables.items():
        if name not in TABLES:
            what = f"[{name}] is not a table" if isinstance(table, dict | list) else f"{name} is not a key"
            raise scene_error(path, f"{what} of a scene{check.nearest(name, (*TABLES, 'title'))}")
        if not isinstance(table, dict) and name not in (REPEATED, *PARTS):
            raise scene_error(path, f"{name} must be a table, written [{name}]")
    try:
        tables = fill_names(tables)
    except ValueError as error:
        raise scene_error(path, str(error)) from None
    for name in REQUIRED:
        if name not in tables:
            raise scene_error(path, f"[{name}] is missing")
    strokes = read_strokes(path, tables.pop(REPEATED, []), folder)
    intervals: dict[str, Any] = {}
    for name, table in tables.items():
        try:
            tables[name], found = known.taken(name, table)
        except ValueError as error:
            raise scene_error(path, f"[{name}] {error}") from None
        intervals |= found
    parts: dict[str, Any] = {name: read_list(path, name, tables.pop(name)) for name in PARTS if name in tables}
    parts |= {name: read_part(path, name, table, folder) for name, table in tables.items()}
    scene = Scene(path, title, blow=parts.pop("strike"), stroke=strokes, known=intervals, **parts)
    check_whole(scene)
    return scene


@check.typed
def plan(
    scene: Scene | str | Path | System | Modes,
    striker: Striker | None = None,
    contact: Contact | None = None,
    *,
    watch: Watch | None = None,
    **changes: Any,
) -> Plan:
    """Decide how to model a blow, without striking: the smallest model that meets the tolerance.

    Parameters
    ----------
    scene : Scene, path of a scene file, System or Modes
        A scene says everything. A body needs the arguments of `strike`, given here in the same way.
    striker, contact : Striker, Contact
        For a body only.
    watch : callable, optional
        Called with the name of each stage; returns a context manager that is open during the stage.
    **changes
        Arguments of `strike`, such as ``at``, ``speed``, ``tolerance`` and ``quantity``, which replace those of a
        scene; and parts of the plan to fix by hand: ``target`` ("rigid", "infinite", "vectors", "mixed" or "modal"),
        ``model`` ("stated", or "auto": a thick theory, air and stretching where the tolerance needs them), ``size`` [m]
        of the elements, ``n_modes`` or ``max_frequency`` [Hz] of the target, ``n_striker_modes``.

    Returns
    -------
    Plan
        If the target needs modes, this finds the first twenty to estimate how many.

    Examples
    --------
    >>> print(fi.plan("studies/scenes/heavy_plate.toml", tolerance=1e-2).target)
    rigid
    """
    if isinstance(scene, (System, Modes)):
        return planner.plan_of(scene, striker, contact, watch, **changes)
    if striker is not None or contact is not None:
        raise ValueError("striker and contact must be left out for a scene, which has its own")
    return (scene if isinstance(scene, Scene) else load_scene(scene)).plan(watch=watch, **changes)
