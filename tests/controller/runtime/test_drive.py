"""The drive of a run: what holds up its cycles."""

import gc
from pathlib import Path

from snakewalk.controller.run.execute import execute
from snakewalk.controller.run.factory import prepare_walk


def test_a_garbage_collection_in_motion_goes_over_what_the_run_itself_has_made(
    tmp_path: Path,
) -> None:
    prepared = prepare_walk("flat-slalom", motion="serpenoid", time_limit_s=0.5)
    gc.unfreeze()  # the suite's own
    before = len(gc.get_objects())
    met: list[int] = []
    try:
        execute(prepared, tmp_path, on_progress=lambda progress: met.append(len(gc.get_objects())))
        assert len(met) > 20
        assert max(met) < before / 4
        assert gc.get_freeze_count() == 0
    finally:
        gc.freeze()
