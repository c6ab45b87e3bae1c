"""Reports as one HTML file."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from runs.reports.machine import machine, versions
from runs.reports.page import Cell, Page

VOID = {"meta", "img", "br"}


class Checker(HTMLParser):
    """Collects what a page refers to, and the elements that are open."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.targets: set[str] = set()
        self.open: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """An element begins."""
        self.links += [value or "" for name, value in attrs if name in ("src", "href", "action", "data")]
        self.targets |= {f"#{value}" for name, value in attrs if name == "id"}
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """An element ends: the one that began last."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Text."""
        self.text.append(data)


def check(page: str) -> Checker:
    """The page's checker: every element is closed, and nothing outside the file is referred to."""
    checker = Checker()
    checker.feed(page)
    checker.close()
    assert not checker.open
    assert all(link.startswith("data:image/") or link in checker.targets for link in checker.links)
    page = re.sub(r"base64,[^\"]*", "", page)
    assert not re.search(r"https?:|//[a-z]|@import|url\(|<script", page)
    return checker


def test_self_contained(tmp_path: Path) -> None:
    """A page with every part refers to nothing outside itself, and shows text as it was given."""
    figure = pytest.importorskip("matplotlib.figure").Figure(figsize=(2, 2))
    figure.add_subplot().loglog([1, 10], [1, 0.1])
    figure.savefig(tmp_path / "a.png")
    page = Page("Errors", "a < b & c")
    page.section("Summary")
    page.text("`x < y`", "<script>")
    page.points(["one", "two"])
    page.facts({"cores": 2})
    page.table(("case", "error"), [("hertz", 1.2345e-4), ("wavy", Cell("missed", "bad")), ("string", None)], "All.")
    page.section("Pictures")
    page.picture(figure, "A line.")
    page.picture(tmp_path / "a.png", "The same line.", "one falling line")
    page.write(tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf8")
    checker = check(text.replace("&lt;script", ""))
    assert [link[:20] for link in checker.links if link.startswith("data:")] == [
        "data:image/svg+xml;b", "data:image/png;base6",
    ]  # fmt: skip
    assert "a < b & c" in checker.text
    assert "<code>x &lt; y</code>" in text
    assert "0.000123" in text
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.png", "page.html"]


def test_only_pictures(tmp_path: Path) -> None:
    """A file of another kind is refused."""
    with pytest.raises(ValueError, match=r"a\.gif: must be a \.png"):
        Page("t").picture(tmp_path / "a.gif", "")


def test_numbers_to_the_right() -> None:
    """A column of numbers is aligned to the right, one with words is not."""
    page = Page("t")
    page.table(("a", "b"), [(1.0, "1e-3 ± 2e-4"), (None, "failed")])
    assert '<th class="number">a</th><th>b</th>' in page.html()


def test_machine() -> None:
    """The machine and the versions are known, and no host's name or path is among them."""
    facts = {**machine(), **versions()}
    assert {"processor", "cores", "memory [GiB]", "python", "numpy", "petsc", "mumps", "gmsh", "commit"} <= set(facts)
    assert "unknown" not in (facts["petsc"], facts["mumps"], facts["numpy"])
    assert not any("/" in str(value) for value in facts.values())
