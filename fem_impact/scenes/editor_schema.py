"""A JSON schema of scene files for editors (taplo, VS Code), made from the table by which scenes are checked."""

import inspect
from collections.abc import Callable
from typing import Any

from ..fe.section import PLANE, Elastic, Material
from ..impact.striker import Hand
from . import keys
from .schema import HOLDS, MAKERS, NESTED, PARTS, REPEATED, REQUIRED, RISES, keys_of

# How well a number is known, see `known`; any number of a table but [map], [observe] and [[stroke]] may be one
INTERVAL = (
    keys.table({"value": keys.POSITIVE, "about": keys.POSITIVE}, ("value", "about")),
    keys.table(dict.fromkeys(("value", "low", "high"), keys.NUMBER), ("value", "low", "high")),
)
KNOWN = ("mesh", "material", "section", "target", "striker", "contact", "strike", "rib", "layer", "rise", "hand")
WITHIN = {"hand": Hand, "material": Material}  # keys that are tables themselves
NAMES = ("material", "striker")  # tables that may have a name of the catalogue
DRAFT = "http://json-schema.org/draft-07/schema#"  # what taplo and VS Code read


def schema() -> dict[str, Any]:
    """The schema of a scene: tables, their keys with types, limits and words, and the kinds to choose from.

    Every scene that loads satisfies it; it leaves everything between keys and tables to `load_scene`.
    """
    tables = {name: _table(name, selector, makers) for name, (selector, makers) in MAKERS.items()}
    tables[REPEATED]["properties"] |= {name: tables[name] for name in NESTED}
    tables |= {name: {"type": "array", "items": tables[name]} for name in (REPEATED, *PARTS)}
    tables["supports"] = {
        "type": "object",
        "description": keys.TABLES["supports"],
        "additionalProperties": {"anyOf": [{"enum": [*HOLDS["supports"]]}, _keys("supports", "", Elastic)]},
    }
    words = keys.TABLES["in_plane"]
    tables["in_plane"] = {"type": "object", "description": words, "additionalProperties": {"enum": [*PLANE]}}
    return {
        "$schema": DRAFT,
        "title": "A scene of fem_impact",
        "type": "object",
        "properties": {"title": {"type": "string", "description": "what the scene is, for pictures and reports"}}
        | tables,
        "required": [name for name in REQUIRED if name != "contact"],  # a striker with a name has one of its own
        "additionalProperties": False,
    }


def _table(name: str, selector: str, makers: dict[str, Callable[..., Any]]) -> dict[str, Any]:
    """The schema of one table: that of its only kind, or a choice by the key ``selector``."""
    if not selector:
        return _one(name, makers[""])
    choices = _choices(name, selector, makers)
    if name in NAMES:
        every = (_keys(name, kind, makers[kind])["properties"].items() for kind in reversed(makers))
        choices.append({
            "description": "One of the catalogue; other keys replace what its name says.",
            "type": "object",
            "properties": {"name": keys.form(name, "", "name"), **{key: one for some in every for key, one in some}},
            "required": ["name"],
            "additionalProperties": False,
        })  # fmt: skip
    return {
        "type": "object",
        "description": keys.TABLES[name],
        "properties": {selector: {"enum": list(makers)}},  # so that editors offer the kinds first
        "required": [] if name in NAMES else [selector],
        "oneOf": choices,
    }


def _one(name: str, maker: Callable[..., Any]) -> dict[str, Any]:
    """The schema of a table that has one kind; where a name may stand for all its keys, either is required."""
    found = _keys(name, "", maker)
    if name not in NAMES:
        return found
    either = [{"required": found["required"]}, {"required": ["name"]}]
    own = {"name": keys.form(name, "", "name"), **found["properties"]}
    return found | {"properties": own, "required": [], "anyOf": either}


def _choices(name: str, selector: str, makers: dict[str, Callable[..., Any]]) -> list[dict[str, Any]]:
    """The schemas of a table of each kind."""
    choices = []
    for kind, maker in makers.items():
        found = _keys(name, kind, maker)
        found["properties"] = {selector: {"const": kind}, **found["properties"]}
        found["required"] = [selector, *found["required"]]
        choices.append(found)
    return choices


def _keys(table: str, kind: str, maker: Callable[..., Any]) -> dict[str, Any]:
    """The schema of the keys that become arguments of a function."""
    arguments = {n: p for n, p in keys_of(maker).items() if n not in NESTED}
    found: dict[str, Any] = {
        "type": "object",
        "properties": {name: _key(table, kind, name, argument.default) for name, argument in arguments.items()},
        "required": [n for n, p in arguments.items() if p.default is p.empty],
        "additionalProperties": False,
    }
    return {"description": (inspect.getdoc(maker) or "").partition("\n")[0] if kind else keys.TABLES[table], **found}


def _key(table: str, kind: str, name: str, default: Any) -> dict[str, Any]:
    """The schema of one key, with its default."""
    if name == "rise":
        one = keys.table({"table": keys.form("rise", "", "table")}, ("table",))
        return keys.form(table, kind, name) | keys.named("a [rise](#rise)", *_choices("rise", "shape", RISES), one)
    if name in WITHIN:
        return _one(name, WITHIN[name]) | {"description": keys.KEYS.get(name, (keys.TABLES[name],))[0]}
    found = keys.form(table, kind, name)
    if table in KNOWN and found.get("type") == "number":
        words = found.pop("description")
        found = {"description": words, "anyOf": [found, *INTERVAL]}
    elif table in KNOWN and any(each.get("type") == "number" for each in found.get("anyOf", ())):
        found = found | {"anyOf": [*found["anyOf"], *INTERVAL]}
    return found | ({"default": default} if isinstance(default, (float, int, str)) else {})
