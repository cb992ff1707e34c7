"""What a blow assumes of the model itself, as numbers: whether plates are thin, deflections small, air still."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from .quantities import NAMES as QUANTITY_NAMES

# [-] a larger effect is beyond a first-order estimate: its square, what such an estimate leaves out, is then 4 %
BEYOND = 0.2
SILENT = 1e-4  # [-] effects that are never worth a line of their own
ALL = (
    "thin target", "shallow target", "thin striker", "small deflections", "no yielding", "local contact",
    "quasi-static contact", "no friction", "still air", "stated damping",
)  # fmt: skip
# [-] coefficient of friction tried: dry metals, woods and plastics on each other lie between 0.15 and 0.6
FRICTION = 0.3
# [-] errors of the model up to this count as right, whatever the tolerance: stiffness, contact law and the speed of a
# hand are seldom known better, and a blow by hand repeats no better
ENOUGH = 0.05
# how each number that decides reads with its value, "{}%" as a percentage up to 100 %
READINGS = {
    "thickness times wavenumber": "thickness times wavenumber is {}",
    "steepest slope": "the steepest slope of the rise is {}",
    "deflection over thickness": "the deflection is {} times the thickness",
    "contact pressure over that at first yield": "the contact pressure is {} times that at first yield",
    "contact radius over half the thickness": "the contact radius is {} times half the thickness",
    "contact radius over the distance to the edge": "the contact radius is {} times the distance to the edge",
    "contact radius times wavenumber": "contact radius times wavenumber is {}",
    "own period of the striker over the contact time": "the striker's own period is {}% of the contact time",
    "tangential over normal impulse, sticking": "the contact ends sticking, by {}% of the normal impulse",
    "tangential over normal impulse that would stick": (
        f"the contact slides to its end with a friction of {FRICTION:g}; sticking takes {{}}% of the normal impulse"
    ),
    "mass of the air moved over that of the body": "the air carried along weighs {}% of the body",
    "damping ratio by the sound radiated, beyond that stated": "sound adds a damping ratio of {} to that stated",
    "damping ratio tried": "no damping is stated, and a ratio of {} was tried",
}


@dataclass(frozen=True)
class Assumption:
    """One assumption, how far it holds, and what it does to the quantities asked for.

    ``effect`` maps each quantity to its estimated change: absolute for the restitution, relative for the others; None
    where it is not known. It is empty before the blow.
    """

    name: str  # one of ALL
    value: float | None  # of the number that decides; None if it is not known
    limit: float | None  # from which on the assumption is doubtful
    effect: Mapping[str, float | None]
    quantities: tuple[str, ...]  # the quantities asked for
    remedy: str  # what would make the answer right, or known
    number: str  # what `value` is, with its unit
    unknown: str = ""  # why something is not known; "" if everything is
    stated: bool = False  # whether what is not known is a matter of the contact law or the mass that the user states

    @property
    def known(self) -> bool:
        """Whether the effect on every quantity is known."""
        return not self.unknown and all(change is not None for change in self.effect.values())

    @property
    def why(self) -> str:
        """Why something is not known; "" if everything is."""
        return self.unknown or ("" if self.known else "the blow with the better model cannot be computed")

    @property
    def worst(self) -> float:
        """Largest known effect [-]."""
        return max((change for change in self.effect.values() if change is not None), default=0.0)

    @property
    def beyond(self) -> bool:
        """Whether the effect is larger than a first-order estimate holds for."""
        return self.worst > BEYOND

    @property
    def doubtful(self) -> bool:
        """Whether the number is beyond its limit."""
        return self.value is not None and self.limit is not None and self.value > self.limit

    @property
    def state(self) -> str:
        """``"not known"``, ``"beyond this estimate"`` or ``"estimated"``; ``"foreseen"`` before the blow."""
        if self.beyond:
            return "beyond this estimate"
        if not self.known:
            return "not known"
        return "estimated" if self.effect else "foreseen"

    @property
    def open(self) -> bool:
        """Whether something is not known that the user did not state as a fact, so that the answer may be wrong."""
        return not self.known and not self.stated

    @property
    def reading(self) -> str:
        """The number that decides in words; "" if it is not known."""
        if self.value is None:
            return ""
        share = f"{100.0 * self.value:.2g} % of" if self.value < 1.0 else f"{self.value:.2g} times"
        phrase = READINGS.get(self.number, f"{self.number} {{}}")
        return phrase.replace("{}% of", share).replace("{}", f"{self.value:.2g}")

    @property
    def sentence(self) -> str:
        """The assumption in one line."""
        said = [] if self.value is None else [self.reading]
        if said and self.limit is not None:
            share = "%" in READINGS.get(self.number, "")
            said[0] += f"; it usually matters above {f'{100.0 * self.limit:g} %' if share else f'{self.limit:g}'}"
        if self.worst > 0.0:
            said.append(f"here it changes the {self.change()}" + (", beyond this estimate" if self.beyond else ""))
        if not self.known:
            said.append(f"not known: {self.why}")
        said += [self.remedy] if self.remedy else []
        return f"{self.name}: {'; '.join(said)}"

    def change(self, more_than: float = math.inf) -> str:
        """A quantity and how much it changes: the first that changes more than that, or the one that changes most."""
        changes = {name: change or 0.0 for name, change in self.effect.items()}
        most = max(changes, key=lambda each: changes[each])
        name = next((each for each in changes if changes[each] > more_than), most)
        size = f"{changes[name]:.1g}" if name == "restitution" else f"{100.0 * float(f'{changes[name]:.1g}'):g} %"
        return f"{QUANTITY_NAMES.get(name, name)} by about {size}"


def unexamined(
    quantities: Iterable[str], why: str = "several bodies meet", remedy: str = "examine each pair by `fi.strike`"
) -> tuple[Assumption, ...]:
    """Every assumption as not known, for a blow that nobody examined."""
    effect = dict.fromkeys(quantities)
    return tuple(Assumption(name, None, None, effect, tuple(quantities), remedy, "", why) for name in ALL)


def total(assumptions: Sequence[Assumption]) -> float:
    """Largest sum over the assumptions of what they do to one quantity [-]; what is not known is not in it."""
    names = dict.fromkeys(name for each in assumptions for name in each.effect)
    return max((float(sum(each.effect.get(name) or 0.0 for each in assumptions)) for name in names), default=0.0)


def allowed(tolerance: float) -> float:
    """Largest error of the model [-] with which an answer is trusted."""
    return max(tolerance, ENOUGH)


def negligible_effect(tolerance: float) -> float:
    """Effect [-] up to which an assumption gets no line: a tenth of the tolerance, as several may still add up."""
    return max(SILENT, 0.1 * tolerance)


def lines(assumptions: Sequence[Assumption], tolerance: float) -> list[str]:
    """The examination in words: whether the model holds, and a line for each assumption that matters."""
    relevant = [each for each in assumptions if each.worst > negligible_effect(tolerance) or each.doubtful]
    return [head(assumptions, tolerance), *(each.sentence for each in sorted(relevant, key=lambda each: -each.worst))]


def head(assumptions: Sequence[Assumption], tolerance: float) -> str:
    """Whether the model holds, in one clause: by how much at most, or what is wrong or not known, and what helps."""
    unsure = [each for each in assumptions if each.open]
    if not any(each.effect for each in assumptions):
        doubtful = ", ".join(each.name for each in assumptions if each.doubtful)
        first = (
            f"the model is doubtful here: {doubtful}" if doubtful else "no assumption of the model is expected to fail"
        )
        return first + (f"; not known before the blow: {', '.join(each.name for each in unsure)}" if unsure else "")
    if len(unsure) == len(assumptions) and len({each.unknown for each in unsure}) == 1:
        return f"the model is not examined, as {unsure[0].unknown}: {unsure[0].remedy}"
    error, said = total(assumptions), []
    if error > allowed(tolerance):
        worst = max(assumptions, key=lambda each: each.worst)
        because = f"{worst.reading}, which changes" if worst.reading else f"{worst.name!r} changes"
        in_all = f", by about {error:.1g} in all" if error > 1.5 * worst.worst else ""
        change = worst.change(allowed(tolerance))
        said.append(f"the model is wrong here{in_all}: {because} the {change}: {worst.remedy}")
    if unsure:
        remedies = {each.why: each.remedy for each in unsure}
        names, cures = ", ".join(each.name for each in unsure), ", ".join(dict.fromkeys(remedies.values()))
        said.append(f"it is not known whether the model holds: {names} ({', '.join(remedies)}): {cures}")
    if said:
        return "; ".join(said)
    holds = f"to {error:.1g}"
    if error <= negligible_effect(tolerance):
        holds = f"to better than 1e{max(round(math.log10(SILENT)), math.ceil(math.log10(error or SILENT)))}"
    taken = ", with the contact as stated" if any(not each.known for each in assumptions) else ""
    return f"the model holds {holds}{taken}"


def table(assumptions: Sequence[Assumption]) -> list[dict[str, Any]]:
    """The assumptions as plain data, with their states."""
    return [
        asdict(replace(each, effect=dict(each.effect))) | {"state": each.state, "sentence": each.sentence}
        for each in assumptions
    ]
