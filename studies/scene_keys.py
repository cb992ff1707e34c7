"""Writes `scene_keys.md`, the page of all keys of a scene, from the schema by which scenes are checked.

    python studies/scene_keys.py

`tests/test_pages.py` fails while the page is not the one that this script would write.
"""

from pathlib import Path

from fem_impact.scenes import editor_schema, keys

PAGE = Path(__file__).parent / "scene_keys.md"
HEAD = """# Keys of a scene

Written by `python studies/scene_keys.py` from the schema of scenes: do not edit.

A scene is a TOML file with one table per part, in SI units. `fem-impact new` writes a commented one to begin with
(`plate`, `disk`, `beam` or `map`). With `fem-impact schema > scene.schema.json` and a first line
`#:schema ./scene.schema.json`, editors that read JSON schemas of TOML (taplo, Even Better TOML) complete keys, show
what they mean and mark mistakes.

Besides its tables a scene has a `title`. The tables `mesh`, `striker`, `contact` and `strike` are required, and so are
the keys in **bold**, unless a [name](#names-in-place-of-numbers) stands for them.

From Python, `fi.load_scene(path)` reads a scene, and `.plan()`, `.strike()` and `.play()` run it.

## Sizes that vary

`thickness`, `width`, `height` and `diameter` are numbers or

- tables `{ x = [...], y = [...], values = [[...], ...] }` (no `y` on a beam) with one row of values for each x, linear
  in between and constant beyond; or
- cases `{ cases = [{ value, centre, radius }, { value, from, to }], otherwise }`, of which the first that holds counts.

## Numbers that are known only so well

Any single number of `mesh`, `material`, `section`, `layer`, `rib`, `target`, `striker`, `contact` and `strike` may say
how well it is known; the scene strikes with its `value`, and `fem-impact strike SCENE --band` or `fi.band` tells what
the rest leaves open:

- `{ value = 70e9, about = 0.03 }`: nine tenths of what it may be lie within 3 % (lognormal, for numbers above zero); or
- `{ value = 70e9, low = 68e9, high = 71e9 }`: anything between the two, alike (uniform).

## Names in place of numbers

`[material] name = "brass"` and `[striker] name = "yarn, medium"` stand for the numbers, with their intervals, of the
[catalogue](catalogue.md). Other keys beside a name replace what it says. A scene whose striker has a name may leave out
`[contact]`. In layers, ribs and strokes names work alike. `[target] damping_ratio` stays to be stated: what is lost in
a body is also lost at its supports.
"""


def words(form):
    """What a key may be, in words."""
    if "oneOf" in form:
        return "a table with a kind"
    if "title" in form:
        return form["title"].replace("a size that varies", "a [size that varies](#sizes-that-vary)")
    if "anyOf" in form and form.get("type") != "object":  # a number, or how well it is known
        return words(form["anyOf"][0])
    if "enum" in form:
        return ", ".join(f'`"{each}"`' for each in form["enum"])
    kind = {"integer": "whole number", "boolean": "`true` or `false`", "string": "text"}
    if form["type"] == "object":
        return f"{{ {', '.join(form['properties'])} }}"
    if form["type"] != "number":
        return kind[form["type"]]
    low = f" > {form['exclusiveMinimum']:g}" if "exclusiveMinimum" in form else ""
    low += f" >= {form['minimum']:g}" if "minimum" in form else ""
    high = f" <= {form['maximum']:g}" if "maximum" in form else ""
    return f"number{low}{' and' if low and high else ''}{high}"


def default(form):
    """The default as it would be written."""
    value = form.get("default")
    return (
        "" if value is None else f"`{str(value).lower() if isinstance(value, bool) else repr(value)}`".replace("'", '"')
    )


def rows(form):
    """The table of one kind of table: its keys, what they may be, their defaults and meaning."""
    lines = ["| key | value | default | meaning |", "|---|---|---|---|"]
    required = form["required"] or next((each["required"] for each in form.get("anyOf", ())), ())
    for key, each in form["properties"].items():
        if "const" not in each:
            name = f"**{key}**" if key in required else key
            lines.append(f"| {name} | {words(each)} | {default(each)} | {each['description']} |")
    return "\n".join(lines) + "\n" if len(lines) > 2 else "It has no keys of its own.\n"


def kinds(choices):
    """The parts about each kind of a table."""
    parts = []
    for choice in choices:
        found = [(key, each["const"]) for key, each in choice["properties"].items() if "const" in each]
        key, kind = found[0] if found else ("name", "...")
        shown = choice if found else {**choice, "properties": {key: choice["properties"][key]}}
        parts += [f'### {key} = "{kind}"\n', f"{choice['description']}\n", rows(shown)]
    return parts


def entry(name, form):
    """The part of the page about one table."""
    parts = [f"## [{name}]\n" if form["type"] == "object" else f"## [[{name}]]\n"]
    form = form.get("items", form)
    parts += [f"{form['description']}\n", *kinds(form.get("oneOf", ()))]
    if name == "supports":
        held, spring = form["additionalProperties"]["anyOf"]
        parts += [f"Each edge is {words(held)}, or springs:\n", rows(spring)]
    elif name == "in_plane":
        parts.append(f"Each edge is {words(form['additionalProperties'])}.\n")
    elif "oneOf" not in form:
        parts.append(rows(form))
    return "\n".join(parts)


def page():
    """The whole page."""
    tables = {name: form for name, form in editor_schema.schema()["properties"].items() if name != "title"}
    hand = tables["striker"]["oneOf"][0]["properties"]["hand"]
    *shapes, table = tables["mesh"]["oneOf"][0]["properties"]["rise"]["anyOf"]
    rise = f"## rise\n\n{keys.TABLES['rise']} A key of `[mesh]`: one of these, or `{words(table)}`.\n"
    own = [entry(name, form) for name, form in tables.items()]
    own += [f"## hand\n\n{hand['description']} A key of `[striker]`.\n", rows(hand), rise, *kinds(shapes)]
    return "\n".join([HEAD, *own])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"{PAGE}: {page().count(chr(10))} lines")
