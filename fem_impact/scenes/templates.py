"""Commented scenes to begin with: each runs as it stands and says what else its keys may be."""

from pathlib import Path

from .._base import check
from .._base.files import write_whole

FILES = Path(__file__).with_name("kinds")
KINDS = ("plate", "disk", "beam", "map")
PLACE = "[0.13, 0.1]"  # [m] where the plate is struck, away from nodes


def text(kind: str) -> str:
    """The scene of a kind, one of `KINDS`, as the text of a TOML file; a map is one of the plate."""
    names = ("plate", "map") if check.one_of("kind", kind, KINDS) == "map" else (kind,)
    return "\n".join((FILES / f"{name}.toml").read_text("utf-8") for name in names)


def write_scene(path: Path, kind: str, whole: str | None = None) -> None:
    """Write the scene of a kind, or another text; refuses to replace a file."""
    if path.suffix.lower() != ".toml":
        raise ValueError(f"a scene must be a .toml file, got {path}")
    if path.exists():
        raise ValueError(f"{path} exists already; name another file with --out, or remove it")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, text(kind) if whole is None else whole)
