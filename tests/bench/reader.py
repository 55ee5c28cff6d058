"""A reader of pages for tests."""

from collections import defaultdict
from html.parser import HTMLParser


class Reader(HTMLParser):
    """Ids, addresses, the texts of elements with an id, and the cells of each table, of a well-formed
    page."""

    VOID = frozenset({"meta", "img", "br", "input", "link", "hr"})

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.addresses, self.tables, self.figure = [], [], [], {}, ""
        self.texts = defaultdict(str)
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.ids += [attrs["id"]] if "id" in attrs else []
        self.addresses += [attrs[name] for name in ("src", "href") if name in attrs]
        if tag == "figure":
            self.figure = attrs.get("id", "")
        elif tag == "tr":
            self.tables.setdefault(self.figure, []).append([])
        elif tag in ("td", "th") and self.tables:
            list(self.tables.values())[-1][-1].append("")
        if tag not in self.VOID:
            self.open.append((tag, attrs.get("id")))

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag
        if tag == "figure":
            self.figure = ""

    def handle_data(self, data):
        if self.open and self.open[-1][1]:
            self.texts[self.open[-1][1]] += data
        if {"td", "th"} & {tag for tag, _ in self.open}:
            list(self.tables.values())[-1][-1][-1] += data
