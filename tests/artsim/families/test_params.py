"""Parameters of procedural objects: they make the same object again, can be asked for, changed, mixed and stored."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.errors import ConfigError
from artsim.export import export
from artsim.families import CATEGORIES, assembly_of, draws_of, make
from artsim.families.catalogue import describe_family
from artsim.making.draws import Draws
from artsim.model.params import Params


@pytest.mark.parametrize("category", CATEGORIES)
def test_parameters_make_the_object_again_and_what_lies_between_two(category: str) -> None:
    first, second = make(category, 3), make(category, 4)
    assert first.params is not None
    assert second.params is not None
    stored = Params.from_json(first.params.to_json())
    assert stored == first.params
    assert make(stored).sha256 == first.sha256
    middle = first.params.between(second.params, 0.5)
    for name, value in middle.values.items():
        ends = [params.values[name] for params in (first.params, second.params) if name in params.values]
        if isinstance(value, float):
            assert min(ends) <= value <= max(ends)  # type: ignore[type-var]
        elif isinstance(value, (str, bool)):
            assert value in ends
    assert len(make(middle)) >= 2


@pytest.mark.parametrize("category", CATEGORIES)
def test_a_parameter_that_is_asked_for_is_what_the_object_has(category: str) -> None:
    draws = draws_of(category, 1)
    artsim.families.FAMILIES[category](draws)
    numbers = [(n, d) for n, d in draws.drawn.items() if d.kind == "number" and n not in ("height", "width", "depth")]
    name, draw = next((n, d) for n, d in numbers if f"{n}_2" not in draws.drawn and not n[-1].isdigit())
    asked = draw.low + 0.375 * (draw.high - draw.low)
    exact, near = make(category, 1, **{name: asked}), make(category, 1, **{name: (asked, draw.high)})
    assert exact.params is not None
    assert near.params is not None
    assert exact.params[name] == pytest.approx(asked)
    assert asked <= float(near.params[name]) <= draw.high


def test_all_else_stays_where_one_parameter_changes() -> None:
    obj = make("drawer", 0)
    assert obj.params is not None
    longer = make(obj.params.having(handle_length=0.5))
    assert longer.params is not None
    changed = {name for name, value in longer.params.values.items() if obj.params.values.get(name) != value}
    assert changed == {"handle_length"}
    assert set(longer.params.values) == set(obj.params.values)
    assert longer.sha256 != obj.sha256
    again = make("drawer", 0, handle_length=0.5)
    assert again.params is not None
    assert again.params.values == longer.params.values


def test_options_and_answers_are_met() -> None:
    for handle in ("bar", "bow"):
        asked = make("microwave", 2, handle=handle, turntable=True)
        assert asked.params is not None
        assert asked.params["handle"] == handle
        assert "turntable" in [part.label for part in asked.parts]
    some = make("microwave", 2, handle={"bar", "none"}).params
    assert some is not None
    assert some["handle"] in ("bar", "none")


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"door_thicknes": 0.02}, "did you mean door_thickness"),
        ({"door_thickness": 5.0}, "door_thickness is 0.008 to 0.045 m"),
        ({"handle": "bra"}, "handle is bar, bow, flat or none"),
    ],
)
def test_refusals_tell_what_there_is(
    asked: dict[str, float | str], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(artsim.families, "DRAWS", 5)
    with pytest.raises(ConfigError, match=words):
        make("microwave", 0, **asked)


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", '{"category": "laptop", "seed": 1, "draw": 0, "values": {"width": NaN}}', '{"values": 1}']
)
def test_other_texts_are_no_parameters(text: str) -> None:
    with pytest.raises(ConfigError, match="to_json"):
        Params.from_json(text)


def test_parameters_of_what_is_not_there_are_refused() -> None:
    for params in (Params("lapdog", 0), Params("laptop", -1), Params("laptop", 0, -1)):
        with pytest.raises(ConfigError):
            make(params)


def test_a_procedural_object_is_loaded_by_its_name_or_parameters(tmp_path: Path) -> None:
    obj = make("laptop", 3, width=0.3)
    export(obj, tmp_path / "one")
    assert artsim.load(tmp_path / "one" / "params.json").sha256 == obj.sha256
    assert artsim.load("laptop:3").sha256 == make("laptop", 3).sha256


@pytest.mark.parametrize("category", ["storage_furniture", "laptop", "bottle"])
def test_descriptions_fit_a_screen_and_tell_numbered_parameters_once(category: str) -> None:
    lines = describe_family(category, 5).splitlines()
    assert all(len(line) <= 120 for line in lines)
    assert not any(line.split()[0][-2:] in ("_2", "_3") for line in lines if line.startswith("  "))


def test_plans_say_how_many_parts_there_will_be() -> None:
    assert len(assembly_of("drawer", 0)) == len(make("drawer", 0))


def test_what_is_drawn_in_one_call_is_what_single_draws_give() -> None:
    one, each = Draws(np.random.default_rng(5)), Draws(np.random.default_rng(5))
    lengths = one.lengths(width=(0.4, 0.6), depth=(0.1, 0.2), of=2.0)
    assert lengths == (each.length("width", (0.4, 0.6), of=2.0), each.length("depth", (0.1, 0.2), of=2.0))
    assert 0.8 <= lengths[0] <= 1.2
    side = one.one_of("side", {"left": -1.0, "right": 1.0}, (0.2, 0.8))
    assert side == {"left": -1.0, "right": 1.0}[each.pick("side", {"left": 0.2, "right": 0.8})]
    turn = one.turn("angle", (60.0, 110.0))
    assert turn == pytest.approx(each.degrees("angle", (60.0, 110.0)) * math.pi / 180.0)
    assert one.drawn == each.drawn  # degrees are what is listed and asked for
    assert one.drawn["angle"].unit == "deg"


def test_a_name_that_is_asked_for_stands_for_what_it_says() -> None:
    for name, side in (("left", -1.0), ("right", 1.0)):
        for seed in range(20):
            draws = Draws(np.random.default_rng(seed), {"side": name})
            assert draws.one_of("side", {"left": -1.0, "right": 1.0}, (0.5, 0.5)) == side
