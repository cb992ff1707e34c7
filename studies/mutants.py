"""Single wrong lines of numerics and kernels: does a test of their module notice?

    python studies/mutants.py                    what was found so far
    python studies/mutants.py --run 200          examine so many random lines, those that are known left out
    python studies/mutants.py --run 40 fe taps   of these packages or modules

Each mutant changes one expression of one line: a sign, an operator, a comparison, a number, `and` for `or`, `min` for
`max`. The lines are drawn with a fixed seed from all functions of the packages in NUMERICS. The tests run are the fast
ones that `constants.py` finds for the module; `mutants.csv` keeps the line, what was changed and the first test that
failed. Some survivors change nothing that a result shows (the first guess of a search, say).
"""

import argparse
import ast
import csv
import os
import random
import sys
from pathlib import Path

from constants import NONE, PACKAGE, ROOT, Changing, Constant, first_failure, tests_of

FOUND = Path(__file__).with_suffix(".csv")
FIELDS = ("mutant", "line", "change", "holder")
NUMERICS = ("fe", "modes", "impact", "model", "sweeps", "taps", "designs")
SEED = 27
ARITHMETIC = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult}
COMPARED = {ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
CALLED = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin"}


def swapped(node: ast.AST) -> bool:
    """Change a node in place, if it can be."""
    if isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC:
        node.op = ARITHMETIC[type(node.op)]()
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARED:
        node.ops[0] = COMPARED[type(node.ops[0])]()
    elif isinstance(node, ast.BoolOp):
        node.op = ast.And() if isinstance(node.op, ast.Or) else ast.Or()
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        node.value = (
            node.value + 1 if type(node.value) is int else 1.01 * node.value + (0.01 if not node.value else 0.0)
        )
    elif isinstance(node, ast.Name) and node.id in CALLED:
        node.id = CALLED[node.id]
    elif isinstance(node, ast.Attribute) and node.attr in CALLED:
        node.attr = CALLED[node.attr]
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node.op = ast.UAdd()
    else:
        return False
    return True


def places(tree: ast.Module) -> list[ast.AST]:
    """All nodes in functions that can be changed, always in the same order; not those of messages and annotations."""
    found = []
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            parts = list(ast.walk(function))
            silent = [each for each in parts if isinstance(each, ast.JoinedStr | ast.Raise | ast.AnnAssign)]
            hints = [each.annotation for each in parts if isinstance(each, ast.arg) and each.annotation]
            out = {id(part) for each in [*silent, *hints, *function.decorator_list] for part in ast.walk(each)}
            found += [each for part in function.body for each in ast.walk(part) if id(each) not in out]
    unique = {id(each): each for each in found}
    return [each for each in unique.values() if hasattr(each, "lineno") and type(each) in KINDS]


KINDS = (ast.BinOp, ast.Compare, ast.BoolOp, ast.Constant, ast.Name, ast.Attribute, ast.UnaryOp)


class Mutant(Changing):
    """Imports one module with one expression changed."""

    def __init__(self, module: str, index: int) -> None:
        super().__init__(Constant(module, "", "", "", False), 1.0)
        self.module, self.index = module, index

    def tree(self) -> ast.Module:
        """The changed module; `line` and `change` say what was done."""
        tree = ast.parse(self.get_data(self.path))
        node = places(tree)[self.index]
        self.line, before = node.lineno, ast.unparse(node)
        self.fits = swapped(node)
        self.change = f"{before} -> {ast.unparse(node)}"
        return tree


def drawn(asked: list[str]) -> list[Mutant]:
    """All mutants of some packages or modules, in random order."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        module = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        if any(f"{module}.".startswith(f"{name}.") for name in asked):
            found += [Mutant(module, i) for i in range(len(places(ast.parse(path.read_text("utf-8")))))]
    random.Random(SEED).shuffle(found)
    return found


def recorded() -> list[dict[str, str]]:
    """What was found before."""
    if not FOUND.exists():
        return []
    with open(FOUND, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def run(number: int, asked: list[str]) -> None:
    """Examine mutants that are not yet known, one by one."""
    os.environ["OMP_NUM_THREADS"] = "1"
    sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
    os.chdir(ROOT)
    rows, sound = recorded(), {}
    known = {(row["mutant"], row["change"]) for row in rows}
    for mutant in drawn(asked):
        if number <= 0:
            break
        mutant.tree()
        name = f"{mutant.module}:{mutant.index}"
        if not mutant.fits or (name, mutant.change) in known:
            continue
        tests = tests_of(mutant.constant)
        if (key := " ".join(tests)) not in sound:
            sound[key] = first_failure(tests, None) if tests else "no test"
        if sound[key] != NONE:
            print(f"{name} is left out: unchanged, {sound[key]}", flush=True)
            continue
        number -= 1
        holder = first_failure(tests, mutant)
        rows.append(dict(zip(FIELDS, (name, str(mutant.line), mutant.change, holder), strict=True)))
        with open(FOUND, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        print(f"{mutant.module}, line {mutant.line}: {mutant.change}: {holder}", flush=True)


def main() -> None:
    """Print what was found, or examine more."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", type=int, default=0, metavar="N", help="examine so many more")
    parser.add_argument("names", nargs="*", default=NUMERICS, help="packages or modules")
    options = parser.parse_args()
    run(options.run, options.names)
    rows = recorded()
    alive = [row for row in rows if row["holder"].startswith(NONE)]
    for row in alive:
        print(f"survives: {row['mutant']}, line {row['line']}: {row['change']}")
    print(f"{len(rows)} wrong lines: a test noticed {len(rows) - len(alive)}")


if __name__ == "__main__":
    main()
