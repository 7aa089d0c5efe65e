"""Values in one line of YAML, and the mark of lines that state what no file does."""

import re

CHOOSE = "# CHOOSE"
_PLAIN = re.compile(r"^[A-Za-z_][\w./-]*$")
_WORDS = {"true", "false", "null", "yes", "no", "on", "off", "y", "n"}


def flow(value: object) -> str:
    """A value in one line of YAML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{flow(k)}: {flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(flow(v) for v in value) + "]"
    if isinstance(value, str) and (not _PLAIN.match(value) or value.lower() in _WORDS):
        return "'" + value.replace("'", "''") + "'"
    return str(value)
