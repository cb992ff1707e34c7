"""How all other coordinates go along with one that is moved, so that a search at the next place begins near its end."""

from dataclasses import dataclass, replace

import numpy as np

from .._base import check
from .._base.rounding import SAME
from .solver import Problem, directions

# [-] of its range: below this, what begins at zero does not go by factors, or steps to zero would never end
NEAR_ZERO = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class RidgePath(check.Brief):
    """A straight way through the coordinates, from a point where all but coordinate ``j`` fit best.

    Along a ridge values go by factors: then coordinates that are parts of a range from zero, such as the loss, go by
    their logarithms, too.
    """

    j: int
    x: np.ndarray  # (n_coordinates,)
    slope: np.ndarray  # (n_coordinates,) growth per growth of the one, of logarithms where `factors`
    factors: np.ndarray  # (n_coordinates,) bool
    stopped: np.ndarray  # (n_coordinates,) bool: at an end of their range, where they stay
    bounds: tuple[np.ndarray, np.ndarray]  # (n_coordinates,) each
    spread: float  # growth of coordinate j for which the sum of squares rises by one, by curvature
    jacobian: np.ndarray  # (n_residuals, n_coordinates less j and the needless) near by

    def _gone(self, last: float) -> float:
        here = self.x[self.j]
        return float(np.log(max(last, NEAR_ZERO) / here)) if self.factors[self.j] else last - here

    def to(self, last: float) -> np.ndarray:
        """The coordinates where the one is at ``last``, none beyond its bounds."""
        gone = self.slope * self._gone(last)
        x = np.where(self.factors, self.x * np.exp(np.where(self.factors, gone, 0.0)), self.x + gone)
        x[self.j] = last
        return np.clip(x, *self.bounds)

    def reach(self, sign: float) -> tuple[float, np.ndarray]:
        """How far the one can go up (sign 1) or down (-1) until another meets its bound, and which do there."""
        low, high = self.bounds
        ahead = np.where(sign * self.slope > 0.0, high, low)
        with np.errstate(all="ignore"):
            far = np.where(self.factors, np.log(ahead / self.x), ahead - self.x)
            far = np.where(np.abs(ahead - self.x) <= SAME * (high - low), 0.0, far) / (sign * self.slope)
        far[(self.slope == 0.0) | self.stopped | ~np.isfinite(far)] = np.inf
        far[self.j] = np.inf
        nearest = float(far.min())
        meets = far <= nearest * (1.0 + SAME)
        here = self.x[self.j]
        return abs(here * np.expm1(sign * nearest)) if self.factors[self.j] else nearest, meets

    def on(self, x: np.ndarray) -> "RidgePath":
        """The way on from another point that fits best, in the direction from the last one to it."""
        factors = self.factors & (x > NEAR_ZERO)
        if factors[self.j] != self.factors[self.j]:
            return replace(self, x=x, slope=np.zeros(len(x)), factors=factors)
        gone = np.where(factors, np.log(np.maximum(x, NEAR_ZERO) / np.maximum(self.x, NEAR_ZERO)), x - self.x)
        slope = np.where(self.stopped | (factors != self.factors), 0.0, gone / gone[self.j])
        return replace(self, x=x, slope=slope, factors=factors)


def way(
    problem: Problem, x: np.ndarray, j: int, bounds: tuple[np.ndarray, np.ndarray], noise: float, ridge: float,
    stopped: np.ndarray | None = None,
) -> RidgePath:  # fmt: skip
    """The way from ``x`` by the derivatives there; by factors if a rise by one takes coordinate j beyond ``ridge``."""
    stopped = np.zeros(len(x), bool) if stopped is None else stopped
    jacobian = problem.jacobian(x)
    apart = np.zeros(len(x), bool)
    apart[[j, *problem.needless]] = True
    others = np.flatnonzero(~apart & ~stopped)
    basis = directions(jacobian[:, others])
    along = basis.left.T @ jacobian[:, j]
    slope = np.zeros(len(x))
    slope[others] = -basis.inverse @ along[basis.told]
    slope[j] = 1.0
    spread = float(np.sqrt(noise) / max(np.linalg.norm(jacobian[:, j] - basis.left @ along), 1e-300))
    factors = np.zeros(len(x), bool)
    if spread > ridge:
        factors[: problem.n_shared] = [each.floor for each in problem.free]
        factors &= x > NEAR_ZERO
    slope[factors] /= x[factors]
    if factors[j]:
        slope *= x[j]
    return RidgePath(j, x, slope, factors, stopped, bounds, spread, jacobian[:, ~apart])
