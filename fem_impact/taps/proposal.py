"""`propose`: the model of taps, built up from a wall as long as it predicts taps left out better."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from .._base import check, markup
from .._base.check import SimulationError
from .._base.threads import one_thread
from ..impact.contact import Contact
from ..impact.striker import Striker
from . import solver, windows
from .fit import fit
from .found import Found, Watch, with_profiles
from .predictions import rms_error
from .records import Taps

Ranges = dict[str, tuple[float, float]]
STIFFNESS = {"contact.stiffness": (1e2, 1e16)}  # of a law of unknown exponent, N/m**exponent: from felt to steel
GAIN = 0.9  # [-] of the error at taps left out that a larger model must come below: less is luck of a few taps
PER_TAP = "stiffness per tap"


@dataclass(frozen=True)
class Trial:
    """A model that was tried."""

    name: str
    inside: str  # the smaller model that it was compared with; "" for the first ones
    n_unknowns: int  # besides speed and onset of each tap
    error: float  # [-] rms of the residual over that of the force
    left_out: float  # [-] the same of taps predicted from the others
    rescued: bool  # its own search ended above the smaller model, and went on from there
    taken: bool


@dataclass(frozen=True, eq=False, repr=False)
class Proposal(check.Brief):
    """The model proposed, and what was tried on the way to it."""

    found: Found
    tried: tuple[Trial, ...]

    def summary(self) -> str:
        """The table of what was tried, and the fit proposed."""
        head = ("model", "unknowns", "residual", "left out", "")
        rows = [
            (one.name, str(one.n_unknowns), f"{100.0 * one.error:.3g} %", f"{100.0 * one.left_out:.3g} %",
             ", ".join(word for word, said in (("taken", one.taken), ("went on from the smaller one", one.rescued))
                       if said))
            for one in self.tried
        ]  # fmt: skip
        return "\n".join([*markup.columns(rows, head), self.found.summary()])


@check.typed
@one_thread
def propose(
    taps: Any,
    *,
    striker: Striker,
    window: Any = None,
    starts: int = 2,
    profiles: bool = True,
    rng: Any = 0,
    watch: Watch | None = None,
) -> Proposal:
    """Find a model of taps: from a wall upwards, as long as taps left out are predicted better.

    A linear and a Hertz contact on a wall, then a free exponent, loss, a springy head, a stiffness for each tap, and
    modes of the structure one by one are tried, and those that did not serve again after each gain. An addition is kept
    only if it predicts the taps left out with less than 0.9 of the error. A larger model whose search ends above the
    smaller one inside it goes on from there, so that it never fits worse.

    The force alone cannot distinguish a mode of the hammer from one of the structure: a springy head, tried first, may
    stand for either.

    Parameters
    ----------
    taps : Taps, two at least
        Of `fi.read_taps` or `fi.measure`; their forces are compared.
    striker : Striker
        The hammer, rigid.
    window, starts, profiles, rng, watch
        As in `fi.fit`; no tap is left out as an outlier.

    Returns
    -------
    Proposal
        ``found`` is as `fi.fit` returns it; ``tried`` lists every model with its errors.

    Raises
    ------
    ValueError
        If there are fewer than two taps, or the striker is not rigid.
    SimulationError
        If no model makes a blow that ends.

    Examples
    --------
    >>> wall, hammer = fi.Modes.rigid(1e4), fi.Striker.rigid(0.1)
    >>> hits = [fi.strike(wall, hammer, fi.Contact.hertz(2e8), at=None, speed=v) for v in (0.5, 1.0, 1.5)]
    >>> taps = [fi.measure(hit, rate=25600.0, noise=5e-3, rng=i) for i, hit in enumerate(hits)]
    >>> found = fi.propose(taps, striker=hammer)
    >>> [trial.name for trial in found.tried if trial.taken][-1]
    'Hertz'
    """
    joined = windows.join_tables(taps)
    if joined.n_taps < 2:
        raise ValueError("taps must be two at least, to predict one from the others")
    if striker.modes.n_modes > 1:
        raise ValueError("striker must be rigid; a springy head is among what is tried")
    given = {"striker": striker, "window": window, "starts": starts, "rng": rng, "robust": False, "profiles": False}
    tried: list[Trial] = []
    best: Found | None = None
    for name, law in (("linear", Contact.linear(1e7)), ("Hertz", Contact.hertz(1e7))):
        one = _fitted(joined, law, dict(STIFFNESS), given)
        if one is not None:
            tried.append(_trial(name, "", one, False))
            best = one if best is None or rms_error(one.left_out()) < GAIN * rms_error(best.left_out()) else best
    if best is None:
        raise SimulationError("no blow of a contact on a wall ends as these taps do; read the taps again")
    law, name = best.problem.setting.contact, "linear" if best.problem.setting.contact.exponent == 1.0 else "Hertz"
    tried = [replace(one, taken=one.name == name) for one in tried]
    length = solver.pulse_length(best.taps)
    band = 0.05 / length, 5.0 / length  # modes below and above do not shape the pulse
    heavy = 0.1 * striker.mass, 1e4 * striker.mass  # more do not move
    ranges: Ranges = dict(STIFFNESS)
    waiting: list[tuple[str, Ranges]] = [  # what is added one after another: its name and its ranges
        ("exponent", {"contact.exponent": (1.0, 4.0)}), ("loss", {"contact.loss": (0.0, 20.0)}),
        ("springy head", {"striker.first_frequency": band, "striker.mode_ratio": (1e-4, 10.0)}), (PER_TAP, {}),
        *((f"mode {i}", {f"mode{i}.frequency": band, f"mode{i}.mass": heavy, f"mode{i}.damping": (0.0, 0.5)})
          for i in (1, 2)),  # a pulse of few samples determines no more
    ]  # fmt: skip
    while True:  # what one addition hid may show after another
        done = {one.name for one in tried}
        for step in list(waiting):
            word, more = step
            label = f"{name} + {word}"
            if label in done or (word == "mode 2" and any(each[0] == "mode 1" for each in waiting)):
                continue
            own = {"per_tap": "contact.stiffness"} if PER_TAP in label else {}
            one = _fitted(joined, law, ranges | more, given | own | {"smaller": best})
            if one is None:
                continue
            taken = rms_error(one.left_out()) < GAIN * rms_error(best.left_out())
            tried.append(_trial(label, name, one, taken))
            if taken:
                best, ranges, name = one, ranges | more, label
                waiting.remove(step)
        if len(tried) == len(done):
            break
    whole = replace(best, compared={one.name: one.left_out for one in tried}, watch=watch)
    return Proposal(with_profiles(whole) if profiles else whole, tuple(tried))


def _fitted(taps: Taps, law: Contact, ranges: Ranges, given: Mapping[str, Any]) -> Found | None:
    """The fit of one model; None if its blows do not end."""
    try:
        found = fit(taps, contact=law, unknown=ranges, **given)
        found.left_out()  # what no others predict is no model either
        return found
    except SimulationError:
        return None


def _trial(name: str, inside: str, found: Found, taken: bool) -> Trial:
    n_unknowns = found.problem.n_values - 2 * len(found.used)
    return Trial(name, inside, n_unknowns, found.error, rms_error(found.left_out()), found.stuck, taken)
