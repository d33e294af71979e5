"""The verbs ``artsim view`` and ``artsim gallery``: pictures."""

import logging
from dataclasses import dataclass
from pathlib import Path

import tyro

from artsim.commands.having import Having, categories_named
from artsim.errors import ConfigError
from artsim.families.constraints import Constraints
from artsim.loading.roots import Opened

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class View(Opened):
    """Draw samples of a dataset, or an object in several states.

    Writes a contact sheet (PNG: depth, part colours, boxes, joint axes). With --rerun, a recording for the rerun
    viewer comes with it. With --html, it writes a page for any browser instead: sliders for joints, boxes, clouds.
    With --serve, a page on this machine finds samples in a dataset of any size, and loads them as they are looked at.
    """

    path: tyro.conf.Positional[Path]
    """Dataset folder, or an object: URDF, MJCF, USD, GLB or joint file, or its folder."""
    out: Path | None = None
    """PNG to write; by default contact_sheet.png in the dataset folder, or <object>.png here."""
    samples: int = 12
    """How many samples (or states of the object) to draw."""
    split: str | None = None
    """Draw from this split only."""
    rerun: Path | None = None
    """Also write a rerun recording (.rrd) to this file."""
    html: Path | None = None
    """Page to write, such as laptop.html; it needs no network and no other file."""
    serve: bool = False
    """Show all samples of a dataset at an address of this machine until Ctrl-C."""
    port: int = 0
    """Port of --serve; 0 takes a free one."""

    def run(self) -> None:
        if not self.path.exists():
            raise ConfigError(
                "there is no dataset and no object", self.path,
                "name the folder of a dataset (artsim generate makes one), or an object's file or folder",
            )  # fmt: skip
        for path, kind in ((self.out, ".png"), (self.html, ".html"), (self.rerun, ".rrd")):
            if path is not None and path.suffix.lower() != kind:
                raise ConfigError(f"it is no {kind} file", path, f"name it {path.stem or 'page'}{kind}")
        if self.serve:
            from artsim.drawing.serve import serve

            serve(self.path, self.split, self.port)
            return
        from artsim.drawing.contact_sheet import write_contact_sheet
        from artsim.drawing.page import write_page

        if self.html is not None:
            write_page(self.path, self.html, self.samples, self.split, self.package_root, self.body)
            log.info(f"wrote {self.html}")
            if self.out is None and self.rerun is None:
                return
        for written in write_contact_sheet(
            self.path, self.out, self.samples, self.split, self.rerun, self.package_root, self.body
        ):
            log.info(f"wrote {written}")


@dataclass(frozen=True)
class Gallery:
    """Draw procedural objects, each at rest and opened further and further, as one picture."""

    categories: tuple[str, ...] = ("all",)
    """Categories, such as faucet; 'all' for every one."""
    objects: int = 1
    """Objects of each category."""
    first_object: int = 0
    """Seed of the first object of each."""
    having: Having = ()
    states: int = 3
    """Pictures of each object."""
    out: Path = Path("gallery.png")
    """PNG to write."""

    def run(self) -> None:
        from artsim.common.outputs import write_output
        from artsim.drawing.gallery import draw_gallery
        from artsim.loading.sources import family_sources

        sources = family_sources(
            categories_named(self.categories), self.objects, self.first_object, Constraints.parse(self.having)
        )
        write_output(self.out, draw_gallery([source.load() for source in sources], self.states))
        log.info(f"wrote {self.out}")
