"""The blows of a page without a server: every mass, stiffness, speed and place of a grid, struck beforehand."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely

from .._base.check import SimulationError
from ..sweeps.grid import Case
from .explore_map import MORE, Picture, Window
from .explore_model import Settings, Setup, limit_of
from .explore_numbers import Explorer, Point

COUNTS = {"mass": 11, "stiffness": 11, "speed": 5}  # [-] positions of the sliders; odd, so that one is the scene's
SPANS = {"mass": 10.0, "stiffness": 100.0, "speed": 4.0}  # [-] slider end over the scene's value
STEPS = 65535  # [-] of a 16-bit integer, over which each curve's times and forces are spread
NAMES = ("n_impacts", "peak_force", "contact_time", "restitution", "error", "model_error")


@dataclass(frozen=True, eq=False)
class Shown:
    """A blow as the page holds it: its numbers, and the points between which its force is a straight line."""

    numbers: tuple[float, ...]  # of NAMES; NaN if the blow failed
    met: bool  # whether it meets the tolerance
    time: np.ndarray  # (n_points,) [-] of `end`, times STEPS
    force: np.ndarray  # (n_points,) [-] of `top`, times STEPS
    end: float  # [s]
    top: float  # [N]
    missed: float  # [-] of the peak, by which the points miss the force
    spectrum_missed: float  # [-] of the impulse, by which the spectrum of the points misses that of the force at most


def kept_points(time: np.ndarray, force: np.ndarray, most: float) -> np.ndarray:
    """Samples (n_kept,) of a curve (n_times,) that straight lines join without missing it by more than ``most`` [N].

    References
    ----------
    Douglas and Peucker (1973), Cartographica 10, 112-122, by GEOS, stretched until distances are along the
    force.
    """
    steep = float(np.abs(np.diff(force) / np.diff(time)).max()) or 1.0
    stretched = 1e4 * steep * time
    kept = shapely.LineString(np.column_stack([stretched, force])).simplify(most, preserve_topology=False)
    return np.searchsorted(stretched, shapely.get_coordinates(kept)[:, 0])


@dataclass(frozen=True, eq=False)
class Lesson:
    """All blows of a page, the maps behind them, and what the page itself errs by."""

    setup: Setup
    places: tuple[Point, ...]  # along a line from the middle through the scene's strike point to the edge
    axes: dict[str, np.ndarray]  # mass [kg], stiffness [-] over the scene's, speed [m/s]
    blows: tuple[Shown, ...]  # by place, speed, stiffness and mass, the last one fastest
    maps: tuple[Picture, ...]  # by place and speed
    limits: np.ndarray  # (n_places, n_masses) [Hz] as `limit_of`
    tolerance: float  # [-] of the blows

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Numbers of places, speeds, stiffnesses and masses."""
        return len(self.places), *(len(self.axes[name]) for name in ("speed", "stiffness", "mass"))  # type: ignore[return-value]

    @cached_property
    def all_numbers(self) -> np.ndarray:
        """Numbers of all blows, (n_places, n_speeds, n_stiffnesses, n_masses, len(NAMES)); NaN where one failed."""
        return np.array([blow.numbers for blow in self.blows]).reshape(*self.shape, len(NAMES))

    def quantity(self, name: str) -> np.ndarray:
        """One of NAMES of all blows, (n_places, n_speeds, n_stiffnesses, n_masses)."""
        found: np.ndarray = self.all_numbers[..., NAMES.index(name)]
        return found

    @property
    def start(self) -> tuple[int, int, int, int]:
        """Position of the scene's own blow: its place, speed, stiffness and mass."""
        place = self.places.index(self.setup.start.at)
        _, *middle = (n // 2 for n in self.shape)
        return place, middle[0], middle[1], middle[2]

    def settings(self, place: int, speed: int, stiffness: int, mass: int) -> Settings:
        """What the sliders set at a position."""
        return settings_at(self.setup, self.axes, self.places[place], speed, stiffness, mass)

    @property
    def unlike(self) -> int:
        """Number of blows that the map counts otherwise than they are."""
        wrong = 0
        for picture, counts in zip(self.maps, self.quantity("n_impacts").reshape(len(self.maps), *self.shape[2:])):
            rows, columns = (
                np.abs(np.log(grid[:, None] / axis)).argmin(axis=0)
                for grid, axis in ((picture.stiffness, self.axes["stiffness"]), (picture.mass, self.axes["mass"]))
            )
            drawn = picture.n_impacts[np.ix_(rows, columns)]
            wrong += int((drawn != np.minimum(np.nan_to_num(counts, nan=-1.0), MORE)).sum())
        return wrong


def settings_at(
    setup: Setup, axes: dict[str, np.ndarray], place: Point, speed: int, stiffness: int, mass: int
) -> Settings:
    """What the sliders set at one position of each axis."""
    there = {name: float(axes[name][i]) for name, i in (("mass", mass), ("stiffness", stiffness), ("speed", speed))}
    return replace(setup.start, at=place, **there)


def places_of(setup: Setup) -> tuple[Point, ...]:
    """Strike points on the line from the middle of the body through the scene's, which is one of them, to the edge."""
    at = np.asarray(setup.start.at)
    if not len(at):
        return (setup.start.at,)
    low, high = setup.mesh.points.min(axis=0), setup.mesh.points.max(axis=0)
    middle = 0.5 * (low + high)
    way = at - middle
    if np.abs(way).max() < 0.05 * np.abs(high - low).max():  # struck in the middle: along the first axis instead
        way = np.eye(len(at))[0] * 0.25 * (high - low)[0]

    def on_body(share: float) -> Point | None:
        return setup.place(*(middle + share * way))

    shares = np.linspace(0.0, 1.0, 101) * float(np.linalg.norm(high - low) / np.linalg.norm(way))
    reach = next((share for share in shares[shares > 1.0] if on_body(share) is None), shares[-1])
    # not on the edge, where a body that is held does not move
    wanted = {share: on_body(share) for share in (0.0, 0.5, 0.9 * reach)}
    wanted[1.0 if np.array_equal(way, at - middle) else 0.0] = setup.start.at
    points = [wanted[share] for share in sorted(wanted)]
    return tuple(dict.fromkeys(point for point in points if point is not None and not setup.at_rest(point)))


def strike_grid(setup: Setup, watch: Callable[[int, int], None]) -> Lesson:
    """Strike all blows of a page; ``watch`` is called with how many are done, and of how many."""
    explorer, tolerance = Explorer(setup), max(3e-3, setup.tolerance)  # the page shows three digits
    start, places = setup.start, places_of(setup)
    axes = {
        name: float(getattr(start, name)) * np.geomspace(1.0 / SPANS[name], SPANS[name], n)
        for name, n in COUNTS.items()
    }
    for name, values in axes.items():
        values[len(values) // 2] = getattr(start, name)  # exactly
    window = Window(*((float(axes[name][0]), float(axes[name][-1])) for name in ("mass", "stiffness")))
    blows: list[Shown] = []
    maps, limits = [], []
    total = len(places) * math.prod(COUNTS.values())
    for place in places:
        body = explorer.look(place).body
        cells = [setup.case(replace(start, at=place, mass=float(mass)), body=body) for mass in axes["mass"]]
        limits.append([limit_of(case) for case in cells])
        law = cells[0].contact  # whether faster blows are the same: with linear contacts and bodies
        alike = law.exponent == 1.0 and not (law.gap or law.lossy or law.special or cells[0].modes.stretches)
        for speed in range(COUNTS["speed"]):
            about, mapper = settings_at(setup, axes, place, speed, 0, 0), explorer.mapper
            picture = mapper.finer(about, mapper.first(about, window, body), body)
            maps.append(mapper.sharp(about, picture, body) if mapper.batched else picture)  # where blows are quick
            if speed and alike:  # but for their force; what the model errs by is not known of them
                ratio = axes["speed"][speed] / axes["speed"][speed - 1]
                for blow in blows[-COUNTS["stiffness"] * COUNTS["mass"] :]:
                    numbers = dict(zip(NAMES, blow.numbers))
                    numbers |= {"peak_force": numbers["peak_force"] * ratio, "model_error": math.nan}
                    blows.append(replace(blow, numbers=tuple(numbers.values()), top=blow.top * ratio))
                continue
            for stiffness in range(COUNTS["stiffness"]):
                for mass in range(COUNTS["mass"]):
                    settings = settings_at(setup, axes, place, speed, stiffness, mass)
                    case = replace(cells[mass], contact=setup.law(settings), speed=settings.speed)  # the same striker
                    blows.append(shown_blow(case, tolerance))
                watch(len(blows), total)
    return Lesson(setup, places, axes, tuple(blows), tuple(maps), np.array(limits), tolerance)


def shown_blow(case: Case, tolerance: float) -> Shown:
    """A blow as the page holds it."""
    try:
        hit = case.blow(tolerance=tolerance)
    except SimulationError:
        none = np.zeros(2)
        return Shown((math.nan,) * len(NAMES), False, none, none, 1.0, 0.0, 0.0, 0.0)
    end = 1.05 * hit.impacts[-1].end if hit.impacts else float(hit.time[-1])
    during = hit.time <= end
    time, force = hit.time[during], hit.force[during]
    last, top = float(time[-1]), float(force.max()) or 1.0
    points = kept_points(time, force, 1e-3 * top)  # a quarter of a pixel
    kept = np.rint(STEPS * time[points] / last), np.rint(STEPS * force[points] / top)
    apart = np.abs(np.interp(time, kept[0] * last / STEPS, kept[1] * top / STEPS) - force)
    # no spectrum errs by more than the area between the curves
    missed = float(apart.max() / top), float(np.trapezoid(apart, time) / hit.impulse) if hit.impacts else 0.0
    error = hit.error.total if hit.error.resolvable else math.inf
    numbers = (
        hit.n_impacts,
        hit.peak_force,
        hit.contact_time,
        math.nan if hit.restitution is None else hit.restitution,
        error,
        hit.model_error,
    )
    return Shown(tuple(map(float, numbers)), hit.tolerance_met, *kept, last, top, *missed)
