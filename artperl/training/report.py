"""What a training run reports: curves as it goes, and in the end a page with its table and overlays of estimates."""

import base64
import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from torch.utils.tensorboard import SummaryWriter

from artperl.evaluation.pictures import curves, overlays
from artperl.evaluation.scoring import Scored
from artperl.methods.protocol import Method
from artsim.common.files import write_atomic, write_error
from artsim.observing.sample import Sample

_SHOWN = 8


def write_report(out: Path, estimator: Method, samples: Sequence[Sample], scored: Sequence[Scored], table: str) -> None:
    """Write ``curves.png``, ``overlays.png``, ``worst.png`` and ``report.html`` into the folder of a run.

    Parameters
    ----------
    out : Path
    estimator : Method
    samples : sequence of Sample
        That the estimator was tested on.
    scored : sequence of Scored
        Its errors there.
    table : str
    """
    spread = np.linspace(0, len(samples) - 1, min(_SHOWN, len(samples))).round().astype(int)
    error = [float((one.rotation / 10.0).max() + (one.translation / 0.05).max()) for one in scored]
    worst = np.argsort(error)[::-1][:_SHOWN]
    pictures = {
        "curves": ("How it learnt", curves(out / "events")),
        "overlays": ("Unseen objects", overlays(estimator, [samples[i] for i in spread])),
        "worst": ("The worst of them", overlays(estimator, [samples[i] for i in worst])),
    }
    for name, (_, png) in pictures.items():
        write_atomic(out / f"{name}.png", png)
    figures = "\n".join(
        f'<h2>{title}</h2><img alt="{title}" src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        for title, png in pictures.values()
    )
    page = _PAGE.format(name=html.escape(out.name), table=html.escape(table), figures=figures)
    write_atomic(out / "report.html", page.encode())


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Training of {name}</title>
<style>body {{ font: 14px/1.5 system-ui, sans-serif; margin: 1.5em auto; max-width: 90em; padding: 0 1em; }}
img {{ max-width: 100%; }} pre {{ overflow-x: auto; }}</style></head><body>
<h1>Training of {name}</h1>
<h2>Errors on unseen objects</h2>
<pre>{table}</pre>
<p>A row for each part: errors of its rotation and of its position, in percent of the object's diagonal and in units of
PartNet, and the overlap (IoU) of its estimated box with the true one, where both are posed and in the rest frame. An
instance is a view of an object. It is right if every part is within 10 degrees and 5 % of the diagonal. The confidence
is the probability of that; AUROC is 1 where it tells all right estimates from wrong ones.</p>
<p>In the pictures, true boxes are grey and dashed, and estimated ones have the colour of their part.</p>
{figures}
</body></html>
"""


def rounded(figures: Any) -> Any:
    """Figures with as many digits as anybody reads."""
    if isinstance(figures, dict):
        return {name: rounded(value) for name, value in figures.items()}
    if isinstance(figures, list):
        return [rounded(value) for value in figures]
    return float(f"{figures:.4g}") if isinstance(figures, float) else figures


def write_scalars(board: SummaryWriter, group: str, figures: dict[str, float], step: int) -> None:
    """Write figures to a board of curves.

    Raises
    ------
    ConfigError
        When the disk is full.
    """
    try:
        for name, value in figures.items():
            board.add_scalar(f"{group}/{name}", value, step)
    except OSError as error:  # of the thread that writes: the disk may be full
        raise write_error(error, Path(board.log_dir)) from error


def scalars(figures: dict[str, Any]) -> dict[str, float]:
    """What a board shows of :func:`artperl.evaluation.tables.summary`: the medians of each part."""
    return {
        f"{category}/{k}/{name}": part[name]["median"]
        for category, figure in figures.items()
        for k, part in zip(figure["part_names"], figure["parts"], strict=True)
        for name in ("rotation_deg", "translation_percent_diagonal", "iou_exact")
    }
