"""The public names by task: a page for each task, whose docstrings Sphinx reads."""

import inspect
import sys
from operator import attrgetter
from textwrap import indent
from types import ModuleType

import api

import fem_impact as fi

TASKS = {
    "Make a body": "Material Plate Beam Rib Elastic assemble yield_strength mesh rise materials",
    "Find its modes": "find_modes ritz_modes Modes Body analytic rayleigh in_air mobility mac matched",
    "Choose what strikes it": "Striker strikers Hand Contact Touch",
    "Strike": "strike collide strokes plan Plan Response Impact Gradient load_response threshold "
    "threshold_frequency verify SimulationError ToleranceWarning",
    "Scenes, maps, uncertain inputs": "Scene load_scene sweep read_borders spread band",
    "Hammers and measured taps": "hammers plan_test Taps read_taps measure fit propose frf update",
    "Design": "design",
    "See and hear": "figures pictures sound spectra",
    "Pages and files": "report lesson explore export",
}
REST = "More"  # what no task names yet
HEAD = """# Public names

All numbers are in SI units. `import fem_impact as fi` comes first everywhere.

```{toctree}
:hidden:

"""


def tasks():
    """Of each task its public names; what is in none comes last."""
    found = {task: [name for name in names.split() if name in fi.__all__] for task, names in TASKS.items()}
    named = {name for names in found.values() for name in names} | {"__version__"}
    return found | {REST: [name for name in fi.__all__ if name not in named]}


def entries(name):
    """The functions and classes under a public name: itself, or those of a module, as `studies/api.md` has them."""
    item = getattr(fi, name)
    return [f"{name}.{key}" for key in api.functions(item)] if isinstance(item, ModuleType) else [name]


def told(path):
    """What Sphinx is to read for one function or class."""
    kind, item = "autofunction", attrgetter(path)(fi)
    if not callable(item):  # a table by name
        return f"```{{eval-rst}}\n.. py:data:: fi.{path}\n\n{indent(inspect.getdoc(item) or '', '   ')}\n```\n"
    if inspect.isclass(item):
        kind = "autoexception" if issubclass(item, Exception) else "autoclass"
    members = "   :members:\n" if kind == "autoclass" else ""
    return f"```{{eval-rst}}\n.. {kind}:: fi.{path}\n{members}```\n"


def page(task, names):
    """The page of a task."""
    parts = [f"# {task}\n"]
    for name in names:
        about = f"\n{api.first(getattr(fi, name))}\n" if isinstance(getattr(fi, name), ModuleType) else ""
        parts.append(f"## fi.{name}\n{about}")
        parts += [told(path) for path in entries(name)]
    return "\n".join(parts)


def write(folder):
    """Write the pages into the folder of `api.md`, in its place."""
    slug = {task: task.lower().replace(",", "").replace(" ", "-") for task, names in tasks().items() if names}
    (folder / "names").mkdir()
    text = HEAD + "".join(f"names/{each}\n" for each in slug.values()) + "```\n"
    for task, place in slug.items():
        names = tasks()[task]
        (folder / "names" / f"{place}.md").write_text(page(task, names), encoding="utf-8")
        listed = ", ".join(f"[fi.{name}](names/{place}.md#fi{name.lower()})" for name in names)
        text += f"\n## {task}\n\n{listed}\n"
    (folder / "api.md").write_text(text, encoding="utf-8")


def lend():
    """Let Sphinx import the package and its modules under the name that everybody writes."""
    sys.modules["fi"] = fi
    for name in set(fi.__all__) - {"__version__"}:
        if isinstance(item := getattr(fi, name), ModuleType):
            sys.modules[f"fi.{name}"] = item
