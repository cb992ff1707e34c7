"""What type checkers of users see: the names, and an annotation at every parameter of them."""

import ast
import inspect
from pathlib import Path

import pytest
from signatures import public

import fem_impact as fi

HOME = Path(fi.__file__).parent


def test_type_checkers_see_the_names_that_are_there():
    tree = ast.parse((HOME / "__init__.py").read_text())
    (block,) = (node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    seen = {}
    for node in block.body:
        if isinstance(node, ast.ImportFrom):
            seen |= {alias.asname: ".".join(filter(None, (node.module, alias.name))) for alias in node.names}
    names = {name: f"{module}.{name}" for name, module in fi._HOME.items()} | fi._MODULES
    assert seen == names
    assert (HOME / "py.typed").is_file()


@pytest.mark.parametrize("name", sorted(public()))
def test_every_parameter_of_a_public_name_is_annotated(name):
    item = public()[name]
    signature = inspect.signature(item.__init__ if inspect.isclass(item) else item)
    bare = [
        each.name for each in signature.parameters.values()
        if each.annotation is inspect.Parameter.empty and each.name not in ("self", "cls")
    ]  # fmt: skip
    assert not bare
    assert inspect.isclass(item) or signature.return_annotation is not inspect.Signature.empty
