"""What the same search would cost on the physics: a few candidates run, the rest extrapolated."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snakewalk.controller.app.runs.repertoire_run import RepertoireRun, pose_of_action
from snakewalk.controller.app.studies.repertoire_physics import FRAME_S, PhysicsBody
from snakewalk.controller.repertoire.motion import RepertoireMotion
from snakewalk.controller.repertoire.route import Follower
from snakewalk.controller.repertoire.search import AIM_SHARE, Route, search

TRIES = 5


@dataclass(frozen=True, slots=True)
class SearchCost:
    """CPU time, s."""

    candidate_s: float
    """A candidate of the search on the repertoire: one more cycle, all book-keeping included."""
    physics_candidate_s: float
    """The same cycle on the simulated robot, mean over those that were run."""
    ran: int
    """Candidates run on the physics."""
    candidates: int
    """That the search scored."""

    @property
    def ratio(self) -> float:
        """How many times the repertoire is quicker."""
        return self.physics_candidate_s / self.candidate_s

    @property
    def physics_search_s(self) -> float:
        """Extrapolated: all candidates at the price of those that were run."""
        return self.candidates * self.physics_candidate_s

    def facts(self) -> dict[str, object]:
        """Numbers for a command's answer."""
        return {
            "search_s": round(self.candidates * self.candidate_s, 4),
            "physics_candidates_run": self.ran,
            "physics_search_s_extrapolated": round(self.physics_search_s, 1),
            "times_quicker": round(self.ratio),
        }


def search_cost(
    job: RepertoireRun,
    candidates: int,
    *,
    beam: int = 400,
    length: int = 4,
    seed: int = 0,
    told: Callable[[int], None] = lambda done: None,
) -> SearchCost:
    """Time the search, and ``candidates`` random cycles of actions on the physics."""
    run, start = job.run, job.route.pose[0]
    aimed_m = AIM_SHARE * run.waypoint_radius_m
    best = float("inf")
    found = job.route
    for _ in range(TRIES):
        begun = time.process_time()
        found = search(job.moves, start, run.waypoints_m, aimed_m, beam=beam)
        best = min(best, time.process_time() - begun)
    random = np.random.default_rng(seed)
    spent, ran = 0.0, 0
    while ran < candidates:
        count = min(length, candidates - ran)
        actions = tuple(int(k) for k in random.integers(len(job.moves.duration_s), size=count))
        spent += physics_route(job, actions)[0]
        ran += count
        told(ran)
    return SearchCost(best / found.candidates, spent / ran, ran, found.candidates)


def physics_route(job: RepertoireRun, actions: tuple[int, ...]) -> tuple[float, Follower]:
    """Run a sequence on the simulated robot without looking: CPU time, and where it went."""
    pose = [job.route.pose[0]]
    for action in actions:
        pose.append(job.moves.after(pose[-1], action))
    route = Route(actions, np.array(pose), 0, 0.0, 1)
    run = job.run
    follower = Follower(job.moves, route, run.waypoints_m, run.waypoint_radius_m, replan=False)
    motion = RepertoireMotion(job.repertoire, job.robot, actions[0], follower.choose)
    pose_rad = pose_of_action(run, job.robot, job.repertoire, actions[0]).joint_rad
    with PhysicsBody(job.robot, job.world, pose_rad, run.start_m, job.start_heading_rad) as body:
        begun = time.process_time()
        while not motion.stopping:
            view = body.view()
            follower.watch(view)
            body.frame(motion.step(FRAME_S, view))
        return time.process_time() - begun, follower
