"""The objects of all sub-scenes as one: poses and joint states, read from the simulation and put into it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from mani_skill.envs.scene import ManiSkillScene
from mani_skill.utils.structs import Articulation, Link
from numpy.typing import NDArray
from torch import Tensor

from artsim.envs.maniskill.build import Built
from artsim.envs.maniskill.truth import Truth
from artsim.model.kinematics import Array


class Mechanism:
    """B objects of at most P parts, as articulations with at most D degrees of freedom, on the CPU or on a GPU.

    PhysX moves all joints freely. Those that follow others (``mimic``, the thread of a screw) are put where they belong
    after each of its steps: the speeds that obey are the nearest in the metric of the joints' own inertias (Gauss's
    principle, without the coupling between joints), so that what is pushed drags what drives it along.

    Parameters
    ----------
    scene : ManiSkillScene
    built : sequence of Built
        One for each sub-scene.
    truth : Truth

    Attributes
    ----------
    articulation : Articulation
        All of them, merged; ``qpos (B, D)``.
    segmentation_id : (B, P) int64
        What segmentation images call each part; -1 in rows beyond an object's parts.
    """

    def __init__(self, scene: ManiSkillScene, built: Sequence[Built], truth: Truth):
        self._scene, self._truth = scene, truth
        self.articulation = Articulation.merge([each.articulation for each in built], name="object")
        device, rows = scene.device, truth.rows
        most = max(len(each.follow) for each in built)
        # Rows beyond an object's parts show its root, and are told apart by the record's masks.
        links = [[*each.links, *[each.links[0]] * (rows - len(each.links))] for each in built]
        numbers = torch.arange(len(built), dtype=torch.int32, device=device).repeat_interleave(rows)
        self._links = Link.create([link for row in links for link in row], scene, numbers)
        named = [[int(link.entity.per_scene_id) for link in each.links] for each in built]
        self.segmentation_id = torch.tensor([ids + [-1] * (rows - len(ids)) for ids in named], device=device)

        def tensor(arrays: Sequence[Array], dtype: torch.dtype = torch.float32) -> Tensor:
            return torch.from_numpy(np.stack(arrays)).to(device, dtype)

        self._place = tensor([_pad(each.place, (rows,)) for each in built], torch.int64)
        self._offset = tensor([_pad(each.offset, (most,)) for each in built])
        self._origins = tensor([_pad(each.origins, (rows, 3)) for each in built])
        self._follow = torch.zeros(len(built), most, rows, device=device)
        for i, each in enumerate(built):
            free = truth.free[i].nonzero()[:, 0]
            self._follow[i, : len(each.follow), free] = torch.from_numpy(each.follow).float().to(device)
        self._project = None
        if any(len(each.follow) > each.follow.shape[1] for each in built):
            self._project = tensor([_pad(_projection(each), (most, most)) for each in built])

    def T_world_part(self) -> Tensor:
        """(B, P, 4, 4): the rest frame, as carried by each part, to the sub-scene's world; padding repeats it."""
        T = self._links.pose.to_transformation_matrix().reshape(*self._origins.shape[:2], 4, 4).clone()
        T[..., :3, 3] -= (T[..., :3, :3] @ self._origins[..., None])[..., 0]
        return T

    def state(self) -> tuple[Tensor, Tensor]:
        """(B, P) joint states, radians or metres, and (B, P) speeds; 0 for roots and rows of padding."""
        moves = self._truth.fixed["joint_parent"] >= 0
        moves = moves & self._truth.fixed["part_valid"]
        way = torch.where(moves, torch.gather(self.articulation.qpos, 1, self._place), 0.0)
        speed = torch.where(moves, torch.gather(self.articulation.qvel, 1, self._place), 0.0)
        return self._truth.fixed["joint_rest"] + way, speed

    def set_state(self, q: Tensor, env_idx: Tensor) -> None:
        """Put joints somewhere, at rest, in the sub-scenes that are being reset.

        Parameters
        ----------
        q : (B, P) float
        env_idx : (b,) int
            Sub-scenes.
        """
        qpos = self._qpos(q)[env_idx]
        self.articulation.set_qpos(qpos)
        self.articulation.set_qvel(torch.zeros_like(qpos))

    def _qpos(self, q: Tensor) -> Tensor:
        way = torch.where(self._truth.free, q - self._truth.fixed["joint_rest"], 0.0)
        return torch.einsum("bdp,bp->bd", self._follow, way) + self._offset

    def settle(self) -> None:
        """After a step of PhysX: let joints that follow others do so."""
        if self._project is None:
            return
        px: Any = self._scene.px
        if self._scene.gpu_sim_enabled:
            px.gpu_fetch_articulation_qpos()
            px.gpu_fetch_articulation_qvel()
        qvel = torch.einsum("bij,bj->bi", self._project, self.articulation.qvel)
        self.articulation.set_qpos(self._qpos(self.state()[0]))
        self.articulation.set_qvel(qvel)
        if self._scene.gpu_sim_enabled:
            px.gpu_apply_articulation_qpos()
            px.gpu_apply_articulation_qvel()
            px.gpu_update_articulation_kinematics()


def _projection(built: Built) -> Array:
    """(D, D) from speeds to the nearest ones that obey."""
    weighed = built.follow.T * built.inertia
    projection: Array = built.follow @ np.linalg.solve(weighed @ built.follow, weighed)
    return projection


def _pad(array: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    padded: NDArray[Any] = np.zeros(shape, dtype=array.dtype)
    padded[tuple(slice(n) for n in array.shape)] = array
    return padded
