"""The bodies of a blow, each reduced to its modes and contacts, and the modal system that they make together."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from .._base import check
from .._base.rounding import ROUNDING
from ..modes.modal import Modes, left_out
from ..modes.stretching import Stretching, stretch
from .compiled.bundles import KernelSystem
from .compiled.law import table
from .contact import STICKY, Contact
from .stretched import Stretched
from .striker import Striker

# [-] by dimension: frequency of the replacement mode over the last, fact: sqrt(sum u**2/w**2 / sum u**2/w**4) of those
# above is sqrt(7/3) on a beam, whose n-th frequency goes as n**2, and sqrt(3) on a plate, where it goes as n
REST_ABOVE = {1: 1.53, 2: 1.73}
# [-] two extra runs divide the highest kept frequency by these: near enough to predict, far enough to differ
THINNED = 1.4, 2.0
Touched = tuple[tuple[int, float], ...]  # contact, and sign: 1 for its first body, -1 for its second


@dataclass(frozen=True, eq=False, repr=False)
class Ends(check.Brief):
    """Where the contacts of a blow act on a body, and what its kept modes lack of its static compliance there."""

    points: np.ndarray  # (n_ends, dimension) [m]
    touched: Touched
    force: float  # [N] constant force at the first point
    rest: np.ndarray  # (n_ends, n_ends) [m/N] compliance of the modes left out; zero if the modes are complete
    forms: slice = field(default_factory=lambda: slice(0))  # modes of the run that stand for these; empty for a spring
    dip_force: float = 0.0  # [N] that constant force if it makes a spring that stands for them deflect
    speed: float = 0.0  # [m/s] with which the body arrives in rigid motion, at its first point
    doubtful: bool = False  # whether more than rounding is not known of the body there
    coming: np.ndarray | None = None  # (n_modes,) [kg**0.5] per unit speed, of a striker in `collide`

    def pressed(self, omega: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Forces (n_ends, 2) that deflect the modes left out as in a state (2, n_modes) of the run, and their rates.

        (0, 2) where a spring stands for these modes: the forces that act deflect it.
        """
        forms = unit_forms(self.rest) if omega[self.forms].size else np.zeros((0, 0))
        signs = np.array([sign for _, sign in self.touched[: len(forms)]])
        return -signs[:, None] * (forms / np.square(forms).sum(axis=0)) @ (omega * state)[:, self.forms].T


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """One body of a blow, reduced to its modes and contacts."""

    omega: np.ndarray  # (n_modes,) [rad/s]
    zeta: np.ndarray  # (n_modes,) [-]
    rows: np.ndarray  # (n_ends, n_modes) [kg**-0.5] shapes at its contacts
    touched: Touched
    rest: np.ndarray  # (n_ends, n_ends) [m/N] residual compliance of the left-out modes
    doubt: np.ndarray  # (n_ends,) [m/N] estimated error of its diagonal
    q: np.ndarray  # (n_modes,) [m kg**0.5]
    p: np.ndarray  # (n_modes,) [m kg**0.5/s]
    bias: np.ndarray  # (n_modes,) [N kg**-0.5]
    force: float  # [N] constant force at its first contact
    points: np.ndarray  # (n_ends, dimension) [m] contact points
    pressed: np.ndarray  # (n_ends, 2) [N], [N/s] forces that deflect the modes left out at the start, and their rates
    loose: np.ndarray  # (n_ends, n) shapes of rigid motions that it may have besides
    spread: np.ndarray | None = None  # (n_ways, n_ends, n_modes) [-] relative errors of squared shapes
    stretching: Stretching | None = None
    speed: float = 0.0  # [m/s] with which it arrives in rigid motion, at its first contact
    coming: np.ndarray | None = None  # (n_modes,) modal velocities per unit of that speed, of a striker in `collide`
    memory: np.ndarray | None = None  # (n_ends,) what its contacts remember at the start; None: nothing
    held: int = 0  # [-] first modes that only a hand makes swing: within a contact they move like a mass

    @cached_property
    def doubtful(self) -> bool:
        """Whether more than rounding is not known of it."""
        whole = self.rest.diagonal() + np.square(self.rows / np.where(self.omega > 0.0, self.omega, np.inf)).sum(axis=1)
        estimated = (self.doubt > 2.0 * ROUNDING * whole).any()
        return bool(self.loose.size or estimated or self.spread is not None)

    @cached_property
    def yields(self) -> bool:
        """Whether modes left out yield at its contacts."""
        return len(self.rest.nonzero()[0]) > 0

    def push_body(self, force: float) -> "ReducedBody":
        """The same body under a constant force [N] at its first contact."""
        return replace(self, force=force, bias=self.bias + force * self.rows[0]) if force else self

    def forms(self, rated: Sequence[bool]) -> np.ndarray:
        """Forms (n_ends, n_forms) of unit stiffness that stand for the modes left out; none where a spring does."""
        if not self.yields or (len(self.touched) == 1 and not rated[self.touched[0][0]]):
            return np.zeros((len(self.touched), 0))
        return unit_forms(self.rest)

    @cached_property
    def thinner(self) -> "list[tuple[ReducedBody, float]]":
        """The body with its upper modes replaced by their compliance, and the ratio of old to new highest frequency.

        One for each of THINNED that leaves out other modes.
        """
        found: list[tuple[ReducedBody, float]] = []
        flexible = self.omega[self.omega > 0.0]
        for wanted in THINNED if self.yields and len(flexible) > 1 else ():
            n = int(self.omega.searchsorted(max(flexible[-1] / wanted, flexible[0]), side="right"))
            if n == len(found[-1][0].omega if found else self.omega):
                continue
            gone = self.rows[:, n:] / self.omega[n:]
            thin = replace(
                self, omega=self.omega[:n], zeta=self.zeta[:n], rows=self.rows[:, :n], rest=self.rest + gone @ gone.T,
                q=self.q[:n], p=self.p[:n], bias=self.bias[:n],
                stretching=None if self.stretching is None else self.stretching.truncated(n),
            )  # fmt: skip
            found.append((thin, float(flexible[-1] / self.omega[n - 1])))
        return found

    def loosened(self) -> "ReducedBody":
        """The body with the rigid motions that it may have besides, as its first modes, slow as masses."""
        n = self.loose.shape[1]
        still, slow = np.zeros(n), np.full(n, 1e-4 * self.omega[0])
        bias = self.force * self.loose[0] if self.force else still
        return replace(
            self, omega=np.append(slow, self.omega), zeta=np.append(still, self.zeta),
            rows=np.hstack([self.loose, self.rows]), q=np.append(still, self.q), p=np.append(still, self.p),
            bias=np.append(bias, self.bias),
        )  # fmt: skip

    def described_by(self, modes: Modes) -> "ReducedBody":
        """The same body in the same motion, described by other modes."""
        moving = self.omega == 0.0
        if self.q.any() or self.p[~moving].any():
            raise ValueError("a body of Ritz vectors must start at rest; find its modes with find_modes")
        other, rigid = part_of(modes, self.touched, self.points).push_body(self.force), modes.omega == 0.0
        rows, velocity = other.rows, other.p
        if self.p.any():
            velocity = float(self.rows[0] @ self.p) * modes.rigid_motion(self.points[:1])
        # rigid motions are known up to a rotation among them, which would look like a difference of speeds
        here, there = np.vstack([rows, velocity])[:, rigid], np.vstack([self.rows, self.p])[:, moving]
        left, _, right = np.linalg.svd(here.T @ there)
        turned = here @ left @ right
        rows, velocity = rows.copy(), velocity.copy()
        rows[:, rigid], velocity[rigid] = turned[:-1], turned[-1]
        other = replace(other, rows=rows, p=velocity, bias=self.force * rows[0] if self.force else other.bias)
        return replace(other, stretching=None if self.stretching is None else stretch(modes))


def unit_forms(rest: np.ndarray) -> np.ndarray:
    """Forms (n_ends, n_forms) of unit stiffness that yield by a compliance (n_ends, n_ends) [m/N]."""
    size, vectors = np.linalg.eigh(rest)
    kept = size > ROUNDING * size[-1]
    return np.asarray(vectors[:, kept] * np.sqrt(size[kept]))


def part_of(modes: Modes, touched: Touched, points: np.ndarray, residual: bool = True) -> ReducedBody:
    """An undeformed body at rest touched at points; ``residual``: modes left out yield. Its modes remember it."""

    def reduced() -> ReducedBody:
        rows = np.atleast_2d(modes.shapes.at(points)) if touched else np.zeros((0, modes.n_modes))
        rest = left_out(modes, points, rows) if residual and modes.dimension and touched else None
        return reduce_body(modes, touched, points, rows, rest)

    found: ReducedBody = modes.known.recall((points.tobytes(), touched, residual), reduced)
    return found


def part_of_striker(striker: Striker, residual: bool = True) -> ReducedBody:
    """A striker as it is held, undeformed and at rest, as `part_of`; it remembers it."""

    def reduced() -> ReducedBody:
        rest = striker.left_out if residual and striker.modes.dimension else None
        part = reduce_body(striker.body, ((0, 1.0),), striker.at[None], striker.shape[None], rest)
        return replace(part, bias=part.bias + striker.push, held=int(striker.hand is not None))

    found: ReducedBody = striker.known.recall(("reduced", residual), reduced)
    return found


def reduce_body(
    modes: Modes, touched: Touched, points: np.ndarray, rows: np.ndarray, left_out: tuple[np.ndarray, np.ndarray] | None
) -> ReducedBody:
    """An undeformed body at rest, with its shapes and residual compliance at its contacts."""
    n_ends = len(touched)
    rest, doubt = (np.zeros((n_ends, n_ends)), np.zeros(n_ends)) if left_out is None else left_out
    rest = 0.5 * (rest + rest.T)
    carried = np.square(rows / np.where(modes.omega > 0.0, modes.omega, np.inf)).sum()
    largest = rest[0, 0] if n_ends == 1 else np.linalg.eigvalsh(rest)[-1] if n_ends else 0.0
    if largest <= ROUNDING * (rest.trace() + carried):
        rest = np.zeros_like(rest)
    still, pressed = np.zeros(modes.n_modes), np.zeros((n_ends, 2))
    part = ReducedBody(
        modes.omega, modes.damping_ratio, rows, touched, rest, doubt, still, still, still, 0.0, points, pressed,
        np.zeros((n_ends, 0)) if left_out is None else modes.shapes.loose(points),
        modes.shapes.spread(points) if n_ends else None,
    )  # fmt: skip
    check.lock_arrays(part)
    return part


def stretched_in(parts: Sequence[ReducedBody]) -> Stretched | None:
    """How one of some bodies stretches, if it does."""
    first, found = 0, None
    for part in parts:
        if part.stretching is not None:
            found = Stretched(part.stretching.forms, part.stretching.linear, first)
        first += len(part.omega)
    return found


@lru_cache(maxsize=64)
def _table_of_laws(laws: tuple[Contact, ...]) -> tuple[np.ndarray, np.ndarray, list[bool]]:
    """Contacts as the kernels read them, the approach at first [m], and whether rates count, (n_contacts,) each."""
    numbers, gaps, rated = zip(*((each.numbers, each.gap, each.rated) for each in laws))
    return table(list(numbers)), -np.array(gaps), list(rated)


def join_bodies(parts: Sequence[ReducedBody], laws: Sequence[Contact]) -> KernelSystem:
    """Join the modes of all bodies; series springs or replacement modes stand in for the left-out modes.

    A series spring is exact only for a body with one lossless contact. Otherwise each eigenvector of the residual
    compliance becomes a mode above the last kept one, so that loss and other contacts act on it too.
    """
    law, offset, rated = _table_of_laws(tuple(laws))
    law, offset, forms, n = law.copy(), offset.copy(), [], 0
    for part in parts:
        forms.append(part.forms(rated) if part.yields else np.zeros((0, 0)))
        n += len(part.omega) + forms[-1].shape[1]
    columns, shape = np.zeros((5, n)), np.zeros((len(laws), n))  # frequency, damping, constant force, state; shapes
    start = 0
    for part, form in zip(parts, forms):
        own = slice(start, start + len(part.omega))
        start = own.stop
        columns[:, own] = part.omega, part.zeta, part.bias, part.q, part.p
        for (i, sign), row in zip(part.touched, part.rows):
            shape[i, own] += sign * row
        if part.memory is not None:
            law["memory"][[i for i, _ in part.touched]] = part.memory
        if part.yields and not form.size:
            first, sign = part.touched[0]
            law["compliance"][first] += part.rest[0, 0]
            offset[first] += sign * part.rest[0, 0] * part.force
    loss = float((law["loss"] * (np.abs(shape) @ np.abs(columns[4]))).max()) if True in rated else None
    for part, form in zip(parts, forms):
        if form.size:
            pushed = np.square(part.rows).sum() / part.rest.trace()
            above, damping = rest_mode(part.points.shape[1], part.omega[-1], part.zeta[-1], loss, pushed)
            for shares in form.T:
                held = np.zeros(2)
                for (i, sign), share, force in zip(part.touched, shares, part.pressed):
                    shape[i, start] += sign * share * above
                    held -= sign * share / above * force
                columns[:, start] = above, damping, 0.0, *held
                start += 1
    return KernelSystem(columns[0], columns[1], shape, offset, columns[2], law, columns[3], columns[4])


def rest_mode(dimension: int, omega: float, zeta: float, loss: float | None, pushed: float) -> tuple[float, float]:
    """Frequency [rad/s] and damping ratio [-] of the mode that replaces those above the last kept one.

    If only rigid motions are kept, ``pushed`` is the square of the frequency of their mass on the residual compliance.
    ``loss`` is the largest loss factor times speed of the contacts, None if their forces do not depend on rates.

    A lossy force depends on the approach rate, in which an undamped mode just above the last one would ring. A
    critically damped mode far above, at 30 times its frequency, acts like a series spring and takes almost no energy.
    A sticky contact would hold the little mass of that one within nanoseconds, and feels no difference: against three
    times as many modes, 33 random blows on a body erred no more with the nearer one, and took a quarter of the time.
    """
    omega = omega or np.sqrt(pushed)
    if loss is None:
        return REST_ABOVE[min(dimension, 2)] * omega, float(zeta)
    return max(5.0, 30.0 * np.sqrt(STICKY / max(loss, STICKY))) * omega, 1.0


def ends_of(parts: Sequence[ReducedBody], laws: Sequence[Contact]) -> tuple[Ends, ...]:
    """Where every body is touched; a constant force makes left-out modes dip only if a series spring replaces them."""
    found, last, rated = [], 0, _table_of_laws(tuple(laws))[2]
    for part in parts:
        last += len(part.omega)
    for part in parts:
        forms = slice(last, last + (part.forms(rated).shape[1] if part.yields else 0))
        last = forms.stop
        dips = part.force if part.yields and forms.start == forms.stop else 0.0
        there = part.points, part.touched, part.force, part.rest
        found.append(Ends(*there, forms, dips, part.speed, part.doubtful, part.coming))
    return tuple(found)
