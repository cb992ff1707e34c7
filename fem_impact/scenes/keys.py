"""What each key of a scene holds, in words and as a JSON type: for checks, editors and the page of scene keys."""

from typing import Any

from .._base import check
from ..fe.assembly import THEORIES
from ..impact.catalogue import materials, strikers
from ..impact.compiled.laws.base import LawNumber
from ..impact.contact import HIGHEST_EXPONENT, LOWEST_EXPONENT, MARKS
from ..impact.quantities import BANDED, QUANTITIES
from ..impact.stepping import SCHEMES
from ..mesh.loops import UNITS
from ..model.target import AIR, MODELS

MOST_LISTENERS = 100  # [-] each costs a sound
SOURCES = ("auto", "fe", "analytic")
Form = dict[str, Any]  # of JSON schema

NUMBER: Form = {"type": "number"}
POSITIVE: Form = NUMBER | {"exclusiveMinimum": 0}
NOT_NEGATIVE: Form = NUMBER | {"minimum": 0}
COUNT: Form = {"type": "integer", "minimum": 1}
TEXT: Form = {"type": "string"}
TURNING = ("free", "hinged")  # how an end may be held while the body can still move rigidly
FLAG: Form = {"type": "boolean"}
LISTED: Form = {"title": "a name"}  # of the catalogue: pages do not list them all


def one_of(words: Any) -> Form:
    """One of several words."""
    return {"enum": [*words]}


def within(low: float, high: float) -> Form:
    """A number between two others, both allowed."""
    return NUMBER | {"minimum": low, "maximum": high}


def _of_law(number: LawNumber) -> tuple[str, Form]:
    """Words and form of a number of a contact law."""
    limits = within(number.least or 0.0, number.most) if number.most <= HIGHEST_EXPONENT else NOT_NEGATIVE
    words = ", ".join(filter(None, [number.unit.replace("**", "^") or "-", number.key]))
    return words, POSITIVE if number.least is None else limits


def rows(item: Form, low: int = 1, high: int | None = None) -> Form:
    """A list of ``low`` items or more, at most ``high`` if given."""
    return {"type": "array", "items": item, "minItems": low} | ({} if high is None else {"maxItems": high})


def table(keys: dict[str, Form], required: tuple[str, ...]) -> Form:
    """A table in braces with these keys and no others."""
    return {"type": "object", "properties": keys, "required": [*required], "additionalProperties": False}


def named(words: str, *forms: Form) -> Form:
    """One of several forms, and what a page calls them."""
    return {"title": words, "anyOf": [*forms]}


POINT = named("a point [x, y]; on a beam [x] or x", NUMBER, rows(NUMBER, 1, 2))
CORNERS = {"title": "a list of points [x, y]"} | rows(rows(NUMBER, 2, 2), 3)
ASIDE = {"title": "a point [across, ahead] of the blow"} | rows(NUMBER, 2, 2)
PLACE = {"title": "a point [x, y, z]"} | rows(NUMBER, 3, 3)
SIZE = named(
    "number > 0, or a size that varies",
    POSITIVE,
    table({"x": rows(NUMBER, 2), "values": rows(POSITIVE, 2)}, ("x", "values")),
    table({"x": rows(NUMBER, 2), "y": rows(NUMBER, 2), "values": rows(rows(POSITIVE, 2), 2)}, ("x", "y", "values")),
    table(
        {
            "cases": rows(
                named(
                    "a case",
                    table({"value": POSITIVE, "centre": POINT, "radius": POSITIVE}, ("value", "centre", "radius")),
                    table({"value": POSITIVE, "from": POINT, "to": POINT}, ("value", "from", "to")),
                ),
                0,
            ),
            "otherwise": POSITIVE,
        },
        ("cases", "otherwise"),
    ),
)
TAPER = named("number > 0, or [[distance, size], ...] along the rib", POSITIVE, rows(rows(NUMBER, 2, 2), 2))
DAMPING = named(
    "number >= 0, or { frequency = [...], ratio = [...] }",
    NOT_NEGATIVE,
    table({"frequency": rows(NUMBER), "ratio": rows(NOT_NEGATIVE)}, ("frequency", "ratio")),
)
POSTS = named(
    "a post",
    table({"at": POINT, "stiffness": POSITIVE}, ("at",)),
    table({"at": POINT, "clamped": POSITIVE}, ("at", "clamped")),
)
QUANTITY = TEXT | {"pattern": rf"^({'|'.join(name + '=.+' * (name in BANDED) for name in QUANTITIES)})$"}
AXIS = named(
    "a list, or { from, to, count, scale }",
    rows(POINT),
    table({"from": NUMBER, "to": NUMBER, "count": COUNT, "scale": one_of(("linear", "log"))}, ("from", "to")),
)

TABLES = {  # table -> what it holds
    "mesh": "The outline of the struck body.",
    "material": "What the body is made of; may be left out if [target] has mass and first_frequency.",
    "section": "How thick the body is.",
    "layer": "A layer of a plate, the first on the struck side; in place of the thickness in [section].",
    "rib": "A bar, stiffener or joist along a line of a plate, by default glued to the side that is not struck.",
    "target": "What else is known of the struck body.",
    "supports": "How each named edge is held. boundary means all of them; edges not named are free.",
    "in_plane": "How each named edge is held in the plane of a plate: sliding along itself only. Where an edge is not "
    "named, it is held if it is hinged or clamped.",
    "striker": "What strikes.",
    "contact": "The spring between striker and body; it only pushes.",
    "strike": "The blow.",
    "stroke": "One blow of several, for rolls, flams, two sticks; what it leaves out stands in the other tables.",
    "observe": "Where motion and sound are computed.",
    "map": "Many blows, for `fem-impact map`.",
    "rise": "Height of the unloaded surface of a curved plate above its outline, towards the striker.",
    "hand": "What holds the striker, so that it comes back by itself.",
}
# "table.kind.key", "table.key" or "key" -> what it is with its unit, and its form; the longest name counts
KEYS: dict[str, tuple[str, Form]] = {
    # mesh
    "length": ("m", POSITIVE),
    "mesh.length": ("m, along x from 0", POSITIVE),
    "mesh.width": ("m, along y from 0", POSITIVE),
    "mesh.radius": ("m; the centre is at x = y = 0", POSITIVE),
    "hole": ("m, radius of a hole in the middle", NOT_NEGATIVE),
    "corners": ("m, in order, clockwise or anticlockwise", CORNERS),
    "holes": ("m, the corners of each hole", {"title": "a list of lists of points"} | rows(CORNERS, 0)),
    "mesh.source": ("an SVG or DXF file, relative to the scene; its largest closed loop is the outline", TEXT),
    "path": ("a mesh file, relative to the scene: .msh, .vtu, .vtk and what else meshio reads", TEXT),
    "unit": ("unit of the numbers in the file, if it does not say so itself", one_of(UNITS)),
    "size": ("m, of the elements; left out, it is chosen for the blow", POSITIVE),
    "rise": ("m, of a curved plate above its outline", {}),
    "mesh.file.rise": ("m, of a curved plate above its outline; left out, the third coordinate of the file", {}),
    "rise.radius": ("m; negative: hollow on the struck side", NUMBER),
    "rise.cymbal.radius": ("m, of the edge", POSITIVE),
    "rise.centre": ("m, where it is highest", rows(NUMBER, 2, 2) | {"title": "a point [x, y]"}),
    "rise.angle": ("rad, of its straight line or its back from the x axis", NUMBER),
    "bow": ("m, height of the whole without the cup", NUMBER),
    "cup_radius": ("m", POSITIVE),
    "cup": ("m, height of the cup over the bow", NUMBER),
    "rise.table": ("a CSV file of heights, columns x, y and z in m, relative to the scene", TEXT),
    # material and section
    "material.name": ("of the [catalogue](catalogue.md); other keys replace what it says", LISTED | one_of(materials)),
    "E": ("Pa, Young's modulus", POSITIVE),
    "material.E": ("Pa, Young's modulus; of wood along the grain", POSITIVE),
    "nu": ("-, Poisson's ratio", NUMBER | {"exclusiveMinimum": -1, "maximum": 0.5}),
    "material.nu": ("-, Poisson's ratio, at most 0.5 unless the material is orthotropic", NUMBER),
    # closer to -1, the rigidity of a plate is beyond all numbers
    "target.nu": ("-, Poisson's ratio of a body without [material]", within(-0.99, 0.5)),
    "rho": ("kg/m^3, density", POSITIVE),
    "E_across": ("Pa, of wood: Young's modulus across the grain", POSITIVE),
    "G": ("Pa, of wood: shear modulus", POSITIVE),
    "angle": ("rad, of wood: direction of the grain from the x axis", NUMBER),
    "yield_strength": ("Pa, in tension; above it the contact leaves a dent", POSITIVE),
    "contact.between.yield_strength": ("Pa, of the softer body; with it the contact may yield", POSITIVE),
    "G_xz": ("Pa, of wood: shear modulus through the thickness along the grain, for thick plates", POSITIVE),
    "G_yz": ("Pa, of wood: shear modulus through the thickness across the grain, for thick plates", POSITIVE),
    "thickness": ("m; left out with [[layer]] tables", SIZE),
    "layer.thickness": ("m", POSITIVE),
    "layer.angle": ("rad, from the x axis to the grain, besides the material's own", NUMBER),
    "material": ("what it is made of, with the keys of [material]; left out, the material of the body", {}),
    "rib.path": ("m, from point to point; what lies beyond the edge counts for nothing", CORNERS | {"minItems": 2}),
    "rib.edge": ("or the edge that it follows", TEXT),
    "rib.line": ("or an open path of the drawing, by its name", TEXT),
    "rib.width": ("m, along the plate", TAPER),
    "rib.height": ("m, across the plate", TAPER),
    "rib.diameter": ("m, of a round one, in place of width and height", TAPER),
    "rib.offset": ("m, of its middle over that of the plate; left out, it is glued to the side not struck", NUMBER),
    "tension": ("N/m, in the plane, the same in all directions", NOT_NEGATIVE),
    "width": ("m, across the blow", SIZE),
    "height": ("m, along the blow", SIZE),
    "diameter": ("m, of a round bar, in place of width and height", SIZE),
    # target and supports
    "mass": ("kg", POSITIVE),
    "target.mass": ("kg; rescales the body, or stands for its density", POSITIVE),
    "first_frequency": ("Hz, the lowest at which it bends", POSITIVE),
    "target.first_frequency": ("Hz; rescales the body, or stands for its stiffness", POSITIVE),
    "damping_ratio": ("-, of critical damping", DAMPING),
    "point_masses": (
        "m and kg, what is attached to the body",
        {"title": "a list of { at, mass }"} | rows(table({"at": POINT, "mass": POSITIVE}, ("at", "mass")), 0),
    ),
    "point_supports": (
        "m and N/m; hinged without a stiffness; clamped is a radius [m]",
        {"title": "a list of { at }, { at, stiffness } or { at, clamped }"} | rows(POSTS, 0),
    ),
    "source": ("where modes come from; auto takes closed forms if the body has them", one_of(SOURCES)),
    "theory": ("mindlin for a thick plate, timoshenko for a thick beam", one_of([*THEORIES[2], *THEORIES[1]])),
    "striker.bar.theory": ("timoshenko for a thick bar", one_of(THEORIES[1])),
    "air": ("the sides of the plate that face open air", one_of(AIR)),
    "baffle": ("whether a large rigid wall surrounds the plate", FLAG),
    "stretching": ("whether the body gets stiffer as it bends, good up to a deflection of about its thickness", FLAG),
    "model": ("auto takes thick theory, air and stretching where the tolerance requires them", one_of(MODELS)),
    "stiffness": ("N/m", POSITIVE),
    "supports.stiffness": ("N/m^2, of springs along a plate's edge; N/m at a beam's end", NOT_NEGATIVE),
    "supports.rotation": ("N, of springs against turning along a plate's edge; N m at a beam's end", NOT_NEGATIVE),
    # striker
    "striker.name": (
        "of the [catalogue](catalogue.md), in place of the kind; also says the contact",
        LISTED | one_of(strikers),
    ),
    "radius": ("m", POSITIVE),
    "n_modes": ("bending modes of the stick; left out, as many as the blow needs", COUNT),
    "slenderness": ("-, length of the stick over its diameter; with it shear counts", POSITIVE),
    "shear_ratio": ("-, stiffness in tension over that in shear", POSITIVE),
    "head": ("kg", POSITIVE),
    "handle": ("kg", POSITIVE),
    "damping": ("N s/m", NOT_NEGATIVE),
    "inertia": ("kg m^2 about the centre of mass, around the axis across blow and arm", POSITIVE),
    "arm": ("m, the contact point, from the centre of mass", ASIDE),
    "pivot": ("m, about which it turns as it arrives, from the centre of mass; left out, it comes straight", ASIDE),
    "gravity": ("m/s^2, that brings a free striker back after each bounce; 9.80665 onto a level body", NOT_NEGATIVE),
    "hand.force": ("N, with which the hand presses", NUMBER),
    "left": ("how this end is held; at most one end may be", one_of(TURNING)),
    "right": ("how this end is held; at most one end may be", one_of(TURNING)),
    "striker.bar.at": ("m, where on the bar it strikes", NUMBER),
    # contact
    "contact.stiffness": ("N/m^exponent: force = stiffness * approach^exponent", POSITIVE),
    "exponent": ("-, 1.5 for round bodies", within(LOWEST_EXPONENT, HIGHEST_EXPONENT)),
    "loss": ("s/m; the force is multiplied by 1 + loss * rate of approach", NOT_NEGATIVE),
    "gap": ("m, travelled before contact", NUMBER),
    "restitution": ("-, of a mass on a rigid wall", within(1e-6, 1.0)),
    "contact.speed": ("m/s, at which this restitution holds", POSITIVE),
    **{
        f"contact.{law.name}.{key}": _of_law(number)
        for law in MARKS.values()
        for key, number in (law.numbers | law.keys).items()
    },
    # strike and stroke
    "at": ("m, where the striker hits the body", POINT),
    "speed": ("m/s, of the striker's contact point towards the body", NOT_NEGATIVE),
    "stroke.speed": ("m/s, if other than in [strike]", POSITIVE),
    "tolerance": ("-, largest accepted error, absolute in restitution, else relative", within(1e-12, 1.0)),
    "quantity": (
        "what must meet the tolerance: restitution, impulse, contact_time, force, n_impacts (by default these five), "
        '"spectrum=5000", "sound=5000"',
        named("a name or a list of names", QUANTITY, rows(QUANTITY), {"type": "object"}),
    ),
    "residual": ("whether the compliance of modes left out acts", FLAG),
    "duration": ("s, when the run stops at the latest", POSITIVE),
    "max_impacts": ("the run stops after so many impacts", COUNT),
    "scheme": ("of time integration; A4 if left out, or by the name of an earlier one", one_of(SCHEMES)),
    "dt": ("s, time step in contact; left out, the tolerance decides", POSITIVE),
    "striker_force": ("N, constant, positive along the blow; such as the weight of a falling ball", NUMBER),
    "target_force": ("N, constant, on the body at the strike point, positive along the blow", NUMBER),
    "when": ("s, when the striker is at the surface", NUMBER),
    "lasts": ("s, after which the striker is lifted", POSITIVE),
    # observe and map
    "points": (
        "m, points of the body where motion and sound are computed",
        {"title": "a list of points"} | rows(POINT),
    ),
    "listener": ("m, where sound is computed; z is the distance from the plate", PLACE),
    "listeners": (
        "m, several such places; the first two are left and right of stereo.wav",
        {"title": "a list of points [x, y, z]"} | rows(PLACE, 1, MOST_LISTENERS),
    ),
    "over": (
        'the axes: any numbers of the scene, such as "striker.mass" = [0.05, 0.1]; without a count, borders are found',
        {"title": "a table of axes, each a list or { from, to, count, scale }", "type": "object", "minProperties": 1}
        | {"additionalProperties": AXIS},
    ),
    "max_frequency": ("Hz, upper end of the band of the spectral centroid", POSITIVE),
}


def form(table: str, kind: str, key: str) -> Form:
    """The JSON schema of a key, with its words; KeyError if nobody wrote them."""
    names = (f"{table}.{kind}.{key}", f"{table}.{key}", key)
    words, found = KEYS[next(name for name in names if name in KEYS or name == key)]
    return {"description": words, **found}


def checked(table: str, key: str, value: Any) -> Any:
    """The value of a key that is a number, a word or a flag, if its form allows it; ValueError says what it may be."""
    found = form(table, "", key)
    unit = found["description"].partition(",")[0].partition(";")[0].strip("-")
    if "enum" in found:
        return check.one_of(key, value, found["enum"])
    if found["type"] == "boolean":
        return check.flag(key, value)
    if "maximum" in found:
        return check.between(key, value, found["minimum"], found["maximum"], unit)
    return (check.positive if "exclusiveMinimum" in found else check.number)(key, value, unit)
