"""The examples in the docstrings of public functions print what they say."""

import doctest
import inspect
from pathlib import Path

import numpy as np
import pytest
from signatures import everything

import fem_impact as fi

STUDIES = Path(__file__).parents[1] / "studies"
EXTRAS = {"export.write_uff": "pyuff"}


SHOWN = {name: item.__doc__ for name, item in everything().items() if ">>>" in (item.__doc__ or "")}


@pytest.mark.parametrize("name", SHOWN)
def test_an_example_prints_what_it_says(name, tmp_path, monkeypatch):
    if name in EXTRAS:
        pytest.importorskip(EXTRAS[name])
    (tmp_path / "studies").symlink_to(STUDIES)
    monkeypatch.chdir(tmp_path)
    example = doctest.DocTestParser().get_doctest(SHOWN[name], {"fi": fi, "np": np}, name, None, None)
    told: list[str] = []
    failed, tried = doctest.DocTestRunner().run(example, out=told.append)
    assert tried > 0 and not failed, "".join(told)


def test_every_function_of_the_first_rank_has_one():
    """All of `fi.name`, every mesh, body, striker and contact there is to make."""
    kinds = ("Striker.", "Contact.", "Beam.", "Modes.")
    constructors = {name for name, item in everything().items() if name.startswith(kinds) and inspect.ismethod(item)}
    made = {f"mesh.{name}" for name in ("rectangle", "disk", "polygon", "line", "outline", "load", "save")}
    made |= {f"analytic.{name}" for name in ("rectangle", "beam", "disk")}
    functions = {name for name in fi.__all__ if inspect.isfunction(getattr(fi, name))}
    assert constructors | made | functions <= set(SHOWN) | {"Modes.from_uff"}  # that one in export.write_uff
