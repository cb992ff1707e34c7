"""Shipped scenes have answers to trust, but for one that shows what is said of the others, and its cure."""

import pytest
from comparing import stretched
from scenes import SHIPPED

import fem_impact as fi

SHOWN = "drumstick_firm.toml"
NAMES = sorted(path.name for path in SHIPPED.glob("*.toml") if path.name != SHOWN)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "guitar_top.toml" else name for name in NAMES]
)
def test_a_shipped_scene_has_an_answer_to_trust(name):
    hit = fi.load_scene(SHIPPED / name).strike()
    assert hit.trusted, hit.verdict


@stretched
def test_the_scene_that_is_not_trusted_names_its_cure(tmp_path):
    text = (SHIPPED / SHOWN).read_text(encoding="utf-8")
    wrong = fi.load_scene(SHIPPED / SHOWN).strike()
    told = "but the model is wrong here: the deflection is 1.3 times the thickness"
    assert not wrong.trusted and told in wrong.verdict
    assert f"{wrong.restitution:.2f} to 0.64" in " ".join(text.replace("\n# ", " ").split())
    (tmp_path / SHOWN).write_text(text.replace("\n# stretching", "\nstretching").replace("\n# air", "\nair"))
    cured = fi.load_scene(tmp_path / SHOWN).strike()
    assert cured.trusted and round(cured.restitution, 2) == 0.64
    chosen = fi.load_scene(SHIPPED / SHOWN).run(model="auto")
    apart = abs(chosen.response.restitution - cured.restitution)  # the modes of the linear blow may be more
    assert apart <= chosen.response.error.total + cured.error.total
    (note,) = (note for note in chosen.notes if "that took" in note)
    assert "stiffens as it stretches" in note and "moves the air" in note  # both at once


UNTRUSTED = (
    "ball_toughened_pane", "ball_window_pane", "drumhead_buzz", "guitar_fingernail", "guitar_plectrum_celluloid",
    "timpano_felt",
)  # fmt: skip
EVERYDAY = sorted((SHIPPED / "everyday").glob("*.toml"))


@pytest.mark.slow
@pytest.mark.thin(10)
@pytest.mark.parametrize("path", EVERYDAY, ids=lambda path: path.stem)
def test_an_everyday_scene_meets_its_tolerance_and_is_trusted_or_says_why_it_is_not(path):
    found = fi.load_scene(path)
    hit = found.play() if found.stroke else found.strike()
    if not found.stroke and path.stem != "drumhead_buzz":  # whose bounces do not end
        assert hit.tolerance_met and hit.n_impacts >= 1 and -1.0 < hit.restitution <= 1.0 and hit.finished
    text = " ".join(path.read_text(encoding="utf-8").replace("\n#", " ").split())
    assert hit.trusted == (path.stem not in UNTRUSTED) == ("ot trusted" not in text), hit.verdict
