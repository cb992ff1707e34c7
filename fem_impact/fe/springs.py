"""Springs along the edges of a body, and checks of its point masses."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .._base import check
from .._base.remembered import gauss_rule
from .section import Elastic
from .supports import cells_of_facets


def at_facets(space: Any, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Cells (n,) of facets (n, 2), and Gauss points on these: area coordinates (n, n_q, 3), places, weights, normals.

    Places and outward unit normals are (n, n_q, 2), weights (n, n_q).
    """
    cells = cells_of_facets(facets, space.vertices)[0]
    x, dx = gauss_rule(8)  # exact for products of quintics
    s = x[:, None]
    corner = space.vertices[cells][:, None]  # (n, 1, 3)
    first, last = (np.equal(corner, facets[:, end, None, None]).astype(float) for end in (0, 1))
    area = (1.0 - s) * first + s * last  # (n, n_q, 3)
    x, tangent = space.points_along(cells, area, last - first)
    normal = np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1) * dx[:, None]
    ds = np.linalg.norm(normal, axis=2)
    return cells, area, x, ds, normal / ds[..., None]


def edge_stiffness(supports: Sequence[Any], frame: Any) -> np.ndarray:
    """Stiffness (n_facets, 2) of supports against deflection and slope of each facet, in the frame's units."""
    pairs = [(kind.stiffness, kind.rotation) if isinstance(kind, Elastic) else (0.0, 0.0) for kind in supports]
    return np.array(pairs).reshape(-1, 2) * [frame.length**3, frame.length] / frame.stiffness


def is_sprung(supports: Mapping[str, Any], posts: Iterable[Any]) -> bool:
    """Whether edges or points, of pairs of place and "hinged" or stiffness [N/m], are held by springs."""
    stiff = [stiffness for _, stiffness in posts if not isinstance(stiffness, str)]
    return any(isinstance(held, Elastic) for held in supports.values()) or bool(np.isfinite(stiff).any())


def _listed(name: str, given: Any, pairs: str) -> Sequence[Any]:
    if isinstance(given, (str, dict)) or not isinstance(given, Sequence):
        raise ValueError(f"{name} must be a list of ({pairs}) pairs, got {check.shown(given)}")
    return given


def check_posts(
    point_supports: Any, dimension: int
) -> tuple[list[tuple[np.ndarray, float]], list[tuple[np.ndarray, float]]]:
    """Check point supports; return what holds points and what clamps disks.

    Points (dimension,) [m] with stiffnesses [N/m], infinite if hinged; centres (2,) [m] with radii [m].
    """
    posts: list[tuple[np.ndarray, float]] = []
    clamps: list[tuple[np.ndarray, float]] = []
    for i, entry in enumerate(_listed("point_supports", point_supports, "point, support")):
        clamped = isinstance(entry, Sequence) and len(entry) == 3 and entry[1] == "clamped"
        if not clamped and (not isinstance(entry, Sequence) or isinstance(entry, str) or len(entry) != 2):
            raise ValueError(
                f"point_supports[{i}] must be a pair (point in m, 'hinged' or a stiffness in N/m) or (point, "
                f"'clamped', radius in m), got {check.shown(entry)}"
            )
        point = check.array(f"point of point_supports[{i}]", entry[0], (dimension,), "m", lift=True)
        if clamped:
            if dimension != 2:
                raise ValueError(
                    f"point_supports[{i}] must not clamp a point of a beam, whose sides then know nothing of each "
                    "other; make two beams, or hold it by 'hinged' at two points"
                )
            clamps.append((point, check.positive(f"radius of point_supports[{i}]", entry[2], "m")))
        elif isinstance(entry[1], str):
            check.one_of(f"support of point_supports[{i}]", entry[1], ("hinged",))
            posts.append((point, np.inf))
        else:
            posts.append((point, check.positive(f"stiffness of point_supports[{i}]", entry[1], "N/m")))
    return posts, clamps


def check_masses(point_masses: Any, dimension: int) -> list[tuple[np.ndarray, float]]:
    """Check a sequence of (point, mass) pairs; return points (dimension,) [m] and masses [kg]."""
    result = []
    for i, entry in enumerate(_listed("point_masses", point_masses, "point, mass")):
        if not isinstance(entry, Sequence) or len(entry) != 2:
            raise ValueError(f"point_masses[{i}] must be a pair (point in m, mass in kg), got {check.shown(entry)}")
        point = check.array(f"point of point_masses[{i}]", entry[0], (dimension,), "m", lift=True)
        result.append((point, check.positive(f"mass of point_masses[{i}]", entry[1], "kg")))
    return result
