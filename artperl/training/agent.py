"""Stage: the agent learns Algorithm 1, behaviour cloning and PPO, on fitting problems."""

from __future__ import annotations

from dataclasses import dataclass

from artperl.agent.decision_process import Fitting
from artperl.agent.policy import Agent
from artperl.agent.ppo import algorithm_1
from artperl.core.pose import Theta
from artperl.data.fitting_problems import Problems
from artperl.perception.network import Perception
from artperl.training.context import Context
from artperl.training.steps import autocast, one_cycle, set_rate
from artperl.training.validation import step_taken
from artsim.common.progress import track

_VIEWS = 8
"""Episodes of a rollout that fit the same object: most of the time goes into making objects."""
_SAVE_ROLLOUTS = 10
"""Rollouts after which the run is saved, against a stop that nobody asked for."""


@dataclass(frozen=True)
class AgentStage:
    """Algorithm 1 on problems whose points carry the labels that perception gives them."""

    name: str = "agent"

    def run(self, context: Context) -> None:
        """Make the rollouts that are left."""
        options, state = context.options, context.state
        agent, optimizer, perception = state.networks["agent"], state.optimizers["agent"], state.networks["perception"]
        assert isinstance(agent, Agent)
        assert isinstance(perception, Perception)
        first, total = state.done[self.name], options.agent_rollouts
        if first >= total:
            return
        problems = Problems(
            context.objects.data, context.objects.base, options.episodes, options.num_points, options.seed + 1,
            options.start, perception if options.labels == "perceived" else None, _VIEWS, options.references,
        )  # fmt: skip

        def episodes(n: int) -> tuple[Fitting, Theta]:
            set_rate(optimizer, options.agent_rate * one_cycle(n, total))
            problem = problems[n].to(context.device)
            return Fitting(problem.shapes, problem.observed, problem.start, options.fitting), problem.goal

        rounds = algorithm_1(agent, optimizer, episodes, options.phase, options.ppo, options.seed, first, total)
        bar = track("agent", total=total, initial=first, smoothing=0.1, shown=context.progress)
        for n in range(first, total):
            with autocast(context.device, options.mixed_precision):
                figures = next(rounds)
            context.report("agent", figures, n)
            bar.set_postfix_str(f"reward {figures['reward']:.3f}, chamfer {figures['chamfer_end']:.3f}")
            bar.update()
            step_taken(context, self.name, n + 1, total, options.validate_rollouts, _SAVE_ROLLOUTS)
        bar.close()
