"""No message gives advice that no test follows."""

import ast
import re
from pathlib import Path

from test_advice import ADVICE
from test_advice_of_assumptions import REMEDIES
from test_advice_of_design import DESIGNS
from test_advice_of_files import FILES
from test_advice_of_gradients import GRADIENTS
from test_advice_of_stretching import STRETCHING

TESTS = Path(__file__).parent
HOME = TESTS.parent / "fem_impact"
VERBS = (
    "add allow ask change check choose close connect correct cut delete divide draw export find give install keep "
    "leave load lower make mesh move name pass pip raise reduce refine remove restore run save select set simplify "
    "split start state strike take try use widen write"
)
ADVISES = re.compile(rf"(?:^|; (?:or |and |else |only )?|, or )(?:{VERBS.replace(' ', '|')})\b")
NO_ADVICE = (  # what the prompt says it does, and other words that only begin alike
    r"^(?:strike|list|find|check|serve|write) (?:a|the|this) ",
    r"^find the hammers",
    r"^strike point",
    r"^cut off by",
    r"^scheme \{\}, steps of",
    r"^<Picture of",
    r"; energy error \{\}$",
)
ELSEWHERE = {  # advice followed in a test of its own: the test, and patterns of its messages
    "test_advice.py::test_a_folder_and_a_device_are_not_called_missing": ("^it is a folder; name a file in it$",),
    "test_advice.py::test_a_part_of_the_plan_that_is_too_large_gets_its_limit": (
        "^give n_modes of at most",
        r"^give \S+ of at most \S+ Hz",
    ),
    "test_advice.py::test_a_band_that_is_too_wide_gets_its_limit": ("give a band of the quantity of at most",),
    "test_advice.py::test_a_blow_too_hard_for_any_tolerance_proposes_a_softer_contact": (
        "take a contact with stiffness =",
    ),
    "test_advice.py::test_a_map_of_too_many_modes_proposes_a_tolerance": ("or leave out the",),
    "test_advice.py::test_a_step_error_that_stays_too_large_proposes_what_is_met": (
        "^raise tolerance to",
        "^give max_impacts of at most",
    ),
    "test_advice.py::test_a_blow_that_misses_its_tolerance_is_done_without_the_scheme": ("^leave out scheme",),
    "test_advice.py::test_a_run_without_end_is_ended_by_each_of_what_is_told": ("no final separation was reached",),
    "test_advice.py::test_a_store_of_another_map_asks_for_a_new_folder": ("store holds another map",),
    "test_advice.py::test_a_heavy_hammer_advises_lighter_ones": ("try lighter hammers",),
    "test_advice.py::test_a_cluster_that_does_not_answer_is_started_or_its_address_corrected": (
        "start one or correct the address",
    ),
    "test_advice_of_files.py::test_a_unit_that_was_assumed_can_be_passed": ("assumed .*, pass unit= to change that",),
    "test_advice_of_files.py::test_a_body_that_the_mesher_cannot_fill_is_filled_as_advised": (
        "remove very thin necks or spikes",
    ),
    "taps/test_readers.py::test_what_contradicts_itself_is_read_once_it_is_exported_again": (
        "states a rate of .*; export it again",
        "states different rates, .*; give one of them",
        "states the unit .* means .*; export it again",
        "states .* samples of .*; export it again",
    ),
    "designs/test_clearance.py::test_a_run_that_goes_on_has_none": (
        "must end with its first impact; give max_impacts",
    ),
    "base/test_isolated.py::test_reader_that_never_ends_is_stopped": ("reading took longer than .*; export it again",),
    "fe/test_eigenvalues.py::test_where_a_pivot_vanishes_another_number_of_modes_is_counted": ("a pivot vanished",),
    "fe/test_eigenvalues.py::test_a_beam_whose_slice_misses_modes_is_found_with_another_number": (
        "modes lie between eigenvalues",
    ),
    "fe/test_eigenvalues.py::test_modes_that_stay_missing_are_found_by_asking_for_more": ("ask for a few more modes",),
    "impact/test_parameters.py::test_what_makes_no_section_is_said": ("no section can be made on either side of",),
    "fe/test_variation.py::test_morley_elements_have_none": ("unknown for element 'morley'; take 'argyris'",),
    "fe/test_point_load.py::test_modes_softer_than_the_body_are_an_error": ("find the modes on a finer mesh",),
    "impact/test_promise.py::test_the_modes_advised_meet_the_tolerance": ("^keep .* modes of .* instead of",),
    "impact/test_promise.py::test_a_contact_that_needs_too_many_modes_gets_what_needs_fewer": (
        "would have to keep some .* modes; ",
        "^divide the stiffness of its contacts by",
    ),
    "impact/test_promise.py::test_an_infinite_plate_that_echoes_is_told_to_be_modal": ("^give target = 'modal'",),
    "impact/test_promise.py::test_a_coarse_mesh_is_blamed_and_the_advice_works": (
        "^find the modes of .* with tolerance",
    ),
    "impact/test_promise.py::test_a_step_of_ones_own_is_blamed": ("^leave dt and scheme to the program",),
    "impact/test_promise.py::test_errors_that_miss_only_together_propose_a_tolerance_that_is_met": (
        "^take a tolerance of",
    ),
    "impact/test_promise.py::test_impacts_that_cannot_be_told_leave_the_first_one": (
        "give max_impacts = 1 for the first impact alone",
    ),
    "modes/test_unstated.py::test_what_is_stated_as_advised_meets_the_tolerance": (
        "^make .* with free = True or False",
        "^give the compliance of",
    ),
    "modes/test_unstated.py::test_what_contradicts_itself_works_as_advised": (
        "carries .* of the mass along, .* leave it out, or check mass",
        "give these as modes of 0 Hz instead",
        "complete must be False .*; leave it out",
    ),
    "impact/test_gradient.py::test_a_push_that_barely_yields_further_has_no_gradient": (
        "; change some number slightly",
    ),
    "impact/test_state.py::test_errors_of_the_blow_before_count": ("^give the blow before a smaller tolerance$",),
    "model/test_planner.py::test_a_blow_that_needs_more_memory_than_there_is_is_refused_before_it_is_computed": (
        "^take a larger tolerance or a softer contact$",
    ),
    "impact/test_state.py::test_the_motion_of_a_system_goes_on_in_its_modes": (
        "^start needs modes, taken as they are",
    ),
    "scenes/test_results.py::test_the_folder_that_is_advised_is_read": (
        "; give the (?:folder|one) that `fem-impact strike` wrote",
        "^no results of fem-impact are in it; give",
    ),
    "scenes/test_templates.py::test_a_new_scene_replaces_no_file": ("exists already; name another file with --out",),
    "sweeps/test_borders.py::test_borders_that_were_not_looked_for_are_none": ("make the map with borders=True",),
    "sweeps/test_store.py::test_a_store_keeps_the_results_of_its_functions_only": (
        "; leave out store, or pass a function",
    ),
    "sweeps/test_store.py::test_a_worker_of_another_version_is_refused": ("; install the same one everywhere",),
    "sweeps/test_store.py::test_a_local_cluster_gives_the_same_map": ("the cluster dropped the map",),
    "test_interrupt.py::test_stored_cells_are_kept_and_used": ("run the same command again to continue",),
    "test_extras.py::test_core_commands_need_no_extra": (
        "pip install",
    ),  # installed, they are used in every other test
    "test_doctor.py::test_what_fails_comes_with_its_remedy_and_reason": ("^make the folder .* writable",),
}


def messages(path):
    """Line and text of every message of a module, with {} for its numbers; help of the prompt is no message."""
    tree = ast.parse(path.read_text())
    skip = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            skip.add(node.value)  # docstrings
        elif isinstance(node, ast.keyword) and node.arg in ("help", "metavar", "description", "title"):
            skip |= set(ast.walk(node.value))
        elif isinstance(node, ast.JoinedStr):
            skip |= set(ast.walk(node)) - {node}
    for node in ast.walk(tree):
        if node in skip:
            continue
        if isinstance(node, ast.JoinedStr):
            parts = (part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
            yield node.lineno, "".join(map(str, parts))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value


def covering():
    """Patterns of the messages that a test provokes and whose advice it follows."""
    tables = ADVICE, FILES, REMEDIES, GRADIENTS, STRETCHING, DESIGNS
    yield from (words for table in tables for _, words, _ in table.values())
    for name, patterns in ELSEWHERE.items():
        file, test = name.split("::")
        assert f"def {test}(" in (TESTS / file).read_text(), name
        yield from patterns


def test_all_advice_is_followed_in_a_test():
    known, alone = [*covering(), *NO_ADVICE], []
    for path in sorted(HOME.rglob("*.py")):
        for line, text in messages(path):
            if ADVISES.search(text) and len(text.split()) > 2 and not any(re.search(words, text) for words in known):
                alone.append(f"{path.relative_to(HOME)}:{line}: {text}")
    assert not alone, "\n".join(alone)
