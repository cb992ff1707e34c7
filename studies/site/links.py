"""Looks for links of a built site that lead nowhere, and for anything that it would load from a network."""

import re
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit

TAG = re.compile(r"<([a-z]+\d?)((?:\s+[\w-]+(?:=\"[^\"]*\")?)+)\s*/?>")
ATTRIBUTE = re.compile(r"([\w-]+)=\"([^\"]*)\"")
SHEETS = {"stylesheet", "icon", "preload"}  # what a <link> loads


class Page:
    """The anchors of a page, where it leads and what it loads; Sphinx writes all attributes in double quotes."""

    def __init__(self, text):
        self.anchors, self.leads, self.loads = {""}, [], []
        for tag, written in TAG.findall(text):
            found = {key: unescape(value) for key, value in ATTRIBUTE.findall(written)}
            self.anchors |= {found[key] for key in ("id", "name") if key in found}
            if tag == "a" and found.get("href"):
                self.leads.append(found["href"])
            if tag == "link" and SHEETS & set(found.get("rel", "").split()):
                self.loads.append(found["href"])
            if tag != "a" and found.get("src"):
                self.loads.append(found["src"])


def broken(folder):
    """Each link within the site that leads nowhere, and each file of another host that a page loads, as a sentence."""
    folder = Path(folder).resolve()
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.html"))}
    found = []
    for path, page in pages.items():
        name = path.relative_to(folder)
        for link in page.leads + page.loads:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                if link in page.loads and parts.scheme != "data":
                    found.append(f"{name} loads {link}")
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file() or not target.is_relative_to(folder):
                found.append(f"{name} leads to {link}, which does not exist")
            elif target in pages and unquote(parts.fragment) not in pages[target].anchors:
                found.append(f"{name} leads to {link}, which has no such place")
    return found
