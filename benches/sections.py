"""Sections of a measured document, each written by the script that measured it."""

from __future__ import annotations

import re
from pathlib import Path


def replace_section(path: Path, heading: str, body: str) -> None:
    """Writes the section `## heading`, in place of the one of that name if there is one."""
    text = path.read_text()
    section = f"## {heading}\n\n{body.strip()}\n"
    old = re.compile(
        rf"^## {re.escape(heading)}\n.*?(?=^## |\Z)", re.MULTILINE | re.DOTALL
    )
    if old.search(text):
        text = old.sub(lambda _: section + "\n", text)
    else:
        text = text.rstrip() + "\n\n" + section
    path.write_text(text.rstrip() + "\n")
