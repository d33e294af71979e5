"""What SAPIEN draws: solids with their coats, light, and a camera."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artsim.model.appearance import Coat, Colour, Lights, Material, patches, subpixel
from artsim.model.camera import Camera
from artsim.model.kinematics import Array
from artsim.model.objects import Part

_GAMMA = 2.2  # of the pictures that SAPIEN gives
_SKY_LAMPS = 3  # of the ten spot lights with shadows that SAPIEN's shaders have
_SKY_DISTANCE = 4.0  # of a sky lamp, over the radius of what is lit
_SHADOW_PIXELS = 4096
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
# SAPIEN's camera looks along x with z up.
_CV_FROM_SAPIEN = np.array([[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Shadows:
    """Where shadows are cast."""

    center: Array
    """(3,) float. Of what casts them, in the stage's frame."""
    radius: float
    """Of a sphere around it."""
    lit: float
    """Radius of the sphere that the sky lights."""


class Stage:
    """A SAPIEN scene.

    Parameters
    ----------
    sapien : module
    solids : sequence of (Part, Coat, float)
        Each with the scale of its object, by which it is drawn. Their places in this list are their numbers.
    lights : Lights
        In the stage's frame. The sky shines only where there are shadows.
    shadows : Shadows, optional
    """

    def __init__(
        self,
        sapien: ModuleType,
        solids: Sequence[tuple[Part, Coat, float]],
        lights: Lights,
        shadows: Shadows | None = None,
    ):
        self.num_faces = sum(len(part.faces) for part, _, _ in solids)
        self._sapien, self._lights, self._shadows = sapien, lights, shadows
        self._scene: Any = sapien.Scene([sapien.render.RenderSystem()])
        self._scene.set_ambient_light(list(lights.ambient))
        self._sun = self._scene.add_directional_light(
            list(lights.sun.direction), _radiance(lights.sun.colour), **self._reach("sun")
        )
        self._sky = self._sky_lamps()
        self._materials: dict[Material, Any] = {}
        self._entities = [self._entity(*solid) for solid in solids]
        self._cameras: dict[tuple[int, int], Any] = {}
        # Number of each entity in the segmentation picture -> number of the solid; 0 is the background.
        numbers = [0 if entity is None else int(entity.per_scene_id) for entity in self._entities]
        self._solid_of_number = np.full(max(numbers, default=0) + 1, -1, dtype=np.int64)
        for k, number in enumerate(numbers):
            if number:
                self._solid_of_number[number] = k

    def _entity(self, part: Part, coat: Coat, scale: float) -> Any:
        """Entity with the part's surface, None for a part without."""
        if len(part.faces) == 0:
            return None
        body = render_body(self._sapien, part, coat, scale, self._materials)
        entity = self._sapien.Entity()
        entity.add_component(body)
        self._scene.add_entity(entity)
        return entity

    def place(self, T_stage_solid: Array) -> None:
        """Move every solid to its (N, 4, 4) pose."""
        for entity, T in zip(self._entities, T_stage_solid, strict=True):
            if entity is not None:
                entity.set_pose(self._pose(T))

    def _reach(self, light: str) -> dict[str, Any]:
        """How SAPIEN is to cast a light's shadows."""
        if self._shadows is None:
            return {}
        common: dict[str, Any] = {"shadow": True, "shadow_map_size": _SHADOW_PIXELS}
        radius, lit = self._shadows.radius, self._shadows.lit
        if light == "sun":
            return {"shadow_scale": radius, "shadow_near": -lit, "shadow_far": lit, **common}  # beyond, all is dark
        away = _SKY_DISTANCE * lit
        return {"shadow_near": away - lit, "shadow_far": away + lit, **common}

    def _sky_lamps(self) -> list[Any]:
        if self._shadows is None or not any(self._lights.sky):
            return []
        width = 2.0 * float(np.arcsin(1.0 / _SKY_DISTANCE))
        # On a level surface, light from evenly spread directions counts half as much as from straight above.
        square = (_SKY_DISTANCE * self._shadows.lit) ** 2
        strength = [2.0 * c * square / _SKY_LAMPS for c in _radiance(self._lights.sky)]
        return [
            self._scene.add_spot_light(
                [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], width, 1.01 * width, strength, **self._reach("sky")
            )
            for _ in range(_SKY_LAMPS)
        ]

    def _light(self, sample: int, samples: int) -> None:
        """Stand sun and sky lamps where they are in one of several pictures."""
        sun = self._lights.sun
        direction = np.asarray(sun.direction) / np.linalg.norm(sun.direction)
        across = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
        across /= np.linalg.norm(across)
        off, angle = np.tan(sun.radius) * np.sqrt((sample + 0.5) / samples), _GOLDEN_ANGLE * sample
        if samples > 1:
            direction = direction + off * (np.cos(angle) * across + np.sin(angle) * np.cross(direction, across))
        center = np.zeros(3) if self._shadows is None else self._shadows.center
        self._aim(self._sun, center, direction)
        count = samples * len(self._sky)
        for k, lamp in enumerate(self._sky):
            # Every count-th part of the hemisphere has one lamp in one of the pictures.
            n = sample + k * samples
            height, turn = (n + 0.5) / count, _GOLDEN_ANGLE * n
            level = np.sqrt(1.0 - height**2)
            up = np.array([level * np.cos(turn), level * np.sin(turn), height])
            assert self._shadows is not None
            self._aim(lamp, center + _SKY_DISTANCE * self._shadows.lit * up, -up)

    def _aim(self, light: Any, position: Array, direction: Array) -> None:
        turn = self._sapien.math.shortest_rotation([1.0, 0.0, 0.0], direction.tolist())
        light.pose = self._sapien.Pose(position.tolist(), turn)

    def _pose(self, T: Array) -> Any:
        return self._sapien.Pose(T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_quat()[[3, 0, 1, 2]])

    def _camera(self, width: int, height: int) -> Any:
        made = self._cameras.get((width, height))
        if made is None:
            # A picture is taken by one camera at a time: the others would be drawn along with it.
            for old in self._cameras.values():
                self._scene.remove_camera(old)
            made = self._scene.add_camera("camera", width, height, 1.0, 0.01, 10.0)
            self._cameras = {(width, height): made}
        return made

    def picture(
        self, camera: Camera, T_stage_camera: Array, near: float, far: float, samples: int = 1
    ) -> tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.uint8]]:
        """Depth in the stage's units, numbers of solids (-1 for none) and colour.

        The first picture is taken through the pixels' centres; the colour is the mean of all.
        """
        eye, K = self._camera(camera.width, camera.height), camera.K
        eye.set_entity_pose(self._pose(T_stage_camera @ _CV_FROM_SAPIEN))
        background = np.asarray(self._lights.background, dtype=np.float32) ** _GAMMA
        light = np.zeros((camera.height, camera.width, 3), dtype=np.float32)
        for sample in range(samples):
            self._light(sample, samples)
            eye.set_perspective_parameters(
                near, far, K[0, 0], K[1, 1], *(K[:2, 2] + subpixel(sample)).tolist(), K[0, 1]
            )
            self._scene.update_render()
            eye.take_picture()
            numbers = eye.get_picture("Segmentation")[..., 1]
            known = numbers < len(self._solid_of_number)
            seen = self._solid_of_number[np.where(known, numbers, 0)]
            if sample == 0:
                solid = seen
                # OpenGL's camera looks along -z.
                depth = np.where(solid < 0, np.float32(0.0), -eye.get_picture("Position")[..., 2])
            colour = eye.get_picture("Color")[..., :3].clip(0.0, 1.0) ** _GAMMA
            light += np.where(seen[..., None] < 0, background, colour)
        rgb = (255.0 * (light / samples) ** (1.0 / _GAMMA)).round().astype(np.uint8)
        return depth, solid, rgb

    def close(self) -> None:
        """Release the scene's pictures and meshes."""
        self._cameras.clear()
        self._entities.clear()
        self._materials.clear()
        self._sky.clear()
        self._sun = None
        self._scene.clear()
        self._scene = None


def render_body(sapien: ModuleType, part: Part, coat: Coat, scale: float, materials: dict[Material, Any]) -> Any:
    """SAPIEN's component that draws a part at its object's scale, in the rest frame.

    Parameters
    ----------
    sapien : module
    part : Part
    coat : Coat
    scale : float
    materials : dict
        SAPIEN's material of each of artsim's; more are put into it.
    """
    body = sapien.render.RenderBodyComponent()
    for patch in patches(part, coat, scale):
        if patch.material not in materials:
            materials[patch.material] = _render_material(sapien, patch.material)
        uv = np.stack([patch.uv[:, 0], 1.0 - patch.uv[:, 1]], axis=1)  # Vulkan counts rows from the top
        body.attach(
            sapien.render.RenderShapeTriangleMesh(
                patch.vertices * np.float32(scale), patch.faces, patch.normals, uv, materials[patch.material]
            )
        )
    return body


def _render_material(sapien: ModuleType, material: Material) -> Any:
    colour = _linear(material.colour)
    glow = [material.emission] * 3 if material.texture is not None else [material.emission * c for c in colour]
    made = sapien.render.RenderMaterial(
        base_color=[*colour, 1.0],
        emission=[*glow, 1.0],
        specular=material.specular,
        roughness=float(np.clip(material.roughness, 0.05, 1.0)),
        metallic=material.metallic,
    )
    if material.texture is not None:
        rgba = np.dstack([material.texture, np.full(material.texture.shape[:2], 255, np.uint8)])
        levels = int(np.log2(max(rgba.shape[:2]))) + 1
        picture = sapien.render.RenderTexture2D(
            np.ascontiguousarray(rgba), "R8G8B8A8Unorm", mipmap_levels=levels, srgb=True
        )
        made.set_base_color_texture(picture)
        if material.emission:
            made.set_emission_texture(picture)
    return made


def _linear(colour: Colour) -> list[float]:
    """Of sRGB."""
    return [float(c) ** _GAMMA for c in colour]


def _radiance(colour: Colour) -> list[float]:
    """Of light that shows a surface which faces it in its own colour."""
    return [np.pi * float(c) for c in colour]
