"""The catalogue as tables: everything is found by its words, and rows say what the entries hold."""

import pytest

import fem_impact as fi
from fem_impact.impact import listing


def test_words_find_entries_by_name_and_group():
    found = listing.listed("")[0]["entries"]
    assert len(found) == len(fi.materials) + len(fi.strikers) + len(fi.hammers.catalogue)
    assert [each["name"] for each in listing.listed("5a nylon")[0]["entries"]] == ["hickory 5A, nylon tip"]
    found = listing.listed("kistler")[0]["entries"]
    assert {(each["section"], each["group"]) for each in found} == {("hammers", "Kistler")}


@pytest.mark.parametrize(("exponent", "ratio"), [(1.0, 1.02), (2.0, 1.31), (3.0, 1.60)])
def test_where_the_force_has_fallen_by_10_dB(exponent, ratio):
    """As the page says: at the inverse of the contact time, of steep laws at 1.6 times that; rounded figures."""
    law = fi.Contact.power(1e6, exponent)
    hit = fi.strike(fi.Modes.rigid(1e4), fi.Striker.rigid(0.03), law, at=None, speed=1.0)
    assert fi.hammers.bandwidth_of(hit, 10.0) * hit.contact_time == pytest.approx(ratio, abs=0.01)


def test_wood_lists_its_constants_once():
    entry = fi.materials.entry("spruce, Sitka")
    said = listing.facts(entry)
    assert [line.split()[0] for line in said] == [
        "E_L", "E_R", "E_T", "G_LR", "G_LT", "G_RT", "nu_LR", "nu_LT", "nu_RT", "rho", "loss_factor",
    ]  # fmt: skip
    assert said[0].startswith("E_L 1.09e+10 Pa, 7.6e+09 to 1.56e+10: ")
    assert said[-1].endswith("(not read here)") and not said[0].endswith("(not read here)")
    told = listing.record("materials", entry)["numbers"]["E"]
    assert told["low"] < told["value"] < told["high"] and told["unit"] == "Pa"


def test_the_prompt_is_told_the_numbers_of_one_and_the_rows_of_several():
    data, said = listing.listed("brass")  # a whole name counts before a part of others, such as of a brass mallet
    assert [each["name"] for each in data["entries"]] == ["brass"] and said[0] == "brass (metal)"
    data, said = listing.listed("yarn")
    ((rows, head),) = said
    assert [row[0] for row in rows] == ["yarn, soft", "yarn, medium", "yarn, hard"] and head[0] == "striker"
    assert [each["section"] for each in data["entries"]] == ["strikers"] * 3
    with pytest.raises(ValueError, match="got 'brss'; did you mean 'brass'"):
        listing.listed("brss")
