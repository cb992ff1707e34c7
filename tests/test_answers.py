"""What commands print for programs: every command answers in JSON as its schema says, and its help has examples."""

import argparse
import json
import re
import shlex
from pathlib import Path

import pytest
from scenes import BAR, QUICK, SMALL
from test_cli import TEXT
from test_studies import study

import fem_impact as fi
from fem_impact import answers, arguments, cli

ROOT = Path(__file__).parents[1]
TAPS = ROOT / "studies" / "measured" / "acceleration.lvm"
KINDS = {"object": dict, "array": list, "string": str, "integer": int, "number": (int, float), "null": type(None)}
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
    "hammer, rove": "hammer small.toml --bandwidth 300 --masses 0.01 --rove 2 --out rove",
    "report": "report small.toml --out page.html",
    "play": "play small.toml --n-modes 3 --midi score.mid --silent --out played",
    "new": "new disk --out new",
    "mesh": "mesh small.toml --out edges.svg",
    "show": "show out",
    "doctor": "doctor",
    "completion": "completion bash",
    "frf": f"frf {TAPS} --response Acceleration --out frf",
    "fit": f"fit {TAPS} --response Acceleration --unknown contact.stiffness=1e5:1e13 --out fit",
}
SLOW = {"spread", "hammer, rove", "fit", "doctor", "report"}


def commands():
    (verbs,) = (each for each in arguments.parser()._actions if isinstance(each, argparse._SubParsersAction))
    return verbs.choices


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in (("small", TEXT), ("quick", QUICK), ("flam", SMALL + STROKES)):
        (tmp_path / f"{name}.toml").write_text(text)
    return tmp_path


def score(path):
    """A MIDI file of one note."""
    mido = pytest.importorskip("mido", reason="the extra play is not installed")
    file = mido.MidiFile(tracks=[mido.MidiTrack([mido.Message("note_on", note=60, velocity=90, time=10)])])
    file.save(path)


def test_every_command_has_keys_and_examples():
    assert set(commands()) == set(answers.EXAMPLES) == set(answers.KEYS) | {"schema"}
    ran = {name.partition(",")[0] for name in RUNS}
    assert ran == set(answers.KEYS) - {"explore"}  # tests/pages/test_explore.py


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in RUNS])
def test_every_answer_is_as_its_schema_says_and_quiet_commands_say_nothing_else(folder, capsys, name):
    if name == "play":
        score(folder / "score.mid")
    if name == "show":
        assert cli.main(["strike", "small.toml", "--out", "out", "--quiet"]) == 0
    if name == "completion":
        pytest.importorskip("shtab", reason="the extra completion is not installed")
    capsys.readouterr()
    command = name.partition(",")[0]
    assert cli.main([*shlex.split(RUNS[name]), "--json", "--quiet"]) in (0, 3)
    said = capsys.readouterr()
    assert said.err == ""
    found, schema = json.loads(said.out), answers.schema(command)
    assert found["command"] == command and found["format"] == answers.FORMAT
    assert set(schema["required"]) <= set(found) <= set(schema["properties"])
    for key, value in found.items():
        kinds = schema["properties"][key].get("type", list(KINDS))
        kinds = [kinds] if isinstance(kinds, str) else kinds
        assert isinstance(value, tuple(KINDS[each] for each in kinds) if kinds != list(KINDS) else object), key
    for file in found["files"]:
        assert (folder / found["folder"] / file).exists(), file


def test_schemas_of_answers_are_printed_and_an_unknown_command_is_refused(capsys):
    assert cli.main(["schema", "modes"]) == 0
    assert json.loads(capsys.readouterr().out) == answers.schema("modes")
    with pytest.raises(SystemExit):
        cli.main(["schema", "strik"])
    assert "did you mean" in capsys.readouterr().err


@pytest.mark.parametrize("command", answers.EXAMPLES)
def test_help_has_examples_that_the_parser_takes_and_exit_statuses(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        cli.main([command, "--help"])
    said = capsys.readouterr().out
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
def test_help_keeps_to_the_width_of_the_terminal(columns, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    for words in (["--help"], *([command, "--help"] for command in answers.EXAMPLES)):
        with pytest.raises(SystemExit):
            cli.main(words)
        lines = capsys.readouterr().out.splitlines()
        long = [line for line in lines if len(line) > columns and len(line.rstrip(" \\").split()) > 1]
        assert not long and len(lines) > 5  # a word of a command is never cut


@pytest.mark.parametrize(
    ("old", "new"),
    [("modes s.toml --count 3", "modes s.toml --n-modes 3"), ("play s.toml --modes 3", "play s.toml --n-modes 3"),
     ("play s.toml --port X", "play s.toml --midi-port X"), ("play s.toml --port", "play s.toml --midi-port")],
)  # fmt: skip
def test_older_spellings_mean_the_same_and_are_not_shown(old, new, capsys):
    before, after = (vars(arguments.parser().parse_args(words.split())) for words in (old, new))
    assert before == after
    with pytest.raises(SystemExit):
        cli.main([old.split()[0], "--help"])
    assert f"{old.split()[2]} " not in capsys.readouterr().out


def test_a_quiet_command_still_says_its_errors(folder, capsys):
    assert cli.main(["modes", "smal.toml", "--quiet"]) == 2
    assert capsys.readouterr().err.endswith("did you mean 'small.toml'?\n")


@pytest.mark.parametrize("out", ["there", "there/mine.svg"])
def test_out_is_a_folder_or_by_its_ending_the_file(folder, capsys, out):
    assert cli.main(["mesh", "small.toml", "--out", out, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == ["mine.svg" if "mine" in out else "mesh.png"]


def test_the_page_of_commands_is_current():
    page = study("commands")
    assert page.PAGE.read_text(encoding="utf-8") == page.page(), "run python studies/commands.py"


def test_explore_tells_its_address_as_json(folder, capsys, monkeypatch):
    monkeypatch.setattr(cli.fi.explore, "serve", lambda *_, ready, **__: ready("http://127.0.0.1:8000/"))
    assert cli.main(["explore", "small.toml", "--no-open", "--json"]) == 0
    found, schema = json.loads(capsys.readouterr().out), answers.schema("explore")
    assert found["address"] == "http://127.0.0.1:8000/" and set(schema["required"]) <= set(found)


def test_modes_counts_those_that_bend_and_tells_the_rigid_ones_in_a_line(tmp_path, capsys):
    (tmp_path / "bar.toml").write_text(BAR)  # free at both ends
    words = ["modes", str(tmp_path / "bar.toml"), "--n-modes", "4"]
    assert cli.main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "Modes 1 to 2 are rigid motions: nothing holds the body there" in lines
    assert [line.split()[0] for line in lines[-4:]] == ["3", "4", "5", "6"] and " 0 Hz" not in "".join(lines)
    assert cli.main([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["n_rigid"] == 2 and len(found["frequencies"]) == 6 and found["frequencies"][2] > 0.0


def test_hammer_says_that_its_tips_are_linear_and_what_the_contact_amounts_to(folder, capsys):
    words = ["hammer", "small.toml", "--bandwidth", "300", "--masses", "0.01", "--json"]
    assert cli.main(words) == 0
    (note,) = json.loads(capsys.readouterr().out)["notes"]
    assert "tips are linear springs [N/m]; the scene's contact is of another kind (hertz)" in note
    alike = float(note.split("a tip of ")[1].split()[0])
    law, mass, speed = fi.Contact.hertz(695e3), 0.03, 2.0  # as long on a rigid wall
    times = [fi.strike(fi.Modes.rigid(1e6), fi.Striker.rigid(mass), each, at=None, speed=speed).contact_time
             for each in (law, fi.Contact.linear(alike))]  # fmt: skip
    assert times[0] == pytest.approx(times[1], rel=1e-2)  # three digits are printed
    (folder / "small.toml").write_text(TEXT.replace('"hertz"', '"linear"'))
    assert cli.main(words) == 0
    assert json.loads(capsys.readouterr().out)["notes"] == []


def test_a_table_too_wide_for_the_terminal_becomes_lists(folder, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    assert cli.main(["mesh", "small.toml"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 40 and "left" in lines
    assert any(line.startswith("  length: 0.3 m") for line in lines)
