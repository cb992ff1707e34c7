"""How Sphinx builds the site: one look for pages, notebooks, formulas and names, and nothing from a network."""

import re
import sys
import tomllib
from pathlib import Path

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
ABOUT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
sys.path[:0] = [str(ROOT)]

project, author, release = "fem_impact", ABOUT["authors"][0]["name"], ABOUT["version"]
copyright = author
root_doc = "README"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_dmath_double_inline = True
myst_heading_anchors = 4
nb_execution_mode = "off"  # notebooks are shown as they are kept; a test runs them anew
napoleon_google_docstring = False
napoleon_use_param = napoleon_use_rtype = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings tell types, shapes and units
autodoc_preserve_defaults = False
toc_object_entries = False
highlight_language = "none"
html_theme = "furo"
html_title = f"fem_impact {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = html_show_sourcelink = html_show_sphinx = False
html_show_search_summary = False  # they are fetched, which a browser refuses to pages from a disk
pygments_style, pygments_dark_style = "a11y-high-contrast-light", "github-dark"
html_theme_options = {"navigation_with_keys": True}


SAME = {r"\lt": "<", r"\gt": ">", r"\dots": r"\ldots"}  # commands of other dialects of LaTeX


def formula(translator, node, *, block):
    """A formula as MathML, which browsers draw without any script."""
    text = re.sub(r"\\[a-z]+", lambda word: SAME.get(word[0], word[0]), node.astext())
    try:
        drawn = tex2mathml(text, as_block=block)
    except MathError as problem:
        logging.getLogger(__name__).warning("not a formula: %s", problem, location=node)
        drawn = f"<code>{translator.encode(node.astext())}</code>"
    translator.body.append(f'<div class="formula">{drawn}</div>' if block else drawn)
    raise nodes.SkipNode


def setup(app):
    """The renderer of formulas."""
    inline = (lambda translator, node: formula(translator, node, block=False), None)
    block = (lambda translator, node: formula(translator, node, block=True), None)
    app.add_html_math_renderer("mathml", inline, block)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
