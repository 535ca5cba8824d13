"""CPU time of a search over recorded actions, and of the same search on the physics.

The second is extrapolated from a few candidates.
"""

import time
from dataclasses import dataclass

import numpy as np

from snakewalk.controller.repertoire.motion import RepertoireMotion
from snakewalk.controller.repertoire.repertoire_physics import FRAME_S, PhysicsBody
from snakewalk.controller.repertoire.repertoire_run import RepertoireRun, pose_of_action
from snakewalk.controller.repertoire.route import RouteFollower
from snakewalk.controller.repertoire.search import AIM_SHARE, Route, search

TRIES = 5


@dataclass(frozen=True, slots=True)
class SearchCost:
    """CPU time, s."""

    candidate_s: float
    """A candidate of the search on the repertoire: one more cycle, all book-keeping included."""
    physics_candidate_s: float
    """CPU time of a cycle on the simulated robot, mean over the cycles that were run."""
    ran: int
    """Candidates run on the physics."""
    candidates: int
    """Number of candidates that the search scored."""

    @property
    def ratio(self) -> float:
        """How many times the repertoire is quicker."""
        return self.physics_candidate_s / self.candidate_s

    @property
    def physics_search_s(self) -> float:
        """Time to simulate all candidates, extrapolated from the simulated ones."""
        return self.candidates * self.physics_candidate_s


def search_cost(
    job: RepertoireRun,
    candidates: int,
    *,
    beam: int = 400,
) -> SearchCost:
    """Time the search, and ``candidates`` random cycles of at most four actions on the physics."""
    run = job.run
    start = job.route.pose[0]
    aimed_m = AIM_SHARE * run.waypoint_radius_m
    best = float("inf")
    route = job.route
    for _ in range(TRIES):
        begun = time.process_time()
        route = search(job.primitives, start, run.waypoints_m, aimed_m, beam=beam)
        best = min(best, time.process_time() - begun)
    random = np.random.default_rng(0)
    spent = 0.0
    ran = 0
    while ran < candidates:
        count = min(4, candidates - ran)
        actions = tuple(int(k) for k in random.choice(job.primitives.tried, size=count))
        spent += physics_route(job, actions)[0]
        ran += count
    return SearchCost(best / route.candidates, spent / ran, ran, route.candidates)


def physics_route(job: RepertoireRun, actions: tuple[int, ...]) -> tuple[float, RouteFollower]:
    """Run a sequence on the simulated robot open loop; return its CPU time and its follower."""
    pose = [job.route.pose[0]]
    for action in actions:
        pose.append(job.primitives.after(pose[-1], action))
    route = Route(actions, np.array(pose), 0, 0.0, 1)
    run = job.run
    follower = RouteFollower(
        job.primitives, route, run.waypoints_m, run.waypoint_radius_m, replan=False
    )
    motion = RepertoireMotion(job.repertoire, job.robot, actions[0], follower.choose)
    pose_rad = pose_of_action(run, job.robot, job.repertoire, actions[0]).joint_rad
    with PhysicsBody(job.robot, job.world, pose_rad, run.start_m, job.start_heading_rad) as body:
        begun = time.process_time()
        while not motion.stopping:
            view = body.view()
            follower.count_waypoints(view)
            body.frame(motion.step(FRAME_S, view))
        return time.process_time() - begun, follower
