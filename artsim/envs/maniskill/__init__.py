"""``ArtSimArticulated-v1``: articulated objects as a ManiSkill 3 task, a different one in each parallel sub-scene.

::

    import gymnasium
    import artsim.envs

    env = gymnasium.make("ArtSimArticulated-v1", categories=("laptop",), goal="close", obs_mode="pointcloud")
    observation, info = env.reset(seed=0)

Programs that import no artsim, such as ManiSkill's own, make it by the id ``artsim.envs:ArtSimArticulated-v1``. The
environment itself is :class:`artsim.envs.maniskill.task.ArticulatedTask`; importing this package imports no part of
ManiSkill.
"""

ENV_ID = "ArtSimArticulated-v1"
RECORDED_ID = f"artsim.envs:{ENV_ID}"
"""The id as programs know it that import no artsim: gymnasium imports the module before the colon."""
EPISODE_LENGTH = 100
"""Control steps, unless ``max_episode_steps`` says otherwise."""
