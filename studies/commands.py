"""Writes `commands.md`, the page of all commands: their options, examples, and what they print as JSON.

    python studies/commands.py

`tests/test_pages.py` fails while the page is not the one that this script would write.
"""

import argparse
from pathlib import Path

from fem_impact import answers, arguments

PAGE = Path(__file__).parent / "commands.md"
HEAD = f"""# Commands

Written by `python studies/commands.py` from the tables that the commands themselves use: do not edit.

Every command takes `--help`, `--quiet` (nothing but errors on stderr) and `--json`, which prints its answer as one JSON
object without NaN or infinity, all numbers in SI units. `fem-impact schema COMMAND` prints a JSON schema of it. Every
answer has these keys (format {answers.FORMAT}):

"""


def cell(text):
    """Text as a cell of a table."""
    return text.replace("|", "\\|")


def keys(table):
    """Keys with their types and meanings as a table."""
    rows = "".join(
        f"| `{name}` | {cell(kind.rstrip('?').replace('|', ' or '))} | {'may be missing: ' * kind.endswith('?')}"
        f"{cell(meaning)} |\n"
        for name, (kind, meaning) in table.items()
    )
    return f"| key | type | meaning |\n|---|---|---|\n{rows}"


def options(parser):
    """The options of a command as a table."""
    rows = []
    for each in parser._actions:
        if each.help is argparse.SUPPRESS or set(each.option_strings) & {"--help", "--json", "--quiet"}:
            continue
        name = each.option_strings[-1] if each.option_strings else each.metavar or "SHELL"
        values = f"{{{','.join(map(str, each.choices))}}}" if each.choices and not each.metavar else each.metavar or ""
        values = " ".join(values) if isinstance(values, tuple) else values
        value = values if each.option_strings and each.nargs != 0 else ""
        rows.append(f"| `{cell(f'{name} {value}'.strip())}` | {cell(each.help)} |\n")
    return f"| option | meaning |\n|---|---|\n{''.join(rows)}" if rows else ""


def page():
    """The whole page."""
    (verbs,) = (each for each in arguments.parser()._actions if isinstance(each, argparse._SubParsersAction))
    ends = "".join(f"| {number} | {said} |\n" for number, said in answers.STATUSES.items())
    parts = [HEAD + keys(answers.ALL), f"| exit status | meaning |\n|---|---|\n{ends}"]
    for name, parser in verbs.choices.items():
        examples = "\n".join(answers.EXAMPLES[name])
        parts += [f"## {name}\n\n{parser.description}\n\n```sh\n{examples}\n```\n", options(parser)]
        if answers.KEYS.get(name):
            parts.append(f"With `--json` also:\n\n{keys(answers.KEYS[name])}")
    return "\n".join(part for part in parts if part)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"{PAGE}: {page().count(chr(10))} lines")
