"""The page of a fit shows what was found and what the data do not tell."""

import re
from copy import copy

import pytest

import fem_impact as fi
from fem_impact.pages import fit_page
from fem_impact.taps.found import Found


@pytest.fixture(scope="module")
def found():
    body = fi.Modes.from_arrays([900.0], [[2.0]], points=[[0.0]], mass=1.0, damping_ratio=0.02, complete=True)
    law = fi.Contact.hertz(5e7)
    hits = [fi.strike(body, fi.Striker.rigid(0.1), law, at=[0.0], speed=v) for v in (0.5, 1.0, 1.5)]
    taps = [fi.measure(hit, rate=25600.0, noise=5e-3, rng=i) for i, hit in enumerate(hits)]
    ranges = {"contact.stiffness": (1e5, 1e10), "striker.mass": (0.02, 0.5), "mode1.mass": (0.05, 1.3),
              "mode1.frequency": (500.0, 1500.0)}  # fmt: skip
    return fi.fit(taps, striker=fi.Striker.rigid(0.1), contact=law, starts=2, unknown=ranges)


def test_a_page_with_values_ridges_pictures_and_double_hits(found, tmp_path):
    fit_page.write_fit(tmp_path / "fit.html", found, title="A <hammer> & a bar")
    page = (tmp_path / "fit.html").read_text()
    assert "A &lt;hammer&gt; &amp; a bar" in page
    assert page.count("data:image/png;base64,") == 3
    assert "do not determine contact.stiffness" in page and "and the taps are explained as well" in page
    assert "^-" not in found.summary() and 'class="badge good"' not in page
    assert "tip x 10" in page and not re.search("https?:", page)


@pytest.mark.parametrize("white, badge", [(0.5, "good"), (1e-4, "bad")])
def test_a_verdict_counts_what_the_model_lacks(found, white, badge, tmp_path, monkeypatch):
    monkeypatch.setattr(Found, "unidentifiable", ())
    monkeypatch.setattr(Found, "whiteness", white)
    for name in ("pulses", "profiles", "spectrum", "picture_uri", "double_hits"):  # the test before has them
        monkeypatch.setattr(fit_page, name, lambda *given: "")
    made = copy(found)  # with what was computed of it
    for name in ("unidentifiable", "whiteness", "verdict"):
        made.__dict__.pop(name, None)
    fit_page.write_fit(tmp_path / "fit.html", made)
    page = (tmp_path / "fit.html").read_text()
    assert page.count('class="badge ') == 1 and f'class="badge {badge}"' in page
    assert ("the model lacks something" in page) == (badge == "bad")


def test_double_hits_are_a_table(found):
    rows = fit_page.double_hits(found)
    assert len(rows) == 1 + len(fit_page.MASSES) and all(len(row) == 1 + len(fit_page.TIPS) for row in rows)
    assert rows[1][1] == "1"  # a light hammer with a soft tip hits once
