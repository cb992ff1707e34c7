"""The line on the terminal: name, progress and time left of what runs; clean where it is narrow or not a terminal."""

import io
import re

import pytest
from rich.console import Console
from scenes import SMALL

import fem_impact as fi
from fem_impact import display
from fem_impact._base import progress
from fem_impact._base.progress import observed, report, revise
from fem_impact.display import Display


class Clock:
    """A clock that is set by hand."""

    now = 100.0

    def monotonic(self):
        return self.now

    process_time = monotonic


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    for module in (display, progress):
        monkeypatch.setattr(module, "time", clock)
    return clock


def on_terminal(width, **options):
    shown = Display(**options)
    shown.console = Console(file=io.StringIO(), force_terminal=True, width=width, legacy_windows=False)
    return shown


def lines(shown):
    """What was written, line by line, without the codes that move the cursor."""
    return re.split(r"[\r\n]+", re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", shown.console.file.getvalue()))


@pytest.mark.parametrize(
    ("stage", "predicted", "steps"),  # of each: seconds that pass, what is then reported or predicted, the line
    [
        ("modes", None, [(0.0, ("vectors", 0, 100), "0/100 vectors, 0:00"),
                         (10.0, ("vectors", 20, 100), "20/100 vectors, 2/s, 0:10, 0:40 left"),  # 80 more at 2/s
                         (5.0, None, "20/100 vectors, 2/s, 0:15, 0:35 left"),
                         (0.0, ("vectors", 3, 400), "3/400 vectors, 0:15")]),  # another search begins
        # cells found in a store do not count as done just now
        ("cells", None, [(0.0, ("cells", 900, 1000), "900/1000, 0:00"),
                         (10.0, ("cells", 950, 1000), "950/1000, 5/s, 0:10, 0:10 left")]),
        # without a count the prediction tells
        ("strike", 3665.0, [(0.0, None, "0:00"), (5.0, None, "0:05, 1:01:00 left"),
                            (4000.0, None, "1:06:45, soon done"), (0.0, "none", "1:06:45")]),
        ("strike", 12.0, [(20.0, None, "0:20, soon done"), (10.0, None, "0:30, longer than predicted")]),
    ],
)  # fmt: skip
def test_the_line_tells_progress_and_the_time_left(clock, stage, predicted, steps):
    shown = on_terminal(100)
    if predicted:
        shown.predict(predicted)
    with shown(stage):
        for seconds, told, line in steps:
            clock.now += seconds
            if told == "none":
                shown.predict(None)
            elif told:
                report(*told)
            assert shown.status_line() == line


def test_a_stage_within_a_stage_has_its_own_name_and_the_outer_one_comes_back(clock):
    shown = on_terminal(100)
    with shown("modes"):
        report("vectors", 5, 100)
        with shown("mesh"):
            assert shown.running[-1][0] == "mesh" and shown.status_line() == "0:00"
        assert shown.status_line() == "5/100 vectors, 0:00" and shown.running[-1][0] == "modes"
    assert shown.status_line() == "" and shown.bar is None


@pytest.mark.parametrize("width", [20, 40, 59, 60, 100])
def test_a_line_is_never_wider_than_the_terminal_and_is_wiped_at_the_end(width):
    shown = on_terminal(width)
    shown.predict(1000.0)
    with shown("modes"):
        for i in range(3):
            report("vectors", 1000 * i, 100_000)
            shown.bar.refresh()
    said = lines(shown)
    assert max(map(len, said)) <= width and any("modes" in line for line in said) and said[-1].strip() == ""
    assert shown.console.file.getvalue().count("\n") <= 1  # one line, written over and over


def test_what_takes_long_is_announced_once_with_or_without_a_terminal(clock):
    said = []
    shown = Display(said.append)
    assert not shown.console.is_terminal
    with shown("hammers"):
        report("vectors", 1, 100)
        clock.now += 5.0
        report("vectors", 2, 100)  # not the hammers themselves
        for i in range(10):
            report("hammers", i, 10)
            clock.now += 4.0
    assert said == ["10 hammers: about 36 s more; Ctrl-C stops it"]


def test_a_command_that_takes_twice_as_long_as_predicted_says_so_at_once_and_again_when_that_doubles(clock):
    said = []
    shown = Display(said.append)
    shown.predict(12.0)
    with shown("vectors"):
        clock.now += 6.0
        revise(15.0)  # less than twice as long
        assert not said and shown.end == clock.now + 15.0
        revise(30.0)
        assert said == ["longer than predicted: about 30 s more; Ctrl-C stops it"]
        revise(40.0)  # nor is 46 s twice as long as 36
        clock.now += 67.0
        shown._overdue()  # by the alarm
        assert said[1:] == ["longer than predicted: 73 s so far; Ctrl-C stops it"]
        assert shown.alarm.interval == pytest.approx(73.0) and shown.alarm.daemon
    assert shown.alarm is None


def test_hammers_that_take_longer_than_the_first_ones_are_announced_again(clock):
    said = []
    shown = Display(said.append)
    with shown("hammers"):
        for i, seconds in enumerate([4.0, 4.0, 4.0, 40.0, 60.0]):
            report("hammers", i, 6)
            clock.now += seconds
    assert said[0] == "6 hammers: about 20 s more; Ctrl-C stops it"
    assert said[1:] == ["longer than predicted: 6 hammers: about 26 s more; Ctrl-C stops it"]


def test_nothing_is_written_where_stderr_is_not_a_terminal(tmp_path, prompt):
    (tmp_path / "scene.toml").write_text(SMALL)
    for words in ("strike scene.toml --tolerance 0.1", "hammer scene.toml --bandwidth 300 --masses 0.01"):
        said = prompt(words)
        assert (said.status, said.err) == (0, "")


def test_modes_hammers_and_maps_report_their_counts(tmp_path):
    told = []
    plate = fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=60)
    section = fi.Plate(fi.Material(70e9, 0.3, 2700.0), 2e-3)
    system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), section, supports={"boundary": "hinged"})
    beam = fi.assemble(fi.mesh.line(0.5), fi.Beam.rectangular(section.material, width=0.02, height=0.01), {})
    with observed(lambda *each: told.append(each)):
        fi.find_modes(system, n_modes=40)
        fi.find_modes(beam, n_modes=100)
        fi.hammers.choose(plate, (0.1, 0.1), 300.0, masses=[0.01, 0.02])
    counted = {what: [each for each in told if each[0] == what] for what in ("vectors", "modes", "hammers")}
    assert all(0 <= done <= total for _, done, total in told)
    assert counted["vectors"][0][1] < counted["vectors"][-1][1]
    assert [done for _, done, _ in counted["modes"]] == sorted({done for _, done, _ in counted["modes"]})
    assert [done for _, done, _ in counted["hammers"]] == [0, 1, 2]


def test_a_quiet_display_shows_nothing_even_on_a_terminal():
    shown = on_terminal(80, shown=False)
    with shown("modes"):
        report("modes", 1, 2)
    assert shown.console.file.getvalue() == ""
