"""Messages name the headings that explain them: at their end, below a first line, and for programs as a list."""

import pytest
from scenes import SHIPPED

import fem_impact as fi
from fem_impact._base import explained

FIRM = SHIPPED / "drumstick_firm.toml"
ONE = " (notes.md#not-resolvable)"


def test_a_message_ends_with_what_explains_it_once_however_it_is_passed_on():
    said = explained.with_headings("tolerance 0.01 is not resolvable")
    assert said.endswith(ONE) and explained.with_headings(said) == said
    assert (
        explained.with_headings(f"stroke 3: {said}; over") == f"stroke 3: tolerance 0.01 is not resolvable; over{ONE}"
    )
    assert (
        explained.with_headings("nothing is wrong") == "nothing is wrong"
        and explained.heading_line("nothing is wrong") == []
    )


def test_errors_and_warnings_of_python_name_their_headings():
    modes = fi.analytic.rectangle(0.465, 0.3, mass=0.063, first_frequency=50.0, n_modes=4)
    blow = {"at": (0.14, 0.09), "speed": 1.0}
    with pytest.warns(fi.ToleranceWarning, match=r"MISSED.*\(notes\.md#tolerance-missed.*\)$"):
        hit = fi.strike(modes, fi.Striker.rigid(0.02), fi.Contact.linear(1e6), **blow)
    first, second, *_ = hit.summary().splitlines()
    assert first == hit.verdict and "notes.md" not in first
    assert second.startswith("See notes.md#tolerance-missed")
    with pytest.raises(fi.SimulationError, match=r"\(notes\.md#tolerance-missed.*\)$"):
        fi.strike(modes, fi.Striker.rigid(0.02), fi.Contact.linear(1e6), strict=True, **blow)
    with pytest.raises(ValueError, match=r"\(notes\.md#strike-points-beside-the-body\)$"):
        fi.strike(modes, fi.Striker.rigid(0.02), fi.Contact.linear(1e3), at=(9.0, 9.0), speed=1.0)


def test_a_strike_names_what_explains_its_model_in_text_and_for_programs(prompt):
    first, *rest = prompt("strike", FIRM).out.split("\n1 impact")
    assert "notes.md" not in first
    assert "(notes.md#still-air)" in " ".join("".join(rest).split())
    see = prompt("strike --json", FIRM).json["see"]
    assert {"notes.md#small-deflections", "notes.md#beyond-this-estimate", "notes.md#still-air"} <= set(see)
