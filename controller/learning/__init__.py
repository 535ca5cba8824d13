"""A simulated robot on its bus as an environment for reinforcement learning (Gymnasium)."""
