"""What a tapped body rings at, with constants found from its other frequencies: each is predicted from the rest."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

STEP = 0.02  # [-] of a constant, for the slopes of frequencies
DRAWS = 4000  # [-] of the errors behind a band
# Huber's robust least squares: a difference beyond this many deviations counts in proportion, not by its square
HUBER, ROUNDS = 1.345, 30


def slopes(frequencies: Callable[[Mapping[str, float]], np.ndarray], values: Mapping[str, float]) -> tuple:
    """Logarithms of the frequencies at these constants, (n,), and their slopes in those of the constants, (n, m).

    Valid while the modes keep their order within the step.
    """
    here = np.log(frequencies(values))
    columns = []
    for name in values:
        up, down = (np.log(frequencies({**values, name: values[name] * (1.0 + step)})) for step in (STEP, -STEP))
        columns.append((up - down) / np.log((1.0 + STEP) / (1.0 - STEP)))
    return here, np.column_stack(columns)


def from_the_others(
    measured: Sequence[float],
    here: np.ndarray,
    slope: np.ndarray,
    error: float,
    prior: Sequence[float] = (),
    use: Sequence[int] = (),
    rounds: int = ROUNDS,
) -> np.ndarray:
    """Each frequency predicted from all others, (DRAWS, n) [Hz].

    The constants are found from the other frequencies by robust least squares: one that does not belong to the body
    must not spoil the rest.

    Parameters
    ----------
    measured : (n,) [Hz]
    here : (n,)
        Logarithms of the computed frequencies at some constants near the true ones.
    slope : (n, m)
        Their slopes in the logarithms of the constants.
    error : float [-]
        Standard deviation of a relative difference of measured and computed frequency.
    prior : (m,) [-], optional
        Standard deviation with which each constant is known beforehand; infinite if left out.
    use : indices, optional
        Frequencies that the constants are found from, of which each is still predicted without itself.
    rounds : int
        Of the robust fit; 1 for plain least squares.

    References
    ----------
    Huber (1964), Ann. Math. Stat. 35, 73-101.
    """
    rng = np.random.default_rng(1)
    n, m = slope.shape
    away = np.log(measured) - here
    weights = np.zeros(m) if not len(prior) else (error / np.asarray(prior)) ** 2
    predicted = np.empty((DRAWS, n))
    for i in range(n):
        rest = np.setdiff1d(use if len(use) else np.arange(n), [i])
        rows = slope[rest]
        trust = np.ones(len(rest))
        for _ in range(rounds):
            weighted = rows.T * trust
            normal = weighted @ rows + np.diag(weights)
            found = np.linalg.solve(normal, weighted @ away[rest])
            trust = np.minimum(1.0, HUBER * error / np.maximum(np.abs(away[rest] - rows @ found), 1e-12))
        spread = error * np.linalg.cholesky(np.linalg.inv(normal))
        draws = found + rng.standard_normal((DRAWS, m)) @ spread.T
        predicted[:, i] = np.exp(here[i] + draws @ slope[i])
    return predicted
