"""The catalogue: every number has a source, a unit and an interval around it, and every entry can be used as it is."""

import re

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.impact import catalogue
from fem_impact.impact.contact import wall_time
from fem_impact.sweeps.inputs import read_inputs

SECTIONS = {"materials": fi.materials, "strikers": fi.strikers, "hammers": fi.hammers.catalogue}
FACTS = [
    (f"{section}: {name}: {key}", key, fact)
    for section in (*SECTIONS, "tips")
    for name, entry in catalogue._entries(section).items()
    for key, fact in entry.facts.items()
]
RANGES = {  # number -> what it may be: from balsa across the grain to alumina, from a plectrum to a sledge hammer
    "Pa": (1e7, 1e12), "kg/m^3": (100.0, 12e3), "kg": (1e-3, 10.0), "m": (5e-4, 0.05), "Hz": (100.0, 1e3),
    "s/m": (0.01, 1.0), "m/s": (0.1, 10.0), "N": (100.0, 5e4), "V/N": (1e-4, 0.1), "N/m^exponent": (1e4, 1e13),
}  # fmt: skip
EXACT = {"exponent", "speed", "force", "tip_nu"}  # what goes with a stiffness or a restitution, and what hardly matters


def test_the_catalogue_is_as_large_as_it_says():
    """Forty materials, thirty strikers and twenty hammers were wanted; woods count once, not once for each cut."""
    woods = [name for name in fi.materials if name.endswith("flat-sawn")]
    assert len(fi.materials) - len(woods) >= 40 and len(fi.strikers) >= 30 and len(fi.hammers.catalogue) >= 20
    assert len({name.lower() for section in SECTIONS.values() for name in section}) == sum(map(len, SECTIONS.values()))


def test_every_number_has_its_unit_its_range_and_an_interval_around_it():
    for name, key, fact in FACTS:
        low, high = RANGES.get(fact.unit, (1e-5, 5.0))
        assert low <= fact.value <= high, f"{name} is {fact.value:g} {fact.unit}"
        assert fact.ends[0] <= fact.value <= fact.ends[1], name
        assert bool(fact.interval) or key in EXACT, f"{name} says nothing of how well it is known"
        assert len(fact.source.split()) >= 2, name


def test_every_source_is_used_and_what_was_not_read_says_so():
    used = {fact.source for _, _, fact in FACTS}
    assert used == {words for words, _ in catalogue.sources().values()}
    assert {fact.read for _, _, fact in FACTS} == {True, False}
    assert all(not read for words, read in catalogue.sources().values() if re.match("estimate|typical|usual", words))


@pytest.mark.parametrize("name", [name for name in fi.materials if "E_R" in fi.materials.entry(name).facts])
def test_the_constants_of_wood_are_those_of_a_solid(name):
    """The compliance in three dimensions is positive definite; grain, rays, rings is the order of stiffness."""
    value = {key: fact.value for key, fact in fi.materials.entry(name).facts.items()}
    L, R, T = (value[key] for key in ("E_L", "E_R", "E_T"))
    lr, lt, rt = -value["nu_LR"] / L, -value["nu_LT"] / L, -value["nu_RT"] / R
    assert np.linalg.eigvalsh(np.array([[1 / L, lr, lt], [lr, 1 / R, rt], [lt, rt, 1 / T]])).min() > 0.0
    assert L > R > 0.95 * T  # redwood has T over R by 2 %
    made = fi.materials[name]
    across, shear, inside = (T, "G_LT", lt) if name.endswith("flat-sawn") else (R, "G_LR", lr)
    assert (made.E, made.E_across, made.G, made.nu) == (L, across, value[shear], pytest.approx(-inside * L))
    assert np.linalg.eigvalsh(made.plane_stress).min() > 0.0


@pytest.mark.parametrize("name", fi.materials)
def test_every_material_is_one_and_none_looks_like_a_slip(name):
    made = fi.materials[name]
    assert made.notes == () and made.rho == fi.materials.entry(name).facts["rho"].value
    known = read_inputs(fi.materials.entry(name).vary("material"))
    assert {"material.E", "material.rho"} <= {each.name for each in known}


@pytest.mark.parametrize("name", fi.strikers)
def test_every_striker_strikes_a_plate(name):
    """On a heavy plate the blow is about as long as on a rigid wall, a lossy one up to twice as long; sticks bend."""
    striker, entry = fi.strikers[name], fi.strikers.entry(name)
    law = entry.contact(on=fi.materials["steel, mild"])
    hit = fi.strike(fi.Modes.rigid(1e3), striker, law, at=None, speed=1.0, tolerance=1e-2)
    alone = float(wall_time(law.stiffness, law.exponent, 1.0 / striker.felt_mass, 1.0))
    assert 0.0 <= hit.restitution <= 1.0 and hit.n_impacts >= 1
    assert entry.kind == "stick" or 0.7 < hit.contact_time / alone < 2.0


def test_a_hard_tip_has_the_stiffness_of_hertz_and_a_soft_head_its_own():
    steel, spruce, ball = fi.materials["steel, hardened"], fi.materials["spruce, Sitka"], fi.strikers["steel, 10 mm"]
    as_soft = fi.Material(E=spruce.E_across, nu=0.3, rho=1.0)
    for struck, alike in ((steel, steel), (spruce, as_soft)):
        found = fi.strikers.entry("steel, 10 mm").contact(on=struck).stiffness
        assert found == pytest.approx(fi.Contact.between(ball, alike).stiffness, rel=1e-12)
    yarn = fi.strikers.entry("yarn, medium")
    assert yarn.contact() == yarn.contact(on=spruce)


def test_rules_of_games_are_kept():
    """A table tennis ball that falls 30.5 cm onto steel rebounds to 24 to 26 cm, as the rules of the ITTF say."""
    ball, law = fi.strikers["table tennis"], fi.strikers.entry("table tennis").contact()
    hit = fi.strike(fi.Modes.rigid(1e3), ball, law, at=None, speed=ball.dropped(0.305), tolerance=1e-3)
    assert 0.24 < 0.305 * hit.restitution**2 < 0.26


def test_a_hammer_of_the_catalogue_taps_through_its_tips():
    hammer = fi.hammers.catalogue["PCB 086C03"]
    times = []
    for tip in hammer.tips:  # from hard to soft
        hit = fi.strike(fi.Modes.rigid(1e4), hammer.striker(), hammer.contact(tip), at=None, speed=0.5)
        assert hit.contact_time == pytest.approx(np.pi * (hammer.mass / hammer.tips[tip]) ** 0.5, rel=1e-3)
        times.append(hit.contact_time)
    assert times == sorted(times) and times[0] < 0.3e-3 and times[-1] > 1e-3
    with pytest.raises(ValueError, match="tip must be one of steel, plastic, vinyl, rubber, got 'stel'; did you mean"):
        hammer.contact("stel")


@pytest.mark.parametrize(
    ("section", "name", "text"),
    [
        ("materials", "brss", "has no 'brss'; did you mean 'brass'?"),
        ("materials", "spruce", "'spruce'; did you mean 'spruce, Sitka' or"),
        ("strikers", "5A wood", "did you mean 'hickory 5A, wood tip'?"),
        ("hammers", "086C03", "did you mean 'PCB 086C03'?"),
        ("materials", 3, "has no 3; `fem-impact catalogue` lists all"),
    ],
)
def test_a_wrong_name_tells_the_right_one(section, name, text):
    with pytest.raises(ValueError, match=re.escape(text)):
        SECTIONS[section][name]
    assert name not in SECTIONS[section] and SECTIONS[section].get(name) is None


def test_what_is_no_striker_has_no_contact():
    with pytest.raises(ValueError, match="contact needs a striker, got 'brass' of the group metal"):
        fi.materials.entry("brass").contact()
