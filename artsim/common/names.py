"""Text out of files that nobody vouches for, made safe to print and to name files after."""

import difflib
import hashlib
import io
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TextIO

_MAX_NAME = 60
"""Characters of a file name: of four bytes each in UTF-8 at worst, they fit the 255 that file systems take."""

_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
"""Names that Windows takes for devices."""


def printable(text: object, most: int = 120) -> str:
    r"""Text as one line that a terminal shows as it is, whatever the text holds.

    Control characters (an escape sequence may rewrite a terminal), marks that turn the direction of writing, line
    breaks and lone surrogates become escapes such as ``\x1b``. What is longer than ``most`` loses its middle.

    Parameters
    ----------
    text : object
        Anything that has a ``str()``.
    most : int
        Characters that are kept.
    """
    text = str(text)
    if len(text) > most:
        half = (most - 5) // 2
        text = f"{text[:half]} ... {text[-half:]}"
    return _escape(text)


def _escape(text: str) -> str:
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


class PrintableStream(io.TextIOBase):
    """A text stream that lets line breaks through and, of all else, what is :func:`printable`.

    Parameters
    ----------
    stream : text stream
        What is written to.
    """

    def __init__(self, stream: TextIO):
        self._stream = stream

    def write(self, text: str) -> int:
        """Write a text, escaped."""
        self._stream.write("\n".join(map(_escape, text.split("\n"))))
        return len(text)

    def flush(self) -> None:
        """Pass on what was written."""
        self._stream.flush()

    def isatty(self) -> bool:
        """Whether somebody watches."""
        return self._stream.isatty()


def safe_name(text: object, fallback: str = "object") -> str:
    """A file name for a thing that is called ``text``: never a path, nor hidden, nor longer than file systems take.

    Letters, digits, ``_``, ``-`` and dots inside stay. A name that had to be changed ends in a digest of the original,
    so that different things keep different names.

    Parameters
    ----------
    text : object
        Anything that has a ``str()``.
    fallback : str
        What stands for a name of which nothing is left.
    """
    text = str(text)
    # Dots at the ends would hide a file, climb a folder, or be dropped by Windows.
    name = re.sub(r"(?:[^\w.-]|\.{2,})+", "_", text).strip("._-")
    if not name or _RESERVED.fullmatch(name):
        name = fallback
    if name == text and len(name) <= _MAX_NAME:
        return name
    digest = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{name[: _MAX_NAME - 9].rstrip('._-')}-{digest}"


def unused_name(name: str, used: set[str]) -> str:
    """A name that nothing has yet; it is used from now on."""
    while name in used:
        name += "_"
    used.add(name)
    return name


def numbered(names: Sequence[str]) -> list[str]:
    """The names, those that occur more than once with a number: ``body, drawer 1, drawer 2``."""
    total, seen = Counter(names), Counter[str]()
    texts = []
    for name in names:
        seen[name] += 1
        texts.append(f"{name} {seen[name]}" if total[name] > 1 else name)
    return texts


def name_fix(asked: object, known: Iterable[str]) -> str:
    """How to mend a name that is not known: by the one that it is a slip of, such as ``Laptop``, or by any other."""
    names = list(known)
    near = difflib.get_close_matches(re.sub(r"[\s-]", "_", str(asked).lower()[:_MAX_NAME]), names, 1, 0.7)
    return f"{f'did you mean {near[0]}? Else ' if near else ''}use one of {', '.join(names)}"


def is_number(text: str) -> bool:
    """Whether a text is one, as Python reads it."""
    try:
        float(text)
    except ValueError:
        return False
    return True
