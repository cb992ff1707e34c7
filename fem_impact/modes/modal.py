"""Modes: the description of a structure that every later stage works on, whether computed or measured."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._base import check, isolated, markup
from .._base.remembered import Remembered
from .._base.rounding import ROUNDING, SAME
from ..fe import plausible
from ..fe.section import Beam, Plate
from . import cell_kinds, dents, followed, picked, universal_files, unstated, viewing
from .shapes import REMEMBERED, RigidShapes, SampledShapes, ScaledShapes, Shapes

HIGHEST = 0.1 * check.REACH  # [Hz] highest frequency that scaling may produce; 2 pi times it must stay in reach
UNSTATED = {  # by argument of `Modes.from_arrays`
    "compliance": "the static compliance is not given: what the modes left out yield is estimated from those given",
    "free": "no rigid motion is given, and no mode shows that the body is held: it is taken as held",
    "inertia": "its rigid motions are those of a uniform body over its points, of which the modes say that it is not",
}


Damping = float | np.ndarray | Callable[[np.ndarray], Any]


@dataclass(frozen=True, eq=False, repr=False)
class Modes(check.Brief):
    """Undamped, mass-normalised eigenmodes of one body in ascending order, each with its damping ratio.

    They describe the whole body: `shapes.compliance` includes the static response of the modes left out.
    Rigid motions are modes of frequency zero.
    """

    omega: np.ndarray  # (n_modes,) [rad/s]
    damping_ratio: np.ndarray  # (n_modes,) [-] fraction of critical damping; overdamped above 1
    shapes: Shapes
    mass: float  # [kg] of the whole body
    frequency_error: np.ndarray | None = None  # (n_modes,) [-] estimated relative error; find_modes always gives it
    bounds: np.ndarray | None = None  # (n_modes, 2) [Hz] guaranteed lower and upper bound of each frequency
    notes: tuple[str, ...] = field(default=(), repr=False)  # what was assumed, and probable slips of a unit
    # The same body described less well in one respect: "mesh", "truncation", "idealisation", each of which may hold
    # poorer ones in turn. Blows with two descriptions that differ in one respect differ by this part of `Error`
    poorer: Mapping[str, "Modes"] = field(default_factory=dict, repr=False)
    section: Plate | Beam | None = field(default=None, repr=False)  # None if not known, as that of a scaled body
    thick: bool = field(default=False, repr=False)  # whether shear and rotary inertia are in them
    air: bool = field(default=False, repr=False)  # whether the air around the body is in them
    stretches: bool = field(default=False, repr=False)  # whether a blow lets them stretch the body, see `stretching`
    # what nobody said of it, of "compliance", "free" and, of modes that were picked, exact "shapes"
    unstated: tuple[str, ...] = field(default=(), repr=False)
    # (n_modes,) [-] estimated error of damping ratios that were computed, by the sound radiated; None if all are stated
    damping_error: np.ndarray | None = None

    def __post_init__(self) -> None:
        omega = check.ascending("omega", self.omega, "rad/s")
        damping = check.array("damping_ratio", self.damping_ratio, omega.shape)
        if (damping < 0.0).any():
            raise ValueError(f"damping_ratio must not be negative, got {damping.min():g}")
        check.settle(self, omega=omega, damping_ratio=damping, mass=check.positive("mass", self.mass, "kg"))
        check.lock_arrays(self)

    @classmethod
    def rigid(cls, mass: float) -> "Modes":
        """A rigid mass [kg] free to translate: one mode of frequency zero.

        Examples
        --------
        >>> ball = fi.Modes.rigid(0.2)
        >>> ball.mass, ball.frequencies.tolist()
        (0.2, [0.0])
        """
        mass = check.positive("mass", mass, "kg")
        return cls(np.zeros(1), np.zeros(1), RigidShapes(mass), mass)

    @classmethod
    def from_arrays(
        cls,
        frequencies: "ArrayLike",
        shapes: "ArrayLike",
        *,
        points: "ArrayLike",
        mass: float,
        damping_ratio: Any = 0.0,
        compliance: "ArrayLike | None" = None,
        loads: "ArrayLike | None" = None,
        cells: "ArrayLike | None" = None,
        free: bool | None = None,
        complete: bool = False,
        solid: Any = None,
    ) -> "Modes":
        """Modes known only at points, as from a modal test.

        Parameters
        ----------
        frequencies : array_like, shape (n_modes,) [Hz], ascending; 0 for rigid motions
        shapes : array_like, shape (n_points, n_modes) [kg**-0.5], mass-normalised
        points : array_like, shape (n_points, dimension) [m]
        mass : float [kg] of the whole body
        damping_ratio : float, array (n_modes,) or function of frequency [Hz]
        compliance : array_like, shape (n_points, n_points) [m/N], optional
            Static compliance of the complete body, with inertia relief if it is free. Without it, what the modes left
            out yield is estimated from those given, and a blow counts the error of that estimate.
        loads : array_like, shape (n_loads,), optional
            Numbers of the points, from 0, of which ``compliance`` has columns, (n_points, n_loads): it is then
            estimated at the others.
        cells : array_like, shape (n_cells, dimension + 1), optional
            Numbers of the points that lines or triangles connect, from 0; pictures need them.
        free : bool, optional
            Whether nothing holds the body. True adds its rigid motions if none are among the modes: those of a uniform
            body over its points; if its modes say that it is not uniform, a blow counts the error. Without it, a body
            without rigid motions is taken as held if one of its low modes carries along a quarter of its mass, more
            at fewer than 8 points; otherwise a blow counts what rigid motions would change as an error.
        complete : bool
            Whether these modes are all there is, as of masses on springs: nothing is left out, nothing else is free.
        solid : Material, (E [Pa], nu), True or False, optional
            Of a solid mesh, isotropic: its ``compliance`` contains the dent of each load, which a contact law has,
            too. It is taken out by the deflections around, on a surface flat there. True if the material is not
            known: the dent is an error. False if there is none, as of shells and beams. Without it, a compliance that
            shows a dent counts it as an error.

        Raises
        ------
        ValueError
            If lengths disagree, a number is not finite or frequencies do not ascend; or if a free body has a mode that
            carries its mass along, or points that do not determine its rigid motions.

        Examples
        --------
        >>> shapes = np.array([[1.2, 0.4], [0.9, -1.1]])  # kg**-0.5, at two points
        >>> modes = fi.Modes.from_arrays([110.0, 340.0], shapes, points=[(0.1, 0.1), (0.3, 0.1)], mass=0.5)
        >>> modes.shape_at([(0.3, 0.1)]).tolist()
        [[0.9, -1.1]]
        """
        omega = 2.0 * np.pi * check.ascending("frequencies", frequencies, "Hz")
        if not len(omega):
            raise ValueError("frequencies must not be empty")
        points = cell_kinds.places(points)
        values = check.array("shapes", shapes, (len(points), len(omega)), "kg**-0.5")
        mass, connected = check.positive("mass", mass, "kg"), cell_kinds.numbered_cells(cells, points)
        damping = damping_ratios(damping_ratio, omega)
        if not values.any():
            raise ValueError("shapes must move at least one point in one mode, got zeros only")
        cell_kinds.refuse_contradicting(points, values)
        span = unstated.unfold_points(points).shape[1]
        if span >= min(points.shape[1], 2):  # along a line, two modes may look alike
            cell_kinds.refuse_twice(omega / (2.0 * np.pi), values, "shapes")
        complete, free = check.flag("complete", complete), None if free is None else check.flag("free", free)
        if complete and (compliance is not None or free):
            raise ValueError("complete must be False if compliance is given or free is True; leave it out")
        loose, error, doubt = None, 0.0, None
        if not complete and omega[0] > 0.0 and free is not False:
            loose, error = unstated.loose_motions(points, connected, values, mass, free)
        if free and loose is not None:
            still = np.zeros(loose.shape[1])
            omega, damping, values = np.append(still, omega), np.append(still, damping), np.hstack([loose, values])
            loose, doubt = None, np.where(omega > 0.0, 0.0, np.full(values.shape, error))[None] if error else None
        rest, known = None, unstated.numbers_of_points(loads, len(points), compliance is not None)
        given = np.zeros((len(points), len(known))) if compliance is None else compliance
        static = check.array("compliance", given, (len(points), len(known)), "m/N")
        if len(known) < len(points) and not complete and omega[-1] > 0.0:
            rest = np.column_stack(unstated.estimate_left_out(omega, values, mass, span))
            rest[known] = 0.0
        flexible = omega > 0.0
        yields = values[:, flexible] / omega[flexible]
        sampled = SampledShapes(points, values, static, connected, rest, loose, known, yields, doubt)
        gaps = ("compliance", rest), ("free", loose), ("inertia", doubt)
        missing = tuple(name for name, what in gaps if what is not None)
        along = plausible.moved_along(np.where(flexible, (values**2).mean(axis=0), 0.0))
        odd: tuple[str, ...] = ()
        if not complete:
            odd = plausible.imported_notes(points, values[:, None, along], mass, omega[along] / (2.0 * np.pi))
            odd += plausible.disordered(points, values[:, flexible])
            turned = plausible.notes_on_rigid(values[:, ~flexible], mass, 0 if free is False else span)
            squares = unstated.mean_squares(points, connected, values[:, None, flexible])
            odd += turned or plausible.notes_on_mass(squares, mass)
        notes = (*odd, *plausible.notes_on_damping(damping, omega), *(UNSTATED[name] for name in missing))
        made, said = cls(omega, damping, sampled, mass, notes=notes, unstated=missing), dents.stated_material(solid)
        return made if said == () else dents.settle_dents(made, dents.of_points(points, static, known), said)

    @classmethod
    def from_uff(
        cls,
        path: Any,
        *,
        mass: float,
        direction: str = "z",
        compliance: "ArrayLike | None" = None,
        free: bool | None = None,
    ) -> "Modes":
        """Read measured modes from a universal file (nodes in data set 15 or 2411, shapes in 55, elements in 2412).

        Needs pyuff.

        Parameters
        ----------
        path : str or Path
        mass : float [kg] of the whole body
        direction : "x", "y" or "z", the direction of the strike and of the measurement
        compliance, free : optional
            As in `from_arrays`; no universal file holds them.

        Returns
        -------
        Modes
            Known only at the measured points, with the elements between them if the file has some; shapes are divided
            by the root of the modal mass in the file.
        """
        path, direction = check.path("path", path), check.one_of("direction", direction, "xyz")
        found = isolated.read_apart(path, "a universal file", universal_files.READER)
        damping = universal_files.damping_of(path.name, found["frequencies"], found["damping_ratio"])
        shapes = found["shapes"][:, "xyz".index(direction)]
        if not shapes.any():
            raise ValueError(f"direction must be one along which {path.name} has motions, got {direction!r}")
        keep = cell_kinds.differing_axes(found["nodes"], direction)
        cells = found["lines" if len(keep) == 1 else "triangles"]
        return cls.from_arrays(
            found["frequencies"], shapes, points=found["nodes"][:, keep], mass=mass,
            damping_ratio=damping, compliance=compliance, cells=cells if len(cells) else None, free=free,
        )  # fmt: skip

    @classmethod
    def from_frf(
        cls,
        frf: Any,
        *,
        mass: float,
        points: "ArrayLike | None" = None,
        driving: Any = None,
        frequencies: "ArrayLike | None" = None,
        compliance: "ArrayLike | None" = None,
        free: bool | None = None,
        pick: bool = True,
    ) -> "Modes":
        """Modes at the peaks of measured frequency responses, or modes that follow these as they are.

        Parameters
        ----------
        frf : xarray.Dataset
            As `fi.frf` returns it, of taps or of a universal file; one of its channels must be measured where the body
            is struck. A roving hammer and a roving sensor serve alike.
        mass : float [kg] of the whole body
        points : array_like, shape (n_channels, dimension) [m], optional
            Where each channel is measured (with a roving hammer, struck); by default as the file states it. Channels
            across the direction of the blow are left out.
        driving : int or str, optional
            The channel at the point struck; by default as the nodes of the file state.
        frequencies : array_like, shape (n_modes,) [Hz], optional
            About where modes are; by default at the peaks.
        compliance, free : optional
            As in `from_arrays`. Without ``compliance`` what the modes left out yield is not known: it is estimated, and
            a blow counts the error of that estimate.
        pick : bool
            Whether modes are those at peaks. False takes as many as it needs to follow the response at the point
            struck, none with a negative amplitude, so that the body is causal and passive; what this changed of the
            response, noise (by the errors or coherence in ``frf``) and a record that ends too early are errors of its
            shapes. What is left out above the band is measured, too, and below the band it moves rigidly if the lowest
            lines do. ``frequencies`` and ``compliance`` are then left out.

        Returns
        -------
        Modes
            Known only at the points, with frequencies and damping ratios refined together with the shapes; its notes
            state what share of the responses they leave unexplained, and the delays of channels that are taken off.

        Raises
        ------
        ValueError
            If ``frf`` has no peaks, no channel at the point struck or no points, or that channel has the wrong sign.

        References
        ----------
        Ewins (2000), Modal Testing, chapter 4.

        Examples
        --------
        >>> bar = fi.Modes.from_arrays(
        ...     [120.0, 410.0], [[1.2, 0.9], [0.7, -1.1]], points=[[0.0], [1.0]], mass=1.0, damping_ratio=0.02
        ... )
        >>> hit = fi.strike(bar, fi.Striker.rigid(0.02), fi.Contact.linear(1e5), at=[0.0], speed=1.0)
        >>> tap = fi.measure(hit, rate=12800.0, at=[[0.0], [1.0]], duration=1.0)
        >>> found = fi.Modes.from_frf(fi.frf(tap), mass=1.0, points=[[0.0], [1.0]], driving=0)
        >>> found.frequencies.round().tolist(), found.damping_ratio.round(3).tolist()
        ([120.0, 410.0], [0.02, 0.02])
        """
        sampled: Any
        if not check.flag("pick", pick):
            if frequencies is not None or compliance is not None:
                raise ValueError(
                    "frequencies and compliance must be left out if pick is False: the responses give them"
                )
            body = followed.body_of(frf, driving, points)
            made = cls.from_arrays(**body.arrays, mass=mass, free=False)
            sampled = made.shapes
            rest = np.zeros((len(sampled.points), 2)) if sampled.rest is None else sampled.rest.copy()
            rest[body.driving] = body.rest
            loose = body.loose if free is None else 0.0
            rigid = np.full((len(rest), 1), loose) if loose else None
            known = replace(sampled, rest=rest, doubt=body.doubt, rigid=rigid)
            said = ("shapes", *(("free",) if loose else ()))
            return replace(made, shapes=known, notes=tuple(body.notes), unstated=said)
        arrays, errors, notes = picked.modes_of(frf, driving, points, frequencies)
        made = cls.from_arrays(**arrays, mass=mass, compliance=compliance, free=free)
        sure = np.zeros((len(errors), made.n_modes - errors.shape[1]))
        sampled = made.shapes
        ways = [np.hstack([sure, errors])[None], *([] if sampled.doubt is None else [sampled.doubt])]
        shapes = replace(sampled, doubt=np.concatenate(ways))
        return replace(made, shapes=shapes, notes=(*made.notes, *notes), unstated=(*made.unstated, "shapes"))

    @cached_property
    def known(self) -> Remembered:  # what was found of these modes at points where they were struck
        return Remembered(REMEMBERED)

    @cached_property
    def n_modes(self) -> int:
        return len(self.omega)

    @property
    def frequencies(self) -> np.ndarray:
        """Natural frequencies, (n_modes,) [Hz]."""
        return self.omega / (2.0 * np.pi)

    @cached_property
    def n_rigid(self) -> int:
        """Number of rigid motions (modes of frequency zero)."""
        return int(np.count_nonzero(self.omega == 0.0))

    @cached_property
    def dimension(self) -> int:
        """Number of coordinates of a point on the body: 2 on a plate, 1 on a beam, 0 for a rigid mass."""
        return self.shapes.dimension

    @property
    def continuous(self) -> bool:
        """Whether the shapes are known between the points of their grid, too; those of a modal test are not."""
        points, cells = self.shapes.grid()
        return cells.shape[1] > 1 and bool(self.shapes.contains(points[cells[:1]].mean(axis=1)).all())

    def _repr_html_(self) -> str:
        """Table of the first modes, for notebooks."""
        shown = 10  # without scrolling
        columns = [self.frequencies[:shown], self.damping_ratio[:shown]]
        head, forms = ["mode", "frequency", "damping ratio"], ["{:.5g} Hz", "{:.3g}"]
        if self.frequency_error is not None:
            columns, head, forms = [*columns, self.frequency_error], [*head, "estimated error"], [*forms, "{:.0e}"]
        rows = [(i, *map(str.format, forms, row)) for i, row in enumerate(zip(*columns), 1)]
        more = f" The first {shown}:" if self.n_modes > shown else ""
        span = f"{self.n_modes} modes up to {self.frequencies[-1]:.5g} Hz of a body of {self.mass:.4g} kg."
        return f"<p>{span}{more}</p>{markup.table(rows, head)}{markup.note_list(self.notes)}"

    def to_pyvista(self) -> Any:
        """The body as a `pyvista.UnstructuredGrid`, refined until smooth to the eye.

        Point arrays ``mode_001`` ... hold the shapes [kg**-0.5], field data ``frequency`` [Hz] and ``damping_ratio``.
        """
        import pyvista  # loads all of VTK, which few need

        points, cells = viewing.grid(self)
        kind = {1: pyvista.CellType.VERTEX, 2: pyvista.CellType.LINE, 3: pyvista.CellType.TRIANGLE}[cells.shape[1]]
        made = pyvista.UnstructuredGrid({kind: cells}, viewing.places_in_space(self, points))
        for i, shape in enumerate(self.shapes.at(points).T, 1):
            made.point_data[f"mode_{i:03d}"] = shape
        made.field_data["frequency"], made.field_data["damping_ratio"] = self.frequencies, self.damping_ratio
        return made

    def points(self, name: str, points: Any) -> np.ndarray:
        """Return points as (n_points, dimension) [m]; raise ValueError if one is not on the body."""
        if self.dimension == 0:
            n_points = 1 if points is None else len(np.atleast_2d(check.numbers(name, points, "m")))
            return np.zeros((max(1, n_points), 0))
        array = check.places(name, points, self.dimension)

        def inside() -> None:
            check.on_body(name, array, self.shapes.contains(array), self.shapes.grid()[0])

        if len(array) == 1:
            self.known.recall(("inside", array.tobytes()), inside)
        else:
            inside()
        return array

    def shape_at(self, points: Any) -> np.ndarray:
        """Mass-normalised shapes at points on the body, (n_points, n_modes) [kg**-0.5]."""
        return self.shapes.at(self.points("points", points))

    def point(self, name: str, at: Any) -> np.ndarray:
        """Return one point as (1, dimension) [m]; raise ValueError unless it is a single point on the body."""
        found = self.points(name, at)
        if len(found) != 1:
            raise ValueError(f"{name} must be one point, got {len(found)}")
        return found

    def rigid_motion(self, at: Any) -> np.ndarray:
        """Modal velocities (n_modes,) [kg**0.5] of a rigid motion that moves the point ``at`` [m] at unit speed.

        The body translates if its supports allow that; otherwise it turns about its hinge.
        """
        point = self.point("at", at)
        result = np.zeros(self.n_modes)
        rigid = self.shapes.take(self.n_rigid) if self.n_rigid else None
        if rigid is None or not rigid.at(point).any():
            raise ValueError(
                "at must be a point that moves in a rigid motion, got one at rest; change at or the supports"
            )
        corners = self.shapes.grid()[0]
        everywhere = rigid.at(corners)  # (n_points, n_rigid)
        straight = np.linalg.lstsq(everywhere, np.ones(len(corners)), rcond=None)[0]
        if np.abs(everywhere @ straight - 1.0).max() > 1e-6:
            if self.n_rigid > 1 and self.dimension > 2:
                raise ValueError(
                    "speed needs a body whose points all move along one direction, as of `Body.modes` with a vector; "
                    "along normals its motion before the blow is not defined: give `Striker.of`"
                )
            row = rigid.at(point)[0]
            straight = row / (row @ row)
        result[: self.n_rigid] = straight / (rigid.at(point)[0] @ straight)
        return result

    def modal_compliance(self, points: Any) -> np.ndarray:
        """Static compliance of the kept modes between points, (n_points, n_points) [m/N]."""
        rows = self.shape_at(points)
        return carried_compliance(self.omega, rows, rows)

    def residual_compliance(self, points: Any) -> np.ndarray:
        """Static compliance of the modes left out, (n_points, n_points) [m/N].

        Raises
        ------
        SimulationError
            If the kept modes are softer than the whole body by more than the errors of both allow.
        """
        place = self.points("points", points)
        return left_out(self, place, self.shapes.at(place))[0]

    def scaled(self, *, mass: float | None = None, first_frequency: float | None = None) -> "Modes":
        """The same body with another mass [kg] or lowest flexible frequency [Hz]; its size stays the same."""
        mass = self.mass if mass is None else check.positive("mass", mass, "kg")
        ratio = 1.0
        if first_frequency is not None:
            flexible = self.frequencies[self.omega > 0.0]
            if not flexible.size:
                raise ValueError("first_frequency needs a flexible mode; these modes are rigid")
            ratio = check.positive("first_frequency", first_frequency, "Hz") / flexible[0]
            if flexible[-1] * ratio > HIGHEST:
                raise ValueError(
                    f"first_frequency must keep the last frequency below {HIGHEST:g} Hz, got {first_frequency:g} Hz"
                )
        return self.stretched(mass / self.mass, float(ratio))

    def stretched(self, mass: float, frequency: float) -> "Modes":
        """The same body with its mass and all frequencies multiplied by these factors [-]."""
        reach = check.REACH**2  # that of ratios
        mass = check.positive("mass", mass, reach=reach)
        frequency = check.positive("frequency", frequency, reach=reach)
        shapes = ScaledShapes(self.shapes, float(mass**-0.5), frequency)
        bounds = None if self.bounds is None else self.bounds * frequency
        poorer = {cause: modes.stretched(mass, frequency) for cause, modes in self.poorer.items()}
        section = self.section if mass == frequency == 1.0 else None
        scaled: dict[str, Any] = {"shapes": shapes, "mass": self.mass * mass, "bounds": bounds, "poorer": poorer}
        return replace(self, omega=self.omega * frequency, section=section, **scaled)

    def descriptions(self) -> dict[frozenset[str], "Modes"]:
        """This and all poorer descriptions of the body, by what each describes less well."""
        found = {frozenset[str](): self}
        for cause, other in self.poorer.items():
            found |= {lacking | {cause}: each for lacking, each in other.descriptions().items()}
        return found

    def truncated(self, *, max_frequency: float | None = None, n_modes: int | None = None) -> "Modes":
        """The lowest modes only, up to a frequency [Hz] or a number; the residual compliance replaces the others."""
        keep = self.n_modes
        if max_frequency is not None:
            limit = check.non_negative("max_frequency", max_frequency, "Hz")
            keep = int(np.searchsorted(self.frequencies, limit, side="right"))
        if n_modes is not None:
            keep = min(keep, check.count("n_modes", n_modes))
        if keep == 0:
            raise ValueError(f"max_frequency must reach the first mode at {self.frequencies[0]:g} Hz")
        each = ("omega", "damping_ratio", "frequency_error", "bounds", "damping_error")
        fields = {name: getattr(self, name) for name in each}
        kept: dict[str, Any] = {name: x if x is None else x[:keep].copy() for name, x in fields.items()}
        poorer = dict(self.poorer)
        if max_frequency is not None:  # a poorer first mode may lie higher
            for cause, modes in poorer.items():
                poorer[cause] = modes.truncated(max_frequency=max(limit, float(modes.frequencies[0])))
        return replace(self, shapes=self.shapes.take(keep), poorer=poorer, **kept)

    def damped(self, damping_ratio: Damping) -> "Modes":
        """The same modes with other damping ratios: a number, an array (n_modes,) or a function of frequency [Hz]."""
        ratios = damping_ratios(damping_ratio, self.omega)
        before = plausible.notes_on_damping(self.damping_ratio, self.omega)
        others = [note for note in self.notes if note not in before]
        notes = plausible.together(others, plausible.notes_on_damping(ratios, self.omega))
        poorer = {cause: modes.damped(damping_ratio) for cause, modes in self.poorer.items()}
        return replace(self, damping_ratio=ratios, notes=notes, poorer=poorer, damping_error=None)


def at_rest(modes: "Modes", point: np.ndarray) -> tuple[str, ...]:
    """A note if a point (1, dimension) [m] of a body that vibrates cannot move itself."""
    flexible, typical = modes.omega[modes.omega > 0.0], SAME * modes.mass**-0.5
    if not modes.dimension or not len(flexible) or np.abs(modes.shapes.at(point)).max() > typical:
        return ()
    everywhere = modes.shapes.at(modes.shapes.grid()[0])  # zero for a body treated as rigid
    softness = modes.shapes.compliance(point)[0, 0] * modes.mass * flexible[0] ** 2
    if np.abs(everywhere).max() <= typical or softness > SAME:
        return ()
    where = ", ".join(f"{x:g}" for x in point[0])
    return (f"the point struck, ({where}) m, cannot move: it lies on a support, and the blow is that on a wall",)


def carried_compliance(omega: np.ndarray, moved: np.ndarray, pushed: np.ndarray, weight: Any = 1.0) -> np.ndarray:
    """Static compliance (n_points, n_loads) [m/N] of modes, times their weights, by shapes at points and at loads."""
    flexible = omega > 0.0
    at_points, at_loads = (rows[:, flexible] / omega[flexible] for rows in (moved, pushed))
    return (weight * at_points) @ at_loads.T


def left_out_between(modes: "Modes", loads: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Static deflection of the modes left out at points under unit forces at loads, (n_points, n_loads) [m/N]."""
    if not len(points):
        return np.zeros((0, len(loads)))
    moved, pushed = (modes.shapes.at(place) for place in (points, loads))
    return np.asarray(modes.shapes.deflection(loads, points) - carried_compliance(modes.omega, moved, pushed))


def left_out(modes: "Modes", place: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`Modes.residual_compliance` at points with known shapes (n_points, n_modes), and the error of its diagonal.

    The error is (n_points,) [m/N].
    """
    whole = modes.shapes.compliance(place)
    rest = whole - carried_compliance(modes.omega, rows, rows)
    doubt = np.abs(np.diag(whole)) * (modes.shapes.compliance_error(place) + ROUNDING)
    if modes.frequency_error is not None:
        # cautious, of a mode's compliance over its frequency's: 2 by omega**-2, the rest for its shape
        doubt = doubt + np.diag(
            carried_compliance(modes.omega, rows, rows, 10.0 * modes.frequency_error[modes.omega > 0.0])
        )
    allowed = doubt + SAME * np.abs(np.diag(whole))
    dent = modes.shapes.dent(place)[:, 0]
    if dent.any():  # short waves dent a solid, too: modes may hold more of the dent than was left of the compliance
        beyond = np.minimum(np.maximum(-np.diag(rest), 0.0), np.maximum(dent, 0.0))
        doubt, rest = doubt + beyond, rest + np.diag(beyond)
    if modes.omega[-1] > 0.0:  # at a support both compliances are pure rounding
        allowed += ROUNDING / (modes.mass * modes.omega[modes.omega > 0.0][0] ** 2)
    for i in np.flatnonzero(np.diag(rest) < -allowed):
        where = ", ".join(f"{x:g}" for x in place[i])
        raise check.SimulationError(
            f"the modes are softer at ({where}) m than the whole body, {whole[i, i]:.4g} m/N, by "
            f"{-rest[i, i]:.2g} m/N, which is more than their errors allow; find the modes on a finer mesh, "
            "give the compliance of the whole body, or 0 Hz for rigid motions, where it has none of them"
        )
    return rest, doubt


def damping_ratios(damping_ratio: Any, omega: np.ndarray) -> np.ndarray:
    """Return the damping ratio of each mode, (n_modes,) [-]; rigid modes get zero.

    ``damping_ratio`` is a number, an array (n_modes,) or a function of the flexible frequencies [Hz].
    """
    result = np.zeros(len(omega))
    flexible = omega > 0.0
    if callable(damping_ratio):
        result[flexible] = check.field("damping_ratio", damping_ratio, omega[flexible] / (2.0 * np.pi))
    elif isinstance(damping_ratio, (list, tuple)) or (isinstance(damping_ratio, np.ndarray) and damping_ratio.ndim):
        result = check.array("damping_ratio", damping_ratio, omega.shape)
    else:
        result[flexible] = check.non_negative("damping_ratio", damping_ratio)
    if (result < 0.0).any():
        raise ValueError(f"damping_ratio must not be negative, got {result.min():g}")
    return result


def rayleigh(mass_factor: float, stiffness_factor: float) -> Callable[[np.ndarray], np.ndarray]:
    """Damping ratio as a function of frequency [Hz] for C = mass_factor M + stiffness_factor K ([1/s], [s]).

    Examples
    --------
    >>> damping = fi.rayleigh(20.0, 1e-6)  # 1/s, s
    >>> damping(np.array([50.0, 500.0])).round(4).tolist()  # at 50 and 500 Hz
    [0.032, 0.0048]
    """
    mass_factor = check.non_negative("mass_factor", mass_factor, "1/s")
    stiffness_factor = check.non_negative("stiffness_factor", stiffness_factor, "s")

    def ratio(frequency: np.ndarray) -> np.ndarray:
        omega = 2.0 * np.pi * check.finite("frequency", check.numbers("frequency", frequency, "Hz"), "Hz")
        if (omega <= 0.0).any():
            raise ValueError(f"frequency must be positive, got {omega.min() / (2.0 * np.pi):g} Hz")
        return 0.5 * (mass_factor / omega + stiffness_factor * omega)

    return ratio
