"""`fi.tune`: what it says of cents holds for bodies made anew; a marimba bar; random plates; what it cannot do."""

import json

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.cli import main
from fem_impact.designs import removal, tuning
from fem_impact.designs.removal import PER_CENT, Dishes

WOOD = fi.Material(E=16e9, nu=0.35, rho=900.0)
BAR = fi.Beam.rectangular(WOOD, width=0.05, height=0.012)
LINE = fi.mesh.line(0.35)
ON_LINE = fi.assemble(LINE, BAR)


def again(found, mesh, whole, modes, **held):
    """Frequencies (n,) [Hz] of modes numbers (n,) of a body made anew from what is told of the patches."""
    patches = [(patch.at, patch.depth) for patch in found.patches]
    less = removal.thinned_section(whole, Dishes.of_places(patches, found.radius).depth)
    solved = fi.find_modes(fi.assemble(mesh, less, **held), n_modes=max(modes) + 3, tolerance=2e-5)
    return solved.frequencies[solved.n_rigid + np.array(modes) - 1]


def test_a_bar_is_tuned_by_one_groove_where_least_does_most():
    found = fi.tune(ON_LINE, {1: "-20 cents", 2: None}, mirror="x")
    first, second = found.tones
    assert found.met and len(found.patches) == 1
    assert_allclose(first.off, 20.0, rtol=1e-9)
    assert_allclose([first.after, second.after], again(found, LINE, BAR, [1, 2]), rtol=1e-7)  # tolerance / 100
    assert abs(first.left) < 1.0
    (patch,) = found.patches
    assert np.abs(patch.at - 0.175).max() < 0.02  # the middle bends most
    assert_allclose(patch.cents[0], first.left - first.off, rtol=1e-9)
    assert patch.words.startswith(f"{1e3 * patch.depth:.3g} mm at") and "mode 2 -" in patch.words
    assert_allclose(patch.by_slopes, patch.cents, rtol=0.05)  # a hundredth of the height is taken off


def test_the_map_adds_up_to_a_uniform_removal_and_a_single_patch_tells_what_it_does():
    found = fi.tune(ON_LINE, {1: "-5 cents", 2: None})
    volume = 0.05 * np.trapezoid(found.map[:, 0], found.points[:, 0])  # dishes overlap to a constant, but at the ends
    assert_allclose(volume, -PER_CENT / 0.012, rtol=0.02)
    patch = found.patch((0.02,), 0.1e-3, radius=0.03)
    less = removal.thinned_section(BAR, Dishes(np.array([[0.02]]), np.array([0.1e-3]), 0.03).depth)
    exact = fi.find_modes(fi.assemble(LINE, less), n_modes=4).frequencies[2:]
    assert_allclose(patch.cents, 1200.0 * np.log2(exact / [each.before for each in found.tones]), rtol=1e-6)
    assert (patch.cents > 0.0).all()  # the end is lighter
    with pytest.raises(ValueError, match="at must lie on the body"):
        found.patch((0.5,), 1e-4)
    with pytest.raises(ValueError, match="radius must be positive, got 0 m"):
        found.patch((0.1,), 1e-4, radius=0.0)


def test_a_straight_bar_becomes_a_marimba_bar():
    """Tuned 1 : 4 : 10 as `studies/design_marimba.py` does with one curve, here by grooves in pairs."""
    whole, wanted = fi.Beam.rectangular(WOOD, width=0.055, height=0.022), {1: 261.63, 2: "ratio 4", 3: "ratio 10"}
    bar = fi.assemble(LINE, whole, theory="timoshenko")
    found = fi.tune(bar, wanted, mirror="x", depth=0.0185, radius=0.06)
    assert found.met and len(found.patches) <= 3
    solved = again(found, LINE, whole, [1, 2, 3], theory="timoshenko")
    exact = np.array([261.63, 4.0 * solved[0], 10.0 * solved[0]])
    assert np.abs(1200.0 * np.log2(solved / exact)).max() < 1.0
    assert removal.thickness(found.section, np.array([[0.175]]))[0] > 0.022 - 0.0185


def test_what_cannot_be_reached_is_said():
    with pytest.warns(fi.ToleranceWarning, match=r"from C6.*; so much off leaves it between 372.* and 443.* Hz"):
        found = fi.tune(ON_LINE, {1: "C6"}, depth=1e-3)
    assert not found.met and "MISSED" in found.summary()
    assert found.tones[0].left > found.tones[0].off  # as far as it goes


def test_no_place_is_deeper_than_allowed_where_dishes_overlap():
    found = fi.tune(
        fi.assemble(LINE, BAR, {"right": "hinged"}), {3: "-28 cents", 4: "-52 cents"}, mirror="x", depth=4e-4
    )
    places = [(patch.at, patch.depth) for patch in found.patches]
    deepest = Dishes.of_places(places, found.radius).depth(np.linspace(0.0, 0.35, 5001)[:, None]).max()
    assert len(places) > 2 and 0.95 * found.depth < deepest <= found.depth  # 1.12 where only middles were bound


def test_a_round_bar_is_turned_down_by_rings():
    """Less is taken off than the girth times the depth, which only holds of shallow grooves."""
    found = fi.tune(fi.assemble(LINE, fi.Beam.circular(WOOD, diameter=0.012)), {1: "-200 cents"})
    x = np.linspace(0.0, 0.35, 5001)
    deep = Dishes.of_places([(each.at, each.depth) for each in found.patches], found.radius).depth(x[:, None])
    assert_allclose(found.volume, np.trapezoid(np.pi * deep * (0.012 - deep), x), rtol=1e-6)


test_arguments_are_checked = refusing([
    (ON_LINE, {"depth": 0.02}, r"depth must be less than the thickness, 0\.012 m, got 0\.02 m"),
    (
        fi.assemble(LINE, fi.Beam.circular(WOOD, diameter=0.012)),
        {"depth": 0.006},
        r"depth must be less than the radius, 0\.006 m, got 0\.006 m",
    ),
    (ON_LINE, {"mirror": "y"}, "mirror must be one of x, got 'y'"),
    (ON_LINE, {"radius": 1e-3}, r"radius must lie between 0\.0233333 and 0\.35 m"),
    ("studies/scenes/heavy_plate.toml", {}, r"\[target\] must not state mass, .*; leave them out"),
    (ON_LINE, {"pitches": {1: None, 2: None}}, r"pitches must want something of a mode: .*; name a pitch, too"),
    (BAR, {}, r"body must be a System of fi\.assemble or a Scene of fi\.load_scene or the path of a file, got Beam"),
], lambda body, how: fi.tune(body, **{"pitches": {1: "-5 cents"}} | how))  # fmt: skip


def test_pitches_of_the_command_are_in_order_or_by_mode():
    assert tuning.parse_pitches(["A4", "A5"]) == ["A4", "A5"] and tuning.parse_pitches(["2=A5", "3="]) == {
        2: "A5",
        3: None,
    }
    with pytest.raises(ValueError, match="--pitch must be MODE=PITCH, as in 2=A5"):
        tuning.parse_pitches(["A4", "2=A5"])


def outline(rng):
    """Corners of a random outline, about 0.3 m wide."""
    angle = np.linspace(0.0, 2.0 * np.pi, int(rng.integers(4, 8)), endpoint=False) + rng.uniform(0.0, 0.4)
    radius = 0.15 * rng.uniform(0.7, 1.2, len(angle))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


@pytest.mark.slow
@pytest.mark.thin(3)
@pytest.mark.parametrize("seed", range(3))
def test_plates_of_random_outlines_are_tuned_as_told(seed):
    """Each claim in cents holds for a body made anew and solved to a finer tolerance."""
    rng = np.random.default_rng(seed)
    corners, plate = outline(rng), fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), 3e-3)
    modes = [1, 3]
    wanted = {mode: f"{rng.uniform(-25.0, -5.0):.1f} cents" for mode in modes}
    found = fi.tune(fi.assemble(fi.mesh.polygon(corners), plate), wanted, tolerance=1.0)
    exact = again(found, fi.mesh.polygon(corners), plate, modes)
    for tone, frequency in zip(found.tones, exact):
        said = 1200.0 * np.log2(frequency / tone.after)
        assert abs(said) < tone.error_after + 0.05  # 2e-5 of the finer body is 0.03 cents
        assert abs(1200.0 * np.log2(frequency / tone.wanted)) < 1.0 + tone.error_after


def test_the_command_tells_prints_and_draws(tmp_path, capsys):
    path = tmp_path / "tuning.png"
    words = ["tune", "studies/scenes/marimba_bar.toml", "--pitch", "F#5", "--mirror", "x", "--json", "--out", str(path)]
    assert main(words) == 0
    said = json.loads(capsys.readouterr().out)
    (tone,), (patch,) = said["tones"], said["patches"]
    assert said["met"] and abs(tone["left"]) < 1.0 and tone["wanted"] == pytest.approx(739.9888454)
    assert tone["left"] - tone["off"] == pytest.approx(patch["cents"][0])
    assert path.read_bytes().startswith(b"\x89PNG")
