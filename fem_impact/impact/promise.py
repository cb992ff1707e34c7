"""Whether a blow met its tolerance: in words, with what dominates the error and what would meet it."""

import os
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import explained
from .._base.check import REACH, SimulationError, ToleranceWarning
from ..modes.shapes import FieldShapes, compliance_errors
from . import accuracy, distance
from .quantities import USUAL, words
from .stepping import richardson

if TYPE_CHECKING:
    from .response import Response

PACKAGE = str(Path(__file__).parents[1]) + os.sep  # where our own lines are
# [-] of the tolerance that the advice leaves to one kind of error: two of them fit, and a fifth is left for the rest
SHARE = 0.4
# see `Modes.unstated`
UNSTATED = {
    "compliance": "static compliance", "free": "whether it moves freely", "shapes": "shapes but as measured",
    "dent": "whether unit loads dent it", "inertia": "moments of inertia",
}  # fmt: skip
ADVICE = {"compliance": "give the compliance", "dent": "give solid = the material, or False for a shell,"}


def sentence(hit: "Response") -> str:
    """One sentence on the computation: whether the tolerance is met and, if not, why and what would meet it."""
    error, what = hit.error, words(hit.quantities) + _missing(hit)
    if hit.tolerance_met:
        return f"tolerance {hit.tolerance:g} met: estimated error {error.total:.1e} of {what}"
    if not error.resolvable:
        why = f"not resolvable: the modes left out govern the contact itself, and no error of {what} can be estimated"
    elif max(error.truncation, error.mesh) >= 1.0 and hit.bodies[-1].poorer and not hit.bodies[0].dimension:
        rest = sum(size % 1.0 for size in error.parts().values())
        others = [name for name in USUAL if name in hit.quantities and name != "n_impacts"]
        why = "models of the target as fine as this one differ in the number of impacts"
        why += f", and by {rest:.1e} in {words(dict.fromkeys(others))}" if others else ""
    else:
        cause, size = error.dominant
        why = f"estimated error {error.total:.1e} of {what}, mostly from {cause} ({size:.1e})"
    return f"tolerance {hit.tolerance:g} MISSED: {why}; {remedy(hit)}"


def met_in_words(hit: "Response") -> str:
    """The same in short, of a tolerance that is met."""
    return f"tolerance {hit.tolerance:g} met{_missing(hit)}"


def _missing(hit: "Response") -> str:
    """What is not stated of the bodies, in brackets."""
    return "".join(
        f" (not stated of {name}: {', '.join(UNSTATED[each] for each in missing)})" for name, missing in _unstated(hit)
    )


def remedy(hit: "Response") -> str:
    """What would meet the tolerance."""
    error, allowed, unstated = hit.error, SHARE * hit.tolerance, _unstated(hit)
    advice: list[str] = []
    if error.truncation > allowed or not error.resolvable:
        loose = [name for name, missing in unstated if "free" in missing]
        more = [] if any("dent" in missing for _, missing in unstated) else _more_modes(hit)
        advice += [f"make {name} with free = True or False, as it is" for name in loose] or more
        advice += [f"{ADVICE[each]} of {name}" for name, missing in unstated for each in ADVICE if each in missing]
    if error.measurement > allowed:
        for name, lacks in unstated:
            advice += [f"measure longer or cleaner responses of {name}"] * ("shapes" in lacks)
            advice += [f"give the rigid motions of {name} as modes of 0 Hz"] * ("inertia" in lacks)
    if error.idealisation > allowed:
        advice.append("give target = 'modal'")
    if error.mesh > allowed:
        for name, modes in zip(_names(hit), hit.bodies):
            meshed = isinstance(getattr(modes.shapes, "base", modes.shapes), FieldShapes)
            if meshed and modes.frequency_error is not None and modes.frequency_error.any():
                limit = max(1e-9, 0.5 * allowed / error.mesh * float(modes.frequency_error.max()))
                remedy = f"find the modes of {name} with tolerance = {limit:.1g}, or on a finer mesh"
                rough = any("the rise between the points" in note for note in modes.notes)
                advice.append(f"give the rise of {name} at more points, or as a function" if rough else remedy)
    if error.inherited > allowed:
        advice.append("give the blow before a smaller tolerance")
    if error.step > allowed:
        advice.append("leave dt and scheme to the program, or give a smaller dt")
    if not advice and error.total >= 0.9:  # the runs differ in their impacts, and no tolerance helps
        return "the number of impacts cannot be determined: give max_impacts = 1 for the first impact alone"
    return "; ".join(advice) or f"take a tolerance of {float(f'{1.06 * error.total:.1e}'):g}"  # just above it


def warn_if_missed(hit: Any, strict: bool = False) -> Any:
    """A response or a sequence; if it missed its tolerance, warn, or raise SimulationError if ``strict``."""
    if not hit.tolerance_met:
        said = hit.promise
        if strict:
            raise SimulationError(said)
        warn(explained.with_headings(said))
    return hit


def doubt_of_sound(found: Any, band: float) -> str:
    """By how much a sound up to a frequency [Hz] may err where it was not asked for: over 5 %, as two runs show."""
    band, worst = min(band, float(found.target.frequencies[-1])), 0.0
    for hit in getattr(found, "hits", [found]):
        if "sound" not in hit.quantities and hit.runs:
            apart = distance.of_sounds(hit.runs[0], hit.history, hit.body_slice(len(hit.bodies) - 1), band)
            worst = max(worst, apart / richardson(hit.scheme, hit.history.law)[1])
    if worst <= 0.05:
        return ""
    so = f"may err by {worst:.1g} of itself, as so soft a blow makes little"
    return f"sound {so}; add 'sound={np.ceil(band):.0f}' to the quantities"


def warn(text: str) -> None:
    """Warn the user that a tolerance was missed, at the line that called this program."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_code.co_filename.startswith(PACKAGE):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, ToleranceWarning, stacklevel=level)


def _names(hit: "Response") -> list[str]:
    return ["the striker", "the target"] if len(hit.bodies) == 2 else [f"body {i}" for i in range(len(hit.bodies))]


def _unstated(hit: "Response") -> list[tuple[str, tuple[str, ...]]]:
    """Name of every body of which something is not stated that the blow may depend on, and what that is."""
    found = []
    for name, modes, ends in zip(_names(hit), hit.bodies, hit.ends):
        if modes.unstated and ends.doubtful:
            idle = {each for each, error in compliance_errors(modes.shapes, ends.points).items() if not error.any()}
            found.append((name, tuple(each for each in modes.unstated if each not in idle)))
    return [(name, missing) for name, missing in found if missing]


def _more_modes(hit: "Response") -> Iterator[str]:
    """How many modes every body that keeps too few needs, and what makes them fewer where they are too many."""
    for body, (name, modes, ends) in enumerate(zip(_names(hit), hit.bodies, hit.ends)):
        if not ends.rest.any() or modes.poorer:  # the number of Ritz vectors has been raised already
            continue
        number = _modes_needed(hit, body)
        if number > 20_000:  # ten times as many as the planner finds by elements
            yield f"{name} would have to keep some {number:.1e} modes; take a softer contact"
        elif number > modes.n_modes + 1:
            yield f"keep {int(np.ceil(number))} modes of {name} instead of {modes.n_modes}"


def _modes_needed(hit: "Response", body: int) -> float:
    """Modes of a body that the tolerance needs."""
    h, modes, ends, allowed = hit.history, hit.bodies[body], hit.ends[body], SHARE * hit.tolerance
    own = np.zeros(len(h.omega), bool)
    own[hit.body_slice(body)] = True
    if not modes.omega[-1]:
        return 0.0  # a body that only moves rigidly: nothing shows how close its other modes are
    needed = 0.0
    for point, (i, _) in zip(ends.points, ends.touched):
        law = hit.contacts[i]
        inverse = float((h.shape[i, (h.omega == 0.0) & ~own] ** 2).sum())  # of the mass that the body feels
        speed = min(REACH, float(np.abs(h._column(1)[:, i]).max(initial=0.0)))
        if not inverse or not speed:
            continue
        # the estimate from few modes errs: twice if they resolve the contact, 20 times if not
        share = allowed * (0.5 if hit.error.resolvable else 0.05) / (accuracy.LOSSY if law.rated else 1.0)
        at: dict[str, Any] = {"contact": law, "mass": 1.0 / inverse, "speed": speed}
        needed = max(needed, accuracy.cutoff_frequency(modes, point, tolerance=share, **at))
        if hit.error.resolvable and hit.error.truncation > allowed:
            power = accuracy.order_of(law.exponent)[0] + (0.5 if modes.dimension == 1 else 0.0)
            needed = max(needed, modes.frequencies[-1] * (hit.error.truncation / allowed) ** (1.0 / power))
    return accuracy.number_of_modes(modes, needed)
