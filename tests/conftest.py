"""What several tests share: which of many cases alike are run, compiled kernels, the prompt, a real browser."""

import json
import os
import shlex
import shutil
from typing import Any, NamedTuple
from zlib import crc32

import pytest
from browsing import Page
from hypothesis import settings
from warming import SMOKING, TASKS, compile_all

os.environ.setdefault("NUMBA_DISABLE_JIT", "0")  # or a first blow would be plain Python, see `model.fresh`
settings.register_profile("same", derandomize=True)  # the same cases in every run
settings.load_profile("same")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# What `pytest -m smoke` runs, without their slow cases: quick files of every package, physics in each. They need the
# kernels of A4 and of maps, but not stretching.
SMOKE = (
    "designs/test_goals", "fe/test_eigenvalues", "fe/test_membrane", "fe/test_plausible", "impact/test_response",
    "impact/test_contact", "impact/test_force_spectrum", "impact/test_threshold", "mesh/test_meshes",
    "mesh/test_triangulation", "model/test_deflection", "modes/test_analytic", "modes/test_unstated",
    "scenes/test_templates", "show/test_sound", "sweeps/test_cells", "taps/test_found", "taps/test_rig",
    "test_end_to_end", "test_figures_of_the_source",
)  # fmt: skip
# Slow families of `independent`, whose files stay as they came: of how many cases one is run, as of a mark `thin`; of 0
# none, as a quick form of it always runs.
SHARES = {
    "test_a_cymbal_is_struck_at_its_rim": 3,
    "test_a_plate_gives_what_its_series_says_at_many_points": 3,
    "test_a_polygon_gives_what_mixed_elements_say": 8,
    "test_claims_are_fair": 0,
    "test_claims_cover_the_error_at_many_points": 0,
    "test_claims_cover_the_truth_in_a_whole_family": 5,
    "test_counts_beside_thresholds_are_right_or_in_doubt": 4,
    "test_domes_sound_as_flat_ones_within_the_stated_bound": 3,
    "test_energy_of_light_and_heavy_strikers_by_hand": 20,
    "test_every_cell_of_a_wide_map_is_a_single_strike": 10,
    "test_frequencies": 3,
    "test_maps_whole_bodies_and_elements_keep_their_promise_or_tell": 3,
    "test_modes_picked_from_a_tap_say_how_well_they_are_known": 2,
    "test_more_attacked_stores_give_the_bits_of_an_undisturbed_run": 3,
    "test_more_blows_keep_their_promise_or_tell": 3,
    "test_more_closed_forms_are_the_textbooks": 5,
    "test_more_elements_are_within_their_claim_of_the_textbook": 8,
    "test_more_rings": 3,
    "test_processes_that_open_one_new_store_together_all_finish_it": 2,
    "test_promises_of_fifty_blows_are_kept_or_their_miss_is_told": 0,
    "test_radiated_pressure_anywhere": 3,
    "test_reference_moves_as_scipy_does": 3,
    "test_solids_are_met_to_what_thin_and_shallow_theory_can": 2,
    "test_static_compliance_and_blow": 40,
}
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip


def pytest_addoption(parser):
    text = "run every case of the slow tests, not a fixed share of the many that are alike"
    parser.addoption("--all-cases", action="store_true", help=text)


@pytest.hookimpl(tryfirst=True)  # before the groups are read
def pytest_collection_modifyitems(config, items):
    """Marks by file; what shares a fixture of its file runs on one worker; of slow `thin(n)` every n-th is run.

    What runs together begins first, so that no worker is left with much of it while the other has nothing to do.
    """
    for item in items:
        shared = any(made[-1].scope == "module" for made in item._fixtureinfo.name2fixturedefs.values())
        if shared and item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(item.path.stem))
        place = item.path.relative_to(config.rootpath / "tests").with_suffix("").as_posix()
        if place in SMOKE and item.get_closest_marker("slow") is None:
            item.add_marker(pytest.mark.smoke)
    items.sort(key=lambda item: item.get_closest_marker("xdist_group") is None)
    if config.getoption("--all-cases"):
        return
    families: dict[Any, list] = {}
    for item in items:
        thin = item.get_closest_marker("thin")
        share = SHARES.get(item.originalname, thin.args[0] if thin else 1)
        if share != 1 and item.get_closest_marker("slow"):
            families.setdefault((item.path, item.originalname, share), []).append(item)
    left_out = set()
    for (*_, share), family in families.items():
        family.sort(key=lambda item: crc32(item.name.encode()))  # a fixed choice that follows no order of the cases
        left_out |= {*family[-(-len(family) // share) if share else 0 :]}
    items[:] = [item for item in items if item not in left_out]
    config.hook.pytest_deselected(items=list(left_out))


@pytest.fixture(scope="session")
def all_cases(request):
    """Whether every case was asked for."""
    return request.config.getoption("--all-cases")


def pytest_configure(config):
    """Compile the inner loops once, before workers start, so that no test waits for the compiler."""
    from fem_impact._base import isolated

    isolated.PATIENCE = 120.0  # [s] a busy machine must not refuse a file; tests of the limit set their own
    if not hasattr(config, "workerinput"):
        compile_all(SMOKING if config.option.markexpr == "smoke" else TASKS)


def pytest_ignore_collect(collection_path, config):
    """A quick look reads no other files: reading all takes as long as its tests."""
    place = collection_path.relative_to(config.rootpath / "tests").with_suffix("").as_posix()
    return (config.option.markexpr == "smoke" and collection_path.is_file() and place not in SMOKE) or None


@pytest.fixture
def read_here(monkeypatch):
    """Foreign files are read in this process, which saves half a second each; `test_isolated` tests the other one."""
    from fem_impact._base import isolated

    def run(path, reader, arguments, patience):
        status, answer = isolated.main(path, reader, arguments)
        return (status, b"", answer) if status else (status, answer, b"")

    monkeypatch.setattr(isolated, "run_reader", run)


class Said(NamedTuple):
    """What a command ended with and printed."""

    status: int
    out: str
    err: str

    @property
    def json(self):
        return json.loads(self.out)


@pytest.fixture
def prompt(tmp_path, monkeypatch, capsys):
    """Run a command, as typed or word by word, in an empty folder."""
    from fem_impact import cli

    def run(line, *words):
        capsys.readouterr()
        try:
            status = cli.main([*(shlex.split(line) if isinstance(line, str) else line), *map(str, words)])
        except SystemExit as end:
            status = end.code
        said = capsys.readouterr()
        return Said(status, said.out, said.err)

    monkeypatch.chdir(tmp_path)
    return run


@pytest.fixture(scope="session")
def chromium():
    """A headless Chromium, driven by Playwright."""
    if CHROMIUM is None:
        pytest.skip("no chromium here: apt-get install chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture
def visit(chromium):
    """Open pages of given size and colours, until an expression holds; all are closed at the end."""
    pages = []

    def visit(address, until="true", **options):
        pages.append(Page(chromium, **options))
        pages[-1].tab.goto(address)
        pages[-1].until(until)
        return pages[-1]

    yield visit
    for page in pages:
        page.context.close()
