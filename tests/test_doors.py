"""The doors of the program run as their page shows them, and each number lies as near to its reference as it says."""

import re
from pathlib import Path

import numpy as np
import own_estimator
import own_law
import own_modes
import own_striker
import own_theory
import pytest
from comparing import refusing
from scenes import ROOT

import fem_impact as fi
from fem_impact.fe import euler
from fem_impact.fe.theory import Term

PAGE = (ROOT / "studies" / "site" / "doors.md").read_text(encoding="utf-8")
DOORS = own_law, own_striker, own_theory, own_modes, own_estimator
ROUNDING = 1e-13  # [-] as `fi.verify` allows: what double precision leaves of a closed form


@pytest.mark.parametrize("door", DOORS, ids=[door.__name__ for door in DOORS])
def test_a_door_leads_to_a_number_within_its_error(door, capsys):
    found, known, stated = door.main()
    scale = 1.0 if door is own_estimator else abs(known)  # the error of a restitution is absolute
    assert 0.0 < stated < 0.02 and abs(found - known) <= (stated + ROUNDING) * scale
    said = capsys.readouterr().out
    assert re.sub(r"\d+e-\d+", "", said) in re.sub(r"\d+e-\d+", "", PAGE), said  # the errors are estimates


def test_each_door_is_short_and_on_the_page():
    names = re.findall(r"tutorials/(own_\w+)\.py", PAGE)
    assert set(names) == {door.__name__ for door in DOORS} == {path.stem for path in ROOT.glob("studies/*/own_*.py")}
    for door in DOORS:
        code = re.sub(r'"""[\s\S]*?"""', "", Path(door.__file__).read_text(encoding="utf-8"))
        assert sum(bool(line.strip()) for line in code.splitlines()) <= 40


def test_what_the_doors_show_is_not_what_is_built_in():
    assert own_estimator.struck(own_estimator.bar("clamped")).error.idealisation == 0.0
    slender = fi.analytic.beam(
        own_theory.LENGTH, ends=("hinged", "hinged"), section=own_theory.SECTION, n_modes=own_theory.MODES
    )
    assert slender.frequencies[-1] > 1.2 * own_theory.main()[0]


def beam(**changes):
    """Assemble a beam by a theory of the user's own."""
    theory = own_theory.replace(own_theory.RAYLEIGH, **changes)
    return fi.assemble(fi.mesh.line(0.4), own_theory.SECTION, {"left": "clamped"}, theory=theory)


test_a_theory_that_makes_no_matrices_is_refused_in_words = refusing([
    ({"fields": ("stiffness", "inertia")}, "terms of theory 'rayleigh' must be of 'K' or 'M' and of a field among"),
    ({"terms": lambda *given: [Term("K", "stiffness", euler.terms(*given)[0].parts * np.nan)]}, "must be finite"),
    ({"terms": lambda *given: [Term("K", "stiffness", euler.terms(*given)[0].parts[..., :3])]}, "must have shape"),
    ({}, "target must be the modes of `find_modes`, as the theory 'rayleigh' is"),
], lambda changes: fi.strike(
    beam(**changes), fi.Striker.rigid(0.1), fi.Contact.hertz(1e8), at=[0.3], speed=1.0
))  # fmt: skip
