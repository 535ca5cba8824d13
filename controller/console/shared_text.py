"""Text of a shared page, without the folders of the user who made it."""

import re
from collections.abc import Mapping
from typing import Any

from snakewalk.config.plain_text import plain

_FOLDERS = re.compile(
    r"""(?<![\w.:/\\~-])             # not within a relative path, a URL or a unit
    (?:~[\w.-]*|[A-Za-z]:)?[/\\](?!dev/)
    (?:[^/\\'"<>|;:,\s]*[/\\])+""",
    re.VERBOSE,
)
_PATH = re.compile(r"(?:~[\w.-]*|[A-Za-z]:)?[/\\](?!dev/)(?:[^\n]*[/\\])?([^/\\\n]+)[/\\]?")


def without_folders(text: str) -> str:
    """Return a text with absolute paths reduced to file names; devices keep theirs.

    A text that is one path, or OPTION=PATH, may contain spaces.
    """
    text = plain(text)
    option, equals, value = text.rpartition("=") if "://" not in text else ("", "", text)
    path_match = _PATH.fullmatch(value)
    if path_match is not None and not any(c in option for c in " /\\"):
        return option + equals + path_match[1]
    return _FOLDERS.sub("", text)


def shared(value: Any) -> Any:
    """Return a JSON value with its texts and keys ``without_folders``."""
    if isinstance(value, str):
        return without_folders(value)
    if isinstance(value, Mapping):
        return {without_folders(str(key)): shared(element) for key, element in value.items()}
    if isinstance(value, list | tuple):
        return [shared(element) for element in value]
    return value
