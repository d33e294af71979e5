"""A comparison says what was measured: means, honest intervals, and published figures in rows of their own."""

from __future__ import annotations

import numpy as np
import pytest

from artperl.evaluation.comparison import binned, figure, row_record, view_azimuth
from artperl.evaluation.comparison_page import markdown
from artperl.evaluation.published import ARTIMAGE_PUBLISHED, ROBOTARM_PUBLISHED
from artperl.evaluation.scoring import score
from artperl.methods.full import Estimator
from artsim.observing.sample import Sample


def test_an_interval_holds_the_mean_and_is_that_of_objects_not_of_views() -> None:
    rng = np.random.default_rng(0)
    objects = np.repeat(np.arange(20), 10)
    values = rng.normal(5.0, 2.0, 20)[objects] + rng.normal(0.0, 0.1, 200)  # views of an object are alike
    own = figure(values, objects)
    assert own["low"] < own["mean"] < own["high"]
    assert own["mean"] == pytest.approx(values.mean())
    alone = figure(values, np.arange(200))
    assert own["high"] - own["low"] > 2.0 * (alone["high"] - alone["low"])
    true_width = 2 * 1.96 * 2.0 / np.sqrt(20)
    assert own["high"] - own["low"] == pytest.approx(true_width, rel=0.4)


def test_every_value_is_in_one_range() -> None:
    at, values = np.array([0.0, 0.05, 0.1, 0.6, 1.0]), np.array([1.0, 3.0, 5.0, 7.0, 9.0])
    ranges = binned(at, values, (0.0, 0.1, 0.6, 1.0))
    assert [own["count"] for own in ranges] == [2, 1, 2]
    assert [own["mean"] for own in ranges] == [2.0, 5.0, 8.0]


def test_published_rows_have_a_figure_for_each_part_and_the_means_of_the_paper() -> None:
    for category, methods in ARTIMAGE_PUBLISHED.items():
        parts = len(methods["artperl"].rotation)
        for method, told in methods.items():
            for values in (told.rotation, told.translation, told.iou):
                assert len(values) in (0, parts), (category, method)
    means = {
        method: np.mean([x for own in ARTIMAGE_PUBLISHED.values() for x in own[method].rotation])
        for method in ("artperl", "omad", "ancsh", "sporeagent")
    }
    assert means == pytest.approx({"artperl": 4.07, "omad": 5.13, "ancsh": 6.67, "sporeagent": 20.85}, abs=0.015)
    assert {len(own.rotation) for own in ROBOTARM_PUBLISHED.values()} == {7}


@pytest.fixture(scope="module")
def record(estimator: Estimator, sample: Sample):  # type: ignore[no-untyped-def]
    return row_record([score(estimator, sample)] * 3, [sample] * 3)


def test_no_published_figure_shares_a_row_with_a_measured_one(record) -> None:  # type: ignore[no-untyped-def]
    text = markdown("artimage", {"laptop": {"full": record, "ancsh": record}}, ["a note"])
    assert "- a note" in text
    table = text.split("### rotation, deg")[1].split("###")[0].strip().splitlines()
    assert len(table[0].split("|")) == 3 + len(record["parts"])  # narrow enough for a page
    rows = {line.split("|")[1].strip(): [c.strip() for c in line[1:-1].split("|")] for line in table[2:]}
    for name, cells in rows.items():
        assert all(("[" in cell) != name.endswith(", published") for cell in cells[1:]), name
    assert rows["A-NCSH, published"][1] == "5.30"
    assert "SporeAgent" not in rows  # not measured here
    assert "| A-NCSH | - | " in text.split("### Confidence")[1]  # one view, three times: all are right, or none is
    assert rows["full"][1].startswith(f"{record['parts'][0]['rotation_deg']['mean']:.2f} [")


def test_a_view_of_the_front_is_at_no_angle_from_it(sample: Sample) -> None:
    assert 0.0 <= view_azimuth(sample) <= 76.0  # as ArtImage's views
