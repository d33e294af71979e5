"""Drawing scenes: which objects, where they stand, how they look, from where they are seen. Same seed, same scene."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import tyro

from artsim.common.elementary import cos, sin, tan
from artsim.common.products import norm
from artsim.common.sequences import wrap_singles
from artsim.errors import ConfigError
from artsim.families import FAMILIES, make
from artsim.loading.roots import PackageRoots
from artsim.model.appearance import Colour, Lights, Sun
from artsim.model.appearance.finishes import draw_coats, repaint_coats
from artsim.model.camera import Camera
from artsim.model.draws import StateOptions, joint_intervals, posed_bounds, sample_state
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import transform_points
from artsim.renderers.scene import Scene, Thing
from artsim.scenes.placement import Area, Arrangement
from artsim.scenes.props import TABLE_HEIGHT, distractor, room, table
from artsim.scenes.settling import Placeable, settle

if TYPE_CHECKING:
    from artsim.loading.sources import Source

_TABLE_DIAGONAL = 0.6
"""Metres: objects with a larger one stand on the floor."""
_DRAWS = 12  # of a procedural object until one is small enough for a table
_CROWD = 2.5  # of the sum of footprints: the area that things are spread over
_CLOSER = 0.6  # of that area in a crowded scene
_ATTEMPTS = 4  # arrangements that are begun before a scene is given up
_STATES = 200  # that are drawn for a bolted object: of those of an arm, one in ten to one in two stays above its base
_SWEPT = 7  # states over the range of a joint, for which a row leaves room
_ROW_GAP = 0.05  # metres between these spaces
_KIN = {"knife": "folding_knife", "table": "drawer"}
"""Families whose sizes the real objects of other categories have."""


@dataclass(frozen=True)
class SceneCameraOptions:
    """From where, and with which cameras, scenes are seen; each drawn from its range."""

    width: int = 1280
    height: int = 720
    fov: tuple[float, float] = (38.0, 50.0)
    """Vertical field of view, degrees."""
    aspect: tuple[float, float] = (1.0, 1.0)
    """Height of a pixel over its width."""
    off_center: float = 0.01
    """The principal point lies within this share of the image's size around its middle."""
    azimuth: tuple[float, float] = (-35.0, 35.0)
    """Degrees about the vertical, 0 = from where objects have their front."""
    elevation: tuple[float, float] = (24.0, 42.0)
    """Degrees above the horizon."""
    fill: tuple[float, float] = (0.78, 0.92)
    """The objects reach over this share of the image."""

    def __post_init__(self) -> None:
        for name in ("fov", "aspect", "azimuth", "elevation", "fill"):
            low, high = getattr(self, name)
            if not low <= high:
                raise ConfigError(f"{low} to {high} is not a range", name, "write LOW HIGH")
        if not (0 < self.width <= 8192 and 0 < self.height <= 8192):
            raise ConfigError(f"images of {self.width}x{self.height} are not made", "width, height", "use 1 to 8192")
        if not (self.fov[0] >= 1.0 and self.fov[1] <= 150.0):
            raise ConfigError(f"fields of view of {self.fov} deg are not within 1..150", "fov", "write 38 50")
        if not (self.fill[0] > 0.0 and self.fill[1] <= 1.0 and self.aspect[0] > 0.0):
            raise ConfigError("fill and aspect are shares above 0, fill up to 1", "fill, aspect", "write 0.78 0.92")
        if not 0.0 <= self.off_center <= 0.3:
            raise ConfigError(f"{self.off_center} is not within 0..0.3", "off_center", "write 0.01")


@dataclass(frozen=True)
class SceneOptions:
    """What a scene holds."""

    categories: tuple[str, ...] = ("laptop", "stapler", "scissors", "box", "eyeglasses")
    """Procedural categories, such as laptop: one new object for each time that a category is named."""
    objects: tuple[Path, ...] = ()
    """URDF files, object folders, or folders of them: every object is put into the scene, in a size that is usual for
    its category."""
    package_root: PackageRoots = field(default_factory=dict)
    """Folders that package:// names of these files stand for, where they are not found as they are; repeatable."""
    place: Literal["auto", "table", "floor", "row"] = "auto"
    """table or floor; auto: on the floor if any object is too large for a table. row: upright on the floor, side by
    side as in a kitchen, with room for every joint's whole range."""
    distractors: int = 3
    """Everyday things besides: books, cans, mugs, fruit."""
    count: tuple[int, int] | None = None
    """Draw so many objects for each scene, LOW to HIGH, from the categories and files that are named. By default all of
    them are in every scene, once each."""
    diagonal: tuple[float, float] | None = None
    """Metres, LOW HIGH: each object is made as large as is drawn from this range, measured at rest from corner to
    corner of its box. By default sizes are usual ones."""
    crowded: bool = False
    """Things stand close together, and before one another: more of each is hidden."""
    settle: bool = False
    """Things fall onto the support and onto each other, in any attitude, and come to rest by physics (MuJoCo): they
    lean on each other and lie in each other. Joints are held. By default each stands or lies on its own."""
    bolted: bool = False
    """Objects are bolted down by their base, as robot arms are: they stand upright in any state. A state in which a
    part would reach below the base is drawn again."""
    states: StateOptions = field(default_factory=lambda: StateOptions(fraction_open=(0.3, 0.7)))
    obj: Annotated[tuple[ArticulatedObject, ...], tyro.conf.Suppress] = ()
    """Objects as they are, besides."""

    def __post_init__(self) -> None:
        wrap_singles(self)
        if self.distractors < 0:
            raise ConfigError(f"{self.distractors} is not a count", "distractors", "use 0 or more")
        if self.count is not None and not 1 <= self.count[0] <= self.count[1]:
            raise ConfigError(f"{self.count} is no range of counts", "count", "write LOW HIGH, such as 3 6")
        if self.diagonal is not None and not 0 < self.diagonal[0] <= self.diagonal[1] < np.inf:
            raise ConfigError(f"{self.diagonal} is no range of metres", "diagonal", "write LOW HIGH, such as 0.18 0.38")
        if self.bolted and self.settle:
            raise ConfigError("what is bolted down does not fall", "bolted, settle", "leave one of them out")
        if self.place not in ("auto", "table", "floor", "row"):
            raise ConfigError(f"there is no place {self.place!r}", "place", "use auto, table, floor or row")
        if self.place == "row" and self.settle:
            raise ConfigError("what stands in a row does not fall", "place, settle", "leave one of them out")
        if not (self.categories or self.objects or self.obj):
            raise ConfigError("a scene needs an object", "categories", "name one, such as laptop")


def make_scene(options: SceneOptions, seed: int) -> Scene:
    """A new scene.

    Parameters
    ----------
    options : SceneOptions
    seed : int
        Not negative. Objects, places, looks and light each have a stream of chance of their own.

    Returns
    -------
    Scene
        The support's surface is at z = 0, and the objects' middle about above the origin.

    Raises
    ------
    ConfigError
        When a category is unknown, or the objects do not fit on their support.
    AssetError
        When an object does not load.
    """
    from artsim.loading.painted import painted_coats  # with it, the readers of meshes come

    if seed < 0:
        raise ConfigError(f"seed {seed} is negative", "seed", "use 0 or more")
    objects = _objects(options, seed)
    rng = np.random.default_rng([seed, 1])
    states = [(_state_above_base if options.bolted else sample_state)(obj, options.states, rng) for obj in objects]
    looks = np.random.default_rng([seed, 2])
    coats = [painted_coats(obj) or draw_coats(obj, looks) for obj in objects]
    others = [distractor(rng) for _ in range(options.distractors)]
    on_table = options.place == "table" or (
        options.place == "auto" and all(obj.diagonal <= _TABLE_DIAGONAL for obj in objects)
    )
    solids = [*zip(objects, states, coats, strict=True), *((obj, np.zeros(1), coat) for obj, coat in others)]
    things: list[Thing] | None
    for attempt in range(_ATTEMPTS):
        area = _area(solids, on_table, attempt, options.crowded)
        if options.place == "row":
            things, area = stand_in_row(solids)
            break
        bolted = len(objects) if options.bolted else 0
        things = settle(solids, area, rng) if options.settle else _arrange(solids, area, rng, options.crowded, bolted)
        if things is not None:
            break
    else:
        where = "table" if on_table else "floor"
        if options.settle:
            raise ConfigError(
                f"of {len(solids)} things some fall off the {where}, or do not come to rest", "settle",
                "use fewer or smaller ones, another seed, or the floor",
            )  # fmt: skip
        raise ConfigError(
            f"{len(solids)} things do not fit on a {where} of {area.high[0] - area.low[0]:.2f} x "
            f"{area.high[1] - area.low[1]:.2f} m", "scene", "use fewer or smaller ones, fewer distractors, or the floor"
        )  # fmt: skip
    supports = _supports(area, on_table, looks)
    lights = draw_lights(supports, looks)
    return Scene(tuple(things[: len(objects)]), tuple(things[len(objects) :]), tuple(supports), lights)


def with_appearance(scene: Scene, seed: int) -> Scene:
    """The same scene with other materials, textures and light: domain randomisation.

    Objects whose coats came from files get drawn ones, too.
    """
    rng = np.random.default_rng([seed, 2])

    def repaint(thing: Thing, articulated: bool) -> Thing:
        coats = draw_coats(thing.obj, rng) if articulated else repaint_coats(thing.coats, rng)
        return replace(thing, coats=coats)

    return Scene(
        tuple(repaint(thing, True) for thing in scene.instances),
        tuple(repaint(thing, False) for thing in scene.distractors),
        tuple(repaint(thing, False) for thing in scene.supports),
        draw_lights(scene.supports, rng),
    )


def _objects(options: SceneOptions, seed: int) -> list[ArticulatedObject]:
    """The objects of a scene, files in a usual size."""
    from artsim.loading.sources import find_sources

    rng = np.random.default_rng([seed, 0])
    categories: Sequence[str] = options.categories
    sources: Sequence[Source] = find_sources(options.objects, options.package_root) if options.objects else ()
    own: Sequence[ArticulatedObject] = options.obj
    if options.count is not None:
        choice = np.random.default_rng([seed, 5])
        number = int(choice.integers(options.count[0], options.count[1] + 1))
        # Kinds come as often as they are named, files each once; with replacement, as on real tables.
        drawn = choice.integers(len(categories) + len(sources) + len(own), size=number).tolist()
        places = np.cumsum([0, len(categories), len(sources), len(own)]).tolist()
        categories, sources, own = (
            [kind[i - low] for i in sorted(drawn) if low <= i < low + len(kind)]
            for kind, low in zip((categories, sources, own), places, strict=False)
        )
    small = options.place not in ("floor", "row") and options.diagonal is None
    made = [_draw_object(category, small, rng) for category in categories]
    loaded = [_in_usual_size(source.load(), int(rng.integers(2**31))) for source in sources]
    objects = [*made, *loaded, *own]
    if options.diagonal is not None:
        sizes = np.random.default_rng([seed, 6])
        objects = [obj.with_diagonal(float(sizes.uniform(*options.diagonal))) for obj in objects]
    return objects


def _draw_object(category: str, small: bool, rng: np.random.Generator) -> ArticulatedObject:
    """A procedural object: one that fits a table, if that is wanted, and the category has such."""
    seeds = rng.integers(2**31, size=_DRAWS).tolist()
    first = obj = make(category, seeds[0])
    for seed in seeds[1:]:
        if not small or obj.diagonal <= _TABLE_DIAGONAL:
            return obj
        obj = make(category, seed)
    return first


def _in_usual_size(obj: ArticulatedObject, seed: int) -> ArticulatedObject:
    """A loaded object as large as a procedural one of its category; as it is where there is no such family."""
    family = _KIN.get(obj.category, obj.category)
    return obj.with_diagonal(make(family, seed).diagonal) if family in FAMILIES else obj


def _area(solids: list[Placeable], on_table: bool, attempt: int, crowded: bool = False) -> Area:
    """Room for some things, more of it with each attempt; a table has its limits."""
    sizes = np.array([np.sort(obj.bounds[1] - obj.bounds[0])[1:] for obj, _, _ in solids])
    crowd = _CROWD if on_table else 2.0 * _CROWD  # so that what is small need not stand behind furniture
    crowd *= _CLOSER if crowded else 1.0
    total = crowd * (1.0 + 0.3 * attempt) * float((sizes + 0.06).prod(axis=1).sum())
    longest = float(norm(sizes).max()) + 0.1
    width = max(np.sqrt(1.6 * total), longest)
    depth = max(total / width, 0.8 * longest)
    if on_table and crowded:
        width, depth = min(width, 1.8), min(depth, 0.95)
    elif on_table:
        width, depth = min(max(width, 0.9), 1.8), min(max(depth, 0.55), 0.95)
    return Area((-0.5 * depth, -0.5 * width), (0.5 * depth, 0.5 * width))


def _state_above_base(obj: ArticulatedObject, options: StateOptions, rng: np.random.Generator) -> Array:
    """Joint states in which no part reaches below the lowest point of the root.

    Raises
    ------
    ConfigError
        When none is found.
    """
    for _ in range(_STATES):
        thing = Thing(obj, sample_state(obj, options, rng), np.eye(4), ())
        low = thing.part_boxes[:, 0, 2]
        if low[1:].min(initial=np.inf) >= low[0]:
            return thing.q
    raise ConfigError(
        f"in each of {_STATES} states of {obj.category} {obj.object_id} a part reaches below the base", "bolted",
        "do without it, or give states in which none does",
    )  # fmt: skip


def _arrange(
    solids: list[Placeable], area: Area, rng: np.random.Generator, crowded: bool = False, bolted: int = 0
) -> list[Thing] | None:
    """All things put down, the largest first, and the first so many upright; None where they do not fit."""
    arrangement = Arrangement(area, crowded=crowded)
    placed: dict[int, Thing] = {}
    for number in sorted(range(len(solids)), key=lambda n: -solids[n][0].diagonal):
        thing = arrangement.put(*solids[number], rng, upright=number < bolted)
        if thing is None:
            return None
        placed[number] = thing
    return [placed[number] for number in range(len(solids))]


def stand_in_row(solids: Sequence[Placeable]) -> tuple[list[Thing], Area]:
    """Things upright side by side along Y, their backs at x = 0, with room between them for every joint's range."""
    things, y = list[Thing](), 0.0
    for obj, q, coats in solids:
        intervals = joint_intervals(obj)
        states = [obj.tree.rest, q, *intervals.T]
        for k in obj.tree.free_joints:
            for value in np.linspace(intervals[k, 0], intervals[k, 1], _SWEPT):
                states.append(np.where(np.arange(len(q)) == k, value, obj.tree.rest))
        low, high = posed_bounds(obj, obj.tree.complete_state(np.array(states)))
        T = np.eye(4)
        T[:3, 3] = -high[:, 0].max(), y - low[:, 1].min(), -obj.bounds[0, 2]
        y += high[:, 1].max() - low[:, 1].min() + _ROW_GAP
        things.append(Thing(obj, q, T, coats))
    shift = 0.5 * (y - _ROW_GAP)
    for thing in things:
        thing.T_world_object[1, 3] -= shift
    front = min(float(thing.vertices[:, 0].min()) for thing in things)
    return things, Area((front - _ROW_GAP, -shift), (_ROW_GAP, shift))


def _supports(area: Area, on_table: bool, rng: np.random.Generator) -> list[Thing]:
    """Table or floor, and the room around."""
    low, high = np.asarray(area.low), np.asarray(area.high)
    if not on_table:
        back = rng.uniform(0.15, 0.6)
        return room((low[0] - 4.0, low[1] - 1.9), (high[0] + back, high[1] + 1.9), 0.0, rng)
    margin = 0.04
    size = high - low + 2 * margin
    back = rng.uniform(0.02, 0.5)
    around = room((low[0] - 3.0, low[1] - 1.4), (high[0] + margin + back, high[1] + 1.4), -TABLE_HEIGHT, rng)
    return [*table(size, rng), *around]


def draw_lights(supports: Sequence[Thing], rng: np.random.Generator) -> Lights:
    """A sun or lamp at the side without a wall, and the light of the sky."""
    sides = [thing.T_world_object[1, 3] for thing in supports if thing.obj.category == "wall"]
    away = -np.sign(max(sides, key=abs, default=1.0))  # the side without a wall
    azimuth, elevation = np.deg2rad(rng.uniform(42.0, 78.0)), np.deg2rad(rng.uniform(36.0, 56.0))
    direction = (
        float(cos(azimuth) * cos(elevation)),
        float(-away * sin(azimuth) * cos(elevation)),
        float(-sin(elevation)),
    )
    warm = rng.uniform(-0.06, 0.1)
    sun = Sun(direction, _tint(rng.uniform(0.8, 1.1), warm), float(np.deg2rad(rng.uniform(2.0, 6.0))))
    return Lights(sun, _tint(rng.uniform(0.46, 0.6), -0.3 * warm), _tint(rng.uniform(0.08, 0.12), 0.0))


def _tint(strength: float, warm: float) -> Colour:
    return (strength * (1.0 + warm), strength, strength * (1.0 - warm))


def scene_camera(scene: Scene, options: SceneCameraOptions, seed: int, view: int = 0) -> Camera:
    """A camera from which all articulated objects fit the image.

    Parameters
    ----------
    scene : Scene
    options : SceneCameraOptions
    seed, view : int
        The same seed and view give the same camera.
    """
    rng = np.random.default_rng([seed, 3, view])
    azimuth, elevation = (np.deg2rad(rng.uniform(*bounds)) for bounds in (options.azimuth, options.elevation))
    focal = 0.5 * options.height / tan(0.5 * np.deg2rad(rng.uniform(*options.fov)))
    size = np.array([options.width, options.height])
    center = size * (0.5 + options.off_center * rng.uniform(-1.0, 1.0, 2))
    K = np.array([[focal / rng.uniform(*options.aspect), 0.0, center[0]], [0.0, focal, center[1]], [0.0, 0.0, 1.0]])
    fill = rng.uniform(*options.fill)
    points = np.concatenate([thing.vertices for thing in scene.instances])
    target = 0.5 * (points.min(axis=0) + points.max(axis=0))
    away = np.array([-cos(azimuth) * cos(elevation), -sin(azimuth) * cos(elevation), sin(elevation)])

    def seen_from(distance: float) -> Camera:
        look = Camera.look_at(target + distance * away, target)
        return Camera(K, options.width, options.height, look.T_world_camera)

    near, far = 0.1, 60.0
    for _ in range(40):  # the least distance from which everything lies within its share of the image
        middle = 0.5 * (near + far)
        camera = seen_from(middle)
        p = transform_points(camera.T_camera_world, points)
        inside = (p[:, 2] > 0.05).all() and (np.abs(camera.project(p) - 0.5 * size) <= 0.5 * fill * size).all()
        near, far = (near, middle) if inside else (middle, far)
    return seen_from(far)
