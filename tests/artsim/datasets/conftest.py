"""What tests of datasets share as fixtures."""

from __future__ import annotations

import multiprocessing

import pytest

from artsim.runs import pool


@pytest.fixture
def quick_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Worker processes that are copies of this one: they need not import everything again, which takes a second."""
    context = multiprocessing.get_context("fork")
    monkeypatch.setattr(pool.multiprocessing, "get_context", lambda method: context)
