"""Each answer on the page of questions runs as it stands there and prints what the page says."""

import re
from typing import NamedTuple

import pytest
from comparing import assert_printed
from scenes import ROOT

from fem_impact import arguments

TEXT = (ROOT / "studies" / "site" / "questions.md").read_text(encoding="utf-8")
SLOW = (  # above 0.3 s
    "hear what my mallet", "tune a bar", "drawing of my instrument", "choose hammer", "frequency responses",
    "stiffness of my tip", "modulus", "without believing", "uncertain inputs", "my own scripts", "first blow",
    "Chladni", "map of double hits", "no installation", "how hard", "where to strike", "beforehand",
)  # fmt: skip
SERVING = ("explore", "play")  # wait for the user


class Answer(NamedTuple):
    """A question, its code, and what the page says that it prints."""

    question: str
    language: str
    code: str
    printed: str
    prose: str


def answers():
    """All of the page by hat."""
    found = {}
    for part in TEXT.split("\n## ")[1:]:
        hat, *questions = part.split("\n### ")
        found[hat.strip()] = []
        for each in questions:
            (language, code), *rest = re.findall(r"^```(\w+)\n(.*?)^```", each, flags=re.MULTILINE | re.DOTALL)
            printed = "".join(text for kind, text in rest if kind == "text")
            found[hat.strip()].append(Answer(each.partition("\n")[0], language, code, printed, each))
    return found


ALL = [each for told in answers().values() for each in told]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder with what the repository has beside the package."""
    for name in ("studies", "meshes", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)


def marked(chosen):
    """The answers as cases, the long ones marked."""
    slow = pytest.mark.slow
    return [
        pytest.param(each, id=each.question, marks=[slow] if any(word in each.question for word in SLOW) else [])
        for each in chosen
    ]


def test_every_hat_has_ten_questions_and_where_to_read_on():
    assert {hat: len(told) for hat, told in answers().items()} == dict.fromkeys(
        ("Percussionist", "Test engineer", "Analyst", "Teacher"), 10
    )
    assert len({each.question for each in ALL}) == 40 and all(each.question.startswith("How do I ") for each in ALL)
    assert [each.question for each in ALL if not re.search(r"Read on:.*?\]\(", each.prose, re.DOTALL)] == []
    assert all(len(each.code.splitlines()) <= 13 for each in ALL)
    assert all(sum(word in each.question for each in ALL) == 1 for word in SLOW)


@pytest.mark.parametrize("answer", marked([each for each in ALL if each.language == "python"]))
def test_lines_of_python_print_what_the_page_says(answer, here, read_here, capsys):
    exec(compile(answer.code, "questions.md", "exec"), {})
    assert_printed(capsys.readouterr().out, answer.printed, rtol=0.1, atol=1e-3)  # as in test_readme


@pytest.mark.parametrize("answer", marked([each for each in ALL if each.language == "sh"]))
def test_commands_run(answer, here, read_here, prompt, tmp_path):
    for line in answer.code.splitlines():
        name, _, words = line.partition(" ")
        assert name == "fem-impact"
        if words.split()[0] in SERVING:
            assert arguments.parser().parse_args(words.split()).command == words.split()[0]
            continue
        said = prompt(words)
        assert said.status == 0 and said.out, said.err
        if (out := re.search(r"--out (\S+)", words)) is not None:
            assert (tmp_path / out[1]).exists()
