"""Open procedural objects under physics, through gymnasium, and draw what the camera saw of one of them."""

import sys
from pathlib import Path

import gymnasium
import numpy as np
from PIL import Image

import artsim.envs  # noqa: F401  # registers artsim/Articulated-v0
from artsim import ViewOptions


def main(out: Path) -> None:
    env = gymnasium.make(
        "artsim/Articulated-v0",
        render_mode="rgb_array",
        categories=("storage_furniture", "laptop", "microwave"),
        control="velocity",
        camera="orbit",
        noise="d435",
        episode_length=60,
        views=ViewOptions(width=320, height=240),
    )
    for seed in range(5):
        observation, info = env.reset(seed=seed)
        total, over, pictures = 0.0, False, []
        while not over:
            action = np.full(env.action_space.shape, 0.05, np.float32)
            observation, reward, _, over, info = env.step(action)
            total += float(reward)
            pictures.append(env.render())
        cloud = observation["points"]
        print(f"{info['category']:18} {len(cloud)} points, opened by {100 * total:.0f} % in {info['time']:.0f} s")
    out.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.hstack(pictures[::15])).save(out)
    print(f"wrote {out}")
    env.close()


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "environment.png"))
