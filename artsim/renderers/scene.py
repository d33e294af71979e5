"""Scenes: several posed articulated objects among other things, and what a camera sees of them. Plain data."""

import weakref
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from artsim.common.products import matmul
from artsim.errors import ConfigError
from artsim.model.appearance import Coat, Lights
from artsim.model.frame import BACKGROUND
from artsim.model.joints import Joint
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject, Mesh, Part, content_sha256
from artsim.model.transforms import transform_points

MAX_THINGS = 254
"""Instance ids are stored in a byte; 255 marks places where nothing stands."""


@dataclass(frozen=True, eq=False)
class Thing:
    """An object that stands in a scene."""

    obj: ArticulatedObject
    q: Array
    """(K,) float. Joint states, radians or metres."""
    T_world_object: Array
    """(4, 4) float. Pose of the rest frame in the world."""
    coats: tuple[Coat, ...]
    """How each part looks."""

    @cached_property
    def T_world_part(self) -> Array:
        """(K, 4, 4) pose of the rest frame, as carried by each part, in the world."""
        return matmul(self.T_world_object, self.obj.tree.forward_kinematics(self.q))

    @cached_property
    def part_vertices(self) -> tuple[Array, ...]:
        """(V, 3) vertices of each part as posed, world frame."""
        return tuple(
            transform_points(T, used_vertices(part) * self.obj.scale)
            for T, part in zip(self.T_world_part, self.obj.parts, strict=True)
        )

    @cached_property
    def vertices(self) -> Array:
        """(V, 3) vertices of all parts as posed, world frame."""
        return np.concatenate(self.part_vertices)

    @cached_property
    def part_boxes(self) -> Array:
        """(K, 2, 3) axis-aligned boxes around the posed parts, world frame; inside out for parts without geometry."""
        nothing = np.array([[np.inf] * 3, [-np.inf] * 3])
        return np.stack([np.stack([v.min(0), v.max(0)]) if len(v) else nothing for v in self.part_vertices])


@dataclass(frozen=True, eq=False)
class Scene:
    """Things in a world whose Z axis points up."""

    instances: tuple[Thing, ...]
    """Articulated objects: those with ground truth."""
    distractors: tuple[Thing, ...]
    """Rigid things of no interest."""
    supports: tuple[Thing, ...]
    """What the others stand on and before: table, floor, walls."""
    lights: Lights

    def __post_init__(self) -> None:
        if len(self.things) > MAX_THINGS:
            raise ConfigError(f"{len(self.things)} things; instance ids fit {MAX_THINGS}", "scene", "use fewer")

    @cached_property
    def things(self) -> tuple[Thing, ...]:
        """Everything there is: the place in this list is the instance id."""
        return (*self.instances, *self.distractors, *self.supports)

    @cached_property
    def solids(self) -> list[tuple[Part, Coat, float]]:
        """Every part of every thing in order, with its looks and its scale."""
        return [
            (part, coat, thing.obj.scale)
            for thing in self.things
            for part, coat in zip(thing.obj.parts, thing.coats, strict=True)
        ]

    @cached_property
    def T_world_solid(self) -> Array:
        """(S, 4, 4) pose of the rest frame, as carried by each solid, in the world."""
        return np.concatenate([thing.T_world_part for thing in self.things])

    @cached_property
    def vertices(self) -> Array:
        """(V, 3) vertices of all things as posed, world frame."""
        return np.concatenate([thing.vertices for thing in self.things])

    @cached_property
    def num_faces(self) -> int:
        """Triangles of all things."""
        return sum(thing.obj.num_faces for thing in self.things)


@dataclass(frozen=True, eq=False)
class SceneFrame:
    """What a camera sees of a scene."""

    depth: NDArray[np.float32]
    """(H, W) float32. z-depth in metres, 0 = no return."""
    instance_ids: NDArray[np.uint8]
    """(H, W) uint8. Place in ``Scene.things`` of what is seen: articulated objects, then distractors, then supports;
    ``BACKGROUND`` where nothing stands."""
    part_ids: NDArray[np.uint8]
    """(H, W) uint8. Part of the articulated object that is seen; ``BACKGROUND`` everywhere else."""
    rgb: NDArray[np.uint8] | None = None
    """(H, W, 3) uint8 or None. Colour, where the renderer makes it."""


_used: weakref.WeakKeyDictionary[Part, Array] = weakref.WeakKeyDictionary()


def used_vertices(part: Part) -> Array:
    """(V, 3) vertices that a part's triangles use, native units; found once for each part."""
    found = _used.get(part)
    if found is None:
        found = _used[part] = part.vertices[np.unique(part.faces)]
    return found


def rigid_object(name: str, mesh: Mesh) -> ArticulatedObject:
    """An object of one part that no joint moves.

    Parameters
    ----------
    name : str
        Its category.
    mesh : Mesh
        Rest frame, metres; the origin is the centre of the box around it.
    """
    vertices, faces = mesh
    part = Part(name, name, vertices, faces)
    digest = content_sha256([vertices.tobytes(), faces.tobytes()])
    return ArticulatedObject(digest[:8], name, (part,), KinematicTree([Joint("root", "free", -1)]), digest)


def split_ids(scene: Scene, solid: NDArray[np.int64]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Instance and part ids of pictures that show numbers of solids.

    Parameters
    ----------
    scene : Scene
    solid : (...) int
        Number of each pixel's part, counted through all parts of all things in order; -1 where there is none.

    Returns
    -------
    instance_ids, part_ids : (...) uint8
    """
    counts = [len(thing.obj) for thing in scene.things]
    instance = np.append(np.repeat(np.arange(len(counts)), counts), BACKGROUND).astype(np.uint8)
    part = np.concatenate([np.arange(count) for count in counts] + [[BACKGROUND]]).astype(np.uint8)
    part[instance >= len(scene.instances)] = BACKGROUND
    return instance[solid], part[solid]
