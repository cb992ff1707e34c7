"""The dent of a solid's unit load: what of a static deflection a contact law has already, so that it counts once.

Under a unit load on a half space the surface sinks by ``w(r) = (1 - nu**2) / (pi E r)``, without limit at the load; on
a mesh by what the size of its elements or the patch of the load allows. Around the load, some elements away, a body's
deflection is the same for all meshes and patches: w(r) and a smooth rest. This rest, continued to the load, is what
the body yields there if a contact law has the half space, as Hertz's has. Thin shells have no w(r).

References
----------
Johnson (1985), Contact mechanics, sections 3.2 (point force on a half space) and 4.2 (approach of distant points).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check
from ..fe.material import Material
from .unstated import unfold_points

RINGS = (1.5, 24), (1.5, 48), (2.5, 24), (2.5, 48)  # [-] first distance over that of the nearest node, and nodes: fits
FEWEST = 12  # [-] nodes of a fit, which finds at most seven numbers
SQUARE = 0.97  # [-] cosine up to which a load acts along the normal: 14 degrees
SINGLE = 1e-6  # [-] of a deflection in single precision
KNOWN = "the dent of a half space was taken out of {} unit loads, because the contact law has it"
UNKNOWN = (
    "{} unit loads dent the mesh as they would a solid, and a contact law has that dent already: give solid=, the "
    "material, or False for a shell; until then the dent counts as an error"
)
SOLID = (
    "{} unit loads dent the mesh, whose elements are solid, and a contact law has that dent already: give solid=, the "
    "material; until then the dent counts as an error"
)
TOO_FEW = "around {} unit loads too few nodes of a smooth surface show their dent: all that yields there is an error"


@dataclass(frozen=True)
class Load:
    """A unit load and the static deflection along it around it."""

    point: int  # of the modes
    apart: np.ndarray  # (n, 3) [m] places of nodes relative to it, the third coordinate along it
    deflection: np.ndarray  # (n,) [m/N]
    own: float  # [m/N] at the load
    square: bool = True  # whether it acts along the normal

    def on_surface(self) -> "Load":
        """The same with the nodes of the surface around it alone, if it acts along the normal."""
        near = np.abs(self.apart[:, 2]) <= 0.2 * np.linalg.norm(self.apart, axis=1)  # not deep beside their distance
        return replace(self, apart=self.apart[near], deflection=self.deflection[near]) if self.square else self

    def nearest(self) -> np.ndarray:
        """The nodes of the smallest fit."""
        return np.argsort(np.linalg.norm(self.apart, axis=1), kind="stable")[: RINGS[0][1]]


def stated_material(solid: Any) -> Any:
    """What was said of the mesh: (E, nu) of a solid, True if its material was not, () of a shell, None if nothing."""
    truth = isinstance(solid, (bool, np.bool_)) or (isinstance(solid, np.ndarray) and solid.shape == ())
    if solid is None or (truth and np.asarray(solid).dtype == bool):
        return None if solid is None else bool(solid) or ()
    if isinstance(solid, Material):
        if solid.E_across is not None:
            raise ValueError("solid must be an isotropic material; the dent of an orthotropic half space is not known")
        return float(solid.E), float(solid.nu)
    pair = isinstance(solid, (list, tuple, np.ndarray)) and getattr(solid, "ndim", 1) == 1
    if not pair or len(solid) not in (0, 2):
        raise ValueError(f"solid must be a Material, (E in Pa, nu), True or False (a shell), got {check.shown(solid)}")
    if not len(solid):
        return ()
    return check.positive("solid", solid[0], "Pa"), check.between("solid", solid[1], -1.0, 0.5)


def settle_dents(modes: Any, loads: list[Load], solid: Any) -> Any:
    """Modes known at points whose unit loads leave no dent, or whose dent is an error; they say so in their notes.

    ``solid`` is as of `stated_material`.
    """
    if solid == () or not loads:
        return modes
    shapes = modes.shapes
    static, dent = shapes.static.copy(), np.zeros((len(shapes.points), 2))
    counts, flat = dict.fromkeys((KNOWN, UNKNOWN, SOLID, TOO_FEW), 0), unfold_points(shapes.points).shape[1] < 3
    for column, load in enumerate(loads):
        if solid is True:
            found = largest_dent(load.on_surface())
            counts[TOO_FEW if found is None else SOLID] += 1
            dent[load.point, 1] = abs(load.own) if found is None else found
            continue
        if solid is None:
            # beside the edge of a plate, where nodes do not lie all around, the deflection ends at no smooth field: the
            # mean of the nearest over the farthest is at most 0.1 in a grid, 0.14 a row off its edge, 0.36 on it
            nearest = load.apart[load.nearest()]
            farthest = np.linalg.norm(nearest, axis=1).max(initial=0.0)
            surrounded = np.linalg.norm(nearest.sum(axis=0)) < 0.12 * len(nearest) * farthest
            found = 0.0 if flat and not surrounded else hidden_dent(load.on_surface())
            size = (0.0 if flat else abs(load.own)) if found is None else found
            counts[TOO_FEW if found is None else UNKNOWN] += size > 0.0
            dent[load.point, 1] = size
            continue
        bare = rest_without_dent(load.on_surface(), *solid) if load.square else None
        counts[TOO_FEW if bare is None else KNOWN] += 1
        dent[load.point] = (0.0, abs(load.own)) if bare is None else (load.own - bare[0], bare[1])
        static[load.point, column] -= dent[load.point, 0]
    notes = tuple(text.format(f"{n} of {len(loads)}") for text, n in counts.items() if n)
    if not notes:
        return modes
    unstated = (*modes.unstated, "dent") if solid is None or solid is True else modes.unstated
    return replace(
        modes, shapes=replace(shapes, static=static, dents=dent), notes=(*modes.notes, *notes), unstated=unstated
    )


def of_points(points: np.ndarray, static: np.ndarray, known: np.ndarray) -> list[Load]:
    """Unit loads at points (n, 1 to 3) [m] that lie on a surface which is flat around each."""
    found = []
    for column, row in enumerate(known.tolist()):
        others = np.delete(np.arange(len(points)), row)
        apart = np.zeros((len(others), 3))
        apart[:, : points.shape[1]] = points[others] - points[row]
        if points.shape[1] == 3:
            nearest = apart[np.argsort(np.linalg.norm(apart, axis=1))[: RINGS[-1][1]]]
            apart = apart @ np.linalg.svd(nearest)[2].T
        found.append(Load(row, apart, static[others, column], float(static[row, column])))
    return found


def rest_without_dent(load: Load, E: float, nu: float) -> tuple[float, float] | None:
    """What a body yields at a load without the dent of a half space, and its error [m/N]; None of too few nodes.

    The error is the difference of four fits, with few and many nodes, nearer to the load and farther off. Where
    elements are half as large as the body is thick, all fits err to one side: it is at least how far their mean lies
    from the nearest and smallest one, and this from the truth, if both ways to it change the fits as much again. Where
    nodes lie to one side, as beside an edge, all fits continue the rest outwards and may err alike: by up to 6 times as
    much on a slab on shear diaphragms.
    """
    distance = np.linalg.norm(load.apart, axis=1)
    space = (1.0 + nu) / (2.0 * np.pi * E) * (load.apart[:, 2] ** 2 / distance**3 + 2.0 * (1.0 - nu) / distance)
    values = _fitted(load.apart, load.deflection - space, RINGS)
    if len(values) < len(RINGS):
        return None
    mean, best = float(np.mean(values)), values[0]
    onward = abs(mean - best) + abs(values[1] - best) + abs(values[2] - best)
    around = np.argsort(distance, kind="stable")[:72]  # about those of all fits
    aside = float(np.linalg.norm(load.apart[around].mean(axis=0)) / distance[around].max())
    return mean, (1.0 + 5.0 * aside) * max(float(np.ptp(values)), onward) + SINGLE * abs(load.own)


def largest_dent(load: Load) -> float | None:
    """How large [m/N] the dent of a solid of unknown material may be; None of too few nodes.

    The largest of fits with ``1 / r`` of unknown size, one beyond the elements over which a load may be spread. Solids
    of three meshes each had 1.02 to 2.11 times their dent.
    """
    values = _fitted(load.apart, load.deflection, (*RINGS, (4.5, 96)), dent=True)
    found = load.own - min(values, default=load.own)
    return float(min(found, abs(load.own))) if found > 0.0 else None


def _fitted(apart: np.ndarray, values: np.ndarray, rings: Any, dent: bool = False) -> list[float]:
    """Values (n,) at nodes around a load continued to it, by fits to the nearest beyond each ring, of enough nodes.

    They are those of a smooth field, with ``1 / r`` if there is a ``dent``.
    """
    distance, found = np.linalg.norm(apart, axis=1), []
    order = np.argsort(distance, kind="stable")
    for first, n in rings:
        chosen = order[distance[order] > first * distance[order[:1]].sum()][:n]
        if len(chosen) >= FEWEST:
            smooth, r = _smooth(apart[chosen])
            terms = np.column_stack([smooth, 1.0 / r]) if dent else smooth
            found.append(float(np.linalg.lstsq(terms, values[chosen], rcond=None)[0][0]))
    return found


def hidden_dent(load: Load) -> float | None:
    """How large [m/N] the dent in a deflection may be, by the deflections around; None of too few nodes.

    Zero if the load sinks no deeper than on a thin plate, ``r**2 log r``, or on a beam, ``r**3``; or if the others are
    rather those of a membrane, ``log r``, than of a solid, ``1 / r``. It counts as deeper from 8 standard errors on:
    solids of three meshes each had 15 to 40, closed forms of plates and beams at most 5. The whole dent is taken as 2.5
    times what is found of it so, 1.3 to 1.82 of tetrahedra, as its rest reaches the others.
    """
    few = load.nearest()
    around = load.deflection[few]
    if len(around) < FEWEST:
        return None
    smooth, r = _smooth(load.apart[few])

    def fitted(shape: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        terms = np.column_stack([smooth, shape])
        found = np.linalg.lstsq(terms, around, rcond=None)[0]
        return terms, found, float(np.square(around - terms @ found).sum())

    if fitted(np.log(r))[2] < 0.5 * fitted(1.0 / r)[2]:  # of thick shells at most this, of slabs 0.6 and more
        return 0.0
    terms, found, square = fitted(r**2 * np.log(r) if smooth.shape[1] > 3 else r**3)
    variance = square / (len(around) - terms.shape[1])
    doubt = float(np.sqrt(variance * np.linalg.pinv(terms.T @ terms)[0, 0]))
    deeper = load.own - float(found[0])
    return 2.5 * deeper if deeper > 8.0 * doubt + SINGLE * abs(load.own) else 0.0


def _smooth(apart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quadratics (n, 6) at nodes around a load, (n, 3) if they lie on a line, and their distances (n,), at most 1."""
    size = float(np.linalg.norm(apart, axis=1).max())
    spread, axes = np.linalg.svd(apart[:, :2], full_matrices=False)[1:]
    x = apart[:, :2] @ axes[spread > 1e-3 * spread[0]].T / size
    pairs = [(i, j) for i in range(x.shape[1]) for j in range(i + 1)]
    products = [x[:, i] * x[:, j] for i, j in pairs]
    return np.column_stack([np.ones(len(x)), x, *products]), np.linalg.norm(apart, axis=1) / size
