"""What commands print for programs: every command answers in JSON as its schema says, and its help has examples."""

import argparse
import re
import shlex

import mido
import pytest
from jsonschema import Draft7Validator
from scenes import BAR, QUICK, ROOT, SMALL, TITLED

import fem_impact as fi
from fem_impact import answers, arguments
from fem_impact.pages import lesson_grid

TAPS = ROOT / "studies" / "measured" / "acceleration.lvm"
STROKES = "[[stroke]]\nwhen = 0.03\n[[stroke]]\nwhen = 0.0\nspeed = 0.5\n"
RUNS = {  # words that run each command in a second or two
    "strike": "strike small.toml --out out --format svg",
    "strike, strokes": "strike flam.toml --out flam --duration 0.01",
    "plan": "plan small.toml",
    "plan, strokes": "plan flam.toml",
    "modes": "modes small.toml --n-modes 3",
    "map": "map quick.toml --out map",
    "spread": "spread small.toml --vary striker.mass=uniform(0.02,0.03) --blows 64 --no-sobol --out spread",
    "hammer": "hammer small.toml --bandwidth 300 --masses 0.01",
    "hammer, catalogue": "hammer small.toml --bandwidth 300 --catalogue 086 --out sheet",
    "hammer, bar": "hammer bar.toml --bandwidth 300 --catalogue 086C01 --out sheet",
    "hammer, rove": "hammer small.toml --bandwidth 300 --masses 0.01 --rove 2 --out rove",
    "tune": 'tune bar.toml --pitch "-5 cents" --out tuned',
    "watch": f"watch {TAPS.parent} --bandwidth 2000 --once --response Acceleration --out seen.png",
    "report": "report small.toml --out report.html",
    "page": "page small.toml --out page.html",
    "play": "play small.toml --n-modes 3 --midi score.mid --silent --out played",
    "new": "new disk --out new",
    "catalogue": "catalogue yarn",
    "mesh": "mesh small.toml --out edges.svg",
    "show": "show out",
    "doctor": "doctor",
    "verify": "verify beam two --out verify.png",
    "completion": "completion bash",
    "frf": f"frf {TAPS} --response Acceleration --out frf",
    "fit": f"fit {TAPS} --response Acceleration --unknown contact.stiffness=1e5:1e13 --out fit",
}
SLOW = {"spread", "watch", "hammer, rove", "hammer, catalogue", "hammer, bar", "fit", "doctor", "report", "page"}


def commands():
    (verbs,) = (each for each in arguments.parser()._actions if isinstance(each, argparse._SubParsersAction))
    return verbs.choices


@pytest.fixture
def folder(tmp_path):
    for name, text in (("small", TITLED), ("quick", QUICK), ("flam", SMALL + STROKES), ("bar", BAR)):
        (tmp_path / f"{name}.toml").write_text(text)
    return tmp_path


def score(path):
    """A MIDI file of one note."""
    file = mido.MidiFile(tracks=[mido.MidiTrack([mido.Message("note_on", note=60, velocity=90, time=10)])])
    file.save(path)


def test_every_command_has_keys_and_examples():
    assert set(commands()) == set(answers.EXAMPLES) == set(answers.KEYS) | {"schema"}
    ran = {name.partition(",")[0] for name in RUNS}
    assert ran == set(answers.KEYS) - {"explore"}  # tests/pages/test_explore.py


def marks(name):
    live = [pytest.mark.slow, pytest.mark.xdist_group("live")] if name == "play" else []  # one worker compiles
    return [pytest.mark.slow] if name in SLOW else live


@pytest.mark.parametrize("name", [pytest.param(name, marks=marks(name)) for name in RUNS])
def test_every_answer_is_as_its_schema_says_and_quiet_commands_say_nothing_else(folder, prompt, name, monkeypatch):
    monkeypatch.setattr(lesson_grid, "COUNTS", dict.fromkeys(lesson_grid.COUNTS, 3))  # a page of few blows
    if name == "play":
        score(folder / "score.mid")
    if name == "show":
        assert prompt("strike small.toml --out out --quiet").status == 0
    command = name.partition(",")[0]
    said = prompt(RUNS[name], "--json", "--quiet")
    assert said.status in (0, 3) and said.err == ""
    found, schema = said.json, answers.schema(command)
    assert found["command"] == command and found["format"] == answers.FORMAT
    Draft7Validator(schema).validate(found)
    assert set(found) <= set(schema["properties"])
    for file in found["files"]:
        assert (folder / found["folder"] / file).exists(), file


def test_schemas_of_answers_are_printed_and_an_unknown_command_is_refused(prompt):
    assert prompt("schema modes").json == answers.schema("modes")
    assert "did you mean" in prompt("schema strik").err


@pytest.mark.parametrize("command", answers.EXAMPLES)
def test_help_has_examples_that_the_parser_takes_and_exit_statuses(command, prompt, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    said = prompt(f"{command} --help").out
    assert "exit status: 0 done; 1 the run failed; 2 bad input" in said
    assert ("3 done, but the tolerance is missed" in " ".join(said.split())) == (command in answers.MISSES)
    shown = said[said.index("examples:") : said.index("exit status:")].replace(" \\\n   ", "")
    for line, wanted in zip(shown.splitlines()[1:], answers.EXAMPLES[command]):
        assert line.strip() == wanted
        words = shlex.split(re.sub(r"^eval \"\$\((.*)\)\"$", r"\1", wanted))
        assert words[0] == "fem-impact" and arguments.parser().parse_args(words[1:]).command == command
        for word in words:
            assert not word.startswith("studies/") or (ROOT / word).is_file()


@pytest.mark.parametrize("columns", [40, 80])
def test_help_keeps_to_the_width_of_the_terminal(columns, prompt, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    for command in ("", *answers.EXAMPLES):
        lines = prompt(f"{command} --help").out.splitlines()
        long = [line for line in lines if len(line) > columns and len(line.rstrip(" \\").split()) > 1]
        assert not long and len(lines) > 5 and "drums" not in [line[-5:] for line in lines]  # a path is never cut


@pytest.mark.parametrize(
    ("old", "new"),
    [("modes s.toml --count 3", "modes s.toml --n-modes 3"), ("play s.toml --modes 3", "play s.toml --n-modes 3"),
     ("play s.toml --port X", "play s.toml --midi-port X"), ("play s.toml --port", "play s.toml --midi-port")],
)  # fmt: skip
def test_older_spellings_mean_the_same_and_are_not_shown(old, new, prompt):
    before, after = (vars(arguments.parser().parse_args(words.split())) for words in (old, new))
    assert before == after
    assert f"{old.split()[2]} " not in prompt([old.split()[0], "--help"]).out


def test_a_quiet_command_still_says_its_errors(folder, prompt):
    said = prompt("modes smal.toml --quiet")
    assert said.status == 2 and said.err.endswith("did you mean 'small.toml'?\n")


@pytest.mark.parametrize(("out", "file"), [("there", "mesh.png"), ("there/mine.svg", "mine.svg")])
def test_out_is_a_folder_or_by_its_ending_the_file(folder, prompt, out, file):
    assert prompt("mesh small.toml --json --out", out).json["files"] == [file]


def test_explore_tells_its_address_as_json(folder, prompt, monkeypatch):
    monkeypatch.setattr(fi.explore, "serve", lambda *_, ready, **__: ready("http://127.0.0.1:8000/"))
    found, schema = prompt("explore small.toml --no-open --json").json, answers.schema("explore")
    assert found["address"] == "http://127.0.0.1:8000/" and set(schema["required"]) <= set(found)


def test_modes_counts_those_that_bend_and_tells_the_rigid_ones_in_a_line(tmp_path, prompt):
    (tmp_path / "bar.toml").write_text(BAR)  # free at both ends
    lines = prompt("modes bar.toml --n-modes 4").out.splitlines()
    assert "Modes 1 to 2 are rigid motions: nothing holds the body there" in lines
    assert [line.split()[0] for line in lines[-4:]] == ["3", "4", "5", "6"] and " 0 Hz" not in "".join(lines)
    found = prompt("modes bar.toml --n-modes 4 --json").json
    assert found["n_rigid"] == 2 and len(found["frequencies"]) == 6 and found["frequencies"][2] > 0.0


def test_hammer_says_that_its_tips_are_linear_and_what_the_contact_amounts_to(folder, prompt):
    words = "hammer small.toml --bandwidth 300 --masses 0.01 --json"
    (note,) = prompt(words).json["notes"]
    assert "tips are linear springs [N/m]; the scene's contact is of another kind (hertz)" in note
    (folder / "small.toml").write_text(TITLED.replace('"hertz"', '"linear"'))
    assert prompt(words).json["notes"] == []


def test_a_table_too_wide_for_the_terminal_becomes_lists(folder, prompt, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    lines = prompt("mesh small.toml").out.splitlines()
    assert max(map(len, lines)) <= 40 and "left" in lines
    assert any(line.startswith("  length: 0.3 m") for line in lines)
