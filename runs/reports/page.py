"""A report as one HTML file that needs no network and prints well: sections, text, tables and pictures.

page = Page("Error against run time", "What the program reaches in a second.")
page.section("Summary")
page.text("Every error is against a closed form.", "`h` is the mesh size.")
page.table(("case", "error"), [("hertz-line", "1e-4"), ("wavy", Cell("missed", "bad"))], "The cases.")
page.picture(figure, "Error over seconds.")
page.write("study.html")
"""

from __future__ import annotations

import base64
import html
import io
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Mark = Literal["", "good", "fair", "bad", "quiet"]

WIDE = 14
"""A table with more columns is printed across the page."""

NUMBER = r"[-−+<>≈≤]?\s?\d[\d.,]*(e[-+]?\d+)?(\s?[±–]\s?\d[\d.]*(e[-+]?\d+)?)?(\s?(s|ms|%|×|MiB))?"

STYLE = """
:root { --ink: #1a1a1a; --soft: #5b6470; --rule: #d5d9de; --fill: #f4f6f8; --good: #00694b; --fair: #7a5200;
  --bad: #b03a00; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 60rem; color: var(--ink); background: #fff;
  font: 16px/1.55 Georgia, "Times New Roman", "Liberation Serif", serif; }
h1, h2, h3, nav, table, figcaption, .facts { font-family: "Helvetica Neue", Arial, "Liberation Sans", sans-serif; }
h1 { font-size: 2rem; line-height: 1.2; margin: 0 0 .4rem; }
h2 { font-size: 1.4rem; margin: 3rem 0 .8rem; padding-top: .8rem; border-top: 2px solid var(--ink); }
h3 { font-size: 1.1rem; margin: 2rem 0 .6rem; }
.lead { font-size: 1.15rem; color: var(--soft); margin: 0 0 1.5rem; }
nav { font-size: .9rem; columns: 2; padding: .8rem 1rem; background: var(--fill); }
nav ol { margin: 0; padding-left: 1.3rem; } nav a { color: inherit; }
p { max-width: 46rem; } ul { max-width: 46rem; padding-left: 1.3rem; }
code { font: .88em/1 "DejaVu Sans Mono", Menlo, Consolas, monospace; background: var(--fill); padding: .1em .3em;
  overflow-wrap: anywhere; }
.scroll { overflow-x: auto; margin: 1rem 0 1.6rem; }
table { border-collapse: collapse; font-size: .8rem; line-height: 1.35; font-variant-numeric: tabular-nums; }
caption { caption-side: top; text-align: left; color: var(--soft); padding-bottom: .4rem; font-size: .85rem; }
th, td { padding: .25rem .6rem; text-align: left; vertical-align: top; border-bottom: 1px solid var(--rule); }
th { border-bottom: 1.5px solid var(--ink); vertical-align: bottom; }
td.number, th.number { text-align: right; white-space: nowrap; }
.good { color: var(--good); font-weight: 600; } .fair { color: var(--fair); font-weight: 600; }
.bad { color: var(--bad); font-weight: 600; } .quiet { color: var(--soft); }
figure { margin: 1.2rem 0 2rem; } figure img { display: block; max-width: 100%; height: auto; }
figcaption { font-size: .85rem; color: var(--soft); margin-top: .5rem; max-width: 46rem; }
.facts { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1.2rem; font-size: .85rem; }
.facts dt { color: var(--soft); } .facts dd { margin: 0; overflow-wrap: anywhere; }
@media (max-width: 40rem) { nav { columns: 1; } body { padding: 1.2rem 1rem; } }
@page { size: A4; margin: 16mm 14mm; }
@page wide { size: A4 landscape; margin: 12mm; }
@media print {
  body { max-width: none; padding: 0; font-size: 10pt; }
  h1 { font-size: 20pt; } h2 { font-size: 14pt; margin-top: 1.6rem; } h3 { font-size: 11pt; }
  h2, h3, h2 + p, caption { break-after: avoid; }
  figure, tr { break-inside: avoid; } thead { display: table-header-group; }
  .wide { page: wide; } .scroll { overflow: visible; }
  table { font-size: 7.5pt; max-width: 100%; } th, td { padding: .15rem .4rem; }
  nav { background: none; border: 1px solid var(--rule); } nav a { text-decoration: none; }
}
"""


@dataclass(frozen=True)
class Cell:
    """A cell of a table whose text is also coloured; the text alone must say it."""

    text: str
    mark: Mark = ""


Entry = str | float | int | Cell | None


class Page:
    """One HTML file, built from top to bottom; everything it shows is inside it.

    Text is plain: it is escaped, and only `words` between backticks are set as code.

    Parameters
    ----------
    title, lead : the heading, and the sentence under it
    """

    def __init__(self, title: str, lead: str = "") -> None:
        self.title, self.lead = title, lead
        self._parts: list[str] = []
        self._sections: list[str] = []

    def section(self, heading: str) -> None:
        """Begin a section; it enters the list of contents."""
        self._sections.append(heading)
        self._parts.append(f'<h2 id="section-{len(self._sections)}">{_text(heading)}</h2>')

    def heading(self, heading: str) -> None:
        """A heading inside a section."""
        self._parts.append(f"<h3>{_text(heading)}</h3>")

    def text(self, *paragraphs: str) -> None:
        """Paragraphs."""
        self._parts += [f"<p>{_text(paragraph)}</p>" for paragraph in paragraphs]

    def points(self, items: Iterable[str]) -> None:
        """A list with dots; nothing where it is empty."""
        listed = "".join(f"<li>{_text(item)}</li>" for item in items)
        if listed:
            self._parts.append(f"<ul>{listed}</ul>")

    def facts(self, facts: Mapping[str, str | float]) -> None:
        """Names and values in two columns."""
        listed = "".join(f"<dt>{_text(name)}</dt><dd>{_text(str(value))}</dd>" for name, value in facts.items())
        self._parts.append(f'<dl class="facts">{listed}</dl>')

    def table(self, head: Sequence[str], rows: Iterable[Sequence[Entry]], caption: str = "") -> None:
        """A table; columns that hold numbers, also written out as text, are aligned to the right."""
        rows = [list(row) for row in rows]
        numeric = [all(_number(row[i]) for row in rows) and bool(rows) for i in range(len(head))]
        kinds = [' class="number"' if is_number else "" for is_number in numeric]
        title = f"<caption>{_text(caption)}</caption>" if caption else ""
        top = _row("th", [_text(name) for name in head], kinds)
        kind = "scroll wide" if len(head) > WIDE else "scroll"
        body = "\n".join(_row("td", [_entry(entry) for entry in row], kinds) for row in rows)
        self._parts.append(
            f'<div class="{kind}"><table>{title}<thead>{top}</thead>\n<tbody>{body}</tbody></table></div>'
        )

    def picture(self, picture: Figure | str | os.PathLike[str], caption: str, alt: str = "") -> None:
        """A picture: a matplotlib figure, as vectors, or a .png or .svg file.

        Raises
        ------
        ValueError
            where the file is neither.
        """
        if isinstance(picture, str | os.PathLike):
            path = Path(picture)
            kinds = {".png": "image/png", ".svg": "image/svg+xml"}
            if path.suffix not in kinds:
                raise ValueError(f"{path}: must be a .png or an .svg")
            kind, data = kinds[path.suffix], path.read_bytes()
        else:
            stream = io.BytesIO()
            # without a date or fonts from outside: the same figure gives the same file everywhere
            picture.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
            kind, data = "image/svg+xml", stream.getvalue()
        code = base64.b64encode(data).decode("ascii")
        self._parts.append(
            f'<figure><img alt="{html.escape(alt or caption)}" src="data:{kind};base64,{code}">'
            f"<figcaption>{_text(caption)}</figcaption></figure>"
        )

    def html(self) -> str:
        """The whole file."""
        listed = "".join(f'<li><a href="#section-{i}">{_text(s)}</a></li>' for i, s in enumerate(self._sections, 1))
        contents = f"<nav><ol>{listed}</ol></nav>" if len(self._sections) > 1 else ""
        lead = f'<p class="lead">{_text(self.lead)}</p>' if self.lead else ""
        return (
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{html.escape(self.title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
            f"<header><h1>{_text(self.title)}</h1>{lead}</header>\n{contents}\n"
            + "\n".join(self._parts)
            + "\n</body>\n</html>\n"
        )

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the file; what was there before is replaced at once, never left half."""
        target = Path(path)
        part = target.with_name(target.name + ".part")
        part.write_text(self.html(), encoding="utf8")
        part.replace(target)


def _text(text: str) -> str:
    """Plain text as HTML; `words` between backticks as code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text, quote=False))


def _row(tag: str, cells: Iterable[str], kinds: Sequence[str]) -> str:
    """A line of a table from its cells' HTML and attributes."""
    return "<tr>" + "".join(f"<{tag}{k}>{cell}</{tag}>" for cell, k in zip(cells, kinds, strict=True)) + "</tr>"


def _entry(entry: Entry) -> str:
    if entry is None:
        return '<span class="quiet">–</span>'
    if isinstance(entry, Cell):
        return f'<span class="{entry.mark}">{_text(entry.text)}</span>' if entry.mark else _text(entry.text)
    return _text(f"{entry:.3g}" if isinstance(entry, float) else str(entry))


def _number(entry: Entry) -> bool:
    """Whether an entry is a number or its absence; numbers may have a sign, a spread and a unit."""
    text = entry.text if isinstance(entry, Cell) else "" if entry is None else str(entry)
    return not isinstance(entry, str | Cell) or text == "–" or re.fullmatch(NUMBER, text) is not None
