"""A JSON schema of scene files for editors (taplo, VS Code), made from the table by which scenes are checked."""

import inspect
from collections.abc import Callable
from types import UnionType
from typing import Any, get_args

from ..fe.section import KINDS, SOFT, Elastic
from .schema import MAKERS, NESTED, PATHS, REPEATED, REQUIRED, SUPPLIED

DRAFT = "http://json-schema.org/draft-07/schema#"  # what taplo and VS Code read
TYPES: dict[type, str] = {float: "number", int: "integer", str: "string", bool: "boolean"}  # all others may be anything


def schema() -> dict[str, Any]:
    """The schema of a scene: tables, their keys and simple types, what is required, and the kinds to choose from.

    Every scene that loads satisfies it; it leaves ranges of numbers and everything between tables to `load_scene`.
    """
    tables = {name: _table(selector, makers) for name, (selector, makers) in MAKERS.items()}
    tables[REPEATED]["properties"] |= {name: tables[name] for name in NESTED}
    tables[REPEATED] = {"type": "array", "items": tables[REPEATED]}
    spring = _keys(Elastic)
    tables["supports"] = {
        "type": "object",
        "description": "how each named edge is held; boundary means all of them",
        "additionalProperties": {"anyOf": [{"enum": [*KINDS, SOFT]}, spring]},
    }
    return {
        "$schema": DRAFT,
        "title": "A scene of fem_impact",
        "type": "object",
        "properties": {"title": {"type": "string"}, **tables},
        "required": list(REQUIRED),
        "additionalProperties": False,
    }


def _table(selector: str, makers: dict[str, Callable[..., Any]]) -> dict[str, Any]:
    """The schema of one table: that of its only kind, or a choice by the key ``selector``."""
    if not selector:
        return _keys(makers[""])
    choices = []
    for kind, maker in makers.items():
        keys = _keys(maker)
        keys["properties"] = {selector: {"const": kind}, **keys["properties"]}
        keys["required"] = [selector, *keys["required"]]
        choices.append(keys)
    return {
        "type": "object",
        "properties": {selector: {"enum": list(makers)}},  # so that editors offer the kinds first
        "required": [selector],
        "oneOf": choices,
    }


def _keys(maker: Callable[..., Any]) -> dict[str, Any]:
    """The schema of the keys that become arguments of a function."""
    arguments = {n: p for n, p in inspect.signature(maker).parameters.items() if n not in SUPPLIED}
    found: dict[str, Any] = {
        "type": "object",
        "properties": {name: _kind(name, argument) for name, argument in arguments.items()},
        "required": [n for n, p in arguments.items() if p.default is inspect.Parameter.empty],
        "additionalProperties": False,
    }
    said = (inspect.getdoc(maker) or "").partition("\n")[0]
    return {"description": said, **found} if said else found


def _kind(name: str, argument: inspect.Parameter) -> dict[str, Any]:
    """The type and default of one key, as far as the annotation of the argument tells."""
    stated = argument.annotation
    kinds = [kind for kind in (get_args(stated) if isinstance(stated, UnionType) else (stated,)) if kind in TYPES]
    found: dict[str, Any] = {"type": "string"} if name in PATHS else {}
    if len(kinds) == 1:
        found["type"] = TYPES[kinds[0]]
    if isinstance(argument.default, (float, int, str)):
        found["default"] = argument.default
    return found
