"""The fitting agent: actions, decision process, policy, PPO (ArtPERL, section 4.3)."""
