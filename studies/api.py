"""Writes `api.md`, the page of all public names, from their docstrings.

    python studies/api.py

`tests/test_pages.py` fails while the page is not the one that this script would write.
"""

import inspect
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

import fem_impact as fi

PAGE = Path(__file__).parent / "api.md"
HEAD = """# Public names

Written by `python studies/api.py` from the docstrings: do not edit. All numbers are in SI units. `import fem_impact as
fi` comes first everywhere.
"""
MADE = {"Impact", "Plan", "Response", "Scene"}  # results, which users do not construct


def parameters(item):
    """The parameters of a function with their defaults, without types: the docstring tells these better."""
    try:
        found = inspect.signature(item).parameters.values()
    except (TypeError, ValueError):
        return "..."
    plain = [each.replace(annotation=inspect.Parameter.empty) for each in found if each.name not in ("self", "cls")]
    told = [each if simple(each.default) else each.replace(default=...) for each in plain]
    return str(inspect.Signature(told))[1:-1].replace("Ellipsis", "...")


def simple(default):
    """Whether a default is its own description."""
    return default is inspect.Parameter.empty or default is None or isinstance(default, (bool, int, float, str, tuple))


def fenced(text):
    """Text as it is."""
    return f"```text\n{text.strip()}\n```\n"


def first(item):
    """The first paragraph of a docstring on one line."""
    return " ".join((inspect.getdoc(item) or "").partition("\n\n")[0].split())


def members(name, kind):
    """A line for each public method and property of a class."""
    lines = []
    own = [each for each in reversed(kind.__mro__) if each.__module__.startswith(fi.__name__)]
    for key, raw in {key: raw for each in own for key, raw in vars(each).items()}.items():
        said = first(raw.__func__ if isinstance(raw, (classmethod, staticmethod)) else raw)
        if key.startswith("_") or not said or not (callable(raw) or isinstance(raw, (property, classmethod)) or
                                                   hasattr(raw, "func")):  # fmt: skip
            continue
        call = f"({parameters(getattr(kind, key))})" if callable(getattr(kind, key)) else ""
        place = f"fi.{name}" if isinstance(raw, (classmethod, staticmethod)) else f".{key}"
        lines.append(f"- `{place}{f'.{key}' if place != f'.{key}' else ''}{call}`: {said}")
    return "\n".join(lines) + "\n" if lines else ""


def entry(name, item):
    """The part of the page about one name."""
    things = isinstance(item, Mapping)
    call = "" if name in MADE else "[name]" if things else f"({parameters(item)})"
    text = f"### fi.{name}\n\n`fi.{name}{call}`\n\n" + fenced(inspect.getdoc(item) or "")
    kind = type(item) if things else item
    return text + ("\n" + members(name, kind) if inspect.isclass(kind) and not issubclass(kind, Exception) else "")


def functions(home):
    """The public functions of a module, and what it holds by name, sorted."""

    def own(key, item):
        if isinstance(item, Mapping):
            return type(item).__module__.startswith(fi.__name__)
        ours = f"{item.__module__}.".startswith(f"{home.__name__}.") if inspect.isfunction(item) else False
        return ours or (inspect.isfunction(item) and key in getattr(home, "__all__", ()))

    return {key: item for key, item in inspect.getmembers(home) if not key.startswith("_") and own(key, item)}


def page():
    """The whole page."""
    names = [name for name in fi.__all__ if name != "__version__"]
    alone = {name: item for name in names if not isinstance(item := getattr(fi, name), ModuleType)}
    parts = [HEAD, "## Functions and classes\n", *(entry(name, alone[name]) for name in sorted(alone))]
    for name in sorted(set(names) - set(alone)):
        home = getattr(fi, name)
        own = functions(home)
        parts.append(f"## fi.{name}\n\n{first(home)}\n")
        parts += [entry(f"{name}.{key}", own[key]) for key in sorted(own)]
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"{PAGE}: {page().count(chr(10))} lines")
