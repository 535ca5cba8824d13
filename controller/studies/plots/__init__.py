"""Pictures of studies; importing this package imports matplotlib."""

from snakewalk.controller.studies.plots.run_comparison import draw_comparison
from snakewalk.controller.studies.plots.sweep import draw_sweep
from snakewalk.controller.studies.plots.trials import draw_trials
from snakewalk.controller.studies.plots.walk import draw as draw_walks

__all__ = ["draw_comparison", "draw_sweep", "draw_trials", "draw_walks"]
