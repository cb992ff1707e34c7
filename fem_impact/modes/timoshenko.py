"""Modes of a uniform Timoshenko beam in closed form, for all ends, none missed.

In units of its length, mass and bending stiffness the beam is described by R = (radius of gyration / length)^2 and
S = E I / (kappa G A length^2). At p = omega^2, with k^2 and -q^2 the roots of K^2 - p (R + S) K + p (p R S - 1) = 0,

    w = a cos kx + b sin kx + c exp(-qx) + d exp(q (x - 1)),     rotation beta' = w'' + p S w.

Above p = 1 / (R S), q is imaginary and there is a second kind of mode, with the section turning against the slope.
The modes of the beam hinged at both ends are known (k = n pi). Freeing an end adds as many modes below p as the dynamic
stiffness there has negative eigenvalues, and clamping one takes away as many as the receptance of its rotation has; so
every mode is counted, and bisection finds each.

References
----------
Huang (1961), J. Appl. Mech. 28, 579-584 (all ends); Wittrick and Williams (1971), Q. J. Mech. Appl. Math. 24, 263-284,
for counting modes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .._base import check
from .._base.remembered import gauss_rule
from .._base.rounding import HALVINGS, SAME
from ..fe.theory import blocks
from .shapes import ClosedShapes

ENDS = {"clamped": (0, 1), "hinged": (0, 2), "free": (2, 3)}  # what vanishes there: w, beta, moment, shear force
MOST = 5000  # [-] largest number of modes; their shapes are integrated point by point
TOGETHER = 64  # [-] modes whose shapes are computed together, to limit memory


@dataclass(frozen=True)
class Stoutness:
    """How far a beam is from a slender one."""

    R: float  # [-] radius of gyration over length, squared
    S: float  # [-] E I / (kappa G A length^2)

    def waves(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """k and q**2 (n,) at p (n,)."""
        square = 0.5 * (p * (self.R + self.S) + np.sqrt(p**2 * (self.R - self.S) ** 2 + 4.0 * p))
        return np.sqrt(square), p * (1.0 - p * self.R * self.S) / square

    def fields(self, p: np.ndarray, x: np.ndarray) -> np.ndarray:
        """w, beta, moment and shear force of the four solutions, (n, n_points, 4, 4), at p (n,) and x (n_points,)."""
        k, square = (part[:, None] for part in self.waves(p))
        p, steep = p[:, None], 1.0  # q above which exponentials replace cosh and sinh, which are bounded below
        result = np.empty((len(p), len(x), 4, 4))
        c, s, turn = np.cos(k * x), np.sin(k * x), (k**2 - p * self.S) / k
        result[..., 0] = np.stack([c, -turn * s, -turn * k * c, -p / k * s], axis=-1)
        result[..., 1] = np.stack([s, turn * c, -turn * k * s, p / k * c], axis=-1)
        q = np.sqrt(np.maximum(square, steep**2))
        turn = (q**2 + p * self.S) / q
        down, up = np.exp(-q * x), np.exp(q * (x - 1.0))
        exponential = np.array([
            [down, -turn * down, turn * q * down, p / q * down], [up, turn * up, turn * q * up, -p / q * up],
        ])  # fmt: skip
        mild = np.minimum(square, steep**2)
        root = np.sqrt(np.abs(mild))
        low = np.minimum(root, steep) * x
        c = np.where(mild > 0.0, np.cosh(low), np.cos(root * x))
        safe = np.where(root * x > 1e-8, root, 1.0)
        s = np.where(root * x > 1e-8, np.where(mild > 0.0, np.sinh(low), np.sin(root * x)) / safe, x)
        turn = mild + p * self.S  # the second is scaled by its rotation, which remains at q = 0
        bounded = np.array([[c, turn * s, turn * c, -p * s], [mild * s, turn * c, turn * mild * s, -p * c]])
        result[..., 2:] = np.where(square > steep**2, exponential, bounded).transpose(2, 3, 1, 0)
        return result

    def hinged(self, n: int) -> np.ndarray:
        """The first n values of p of the beam hinged at both ends, ascending."""
        k = np.pi * np.arange(n + 1)
        b = 1.0 + (self.R + self.S) * k**2
        root = np.sqrt(b**2 - 4.0 * self.R * self.S * k**4)
        return np.sort(np.concatenate([2.0 * k[1:] ** 4 / (b + root)[1:], (b + root) / (2.0 * self.R * self.S)]))[:n]

    def count(self, ends: tuple[str, str], p: np.ndarray) -> np.ndarray:
        """Number of modes (n,) below p (n,), rigid motions included."""
        k, square = self.waves(p)
        total = np.floor(k / np.pi) + np.where(square < 0.0, np.floor(np.sqrt(np.abs(square)) / np.pi) + 1.0, 0.0)
        at = self.fields(p, np.array([0.0, 1.0]))  # (n, 2, 4, 4)
        free = [i for i in range(2) if ends[i] == "free"]
        clamped = [i for i in range(2) if ends[i] == "clamped"]
        outward = np.array([-1.0, 1.0])
        rows = np.concatenate([at[:, :, 0], at[:, :, 2]], axis=1)  # w, w, M, M at both ends
        if free:
            solved = np.linalg.solve(rows, np.broadcast_to(np.eye(4)[:, free], (len(p), 4, len(free))))
            force = outward[free, None] * (at[:, free, 3] @ solved)
            total = total + _negative(force)
            rows[:, free] = at[:, free, 3]
        if clamped:
            moments = np.eye(4)[:, [2 + i for i in clamped]] * outward[clamped]
            solved = np.linalg.solve(rows, np.broadcast_to(moments, (len(p), 4, len(clamped))))
            total = total - _negative(at[:, clamped, 1] @ solved)
        return total

    def eigenvalues(self, ends: tuple[str, str], first: int, n: int) -> np.ndarray:
        """p of the modes number ``first`` (0 is the lowest) to ``first`` + n - 1, (n,)."""
        number = first + np.arange(n)
        around = self.hinged(first + n + 2)
        low = np.where(number >= 3, around[np.maximum(number - 3, 0)], 1e-3 * around[0])
        high = around[number + 2] * (1.0 + 1e-9)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            below = self.count(ends, middle) > number
            low, high = np.where(below, low, middle), np.where(below, middle, high)
        return 0.5 * (low + high)

    def weights(self, ends: tuple[str, str], p: np.ndarray) -> np.ndarray:
        """Weights (n, 4) of the four solutions in the modes of unit mass; positive next to the left end."""
        at = self.fields(p, np.array([0.0, 1.0]))
        at = at / np.abs(at).max(axis=(1, 3), keepdims=True)
        size = np.abs(at).max(axis=(1, 2))[:, None]  # (n, 1, 4), of any field: one that only turns has no w
        rows = np.concatenate([at[:, i][:, list(ENDS[ends[i]])] for i in range(2)], axis=1)
        found = np.linalg.svd(rows / size)[2][:, 3] / size[:, 0]
        for block in blocks(len(p), TOGETHER):
            k = self.waves(p[block])[0].max()
            x, dx = gauss_rule(int(k) + 40)
            w, beta = np.moveaxis(self.fields(p[block], x)[:, :, :2], 2, 0)
            w, beta = ((part @ found[block][..., None])[..., 0] for part in (w, beta))
            found[block] /= np.sqrt((w**2 + self.R * beta**2) @ dx)[:, None]
        near = np.einsum("nij,nj->ni", self.fields(p, np.array([1e-3]))[:, 0], found)[:, 0]
        return found * np.where(near < 0.0, -1.0, 1.0)[:, None]


SLENDER = Stoutness(0.0, 0.0)  # without shear and rotary inertia


def _negative(matrices: np.ndarray) -> np.ndarray:
    """Number of negative eigenvalues (n,) of symmetric matrices (n, m, m)."""
    return (np.linalg.eigvalsh(0.5 * (matrices + matrices.transpose(0, 2, 1))) < 0.0).sum(axis=1)


def rigid_motions(ends: tuple[str, str], stoutness: Stoutness) -> np.ndarray:
    """Rigid shapes c0 + c1 x of a beam of unit mass and length, (n_rigid, 2)."""
    if ends == ("free", "free"):
        turn = (1.0 / 12.0 + stoutness.R) ** -0.5
        return np.array([[1.0, 0.0], [-0.5 * turn, turn]])
    turn = (1.0 / 3.0 + stoutness.R) ** -0.5
    if ends == ("hinged", "free"):
        return np.array([[0.0, turn]])
    return np.array([[turn, -turn]]) if ends == ("free", "hinged") else np.zeros((0, 2))


@dataclass(frozen=True, eq=False)
class BeamlikeShapes(ClosedShapes):
    """What the closed forms of all beams share."""

    length: float  # [m]
    ends: tuple[str, str]
    stoutness: Stoutness

    def contains(self, points: np.ndarray) -> np.ndarray:
        return np.all((points >= -SAME * self.length) & (points <= (1 + SAME) * self.length), axis=1)

    def compliance(self, points: np.ndarray) -> np.ndarray:
        result = self.deflection(points, points)
        return 0.5 * (result + result.T)

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Exact static deflection under each load; a beam that can move rigidly gets inertia relief."""
        x = points[:, 0] / self.length
        return np.column_stack([green(self.ends, self.stoutness, load)(x) for load in loads[:, 0] / self.length])

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        node = np.arange(129)
        return self.length * node[:, None] / 128.0, np.column_stack([node[:-1], node[1:]])


@dataclass(frozen=True, eq=False, repr=False)
class TimoshenkoShapes(BeamlikeShapes, check.Brief):
    """Shapes of a uniform Timoshenko beam of unit mass and rigidity over x / length in 0 ... 1."""

    p: np.ndarray  # (n_modes,) omega squared; 0 for rigid motions
    weights: np.ndarray  # (n_modes, 4)

    def at(self, points: np.ndarray) -> np.ndarray:
        x, flexible = points[:, 0] / self.length, self.p > 0.0
        values = np.empty((len(x), len(self.p)))
        shapes = self.stoutness.fields(self.p[flexible], x)[:, :, 0]  # (n, n_points, 4)
        values[:, flexible] = np.einsum("npk,nk->pn", shapes, self.weights[flexible])
        values[:, ~flexible] = self.weights[~flexible, 0] + x[:, None] * self.weights[~flexible, 1]
        return values

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """w' (n_points, n_modes) at x (n_points,) of a beam that cannot move rigidly: rotation and shear."""
        parts = []
        for block in blocks(len(self.p), TOGETHER):
            fields = self.stoutness.fields(self.p[block], x)
            steep = fields[:, :, 1] + self.stoutness.S * fields[:, :, 3]
            parts.append(np.einsum("npk,nk->pn", steep, self.weights[block]))
        return np.hstack(parts)


@lru_cache(maxsize=64)
def green(ends: tuple[str, str], stoutness: Stoutness, load: float) -> Callable[[np.ndarray], np.ndarray]:
    """Deflection of the unit beam under a unit force at ``load`` in 0 ... 1, without its rigid motion.

    w, beta, moment and shear force are polynomials with four constants, those at the left end, plus what the force adds
    beyond its place and what the inertia of the rigid motion adds, which balances it. The beam is mirrored if need be
    so that the force is in its left half: near a clamped end the deflection is of the order of the distance cubed, and
    mirroring keeps its digits.
    """
    if load > 0.5:
        mirrored = green(ends[::-1], stoutness, 1.0 - load)
        return lambda x: mirrored(1.0 - x)
    R, S = stoutness.R, stoutness.S
    moving = rigid_motions(ends, stoutness)
    c0, c1 = -moving.T @ (moving @ [1.0, load])  # inertia force c0 + c1 x and moment R c1 per length

    def constants(x: np.ndarray) -> np.ndarray:
        """w, beta, M and Q (4, n, 4) at x (n,) of unit constants w, beta, M and Q at 0."""
        one, none = np.ones_like(x), np.zeros_like(x)
        return np.array([
            np.column_stack([one, x, x**2 / 2.0, S * x - x**3 / 6.0]), np.column_stack([none, one, x, -(x**2) / 2.0]),
            np.column_stack([none, none, one, -x]), np.column_stack([none, none, none, one]),
        ])  # fmt: skip

    def driven(x: np.ndarray) -> np.ndarray:
        """w, beta, M and Q (4, n) at x (n,) by the force and the inertia."""
        beyond = (x - load).clip(0.0)
        push = -c0 * x - c1 * x**2 / 2.0 - (x > load)  # a force at an end acts inside
        moment = c0 * x**2 / 2.0 + c1 * x**3 / 6.0 + beyond - R * c1 * x
        turn = c0 * x**3 / 6.0 + c1 * x**4 / 24.0 + beyond**2 / 2.0 - R * c1 * x**2 / 2.0
        bent = c0 * x**4 / 24.0 + c1 * x**5 / 120.0 + beyond**3 / 6.0 - R * c1 * x**3 / 6.0
        return np.array([bent - S * (c0 * x**2 / 2.0 + c1 * x**3 / 6.0 + beyond), turn, moment, push])

    left = np.setdiff1d(np.arange(4), ENDS[ends[0]])  # constants that the left end does not hold
    far, right = np.ones(1), list(ENDS[ends[1]])
    start = np.zeros(4)
    start[left] = np.linalg.lstsq(constants(far)[right, 0][:, left], -driven(far)[right, 0], rcond=None)[0]
    x, dx = gauss_rule(6)  # exact on either side of the force
    place = np.concatenate([load * x, load + (1.0 - load) * x])
    share = np.concatenate([load * dx, (1.0 - load) * dx])
    w, beta = (constants(place) @ start + driven(place))[:2]
    carried = moving @ np.vstack([share @ w, share @ (place * w) + R * share @ beta])  # (n_rigid, 1)
    drift = carried.ravel() @ moving
    return lambda x: (constants(x) @ start + driven(x))[0] - drift @ np.vstack([np.ones_like(x), x])
