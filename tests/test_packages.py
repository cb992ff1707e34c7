"""The order of the packages: each imports only from those above it in this list, and knows nothing of those below."""

import ast
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_matrix

HOME = Path(__file__).parents[1] / "fem_impact"
ORDER = [
    "_base", "mesh", "fe", "modes", "impact/compiled", "impact", "references", "model", "sweeps", "show", "scenes",
    "live", "taps", "designs", "pages", "",
]  # fmt: skip
OWNERS = {
    "numba": ("impact/compiled/",),
    "skfem": ("fe/elements.py", "fe/beam_elements.py", "fe/plane.py", "fe/shear_beam.py"),
    "matplotlib": ("show/figures.py", "show/plots.py", "show/style.py"),
}
MODULES = sorted(path for path in HOME.rglob("*.py") if path.name != "__init__.py")


def package(path):
    """The package of a module as a path from `HOME`; the folder of laws is part of that above it."""
    return "" if path.parent == HOME else path.parent.relative_to(HOME).as_posix().removesuffix("/laws")


def imports(path):
    """Packages of ours that a module imports from, and libraries, anywhere in the file: two sets of names."""
    own, outside = set(), set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            for name in node.names:
                target = base / name.name
                found = target if target.is_dir() else base.parent if base.with_suffix(".py").exists() else base
                own.add(found.relative_to(HOME).as_posix().removeprefix(".").removesuffix("/laws"))
        elif isinstance(node, ast.ImportFrom):
            outside.add(node.module.split(".")[0])
        elif isinstance(node, ast.Import):
            outside |= {alias.name.split(".")[0] for alias in node.names}
    return own, outside


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(HOME).as_posix())
def test_a_module_imports_from_its_package_and_those_above(path):
    own, outside = imports(path)
    mine = ORDER.index(package(path))
    below = {name for name in own if ORDER.index(name) > mine}
    assert not below, f"{path.name} imports from {sorted(below)}, which come later"
    here = path.relative_to(HOME).as_posix()
    trespass = {library for library in outside if not here.startswith(OWNERS.get(library, ("",)))}
    assert not trespass, f"{here} imports {sorted(trespass)}, which belongs to other modules"


@pytest.mark.parametrize("name", [name for name in ORDER if name])
def test_a_package_says_what_it_is_for_and_where_to_start(name):
    text = ast.get_docstring(ast.parse((HOME / name / "__init__.py").read_text()))
    assert text is not None and text.count(".") >= 2 and len(text) < 600
    modules = {path.stem for path in (HOME / name).glob("*.py")} - {"__init__"}
    assert name == "impact/compiled" or any(f"`{module}`" in text for module in modules)


MODELS = {"model.planner", "model.target", "modes.finding", "modes.modal", "scenes.scene"}
BLOWS = {f"impact.{name}" for name in ("collision", "contact", "response", "striker")}
DOORS = {  # what these packages may use of those above: what a user does, and modules that hide how a blow is computed
    "live": MODELS | BLOWS | {"impact.played", "modes.viewing", "show.sampling", "show.sound"},
    "taps": MODELS | BLOWS | {
        "fe.assembly", "impact.accuracy", "impact.engine", "impact.history", "impact.measured", "impact.quantities",
        "impact.reduced_body", "impact.spectra", "modes.picked", "modes.universal_files", "scenes.schema",
        "show.export", "show.figures", "show.plots", "show.sampling", "sweeps.bodies", "sweeps.hammers",
    },
    "designs": MODELS | BLOWS | {
        "fe.assembly", "fe.refinement", "fe.section", "fe.slopes", "fe.system", "fe.variation", "impact.clearance",
        "impact.gradient", "impact.parameters", "impact.promise", "impact.quantities", "mesh.meshes", "model.budget",
        "modes.varied", "modes.viewing", "show.outlined", "taps.arguments", "taps.solver", "taps.unknowns",
    },
}  # fmt: skip


@pytest.mark.parametrize("name", DOORS)
def test_live_taps_and_designs_reach_into_no_other_package(name):
    for path in sorted((HOME / name).glob("*.py")):
        tree, used = ast.parse(path.read_text()), set()
        for node in (item for item in ast.walk(tree) if isinstance(item, ast.ImportFrom) and item.level == 2):
            names = [alias.name for alias in node.names]
            assert not any(each.startswith("_") for each in names), f"{path.name} imports private {names}"
            used |= {node.module} if "." in node.module else {f"{node.module}.{each}" for each in names}
        foreign = {each for each in used if not each.startswith("_base.")} - DOORS[name]
        assert not foreign, f"{path.name} imports from {sorted(foreign)}"


NOT_MIRRORED = {  # tested under the name of what uses them
    "_base/check.py", "fe/euler.py", "fe/interpolation.py", "fe/kirchhoff.py", "fe/material.py", "fe/plane.py",
    "fe/plates.py", "fe/system.py", "impact/played.py", "mesh/meshio_reader.py", "model/asked.py", "model/budget.py",
    "model/by_idealisation.py", "model/by_mixture.py", "model/by_vectors.py", "modes/disk.py",
    "modes/rectangle.py", "modes/request.py", "modes/shapes.py", "modes/slender.py", "pages/explore_server.py",
    "pages/explore_view.py", "references/blows.py", "references/contacts.py",
    "references/frequencies.py", "scenes/maps.py", "scenes/schema.py", "scenes/whole.py",
    "show/plots.py", "show/style.py",
}  # fmt: skip


def test_every_module_has_a_test_file_of_its_name():
    tests = Path(__file__).parent
    for path in sorted(HOME.glob("*/*.py")):
        name = path.relative_to(HOME).as_posix()
        if path.name != "__init__.py" and name not in NOT_MIRRORED:
            assert (tests / path.parent.name.lstrip("_") / f"test_{path.name}").is_file(), name


def classes():
    """Package and attribute names of every class of ours."""
    found = []
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef):
                names = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
                names |= {item.target.id for item in node.body if isinstance(item, ast.AnnAssign)}
                stored = (item for item in ast.walk(node) if isinstance(getattr(item, "ctx", None), ast.Store))
                names |= {ast.unparse(item)[5:] for item in stored if ast.unparse(item).startswith("self.")}
                found.append((package(path), node.name, names))
    return found


def untyped(path):
    """Function, parameter and the attributes used of every parameter without a type of its own."""
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.FunctionDef):
            continue
        for each in [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]:
            if each.arg in ("self", "cls") or (each.annotation and ast.unparse(each.annotation) != "Any"):
                continue
            used = {
                item.attr
                for item in ast.walk(node)
                if isinstance(item, ast.Attribute) and isinstance(item.value, ast.Name) and item.value.id == each.arg
            }
            if used:
                yield node.name, each.arg, used


COMMON = set().union(*map(dir, (np.ndarray, dict, list, str, bytes, float, Path, coo_matrix)))
CLASSES = classes()


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(HOME).as_posix())
def test_no_untyped_parameter_stands_for_a_class_of_a_later_package(path):
    if package(path) == "impact/compiled":
        return  # numba finds the types of kernels, which take arrays and named tuples only
    mine = ORDER.index(package(path))
    for function, parameter, used in untyped(path):
        homes = {home: name for home, name, names in CLASSES if used - COMMON and used - COMMON <= names}
        later = {name for home, name in homes.items() if ORDER.index(home) > mine}
        assert not later or len(later) < len(homes), f"{path.name}: {parameter} of {function} is a {sorted(later)}"
