"""What the package's source says of itself: the order of its packages, who prints, which types users see."""

import ast
import inspect
from functools import cache
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from signatures import public

import fem_impact as fi

HOME = Path(__file__).parents[1] / "fem_impact"
# each package imports only from those above it in this list, and knows nothing of those below
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
SPEAKERS = {"canvas.py", "cli.py", "display.py"}  # the prompt, and a process whose output its parent reads


@cache
def nodes(path):
    """Everything in a module, parsed once."""
    return list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def place(path):
    return path.relative_to(HOME).as_posix()


def package(path):
    """The package of a module as a path from `HOME`; the folder of laws is part of that above it."""
    return "" if path.parent == HOME else place(path.parent).removesuffix("/laws")


def imports(path):
    """Packages of ours that a module imports from, and libraries, anywhere in the file: two sets of names."""
    own, outside = set(), set()
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            for name in node.names:
                target = base / name.name
                found = target if target.is_dir() else base.parent if base.with_suffix(".py").exists() else base
                own.add(place(found).removeprefix(".").removesuffix("/laws"))
        elif isinstance(node, ast.ImportFrom):
            outside.add(node.module.split(".")[0])
        elif isinstance(node, ast.Import):
            outside |= {alias.name.split(".")[0] for alias in node.names}
    return own, outside


def test_modules_import_from_packages_above_and_libraries_only_where_they_belong():
    for path in MODULES:
        own, outside = imports(path)
        below = {name for name in own if ORDER.index(name) > ORDER.index(package(path))}
        assert not below, f"{place(path)} imports from {sorted(below)}, which come later"
        trespass = {library for library in outside if not place(path).startswith(OWNERS.get(library, ("",)))}
        assert not trespass, f"{place(path)} imports {sorted(trespass)}, which belongs to other modules"


def test_a_package_says_what_it_is_for_and_where_to_start():
    for name in filter(None, ORDER):
        text = ast.get_docstring(ast.parse((HOME / name / "__init__.py").read_text()))
        assert text is not None and text.count(".") >= 2 and len(text) < 600, name
        modules = {path.stem for path in (HOME / name).glob("*.py")} - {"__init__"}
        assert name == "impact/compiled" or any(f"`{module}`" in text for module in modules), name


def test_only_the_prompt_prints():
    for path in HOME.rglob("*.py"):
        called = (node.func for node in nodes(path) if isinstance(node, ast.Call))
        prints = any(isinstance(func, ast.Name) and func.id == "print" for func in called)
        assert not prints or path.name in SPEAKERS, path


MODELS = {"model.planner", "model.target", "modes.finding", "modes.modal", "scenes.scene"}
BLOWS = {f"impact.{name}" for name in ("collision", "contact", "response", "striker")}
DOORS = {  # what these packages may use of those above: what a user does, and modules that hide how a blow is computed
    "live": MODELS | BLOWS | {"impact.played", "modes.viewing", "show.sampling", "show.sound"},
    "taps": MODELS | BLOWS | {
        "fe.assembly", "fe.plausible", "impact.accuracy", "impact.engine", "impact.history", "impact.measured",
        "impact.quantities", "impact.reduced_body", "impact.spectra", "modes.picked", "modes.universal_files",
        "scenes.schema", "show.export", "show.figures", "show.plots", "show.sampling", "sweeps.bodies",
        "sweeps.hammers",
    },
    "designs": MODELS | BLOWS | {
        "fe.assembly", "fe.refinement", "fe.section", "fe.slopes", "fe.system", "fe.variation", "impact.clearance",
        "impact.gradient", "impact.parameters", "impact.promise", "impact.quantities", "mesh.meshes", "model.budget",
        "modes.varied", "modes.viewing", "show.outlined", "taps.solver", "taps.unknowns",
    },
}  # fmt: skip


def test_live_taps_and_designs_reach_into_no_other_package():
    for path in (path for name in DOORS for path in sorted((HOME / name).glob("*.py"))):
        used = set()
        for node in (item for item in nodes(path) if isinstance(item, ast.ImportFrom) and item.level == 2):
            names = [alias.name for alias in node.names]
            assert not any(each.startswith("_") for each in names), f"{path.name} imports private {names}"
            used |= {node.module} if "." in node.module else {f"{node.module}.{each}" for each in names}
        foreign = {each for each in used if not each.startswith("_base.")} - DOORS[path.parent.name]
        assert not foreign, f"{path.name} imports from {sorted(foreign)}"


NOT_MIRRORED = {  # tested under the name of what uses them
    "_base/check.py", "fe/elements.py", "fe/euler.py", "fe/interpolation.py", "fe/kirchhoff.py", "fe/material.py",
    "fe/plane.py", "fe/plates.py", "fe/supports.py", "fe/system.py", "impact/played.py", "mesh/meshio_reader.py",
    "mesh/open_paths.py", "model/asked.py", "model/budget.py", "model/by_idealisation.py", "model/by_mixture.py",
    "model/by_modes.py", "model/by_vectors.py", "modes/disk.py", "modes/rectangle.py", "modes/request.py",
    "modes/shapes.py", "modes/slender.py", "pages/explore_numbers.py", "pages/explore_server.py",
    "pages/explore_view.py", "pages/html_page.py", "pages/lesson_grid.py", "pages/tap_pictures.py",
    "pages/worksheet.py", "references/blows.py", "references/frequencies.py", "scenes/band.py", "scenes/maps.py",
    "scenes/schema.py", "scenes/sentences.py", "scenes/whole.py", "show/canvas.py",
    "show/histories.py", "show/outlined.py", "show/plots.py", "show/sampling.py", "show/style.py", "sweeps/inputs.py",
    "taps/proposal.py", "taps/units.py",
}  # fmt: skip


def test_every_module_has_a_test_file_of_its_name():
    for path in MODULES:
        if path.parent.parent == HOME and place(path) not in NOT_MIRRORED:
            mirror = Path(__file__).parent / path.parent.name.lstrip("_") / f"test_{path.name}"
            assert mirror.is_file(), place(path)


def classes():
    """Package and attribute names of every class of ours."""
    for path in MODULES:
        for node in (each for each in nodes(path) if isinstance(each, ast.ClassDef)):
            names = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
            names |= {item.target.id for item in node.body if isinstance(item, ast.AnnAssign)}
            stored = (item for item in ast.walk(node) if isinstance(getattr(item, "ctx", None), ast.Store))
            yield (
                package(path),
                node.name,
                names | {ast.unparse(item)[5:] for item in stored if ast.unparse(item).startswith("self.")},
            )


def untyped(path):
    """Function, parameter and the attributes used of every parameter without a type of its own."""
    for node in (each for each in nodes(path) if isinstance(each, ast.FunctionDef)):
        used: dict[str, set] = {}
        for item in ast.walk(node):
            if isinstance(item, ast.Attribute) and isinstance(item.value, ast.Name):
                used.setdefault(item.value.id, set()).add(item.attr)
        for each in [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]:
            typed = each.annotation and ast.unparse(each.annotation) != "Any"
            if each.arg not in ("self", "cls") and not typed and each.arg in used:
                yield node.name, each.arg, used[each.arg]


def test_no_untyped_parameter_stands_for_a_class_of_a_later_package():
    """But in `impact/compiled`: numba finds the types of kernels, which take arrays and named tuples only."""
    common = set().union(*map(dir, (np.ndarray, dict, list, str, bytes, float, Path, coo_matrix)))
    known = list(classes())
    for path in (each for each in MODULES if package(each) != "impact/compiled"):
        for function, parameter, used in untyped(path):
            homes = {home: name for home, name, names in known if used - common and used - common <= names}
            later = {name for home, name in homes.items() if ORDER.index(home) > ORDER.index(package(path))}
            assert not later or len(later) < len(homes), f"{place(path)}: {parameter} of {function} is a {later}"


def test_every_name_of_the_stub_is_there_and_known_to_type_checkers():
    assert all(getattr(fi, name) is not None for name in fi.__all__)
    for node in ast.parse((HOME / "__init__.pyi").read_text()).body:  # "as" makes an import a name of ours
        assert not isinstance(node, ast.ImportFrom) or all(each.asname == each.name for each in node.names)
    assert (HOME / "py.typed").is_file()


def test_every_parameter_of_a_public_name_is_annotated():
    for name, item in public().items():
        signature = inspect.signature(item.__init__ if inspect.isclass(item) else item)
        kinds = {each.name: each.annotation for each in signature.parameters.values()}
        bare = {each for each, kind in kinds.items() if kind is inspect.Parameter.empty} - {"self", "cls"}
        assert not bare, (name, bare)
        assert "_typing" not in str(signature), f"{name}: help() shows the inside of an alias; write it in quotes"
        assert inspect.isclass(item) or signature.return_annotation is not inspect.Signature.empty, name
