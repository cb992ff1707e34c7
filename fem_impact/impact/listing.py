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
KEYS: dict[str, tuple[str, ...]] = {  # numbers of the catalogue behind the name of an entry
    "materials": ("E", "E_across", "nu", "rho", "loss_factor", "yield_strength"), "strikers": (),
    "hammers": ("mass", "force", "sensitivity"),
}  # fmt: skip


def listed(words: str) -> tuple[dict[str, Any], list[Any]]:
    """What the prompt answers to some words: data, and sentences or tables (rows, head); of one entry its numbers."""
    entries = [(name, section.entry(each)) for name, section in SECTIONS.items() for each in section.find(words)]
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
    """A row for each entry of a section, under its `HEADS`; strikers on a rigid wall at 1 m/s without loss."""
    found: Rows = []
    for entry in entries:
        values = {key: fact.value for key, fact in entry.facts.items()}
        row = [entry.name, *(f"{values[key]:.3g}" if key in values else "-" for key in KEYS[section])]
        if section == "hammers":
            row.append(", ".join(entry.tips))
        if section == "strikers":
            contact, mass, damping = entry.contact(), strikers[entry.name].felt_mass, "none published"
            if "restitution" in values:
                damping = f"restitution {values['restitution']:g} at {values['speed']:g} m/s"
            elif "loss" in values:
                damping = f"loss {values['loss']:g} s/m"
            law = "linear" if contact.exponent == 1.0 else "power" if "stiffness" in values else "Hertz"
            time = float(wall_time(contact.stiffness, contact.exponent, 1.0 / mass, 1.0))
            numbers = f"{contact.stiffness:.3g}", f"{contact.exponent:g}", damping, f"{time:.2g}"
            row += [f"{mass:.3g}", law, *numbers]
        found.append(row)
    return found


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
    head = {"section": section, "group": entry.group, "name": entry.name, "note": entry.note, "tips": list(entry.tips)}
    return {**head, "kind": entry.kind, "numbers": numbers}
