"""Modes picked from measured frequency responses: a pole at each peak, all refined together, and what moves with it.

The accelerance of channel k is ``H_k = L_k - omega**2 (R_k + sum over r of A_kr / (omega_r**2 - omega**2 + 2 i zeta_r
omega_r omega))``: L and R stand for the modes far below and above the band, poles up to half beyond its ends for nearer
ones, and ``A_kr`` is the product of the mass-normalised deflections [kg**-0.5] at both ends. With real A, those of
normal modes, the sum is linear in all but the poles (least squares frequency domain; Ewins, Modal Testing, chapter 4).
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from .._base import check
from .._base.rounding import ROUNDING
from .._base.threads import one_thread
from . import cell_kinds

PER_FORCE = {"m/s^2/N": 2, "m/s/N": 1, "m/N": 0}  # unit of a response -> times that it was differentiated
FELT = 0.1  # [-] of the largest force spectrum: 20 dB below it a hammer excites too little (ISO 7626-5)
PROMINENCE = 1.5  # [-] of logarithms: peaks of less than a factor of 4.5 over their surroundings may be noise
DAMPING = 1e-6, 0.5  # [-] damping ratios of a peak that is sought
GAIN = 10.0  # [-] of the noise variance: what each value of one more mode must explain, where luck explains one
LINES = 9  # [-] whose mean sets the weight of a line: a third of the noise; 5 and 21 do as well (test_picked.py)
ABOUT = 20  # [-] lines on either side of a peak that give the noise there, to a tenth
ENDS = ("node", "direction"), ("reference", "reference_direction")


class Picked(NamedTuple):
    """Poles at peaks, and the products of deflections, with their standard errors."""

    frequencies: np.ndarray  # (n_modes,) [Hz], undamped
    damping_ratio: np.ndarray  # (n_modes,)
    products: np.ndarray  # (n_channels, n_modes) [1/kg]
    errors: np.ndarray  # (n_channels, n_modes) [1/kg]
    misfit: np.ndarray  # (n_channels, n_modes) [-] what is left of the responses at each peak, over the mode's share
    left: float  # [-] root mean square that they leave of the responses, each frequency by its weight
    frequency_errors: np.ndarray  # (n_modes,) [Hz] standard errors
    damping_errors: np.ndarray  # (n_modes,) [-] the same
    alike: float  # [-] neighbouring lines that say the same, for which all errors are widened by its root
    late: np.ndarray  # (n_channels,) [s] delays of the responses that were taken off; 0 of most


def peaks(size: np.ndarray) -> np.ndarray:
    """Numbers of the peaks of magnitudes (n_frequencies,) that noise does not make."""
    from scipy.signal import find_peaks  # imported here because it takes 0.3 s

    return find_peaks(np.log(np.maximum(size, 1e-300)), prominence=PROMINENCE)[0]


def is_frf(value: Any) -> bool:
    """Whether something is a table as `fi.frf` returns it."""
    names = getattr(value, "coords", ())
    return "H" in getattr(value, "data_vars", ()) and all(name in names for name in ("frequency", "channel", "units"))


def responses(name: str, found: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where there is force: s (n,) [rad/s], accelerances (n, n_channels) [1/kg], weights (n,), which lines.

    An exponential window over force and response moves s = i omega by the damping that it adds, and does nothing else.
    """
    if not is_frf(found) or found["H"].dims != ("frequency", "channel") or not found["H"].size:
        raise ValueError(f"{name} must be frequency responses as fi.frf returns them, got {check.shown(found)}")
    units = [str(unit) for unit in found["units"].values]
    for unit in units:
        check.one_of(f"{name}.units", unit, PER_FORCE)
    omega = 2.0 * np.pi * check.ascending(f"{name}.frequency", found["frequency"].values, "Hz")
    values = np.asarray(found["H"].values, complex)
    if not (np.abs(values) <= check.REACH).all():
        raise ValueError(f"{name}.H must be finite")
    used = omega > 0.0
    if "force" in found:
        used &= found["force"].values >= FELT * found["force"].values.max()
    sure = np.nan_to_num(found["coherence"].values).mean(axis=1)[used] if "coherence" in found else np.ones(used.sum())
    omega = omega[used]
    s = 1j * omega + check.non_negative(f"{name}.added_damping", found.attrs.get("added_damping", 0.0), "1/s")
    values = values[used] * s[:, None] ** (2 - np.array([PER_FORCE[unit] for unit in units]))
    size = np.sqrt(np.square(np.abs(values)).mean(axis=1))
    # errors go with the response where it is large, and are noise where it is small; by the noise of its own line, one
    # that rises above its neighbours would count less than one that falls below them
    if not (size * sure).any():
        raise ValueError(
            f"{name} must hold responses that are not zero, nor of no coherence, where its force has power"
        )
    size, sure = (uniform_filter1d(each, LINES, mode="nearest") for each in (size, sure))
    return s, values, sure / np.hypot(size, max(np.median(size), ROUNDING * size.max())), used


@one_thread
def pick(name: str, found: Any, about: Any = None) -> Picked:
    """The modes at the peaks of frequency responses, or near the frequencies ``about`` (n_modes,) [Hz].

    Peaks whose pole runs away in the search, or that noise explains, are no modes and are left out. A delay of a
    channel is taken off; a smaller turn of its phases, as sensors that block what is slow leave, is in the errors.
    """
    s, values, weight, _ = responses(name, found)
    omega, decay, turn = s.imag, s.real[0] if len(s) else 0.0, s / np.maximum(np.abs(s), 1e-300) / 1j
    values = values * (np.square(omega / np.abs(s)))[:, None]  # with poles moved by the decay of a window: turned s**2
    size = np.sqrt(np.square(np.abs(values)).mean(axis=1)) / np.maximum(omega, 1e-300)
    if about is None:
        summits = peaks(size)
    else:
        wanted = 2.0 * np.pi * check.ascending("frequencies", about, "Hz")
        if wanted.size and not (len(omega) and omega[0] <= wanted[0] and wanted[-1] <= omega[-1]):
            raise ValueError(f"frequencies must lie within those of {name}, where its force has power")
        summits = np.unique([int(np.abs(omega - one).argmin()) for one in wanted]).astype(int)
    apart = np.diff(np.log(omega[summits]), prepend=-np.inf, append=np.inf)
    widths = np.minimum([_damping(omega, size, i) for i in summits], 0.5 * np.minimum(apart[1:], apart[:-1]))
    start = np.log(np.stack([omega[summits], widths])).reshape(2, -1)
    data = np.vstack([(values * weight[:, None]).real, (values * weight[:, None]).imag])
    weight = weight * turn**2
    late, (found_modes, begun) = _in_time(omega, data, weight, start, about is not None)
    poles, basis, constants, rest = found_modes
    n, inside = poles.shape[1], _inside(omega, poles)
    if about is not None:  # what else there is helps to find them
        inside &= np.isin(np.arange(n), np.abs(poles[0] - begun[:, None]).argmin(axis=1)) if n else False
    if not inside.any():
        raise ValueError(f"{name} has no peaks that are modes; give frequencies= near which they are sought")
    spare = max(1, len(basis) - basis.shape[1])
    wide = _alike(rest)
    spread = np.sqrt(wide * np.diag(np.linalg.pinv(basis.T @ basis))[:, None] * np.square(rest).sum(axis=0) / spare)
    natural, damping = np.exp(poles)
    doubt = np.sqrt(wide) * _pole_errors(omega, weight, poles, constants[:n], rest)
    moved = _moved_by_phases(omega, weight, found_modes)
    doubt, spread = np.hypot(doubt, moved[0]), np.hypot(spread[:n], moved[1])
    doubt *= np.stack([natural / (2.0 * np.pi), damping])
    inner = natural**2 + decay * (decay - 2.0 * damping * natural)  # of poles that a window has moved
    damping, natural = np.maximum(damping * natural - decay, 0.0) / np.sqrt(inner), np.sqrt(inner)
    left = float(np.linalg.norm(rest) / max(float(np.linalg.norm(data)), 1e-300))
    misfit = _misfit(omega, np.exp(poles), basis[:, :n], constants[:n], rest)
    whole = natural / (2.0 * np.pi), damping, constants[:n].T, spread.T, misfit, *doubt
    kept = [each[..., inside] for each in whole]
    return Picked(kept[0], kept[1], kept[2], kept[3], kept[4], left, kept[5], kept[6], wide, late)


def _in_time(
    omega: np.ndarray, data: np.ndarray, weight: np.ndarray, start: np.ndarray, given: bool
) -> tuple[np.ndarray, tuple["_Modes", np.ndarray]]:
    """How much later than the force each response comes, (n_channels,) [s], and what `_search` finds without that.

    A delay counts if modes leave less than half without it, and if it turns the band by more than 0.3: one that does
    less may be the damping's form. Real products tell it from a wave's travel.
    """

    def searched(late: np.ndarray) -> tuple["_Modes", np.ndarray]:
        return _search(omega, _turned(data, omega[:, None] * late), weight, start, given)

    trials = np.linspace(-3.0, 3.0, 25) / omega[-1]
    q = np.linalg.qr(_basis(omega, weight, start)[0])[0]
    explained = np.array([np.square(q.T @ _turned(data, one * omega[:, None])).sum(axis=0) for one in trials])
    left = np.square(data).sum(axis=0) - explained  # (n_trials, n_channels)
    left /= np.maximum(left[len(trials) // 2], 1e-300)
    shared = int(left.mean(axis=1).argmin())
    late = np.where(left[shared] < 1.0, trials[shared], 0.0) * (left[shared].mean() < 0.5)
    late = np.where(left.min(axis=0) < 0.5, trials[left.argmin(axis=0)], late)
    plain = _search(omega, data, weight, start, given)
    found = searched(late) if late.any() else plain
    for _ in range(4):
        step, share = _phases(omega, found[0], (1.0,))
        sure = (share > 0.5) & (np.abs(step[0] * omega[-1]) > np.where(late, 0.0, 0.3))
        if not sure.any():
            break
        late = late + np.where(sure, step[0], 0.0)
        found = searched(late)
    less = np.square(found[0].rest).sum(axis=0) < 0.5 * np.square(plain[0].rest).sum(axis=0)
    kept = np.where(less & (np.abs(late) * omega[-1] > 0.3), late, 0.0)
    if (kept != late).any():
        found = searched(kept) if kept.any() else plain
    return kept, found


def _turned(data: np.ndarray, phases: np.ndarray) -> np.ndarray:
    """Real over imaginary parts, (2 n_frequencies, n_channels), turned by phases."""
    turned = (data[: len(data) // 2] + 1j * data[len(data) // 2 :]) * np.exp(1j * phases)
    return np.vstack([turned.real, turned.imag])


def _phases(omega: np.ndarray, found: "_Modes", powers: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Phases, as sums of powers of omega, that explain what is left of responses: (n_powers, n_channels), the share.

    What products make up for is not in it.
    """
    n, q = found.poles.shape[1], np.linalg.qr(found.basis)[0]
    ways = _turned(found.basis[:, :n] @ found.constants[:n], np.full((len(omega), 1), -0.5 * np.pi))
    steps, shares = np.zeros((len(powers), ways.shape[1])), np.zeros(ways.shape[1])
    for k, (way, rest) in enumerate(zip(ways.T, found.rest.T)):
        columns = way[:, None] * np.tile(omega, 2)[:, None] ** np.array(powers)
        columns -= q @ (q.T @ columns)
        sizes = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        part = np.linalg.lstsq(columns / sizes, rest, rcond=None)[0]
        steps[:, k] = part / sizes
        shares[k] = np.square(columns / sizes @ part).sum() / max(float(np.square(rest).sum()), 1e-300)
    return steps, shares


def _moved_by_phases(omega: np.ndarray, weight: np.ndarray, found: "_Modes") -> tuple[np.ndarray, np.ndarray]:
    """How far logarithms of poles (2, n_modes) and products (n_modes, n_channels) go without a delay of each channel,
    whose phases go with omega, and without what blocks slow changes, as couplings do: these go with one over it."""
    n, (delay, block) = found.poles.shape[1], _phases(omega, found, (1.0, -1.0))[0]
    turned = _turned(found.basis @ found.constants + found.rest, omega[:, None] * delay + block / omega[:, None])
    after = _fit(omega, turned, weight, found.poles, 5)
    after = after if after.poles.shape[1] == n else found
    return np.abs(after.poles - found.poles), np.abs(after.constants - found.constants)[:n]


def _search(
    omega: np.ndarray, data: np.ndarray, weight: np.ndarray, start: np.ndarray, given: bool
) -> tuple["_Modes", np.ndarray]:
    """The modes from poles on, those hidden beside them and without those of noise; where the ones ``given`` began."""
    found, begun = _fit(omega, data, weight, start, 60 if given else 5), np.zeros(0)
    if given:
        begun = found.poles[0]
    else:
        found = _without_noise(omega, data, weight, found, begun)
    found = _fit(omega, data, weight, _with_more(omega, data, weight, found).poles)
    return _without_noise(omega, data, weight, found, begun, alike=True), begun


def _alike(rest: np.ndarray) -> float:
    """How many neighbouring lines of what is left, (2 n_frequencies, n_channels), say the same: one of white noise.

    More of spectra padded with zeros or windowed, and where modes out of the band are not quite followed.
    """
    left = rest[: len(rest) // 2] + 1j * rest[len(rest) // 2 :]
    left = left / np.maximum(np.sqrt(uniform_filter1d(np.square(np.abs(left)), 2 * ABOUT, axis=0)), 1e-300)
    found, whole = 1.0, float(np.square(np.abs(left)).sum())
    for lag in range(1, len(left) // 4):
        share = abs((left[lag:] * left[:-lag].conj()).sum()) / max(whole, 1e-300)
        if share < 3.0 / np.sqrt(left.size):
            break
        found += 2.0 * share
    return found


def _pole_errors(
    omega: np.ndarray, weight: np.ndarray, poles: np.ndarray, products: np.ndarray, rest: np.ndarray
) -> np.ndarray:
    """Standard errors (2, n_modes) [-] of the logarithms of poles, from what the modes leave of the responses.

    The noise may differ from line to line and from channel to channel: what is left counts where it is left (White
    1980, Econometrica 48, 817-838), more where a line has much to say (MacKinnon and White 1985, HC2).
    """
    basis, slopes = _basis(omega, weight, poles)
    q = np.linalg.qr(basis)[0]
    columns, square = _curvature(q, slopes, np.tile(products, (2, 1)))
    inner = np.zeros(square.shape)
    for own, left in zip(products.T, rest.T):
        moved = columns * np.tile(own, 2)  # (2 n_frequencies, 2 n_modes)
        lever = np.square(q).sum(axis=1) + np.square(np.linalg.qr(moved)[0]).sum(axis=1) / rest.shape[1]
        felt = moved * (left / np.sqrt(np.maximum(1.0 - lever, 1e-3)))[:, None]
        inner += felt.T @ felt
    size = np.sqrt(np.maximum(np.diag(square), 1e-300))  # of modes that hardly move, too
    back = np.linalg.pinv(square / np.outer(size, size), hermitian=True)
    return np.sqrt(np.maximum(np.diag(back @ (inner / np.outer(size, size)) @ back), 0.0) / size**2).reshape(2, -1)


def _curvature(q: np.ndarray, slopes: np.ndarray, products: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slopes by logarithms of poles that products cannot make up for, and half the curvature of the sum of squares.

    ``q`` (2 n_frequencies, n_modes + 2) spans the basis, ``products`` are (2 n_modes, n_channels).
    """
    columns = np.concatenate(list(slopes), axis=1)
    columns -= q @ (q.T @ columns)
    return columns, (columns.T @ columns) * (products @ products.T)


def _misfit(
    omega: np.ndarray, poles: np.ndarray, basis: np.ndarray, products: np.ndarray, rest: np.ndarray
) -> np.ndarray:
    """What is left within half a half-power width of each peak over the mode's own share, (n_channels, n_modes) [-].

    It errs in step over a peak, where noise would not, so that it does not average out.
    """
    found = np.zeros((rest.shape[1], len(products)))
    for k, (natural, damping) in enumerate(poles.T):
        near = np.tile(np.abs(omega - natural) <= max(damping * natural, np.abs(omega - natural).min()), 2)
        own = np.linalg.norm(basis[near, k]) * np.abs(products[k])
        found[:, k] = np.linalg.norm(rest[near], axis=0) / np.maximum(own, 1e-300)
    return found


def _inside(omega: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """Which poles (2, n_modes) lie within the band, (n_modes,) bool."""
    return (poles[0] >= np.log(omega[0])) & (poles[0] <= np.log(omega[-1]))


class _Modes(NamedTuple):
    poles: np.ndarray  # (2, n_modes) logarithms of natural frequencies [rad/s] and damping ratios
    basis: np.ndarray  # (2 n_frequencies, n_modes + 2)
    constants: np.ndarray  # (n_modes + 2, n_channels)
    rest: np.ndarray  # (2 n_frequencies, n_channels) weighted residual


def _fit(omega: np.ndarray, data: np.ndarray, weight: np.ndarray, start: np.ndarray, steps: int = 60) -> _Modes:
    """The modes near poles (2, n_modes); those whose pole runs away are none."""
    poles, ran = start, np.ones(start.shape[1], bool)
    while ran.any():
        if len(data) <= 4 * poles.shape[1] + 4:  # too few lines for any
            poles = poles[:, :0]
            break
        poles, ran = _refined(omega, data, weight, poles, steps)
        poles = poles[:, ~ran]
    basis = _basis(omega, weight, poles)[0]
    constants = np.linalg.lstsq(basis, data, rcond=None)[0]
    return _Modes(poles, basis, constants, data - basis @ constants)


def _with_more(omega: np.ndarray, data: np.ndarray, weight: np.ndarray, found: _Modes) -> _Modes:
    """The modes and those hidden beside them, which show in what is left; and some above and below the band."""
    places = [None, 1.2 * omega[-1], omega[0] / 1.2]
    while places:
        more = _with_one_more(omega, data, weight, found, places[0])
        if more is None and places[0] is None:
            more = _with_one_split(omega, data, weight, found)
        if more is None:
            places = places[1:]
        else:
            found = more
    return found


def _with_one_more(
    omega: np.ndarray, data: np.ndarray, weight: np.ndarray, before: _Modes, at: float | None
) -> _Modes | None:
    """The modes and one at ``at`` [rad/s], or where they leave most; None if that is noise, or too near another."""
    n = before.poles.shape[1]
    size = np.linalg.norm(before.rest.reshape(2, len(omega), -1), axis=(0, 2))
    natural, damping = np.exp(before.poles)
    apart = (np.abs(omega[:, None] - natural) > damping * natural).all(axis=1)  # half a half-power width
    place = int(np.where(apart, size, 0.0).argmax())
    width = np.median(before.poles[1]) if n else np.log(_damping(omega, size, place))
    start = np.column_stack([before.poles, [np.log(omega[place] if at is None else at), width]])
    after = _fit(omega, data, weight, start[:, np.argsort(start[0])])  # one may run away, which the others replace
    natural, damping = np.exp(after.poles)
    near = np.diff(natural) < (damping * natural)[1:]
    gain = np.square(before.rest).sum() - np.square(after.rest).sum()
    return None if near.any() or gain < _luck(data, after, place) else after


def _luck(data: np.ndarray, modes: _Modes, place: int) -> float:
    """What one more mode at a line may explain of noise alone, from what all leave there, or everywhere."""
    noise = np.square(modes.rest).sum() / (max(1, len(data) - modes.basis.shape[1]) * data.shape[1])
    about = modes.rest.reshape(2, len(data) // 2, -1)[:, max(0, place - ABOUT) : place + ABOUT + 1]
    # larger where the hammer has little force; what is left of exact responses is rounding
    noise = max(noise, np.square(about).mean(), np.square(ROUNDING * data).mean())
    return GAIN * (2 + data.shape[1]) * float(noise)


def _without_noise(
    omega: np.ndarray, data: np.ndarray, weight: np.ndarray, found: _Modes, kept: np.ndarray, alike: bool = False
) -> _Modes:
    """The modes within the band that explain more than noise does, each beside the others, and those nearest ``kept``.

    ``kept`` are logarithms of frequencies; ``alike`` tells whether what is left says how often it says the same.
    """
    while n := found.poles.shape[1]:
        own = np.diag(np.linalg.pinv(found.basis.T @ found.basis))[:n]
        gain = np.square(found.constants[:n]).sum(axis=1) / np.maximum(own, 1e-300)
        places = np.abs(omega[:, None] - np.exp(found.poles[0])).argmin(axis=0)
        share = gain / [_luck(data, found, place) for place in places]
        if alike:  # lines that say the same add up, over the half-power width at most
            width = 2.0 * np.exp(found.poles.sum(axis=0)) / np.gradient(omega)[places]
            share /= np.clip(width, 1.0, _alike(found.rest))
        share[~_inside(omega, found.poles)] = np.inf
        share[np.abs(found.poles[0] - kept[:, None]).argmin(axis=1)] = np.inf
        poor = share < 1.0
        # of two beside each other either may do without the other: the poorer goes first
        poor[1:] &= share[1:] <= np.where(poor[:-1], share[:-1], np.inf)
        poor[:-1] &= share[:-1] < np.where(poor[1:], share[1:], np.inf)
        if not poor.any():
            break
        found = _fit(omega, data, weight, found.poles[:, ~poor], 60 if alike else 5)
    return found


def _with_one_split(omega: np.ndarray, data: np.ndarray, weight: np.ndarray, before: _Modes) -> _Modes | None:
    """The modes, of which one becomes two where what is left about it is no noise; None if none does.

    Complex products, as of dampers at single places, delays or friction, leave something about a pole, too: two must
    explain more.
    """
    n, (natural, damping) = before.poles.shape[1], np.exp(before.poles)
    q = np.linalg.qr(before.basis)[0]

    def explained(columns: np.ndarray) -> float:
        moved = np.linalg.qr(columns - q @ (q.T @ columns))[0]
        return float(np.square(moved.T @ before.rest).sum())

    half = len(omega)
    turned = np.vstack([-before.basis[half:, :n], before.basis[:half, :n]])  # i times each
    shifts = 0.5 * np.stack([-damping, damping])  # a quarter of a half-power width to either side
    beside = before.poles + np.stack([shifts, np.zeros(shifts.shape)], axis=1)  # (2 sides, 2, n_modes)
    columns = [_basis(omega, weight, each)[0][:, :n] for each in beside]
    places = np.abs(omega[:, None] - natural).argmin(axis=0)
    gains = np.array([explained(np.stack([each[:, k] for each in columns], axis=1)) for k in range(n)])
    least = [max(explained(turned[:, [k]]), 0.3 * _luck(data, before, places[k])) for k in range(n)]
    for k in np.argsort(-gains):
        if gains[k] > least[k]:
            start = np.hstack([before.poles[:, :k], beside[:, :, k].T, before.poles[:, k + 1 :]])
            after = _fit(omega, data, weight, start)
            apart = np.diff(after.poles[0]) > 0.05 * np.exp(after.poles[1, 1:])
            gain = np.square(before.rest).sum() - np.square(after.rest).sum() - explained(turned)
            if after.poles.shape[1] == n + 1 and apart.all() and gain > _luck(data, after, places[k]):
                return after
    return None


def unit_responses(s: np.ndarray, weight: np.ndarray, poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weighted accelerances (n, n_modes) of unit modes at s (n,) [rad/s], and their slopes (2, n, n_modes).

    These are by the logarithms of natural frequencies and of damping ratios, ``poles`` (2, n_modes).
    """
    natural, damping = np.exp(poles)
    square, swing = (s**2)[:, None], 2.0 * damping * natural * s[:, None]
    under = weight[:, None] / (square + swing + natural**2)
    steep = -square * under**2 / weight[:, None]
    return square * under, np.stack([steep * (2.0 * natural**2 + swing), steep * swing])


def _basis(omega: np.ndarray, weight: np.ndarray, poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weighted columns of modes, of those below and of those above, real over imaginary parts, (2 n, n_modes + 2); and
    slopes (2, 2 n, n_modes) of the first by logarithms of frequencies and damping ratios, ``poles`` (2, n_modes)."""
    modes, slopes = unit_responses(1j * omega, weight, poles)
    columns = np.hstack([modes, np.column_stack([np.abs(weight), -weight * (omega / omega[-1]) ** 2])])
    return np.vstack([columns.real, columns.imag]), np.concatenate([slopes.real, slopes.imag], axis=1)


def _refined(omega: np.ndarray, data: np.ndarray, weight: np.ndarray, start: np.ndarray, steps: int):
    """Logarithms (2, n_modes) of natural frequencies and damping ratios near some, and which of them ran away.

    The products are eliminated (variable projection; Kaufman 1975, BIT 15, 49-57), the rest is a Levenberg-Marquardt
    search.
    """
    n = start.shape[1]
    middle = 0.5 * (start[0, 1:] + start[0, :-1])
    low = np.concatenate([[np.log(omega[0] / 1.5)], middle, np.full(n, np.log(DAMPING[0]))])[: 2 * n]
    high = np.concatenate([middle, [np.log(1.5 * omega[-1])], np.full(n, np.log(DAMPING[1]))])[-2 * n :]
    # poles within one peak share it: what was the middle between them need not stay between them
    close = np.flatnonzero(np.diff(start[0]) < 1.5 * np.exp(np.maximum(start[1, 1:], start[1, :-1])))
    for i in close:
        low[i + 1] = low[i]
    for i in close[::-1]:
        high[i] = high[i + 1]
    edge = 1e-3 * (high - low)  # of frequencies, of the nearer end: neighbours may lie closer than this
    edge[:n] = 1e-3 * np.minimum(high[:n] - start[0], start[0] - low[:n])
    x, caution, cost = np.clip(start.ravel(), low + edge, high - edge), 1e-3, np.inf
    best = x
    for _ in range(steps):
        basis, slopes = _basis(omega, weight, x.reshape(2, n))
        q, r = np.linalg.qr(basis)
        products = np.tile(np.linalg.lstsq(r, q.T @ data, rcond=None)[0][:n], (2, 1))  # (2 n_modes, n_channels)
        rest = data - q @ (q.T @ data)
        before, cost = cost, float(np.square(rest).sum())
        if cost >= before:
            x, cost, caution = best, before, 10.0 * caution
        else:
            columns, square = _curvature(q, slopes, products)
            slope = ((columns.T @ rest) * products).sum(axis=1)
            best, caution = x, 0.1 * caution
            if cost > (1.0 - 1e-6) * before:
                break
        step = np.linalg.lstsq(square + caution * np.diag(np.diag(square)), slope, rcond=None)[0]
        x = np.clip(best + step, low, high)
    near = (best - low < edge) | (high - best < edge)
    order = np.argsort(best[:n], kind="stable")
    return best.reshape(2, n)[:, order], near.reshape(2, n).any(axis=0)[order]


def _damping(omega: np.ndarray, size: np.ndarray, i: int) -> float:
    """Damping ratio [-] by the half-power width of a peak."""
    below = size < np.sqrt(0.5) * size[i]
    left = i - int(below[i::-1].argmax()) if below[: i + 1].any() else 0
    right = i + int(below[i:].argmax()) if below[i:].any() else len(size) - 1
    return float(np.clip(0.5 * (omega[right] - omega[left]) / omega[i], 10.0 * DAMPING[0], 0.1 * DAMPING[1]))


def check_driving(found: Any, drive: int, own: np.ndarray, moved: np.ndarray) -> None:
    """ValueError if most of what the point struck does, (n,), is against the force, or if it does not move."""
    if (own < 0.0).sum() > (own > 0.0).sum():
        raise ValueError(
            f"frf has a response at the point struck, {label(found, drive)}, that moves against the force; change the "
            "sign of its direction"
        )
    if not moved.any():
        raise ValueError(f"frf must have a response {label(found, drive)} at the point struck that moves in its modes")


@one_thread
def modes_of(found: Any, driving: Any, points: Any, about: Any) -> tuple[dict[str, Any], np.ndarray, list[str]]:
    """Frequencies, damping ratios, mass-normalised shapes and points of `Modes.from_frf`; errors of shapes; notes.

    The errors (n_points, n_modes) are relative, of squared shapes.
    """
    picked = pick("frf", found, about)
    drive, used, sign, end = find_driving_point(found, driving)
    products = sign[:, None] * picked.products[used]
    own, doubt = products[used.index(drive)], picked.errors[drive]
    moved = own * picked.alike**0.5 > 3.0 * doubt  # standard errors of noise alone: others count as errors of shapes
    check_driving(found, drive, own, moved)
    rest = f"of which {100.0 * picked.left:.2g} % rms are left unexplained"
    rest += "; check their units, signs and delays" * (picked.left > 0.5)  # sharing nothing makes it 1
    notes = [f"picked from frequency responses, {rest}", *notes_of_delays(found, picked.late)]
    against = own * picked.alike**0.5 < -3.0 * doubt
    for left, why in ((~moved & ~against, "hardly moves"), (against, "moves against the force")):
        if left.any():
            lost = ", ".join(f"{one:.5g} Hz" for one in picked.frequencies[left])
            notes.append(f"modes at {lost} are left out: the point struck {why} in them, so that they have no scale")
    if against.any():
        notes[-1] += f"; check whether {label(found, drive)} is the response there, or exchanged with another"
    errors = np.hypot(picked.errors[used] / np.maximum(np.abs(products), 1e-300), picked.misfit[used])
    return {
        "frequencies": picked.frequencies[moved], "damping_ratio": picked.damping_ratio[moved],
        "shapes": products[:, moved] / np.sqrt(own[moved]), "points": response_points(found, points, used, end),
    }, errors[:, moved], notes  # fmt: skip


def notes_of_delays(found: Any, late: np.ndarray) -> list[str]:
    """What is said of delays (n_channels,) [s] that were taken off the responses."""
    notes = []
    for i in np.flatnonzero(late):
        way, size = "late" if late[i] > 0.0 else "early", 1e3 * abs(late[i])
        one = f"{label(found, int(i))} seems {way} against the force, by {size:.2g} ms, which are taken off"
        notes.append(f"{one}; check its delay")
    return notes


def label(found: Any, i: int) -> str:
    return repr(str(found["channel"].values[i]))


def find_driving_point(found: Any, driving: Any) -> tuple[int, list[int], np.ndarray, str]:
    """The channel at the point struck, the channels along its direction, their signs, and which end moves."""
    count, names = found.sizes["channel"], [str(name) for name in found["channel"].values]
    if driving is not None:
        drive = names.index(check.one_of("driving", driving, names)) if isinstance(driving, str) else check.count(
            "driving", driving, low=0, high=count - 1
        )  # fmt: skip
    if not all(name in found.coords for pair in ENDS for name in pair):
        if driving is None:
            raise ValueError("driving must name the channel at the point struck: these responses state no nodes")
        return drive, list(range(count)), np.ones(count), "place"
    ways = np.stack([found[name].values.astype(int) for pair in ENDS for name in pair])  # (4, n_channels)
    if driving is None:
        same = np.flatnonzero((ways[0] == ways[2]) & (np.abs(ways[1]) == np.abs(ways[3])))
        if not same.size:
            raise ValueError(
                "frf holds no response at the point struck, without which shapes have no scale; measure it, or name it "
                "by driving="
            )
        drive = int(same[0])
    used = np.flatnonzero((np.abs(ways[1]) == abs(ways[1, drive])) & (np.abs(ways[3]) == abs(ways[3, drive])))
    moves = [len(set(ways[i, used])) > 1 for i in (0, 2)]
    if all(moves):
        raise ValueError(
            "frf holds responses from several points to several points; pick those of one point struck, or of one "
            "response, as by frf.isel(channel=[...])"
        )
    end = ways[2 if moves[1] else 0, used]
    if len(set(end)) < len(end):
        twice = next(int(node) for node in end if (end == node).sum() > 1)
        raise ValueError(f"frf holds two responses for node {twice}; pick one of them by frf.isel(channel=[...])")
    sign = np.where(ways[1, used] * ways[3, used] < 0, -1.0, 1.0)
    return drive, used.tolist(), sign, "struck" if moves[1] else "place"


def response_points(found: Any, points: Any, used: list[int], end: str) -> np.ndarray:
    """Points (n_used, dimension) [m], given for all channels or stated in the file."""
    if points is not None:
        given = check.array("points", points, (None, None), "m")
        if len(given) != found.sizes["channel"]:
            raise ValueError(f"points must be {found.sizes['channel']} points, one for each channel, got {len(given)}")
        return given[used]
    if end not in found.coords:
        raise ValueError("points must be given: these responses state no coordinates (data set 15 or 2411 of a file)")
    place = np.asarray(found[end].values, float)[used]
    if not np.isfinite(place).all():
        raise ValueError("points must be given: a node of these responses has no coordinates")
    along = abs(int(found["direction"].values[used[0]]))
    return place[:, cell_kinds.differing_axes(place, "xyz"[along - 1] if 1 <= along <= 3 else "z")]
