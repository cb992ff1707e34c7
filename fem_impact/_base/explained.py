"""Names the headings of studies/notes.md that explain a message, so that a reader of one finds the other."""

import re
from collections.abc import Iterable

# what a message says, under the heading that explains it; the page quotes the same
HEADINGS: dict[str, tuple[str, ...]] = {
    "tolerance-missed": ("MISSED",),
    "not-resolvable": ("not resolvable",),
    "number-of-impacts-in-doubt": ("the number of impacts cannot be determined", "number in doubt"),
    "no-final-separation": ("no final separation was reached",),
    "step-error-stays": ("the step error stays at",),
    "thin-target": ("thin target: ",),
    "shallow-target": ("shallow target: ",),
    "thin-striker": ("thin striker: ",),
    "small-deflections": ("small deflections: ",),
    "no-yielding": ("no yielding: ",),
    "local-contact": ("local contact: ",),
    "quasi-static-contact": ("quasi-static contact: ",),
    "no-friction": ("no friction: ",),
    "still-air": ("still air: ",),
    "stated-damping": ("stated damping: ",),
    "not-known": ("it is not known whether the model holds", "the model is not examined"),
    "beyond-this-estimate": ("beyond this estimate",),
    "slips-of-units": ("softer than rubber", "are expected", "and both count"),
    "drawings": (
        "states no unit", "y points down in an SVG file", "points along gentle bends were joined", "was closed",
        "are lines for ribs",
    ),
    "mesh-files": (
        "duplicate nodes were merged", "inverted triangles were flipped", "triangles were split at hanging nodes",
        "sides of the rim were replaced by smooth curves", "not on the rim, so it cannot be supported",
        "the surface is curved", "and was levelled",
    ),
    "strike-points-that-cannot-move": ("it lies on a support",),
    "rolling-shear": ("G_yz is not stated",),
    "modes-from-elsewhere": (
        "the static compliance is not given", "no rigid motion is given", "dent the mesh as they would a solid",
        "dent the mesh, whose elements are solid", "too few nodes of a smooth surface show their dent",
    ),
    "air": ("with a rigid wall around",),
    "too-many-modes-or-unknowns": ("more than the limit of", "GB of memory for"),
    "strike-points-beside-the-body": ("must lie on the body",),
    "outlines-that-cannot-be-meshed": ("the mesher could not fill the outline",),
    "extras": ("pip install 'fem-impact[",),
    "no-gradient": ("no gradient",),
    "nothing-changes-in-a-design": ("no derivative in",),
}  # fmt: skip
POINTER = re.compile(r" \((notes\.md#[^()]+)\)")


def headings_of(text: str) -> str:
    """The headings that explain a message, such as "notes.md#air, #not-known"; "" if none does."""
    found = [f"#{heading}" for heading, said in HEADINGS.items() if any(each in text for each in said)]
    return f"notes.md{', '.join(found)}" if found else ""


def with_headings(text: str) -> str:
    """The message, ending with the headings that explain it in brackets."""
    bare = POINTER.sub("", text)  # it may hold a message that has its own already
    place = headings_of(bare)
    return f"{bare} ({place})" if place else bare


def printable(text: str) -> str:
    """Text as one line in which everything can be printed."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))


def heading_line(first: str) -> list[str]:
    """The line that follows the first line of a summary, which itself stays short; none if nothing explains it."""
    place = headings_of(first)
    return [f"See {place}"] if place else []


def lines_of_notes(notes: Iterable[str]) -> list[str]:
    """Notes as lines of text, each with the headings that explain it."""
    return [f"Note: {with_headings(note)}" for note in notes]


def named_headings(lines: Iterable[str]) -> list[str]:
    """Every heading that lines of text name, each as notes.md#heading."""
    found = (each for line in lines for each in re.findall(r"(?:notes\.md|, )(#[a-z-]+)", line))
    return [f"notes.md{each}" for each in dict.fromkeys(found) if each[1:] in HEADINGS]
