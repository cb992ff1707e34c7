"""What is uncertain about a blow: how each input is distributed, how they go together, and points that fill both."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats
from scipy.stats import qmc

from .._base import check
from .cells import REACH

# kind: the names of its numbers, and the distribution they make
KINDS: dict[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "normal": (("mean", "deviation"), stats.norm),
    "lognormal": (("median", "sigma"), lambda median, sigma: stats.lognorm(sigma, scale=median)),
    "uniform": (("low", "high"), lambda low, high: stats.uniform(low, high - low)),
    "loguniform": (("low", "high"), stats.loguniform),
    "triangular": (
        ("low", "mode", "high"),
        lambda low, mode, high: stats.triang((mode - low) / (high - low), low, high - low),
    ),
}


@dataclass(frozen=True, eq=False)
class Input:
    """One uncertain number of a blow."""

    name: str
    said: str  # its distribution as text, such as "lognormal(695000, 0.1)"
    distribution: Any  # frozen distribution of scipy.stats

    @classmethod
    def of(cls, name: str, given: Any) -> "Input":
        """The input that a user describes: (kind, number, ...), the same as text, or a distribution of scipy.stats."""
        if not isinstance(name, str):
            raise ValueError(f"vary must map names to distributions, got the name {check.shown(name)}")
        if isinstance(given, stats.distributions.rv_frozen):
            middle = np.asarray(given.ppf([0.25, 0.5, 0.75]), float)
            if middle.shape != (3,) or not np.isfinite(middle).all():
                raise ValueError(f"vary[{name!r}] must be a distribution of one continuous number")
            words = [f"{value:g}" for value in given.args] + [f"{key}={value:g}" for key, value in given.kwds.items()]
            return cls(name, f"{given.dist.name}({', '.join(words)})", given)
        if isinstance(given, str):
            found = re.fullmatch(r"\s*([a-z]+)\s*\(([^()]*)\)\s*", given)
            if found is None:
                raise ValueError(f"vary[{name!r}] must look like lognormal(695e3, 0.1), got {check.shown(given)}")
            try:
                given = (found[1], *map(float, found[2].split(",")))
            except ValueError:
                raise ValueError(f"vary[{name!r}] must hold numbers, got {check.shown(given)}") from None
        if not isinstance(given, Sequence) or not given:
            raise ValueError(
                f"vary[{name!r}] must be a distribution such as ('lognormal', 695e3, 0.1), got {check.shown(given)}"
            )
        kind, *values = given
        wanted, make = KINDS[check.one_of(f"vary[{name!r}]", kind, KINDS)]
        if len(values) != len(wanted):
            raise ValueError(f"vary[{name!r}] must be {kind}({', '.join(wanted)}), got {len(values)} numbers")
        numbers = [check.number(f"{word} of vary[{name!r}]", value, reach=REACH) for word, value in zip(wanted, values)]
        named = dict(zip(wanted, numbers))
        for word in ("deviation", "sigma", "median", *["low"] * (kind == "loguniform")):
            if word in named:
                check.positive(f"{word} of vary[{name!r}]", named[word], reach=REACH)
        if "low" in named and not named["low"] < named["high"]:
            raise ValueError(f"low of vary[{name!r}] must be below high, got {named['low']:g} and {named['high']:g}")
        if "mode" in named and not named["low"] <= named["mode"] <= named["high"]:
            raise ValueError(f"mode of vary[{name!r}] must lie between low and high, got {named['mode']:g}")
        return cls(name, f"{kind}({', '.join(f'{value:g}' for value in numbers)})", make(*numbers))


def read_inputs(vary: Any) -> tuple[Input, ...]:
    """The inputs from what a user gives: a mapping of names to distributions."""
    if not isinstance(vary, Mapping) or not vary:
        raise ValueError(
            f"vary must name at least one input, such as {{'contact.stiffness': ('lognormal', 695e3, 0.1)}}, "
            f"got {check.shown(vary)}"
        )
    if len(vary) > 64:
        raise ValueError(f"vary must name at most 64 inputs, got {len(vary)}")
    return tuple(Input.of(name, given) for name, given in vary.items())


def correlating_matrix(inputs: Sequence[Input], correlation: Any) -> np.ndarray | None:
    """Lower triangular matrix (n_inputs, n_inputs) that correlates independent normal numbers; None if none are.

    ``correlation`` has those of the inputs' normal scores (a Gaussian copula), as such a matrix or by pairs of names;
    pairs left out have none. Of normal inputs they are the correlations themselves, of lognormal ones of the
    logarithms.
    """
    if correlation is None:
        return None
    names = [each.name for each in inputs]
    if isinstance(correlation, Mapping):
        matrix = np.eye(len(names))
        for pair, value in correlation.items():
            if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] == pair[1]:
                raise ValueError(f"correlation must map pairs of different names to numbers, got {check.shown(pair)}")
            i, j = (names.index(check.one_of("correlation", name, names)) for name in pair)
            matrix[i, j] = matrix[j, i] = check.between(f"correlation of {pair[0]} and {pair[1]}", value, -1.0, 1.0)
    else:
        matrix = check.array("correlation", correlation, (len(names), len(names)))
    if not (np.allclose(matrix, matrix.T) and np.allclose(np.diag(matrix), 1.0)):
        raise ValueError("correlation must be symmetric with ones on its diagonal")
    try:
        return None if np.array_equal(matrix, np.eye(len(names))) else np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        raise ValueError("correlation must be positive definite: no inputs can go together like this") from None


def shares(n_points: int, n_inputs: int, seed: int) -> np.ndarray:
    """Points (n_points, n_inputs) inside the unit cube that fill it evenly: Sobol's, scrambled by a seed.

    References
    ----------
    Owen (1995), Randomly permuted (t, m, s)-nets and (t, s)-sequences; Joe and Kuo (2008), SIAM J. Sci. Comput. 30,
    2635-2654.
    """
    engine = qmc.Sobol(n_inputs, scramble=True, rng=np.random.default_rng(seed))
    points = engine.random_base2(max(0, (n_points - 1).bit_length()))[:n_points]
    return points + 0.5 / engine.maxn  # the middle of each smallest cell: never 0, where a tail would be infinite


def drawn_inputs(inputs: Sequence[Input], points: np.ndarray, mixer: np.ndarray | None) -> np.ndarray:
    """Values (n_points, n_inputs) of the inputs at points of the unit cube, correlated by `correlating_matrix`."""
    if mixer is not None:
        points = stats.norm.cdf(stats.norm.ppf(points) @ mixer.T)
    return np.column_stack([each.distribution.ppf(column) for each, column in zip(inputs, points.T)])


def sobol_points(points: np.ndarray) -> np.ndarray:
    """Points for Sobol indices, (n * (d + 2), d), from n points of the cube of 2 d coordinates.

    Each of the n groups has a point A, the d points that have one coordinate from B and the others from A, and B.

    References
    ----------
    Saltelli et al. (2010), Comput. Phys. Commun. 181, 259-270; the order is that of SALib.
    """
    n, d = points.shape[0], points.shape[1] // 2
    first, second = points[:, :d], points[:, d:]
    groups = np.repeat(first[:, None, :], d + 2, axis=1)
    groups[:, -1] = second
    which = np.arange(d)
    groups[:, 1 + which, which] = second[:, which]
    return groups.reshape(n * (d + 2), d)
