"""The import order is part of the design: a module may import from lower floors only."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "fem_impact"
FLOORS = [
    {"_check", "_files", "_kernels", "_batch", "svg"},
    {"_apart", "farm"},
    {"_meshread"},
    {"outline", "curves", "boundary", "meshfile"},
    {"triangulation", "cad"},
    {"mesh", "section", "contact", "elements", "beam_elements", "supports", "eigen"},
    {"splitting", "attached"},
    {"corners"},
    {"assembly"},
    {"residual"},
    {"pointload", "spectrum", "uff"},
    {"modal"},
    {"analytic"},
    {"striker", "spectra"},
    {"response"},
    {"drawing"},
    {"accuracy", "threshold", "figures", "sound"},
    {"export", "idealisation", "pictures", "plans"},
    {"integrator"},
    {"planner", "tables"},
    {"scene", "charts", "bounces"},
    {"prose"},
    {"doctor", "report", "maps"},
    {"hammers"},
    {"atlas"},
    {"bench"},
    {"desk"},
    {"explore"},
    {"cli"},
    {"__main__"},
]
FLOOR = {name: level for level, names in enumerate(FLOORS) for name in names}
OWNERS = {"numba": {"_kernels", "_batch"}, "skfem": {"elements", "beam_elements"}, "matplotlib": {"figures", "charts"}}


def imports(path):
    """Return (own modules, outside packages) imported anywhere in a file, as two sets of names."""
    own, outside = set(), set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            own |= {node.module.split(".")[0]} if node.module else {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom):
            outside.add(node.module.split(".")[0])
        elif isinstance(node, ast.Import):
            outside |= {a.name.split(".")[0] for a in node.names}
    return own, outside


@pytest.mark.parametrize("module", sorted(p.stem for p in PACKAGE.glob("*.py") if p.stem != "__init__"))
def test_module_imports_lower_floors_only(module):
    own, outside = imports(PACKAGE / f"{module}.py")
    assert module in FLOOR, f"{module}.py has no floor: add it to FLOORS or fold it into a module"
    sideways = {name for name in own if FLOOR[name] >= FLOOR[module]}
    assert not sideways, f"{module}.py imports {sorted(sideways)} from its own floor or above"
    trespass = {pkg for pkg in outside if module not in OWNERS.get(pkg, {module})}
    assert not trespass, f"{module}.py imports {sorted(trespass)}, which belongs to other modules"
