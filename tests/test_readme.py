"""What README and guide show must run as it stands there."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fem_impact as fi
from fem_impact import arguments

ROOT = Path(__file__).parents[1]
README, GUIDE = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "studies/guide.md"))
NUMBER = r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]\d+)?"


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)


def words_of(line):
    """The words after `fem-impact` in a command."""
    words = shlex.split(line)
    return words[next(i for i, word in enumerate(words) if word.endswith("fem-impact")) + 1 :]


SIX = re.findall(r"^`((?:fem-impact|python) [^`]+)`$", README, flags=re.MULTILINE)
SHOWN = [line for page in (README, GUIDE) for block in blocks(page, "sh") for line in block.splitlines()]
OURS = [line for line in SHOWN + SIX if "fem-impact " in line]


def test_the_front_page_is_short():
    assert README.count("\n") <= 120
    assert len(SIX) == 6 and README.count("![") == 7


def test_first_example_prints_what_the_page_says(capsys):
    exec(compile(blocks(README, "python")[0], "README.md", "exec"), {})
    printed, stated = capsys.readouterr().out, blocks(README, "text")[0]
    assert re.sub(NUMBER, "#", printed) == re.sub(NUMBER, "#", stated), printed
    numbers = [[float(each) for each in re.findall(NUMBER, text)] for text in (printed, stated)]
    np.testing.assert_allclose(*numbers, rtol=0.1, atol=1e-12)  # errors are estimates; another mesher moves them


def test_first_example_has_a_clean_verdict():
    names = {}
    exec(compile(blocks(README, "python")[0], "README.md", "exec"), names)
    hit = names["hit"]
    assert hit.trusted


def test_python_example_runs_and_writes_its_files(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(compile(blocks(GUIDE, "python")[0], "guide.md", "exec"), names)
    assert -1.0 < names["hit"].restitution < 1.0  # it must rebound or follow, never gain speed
    assert names["hit"].n_impacts >= 1
    assert f"{names['hit'].n_impacts}" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["force.png", "strike.wav"]


@pytest.mark.slow
def test_python_example_of_curved_plates_has_bodies_that_vibrate(monkeypatch):
    monkeypatch.chdir(ROOT)
    names = {"fi": fi}
    exec(compile(blocks(GUIDE, "python")[1], "guide.md", "exec"), names)
    cymbal, top, plywood = (names[name] for name in ("cymbal", "top", "plywood"))
    assert cymbal.theory == top.theory == "shallow" and plywood.plain
    first = fi.find_modes(cymbal, n_modes=1, tolerance=1e-3).frequencies[0]
    assert first == pytest.approx(28.44, rel=1e-3)  # as the scene's, in the picture of studies/README.md


def test_python_example_of_a_plan_runs(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    exec(compile(blocks(GUIDE, "python")[2], "guide.md", "exec"), {"fi": fi})
    printed = capsys.readouterr().out
    assert "tolerance 0.001 of restitution will be met" in printed
    assert 0.2 < float(printed.splitlines()[-1]) < 0.4  # 0.314 on modes enough for 1e-4; fifty err by a few per cent


@pytest.mark.slow
def test_python_example_of_uncertain_inputs_runs(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(ROOT)
    example = blocks(GUIDE, "python")[3].replace("spread.png", str(tmp_path / "spread.png"))
    names = {"fi": fi}
    exec(compile(example, "guide.md", "exec"), names)
    assert "What to measure better" in capsys.readouterr().out
    assert names["found"].n_failed == 0 and (tmp_path / "spread.png").is_file()


@pytest.mark.slow
def test_python_example_of_a_scene_as_known_runs(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    names = {"fi": fi}
    exec(compile(blocks(GUIDE, "python")[4], "guide.md", "exec"), names)
    assert "inputs leave open" in capsys.readouterr().out
    assert names["known"]["restitution"].mostly == "section.thickness"


def test_python_example_of_a_design_runs(capsys):
    names = {"fi": fi}
    exec(compile(blocks(GUIDE, "python")[5], "guide.md", "exec"), names)
    assert "design found" in capsys.readouterr().out
    assert abs(names["found"].verify().values["mode1.frequency"] / 440.0 - 1.0) < 1e-3  # its tolerance


@pytest.mark.slow
def test_python_example_of_a_fit_runs(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    names = {"fi": fi}
    exec(compile(next(each for each in blocks(GUIDE, "python") if "fi.fit(" in each), "guide.md", "exec"), names)
    assert "4 taps explained to 2.5 % rms" in capsys.readouterr().out
    low, high = names["found"].interval("contact.exponent")
    assert 1.5 < low < high < 1.9


def test_first_two_commands_are_single_lines_that_install_then_run_and_test():
    run, test = (block.strip() for block in blocks(README, "sh")[:2])
    assert "\n" not in run and "\n" not in test
    assert run.split(" && ")[2].startswith(".venv/bin/fem-impact strike studies/scenes/drumstick.toml")
    assert test.endswith(".venv/bin/python -m pytest -n auto") and ".[test]" in test
    assert next(line for line in README.splitlines() if "-m pytest" in line) == test  # as `.ci/run` looks for it


def test_commands_shown_name_scenes_that_exist_and_load():
    shown = set(re.findall(r"studies/scenes/\w+\.toml", README + GUIDE))
    assert shown
    for name in shown:
        assert fi.load_scene(ROOT / name).title


@pytest.mark.parametrize("line", sorted(set(OURS)))
def test_shown_commands_are_ones_the_parser_takes(line):
    options = arguments.parser().parse_args(words_of(line))  # exits with status 2 where an option does not exist
    assert "scene" not in options or options.command == "show" or options.scene.suffix in (".toml", ".lvm", ".msh")


@pytest.mark.slow
@pytest.mark.parametrize("line", SIX, ids=lambda line: line.split()[1])
def test_the_six_commands_of_the_front_page_run(line, tmp_path):
    start = [sys.executable] if line.startswith("python ") else [sys.executable, "-m", "fem_impact"]
    for name in ("studies", "meshes", "fem_impact"):
        (tmp_path / name).symlink_to(ROOT / name)
    done = subprocess.run([*start, *shlex.split(line)[1:]], cwd=tmp_path, capture_output=True, text=True, timeout=1800)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) > 3
