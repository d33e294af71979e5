"""Train a floating gripper to close drawers that it has never seen, with PPO on a CPU, and draw how the return rises.

Every fourth episode has a new procedural desk; the gripper sees states. On a GPU ManiSkill simulates thousands of
sub-scenes at once; on a CPU each process simulates one:

    pip install -e '.[maniskill]' stable-baselines3 matplotlib
    python examples/maniskill/main.py out/maniskill            # a few minutes
    python examples/maniskill/main.py out/maniskill --help     # other objects, goals and robots
"""

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import gymnasium
import numpy as np
import torch
import tyro
from mani_skill.utils.wrappers.gymnasium import CPUGymWrapper
from PIL import Image
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import SubprocVecEnv

import artsim.envs  # noqa: F401  # registers ArtSimArticulated-v1


@dataclass
class Options:
    """What to train."""

    out: Annotated[Path, tyro.conf.Positional] = Path("out/maniskill")
    """Folder of the pictures and of the policy."""
    category: str = "drawer"
    """A procedural category: artsim generate-objects --help names them."""
    goal: str = "close"
    """open, close or random."""
    robot: str = "floating_panda_gripper"
    """floating_panda_gripper, panda, panda_wristcam, fetch or xarm6_robotiq."""
    control: str = "pd_joint_delta_pos"
    """Control mode of the robot."""
    max_joints: int = 1
    """Objects with more joints are passed over."""
    steps: int = 40_000
    """Control steps to learn from."""
    processes: int = 2
    """Sub-scenes at once."""


def new(options: Options, seed: int, render_mode: str | None = None) -> gymnasium.Env[Any, Any]:
    """The environment with NumPy arrays, its returns written down. Episodes last: a gripper that is done has more."""
    torch.set_num_threads(1)
    env = gymnasium.make(
        "ArtSimArticulated-v1",
        categories=(options.category,),
        goal=options.goal,
        robot_uids=options.robot,
        control_mode=options.control,
        max_joints=options.max_joints,
        reconfiguration_freq=4,
        render_mode=render_mode,
    )
    env = Monitor(CPUGymWrapper(env, ignore_terminations=True), info_keywords=("success",))
    env.reset(seed=seed)
    return env


class Curve(BaseCallback):
    """Mean return and share of successes of the latest episodes, now and then."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[tuple[int, float, float]] = []
        self._start = time.perf_counter()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        episodes = self.model.ep_info_buffer
        if not episodes:
            return
        mean = float(np.mean([episode["r"] for episode in episodes]))
        success = float(np.mean([episode["success"] for episode in episodes]))
        self.rows.append((self.num_timesteps, mean, success))
        seconds = time.perf_counter() - self._start
        print(f"{self.num_timesteps:>8} steps {seconds:6.0f} s  return {mean:6.2f}  success {success:4.0%}", flush=True)


def draw(rows: list[tuple[int, float, float]], file: Path) -> None:
    """Return and successes over steps."""
    import matplotlib.pyplot as plt

    steps, returns, success = np.array(rows).T
    figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
    axes.plot(steps, returns)
    axes.set(xlabel="control steps", ylabel="return of the last 100 episodes")
    right = axes.twinx()
    right.plot(steps, success, color="tab:green")
    right.set(ylabel="success", ylim=(0, 1))
    figure.savefig(file, dpi=120)


def film(policy: PPO, options: Options, file: Path) -> None:
    """Four pictures of the trained policy's first steps in an episode."""
    env = new(options, seed=10_000, render_mode="rgb_array")
    observation, _ = env.reset(seed=10_001)
    pictures = [env.render()]
    for _ in range(3):
        for _ in range(8):
            action, _ = policy.predict(observation, deterministic=True)
            observation, *_ = env.step(action)
        pictures.append(env.render())
    Image.fromarray(np.hstack(pictures)).save(file)
    env.close()


def main(options: Options) -> None:
    """Train, and show."""
    options.out.mkdir(parents=True, exist_ok=True)
    envs = SubprocVecEnv([partial(new, options, seed) for seed in range(options.processes)])
    policy = PPO(
        "MlpPolicy",
        envs,
        n_steps=256,
        batch_size=128,
        n_epochs=8,
        gamma=0.95,
        learning_rate=3e-4,
        policy_kwargs={"net_arch": [128, 128], "log_std_init": -0.5},
        device="cpu",
        seed=0,
    )
    curve = Curve()
    policy.learn(options.steps, callback=curve)
    policy.save(options.out / "policy.zip")
    envs.close()
    draw(curve.rows, options.out / "return.png")
    film(policy, options, options.out / "episode.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
