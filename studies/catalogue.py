"""Writes `catalogue.md`, the page of all materials, strikers and impact hammers that have a name.

    python studies/catalogue.py

`tests/test_pages.py` fails while the page is not the one that this script would write.
"""

from itertools import groupby
from pathlib import Path

import fem_impact as fi
from fem_impact.impact import catalogue, listing

PAGE = Path(__file__).parent / "catalogue.md"
HEAD = """# Catalogue

Written by `python studies/catalogue.py` from `fem_impact/impact/catalogue.toml`: do not edit. All numbers are in SI
units.

{materials} materials (woods counted once, though each may be cut in two ways), {strikers} strikers and {hammers} impact
hammers have names. `fi.materials["brass"]` is a material, `fi.strikers["yarn, medium"]` a striker, and
`fi.strikers.entry("yarn, medium").contact(on=fi.materials["brass"])` the contact between the two. In a scene, `name` in
`[material]` and `[striker]` stands for them, and at the prompt `fem-impact new --material brass --mallet "yarn,
medium"` writes such a scene. `fem-impact catalogue WORD` shows the numbers of one.

Each number has an interval. Nine tenths of what it may be lie within ± so many per cent, or it lies between two ends;
`fem-impact strike SCENE --band` and `fi.band` use it. A number without one is exact or goes with that beside it. The
figure in brackets is its [source](#sources). **{unread} of {numbers} numbers come from sources that were not at hand
when they were entered** (marked ° here and *not read* below): they are from memory, or estimates. Take such a number
for what its interval says, and measure where it matters.

## Which law, which exponent, which damping for my mallet?

Hard and round tips follow Hertz's law, exponent p = 1.5, with the stiffness of tip and body together: here on a rigid
wall, on wood it may be a hundredth of that. Wound and felted heads get harder as they are pressed: p of 2 to 3,
whatever they strike. Hollow and gas-filled balls are nearly linear, p = 1. The damping is a loss (Hunt and Crossley:
the force is multiplied by 1 + loss times the rate of approach), or the restitution on a rigid wall at a speed, from
which the loss follows (`Contact.restituting`). "None published": take none, as what is lost in the vibration of the
bodies is computed; dents need a law that yields (`Contact.elastic_plastic`), and felt that relaxes one that remembers
(`Contact.felt`). The time is that of a contact on a rigid wall at 1 m/s without loss; at its inverse the spectrum of
the force has fallen by 10 dB, with p = 3 at 1.6 times that. Sticks bend, which shortens their contacts.

"""
GROUPS = {"wood": "Woods", "metal": "Metals", "glass": "Glasses and ceramics", "stone": "Stone and concrete",
          "plastic": "Plastics", "skin": "Skins", "board": "Boards", "laminate": "Laminates"}  # fmt: skip
CUT = """`fi.materials["spruce, Sitka"]` is quarter-sawn: the radial direction R lies across the grain in the plane of
the plate; in `"spruce, Sitka, flat-sawn"` the tangential direction T does. Where no source has G_RT, rolling shear is
left unstated.

"""


def entries():
    """Every entry once, by section: of wood the quarter-sawn one."""
    cuts = [cut for cut in catalogue.CUTS if cut]
    return {
        name: [section.entry(each) for each in section if not each.endswith(tuple(cuts))]
        for name, section in listing.SECTIONS.items()
    } | {"tips": list(catalogue._entries("tips").values())}


def table(head, rows):
    """A table of the page."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines) + "\n"


def cell(fact, sources):
    """A number with its interval and source."""
    known = fact.interval
    if "about" in known:
        ends = f" ± {100 * known['about']:.2g} %"
    else:
        ends = f" ({known['low']:.3g} to {known['high']:.3g})" if known else ""
    return f"{fact.value:.3g}{ends} [{sources.index(fact.source) + 1}]{'' if fact.read else '°'}"


def wide(group, sources):
    """The table of all numbers of some entries, and their notes."""
    told = [listing.distinct(entry) for entry in group]
    keys = list(dict.fromkeys(key for facts in told for key in facts))
    unit = {key: fact.unit for facts in told for key, fact in facts.items()}
    head = ["", *(f"{key} [{unit[key]}]" for key in keys)]
    rows = [[entry.name, *(cell(facts[key], sources) if key in facts else "" for key in keys)]
            for entry, facts in zip(group, told)]  # fmt: skip
    notes = [f"- {entry.name}: {entry.note}\n" for entry in group if entry.note]
    return table(head, rows) + ("\n" + "".join(notes) if notes else "")


def page():
    """The whole page."""
    found, sources = entries(), [words for words, _ in catalogue.sources().values()]
    facts = [fact for section in found.values() for entry in section for fact in listing.distinct(entry).values()]
    counts = {name: len(section) for name, section in found.items()}
    unread = sum(not fact.read for fact in facts)
    parts = [HEAD.format(**counts, unread=unread, numbers=len(facts))]
    parts.append(table(listing.HEADS["strikers"], listing.rows("strikers", found["strikers"])))
    for name, group in groupby(found["materials"], lambda entry: entry.group):
        group = list(group)
        woods = [entry for entry in group if "E_L" in entry.facts]
        parts.append(f"## {GROUPS[name]}\n\n{CUT if woods else ''}" + wide(woods or group, sources))
        if woods and len(woods) < len(group):
            parts.append(wide([entry for entry in group if entry not in woods], sources))
    for name, group in groupby(found["strikers"], lambda entry: entry.group):
        parts.append(f"## Strikers: {name}\n\n" + wide(list(group), sources))
    parts.append(
        '## Impact hammers\n\n`fi.hammers.catalogue["PCB 086C03"]` has the mass, the largest force, the '
        "sensitivity and the stiffness of each tip.\n\n" + table(*hammers(found["hammers"], sources))
    )
    parts.append(
        "## Tips of impact hammers\n\nThe linear spring with the contact time of the tip on a rigid wall. Makers "
        "show spectra, not stiffnesses: the intervals are wide.\n\n" + wide(found["tips"], sources)
    )
    read = [words for words, known in catalogue.sources().values() if known]
    listed = "".join(f"{i}. {words}{'' if words in read else ' (*not read*)'}\n" for i, words in enumerate(sources, 1))
    return "\n".join([*parts, f"## Sources\n\n{listed}"])


def hammers(group, sources):
    """Head and rows of the table of hammers."""
    keys = ("mass", "force", "sensitivity")
    rows = [[entry.name, *(cell(entry.facts[key], sources) if key in entry.facts else "" for key in keys),
             ", ".join(entry.tips), entry.note] for entry in group]  # fmt: skip
    return ["", "mass [kg]", "largest force [N]", "sensitivity [V/N]", "tips", "note"], rows


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"{PAGE}: {page().count(chr(10))} lines, {len(fi.materials)} names of materials")
