"""The sheet that says which hammer and tip of the catalogue to take, point by point."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.pages import hammer_sheet
from fem_impact.taps import roving

PANEL = fi.analytic.rectangle(0.4, 0.3, mass=2.0, first_frequency=100.0, n_modes=80, damping_ratio=0.01)
POINTS = [(0.1, 0.1), (0.2, 0.15)]


@pytest.fixture(scope="module")
def kit():
    return roving.hammers_known("PCB 086", 600.0, 10.0, 0.12)


@pytest.fixture(scope="module")
def plan(kit):
    return fi.plan_test(PANEL, kit, POINTS, 600.0)


def test_the_kit_has_hammers_up_to_a_mass_with_tips_that_are_not_far_too_soft_or_hard(kit):
    assert set(kit) == {"PCB 086E80", "PCB 086C01"}  # 4.8 g and 100 g; the others weigh 160 g and more
    # on a wall 600 Hz ask for 0.1 kg (2 pi 600 Hz / 2.039)**2 = 342 kN/m: 69 MN/m of steel are 200 times as much
    assert set(kit["PCB 086C01"][1]) == {"rubber", "vinyl", "plastic"}
    assert set(kit["PCB 086E80"][1]) == {"vinyl"}  # its softest, although far beyond what 4.8 g need


test_hammers_that_are_not_there_are_told = refusing([
    ("violin", "must name hammers, got 'violin'"),
    ("086D50", r"has no hammer up to 1 kg, the mass of the body, .*; name others, or ask for another"),
], lambda words: roving.hammers_known(words, 600.0, 10.0, 1.0))  # fmt: skip


def test_the_speed_of_overload_is_that_at_which_a_blow_reaches_the_range(plan):
    i, j = 0, plan.hammers.index("PCB 086E80")
    speed = hammer_sheet.overload(plan, i, j)
    hammer = fi.hammers.catalogue[plan.hammers[j]]
    hit = fi.strike(PANEL, hammer.striker(), hammer.contact(plan.tips[j]), at=POINTS[i], speed=speed, max_impacts=1)
    assert_allclose(hit.peak_force, hammer.force, rtol=1e-3)  # both blows to 1e-4


def test_what_works_comes_first_and_double_hits_last(plan):
    for i in range(2):
        verdicts = [hammer_sheet.tip_verdict(plan, i, j) for j in hammer_sheet.order_of_blows(plan, i)]
        ranks = [{"works": 0, "double hit": 2}.get(each, 1) for each in verdicts]
        assert ranks == sorted(ranks)
        if plan.best[i] >= 0:
            assert hammer_sheet.order_of_blows(plan, i)[0] == plan.best[i]


@pytest.mark.slow
def test_every_point_has_a_sheet_that_prints_on_a_page_of_its_own(plan, tmp_path, visit):
    hammer_sheet.write_sheets(tmp_path / "sheet.html", plan, title="A <panel>", notes=("tips are linear",))
    page = visit((tmp_path / "sheet.html").as_uri(), width=360, height=800)
    assert not page.errors and page.tab.evaluate("document.documentElement.scrollWidth") <= 360
    assert page.tab.locator("section.sheet").count() == 2
    assert np.char.startswith(page.tab.locator(".take").all_inner_texts(), ("Take PCB")).any()
    page.tab.emulate_media(media="print")
    second = "getComputedStyle(document.querySelectorAll('.sheet')[1]).breakBefore"
    assert page.tab.evaluate(second) == "page"
