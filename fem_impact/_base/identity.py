"""Distinguishes programs, functions and objects by what their results depend on, so that none is taken for another.

A function is its code, its defaults and what it uses of closures and globals, whatever its name and place in a file.
What belongs to Python, to an installed package or to this program is its name and version. What a function reads from
files or finds by names made at run time does not count.
"""

import dis
import hashlib
import importlib
import pickle
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cache, cached_property
from importlib.metadata import version
from pathlib import Path
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from .child import PACKAGE

NUMERICS = ("numpy", "scipy", "numba", "scikit-fem")  # libraries whose versions may change the digits of a result
PLAIN = (type(None), bool, int, float, complex, str, bytes, range, type(...), type(NotImplemented))
OF_A_CLASS = {  # what a class has besides its own names, or what follows from them
    "__dict__", "__weakref__", "__doc__", "__module__", "__annotations__", "__abstractmethods__", "_abc_impl",
    "__dataclass_fields__", "__dataclass_params__", "__firstlineno__", "__static_attributes__",
}  # fmt: skip


@cache
def program() -> str:
    """Digest of this package's source and of the versions of the libraries that compute for it."""
    body = hashlib.sha256(repr([version(name) for name in NUMERICS]).encode())
    for file in sorted(PACKAGE.rglob("*.py")):
        body.update(file.relative_to(PACKAGE).as_posix().encode() + hashlib.sha256(file.read_bytes()).digest())
    return body.hexdigest()


def identify(thing: Any) -> str:
    """Digest of a function or an object.

    Raises
    ------
    ValueError
        If it uses something that cannot be distinguished from others of its kind, such as an open file; says what.
    """
    known: dict[int, tuple[Any, bytes]] = {}  # the objects, too: only of living ones is the number unique
    path: list[int] = []  # numbers of the objects that are being looked into

    def digest(thing: Any) -> bytes:
        if type(thing) in PLAIN:
            return hashlib.sha256(f"{type(thing).__name__} {thing!r}".encode("utf-8", "surrogatepass")).digest()
        number = id(thing)
        if number in path:
            return hashlib.sha256(f"itself {path.index(number)}".encode()).digest()
        if number not in known:
            path.append(number)
            label, used = _used(thing)
            parts = [digest(part) for part in used]
            path.pop()
            ordered = sorted(parts) if isinstance(thing, (set, frozenset, dict)) else parts
            known[number] = thing, hashlib.sha256(b"".join([label.encode(), *ordered])).digest()
        return known[number][1]

    try:
        return digest(thing).hex()
    except RecursionError:
        raise ValueError("what it uses is nested too deeply") from None


def _used(thing: Any) -> tuple[str, list[Any]]:
    """What kind of object it is, and the objects that make it up."""
    kind = type(thing)
    if kind in (tuple, list, set, frozenset):
        return kind.__name__, list(thing)
    if kind is dict:
        return "dict", list(thing.items())
    if kind is np.ndarray and not thing.dtype.hasobject:
        return "array", [repr(thing.dtype), thing.shape, thing.tobytes()]
    if isinstance(thing, ModuleType):
        if version := _versioned(thing.__name__):
            return f"module {version}", []
        file = getattr(thing, "__file__", None)
        if file is None:
            raise ValueError(f"it uses the module {thing.__name__}, which has no file")
        names = {value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
                 for value in vars(thing).values()}  # fmt: skip
        others = sorted(name for name in names if isinstance(name, str) and name in sys.modules)
        return "module", [Path(file).read_bytes(), *(sys.modules[name] for name in others)]  # and all that it uses
    name = getattr(thing, "__qualname__", getattr(thing, "__name__", None))
    if isinstance(name, str) and (known := _named(thing, getattr(thing, "__module__", None), name)):
        return known, []
    if isinstance(thing, CodeType):
        counts = thing.co_argcount, thing.co_posonlyargcount, thing.co_kwonlyargcount, thing.co_flags
        arguments = thing.co_varnames[: thing.co_argcount + thing.co_kwonlyargcount]
        return "code", [thing.co_code, thing.co_exceptiontable, thing.co_consts, thing.co_names, counts, arguments]
    if isinstance(thing, FunctionType):
        filled = thing.__closure__, thing.__defaults__, thing.__kwdefaults__
        return "function", [thing.__code__, *filled, dict(_globals(thing.__code__, thing.__globals__))]
    if isinstance(thing, CellType):
        with suppress(ValueError):
            return "cell", [thing.cell_contents]
        return "empty cell", []
    if isinstance(thing, type):
        own = {name: value for name, value in vars(thing).items() if name not in OF_A_CLASS}
        return f"class {name}", [thing.__bases__, own]
    if isinstance(thing, property):
        return "property", [thing.fget, thing.fset, thing.fdel]
    if isinstance(thing, cached_property):
        return "property", [thing.func]
    if hasattr(thing, "__wrapped__"):  # what decorators, caches and compilers return
        return kind.__qualname__, [thing.__wrapped__]
    return _reduced(thing)


def _reduced(thing: Any) -> tuple[str, list[Any]]:
    """What an object would be pickled as, without what it keeps of properties."""
    kind = type(thing)
    try:
        found = thing.__reduce_ex__(pickle.HIGHEST_PROTOCOL)
    except Exception:  # objects that cannot be copied raise anything
        found = ""
    if isinstance(found, str):  # a name somewhere
        places = [place for place in list(sys.modules) if found and _named(thing, place, found)]
        name = _named(thing, min(places, default=""), found)
        if not name:
            raise ValueError(f"it uses an object of type {kind.__module__}.{kind.__qualname__}")
        return name, []
    make, arguments, state, items, pairs = (*found, None, None, None)[:5]
    if isinstance(state, dict):
        kept = {name for each in kind.__mro__ for name, value in vars(each).items()
                if isinstance(value, cached_property)}  # fmt: skip
        state = {name: value for name, value in state.items() if name not in kept}
    return "object", [make, arguments, state, list(items or ()), dict(pairs or ())]


def _globals(code: CodeType, known: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Globals and modules that a function uses, and those of the functions inside it."""
    for step in dis.get_instructions(code):
        if step.opname in ("LOAD_GLOBAL", "LOAD_NAME") and step.argval in known:
            yield step.argval, known[step.argval]
        elif step.opname == "IMPORT_NAME":
            with suppress(ImportError):
                yield f"import {step.argval}", importlib.import_module(step.argval)
    for part in code.co_consts:
        if isinstance(part, CodeType):
            yield from _globals(part, known)


def _named(thing: Any, module: Any, name: str) -> str:
    """Name and version of what belongs to Python, to this program or to an installed package; '' of all else."""
    found = sys.modules.get(module) if isinstance(module, str) else None
    version = "" if found is None else _versioned(module)
    if not version:
        return ""
    for part in name.split("."):
        found = getattr(found, part, None)
    return f"{version} {name}" if found is thing else ""


def _versioned(module: str) -> str:
    """A module's name with a version, if it belongs to Python, to this program or to an installed package; else ''."""
    top = module.partition(".")[0]
    home = sys.modules.get(top)
    if top in sys.stdlib_module_names:
        return f"{module} {sys.version}"
    places = [getattr(home, "__file__", None) or "", *getattr(home, "__path__", ())]
    installed = any(part in ("site-packages", "dist-packages") for place in places for part in Path(place).parts)
    return f"{module} {getattr(home, '__version__', '')}" if installed or top == PACKAGE.name else ""
