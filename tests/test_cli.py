"""The command line: what it prints, what it writes, and how it fails."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista
from numpy.testing import assert_allclose
from scenes import TITLED
from scipy.io import wavfile

import fem_impact as fi
from fem_impact import answers, arguments, cli


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TITLED)
    return path


def names(folder):
    return sorted(path.name for path in folder.glob("[!.]*"))


def test_strike_writes_every_file_and_prints_a_summary(scene, tmp_path, prompt):
    out = tmp_path / "out" / "small"  # named after the scene
    ran = prompt("strike small.toml")
    every = ["force.csv", "force.png", "modes", "modes.pvd", "response.json", "response.npz", "strike.wav"]
    assert ran.status == 0 and names(out) == every
    data = json.loads((out / "response.json").read_text())
    for word in ("A small test", "Time: mesh", "strike", "files", "total", "response.json", f"Files in {Path('out')}"):
        assert word in ran.out
    assert data["scene"]["contact"] == {"kind": "hertz", "stiffness": 695e3}
    assert data["versions"]["fem-impact"] == fi.__version__
    assert data["response"]["n_impacts"] == len(data["impacts"]) > 0
    assert pyvista.get_reader(out / "modes.pvd").time_values[0] == pytest.approx(100.0, rel=1e-9)
    assert prompt("strike small.toml --target rigid").status in (0, 3)  # no modes, no sound
    assert names(out) == ["force.csv", "force.png", "response.json", "response.npz"]


def test_a_strike_writes_nothing_where_one_file_cannot_be_written(scene, tmp_path, prompt):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "modes").write_text("mine")
    ran = prompt("strike small.toml --out out")
    assert (ran.status, ran.err) == (answers.Status.FAILED, f"fem-impact: {Path('out/modes')}: Not a directory\n")
    assert names(tmp_path / "out") == ["modes"]


LISTENER = (0.5, 0.3, 1.0)


def heard(scene, prompt, words=""):
    """Strike the scene's plate: samples of radiated.wav [Pa], what response.json holds and what is printed."""
    ran = prompt(f"strike {scene.name} --out out {words}")
    data = json.loads(Path("out/response.json").read_text())
    rate, samples = wavfile.read("out/radiated.wav")
    assert ran.status == 0 and rate == 48_000 and "radiated.wav" in data["files"]
    return samples.astype(float) * data["radiated"]["full_scale"], data, ran.out


def test_sound_radiated_to_a_listener_is_written_in_pascal_and_grows_with_the_speed(scene, prompt):
    loud = TITLED.replace('"hertz"', '"linear"').replace("695e3", "1e5").replace("mass = 0.03", "mass = 0.003")
    scene.write_text(loud + f"[observe]\nlistener = {list(LISTENER)}\n")
    pressure, data, said = heard(scene, prompt, "--target modal")
    noted, told = data["radiated"], fi.load_scene(scene)
    assert noted["unit"] == "Pa" and noted["listener"] == list(LISTENER)
    wanted = fi.sound.radiate(told.run(target="modal").response, LISTENER)  # Rayleigh's integral, see test_sound
    bound = 1e-6 * np.abs(pressure).max()  # 32-bit samples
    early = slice(24_000)  # the end is faded
    assert_allclose(pressure[early], wanted.samples[early] * wanted.full_scale, rtol=0, atol=bound)
    assert f"peak {noted['level']:.1f} dB re 20 µPa" in said
    assert_allclose(noted["level"], 20 * np.log10(np.abs(pressure).max() / 20e-6), atol=1e-5)
    # the listener of the command is that of the scene; a linear contact scales exactly
    scene.write_text(loud.replace("speed = 2.0", "speed = 1.0"))
    soft, again, _ = heard(scene, prompt, "--target modal --listener 0.5 0.3 1.0")
    assert again["scene"]["observe"] == {"listener": list(LISTENER)}
    assert_allclose(pressure, 2.0 * soft, rtol=0, atol=bound)
    assert_allclose(noted["level"] - again["radiated"]["level"], 20 * np.log10(2.0), atol=1e-6)
    players = fi.report._sounds(fi.load_scene(scene).heard_from(list(LISTENER)), told.strike())
    assert "Sound radiated to (0.5, 0.3, 1)\N{NO-BREAK SPACE}m" in [player["name"] for player in players]


def test_json_is_printed_as_it_is_written_and_the_tolerance_of_the_command_replaces_that_of_the_scene(scene, prompt):
    loose = prompt("strike small.toml --out out --json").json
    ours = {"command": "strike", "format": answers.FORMAT, "folder": "out"}
    ours["see"] = ["notes.md#not-known", "notes.md#still-air"]
    assert loose == json.loads(Path("out/response.json").read_text()) | ours
    tight = prompt("strike small.toml --out out --json --tolerance 1e-4").json
    assert tight["scene"]["strike"]["tolerance"] == 1e-4
    assert tight["response"]["n_modes"] > loose["response"]["n_modes"]


def test_bad_scene_is_one_line_status_2_and_no_file(scene, tmp_path, prompt):
    scene.write_text(TITLED.replace("speed = 2.0", "sped = 2.0"))
    ran = prompt("strike small.toml --out deep/out")
    assert (ran.status, ran.out, ran.err.count("\n")) == (2, "", 1)
    text = "[strike] sped is not a key of this table; did you mean 'speed'?"
    assert ran.err.startswith(f"fem-impact: small.toml: {text}") and names(tmp_path) == ["small.toml"]


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        ("strike smal.toml", 2, "fem-impact: smal.toml: there is no such file; did you mean 'small.toml'?\n"),
        ("strike other.toml", 2, "there is no such file\n"),  # alike only in the ending
        ("modes no/x.toml", 2, f"fem-impact: {Path('no/x.toml')}: there is no such file\n"),
        ("strike pipe", 2, "it is not a regular file"),  # and never ends
        ("modes small.toml --n-modes 0", 2, "n_modes must be at least 1"),
        ("modes small.toml --n-modes -3", 2, "n_modes must be at least 1"),
        ("strike small.toml --out small.toml/out", 1, "small.toml"),
        ("strike small.toml --duration -1", 2, "--duration must be positive, got -1 s"),  # also where nothing rings
        ("strik small.toml", 2, "did you mean strike?"),
        ("strike small.toml --tolerence 1", 2, "did you mean --tolerance?"),
        ("frf small.toml --bandwith 1", 2, "see fem-impact frf --help"),
        ("frf small.toml --bandwidth 1", 2, "; --bandwidth is an option of hammer, watch\n"),
        ("modes small.toml --vkt x.vtu", 2, "did you mean --vtk?"),
        ("hammer small.toml", 2, "required: --bandwidth; see fem-impact hammer --help"),
        ("hammer small.toml --bandwidth -1 --out x.xyz", 2, "path ending must be one of"),
        ("modes small.toml --n-modes x", 2, "invalid int value: 'x'; see fem-impact modes --help"),
        ("map small.toml --format zar", 2, "did you mean zarr?"),
        ("play small.toml --silent a.wav", 2, "unrecognized arguments: a.wav; see fem-impact play --help"),
        ("", 2, "required: COMMAND; see fem-impact --help"),
        ("strike ''", 2, "argument SCENE: it must be the path of a file, got ''"),
        (f"report small.toml --out {'x' * 300}", 2, "argument --out: it must be the path of a file"),
        ("'\x1b[31m'", 2, r"'\x1b[31m'"),
    ],
)
def test_a_mistake_is_one_line_that_says_what_was_meant(scene, tmp_path, prompt, words, status, said):
    os.mkfifo(tmp_path / "pipe")
    ran = prompt(words)
    assert (ran.status, ran.out) == (status, "") and said in ran.err
    assert ran.err.startswith("fem-impact: ") and ran.err[:-1].isprintable() and ran.err.count("\n") == 1
    assert ran.err.endswith(said) or not said.endswith("\n")
    assert names(tmp_path) == ["pipe", "small.toml"]


@pytest.mark.parametrize(
    ("place", "failure", "status", "said"),
    [
        ("figures.save", fi.SimulationError("energy drifted"), 1, "energy drifted\n"),
        ("export.write_json", KeyboardInterrupt(), 130, "interrupted; nothing was written"),
        ("export.write_wav", OSError(28, "No space left on device"), 1, "No space left on device\n"),
    ],
)
def test_a_failed_or_interrupted_run_is_a_sentence_and_leaves_nothing(
    scene, tmp_path, prompt, monkeypatch, place, failure, status, said
):
    def fail(*_, **__):
        raise failure

    monkeypatch.setattr(f"fem_impact.{place}", fail)
    ran = prompt("strike small.toml --out out")
    assert ran.status == status and ran.err.startswith(f"fem-impact: {said}")
    assert not (tmp_path / "out").exists()


def test_modes_are_listed_and_written(scene, tmp_path, prompt):
    ran = prompt("modes small.toml --n-modes 5 --vtk m.pvd")
    lines = ran.out.splitlines()
    assert ran.status == 0 and lines[0] == "A small test" and sum("Hz" in line for line in lines) == 5
    assert lines[2].split() == ["1", "100", "Hz", "0.01"]
    assert len(list((tmp_path / "m").glob("*.vtu"))) == 5
    found = prompt("modes small.toml --n-modes 3 --json").json["frequencies"]
    assert found[0] == pytest.approx(100.0) and len(found) == 3


@pytest.mark.parametrize("columns", [20, 200])
@pytest.mark.slow
def test_summary_keeps_to_the_width_of_the_terminal(scene, prompt, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    ran = prompt("strike small.toml --out o")
    long = [line for line in ran.out.splitlines() if len(line) > min(columns, 88)]
    assert ran.status == 0 and all(len(line.split()) == 1 for line in long)  # a path is never cut


HEAVY = {"numpy", "scipy", "skfem", "numba", "matplotlib", "vtk", "pyvista", "meshio", "netgen", "shapely"}
TABLES = {"xarray", "pandas", "scipy.stats"}  # of maps, spreads and fits: as long to load as a small blow takes


@pytest.mark.parametrize(
    ("words", "said", "heavy"),
    [
        ("--help", "strike", HEAVY),
        ("--version", fi.__version__, HEAVY),
        pytest.param("strike small.toml", "restitution", TABLES, marks=pytest.mark.slow),
    ],
)
def test_commands_load_nothing_that_they_do_not_need(scene, words, said, heavy):
    code = (
        "import sys; from fem_impact import cli\n"
        "try: assert not cli.main(sys.argv[1:])\nexcept SystemExit as end: assert not end.code\n"
        f"assert not {heavy} & set(sys.modules), {heavy} & set(sys.modules)"
    )
    command = [sys.executable, "-c", code, *words.split()]
    run = subprocess.run(command, capture_output=True, text=True, cwd=scene.parent)
    assert run.returncode == 0, run.stderr
    assert said in run.stdout


def test_closed_pipe_is_no_error(scene, tmp_path):
    command = f"{sys.executable} -m fem_impact.cli modes {scene} --n-modes 20 | head -n 1"
    environment = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[1])}
    run = subprocess.run(["bash", "-c", command], capture_output=True, text=True, env=environment)
    assert run.stdout == "A small test\n" and run.stderr == ""


def test_completion_offers_verbs_options_and_files(tmp_path):
    script = arguments.completion("bash").data["script"]
    (tmp_path / "plate.toml").touch()

    def offered(*words):
        line = " ".join(f"'{word}'" for word in words)
        code = f"{script}\nCOMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; _shtab_fem_impact; echo ${{COMPREPLY[@]}}"
        run = subprocess.run(["bash", "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
        return sorted(set(run.stdout.split()))

    assert offered("fem-impact", "st") == ["strike"]
    assert offered("fem-impact", "strike", "--to") == ["--tolerance"]
    assert offered("fem-impact", "modes", "a.toml", "--") == ["--help", "--json", "--n-modes", "--quiet", "--vtk"]
    assert offered("fem-impact", "modes", "pl") == offered("fem-impact", "map", "x", "--out", "pl") == ["plate.toml"]


def test_shapes_that_cannot_be_written_are_told_before_the_work(scene, prompt, monkeypatch):
    monkeypatch.setattr(fi.Scene, "modes", lambda *_, **__: pytest.fail("the work must not begin"))
    ran = prompt("modes small.toml --vtk m.stl")
    assert ran.status == 2 and "path ending must be one of .vtu, .pvd" in ran.err
    ran = prompt("modes small.toml --vtk small.toml/m.pvd")
    assert ran.status == 1 and ran.err.count("\n") == 1


def test_uncompiled_kernels_run_as_plain_python(monkeypatch, tmp_path):
    home, kept = tmp_path / "impact" / "compiled", tmp_path / "kept" / "compiled_0"
    for folder in (home / "__pycache__", kept):
        folder.mkdir(parents=True)
    (home / "energy.py").write_text("")
    monkeypatch.setattr(fi, "__file__", str(tmp_path / "__init__.py"))
    monkeypatch.delitem(sys.modules, "numba", raising=False)

    def plain(once=True, **environment):
        """Whether kernels run as plain Python, and what the environment then says."""
        return cli._prepare(environment, once=once), environment

    alone, said = plain()
    assert alone and said["NUMBA_DISABLE_JIT"] == said["OMP_NUM_THREADS"] == "1"
    chosen = {"NUMBA_DISABLE_JIT": "0", "OMP_NUM_THREADS": "7"}
    follows, said = plain(**chosen)
    assert not follows and chosen.items() <= said.items()
    assert "NUMBA_DISABLE_JIT" not in plain(once=False)[1]
    assert plain(NUMBA_CACHE_DIR=str(kept.parent))[0]  # where nothing is compiled yet
    for folder in (home / "__pycache__", kept):
        (folder / "energy.follow-1.py311.nbi").write_text("")
    assert not plain(NUMBA_CACHE_DIR=str(kept.parent))[0]
    compiled, said = plain()
    assert not compiled and "NUMBA_DISABLE_JIT" not in said


def test_pictures_come_in_the_format_asked_for(scene, tmp_path, prompt):
    out = tmp_path / "out"
    assert prompt("strike small.toml --out out --format svg").status == 0
    assert (out / "force.svg").read_text().startswith("<?xml") and not (out / "force.png").exists()
    assert "force.svg" in json.loads((out / "response.json").read_text())["files"]
    ran = prompt("mesh small.toml --out out/edges.png --format pdf")
    assert ran.status == 0 and (out / "edges.pdf").read_bytes().startswith(b"%PDF") and "edges.pdf" in ran.out


def test_a_map_takes_a_format_of_its_numbers_and_one_of_its_pictures(scene, tmp_path, prompt):
    scene.write_text(TITLED + '[map.over]\n"striker.mass" = [0.03, 0.05]\n"contact.stiffness" = [1e5, 2e5]\n')
    assert prompt("map small.toml --out map --format nc --format svg").status == 0
    assert {file.suffix for file in (tmp_path / "map").glob("[!.]*")} == {".nc", ".csv", ".svg"}
