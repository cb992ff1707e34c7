"""What the README shows must run as it stands there."""

import re
import shlex
from pathlib import Path

import pytest

import fem_impact as fi

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


def test_python_example_runs_and_writes_its_files(tmp_path, monkeypatch, capsys):
    example = blocks("python")[0]
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(compile(example, "README.md", "exec"), names)
    # The stick weighs m/3 at its tip and the plate 200 g: it must rebound or follow, never gain speed.
    assert -1.0 < names["hit"].restitution < 1.0
    assert names["hit"].n_impacts >= 1
    assert f"{names['hit'].n_impacts}" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["force.png", "strike.wav"]


def test_python_example_of_a_plan_runs(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    exec(compile(blocks("python")[1], "README.md", "exec"), {"fi": fi})
    printed = capsys.readouterr().out
    assert "tolerance 0.001 of restitution will be met" in printed
    assert 0.2 < float(printed.splitlines()[-1]) < 0.4  # 0.314 on modes enough for 1e-4; fifty err by a few per cent


@pytest.mark.slow
def test_python_example_of_uncertain_inputs_runs(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(ROOT)
    example = blocks("python")[2].replace("spread.png", str(tmp_path / "spread.png"))
    names = {"fi": fi}
    exec(compile(example, "README.md", "exec"), names)
    assert "What should be measured better" in capsys.readouterr().out
    assert names["found"].n_failed == 0 and (tmp_path / "spread.png").is_file()


def test_python_example_of_a_design_runs(capsys):
    names = {"fi": fi}
    exec(compile(blocks("python")[3], "README.md", "exec"), names)
    assert "design found" in capsys.readouterr().out
    assert abs(names["found"].verify().values["mode1.frequency"] / 440.0 - 1.0) < 1e-3  # its tolerance


@pytest.mark.slow
def test_python_example_of_a_fit_runs(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    names = {"fi": fi}
    exec(compile(blocks("python")[4], "README.md", "exec"), names)
    assert "4 taps explained to 2.5 % rms" in capsys.readouterr().out
    low, high = names["found"].interval("contact.exponent")
    assert 1.5 < low < high < 1.9


def test_first_two_commands_are_single_lines_that_install_then_run_and_test():
    run, test = (block.strip() for block in blocks("sh")[:2])
    assert "\n" not in run and "\n" not in test
    assert run.split(" && ")[2].startswith(".venv/bin/fem-impact strike studies/scenes/drumstick.toml")
    assert test.endswith(".venv/bin/python -m pytest -n auto") and ".[test]" in test


def test_commands_shown_name_scenes_that_exist_and_load():
    shown = set(re.findall(r"studies/scenes/\w+\.toml", README))
    assert shown
    for name in shown:
        assert fi.load_scene(ROOT / name).title


@pytest.mark.parametrize(
    "line", [line for block in blocks("sh") for line in block.splitlines() if "fem-impact" in line]
)
def test_shown_commands_are_ones_the_parser_takes(line):
    from fem_impact import arguments

    words = shlex.split(line)
    start = next(i for i, word in enumerate(words) if word.endswith("fem-impact"))
    options = arguments.parser().parse_args(words[start + 1 :])  # exits with status 2 where an option does not exist
    assert "scene" not in options or options.scene.suffix in (".toml", ".lvm", ".msh")


def test_licence_is_the_one_the_package_declares():
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["license"] == "BSD-3-Clause" and project["license"] in README
