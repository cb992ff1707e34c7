"""What type checkers of users see: the names, and an annotation at every parameter of them."""

import ast
import inspect
from pathlib import Path

import pytest
from signatures import public

import fem_impact as fi

HOME = Path(fi.__file__).parent


def test_every_name_of_the_stub_is_there_and_known_to_type_checkers():
    for name in fi.__all__:
        assert getattr(fi, name) is not None
    for node in ast.parse((HOME / "__init__.pyi").read_text()).body:  # "as" makes an import a name of ours
        assert not isinstance(node, ast.ImportFrom) or all(each.asname == each.name for each in node.names)
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
