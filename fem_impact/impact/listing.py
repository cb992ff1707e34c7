"""What the catalogue holds, as tables: for the prompt and for the page `studies/catalogue.md`."""

from collections.abc import Iterable, Sequence
from typing import Any

from .._base import check
from .catalogue import CUTS, Catalogue, Entry, Fact, hammers, materials, strikers
from .contact import wall_time

SECTIONS: dict[str, Catalogue[Any]] = {"materials": materials, "strikers": strikers, "hammers": hammers}
Rows = list[Sequence[str]]
HEADS: dict[str, tuple[str, ...]] = {
    "materials": ("material", "E [Pa]", "E across [Pa]", "nu", "rho [kg/m^3]", "loss factor", "yields at [Pa]"),
    "strikers": ("striker", "felt mass [kg]", "law", "stiffness [N/m^p]", "p", "damping", "contact [s]"),
    "hammers": ("hammer", "mass [kg]", "up to [N]", "gives [V/N]", "tips"),
}


def matching(words: str) -> dict[str, list[Entry]]:
    """Entries of each section whose names or groups contain all of some words; all entries if there are none."""
    return {name: [section.entry(each) for each in section.find(words)] for name, section in SECTIONS.items()}


def listed(words: str) -> tuple[dict[str, Any], list[Any]]:
    """What the prompt answers to some words: data, and sentences or tables (rows, head); of one entry its numbers."""
    entries = [(section, entry) for section, each in matching(words).items() for entry in each]
    exact = [pair for pair in entries if pair[1].name.lower() == words.lower()]
    entries = exact or entries
    if not entries:
        near = check.nearest(words, [name for section in SECTIONS.values() for name in section])
        raise ValueError(f"WORD must be part of a name or group of the catalogue, got {check.shown(words)}{near}")
    said: list[Any] = []
    if len(entries) == 1:
        entry = entries[0][1]
        said += [f"{entry.name} ({entry.group})", *facts(entry), *filter(None, [entry.note])]
    else:
        for section in dict.fromkeys(section for section, _ in entries):
            said.append((rows(section, [entry for name, entry in entries if name == section]), HEADS[section]))
    return {"entries": [record(section, entry) for section, entry in entries]}, said


def rows(section: str, entries: Iterable[Entry]) -> Rows:
    """A row for each entry of a section, under its `HEADS`."""
    return [{"materials": _material, "strikers": _striker, "hammers": _hammer}[section](each) for each in entries]


def facts(entry: Entry) -> list[str]:
    """A sentence for each number of an entry; of wood those in every direction, whatever the cut."""
    said = []
    for key, fact in distinct(entry).items():
        ends = f", {fact.ends[0]:.3g} to {fact.ends[1]:.3g}" if fact.interval else ""
        said.append(f"{key} {fact.value:.4g} {fact.unit}{ends}: {fact.source}{'' if fact.read else ' (not read here)'}")
    return said


def distinct(entry: Entry) -> dict[str, Fact]:
    """The numbers of an entry, of wood without those that its cut gives another name."""
    again = CUTS[""] if "E_L" in entry.facts else ()
    return {key: fact for key, fact in entry.facts.items() if key not in again}


def record(section: str, entry: Entry) -> dict[str, Any]:
    """An entry as plain data."""
    numbers = {
        key: {"value": fact.value, "low": fact.ends[0], "high": fact.ends[1], "unit": fact.unit,
              "source": fact.source, "read": fact.read}
        for key, fact in entry.facts.items()
    }  # fmt: skip
    told = {"section": section, "group": entry.group, "name": entry.name, "note": entry.note, "tips": list(entry.tips)}
    return {**told, "kind": entry.kind, "numbers": numbers}


def damping(entry: Entry) -> str:
    """What is known of the damping in the contact of a striker."""
    told = {key: fact.value for key, fact in entry.facts.items()}
    if "restitution" in told:
        return f"restitution {told['restitution']:g} at {told['speed']:g} m/s"
    return f"loss {told['loss']:g} s/m" if "loss" in told else "none published"


def _number(entry: Entry, key: str) -> str:
    return f"{entry.facts[key].value:.3g}" if key in entry.facts else "-"


def _material(entry: Entry) -> Sequence[str]:
    keys = ("E", "E_across", "nu", "rho", "loss_factor", "yield_strength")
    return (entry.name, *(_number(entry, key) for key in keys))


def _striker(entry: Entry) -> Sequence[str]:
    """A striker, on a rigid wall at 1 m/s without loss."""
    contact, mass = entry.contact(), strikers[entry.name].felt_mass
    time = float(wall_time(contact.stiffness, contact.exponent, 1.0 / mass, 1.0))
    law = "linear" if contact.exponent == 1.0 else "power" if "stiffness" in entry.facts else "Hertz"
    told = (f"{mass:.3g}", law, f"{contact.stiffness:.3g}", f"{contact.exponent:g}", damping(entry))
    return (entry.name, *told, f"{time:.2g}")


def _hammer(entry: Entry) -> Sequence[str]:
    return (entry.name, *(_number(entry, key) for key in ("mass", "force", "sensitivity")), ", ".join(entry.tips))
