"""Text of files is printable on a terminal, and safe as a file name."""

from __future__ import annotations

from pathlib import Path

import pytest

from artsim.common.names import printable, safe_name


@pytest.mark.parametrize(
    "text",
    ["/etc/passwd", "../../x", "x/../../y", "a\\b", ".hidden", "..", "", "con", "NUL.txt", "a\0b", "\ud800", "x" * 1000,
     "\u202ex", "a b", "trailing.", "C:\\x"],
)  # fmt: skip
def test_a_name_is_never_a_path(text: str) -> None:
    name = safe_name(text)
    assert Path(name).name == name
    assert not name.startswith(".")
    assert len(f"{name}.png".encode()) <= 255
    assert name.isprintable()
    assert name != text
    assert safe_name(text) == name
    assert safe_name(name) == name


def test_names_that_differ_stay_apart() -> None:
    texts = ["a/b", "a_b", "a\\b", "a b", "..a_b", "x" * 100, "x" * 101, "\u6905", "\u6905/"]
    assert len({safe_name(text) for text in texts}) == len(texts)
    assert safe_name("laptop-10211") == "laptop-10211"
    assert safe_name("\u6905\u5b50") == "\u6905\u5b50"


def test_printable_text_stays_as_it_is() -> None:
    for text in ("drawer_1", "\u6905\u5b50 \u00e9\u00df", "73 deg, 12 cm", ""):
        assert printable(text) == text
