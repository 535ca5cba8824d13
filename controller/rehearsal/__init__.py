"""Dress rehearsal: a served simulated robot, its truth, and the judgement of a run."""
