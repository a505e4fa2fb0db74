"""The report as one web page that needs no other file."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from pathlib import Path

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 1500px; margin: 2em auto; padding: 0 1em;
       color: #222; background: #fff; }
h1, h2 { font-weight: 600; line-height: 1.2; }
h2 { margin-top: 2em; }
table { border-collapse: collapse; margin: 1em 0; font-variant-numeric: tabular-nums; }
th, td { padding: .25em .9em; border-bottom: 1px solid #ddd; text-align: right; }
th:first-child, td:first-child { text-align: left; }
img { max-width: 100%; height: auto; }
dt { font-weight: 600; } dd { margin: 0 0 .4em 0; overflow-wrap: anywhere; }
"""

#: A part of the page: heading, tables (heading row first), picture (or none), remark.
Section = tuple[str, Sequence[Sequence[Sequence[str]]], "Path | None", str]


def page(title: str, facts: Sequence[tuple[str, str]], sections: Sequence[Section]) -> str:
    """The page's text, pictures inlined.

    Args:
        title: its heading.
        facts: names and values of the circumstances.
        sections: in their order.
    """
    listed = "".join(f"<dt>{escape(n)}</dt><dd>{escape(v)}</dd>\n" for n, v in facts)
    body = "".join(_section(*s) for s in sections)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"<title>{escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{escape(title)}</h1>\n<dl>\n{listed}</dl>\n{body}</body>\n</html>\n"
    )


def _section(
    heading: str,
    tables: Sequence[Sequence[Sequence[str]]],
    picture: Path | None,
    remark: str,
) -> str:
    parts = [f"<h2>{escape(heading)}</h2>\n"]
    if remark:
        parts.append(f"<p>{escape(remark)}</p>\n")
    parts += [_table(rows) for rows in tables]
    if picture is not None and picture.exists():
        data = base64.b64encode(picture.read_bytes()).decode("ascii")
        parts.append(f'<img alt="{escape(heading)}" src="data:image/png;base64,{data}">\n')
    return "".join(parts)


def _table(rows: Sequence[Sequence[str]]) -> str:
    head, *body = rows
    lines = ["<tr>" + "".join(f"<th>{escape(c)}</th>" for c in head) + "</tr>"]
    lines += ["<tr>" + "".join(f"<td>{escape(c)}</td>" for c in row) + "</tr>" for row in body]
    return "<table>\n" + "\n".join(lines) + "\n</table>\n"
