"""Environments that lack packages, for child processes: as if nobody had ever installed them.

What the core may use is read from the metadata of packages: a dependency that nobody declared is missing, too.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

from packaging.requirements import Requirement

_TOOLS = {"pip", "setuptools"}
"""Distributions that an environment has anyway."""
_HIDE = """
import sys
from importlib.machinery import PathFinder


class Without(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if name.partition(".")[0] in MISSING else super().find_spec(name, path, target)


sys.meta_path[sys.meta_path.index(PathFinder)] = Without
"""


def environment(folder: Path, missing: Collection[str]) -> dict[str, str]:
    """Environment variables of a Python process, and of all that it starts, which finds none of some modules.

    Parameters
    ----------
    folder : Path
        An empty one.
    missing : collection of str
        Modules.
    """
    (folder / "sitecustomize.py").write_text(f"MISSING = {sorted(missing)!r}\n{_HIDE}")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}


@cache
def beyond_the_core(extra: str = "") -> frozenset[str]:
    """Installed modules that belong to no distribution that artsim's core, as its metadata has it, brings along, nor
    one of its extras."""
    core = distributions_of("") | distributions_of(extra) | _TOOLS
    return frozenset(
        module for module, owners in packages_distributions().items() if not core & {normal(owner) for owner in owners}
    )


@cache
def distributions_of(extra: str) -> frozenset[str]:
    """Names of all distributions that an extra of artsim brings, directly or not; those of the core for ''."""
    found: set[tuple[str, str]] = set()
    todo = [("artsim", extra)]
    while todo:
        name, wanted = todo.pop()
        if (name, wanted) in found:
            continue
        found.add((name, wanted))
        try:
            lines = requires(name) or []
        except PackageNotFoundError:
            continue
        for requirement in map(Requirement, lines):
            if requirement.marker is None or requirement.marker.evaluate({"extra": wanted}):
                todo += [(normal(requirement.name), each) for each in ("", *requirement.extras)]
    return frozenset(name for name, _ in found)


def normal(name: str) -> str:
    """The name of a distribution as packaging compares it."""
    return re.sub(r"[-_.]+", "-", name).lower()
