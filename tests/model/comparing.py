"""What blows of the model are compared by."""

QUANTITIES = ("impulse", "contact_time", "peak_force")


def difference(hit, other):
    """What the tolerance speaks of: the largest of four differences."""
    relative = (abs(getattr(hit, name) / getattr(other, name) - 1.0) for name in QUANTITIES)
    return max(abs(hit.restitution - other.restitution), *relative)


def examined(hit, name):
    """One assumption of a blow."""
    return next(each for each in hit.assumptions if each.name == name)
