"""No message gives advice that no test asks for: a test that provokes a message follows what it advises."""

import ast
import re
from contextlib import suppress
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
HOME = TESTS.parent / "fem_impact"
VERBS = (
    "add allow ask change check choose close connect correct cut delete divide draw export find give install keep "
    "leave load lower make mesh move name pass pip raise reduce refine remove restore run save select set simplify "
    "split start state strike take try use widen write"
)
ADVISES = re.compile(rf"(?:^|; (?:or |and |else |only )?|, or )((?:{VERBS.replace(' ', '|')})\b.*)")
NO_ADVICE = (  # what the prompt says it does, and other words that only begin alike
    r"^(?:strike|list|find|check|serve|write) (?:a|the|this) ",
    r"^find the hammers",
    r"^strike point",
    r"^cut off by",
    r"^scheme \{\}, steps of",
    r"^<Picture of",
    r"; energy error \{\}$",
)
FOLLOWED = (  # by tests that expect other words of the message
    "^make the folder .* writable",
    "E_across and G must be given together",
    "must not clamp a point of a beam",
    "^leave dt and scheme to the program",
    "to be played, got .*; take a softer one",
    "find the modes on a finer mesh",
    "; give lognormal, or uniform",
    "; raise max_blows",
    "; leave out store, or pass a function",
    "start and end must leave at least",
)


def messages(path):
    """Line and text of every string of a module, with {} for its numbers; no docstrings, and no help of the prompt."""
    nodes, skip = list(ast.walk(ast.parse(path.read_text()))), set()
    for node in nodes:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            skip.add(node.value)  # docstrings
        elif isinstance(node, ast.keyword) and node.arg in ("help", "metavar", "description", "title"):
            skip |= set(ast.walk(node.value))
        elif isinstance(node, ast.JoinedStr):
            skip |= set(ast.walk(node)) - {node}
    for node in nodes:
        if node in skip:
            continue
        if isinstance(node, ast.JoinedStr):
            parts = (part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
            yield node.lineno, "".join(map(str, parts))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value


@pytest.mark.filterwarnings("ignore::FutureWarning")  # of strings that are no patterns
def test_all_advice_is_asked_for_in_a_test():
    """A test expects the message, by a pattern of three words or more, or the first words of its advice."""
    paths = [path for path in TESTS.rglob("*.py") if path.name != Path(__file__).name]
    texts = {text for path in paths for _, text in messages(path)}
    asked, alone = "\n".join(texts), {}
    for path in sorted(set(HOME.rglob("*.py")) - {HOME / "arguments.py"}):  # which is the help of the prompt
        for line, text in messages(path):
            if (advice := ADVISES.search(text)) and len(text.split()) > 2:
                words = re.split(r"\{\}|[;,:()='\"\[]", advice[1])[0].split()
                if " ".join(words[:4]) not in asked:
                    alone[text] = f"{path.relative_to(HOME)}:{line}: {text}"
    short = [text for text in texts if len(text) < 200 and "\n" not in text]
    expected = [text for text in short if len(text.replace("{}", "").split()) > 2]  # "{} has {}" fits nearly all
    for words in [*NO_ADVICE, *FOLLOWED, *expected]:
        with suppress(re.error):
            pattern = re.compile(words)
            if not pattern.search("anything must match"):
                alone = {text: place for text, place in alone.items() if not pattern.search(text)}
    assert not alone, "\n".join(alone.values())
