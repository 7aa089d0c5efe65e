"""A page as a reader of HTML takes it."""

import re
from html.parser import HTMLParser

VOID = {"meta", "img", "br", "link", "hr", "col", "input"}


class Page(HTMLParser):
    """Checks that tags are balanced; keeps tags, references, ids and text."""

    def __init__(self, path):
        super().__init__()
        self.open, self.tags, self.links, self.ids, self.words = [], [], [], [], []
        self.feed(path.read_text(encoding="utf-8"))
        self.close()
        assert self.open == []

    @property
    def text(self):
        return re.sub(r"\s+", " ", " ".join(self.words))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.tags.append((tag, found))
        self.links += [v for k, v in attributes if k in ("href", "src", "xlink:href", "data", "action")]
        self.ids += [found["id"]] if "id" in found else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.words.append(data)
