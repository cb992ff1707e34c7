"""What a blow assumes of the model itself, as numbers: whether plates are thin, deflections small, air still."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from .quantities import NAMES as QUANTITY_NAMES

# [-] a larger effect is beyond a first-order estimate: its square, what such an estimate leaves out, is then 4 %
BEYOND = 0.2
SILENT = 1e-4  # [-] effects that are never worth a line of their own
# [-] of the tolerance: an assumption that changes the blow by less gets no line, as several may still add up
SHARE = 0.1
ALL = (
    "thin target", "thin striker", "small deflections", "no yielding", "local contact", "quasi-static contact",
    "still air", "stated damping",
)  # fmt: skip


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
        """Whether the effect is larger than a first-order estimate can tell."""
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
    def sentence(self) -> str:
        """The assumption in one line."""
        said = [] if self.value is None else [f"{self.number} {self.value:.2g}{self._limit}"]
        if self.beyond:
            said.append(f"changes the {_worst(self.effect)[0]} by some {self.worst:.0%}, beyond this estimate")
        elif self.worst > 0.0:
            said.append(f"changes the {_worst(self.effect)[0]} by {self.worst:.1g}")
        if not self.known:
            said.append(f"not known: {self.why}")
        said += [self.remedy] if self.remedy else []
        return f"{self.name}: {'; '.join(said)}"

    @property
    def _limit(self) -> str:
        return "" if self.limit is None else f" ({'above' if self.doubtful else 'of'} {self.limit:g})"


def _worst(effect: Mapping[str, float | None]) -> tuple[str, float]:
    known = {name: change for name, change in effect.items() if change is not None}
    name = max(known, key=lambda each: known[each])
    return QUANTITY_NAMES.get(name, name), known[name]


def unexamined(
    quantities: Iterable[str],
    why: str = "blows of several bodies are not examined",
    remedy: str = "examine each pair by `fi.strike`",
) -> tuple[Assumption, ...]:
    """Every assumption as not known, for a blow that nobody examined."""
    effect = dict.fromkeys(quantities)
    return tuple(Assumption(name, None, None, effect, tuple(quantities), remedy, "", why) for name in ALL)


def total(assumptions: Sequence[Assumption]) -> float:
    """Sum of the largest known effects [-]; what is not known is not in it."""
    return float(sum(each.worst for each in assumptions))


def lines(assumptions: Sequence[Assumption], tolerance: float) -> list[str]:
    """The examination in words: one line if all is well, and one for each assumption that matters or is not known."""
    error, worth = total(assumptions), max(SILENT, SHARE * tolerance)
    telling = [each for each in assumptions if each.worst > worth or each.doubtful]
    unknown = [each for each in assumptions if not each.known]
    if not any(each.effect for each in assumptions):
        return _foreseen(assumptions)
    if error <= worth:
        head = f"the model's own error is below {_above(error)}"
    elif any(each.beyond for each in telling):
        head = f"the model's own error is beyond this estimate: some {error:.0%}"
    else:
        head = f"the model's own error is about {error:.1g}"
    head += f", not counting what is not known ({', '.join(each.name for each in unknown)})" if unknown else ""
    return [head, *(each.sentence for each in sorted(telling, key=lambda each: -each.worst))]


def _foreseen(assumptions: Sequence[Assumption]) -> list[str]:
    doubtful = [each for each in assumptions if each.doubtful]
    unknown = [each.name for each in assumptions if not each.known]
    names = ", ".join(each.name for each in doubtful)
    head = f"doubtful: {names}" if doubtful else "no assumption of the model itself is foreseen to fail"
    head += f"; not known before the blow: {', '.join(unknown)}" if unknown else ""
    return [head, *(each.sentence for each in doubtful)]


def _above(error: float) -> str:
    """The power of ten above an error [-], but at least SILENT, in words."""
    return f"1e{max(round(math.log10(SILENT)), math.ceil(math.log10(error)) if error > 0.0 else -99)}"


def table(assumptions: Sequence[Assumption]) -> list[dict[str, Any]]:
    """The assumptions as plain data, with their states."""
    return [asdict(replace(each, effect=dict(each.effect))) | {"state": each.state} for each in assumptions]
