"""Strike anything thin with anything, and know how far to trust the answer."""

import ast
import logging
from importlib import import_module
from pathlib import Path
from typing import Any

from ._base import progress

logging.getLogger(__name__).addHandler(logging.NullHandler())  # silent unless the user listens to "fem_impact"
progress.speak()  # but for what takes long

# Public names and where they are, as the stub has them; imported at first use so that the command line starts quickly.
_HOME = {
    alias.name: f".{node.module or ''}"
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text("utf-8")).body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}

__all__ = [*_HOME, "__version__"]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version("fem-impact")
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = import_module(_HOME[name], __name__) if _HOME[name] != "." else None
    if home is not None and hasattr(home, name):
        found = getattr(home, name)
    else:
        found = import_module(f"{_HOME[name].rstrip('.')}.{name}", __name__)  # a module
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
