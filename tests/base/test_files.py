"""Files are complete or absent, whatever goes wrong while they are written."""

import os

import pytest

from fem_impact._base.files import PARTIAL, replacing, staged


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_replacing_keeps_the_old_file_when_the_block_fails(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError, match="half way"), replacing(path) as temporary:
        temporary.write_text("ne")
        raise RuntimeError("half way")
    assert path.read_text() == "old" and names(tmp_path) == ["a.txt"]


def test_replacing_keeps_the_suffix_because_writers_choose_a_format_by_it(tmp_path):
    with replacing(tmp_path / "a.png") as temporary:
        assert temporary.suffix == ".png" and temporary.name.startswith(PARTIAL)
        temporary.write_text("new")
    assert names(tmp_path) == ["a.png"]


def test_staged_moves_everything_in_and_leaves_other_files_alone(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    (tmp_path / "out" / "a.txt").write_text("old")
    with staged(tmp_path / "out") as staging:
        (staging / "a.txt").write_text("new")
        (staging / "modes").mkdir()
        (staging / "modes" / "b.txt").write_text("b")
        assert (tmp_path / "out" / "a.txt").read_text() == "old"
    assert names(tmp_path / "out") == ["a.txt", "mine.txt", "modes", "modes/b.txt"]
    assert (tmp_path / "out" / "a.txt").read_text() == "new"


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_staged_leaves_nothing_when_the_block_fails(tmp_path, failure):
    with pytest.raises(failure), staged(tmp_path / "new" / "deep") as staging:
        (staging / "a.txt").write_text("half")
        raise failure
    assert names(tmp_path) == []


def test_staged_moves_nothing_where_a_folder_is_in_the_way(tmp_path):
    (tmp_path / "b.txt").mkdir()
    with pytest.raises(IsADirectoryError, match=r"b\.txt"), staged(tmp_path) as staging:
        (staging / "a.txt").write_text("a")
        (staging / "b.txt").write_text("b")
    assert names(tmp_path) == ["b.txt"]


def test_staged_finds_a_place_that_cannot_be_written_to_before_the_work_begins(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(NotADirectoryError), staged(tmp_path / "file" / "out"):
        pytest.fail("the block must not run")


def test_anything_but_a_regular_file_is_not_replaced(tmp_path):
    """Renaming would put a file in the place of a device or a pipe."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="Not a regular file"), replacing(tmp_path / "pipe"):
        pass
    with pytest.raises(OSError, match="Not a regular file"), staged(tmp_path) as staging:
        (staging / "pipe").write_text("new")
    assert names(tmp_path) == ["pipe"]
    assert (tmp_path / "pipe").is_fifo()
