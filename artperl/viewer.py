"""An estimate to look at: a file for any browser with the cloud by part, boxes and axes."""

from __future__ import annotations

import html
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from artperl.core.estimate import Estimate
from artperl.core.listing import HEAD, cells, summary
from artperl.perception.preprocess import is_measured
from artsim.common.names import printable
from artsim.common.palette import PALETTE

_MOST = 6000
"""Points that are drawn."""
_CORNERS = np.array([[i & 1, i & 2, i & 4] for i in range(8)], dtype=bool) - 0.5


def page(estimate: Estimate, points: ArrayLike, title: str) -> str:
    """HTML with everything in it.

    Parameters
    ----------
    estimate : Estimate
    points : (N, 3) float
        The cloud that was estimated.
    title : str
    """
    points = np.asarray(points, dtype=np.float64)
    shown = np.flatnonzero(is_measured(points))
    shown = np.random.default_rng(0).permutation(shown)[:_MOST]
    T = estimate.trajectory
    center = np.einsum(
        "kji,kj->ki", estimate.T_camera_part[:, :3, :3], estimate.translation - estimate.T_camera_part[:, :3, 3]
    )
    corners = center[:, None] + _CORNERS * estimate.size[:, None]
    posed = np.einsum("skij,kcj->skci", T[..., :3, :3], corners) + T[:, :, None, :3, 3]
    reach = 0.5 * float(np.linalg.norm(estimate.size.max(axis=0)))
    ends = estimate.joint_origin[:, None] + estimate.joint_axis[:, None] * np.array([[-reach], [reach]])
    data = {
        "points": _short(points[shown]),
        "part": estimate.part[shown].tolist(),
        "boxes": _short(posed),
        "axes": _short(ends[1:]),
        "colours": [f"rgb({r},{g},{b})" for r, g, b in PALETTE.tolist()],
    }
    return _PAGE.format(
        title=_escape(title), summary=_escape(summary(estimate)), rows=_rows(estimate), data=json.dumps(data),
        warnings="\n".join(f"<p><b>Warning:</b> {_escape(text)}</p>" for text in estimate.warnings),
        head="".join(f"<th>{name}</th>" for name in HEAD), last=len(T) - 1,
    )  # fmt: skip


def _escape(text: str) -> str:
    """Text as a browser shows it, names out of files included."""
    return html.escape(printable(text, 1000))


def _rows(estimate: Estimate) -> str:
    rows = []
    for k, (part, *values) in enumerate(cells(estimate)):
        colour = "rgb({},{},{})".format(*PALETTE[k % len(PALETTE)])
        rows.append(
            f'<tr><td style="color:{colour}">■ {_escape(part)}</td>'
            + "".join(f"<td>{html.escape(c)}</td>" for c in values)
            + "</tr>"
        )
    return "\n".join(rows)


def _short(values: Any) -> Any:
    """Tenths of millimetres are enough for the eye."""
    return np.round(np.asarray(values, dtype=np.float64), 4).tolist()


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>
body {{ font: 14px/1.5 system-ui, sans-serif; margin: 1.5em auto; max-width: 62em; color: #222; }}
canvas {{ width: 100%; height: 34em; background: #f6f6f6; border-radius: 6px; cursor: grab; touch-action: none; }}
table {{ border-collapse: collapse; }} td, th {{ padding: .15em .9em .15em 0; text-align: left; }}
label {{ margin-right: 1.5em; }} h1 {{ font-size: 1.3em; }}
</style></head><body>
<h1>{title}</h1>
<p>{summary}</p>
{warnings}
<canvas id="view"></canvas>
<p><label>step <input id="step" type="range" min="0" max="{last}" value="{last}"> <span id="name"></span></label>
<label><input id="boxes" type="checkbox" checked> boxes</label>
<label><input id="axes" type="checkbox" checked> joint axes</label>
drag to turn, scroll to zoom, double-click for the camera's own view</p>
<table><tr>{head}</tr>
{rows}
</table>
<script>
const data = {data};
const canvas = document.getElementById("view"), pen = canvas.getContext("2d");
const control = name => document.getElementById(name);
const edges = [];
for (let i = 0; i < 8; i++) for (const bit of [1, 2, 4]) if (!(i & bit)) edges.push([i, i | bit]);
const n = data.points.length || 1;
const middle = [0, 1, 2].map(i => data.points.reduce((sum, p) => sum + p[i], 0) / n);
const radius = Math.max(1e-6, ...data.points.map(p => Math.hypot(...p.map((x, i) => x - middle[i]))));
let yaw = 0, pitch = 0, zoom = 1;
function project(p) {{
  const [x, y, z] = p.map((v, i) => (v - middle[i]) / radius);
  const a = Math.cos(yaw) * x + Math.sin(yaw) * z, b = -Math.sin(yaw) * x + Math.cos(yaw) * z;
  const c = Math.cos(pitch) * y - Math.sin(pitch) * b, d = Math.sin(pitch) * y + Math.cos(pitch) * b;
  const size = 0.42 * Math.min(canvas.width, canvas.height) * zoom * 4 / (4 + d);
  return [canvas.width / 2 + a * size, canvas.height / 2 + c * size, d];
}}
function line(p, q) {{ pen.beginPath(); pen.moveTo(p[0], p[1]); pen.lineTo(q[0], q[1]); pen.stroke(); }}
function draw() {{
  canvas.width = canvas.clientWidth * devicePixelRatio; canvas.height = canvas.clientHeight * devicePixelRatio;
  const step = +control("step").value;
  control("name").textContent = step == 0 ? "start" : step == {last} ? "refined" : "agent " + step;
  const dots = data.points.map((p, i) => [...project(p), data.part[i]]).sort((p, q) => q[2] - p[2]);
  const width = 1.6 * devicePixelRatio * Math.sqrt(zoom);
  for (const [x, y, , part] of dots) {{
    pen.fillStyle = part < 0 ? "#bbb" : data.colours[part % data.colours.length];
    pen.fillRect(x - width / 2, y - width / 2, width, width);
  }}
  pen.lineWidth = 1.6 * devicePixelRatio;
  if (control("boxes").checked) data.boxes[step].forEach((box, k) => {{
    pen.strokeStyle = data.colours[k % data.colours.length];
    const corners = box.map(project);
    for (const [i, j] of edges) line(corners[i], corners[j]);
  }});
  pen.strokeStyle = "#c00020";
  if (control("axes").checked && step == {last}) for (const [p, q] of data.axes) line(project(p), project(q));
}}
let held = null;
canvas.onpointerdown = e => {{ held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); }};
canvas.onpointerup = () => held = null;
canvas.onpointermove = e => {{
  if (!held) return;
  yaw += (e.clientX - held[0]) / 150; pitch += (e.clientY - held[1]) / 150; held = [e.clientX, e.clientY]; draw();
}};
canvas.onwheel = e => {{ zoom *= Math.exp(-e.deltaY / 800); e.preventDefault(); draw(); }};
canvas.ondblclick = () => {{ yaw = pitch = 0; zoom = 1; draw(); }};
for (const name of ["step", "boxes", "axes"]) control(name).oninput = draw;
onresize = draw; draw();
</script></body></html>
"""
