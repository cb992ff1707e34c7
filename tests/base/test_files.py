"""Files are complete or absent, whatever goes wrong while they are written."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import fem_impact
from fem_impact._base.files import LIST, MACHINE, PARTIAL, replacing, staged_folder


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def write(folder, command, **files):
    with staged_folder(folder, command) as staging:
        for name, text in files.items():
            (staging / name).parent.mkdir(exist_ok=True)
            (staging / name).write_text(text)


def test_replacing_keeps_the_old_file_when_the_block_fails_and_the_suffix_by_which_writers_choose(tmp_path):
    path = tmp_path / "a.png"
    path.write_text("old")
    with pytest.raises(RuntimeError, match="half way"), replacing(path) as temporary:
        assert temporary.suffix == ".png" and temporary.name.startswith(PARTIAL)
        temporary.write_text("ne")
        raise RuntimeError("half way")
    assert path.read_text() == "old" and names(tmp_path) == ["a.png"]
    with replacing(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new" and names(tmp_path) == ["a.png"]


def test_staged_moves_everything_in_and_leaves_other_files_alone(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    (tmp_path / "out" / "a.txt").write_text("old")
    with staged_folder(tmp_path / "out") as staging:
        (staging / "modes").mkdir()
        for name in ("a.txt", "modes/b.txt"):
            (staging / name).write_text("new")
        assert (tmp_path / "out" / "a.txt").read_text() == "old"
    assert names(tmp_path / "out") == ["a.txt", "mine.txt", "modes", "modes/b.txt"]
    assert (tmp_path / "out" / "a.txt").read_text() == "new"


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_staged_leaves_nothing_when_the_block_fails(tmp_path, failure):
    with pytest.raises(failure), staged_folder(tmp_path / "new" / "deep") as staging:
        (staging / "a.txt").write_text("half")
        raise failure
    assert names(tmp_path) == []


def test_staged_moves_nothing_where_a_folder_is_in_the_way_of_a_file_or_a_file_of_a_folder(tmp_path):
    (tmp_path / "b.txt").mkdir()
    with pytest.raises(IsADirectoryError, match=r"b\.txt"):
        write(tmp_path, None, **{"a.txt": "a", "b.txt": "b"})
    (tmp_path / "modes").write_text("mine")
    with pytest.raises(NotADirectoryError, match="modes"):
        write(tmp_path, None, **{"a.txt": "a", "modes/b.txt": "b"})
    assert names(tmp_path) == ["b.txt", "modes"]
    with pytest.raises(NotADirectoryError), staged_folder(tmp_path / "modes" / "out"):
        pytest.fail("the block must not run where nothing can be written")


@pytest.mark.parametrize("linked", [True, False])
def test_staged_puts_everything_back_if_a_file_cannot_be_moved(tmp_path, monkeypatch, linked):
    """The third of three cannot; the first was there, the second is new."""
    write(tmp_path, "strike", **{"a.txt": "old", "gone.txt": "old"})
    move = os.replace
    monkeypatch.setattr(os, "replace", lambda old, new: move(old, new if Path(new).name != "z.txt" else "/dev/null/z"))
    if not linked:
        monkeypatch.setattr(os, "link", lambda *_: (_ for _ in ()).throw(PermissionError), raising=False)
    before = names(tmp_path)
    with pytest.raises(NotADirectoryError):
        write(tmp_path, "strike", **dict.fromkeys(("a.txt", "new/b.txt", "z.txt"), "new"))
    assert names(tmp_path) == before and (tmp_path / "a.txt").read_text() == "old"
    assert "gone.txt" in (tmp_path / LIST).read_text()


@pytest.mark.parametrize("write", [replacing, staged_folder])
def test_what_cannot_be_written_is_named_as_the_user_does(tmp_path, write):
    with pytest.raises(PermissionError) as caught, write(tmp_path / "mine") as place:
        raise PermissionError(13, "Permission denied", str(place))
    assert str(caught.value) == f"[Errno 13] Permission denied: {str(tmp_path / 'mine')!r}"


def test_a_second_run_removes_what_the_first_alone_wrote(tmp_path):
    write(tmp_path, "map", e="map")
    write(tmp_path, "strike", **{"a": "1", "b": "1", "c": "1", "d/d": "1", "e": "strike"})
    (tmp_path / "c").write_text("edited")
    (tmp_path / "mine").write_text("1")
    write(tmp_path, "strike", a="2")
    assert names(tmp_path) == [LIST, "a", "c", "mine"] and (tmp_path / "a").read_text() == "2"
    write(tmp_path, "strike", b="3")
    assert names(tmp_path) == [LIST, "b", "c", "mine"]


def test_a_mesh_written_over_itself_stays_the_users(tmp_path):
    (tmp_path / "plate.msh").write_text("mesh")
    write(tmp_path, "strike", **{"plate.msh": "mesh", "a": "1"})
    write(tmp_path, "strike", **{"plate.msh": "mesh", "a": "1"})
    write(tmp_path, "strike", b="1")
    assert names(tmp_path) == [LIST, "b", "plate.msh"]


def test_a_damaged_list_names_nothing(tmp_path):
    (tmp_path / "a").write_text("1")
    for text in ("", "[]", "{", '{"strike": 1}', "[" * 100_000, '{"strike": {"a": 1, "\\u0000": 2}}'):
        (tmp_path / LIST).write_text(text)
        write(tmp_path, "strike", b="1")
        assert names(tmp_path) == [LIST, "a", "b"], text[:20]


def test_a_list_names_nothing_outside_its_folder(tmp_path):
    folder = tmp_path / "out"
    write(folder, "strike", a="1")
    (digest,) = json.loads((folder / LIST).read_text())["strike"].values()
    (tmp_path / "secret").write_text("1")
    (folder / "b").write_text("1")
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "up").symlink_to(tmp_path)
    wanted = ["../secret", str(tmp_path / "secret"), "up/secret", "link", "x/../b"]
    (folder / LIST).write_text(json.dumps({"strike": dict.fromkeys(wanted, digest)}))
    write(folder, "strike", c="1")
    left = [LIST, "a", "b", "c", "link", "up"]
    assert names(tmp_path) == ["out", *(f"out/{name}" for name in left), "secret"]


def test_anything_but_a_regular_file_is_not_replaced(tmp_path):
    """Renaming would put a file in the place of a device or a pipe."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="Not a regular file"), replacing(tmp_path / "pipe"):
        pass
    with pytest.raises(OSError, match="Not a regular file"):
        write(tmp_path, None, pipe="new")
    with pytest.raises(OSError, match="it is a file and no folder; name another"):
        write(tmp_path / "pipe", None, a="new")
    assert names(tmp_path) == ["pipe"] and (tmp_path / "pipe").is_fifo()


KILLED = """
import os, signal, sys
from pathlib import Path
from fem_impact._base.files import replacing, staged_folder
with staged_folder(sys.argv[1]) as staging, replacing(Path(sys.argv[1]) / "a.txt") as temporary:
    (staging / "modes").mkdir()
    (staging / "modes" / "b.txt").write_text("half")
    temporary.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    one.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(Path(fem_impact.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", KILLED, str(one)], env=environment, check=False)
    assert done.returncode == -signal.SIGKILL and len(list(one.glob(f"{PARTIAL}*"))) == 2
    shutil.copytree(one, two)
    with staged_folder(one) as staging:
        assert names(one) == [staging.name]
    with replacing(two / "b.txt") as temporary:
        temporary.write_text("whole")
    assert names(two) == ["b.txt"]


def test_what_others_are_writing_is_left_alone(tmp_path):
    """Of a running process, of another machine, of this process, and what only looks alike; not a dead namesake's."""
    if os.name == "posix":
        (tmp_path / f"{PARTIAL}{MACHINE}-{os.getpid()}-0123abcd").mkdir()
    theirs = [f"{PARTIAL}{MACHINE}-{os.getppid()}-0123abcd", f"{PARTIAL}elsewhere-1-0123abcd", f"{PARTIAL}notes"]
    for name in theirs:
        (tmp_path / name).write_text("busy")
    with staged_folder(tmp_path) as outer, replacing(tmp_path / "a.txt") as temporary, staged_folder(tmp_path):
        assert outer.is_dir()
        temporary.write_text("a")
    assert names(tmp_path) == sorted([*theirs, "a.txt"])
