"""Things that can be looked at: in a browser by :meth:`Showable.show`, in a notebook by themselves."""

from __future__ import annotations

import html
import tempfile
import webbrowser
from pathlib import Path
from typing import Any

from artsim.common.outputs import write_output

_HEIGHT = 480
"""Pixels of a page in a notebook."""


class Showable:
    """Mixin of what has a page to look at."""

    def _page(self, **more: Any) -> str:
        """HTML of the page."""
        raise NotImplementedError

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
        page = self._page(**more).encode()
        if out is not None:
            write_output(Path(out), page)
            return Path(out)
        with tempfile.NamedTemporaryFile(prefix="artsim-", suffix=".html", delete=False) as file:
            file.write(page)
        webbrowser.open(Path(file.name).as_uri())
        return Path(file.name)

    def _repr_html_(self) -> str:
        """The page in a frame, for notebooks."""
        source = html.escape(self._page(), quote=True)
        return f'<iframe srcdoc="{source}" width="100%" height="{_HEIGHT}" style="border:none"></iframe>'
