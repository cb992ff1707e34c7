"""What the catalogue holds, as tables: for the prompt and for the page `studies/catalogue.md`."""

from collections.abc import Iterable, Sequence
from typing import Any

from .catalogue import CUTS, Catalogue, Entry, Fact, hammers, materials, strikers
from .contact import wall_time

SECTIONS: dict[str, Catalogue[Any]] = {"materials": materials, "strikers": strikers, "hammers": hammers}
Rows = list[Sequence[str]]
HEADS: dict[str, tuple[str, ...]] = {
    "materials": ("material", "E [Pa]", "E across [Pa]", "nu", "rho [kg/m^3]", "loss factor", "yields at [Pa]"),
    "strikers": ("striker", "felt mass [kg]", "law", "stiffness [N/m^p]", "p", "damping", "contact [s]"),
    "hammers": ("hammer", "mass [kg]", "up to [N]", "gives [V/N]", "tips"),
}
FACTS = ("number", "value", "unit", "from", "to", "source")


def found(words: str) -> dict[str, list[Entry]]:
    """Entries of each section whose names or groups contain all of some words; all entries if there are none."""
    return {name: [section.entry(each) for each in section.find(words)] for name, section in SECTIONS.items()}


def rows(section: str, entries: Iterable[Entry]) -> Rows:
    """A row for each entry of a section, under its `HEADS`."""
    return [{"materials": _material, "strikers": _striker, "hammers": _hammer}[section](each) for each in entries]


def facts(entry: Entry) -> Rows:
    """A row for each number of an entry, under `FACTS`; of wood those in every direction, whatever the cut."""
    return [
        (key, f"{fact.value:.3g}", fact.unit, *_ends(fact), fact.source + ("" if fact.read else " (not read here)"))
        for key, fact in distinct(entry).items()
    ]


def distinct(entry: Entry) -> dict[str, Fact]:
    """The numbers of an entry, of wood without those that its cut gives another name."""
    again = CUTS[""] if "E_L" in entry.facts else ()
    return {key: fact for key, fact in entry.facts.items() if key not in again}


def data(section: str, entry: Entry) -> dict[str, Any]:
    """An entry as plain data."""
    numbers = {
        key: {"value": fact.value, "low": fact.ends[0], "high": fact.ends[1], "unit": fact.unit,
              "source": fact.source, "read": fact.read}
        for key, fact in entry.facts.items()
    }  # fmt: skip
    told = {"section": section, "group": entry.group, "name": entry.name, "note": entry.note, "tips": list(entry.tips)}
    return {**told, "kind": entry.kind, "numbers": numbers}


def law(entry: Entry) -> str:
    """The contact law of a striker in a word."""
    if "stiffness" not in entry.facts:
        return "Hertz"
    return "linear" if entry.facts["exponent"].value == 1.0 else "power"


def damping(entry: Entry) -> str:
    """What is known of the damping in the contact of a striker."""
    told = {key: fact.value for key, fact in entry.facts.items()}
    if "restitution" in told:
        return f"restitution {told['restitution']:g} at {told['speed']:g} m/s"
    return f"loss {told['loss']:g} s/m" if "loss" in told else "none published"


def _ends(fact: Fact) -> tuple[str, str]:
    return (f"{fact.ends[0]:.3g}", f"{fact.ends[1]:.3g}") if fact.interval else ("", "")


def _number(entry: Entry, key: str) -> str:
    return f"{entry.facts[key].value:.3g}" if key in entry.facts else "-"


def _material(entry: Entry) -> Sequence[str]:
    keys = ("E", "E_across", "nu", "rho", "loss_factor", "yield_strength")
    return (entry.name, *(_number(entry, key) for key in keys))


def _striker(entry: Entry) -> Sequence[str]:
    """A striker, on a rigid wall at 1 m/s without loss."""
    contact, mass = entry.contact(), strikers[entry.name].felt_mass
    time = float(wall_time(contact.stiffness, contact.exponent, 1.0 / mass, 1.0))
    told = (f"{mass:.3g}", law(entry), f"{contact.stiffness:.3g}", f"{contact.exponent:g}", damping(entry))
    return (entry.name, *told, f"{time:.2g}")


def _hammer(entry: Entry) -> Sequence[str]:
    return (entry.name, *(_number(entry, key) for key in ("mass", "force", "sensitivity")), ", ".join(entry.tips))
