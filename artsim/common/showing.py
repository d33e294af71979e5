"""Things that can be looked at, by :meth:`Showable.show` or in a notebook by themselves, and written for simulators.

What does it stands in rooms above, whose modules register it.
"""

import html
from collections.abc import Sequence
from functools import singledispatch
from importlib import import_module
from pathlib import Path
from typing import Any

PAGE_MODULES: list[str] = []
"""Modules that register pages with ``page_of``. A package names its own when it is imported; each is imported when the
first page is asked for."""
EXPORT_MODULES: list[str] = []
"""Modules that register with ``export_of``, likewise."""
_HEIGHT = 480
"""Pixels of a page in a notebook."""


@singledispatch
def page_of(thing: Any, **more: Any) -> str:
    """HTML of the page of a thing. Modules of ``PAGE_MODULES`` register a function for each type.

    Parameters
    ----------
    thing : object
    **more
        What else the page shows: ``points`` (N, 3) of an estimate.

    Raises
    ------
    TypeError
        When the type has no page.
    """
    raise TypeError(f"{type(thing).__name__} has no page")


@singledispatch
def export_of(thing: Any, folder: str | Path, formats: Sequence[str]) -> dict[str, Any]:
    """Write a thing for simulators into a folder. Modules of ``EXPORT_MODULES`` register a function for each type.

    Raises
    ------
    TypeError
        When the type is not written.
    """
    for module in EXPORT_MODULES:
        import_module(module)
    written = export_of.dispatch(type(thing))
    if written is export_of.dispatch(object):
        raise TypeError(f"{type(thing).__name__} is not written for simulators")
    return written(thing, folder, formats)


class Showable:
    """Mixin of what has a page to look at."""

    def _page(self, **more: Any) -> str:
        """HTML of the page."""
        for module in PAGE_MODULES:
            if page_of.dispatch(type(self)) is page_of.dispatch(object):
                import_module(module)
        return page_of(self, **more)

    def show(self, out: str | Path | None = None, **more: Any) -> Path:
        """Write a page that works without a network, and open it in the browser unless a file is named.

        Parameters
        ----------
        out : path, optional
            HTML file to write; by default a temporary one.
        **more
            What else the page shows: ``points`` (N, 3) of an estimate.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ArtsimError
            When it cannot be written.
        """
        import tempfile  # here, since every "import artsim" imports this module
        import webbrowser

        from artsim.common.messages import note
        from artsim.common.outputs import write_output

        page = self._page(**more).encode()
        if out is not None:
            write_output(Path(out), page)
            return Path(out)
        with tempfile.NamedTemporaryFile(prefix="artsim-", suffix=".html", delete=False) as file:
            file.write(page)
        if not webbrowser.open(Path(file.name).as_uri()):
            note(f"no browser is found: open {file.name}")
        return Path(file.name)

    def _repr_html_(self) -> str:
        """The page in a frame, for notebooks."""
        source = html.escape(self._page(), quote=True)
        return f'<iframe srcdoc="{source}" width="100%" height="{_HEIGHT}" style="border:none"></iframe>'
