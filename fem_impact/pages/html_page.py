"""Fills the templates of the folder ``web``: pages of one file each, with styles, scripts, pictures and sounds."""

import base64
import io
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import wavfile

from .._base import check, markup
from .._base.files import write_whole
from ..show import export

WEB = Path(__file__).parent / "web"
QUIET = -20.0  # [dB] re full scale: a quieter sound is offered amplified


def template(name: str) -> Any:
    """A template of the folder ``web``; it escapes all text."""
    jinja2 = check.extra("jinja2", "web", "a page")
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(WEB), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    ).get_template(name)


def web_text(*names: str) -> str:
    """The text of files of the folder ``web``, one after another."""
    return "".join((WEB / name).read_text(encoding="utf-8") for name in names)


def write_page(
    path: str | Path, name: str, styles: tuple[str, ...] = ("report.css",), scripts: tuple[str, ...] = (), **values: Any
) -> int:
    """Fill a template with values, styles and scripts, and write it; return its size [byte]."""
    parts = {"style": web_text(*styles), "script": web_text(*scripts), "versions": export.versions()}
    return write_whole(path, template(name).render(parts, **values))


def script_data(data: Any) -> str:
    """Data as JSON within a page; no "<" in it can close the script element around it."""
    return json.dumps(export.plain(data), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def packed(values: Any, kind: str = "<f4", squeezed: bool = False) -> str:
    """Numbers as pages read them: base64 of 32-bit floats, or of another type; deflated if ``squeezed``."""
    raw = np.asarray(values, kind).tobytes()
    return base64.b64encode(zlib.compress(raw, 9) if squeezed else raw).decode("ascii")


def audio(samples: np.ndarray, rate: int) -> str:
    """A data URI with the samples as a 16-bit WAV file, for the page's player."""
    file = io.BytesIO()
    wavfile.write(file, rate, np.round(32767.0 * np.clip(samples, -1.0, 1.0)).astype(np.int16))
    return markup.data_uri("audio/wav", file.getvalue())


def picture_uri(figure: Any) -> str:
    """A figure as the address of a picture within a page."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=120, transparent=True)
    return markup.data_uri("image/png", file.getvalue())
