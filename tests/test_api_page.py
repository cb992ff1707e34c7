"""The page of public names is the one that the docstrings give, and it leaves out none of them."""

import re
from pathlib import Path

import api

import fem_impact as fi

ROOT = Path(__file__).parents[1]


def test_the_page_has_every_public_name_once():
    heads = re.findall(r"^##+ fi\.([\w.]+)$", api.page(), flags=re.MULTILINE)
    assert len(heads) == len(set(heads)) and set(fi.__all__) - {"__version__"} <= set(heads)
    assert {"mesh.rectangle", "figures.spread", "export.write_vtk", "hammers.choose"} <= set(heads)


def test_every_name_on_the_page_says_what_it_is():
    for head, text in re.findall(
        r"^### (fi\.\S+)\n\n`[^`]*`\n\n```text\n(.*?)```", api.page(), re.MULTILINE | re.DOTALL
    ):
        assert len(text.split()) >= 3, head


def test_the_page_does_not_depend_on_the_run():
    """No addresses of objects, no folders of this machine."""
    assert not re.search(rf"0x[0-9a-f]{{6}}|{re.escape(str(ROOT))}|/home/|/tmp/", api.page())
