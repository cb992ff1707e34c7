"""Taking material off a plate or bar in round dishes: the section that is left, and what each dish does to modes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from .._base import check
from .._base.rounding import SAME
from ..fe.section import Beam, Plate, size_at
from ..fe.slopes import quadrature
from ..fe.system import System
from ..fe.variation import SectionChange, frequency_densities
from .pitches import CENTS

FINER = 3  # [-] odd: points to look at how deep dishes are together, for each place; a choice: within 4 % on plates
PER_CENT = CENTS / np.log(2.0)  # [-] fact: cents of a relative change


def dish_profile(square: np.ndarray) -> np.ndarray:
    """Depth of a dish over that in its middle, at squared distances over its squared radius: smooth everywhere."""
    return np.asarray(np.exp(-3.0 * square))


@dataclass(frozen=True, eq=False)
class Dishes:
    """Dishes of one radius, ``depth exp(-3 (r / radius)**2)`` deep at a distance r from their middles.

    At the radius a twentieth of the depth is left. On a bar they are grooves across its whole width.
    """

    middles: np.ndarray  # (n, dimension) [m]
    depths: np.ndarray  # (n,) [m]
    radius: float  # [m]

    @classmethod
    def of_places(cls, places: Sequence[tuple[np.ndarray, float]], radius: float) -> "Dishes":
        """Those of places (n, dimension) [m] with one depth [m] each."""
        depths = np.repeat([deep for _, deep in places], [len(at) for at, _ in places])
        return cls(np.concatenate([at for at, _ in places]), depths, radius)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Depth [m] taken off at points (n_points, dimension) [m], (n_points,)."""
        if not len(self.middles):
            return np.zeros(len(points))
        return np.asarray(
            dish_profile(((points[:, None] - self.middles) ** 2).sum(axis=2) / self.radius**2) @ self.depths
        )


def thinned_section(section: Any, depth: Any) -> Any:
    """The section after a depth, a function of points (n, dimension) [m] returning (n,) [m], was taken off.

    The thickness of a plate and the height of a bar are less by it; a round bar is turned down, by it all round. The
    middle surface stays where it is.
    """

    def less(name: str, times: float) -> Any:
        return lambda points: size_at(section, name, points) - times * depth(points)

    if isinstance(section, Plate):
        return replace(section, thickness=less("thickness", 1.0))
    if section.round:
        return replace(section, width=less("width", 2.0), height=less("height", 2.0))
    return replace(section, height=less("height", 1.0))


def thickness(section: Any, points: np.ndarray) -> np.ndarray:
    """Thickness of a plate or height of a bar, (n,) [m]."""
    name = "thickness" if isinstance(section, Plate) else "height"
    return size_at(section, name, points)


def check_body(section: Any) -> None:
    """Raise ValueError for a section that nothing can be taken off, or whose slopes are not known."""
    check.instance("section", section, Plate, Beam)
    if isinstance(section, Plate) and section.layers:
        raise ValueError(
            "section must not have layers: what is left of them is not known; take a plate of one material"
        )
    if isinstance(section, Plate) and section.ribs:
        raise ValueError("section must not have ribs here; use fi.design with numbers of the plate or of its ribs")


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """What taking material off does to modes, at all places of a body."""

    tree: Any  # of the places of a quadrature
    places: np.ndarray  # (n, dimension) [m]
    areas: np.ndarray  # (n,) [m^2] of the surface
    cents: np.ndarray  # (n, n_modes) [cents/m] of depth, each with its area

    @classmethod
    def of(cls, system: System, vectors: np.ndarray, omega: np.ndarray) -> "Sensitivity":
        """Of modes with vectors (n_dofs, n_modes) in the frame and frequencies (n_modes,) [rad/s]."""
        section, frame, points = system.section, system.frame, quadrature(system)
        places = frame.to_metres(points.x)
        unit = float(thickness(section, places).min())
        wide: Any = 1.0  # of a plate; of a bar its width, or girth, that dishes are cut into
        if isinstance(section, Beam):
            wide = size_at(section, "width", places) * (np.pi if section.round else 1.0)
        change = SectionChange.by_differences(
            "depth", 1.0, lambda share: thinned_section(section, lambda at: np.full(len(at), (share - 1.0) * unit))
        )
        found = frequency_densities(system, change, vectors, (omega / frame.rate) ** 2)
        dx = points.dx.ravel() * frame.length ** places.shape[1]
        own = PER_CENT / unit * dx[:, None] * found.reshape(len(dx), -1)
        return cls(cKDTree(places), places, dx * wide, own)

    def of_dishes(self, middles: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
        """Cents (n, n_modes) per depth [1/m] of dishes around middles (n, dimension) [m], and volumes (n,) per depth.

        Volumes per depth are areas [m^2]; what lies beyond the edge is not there.
        """
        found, areas = np.zeros((len(middles), self.cents.shape[1])), np.zeros(len(middles))
        for i, near in enumerate(self.tree.query_ball_point(middles, 2.5 * radius)):  # 1e-8 of the depth is left there
            dish = dish_profile(((self.places[near] - middles[i]) ** 2).sum(axis=1) / radius**2)
            found[i], areas[i] = dish @ self.cents[near], dish @ self.areas[near]
        return found, areas


def mirror_images(middle: np.ndarray, axes: str, system: System) -> np.ndarray:
    """A middle (dimension,) and its images in the middle of the body along x, y or both, each once: (n, dimension)."""
    points = system.mesh.points
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    found = middle[None]
    for k in map("xy".index, axes):
        turned = found.copy()
        turned[:, k] = 2.0 * low[k] + size[k] - turned[:, k]
        if np.abs(turned[:, k] - found[:, k]).max() > SAME * size[k]:
            found = np.concatenate([found, turned])
    return found


@dataclass(frozen=True, eq=False)
class Places:
    """Where dishes may be: places all over a body, each with its images."""

    middles: np.ndarray  # (n, dimension) [m]
    owners: np.ndarray  # (n,) number of the place that each belongs to
    radius: float  # [m]
    between: np.ndarray  # (n_between, dimension) [m] a finer lattice, of the half that is mirrored
    gap: float  # [m] farthest that a point lies from this lattice

    @classmethod
    def over(cls, system: System, radius: float, axes: str) -> "Places":
        """Those over the whole body, so close that a dish between two does no more than both."""
        low, size = system.mesh.points.min(axis=0), np.ptp(system.mesh.points, axis=0)
        counts = [FINER * max(2, round(s / (0.5 * radius))) for s in size]
        lines = [a + s * np.linspace(0.0, 1.0, 1 + count) for a, s, count in zip(low, size, counts)]
        for k in map("xy".index, axes):
            lines[k] = lines[k][: 1 + (1 + counts[k]) // 2]
        between, middles = (
            np.stack(np.meshgrid(*(line[::step] for line in lines), indexing="ij"), axis=-1).reshape(-1, len(low))
            for step in (1, FINER)
        )
        groups = [mirror_images(middle, axes, system) for middle in middles]
        groups = [each for each in groups if system.contains(each).all()]
        owners = np.repeat(np.arange(len(groups)), [len(each) for each in groups])
        return cls(np.concatenate(groups), owners, radius, between, float(np.linalg.norm(0.5 * size / counts)))

    @property
    def first(self) -> np.ndarray:
        """One middle of each place, (n_places, dimension) [m]."""
        return self.middles[np.unique(self.owners, return_index=True)[1]]

    def dishes(self, depths: np.ndarray) -> Dishes:
        """Dishes of depths (n_places,) [m]."""
        each = depths[self.owners]
        return Dishes(self.middles[each > 0.0], each[each > 0.0], self.radius)

    def some(self, keep: np.ndarray) -> "Places":
        """Only those places whose numbers are in ``keep``, in that order."""
        found = [np.flatnonzero(self.owners == k) for k in keep]
        owners = np.repeat(np.arange(len(keep)), list(map(len, found)))
        return replace(self, middles=self.middles[np.concatenate(found)], owners=owners)

    def summed(self, values: np.ndarray) -> np.ndarray:
        """Sums (n_places, ...) over the images of values (n, ...)."""
        found = np.zeros((1 + self.owners.max(), *values.shape[1:]))
        np.add.at(found, self.owners, values)
        return found

    @property
    def overlaps(self) -> np.ndarray:
        """Greatest depth about each point of `between` by a dish of depth 1 at each place, (n_between, n_places) [-].

        Where dishes are deepest together, their slopes cancel: at a distance from there, they are less by at most
        `dish_profile`.
        """
        found = self.summed(dish_profile(((self.middles[:, None] - self.between) ** 2).sum(axis=2) / self.radius**2)).T
        return found / dish_profile(np.square(self.gap / self.radius))
