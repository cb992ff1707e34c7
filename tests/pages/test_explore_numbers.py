"""What is sent to the live page is what the blow is."""

import base64
import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import load_text
from test_cli import TEXT

from fem_impact.pages import explore_model, explore_numbers


@pytest.fixture(scope="module")
def explorer(tmp_path_factory):
    return explore_numbers.Explorer(explore_model.Setup.of(load_text(tmp_path_factory.mktemp("explorer"), TEXT)))


def unpacked(text):
    return np.frombuffer(base64.b64decode(text), "<f4")


def test_judged_blow_is_sent_whole(explorer):
    setup = explorer.setup
    told, hit = explorer.judge(setup.start), setup.case(setup.start).blow(tolerance=setup.tolerance)
    assert hit.tolerance == setup.scene.blow.values["tolerance"] == 1e-2  # the scene's own
    cells = dict(told["cells"])
    assert cells["impacts"] == str(hit.n_impacts) and cells["restitution"] == f"{hit.restitution:.3f}"
    assert told["verdict"] == hit.verdict and told["model"] == hit.model_verdict[1:] and not told["missed"]
    assert told["trusted"] == hit.trusted
    force = unpacked(told["force"])
    assert force.max() == pytest.approx(hit.force.max(), rel=1e-6)  # 32-bit floats
    assert len(force) == len(unpacked(told["time"])) and unpacked(told["time"])[-1] >= hit.impacts[-1].end
    band = np.geomspace(*explore_numbers.BAND, explore_numbers.SPECTRUM_POINTS)
    spectrum = np.abs(hit.spectrum(band))
    assert_allclose(unpacked(told["spectrum"]), spectrum, atol=2e-3 * spectrum.max())  # a pixel of 300


def test_answer_says_that_it_is_not_the_last_word(explorer):
    told, hit = explorer.answer(explorer.setup.start)
    assert dict(told["cells"])["estimated error"] == "refining …" and "verdict" not in told
    rest = explorer.rest_of(explorer.setup.start, hit)
    scene = tomllib.loads(base64.b64decode(rest["scene"].partition(",")[2]).decode())
    assert scene["strike"]["at"] == list(explorer.setup.start.at)
    assert rest["limit"] == pytest.approx(explore_model.limit_of(explorer.case(explorer.setup.start)))
    assert "× threshold" in rest["resonates"]


def test_only_the_latest_strike_points_are_remembered(explorer):
    for i in range(explore_numbers.KNOWN + 3):
        explorer.learn((0.1, 0.01 * i), explore_numbers.View(1e-6 * i, None))
    assert len(explorer.views) == explore_numbers.KNOWN and (0.1, 0.0) not in explorer.views
    assert explorer.rest == 1e-6 * (explore_numbers.KNOWN + 2)


@pytest.mark.slow
def test_blows_and_rolls_are_heard_on_the_surface_and_above_it(explorer):
    start, where = explorer.setup.start, explorer.setup.start.at
    on, above, roll = (explorer.listen(start, where, h, rate) for h, rate in ((0.0, None), (1.5, None), (0.0, 12.0)))
    assert "the surface at" in on["note"] and " above (" in above["note"] and "Pa; full scale" in above["note"]
    assert len({on["uri"], above["uri"], roll["uri"]}) == 3
    assert all(each["uri"].startswith("data:audio/wav;base64,") for each in (on, above, roll))
