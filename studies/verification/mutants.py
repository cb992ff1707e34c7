"""Single wrong lines of numerics and kernels: does a test of their module notice?

    python studies/verification/mutants.py                    what was found so far
    python studies/verification/mutants.py --run 200          examine so many random lines that are not yet known
    python studies/verification/mutants.py --run 40 fe taps   of these packages or modules
    python studies/verification/mutants.py --again            once more those that survived or whose test is gone

Each mutant changes one expression of one line: a sign, an operator, a comparison, a number, `and` for `or`, `min` for
`max`. They are drawn with a fixed seed from all functions of the packages in NUMERICS, without messages and logs. The
tests run are fast ones: those of the module, those that name it, and those of the modules that import it, in this
order. Kernels are run as plain Python by those of their tests that are quick there and call the changed function, and
are compiled only if none of these fails. `mutants.csv` keeps

holder   the first test that failed when the mutant was first examined, or since that test is gone: it fails with the
         mutant, and not without. A test that does not end is a failure, too, if without the mutant it ends in a quarter
         of the time. "none of the quick": a kernel that was not compiled, as a test was written for it at once, or as
         nothing can notice it
since    the test, written since, that notices what no test noticed at first; or that the line is gone, as
         nothing needed it or another has its place
reason   why a mutant that no test can notice changes no result: written by hand
"""

import argparse
import ast
import copy
import csv
import gc
import hashlib
import json
import os
import re
import signal
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from constants import KERNELS, NONE, PACKAGE, ROOT, SLOW, Changing, Constant, first_failure

FOUND = Path(__file__).with_suffix(".csv")
NUMERICS = ("fe", "modes", "impact", "model", "sweeps", "taps", "designs")
SEED = 27
FILES = 9  # [-] test files run for a mutant at most, to limit the work
# for any kernel
BLOWS = "kernels", "contact_cases", "collision", "history", "lossy_contacts", "flight", "gradient"
QUICK = 0.7  # [s] of CPU for a test of kernels as plain Python: the compiler takes twenty times as long
MOST = 150  # [-] such tests run for a mutant, the quickest first, to limit the work
REACH = ROOT / "out" / "kernel_tests.json"  # what `quick` found; remove it where tests have changed
GONE = "the line is gone"
ARITHMETIC = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult}
COMPARED = {ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
CALLED = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin"}
SILENT = r"(LOG|warnings|progress)\."  # calls that tell people something


def swapped(node: ast.AST) -> ast.AST | None:
    """A wrong copy of a node, if there is one."""
    node = copy.copy(node)
    if isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC:
        node.op = ARITHMETIC[type(node.op)]()
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARED:
        node.ops = [COMPARED[type(node.ops[0])](), *node.ops[1:]]
    elif isinstance(node, ast.BoolOp):
        node.op = ast.And() if isinstance(node.op, ast.Or) else ast.Or()
    elif isinstance(node, ast.Constant) and type(node.value) is int:
        node.value += 1
    elif isinstance(node, ast.Constant) and type(node.value) is float:
        node.value = 1.01 * node.value or 0.01
    elif isinstance(node, ast.Name) and node.id in CALLED:
        node.id = CALLED[node.id]
    elif isinstance(node, ast.Attribute) and node.attr in CALLED:
        node.attr = CALLED[node.attr]
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node.op = ast.UAdd()
    else:
        return None
    return node


def silent(node: ast.AST) -> bool:
    """Whether a part of a function changes no result: messages, errors, annotations."""
    told = isinstance(node, ast.Call) and re.match(SILENT, ast.unparse(node.func))
    return bool(told) or isinstance(node, ast.JoinedStr | ast.Raise | ast.AnnAssign)


def places(tree: ast.Module) -> list[tuple[str, ast.AST]]:
    """All nodes in functions that can be changed, each with the name of its function."""
    found: dict[int, tuple[str, ast.AST]] = {}
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            hints = [each.annotation for each in ast.walk(function) if isinstance(each, ast.arg) and each.annotation]
            out = [each for each in ast.walk(function) if silent(each)] + hints + function.decorator_list
            left_out = {id(part) for each in out for part in ast.walk(each)}
            inside = [each for part in function.body for each in ast.walk(part) if id(each) not in left_out]
            found |= {id(each): (function.name, each) for each in inside}
    return [each for each in found.values() if hasattr(each[1], "lineno")]


@dataclass(frozen=True)
class Place:
    """What is changed, told so that edits elsewhere do not matter."""

    module: str  # dotted, within the package
    function: str
    line: str  # its text
    column: str  # in the line, counted from its first letter
    change: str

    @property
    def order(self) -> str:
        """Where it comes in the random order."""
        return hashlib.sha256(f"{SEED} {self}".encode()).hexdigest()


def changes(module: str, tree: ast.Module, lines: list[str]) -> Iterator[tuple[Place, ast.AST, ast.AST]]:
    """Each place of a module with its node and what takes the place of it."""
    for function, node in places(tree):
        if (new := swapped(node)) is not None:
            line = lines[node.lineno - 1]
            column = node.col_offset - len(line) + len(line.lstrip())
            change = f"{ast.unparse(node)} -> {ast.unparse(new)}"
            yield Place(module, function, line.strip(), str(column), change), node, new


class Mutant(Changing):
    """Imports one module with one expression changed."""

    def __init__(self, place: Place) -> None:
        super().__init__(Constant(place.module, "", "", "", False), 1.0)
        self.place = place

    def tree(self) -> ast.Module:
        """The changed module."""
        text = self.get_data(self.path).decode()
        tree = ast.parse(text)
        found = [(node, new) for place, node, new in changes(self.place.module, tree, text.splitlines())
                 if place == self.place]  # fmt: skip
        node, new = found[0]
        node.__class__, node.__dict__ = type(new), new.__dict__
        return tree


def drawn(asked: list[str]) -> list[Place]:
    """All places of some packages or modules, in random order."""
    found = set()
    for path in sorted(PACKAGE.rglob("*.py")):
        module = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        if any(f"{module}.".startswith(f"{name}.") for name in asked):
            text = path.read_text("utf-8")
            found |= {place for place, _, _ in changes(module, ast.parse(text), text.splitlines())}
    return sorted(found, key=lambda place: place.order)


FIELDS = (*Place.__dataclass_fields__, "holder", "since", "reason")


def recorded() -> dict[Place, dict[str, str]]:
    """What was found before."""
    if not FOUND.exists():
        return {}
    with open(FOUND, newline="", encoding="utf-8") as file:
        return {Place(*list(row.values())[:5]): row for row in csv.DictReader(file)}


def write(rows: dict[Place, dict[str, str]]) -> None:
    """Keep what was found."""
    with open(FOUND, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows.values())


def tests(module: str) -> list[str]:
    """The test files of a module, then those that name it, then those of the modules that import it."""
    package, _, name = module.rpartition(".")
    texts = {path: path.read_text("utf-8") for path in sorted((ROOT / "tests").rglob("test_*.py"))}
    imported = rf"import (\([^)]*|[^\n]*)\b{name}\b|\.{name} import"
    naming = [path for path, text in texts.items() if re.search(imported, text)]
    if package == KERNELS:
        known = {path.stem: path for path in texts}
        blows = [known[f"test_{each}"] for each in BLOWS]
        near = [path for path in [*naming, *blows] if path.stem not in ("test_build", "test_environment")]
    else:
        users = [path.stem for path in sorted(PACKAGE.rglob("*.py")) if re.search(imported, path.read_text("utf-8"))]
        near = [*naming, *(path for path in texts if path.stem.removeprefix("test_") in users)]
        near.sort(key=lambda path: path.parent.name != package)
    own = [path for path in texts if path.parent.name == package and path.stem == f"test_{name}"]
    return [str(path) for path in dict.fromkeys([*own, *near])][:FILES]


def quick() -> dict[str, tuple[float, list[str]]]:
    """Tests of kernels that pass in QUICK seconds where nothing is compiled: their time, and what kernels they call."""
    if REACH.exists():
        return json.loads(REACH.read_text("utf-8"))
    import numba
    import pytest
    import warming

    kernels, found = PACKAGE / KERNELS.replace(".", "/"), {}
    files = dict.fromkeys(test for path in sorted(kernels.glob("*.py")) for test in tests(f"{KERNELS}.{path.stem}"))

    class Watch:
        """A plugin of pytest that ends long tests and notes what is called."""

        @pytest.hookimpl(hookwrapper=True)
        def pytest_runtest_protocol(self, item):
            called, start = set(), time.process_time()

            def note(frame, event, _):
                code = frame.f_code
                if event == "call" and code.co_filename.startswith(str(kernels)):
                    called.add(f"{Path(code.co_filename).stem}.{code.co_name}")

            sys.setprofile(note)
            yield
            sys.setprofile(None)
            found[item.nodeid] = time.process_time() - start, sorted(called)

        @pytest.hookimpl(hookwrapper=True)
        def pytest_runtest_call(self):
            signal.signal(signal.SIGPROF, lambda *_: pytest.skip("it takes long"))
            signal.setitimer(signal.ITIMER_PROF, QUICK)
            yield
            signal.setitimer(signal.ITIMER_PROF, 0.0)

        def pytest_runtest_logreport(self, report):
            if report.outcome != "passed":
                failed.add(report.nodeid)

    failed: set[str] = set()
    if not (child := os.fork()):
        warming.compile_all = lambda _: None
        os.environ["NUMBA_DISABLE_JIT"], numba.config.DISABLE_JIT = "1", 1
        pytest.main(["-n", "0", "-q", "-p", "no:cacheprovider", "--tb=no", *files], plugins=[Watch()])
        REACH.parent.mkdir(exist_ok=True)
        REACH.write_text(json.dumps({test: told for test, told in found.items() if test not in failed}), "utf-8")
        os._exit(0)
    os.waitpid(child, 0)
    return json.loads(REACH.read_text("utf-8"))


def uncompiled(place: Place) -> str:
    """The first quick test that fails with a kernel changed and nothing compiled."""
    mutant, name = Mutant(place), f"{place.module.rpartition('.')[2]}.{place.function}"
    mutant.plain = True
    asked = sorted((seconds, test) for test, (seconds, called) in quick().items() if name in called)
    found = first_failure([test for _, test in asked[:MOST]], mutant) if asked else NONE
    if found.startswith(SLOW):
        test = found.removeprefix(SLOW).removeprefix(", at ")
        return test if test and first_failure([test], mutant).startswith(SLOW) else NONE
    return found


def holder(place: Place, sound: dict[str, bool]) -> str:
    """The first test that notices a mutant and passes without it."""
    if place.module.startswith(KERNELS) and (found := uncompiled(place)) != NONE:
        return found
    mutant, asked = Mutant(place), tests(place.module)
    found = first_failure(asked, mutant) if asked else "none: no test"
    if found.startswith(SLOW):  # does it hang, or are the tests long?
        test = found.removeprefix(SLOW).removeprefix(", at ")
        if test and first_failure([test], None, 0.25) == NONE and first_failure([test], mutant).startswith(SLOW):
            return test
        return SLOW
    elif "::" in found:
        if found not in sound:
            sound[found] = first_failure([found], None) == NONE
        if not sound[found]:
            return f"{NONE}: {found} fails without it, too"
    return found


def run(number: int, asked: list[str], again: bool) -> None:
    """Examine mutants that are not yet known, one by one; or those that survived or whose test is gone, once more."""
    os.environ["OMP_NUM_THREADS"] = "1"
    os.nice(max(0, 10 - os.nice(0)))
    sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
    os.chdir(ROOT)
    import fem_impact  # noqa: F401  what it imports from elsewhere is shared by all that follows

    for name in [name for name in sys.modules if name.partition(".")[0] == "fem_impact"]:
        del sys.modules[name]
    gc.freeze()
    sound: dict[str, bool] = {}
    known, present = recorded(), drawn(asked)
    if again:
        chosen = [place for place, row in known.items() if alive(row) or orphaned(row)]
    else:
        chosen = [place for place in present if place not in known][:number]
    chosen.sort(key=lambda place: place.module.startswith(KERNELS))  # which take longest
    for place in chosen:
        found = holder(place, sound) if place in present else GONE
        rows = recorded()  # it may have been edited meanwhile
        row = rows.setdefault(place, dict.fromkeys(FIELDS, "") | vars(place))
        survived = row["holder"].startswith(NONE)
        row["since" if found == GONE or survived else "holder"] = "" if survived and found.startswith(NONE) else found
        write(rows)
        print(f"{place.module}: {place.line}: {place.change}: {found}", flush=True)


def alive(row: dict[str, str]) -> bool:
    """Whether no test notices a mutant that changes results."""
    return row["holder"].startswith(NONE) and not row["since"] and not row["reason"]


def orphaned(row: dict[str, str]) -> bool:
    """Whether the test that noticed a mutant is no longer there."""
    path, _, test = (row["since"] or row["holder"]).partition("::")
    if not test:
        return False
    name = rf"\bdef {test.partition('[')[0]}\("
    return not (ROOT / path).exists() or not re.search(name, (ROOT / path).read_text("utf-8"))


def main() -> None:
    """Print what was found, or examine more."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", type=int, default=0, metavar="N", help="examine so many more")
    parser.add_argument("--again", action="store_true", help="examine those that survived once more")
    parser.add_argument("names", nargs="*", default=NUMERICS, help="packages or modules")
    options = parser.parse_args()
    if options.run or options.again:
        run(options.run, options.names, options.again)
    rows = list(recorded().values())
    for row in rows:
        if alive(row):
            print(f"survives: {row['module']}.{row['function']}: {row['line']}: {row['change']}")
    at_once = sum(not row["holder"].startswith(NONE) and row["since"] != GONE for row in rows)
    gone = sum(row["since"] == GONE for row in rows)
    since = sum(bool(row["since"]) for row in rows) - gone
    equal = sum(bool(row["reason"]) for row in rows)
    left = sum(alive(row) for row in rows)
    print(f"{len(rows)} wrong lines were examined; {FOUND.name} tells each.")
    print(f"Tests noticed {at_once} at once and {since} since. {gone} lines are gone since.")
    print(f"{equal} change no result; {left} survive.")


if __name__ == "__main__":
    main()
