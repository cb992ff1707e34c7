"""What README, guide, docstrings and the page of hats show must run as it stands there."""

import doctest
import inspect
import re
import shlex
import subprocess
import sys
from functools import partial
from pathlib import Path

import hats
import numpy as np
import pytest
from comparing import assert_printed
from scenes import ROOT
from signatures import everything

import fem_impact as fi
from fem_impact import arguments

README, GUIDE = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "studies/guide.md"))
NUMBER = r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]\d+)?"


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)


def run_block(page, number, **known):
    """The names that a block of Python on a page leaves, run as it stands there."""
    exec(compile(blocks(page, "python")[number], "page.md", "exec"), known)
    return known


SIX = re.findall(r"^`((?:fem-impact|python) [^`]+)`$", README, flags=re.MULTILINE)
LINES = [line for page in (README, GUIDE) for block in blocks(page, "sh") for line in block.splitlines()]
OURS = [line for line in LINES + SIX if "fem-impact " in line]


def test_the_front_page_is_short():
    assert README.count("\n") <= 120
    assert len(SIX) == 6 and README.count("![") == 7


def test_first_example_prints_what_the_page_says_with_a_clean_verdict(capsys):
    names = run_block(README, 0)
    # errors are estimates; another mesher moves them
    assert_printed(capsys.readouterr().out, blocks(README, "text")[0], NUMBER, rtol=0.1, atol=1e-12)
    assert names["hit"].trusted


def test_python_example_runs_and_writes_its_files(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    hit = run_block(GUIDE, 0)["hit"]
    assert -1.0 < hit.restitution < 1.0  # it must rebound or follow, never gain speed
    assert hit.n_impacts >= 1 and f"{hit.n_impacts}" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["force.png", "strike.wav"]


@pytest.mark.slow
def test_python_example_of_curved_plates_has_bodies_that_vibrate(monkeypatch):
    monkeypatch.chdir(ROOT)
    names = run_block(GUIDE, 1, fi=fi)
    cymbal, top, plywood = (names[name] for name in ("cymbal", "top", "plywood"))
    assert cymbal.theory == top.theory == "shallow" and plywood.plain
    first = fi.find_modes(cymbal, n_modes=1, tolerance=1e-3).frequencies[0]
    assert first == pytest.approx(28.44, rel=1e-3)  # as the scene's, in the picture of studies/README.md


slow = partial(pytest.param, marks=pytest.mark.slow)


@pytest.mark.parametrize(("call", "words", "holds"), [  # what a block calls and prints, and what then holds
    # 0.314 on modes enough for 1e-4; fifty err by a few per cent
    ("plan.but(", "tolerance 0.001 of restitution will be met", lambda _, said: 0.2 < float(said.split()[-1]) < 0.4),
    slow("fi.spread(", "What to measure better",
         lambda names, _: names["found"].n_failed == 0 and Path("spread.png").is_file()),
    slow("fi.band(", "inputs leave open",
         lambda names, _: names["known"]["restitution"].mostly == "section.thickness"),
    ("fi.design(", "design found",  # to its tolerance
     lambda names, _: abs(names["found"].verify().values["mode1.frequency"] / 440.0 - 1.0) < 1e-3),
    slow("fi.tune(", "0.3 mm at (0.05) and (0.3) m, radius 60 mm", lambda names, _: names["found"].met),
    slow("fi.fit(", "4 taps explained to 2.5 % rms",
         lambda names, _: (np.diff([1.5, *names["found"].interval("contact.exponent"), 1.9]) > 0.0).all()),
])  # fmt: skip
def test_python_examples_of_the_guide_run(call, words, holds, tmp_path, monkeypatch, capsys):
    (tmp_path / "studies").symlink_to(ROOT / "studies")
    monkeypatch.chdir(tmp_path)
    names = run_block(GUIDE, next(i for i, each in enumerate(blocks(GUIDE, "python")) if call in each), fi=fi)
    said = capsys.readouterr().out
    assert words in said and holds(names, said)


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
    words = shlex.split(re.split(r"fem-impact(?= )", line, maxsplit=1)[1])
    options = arguments.parser().parse_args(words)  # exits with status 2 where an option does not exist
    assert "scene" not in options or options.command == "show" or options.scene.suffix in (".toml", ".lvm", ".msh")


@pytest.mark.slow
@pytest.mark.parametrize("line", SIX, ids=lambda line: line.split()[1])
def test_the_six_commands_of_the_front_page_run(line, tmp_path, prompt):
    for name in ("studies", "meshes", "fem_impact"):
        (tmp_path / name).symlink_to(ROOT / name)
    program, *words = shlex.split(line)
    if program == "fem-impact":
        status, told, said = prompt(words)
    else:
        done = subprocess.run([sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, timeout=1800)
        status, told, said = done.returncode, done.stdout, done.stderr
    assert status == 0 and len(told.splitlines()) > 3, said


EXAMPLES = {name: item.__doc__ for name, item in everything().items() if ">>>" in (item.__doc__ or "")}


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_in_a_docstring_prints_what_it_says(name, tmp_path, monkeypatch):
    (tmp_path / "studies").symlink_to(ROOT / "studies")
    monkeypatch.chdir(tmp_path)
    example = doctest.DocTestParser().get_doctest(EXAMPLES[name], {"fi": fi, "np": np}, name, None, None)
    told: list[str] = []
    failed, tried = doctest.DocTestRunner().run(example, out=told.append)
    assert tried > 0 and not failed, "".join(told)


def test_every_function_of_the_first_rank_has_an_example():
    """All of `fi.name`, every mesh, body, striker and contact there is to make."""
    kinds = ("Striker.", "Contact.", "Beam.", "Modes.")
    constructors = {name for name, item in everything().items() if name.startswith(kinds) and inspect.ismethod(item)}
    made = {f"mesh.{name}" for name in ("rectangle", "disk", "polygon", "line", "outline", "load", "save")}
    made |= {f"analytic.{name}" for name in ("rectangle", "beam", "disk")}
    functions = {name for name in fi.__all__ if inspect.isfunction(getattr(fi, name))}
    assert constructors | made | functions <= set(EXAMPLES) | {"Modes.from_uff"}  # that one in export.write_uff


def test_every_hat_has_a_path_that_the_prompt_knows():
    assert set(hats.HATS) == {"percussionist", "test_engineer", "analyst", "teacher"}
    for hat in hats.HATS:
        commands, files = hats.path_of(hat)
        assert 2 <= len(commands) <= 4 and files
        for command in commands:
            words = shlex.split(command)
            assert arguments.parser().parse_args(words[1:]).command == words[1]


@pytest.mark.slow
@pytest.mark.thin(4)
@pytest.mark.parametrize("hat", hats.HATS)
def test_the_commands_of_a_hat_lead_to_its_files(hat, tmp_path, capsys):
    for command, seconds, done in hats.walk(hat, tmp_path):
        assert done.returncode in (0, 3) and done.stdout, done.stderr  # 3: done, but the tolerance is missed
        with capsys.disabled():
            print(f"\n{hat}: {seconds:.1f} s  {command}", end="")
    for name in hats.path_of(hat)[1]:
        assert (tmp_path / name).stat().st_size > 0, name
