"""Each hat's path from an installed program to its first result: the page's commands run and leave the page's files."""

import hats
import pytest

from fem_impact import arguments


def test_every_hat_has_a_path_that_the_prompt_knows():
    assert set(hats.HATS) == {"percussionist", "test_engineer", "analyst", "teacher"}
    for hat in hats.HATS:
        commands, files = hats.path_of(hat)
        assert 2 <= len(commands) <= 4 and files
        for command in commands:
            words = hats.shlex.split(command)
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
