"""How far to trust an answer: of each quantity asked for, the error of the computation and that of the model."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import markup
from . import assumption, promise
from .distance import value_of
from .quantities import UNITS, rebound, words

if TYPE_CHECKING:
    from .response import Response

FEWEST, MOST = 2, 6  # [-] digits shown: as many as the error of the computation lets stand


@dataclass(frozen=True)
class Judged:
    """One quantity, and how far to trust it.

    Errors are absolute for the restitution and relative for the others.
    """

    quantity: str  # as asked for: "restitution", "impulse", "contact_time", "force", "n_impacts", "spectrum", "sound"
    band: float | None  # [Hz] of "spectrum" and "sound"
    value: float | None  # in SI units; of a spectrum the largest; None for sound, and for a restitution that is none
    computation: float | None  # [-] estimated error; None if the modes left out govern the contact
    model: float | None  # [-] sum of what the assumptions do to it; None if something is not known that may matter
    known: float  # [-] the same, without what is not known
    unknown: tuple[str, ...]  # assumptions whose effect is not known and may matter
    dominant: str  # what the answer suffers from most: a part of the computation, or an assumption
    remedy: str  # what to do about it; "" if it is trusted
    allowed: float  # [-] error of the model with which it is trusted
    tolerance: float  # [-] of the computation

    @property
    def holds(self) -> bool:
        """Whether the model's error is known and at most `allowed`."""
        return self.model is not None and self.model <= self.allowed

    @property
    def trusted(self) -> bool:
        """Whether the computation meets its tolerance, and the model holds."""
        return self.computation is not None and self.computation <= self.tolerance and self.holds

    @property
    def name(self) -> str:
        """The quantity in words."""
        return words({self.quantity: self.band})

    @property
    def shown(self) -> str:
        """The value with its unit, in as many digits as the error of the computation lets stand."""
        if self.value is None:
            return "-"
        if self.quantity == "n_impacts":
            return f"{self.value:.0f}"
        return f"{self.value:.{_digits(self.computation)}g} {UNITS[self.quantity]}".strip()


@dataclass(frozen=True)
class Trust:
    """How far to trust each quantity asked for; `print` it, or take one by its name."""

    judged: tuple[Judged, ...]

    def __iter__(self) -> Iterator[Judged]:
        return iter(self.judged)

    def __getitem__(self, quantity: str) -> Judged:
        found = {each.quantity: each for each in self.judged}
        if quantity not in found:
            raise ValueError(f"quantity must be one of those asked for, {', '.join(found)}, got {quantity!r}")
        return found[quantity]

    @property
    def trusted(self) -> bool:
        """Whether each quantity is."""
        return all(each.trusted for each in self.judged)

    def table(self) -> list[dict[str, Any]]:
        """All quantities as plain data."""
        return [asdict(each) | {"trusted": each.trusted} for each in self.judged]

    def __str__(self) -> str:
        head = "quantity", "value", "computation errs by", "model errs by", "trusted", "mostly by"
        rows = [
            (
                each.name,
                each.shown,
                "not known" if each.computation is None else f"{each.computation:.1g}",
                f"{each.known:.1g}" if each.model is not None else f"{each.known:.1g} and what is not known",
                "yes" if each.trusted else "no",
                each.dominant,
            )
            for each in self.judged
        ]
        remedies = dict.fromkeys(each.remedy for each in self.judged if each.remedy)
        return "\n".join([*markup.columns(rows, head), *(f"To do: {remedy}" for remedy in remedies)])


def examine(hit: "Response") -> Trust:
    """How far to trust each quantity that a blow was asked for."""
    cure, judged = "" if hit.tolerance_met else promise.remedy(hit), []
    found, error, limit = hit.assumptions, hit.error, assumption.allowed(hit.tolerance)
    for name, band in hit.quantities.items():
        unsure = [each for each in found if each.open and each.effect.get(name) is None]
        effects = [each.effect.get(name) or 0.0 for each in found]
        known, worst = float(sum(effects)), found[effects.index(max(effects))]
        parts, own = error.parts(name), error.of_quantity(name)
        if name == "n_impacts" and own < 0.5:  # a number is right, or doubted as a whole
            own = 0.0
        cause, size = max(parts.items(), key=lambda part: part[1]) if error.resolvable else ("modes left out", np.inf)
        dominant = worst.name if max(effects) >= size else cause
        remedies = [cure] if cure else []
        if known > limit:
            remedies.append(worst.remedy)
        elif unsure:
            dominant = unsure[0].name if hit.tolerance_met else dominant
            remedies.append(unsure[0].remedy)
        value = None if name == "sound" else value_of(hit, name, band)
        if band is not None and value is not None:
            value = np.abs(value).max()
        judged.append(Judged(
            name, band, None if value is None else float(value), own if error.resolvable else None,
            None if unsure else known, known, tuple(each.name for each in unsure), dominant, "; ".join(remedies),
            limit, hit.tolerance,
        ))  # fmt: skip
    return Trust(tuple(judged))


def in_one_line(hit: "Response") -> str:
    """The answer in one line: what was asked for first, how well it is computed, and whether the model holds."""
    first = hit.trust.judged[0]
    if first.quantity == "restitution":
        value = rebound(hit, max(FEWEST, _digits(first.computation) - 1))
    else:
        value = first.shown if first.value is not None else ""
    answer = f"{first.name} {value}".strip()
    clause = assumption.head(hit.assumptions, hit.tolerance)
    holds = all(each.holds for each in hit.trust)
    if hit.tolerance_met:
        computed = f"{answer}, computed to {first.computation:.1g} ({promise.met_in_words(hit)})"
        return f"{computed}{'; ' if holds else ', but '}{clause}"
    return f"{answer}: {promise.sentence(hit)}" + ("" if holds else f"; besides, {clause}")


def _digits(error: float | None) -> int:
    """Digits of a number with a relative error."""
    return FEWEST if error is None else int(np.clip(np.ceil(-np.log10(max(error, 1e-9))) + 1, FEWEST, MOST))
