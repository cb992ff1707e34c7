"""The list of named numbers: each is told, and what is written of the tests that hold them is true of this tree."""

import ast
from functools import cache

import constants as study
import pytest
from scenes import ROOT

KNOWN = study.constants()


def test_every_number_is_told():
    silent = [each.path for each in KNOWN if each.kind != "layout" and len(each.comment.split()) < 3]
    assert not silent, "say in a comment what they are and why they are so large"


@cache
def held_in(file):
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def test_the_tests_that_hold_constants_exist():
    present = {each.path for each in KNOWN}
    for path, row in study.recorded().items():
        assert path in present, f"{path} is gone: remove its line from studies/verification/constants.csv"
        if "::" in row["holder"]:
            file, name = row["holder"].split("::")[:2]
            again = f"python studies/verification/constants.py --hold {path} --again"
            assert name.partition("[")[0] in held_in(file), again


@pytest.mark.parametrize(
    ("text", "factor", "value"),
    [("0.5", 10.0, 5.0), ("3", 0.1, 1), ("(1.0, 2)", 2.0, (2.0, 4)), ("{'a': 1.5}", 2.0, {"a": 3.0}),
     ("2.0**0.5", 2.0, 8.0**0.5)],
)  # fmt: skip
def test_a_constant_is_changed_by_a_factor(text, factor, value):
    new = ast.fix_missing_locations(ast.Expression(study.changed(ast.parse(text, mode="eval").body, factor)))
    assert eval(compile(new, "here", "eval")) == pytest.approx(value, rel=1e-15)


def test_kinds_follow_from_comments():
    def kind(comment, value="0.3", module="fe.here", told=False):
        return study.Constant(module, "HERE", value, comment, told).kind

    assert kind("rows of a table", "5") == "layout"
    assert kind("[-] fact: of a circle") == kind("[-] shear coefficient (Cowper 1966)") == "fact"
    assert kind("[-] radius", module="show.canvas") == kind("[px] width") == "picture"
    assert kind("[-] largest", told=True) == "limit"
    assert kind("[-] at a time, to limit memory") == kind("[s] a step", module="model.cost") == "resource"
    assert kind("[-] a smaller one is rounding", "1e-12") == "rounding"
    assert kind("[-] a smaller one is rounding") == kind("[-] factor on estimates") == "tuning"
