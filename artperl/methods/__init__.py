"""From a cloud to an estimate: each method is one page, and one line of the registry.

``METHODS`` names the class of each method, which is imported when it is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Literal, get_args

from artsim.common.names import name_fix
from artsim.errors import ConfigError

if TYPE_CHECKING:
    from artperl.methods.protocol import Method

METHODS = {
    "full": "artperl.methods.full:Estimator",
    "artperl": "artperl.methods.artperl:ArtPERL",
    "ancsh": "artperl.methods.ancsh:ANCSH",
    "omad": "artperl.methods.omad:OMAD",
    "sporeagent": "artperl.methods.sporeagent:SporeAgent",
}
"""Module and class of each method: full, which comes with trained weights; artperl, section 4 of the paper; and the
baselines that the paper compares with."""
StoredMethod = Literal["full", "artperl", "ancsh", "omad", "sporeagent"]
STORED_METHODS: tuple[str, ...] = get_args(StoredMethod)
"""Those that are trained and written down; others make themselves for a category."""


def method_of(name: str) -> type[Method]:
    """The class of a method.

    Raises
    ------
    ConfigError
        When there is no method of that name.
    """
    if name not in METHODS:
        raise ConfigError(f"there is no method {name!r}", "method", name_fix(name, METHODS))
    module, name_of_class = METHODS[name].split(":")
    found: type[Method] = getattr(import_module(module), name_of_class)
    return found
