"""What mkdocs adds to docs/: pages of the repository outside it, public names, notebooks with their results.

mkdocs.yml names this file under ``hooks``. ``python scripts/site.py README.md`` prints a page as package
indices show it: without the repository, so with paths in place of links.
"""

from __future__ import annotations

import base64
import html
import logging
import posixpath
import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s#]*)(#[^)\s]*)?\)")
"""A picture or a link: mark, text, path, heading."""
OUTSIDE = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "artperl/weights/README.md": "weights.md",
    "results/README.md": "results/index.md",
    **{f"results/{path.name}": f"results/{path.name}" for path in sorted(ROOT.glob("results/[!R]*.md"))},
    **{f"examples/{path.parent.name}/README.md": f"examples/{path.parent.name}.md"
       for path in ROOT.glob("examples/*/README.md")},
}  # fmt: skip
"""Pages outside docs/ -> their place in the site."""
PACKAGES = re.findall(r"^## (art[\w.]+)\n(.*?)(?=^## |\Z)", (ROOT / "docs" / "api.md").read_text(), re.M | re.S)
"""Public packages and what docs/api.md lists of each."""
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
log = logging.getLogger("mkdocs.hooks.site")


def on_config(config: Any) -> Any:
    """The public packages and the notebooks stand in the navigation as they stand on disk."""
    more = {
        "Notebooks": [f"notebooks/{path.stem}.md" for path in NOTEBOOKS],
        "Reference": [f"reference/{name}.md" for name, _ in PACKAGES],
        "Results": [{"All tables": [place for place in OUTSIDE.values() if place.startswith("results/")]}],
    }
    for section in config.nav:
        for name, pages in section.items():
            pages += more.get(name, [])
    config.theme.static_templates.discard("404.html")  # its paths start at a server's root, its search in the network
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add pages that are not files of docs/."""
    from mkdocs.structure.files import File

    def add(place: str, content: str | bytes) -> None:
        files.append(File.generated(config, place, content=content))

    for source, place in OUTSIDE.items():
        add(place, (ROOT / source).read_text())
    for package, listed in PACKAGES:
        add(f"reference/{package}.md", "\n\n".join([f"# {package}", *directives(package, listed)]))
    for path in NOTEBOOKS:
        files.remove(files.get_file_from_path(f"notebooks/{path.name}"))
        for place, content in executed(path):
            add(place, content)
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links of the repository lead to their pages in the site."""
    place = page.file.src_uri
    if place.startswith(("reference/", "notebooks/")):
        return markdown
    source = {site: own for own, site in OUTSIDE.items()}.get(place, f"docs/{place}")

    def link(mark: str, words: str, own: str, heading: str) -> str:
        name = next((name for name in (own, f"{own}/README.md") if name in OUTSIDE), own)
        if name not in OUTSIDE and not name.startswith("docs/"):
            return words
        target = OUTSIDE.get(name) or name.removeprefix("docs/").replace(".ipynb", ".md")
        return f"{mark}[{words}]({posixpath.relpath(target, posixpath.dirname(place) or '.')}{heading})"

    # Python-Markdown, unlike the repository's reader, takes a list below a text for a part of it.
    text = re.sub(r"^((?![-*] |\d+\. |\s|$).*\n)(?=(?:[-*]|\d+\.) )", r"\1\n", markdown, flags=re.M)
    return relinked(text, source, link)


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Search works on pages that are opened as files, by a script of the site in place of one from the network."""
    place = posixpath.relpath("worker.js", posixpath.dirname(page.file.dest_uri) or ".")
    return re.sub(r'<script src="https://unpkg\.com/iframe-worker[^"]*">', f'<script src="{place}">', output)


def relinked(text: str, source: str, link: Callable[[str, str, str, str], str]) -> str:
    """A page with other links to files.

    Parameters
    ----------
    text : str
        Markdown.
    source : str
        Its path in the repository.
    link : function
        Mark of a picture or nothing, text, path in the repository, heading with its # -> what replaces the link.
    """

    def replaced(found: re.Match[str]) -> str:
        mark, words, path, heading = found.groups(default="")
        if not path or re.match(r"\w+:", path):
            return found[0]
        own = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
        if not (ROOT / own).exists():
            log.warning("%s: %s does not exist", source, path)
        return link(mark, words, own, heading)

    blocks = re.split(r"(^```.*?^```$)", text, flags=re.M | re.S)  # code is left alone
    return "".join(block if block.startswith("```") else LINK.sub(replaced, block) for block in blocks)


def alone(mark: str, words: str, own: str, _: str) -> str:
    """A link on a page that is read without the repository: text and path. Pictures are left out."""
    return "" if mark else f"{words} (`{own}`)"


def directives(package: str, listed: str) -> Iterator[str]:
    """A line of mkdocstrings for each name of a package that docs/api.md lists."""
    module, elsewhere = import_module(package), {name for name, _ in PACKAGES if name != package}
    homes = getattr(module, "_HOMES", {})
    for name in dict.fromkeys(re.findall(rf"`{re.escape(package)}\.(\w+)`", listed)):
        thing = getattr(module, name)
        if name != "__version__" and not isinstance(thing, type(sys)):
            home = getattr(thing, "__module__", None) or f"{package}.{homes.get(name, '')}".rstrip(".")
            if home not in elsewhere:
                yield f"::: {home}.{name}"


def executed(path: Path) -> Iterator[tuple[str, str | bytes]]:
    """Pages and pictures of a notebook that is run here: places in the site with their content."""
    import nbformat
    from nbclient import NotebookClient
    from traitlets.config import Config

    log.info("running %s", path.name)
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        # Sockets of this machine, not ports, which others can open.
        options = Config(KernelManager={"transport": "ipc", "ip": f"{folder}/.kernel"})
        NotebookClient(notebook, config=options, resources={"metadata": {"path": folder}}).execute()
    parts, number = [], 0
    for cell in notebook.cells:
        parts.append(f"```python\n{cell.source}\n```" if cell.cell_type == "code" else cell.source)
        for output in cell.get("outputs", ()):
            data, name = output.get("data", {}), f"{path.stem}-{number}"
            if "image/png" in data:
                yield f"notebooks/{name}.png", base64.b64decode(data["image/png"])
                parts.append(f"![Output]({name}.png)")
                number += 1
            elif page := re.search(r'srcdoc="([^"]*)"', data.get("text/html", "")):
                yield f"notebooks/{name}.html", html.unescape(page[1])
                parts.append(f'<iframe src="{name}.html" width="100%" height="480" title="Output"></iframe>')
                number += 1
            elif output.get("name") != "stderr" and (text := output.get("text") or data.get("text/plain")):
                parts.append(f"```text\n{text.rstrip()}\n```")
    yield f"notebooks/{path.stem}.md", "\n\n".join(parts)


if __name__ == "__main__":
    name = sys.argv[1]
    print(relinked((ROOT / name).read_text(), name, alone), end="")
