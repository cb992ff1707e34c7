"""Materials and strikers of a scene by name: what ``[material] name = "brass"`` stands for."""

from collections.abc import Iterator, Mapping
from typing import Any

from .._base import known
from ..fe.material import Material
from ..impact.catalogue import Catalogue, Entry, materials, strikers


def fill_names(tables: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a scene with the numbers, and their intervals, that its names stand for.

    Other keys beside a name replace what it says. Without a table [contact], the striker's name says how it strikes the
    material of the scene. A ValueError begins with the table.
    """
    found = dict(tables)
    if isinstance(found.get("material"), Mapping):
        found["material"] = _material("[material]", found["material"])
    for part in ("layer", "rib"):
        for i, each in _listed_with(found, part, "material"):
            found[part][i] = {**each, "material": _material(f"[[{part}]] {i} material:", each["material"])}
    found = _striker("[striker]", found, found)
    stated = {"contact": tables["contact"]} if "contact" in tables else {}  # it holds for strokes, too
    for i, each in _listed_with(found, "stroke", "striker"):
        if "name" in each["striker"]:  # the numbers of a stroke have no intervals
            made = _striker(f"[[stroke]] {i} striker:", {**stated, **each}, found)
            found["stroke"][i] = made | {key: known.taken("", made[key])[0] for key in ("striker", "contact")}
    return found


def _listed_with(tables: dict[str, Any], name: str, key: str) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """Number and table of those that may stand several times in which a key is a table; their list is made anew."""
    if isinstance(tables.get(name), list):
        tables[name] = list(tables[name])
        for i, each in enumerate(tables[name]):
            if isinstance(each, Mapping) and isinstance(each.get(key), Mapping):
                yield i, each


def _material(called: str, table: Mapping[str, Any]) -> dict[str, Any]:
    if "name" not in table:
        return dict(table)
    stands = _entry(called, materials, table["name"]).table
    return {**stands, **{key: value for key, value in table.items() if key != "name"}}


def _entry(called: str, names: Catalogue[Any], name: Any) -> Entry:
    try:
        return names.entry(name)
    except ValueError as error:
        raise ValueError(f"{called} name: {error}") from None


def _striker(called: str, table: Mapping[str, Any], scene: Mapping[str, Any]) -> dict[str, Any]:
    """A table with those of the striker and the contact that the striker's name stands for, if it has one."""
    given = table.get("striker")
    if not isinstance(given, Mapping) or "name" not in given:
        return dict(table)
    if "kind" in given:
        raise ValueError(f"{called} kind must be left out beside name, which has one")
    entry = _entry(called, strikers, given["name"])
    own = {key: value for key, value in given.items() if key != "name"}
    found = {**table, "striker": {**entry.table, **own}}
    return found if "contact" in table else {**found, "contact": entry.contact_table(_struck(called, entry, scene))}


def _struck(called: str, entry: Entry, scene: Mapping[str, Any]) -> Material | None:
    """The material that a tip strikes: of the layer on the struck side, or the scene's; None if it does not matter."""
    if "stiffness" in entry.facts:
        return None
    first = next(iter(scene.get("layer") or ()), None)
    own = first.get("material") if isinstance(first, Mapping) else None
    table = own or scene.get("material")
    if not isinstance(table, Mapping):
        raise ValueError(
            f"{called} name: the contact of {entry.name!r} depends on what it strikes; write a table [material], or "
            "[contact]"
        )
    try:
        return Material(**known.taken("material", table)[0])
    except (TypeError, ValueError):  # the material is wrong: whoever builds it says how
        return None
