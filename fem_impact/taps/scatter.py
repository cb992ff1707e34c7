"""How much taps differ in an unknown that each has its own value of, beside what noise alone would make."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import f

from .._base import check
from .._base.rounding import ROUNDING
from .solver import Problem


@dataclass(frozen=True, eq=False, repr=False)
class Scatter(check.Brief):
    """One unknown over the taps."""

    name: str
    values: np.ndarray  # (n_taps,)
    mean: float  # geometric if `relative`
    deviation: float  # standard deviation over the taps; of the logarithm [-] if `relative`
    by_noise: float  # the same, as noise alone would make it
    relative: bool  # whether the range is positive, so that ratios count
    freedom: int  # degrees of freedom of the noise variance

    @property
    def chance(self) -> float:
        """Probability that noise alone makes taps differ this much [-]; large: one value for all would do."""
        return float(f.sf((self.deviation / max(self.by_noise, 1e-300)) ** 2, len(self.values) - 1, self.freedom))


def scatter(problem: Problem, x: np.ndarray, i: int, noise: float, freedom: int) -> Scatter:
    """The scatter of the free unknown number ``i``, which every tap has its own value of.

    Parameters
    ----------
    x : ndarray, shape (n_coordinates,), the best fit
    noise : float, variance of the residuals
    freedom : int, its degrees of freedom
    """
    n_taps, unknown = problem.data.n_taps, problem.free[i]
    place = [each.name for each in problem.free if each.name in problem.own].index(unknown.name)
    columns = problem.n_shared + (2 + place) * n_taps + np.arange(n_taps)
    answers = np.linalg.pinv(problem.jacobian(x), rcond=ROUNDING)[columns]  # (n_taps, n_residuals) to the noise
    answers -= answers.mean(axis=0)  # apart from the mean of all taps
    variance = noise * float(np.square(answers).sum()) / (n_taps - 1)
    size = 1.0 if unknown.log else unknown.high - unknown.low
    apart = problem.apart(x)[place]
    values = np.array([problem.values(x, tap)[unknown.name] for tap in range(n_taps)])
    return Scatter(
        unknown.name, values, problem.values(x)[unknown.name], size * float(np.std(apart, ddof=1)),
        size * float(np.sqrt(variance)), unknown.log, freedom,
    )  # fmt: skip
