"""The command line: what it prints, what it writes, and how it fails."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scenes import SMALL
from scipy.io import wavfile

import fem_impact as fi
from fem_impact import answers, arguments, cli

SCENES = Path(__file__).parents[1] / "studies" / "scenes"
TEXT = 'title = "A small test"' + SMALL


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TEXT)
    return path


def test_strike_writes_every_file_and_prints_a_summary(scene, tmp_path, capsys):
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "out")]) == 0
    written = sorted(path.name for path in (tmp_path / "out").glob("[!.]*"))
    assert written == ["force.csv", "force.png", "modes", "modes.pvd", "response.json", "response.npz", "strike.wav"]
    printed = capsys.readouterr().out
    data = json.loads((tmp_path / "out" / "response.json").read_text())
    for word in ("A small test", "Time: mesh", "strike", "files", "total", "response.json", str(tmp_path / "out")):
        assert word in printed
    assert data["scene"]["contact"] == {"kind": "hertz", "stiffness": 695e3}
    assert data["versions"]["fem-impact"] == fi.__version__
    assert data["response"]["n_impacts"] == len(data["impacts"]) > 0
    reader = pyvista.get_reader(tmp_path / "out" / "modes.pvd")
    assert reader.time_values[0] == pytest.approx(100.0, rel=1e-9)
    rigid = ["strike", str(scene), "--out", str(tmp_path / "out"), "--target", "rigid"]
    assert cli.main(rigid) in (0, 3)  # no modes, no sound
    written = sorted(path.name for path in (tmp_path / "out").glob("[!.]*"))
    assert written == ["force.csv", "force.png", "response.json", "response.npz"]


def test_a_strike_writes_nothing_where_one_file_cannot_be_written(scene, tmp_path, capsys):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "modes").write_text("mine")
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "out")]) == cli.FAILED
    assert capsys.readouterr().err == f"fem-impact: {tmp_path / 'out' / 'modes'}: Not a directory\n"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["modes"]


def hear(scene, folder, speed=2.0):
    """Strike the scene's plate and return the samples of radiated.wav [Pa] and what the command notes of them."""
    text = TEXT.replace("speed = 2.0", f"speed = {speed}").replace('"hertz"', '"linear"')
    text = text.replace("damping_ratio = 0.01", "damping_ratio = 0.002").replace("695e3", "1e5")
    text = text.replace("mass = 0.03", "mass = 0.003")  # light: gone before the first mode swings back
    scene.write_text(text + "[observe]\nlistener = [0.5, 0.3, 1.0]\n")
    assert cli.main(["strike", str(scene), "--out", str(folder)]) == 0
    rate, samples = wavfile.read(folder / "radiated.wav")
    said = json.loads((folder / "response.json").read_text())["radiated"]
    assert rate == 48_000 and said["unit"] == "Pa" and said["listener"] == [0.5, 0.3, 1.0]
    return samples.astype(float) * said["full_scale"], said


def test_sound_radiated_to_a_listener_rings_at_the_modes_and_decays_with_them(scene, tmp_path, capsys):
    pressure, said = hear(scene, tmp_path / "out")
    times = np.arange(len(pressure)) / 48_000
    frequencies = fi.load_scene(scene).modes(5).frequencies
    # hinged 0.465 x 0.3 m: modes (1,1), (2,1), (3,1), (1,2), (2,2) in the ratio of their squared wave numbers
    m, n = np.array([1, 2, 3, 1, 2]), np.array([1, 1, 1, 2, 2])
    squares = (m / 0.465) ** 2 + (n / 0.3) ** 2
    assert_allclose(np.sort(frequencies), np.sort(100.0 * squares / squares[0]), rtol=1e-9)
    spectrum = np.abs(np.fft.rfft(pressure))
    bins = np.fft.rfftfreq(len(pressure), 1 / 48_000)
    inner = np.flatnonzero((spectrum[1:-1] > spectrum[:-2]) & (spectrum[1:-1] > spectrum[2:])) + 1
    peaks = inner[(spectrum[inner] > 0.02 * spectrum.max()) & (bins[inner] < 405.0)]
    # bins are 0.2 Hz apart; a neighbour's flank shifts a peak by less than one
    assert_allclose(bins[peaks], np.sort(frequencies), rtol=0, atol=2 * bins[1])
    for frequency in frequencies:
        ring = pressure * np.exp(-2j * np.pi * frequency * times)
        early, late = (np.abs((ring[a : a + 24000] * np.hanning(24000)).sum()) for a in (9600, 9600 + 24000))
        # 3 %: half a second of a Hann window keeps a neighbour 23 Hz away 60 dB down
        assert_allclose(np.log(early / late) / 0.5, 0.002 * 2 * np.pi * frequency, rtol=0.03)
    assert f"peak {said['level']:.1f} dB re 20 µPa" in capsys.readouterr().out
    assert_allclose(said["level"], 20 * np.log10(np.abs(pressure).max() / 20e-6), atol=1e-5)  # 32-bit samples


@pytest.mark.slow
def test_twice_the_speed_sounds_six_decibel_louder(scene, tmp_path):
    (soft, low), (loud, high) = (hear(scene, tmp_path / str(speed), speed=speed) for speed in (1.0, 2.0))
    # a linear contact scales exactly; what is left is the 32 bits of a sample
    assert_allclose(loud, 2.0 * soft, rtol=0, atol=1e-6 * np.abs(loud).max())
    assert_allclose(high["level"] - low["level"], 20 * np.log10(2.0), atol=1e-6)


@pytest.mark.slow
def test_listener_of_the_command_is_the_one_of_the_scene(scene, tmp_path, capsys):
    _, said = hear(scene, tmp_path / "one")
    scene.write_text(scene.read_text().partition("[observe]")[0])
    place = ["--listener", "0.5", "0.3", "1.0"]
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "two"), *place]) == 0
    again = json.loads((tmp_path / "two" / "response.json").read_text())
    assert again["radiated"] == said and again["scene"]["observe"] == {"listener": [0.5, 0.3, 1.0]}
    assert "radiated.wav" in again["files"]
    heard = fi.report._sounds(fi.load_scene(scene).heard_from([0.5, 0.3, 1.0]), fi.load_scene(scene).strike())
    assert "Sound radiated to (0.5, 0.3, 1)\N{NO-BREAK SPACE}m" in [player.name for player in heard]
    assert cli.main(["strike", str(scene), *place[:3], "0"]) == 2
    assert "[observe] listener must lie off the plate's plane" in capsys.readouterr().err


def test_json_is_printed_as_it_is_written(scene, tmp_path, capsys):
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "out"), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    ours = {"command": "strike", "format": answers.FORMAT, "folder": str(tmp_path / "out")}
    ours["see"] = ["notes.md#not-known", "notes.md#still-air"]
    assert printed == json.loads((tmp_path / "out" / "response.json").read_text()) | ours


def test_tolerance_of_the_command_replaces_that_of_the_scene(scene, tmp_path, capsys):
    cli.main(["strike", str(scene), "--out", str(tmp_path / "out"), "--json"])
    loose = json.loads(capsys.readouterr().out)
    cli.main(["strike", str(scene), "--out", str(tmp_path / "out"), "--json", "--tolerance", "1e-4"])
    tight = json.loads(capsys.readouterr().out)
    assert tight["scene"]["strike"]["tolerance"] == 1e-4
    assert tight["response"]["n_modes"] > loose["response"]["n_modes"]


def test_files_go_to_a_folder_named_after_the_scene(scene, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["strike", str(scene)]) == 0
    assert (tmp_path / "out" / "small" / "response.json").is_file()
    assert f"Files in {Path('out/small')}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("speed = 2.0", "sped = 2.0", "[strike] sped is not a key of this table; did you mean 'speed'?"),
        ("mass = 0.03", "mass = -0.03", "[striker] mass must be positive, got -0.03 kg"),
        ("stiffness = 695e3", "stiffness = nan", "[contact] stiffness must be finite, got nan"),
        ("at = [0.1395, 0.09]", "at = [0.1395, 0.9]", "[strike] at must lie on the body, got (0.1395, 0.9) m"),
    ],
)
def test_bad_scene_is_one_line_status_2_and_no_file(scene, tmp_path, capsys, old, new, text):
    scene.write_text(TEXT.replace(old, new))
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "deep" / "out")]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.startswith(f"fem-impact: {scene}: {text}")
    assert captured.err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["small.toml"]


def test_bad_tolerance_of_the_command_is_told(scene, tmp_path, capsys):
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "out"), "--tolerance", "-1"]) == 2
    assert "tolerance must lie between 1e-12 and 1, got -1" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_missing_scene_is_a_sentence_with_the_nearest_name(scene, tmp_path, capsys):
    assert cli.main(["strike", str(tmp_path / "smal.toml")]) == 2
    said = capsys.readouterr().err
    assert said == f"fem-impact: {tmp_path / 'smal.toml'}: there is no such file; did you mean 'small.toml'?\n"
    assert cli.main(["strike", str(tmp_path / "other.toml")]) == 2  # alike only in the ending
    assert capsys.readouterr().err.endswith("there is no such file\n")
    assert cli.main(["modes", str(tmp_path / "no" / "x.toml")]) == 2
    assert capsys.readouterr().err == f"fem-impact: {tmp_path / 'no' / 'x.toml'}: there is no such file\n"


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["strik", "SCENE"], "did you mean strike?"),
        (["strike", "SCENE", "--tolerence", "1"], "did you mean --tolerance?"),
        (["modes", "SCENE", "--vkt", "x.vtu"], "did you mean --vtk?"),
        (["hammer", "SCENE"], "required: --bandwidth; see fem-impact hammer --help"),
        (["modes", "SCENE", "--n-modes", "x"], "invalid int value: 'x'; see fem-impact modes --help"),
        (["map", "SCENE", "--format", "zar"], "did you mean zarr?"),
        (["play", "SCENE", "--silent", "a.wav"], "unrecognized arguments: a.wav; see fem-impact play --help"),
        ([], "required: COMMAND; see fem-impact --help"),
        (["strike", ""], "argument SCENE: it must be the path of a file, got ''"),
        (["report", "SCENE", "--out", "x" * 300], "argument --out: it must be the path of a file"),
        (["\x1b[31m"], r"'\x1b[31m'"),
    ],
)
def test_typo_is_one_line_with_the_nearest_word(words, hint, capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(words)
    said = capsys.readouterr().err
    assert end.value.code == 2 and hint in said
    assert said.startswith("fem-impact: ") and said[:-1].isprintable()


def test_scene_may_not_be_a_pipe_that_never_ends(tmp_path, capsys):
    os.mkfifo(tmp_path / "scene.toml")
    assert cli.main(["strike", str(tmp_path / "scene.toml")]) == 2
    assert "it is not a regular file" in capsys.readouterr().err


def test_a_billion_modes_are_refused(scene, capsys):
    assert cli.main(["modes", str(scene), "--n-modes", "1000000000"]) == 2
    assert "count must be at most 50000 modes for this scene, got 1000000000" in capsys.readouterr().err


def test_place_that_cannot_be_written_to_is_a_sentence(scene, tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "file" / "out")]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_failed_run_is_a_sentence_and_leaves_nothing(scene, tmp_path, capsys, monkeypatch):
    def fail(*_, **__):
        raise fi.SimulationError("energy drifted")

    monkeypatch.setattr(fi.figures, "save", fail)
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "out")]) == 1
    assert capsys.readouterr().err == "fem-impact: energy drifted\n"
    assert not (tmp_path / "out").exists()


def test_interrupted_run_leaves_nothing(scene, tmp_path, capsys, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(fi.export, "write_json", interrupt)
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "out")]) == 130
    assert "interrupted; nothing was written" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_modes_are_listed_and_written(scene, tmp_path, capsys):
    assert cli.main(["modes", str(scene), "--n-modes", "5", "--vtk", str(tmp_path / "m.pvd")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "A small test" and sum("Hz" in line for line in lines) == 5
    assert lines[2].split() == ["1", "100", "Hz", "0.01"]
    assert len(list((tmp_path / "m").glob("*.vtu"))) == 5


def test_modes_as_json(scene, capsys):
    assert cli.main(["modes", str(scene), "--n-modes", "3", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["frequencies"][0] == pytest.approx(100.0) and len(data["frequencies"]) == 3


@pytest.mark.parametrize("count", ["0", "-3"])
def test_count_of_modes_must_be_positive(scene, capsys, count):
    assert cli.main(["modes", str(scene), "--n-modes", count]) == 2
    assert "n_modes must be at least 1" in capsys.readouterr().err


@pytest.mark.parametrize("columns", [20, 40, 200])
@pytest.mark.slow
def test_summary_keeps_to_the_width_of_the_terminal(scene, tmp_path, capsys, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.chdir(tmp_path)
    assert cli.main(["strike", str(scene), "--out", "o"]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= min(columns, 88)


def test_help_and_version_load_nothing_heavy():
    code = (
        "import sys; from fem_impact import cli\n"
        "try: cli.main(sys.argv[1:])\nexcept SystemExit as end: assert not end.code\n"
        "heavy = {'numpy', 'scipy', 'skfem', 'numba', 'matplotlib', 'vtk', 'pyvista', 'meshio', 'netgen', 'shapely'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)"
    )
    for option, word in (("--help", "strike"), ("--version", fi.__version__)):
        run = subprocess.run([sys.executable, "-c", code, option], capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        assert word in run.stdout


def test_closed_pipe_is_no_error(scene, tmp_path):
    command = f"{sys.executable} -m fem_impact.cli modes {scene} --n-modes 20 | head -n 1"
    environment = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[1])}
    run = subprocess.run(["bash", "-c", command], capture_output=True, text=True, env=environment)
    assert run.stdout == "A small test\n" and run.stderr == ""


@pytest.mark.slow  # compiles, and finds some hundred modes
def test_default_scene_runs_end_to_end(tmp_path, capsys):
    assert cli.main(["strike", str(SCENES / "drumstick.toml"), "--out", str(tmp_path / "out"), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    # the estimate must keep the promise the scene asks for
    assert data["response"]["error"]["total"] < 1e-4
    assert -1.0 < data["response"]["restitution"] < 1.0


def test_completion_offers_verbs_options_and_files(tmp_path):
    pytest.importorskip("shtab", reason="the extra completion is not installed")
    script = arguments.completion(arguments.parser(), "bash")
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


def test_shapes_that_cannot_be_written_are_told_before_the_work(scene, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(fi.Scene, "modes", lambda *_, **__: pytest.fail("the work must not begin"))
    assert cli.main(["modes", str(scene), "--vtk", str(tmp_path / "m.stl")]) == 2
    assert "path ending must be one of .vtu, .pvd" in capsys.readouterr().err
    assert cli.main(["modes", str(scene), "--vtk", str(scene / "m.pvd")]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_full_disk_is_a_sentence(scene, tmp_path, capsys, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(fi.export, "write_wav", full)
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "out")]) == 1
    assert capsys.readouterr().err == "fem-impact: No space left on device\n"
    assert not (tmp_path / "out").exists()


WORDS = st.sampled_from(
    ["strike", "modes", "--out", "--n-modes", "--vtk", "--json", "--tolerance", "3", "-1", "nan", ""]
)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(arguments=st.lists(st.one_of(WORDS, st.text(max_size=6)), max_size=6))
def test_any_arguments_end_in_a_status_and_a_message(tmp_path, monkeypatch, capsys, arguments):
    monkeypatch.chdir(tmp_path)
    try:
        status = cli.main(arguments)
    except SystemExit as end:
        status = end.code
    captured = capsys.readouterr()
    assert status in (0, 1, 2) and (captured.err if status else captured.out)
    assert not list(tmp_path.iterdir())


def test_uncompiled_kernels_run_as_plain_python(monkeypatch, tmp_path):
    home = tmp_path / "impact" / "compiled"
    (home / "__pycache__").mkdir(parents=True)
    (home / "energy.py").write_text("")
    monkeypatch.setattr(fi, "__file__", str(tmp_path / "__init__.py"))
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    fresh: dict[str, str] = {}
    assert cli._prepare(fresh, once=True)
    assert fresh["NUMBA_DISABLE_JIT"] == "1" and fresh["OMP_NUM_THREADS"] == "1"
    chosen = {"NUMBA_DISABLE_JIT": "0", "OMP_NUM_THREADS": "7"}
    assert not cli._prepare(chosen, once=True)
    assert chosen["NUMBA_DISABLE_JIT"] == "0" and chosen["OMP_NUM_THREADS"] == "7"
    many: dict[str, str] = {}
    cli._prepare(many, once=False)
    assert "NUMBA_DISABLE_JIT" not in many
    (home / "__pycache__" / "energy.follow-1.py311.nbi").write_text("")
    compiled: dict[str, str] = {}
    assert not cli._prepare(compiled, once=True)
    assert "NUMBA_DISABLE_JIT" not in compiled
    elsewhere = {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}  # where nothing is compiled yet
    assert cli._prepare(elsewhere, once=True)
    (tmp_path / "kept" / "compiled_0").mkdir()
    (tmp_path / "kept" / "compiled_0" / "energy.follow-1.py311.nbi").write_text("")
    assert not cli._prepare({"NUMBA_CACHE_DIR": str(tmp_path / "kept")}, once=True)


def test_pictures_come_in_the_format_asked_for(scene, tmp_path, capsys):
    out = tmp_path / "out"
    assert cli.main(["strike", str(scene), "--out", str(out), "--format", "svg"]) == 0
    assert (out / "force.svg").read_text().startswith("<?xml") and not (out / "force.png").exists()
    assert "force.svg" in json.loads((out / "response.json").read_text())["files"]
    assert cli.main(["mesh", str(scene), "--out", str(out / "edges.png"), "--format", "pdf"]) == 0
    assert (out / "edges.pdf").read_bytes().startswith(b"%PDF") and "edges.pdf" in capsys.readouterr().out


def test_a_map_takes_a_format_of_its_numbers_and_one_of_its_pictures(tmp_path, capsys):
    path = tmp_path / "map.toml"
    path.write_text(TEXT + '[map.over]\n"striker.mass" = [0.03, 0.05]\n"contact.stiffness" = [1e5, 2e5]\n')
    assert cli.main(["map", str(path), "--out", str(tmp_path / "map"), "--format", "nc", "--format", "svg"]) == 0
    endings = {file.suffix for file in (tmp_path / "map").glob("[!.]*")}
    assert endings == {".nc", ".csv", ".svg"}
