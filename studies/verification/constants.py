"""Every named number of the package by kind, and for those that somebody chose: why, and which test holds it.

    python studies/verification/constants.py                       counts by kind and package
    python studies/verification/constants.py --list tuning         each constant of a kind with its line and its test
    python studies/verification/constants.py --hold model.vectors  change the tuning constants of a module, package or
                                   of one name (fe.corners.SHRINK), one by one, and note which test fails first

The kind follows from what is already written, in this order:

layout    the comment names no unit: codes of formats, places in arrays, tables of names
fact      the comment says so ("fact: ..."), says what the number is exact for, or cites its source (Author 1999):
          physics, mathematics and units, which nobody chose
picture   it lives in `show`, `pages`, `cli`, `display`, `markup`, `sketch` or `viewing`, is in pixels or counts
          characters: what something looks like
limit     a message quotes it, or an error is raised beyond a MOST_, LARGEST_ or LONGEST_: what the user is allowed
resource  it lives in `model.cost`, or the comment says that it bounds memory or time, or what is faster: it changes or
          foretells the cost, not the answer
rounding  below 1e-6, and the comment says that it stands for rounding: double precision decides it
tuning    all others: thresholds, safety factors, tolerances and counts that decide a result

`constants.csv` remembers for each constant that was changed its value, the factors and the first test that failed, or
that none did. Constants of order one and small counts are changed by 2, others by 10, up and then down; the tests
run are the fast ones of its module and of the modules that use it, or where there are none, of its package. So a
constant that none of them holds may still be held by others. For a compiled kernel, which is compiled anew with each
change, the tests are all that import any kernel.
"""

import argparse
import ast
import csv
import hashlib
import importlib.abc
import importlib.util
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "fem_impact"
HOLDERS = Path(__file__).with_suffix(".csv")
COLUMNS = ("constant", "value", "factors", "holder")
SHOWN = {"show", "pages", "cli", "display", "_base.markup", "mesh.sketch", "modes.viewing"}  # for the eye
KINDS = ("layout", "fact", "picture", "limit", "resource", "rounding", "tuning")
FACT = r"\bfact:|\bexact for\b|\([A-Z][^()]* (19|20)\d\d\)"
CHEAP = r"to limit (the )?(memory|work)|limits the memory|is faster|% slower|time limit|does not change the result"
SECONDS = 60  # [s] of CPU that the tests of one changed constant may take; longer ones count as not failed
KERNEL_SECONDS = 180  # [s] the same where kernels are compiled first
KERNELS = "impact.compiled"
NONE, SLOW = "none", f"none within {SECONDS} s"


@dataclass(frozen=True)
class Constant:
    """A named number."""

    module: str  # dotted, within the package
    name: str
    value: str  # as written
    comment: str
    told: bool  # whether it limits what the user may ask for

    @property
    def path(self) -> str:
        return f"{self.module}.{self.name}"

    @property
    def package(self) -> str:
        return self.module.rpartition(".")[0] or self.module

    @cached_property
    def kind(self) -> str:
        unit = re.match(r"\[([^\]]*)\]", self.comment)
        if not unit:
            return "layout"
        if re.search(FACT, self.comment):
            return "fact"
        shown = {self.package, self.module} & SHOWN
        if shown or unit[1] == "px" or re.search(r"\bcharacters\b", self.comment):
            return "picture"
        if self.told:
            return "limit"
        if unit[1] == "byte" or self.module == "model.cost" or re.search(CHEAP, self.comment):
            return "resource"
        if re.search(r"\bround(ing|ed|s)\b", self.comment) and re.fullmatch(r"[\d.]+e-(0?[6-9]|\d\d+)", self.value):
            return "rounding"
        return "tuning"


def has_number(node: ast.AST) -> bool:
    """Whether a literal number is in it; True and False are none."""
    return any(isinstance(each, ast.Constant) and type(each.value) in (int, float) for each in ast.walk(node))


def named(tree: ast.Module) -> list[tuple[ast.stmt, str, ast.expr]]:
    """The statement, name and value of each upper-case name of a module that a literal number goes into."""
    found = []
    for node in tree.body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        pairs = [(target, node.value)]
        if isinstance(target, ast.Tuple):
            values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value] * len(target.elts)
            pairs = list(zip(target.elts, values, strict=True))
        found += [(node, name.id, value) for name, value in pairs
                  if isinstance(name, ast.Name) and name.id.isupper() and has_number(value)]  # fmt: skip
    return found


def comment(lines: list[str], node: ast.stmt) -> str:
    """What is said of a constant: behind it, or on the lines above it up to the next statement."""
    behind = [line.partition("# ")[2] for line in lines[node.lineno - 1 : node.end_lineno] if "# " in line]
    above = []
    for line in reversed(lines[: node.lineno - 1]):
        if not line.startswith("#"):
            break
        above.insert(0, line.removeprefix("# "))
    return " ".join(above + [each for each in behind if each not in ("fmt: skip",)])


def limits_in(tree: ast.Module, module: str) -> set[str]:
    """The constants in messages and checks, and most of what there may be before an error is raised."""
    told = set()
    for node in ast.walk(tree):
        checked = isinstance(node, ast.Call) and re.match(r"_?check", ast.unparse(node.func))
        refused = isinstance(node, ast.If) and any(isinstance(each, ast.Raise) for each in node.body)
        if isinstance(node, ast.JoinedStr) or checked or refused:
            inside = list(ast.walk(node.test if isinstance(node, ast.If) else node))
            names = {f"{module}.{each.id}" for each in inside if isinstance(each, ast.Name)}
            names |= {ast.unparse(each) for each in inside if isinstance(each, ast.Attribute)}
            told |= {each for each in names if not refused or re.search(r"\.(MOST|LARGEST|LONGEST)_", each)}
    for node in ast.walk(tree):  # those of another module, which owns them
        if isinstance(node, ast.ImportFrom):
            owner = (node.module or "").rpartition(".")[2]
            told |= {f"{owner}.{each.name}" for each in node.names if f"{module}.{each.name}" in told}
    return told


def constants(package: Path = PACKAGE) -> list[Constant]:
    """All named numbers of the package."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}
    trees = {path: ast.parse(text) for path, text in texts.items()}
    limits = {name for path, tree in trees.items() for name in limits_in(tree, path.stem)}
    found = []
    for path, tree in trees.items():
        module, lines = ".".join(path.relative_to(package).with_suffix("").parts), texts[path].splitlines()
        for node, name, value in named(tree):
            told = f"{path.stem}.{name}" in limits
            found.append(Constant(module, name, ast.unparse(value), comment(lines, node), told))
    return found


def changed(node: ast.expr, factor: float) -> ast.expr:
    """An expression with all its numbers times a factor; a whole number stays one and at least 1."""
    if isinstance(node, ast.Tuple | ast.List):
        return type(node)([changed(each, factor) for each in node.elts], ast.Load())
    if isinstance(node, ast.Dict):
        return ast.Dict(node.keys, [changed(each, factor) for each in node.values])
    if isinstance(node, ast.Constant) and type(node.value) is int:
        return ast.Constant(max(round(node.value * factor), 1) if node.value else 0)
    text = f"(lambda x: type(x)(x * {factor!r}) if isinstance(x, (int, float)) else x * {factor!r})"
    return ast.Call(ast.parse(text, mode="eval").body, [node], []) if has_number(node) else node


def factors(constant: Constant) -> tuple[float, float]:
    """By what it is changed."""
    numbers = [abs(each.value) for each in ast.walk(ast.parse(constant.value))
               if isinstance(each, ast.Constant) and type(each.value) in (int, float) and each.value]  # fmt: skip
    near_one = all(0.05 <= each <= 50 for each in numbers)
    return (2.0, 0.5) if near_one else (10.0, 0.1)


class Changing(importlib.abc.MetaPathFinder, importlib.abc.SourceLoader):
    """Imports one module with one of its constants changed."""

    plain = False  # whether kernels run as plain Python

    def __init__(self, constant: Constant, factor: float) -> None:
        self.constant, self.factor = constant, factor
        self.kernels = constant.package == KERNELS
        self.full = f"fem_impact.{constant.module}"
        self.path = PACKAGE / (constant.module.replace(".", "/") + ".py")

    def find_spec(self, name, path=None, target=None):
        own = name.replace(".plain.", ".") == self.full  # kernels are read once more to run as plain Python
        return importlib.util.spec_from_file_location(name, self.path, loader=self) if own else None

    def get_filename(self, name):
        return str(self.path)

    def get_data(self, path):
        return Path(path).read_bytes()

    def get_code(self, name):
        return compile(ast.fix_missing_locations(self.tree()), str(self.path), "exec")

    def spare(self, folder: Path) -> None:
        """Put into a folder for compiled kernels those that do not call into the changed module."""
        home, texts = self.path.parent, {path.stem: path.read_text("utf-8") for path in self.path.parent.glob("*.py")}
        used = {name: set(re.findall(r"^from \.(\w+) import|^from \. import (\w+)", text, re.M))
                for name, text in texts.items()}  # fmt: skip
        calling, more = set(), {self.path.stem}
        while more - calling:
            calling |= more
            more = {name for name, pairs in used.items() if calling & {part for pair in pairs for part in pair}}
        target = folder / f"{home.name}_{hashlib.sha1(str(home).encode()).hexdigest()}"  # where numba looks
        target.mkdir()
        for path in home.glob("__pycache__/*.nb[ci]"):
            if path.name.partition(".")[0] not in calling:
                shutil.copy2(path, target)

    def tree(self) -> ast.Module:
        """The changed module."""
        tree = ast.parse(self.get_data(self.path))
        for node, own, value in named(tree):
            if own == self.constant.name:
                new = changed(value, self.factor)
                if isinstance(node.value, ast.Tuple) and value in node.value.elts and value is not node.value:
                    node.value.elts[node.value.elts.index(value)] = new
                else:
                    node.value = new
        return tree


class First:
    """A plugin of pytest that writes into a file which test runs, and at the end what failed first."""

    holder = NONE

    def __init__(self, path: Path) -> None:
        self.path = path

    def pytest_runtest_logstart(self, nodeid):
        self.path.write_text(f"{SLOW}, at {nodeid}")

    def pytest_runtest_logreport(self, report):
        if report.failed and self.holder == NONE:
            self.holder = report.nodeid

    def pytest_collectreport(self, report):
        if report.failed and self.holder == NONE:
            self.holder = report.nodeid


def tests_of(constant: Constant) -> list[str]:
    """The test files of its module and of others that use it; where there are none, those that name the module."""
    found, name = [], constant.module.rpartition(".")[2]
    if constant.package == KERNELS:
        texts = {str(path): path.read_text("utf-8") for path in sorted((ROOT / "tests").rglob("test_*.py"))}
        kernels = [path for path, text in texts.items() if re.search(rf"{KERNELS}(\.| import )", text)]
        own = rf"compiled(\.{name}\b| import .*\b{name}\b)"
        return sorted(kernels, key=lambda path: not re.search(own, texts[path]))
    using = rf"\b{name}\.{constant.name}\b|\b{name} import (\([^)]*|[^\n]*)\b{constant.name}\b"
    home = PACKAGE / (constant.module.replace(".", "/") + ".py")
    for path in [home, *sorted(PACKAGE.rglob("*.py"))]:
        own = ROOT / "tests" / path.parent.relative_to(PACKAGE).as_posix().removeprefix("_") / f"test_{path.name}"
        if own.exists() and str(own) not in found and (path == home or re.search(using, path.read_text("utf-8"))):
            found.append(str(own))
    folder = ROOT / "tests" / constant.package.removeprefix("_").replace(".", "/")
    naming = [path for path in sorted(folder.glob("test_*.py")) if re.search(rf"\b{name}\b", path.read_text("utf-8"))]
    return found or [str(path) for path in naming]


def first_failure(tests: list[str], change: Changing | None, share: float = 1.0) -> str:
    """The first test that fails with a constant changed, found in a process of its own.

    If none does in a `share` of the time there is, it says which test ran last.
    """
    import numba
    import pytest
    import warming

    kernels = change is not None and change.kernels and not change.plain
    seconds = int(share * (KERNEL_SECONDS if kernels else SECONDS))
    folder = tempfile.TemporaryDirectory()
    told = Path(folder.name) / "told"
    child = os.fork()
    if not child:
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        warming.compile_all = lambda _: None  # kernels are on disk, or compiled as needed
        if change:
            sys.meta_path.insert(0, change)
        if change and change.plain:
            os.environ["NUMBA_DISABLE_JIT"], numba.config.DISABLE_JIT = "1", 1
        if kernels:
            numba.config.CACHE_DIR = folder.name
            change.spare(Path(folder.name))
        first = First(told)
        status = pytest.main(["-x", "-n", "0", "-q", "-p", "no:cacheprovider", "--no-header", *tests], plugins=[first])
        if status not in (0, 1, 2, 5) and first.holder == NONE:
            first.holder = "import"
        told.write_text(first.holder)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    said = told.read_text() if told.exists() else SLOW
    folder.cleanup()
    return said if status in (0, signal.SIGXCPU, signal.SIGKILL) else "crash"


def recorded() -> dict[str, dict[str, str]]:
    """What was found before, by constant."""
    if not HOLDERS.exists():
        return {}
    with open(HOLDERS, newline="", encoding="utf-8") as file:
        return {row["constant"]: row for row in csv.DictReader(file)}


def hold(asked: list[Constant]) -> None:
    """Change constants one by one and record which test fails first."""
    import matplotlib.pyplot  # noqa: F401
    import numba  # noqa: F401
    import scipy.optimize  # noqa: F401
    import skfem  # noqa: F401
    import xarray  # noqa: F401

    os.environ["OMP_NUM_THREADS"] = "1"
    sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
    os.chdir(ROOT)
    sound: dict[str, str] = {}
    for constant in asked:
        tests = tests_of(constant)
        if (key := " ".join(tests)) not in sound:
            sound[key] = first_failure(tests, None) if tests else NONE
        if sound[key] != NONE:
            print(f"{constant.path} is left out: unchanged, {sound[key]}", flush=True)
            continue
        holder, tried = NONE, []
        for factor in factors(constant) if tests else ():
            tried.append(f"{factor:g}")
            holder = first_failure(tests, Changing(constant, factor))
            if not holder.startswith(NONE):
                break
        rows = recorded()
        rows[constant.path] = dict(zip(COLUMNS, (constant.path, constant.value, " ".join(tried), holder), strict=True))
        present = {each.path for each in constants()}
        with open(HOLDERS, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows[path] for path in sorted(rows) if path in present)
        print(f"{constant.path} = {constant.value}: {holder}", flush=True)


def counts(found: list[Constant]) -> None:
    """Print how many there are of each kind in each package."""
    cells = Counter((each.package, each.kind) for each in found)
    packages = sorted({each.package for each in found})
    print(f"{'':16}" + "".join(f"{kind:>10}" for kind in KINDS) + f"{'all':>10}")
    for package in [*packages, ""]:
        row = [sum(n for key, n in cells.items() if key[1] == kind and package in ("", key[0])) for kind in KINDS]
        print(f"{package or 'all':16}" + "".join(f"{n:10}" for n in row) + f"{sum(row):10}")
    rows = recorded()
    examined = [each for each in found if each.path in rows and rows[each.path]["value"] == each.value]
    free = [each for each in examined if rows[each.path]["holder"].startswith(NONE)]
    print(f"{len(examined)} were changed: a test failed for {len(examined) - len(free)}, none for {len(free)}")


def main() -> None:
    """Print counts or a list, or change constants."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--list", choices=KINDS, help="the constants of this kind")
    parser.add_argument("--hold", nargs="+", metavar="NAME", help="packages, modules or constants to change")
    parser.add_argument("--again", action="store_true", help="also those whose value has not changed since")
    options = parser.parse_args()
    found, rows = constants(), recorded()
    if options.list:
        for each in found:
            if each.kind == options.list:
                row = rows.get(each.path, {"value": None})
                held = f"\n    {row['holder']}" if row["value"] == each.value else ""
                print(f"{each.path} = {each.value}  # {each.comment}{held}")
    elif options.hold:
        asked = [each for name in options.hold for each in found
                 if f"{each.path}.".startswith(f"{name}.") and each.kind in ("tuning", "rounding")
                 and (options.again or rows.get(each.path, {"value": None})["value"] != each.value)]  # fmt: skip
        hold(asked)
    else:
        counts(found)


if __name__ == "__main__":
    main()
