"""Packages whose public names are imported when first asked for: a program waits only for what it uses."""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(
    package: str, homes: Mapping[str, str], packages: tuple[str, ...] = ()
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """What a package defines as ``__getattr__`` and ``__dir__`` (PEP 562). Its ``__all__`` stands before.

    Parameters
    ----------
    package : str
        Its ``__name__``.
    homes : mapping
        Public name -> module of the package that defines it. Where that needs an extra, the error says which.
    packages : tuple of str
        Modules of the package that are imported when they are asked for.
    """
    module = sys.modules[package]

    def get(name: str) -> Any:
        if name in homes:
            from artsim.common.extras import require_extra  # here, since every "import artsim" imports this module

            with require_extra(package):
                value = getattr(import_module(f"{package}.{homes[name]}"), name)
            setattr(module, name, value)  # from now on it is found at once
            return value
        if name in packages:
            return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name, obj=module)

    def names() -> list[str]:
        """Public names alone."""
        return sorted({*module.__all__, *packages})

    return get, names
