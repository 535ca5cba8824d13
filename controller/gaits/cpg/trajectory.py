"""Joint trajectories of a pattern generator: many are checked before a change of pattern.

All is in closed form: every value is ``goal + (left + slope t) e^(-h t)`` (``Damped``). Rows
of such values: biases, offsets, then real and imaginary parts of the amplitudes, a row a harmonic.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.drivers.compiling import compiled

NEGLIGIBLE = 0.005
"""Share of the acceleration limit that harmonics must add to be counted in a check."""
_ROWS = "float64[:, ::1]"
_ROW = "float64[::1]"
_INPUT_TYPES = f"{_ROW}, {_ROW}, {_ROWS}, {_ROWS}, {_ROWS}, float64, {_ROW}, {_ROW}"


@compiled(
    f"void(float64, int64, {_ROW}, {_ROWS}, {_ROWS}, {_ROWS}, float64, {_ROW}, {_ROW}, "
    f"float64[:, :, ::1], {_ROWS}, {_ROW}, {_ROW})"
)
def _evaluate(
    t: float,
    count: int,
    clock: Floats,
    goal: Floats,
    left: Floats,
    slope: Floats,
    h: float,
    phase_error: Floats,
    coupling: Floats,
    state: Floats,
    work: Floats,
    angle: Floats,
    speed: Floats,
) -> None:
    """Angles and speeds (J,) at one time, of the first ``count`` harmonics.

    ``state`` is memory for values and rates (2, rows, J), ``work`` for (5, J).

    Many short loops over joints: the processor handles several joints at a time in each.
    """
    harmonics = (len(goal) - 2) // 2
    phase = clock[0]
    goal_omega = clock[1]
    missing = clock[2]
    ramp = clock[3]
    slowing = clock[4]
    left_s = np.exp(-slowing * t)
    fallen = (1.0 - left_s) / slowing
    omega = goal_omega + (missing + ramp * t) * left_s
    phase += goal_omega * t + missing * fallen + ramp * (fallen - t * left_s) / slowing
    value = state[0]
    rate = state[1]
    fading = np.exp(-h * t)
    for i in range(2 + 2 * count):
        row = i if i < 2 + count else i - count + harmonics
        for j in range(len(angle)):
            line = left[row, j] + slope[row, j] * t
            value[row, j] = goal[row, j] + line * fading
            rate[row, j] = (slope[row, j] - h * line) * fading
    c = work[0]
    s = work[1]
    c_one = work[2]
    s_one = work[3]
    turning = work[4]
    for j in range(len(angle)):
        theta = phase + value[0, j] + phase_error[j]
        c_one[j], s_one[j] = np.cos(theta), np.sin(theta)
        c[j], s[j] = 1.0, 0.0
        turning[j] = omega + rate[0, j] + coupling[j]
        angle[j], speed[j] = value[1, j], rate[1, j]
    re, im = value[2 : 2 + harmonics], value[2 + harmonics :]
    re_rate, im_rate = rate[2 : 2 + harmonics], rate[2 + harmonics :]
    for k in range(count):
        for j in range(len(angle)):
            turned = c[j] * c_one[j] - s[j] * s_one[j]
            s[j] = s[j] * c_one[j] + c[j] * s_one[j]
            c[j] = turned
        for j in range(len(angle)):
            angle[j] += re[k, j] * c[j] - im[k, j] * s[j]
        for j in range(len(angle)):
            spin = (k + 1.0) * turning[j]
            along, across = re_rate[k, j] - spin * im[k, j], im_rate[k, j] + spin * re[k, j]
            speed[j] += along * c[j] - across * s[j]


@compiled(f"void({_INPUT_TYPES}, float64[:, ::1], float64[:, ::1])")
def trajectory(
    t_s: Floats,
    clock: Floats,
    goal: Floats,
    left: Floats,
    slope: Floats,
    h: float,
    phase_error: Floats,
    coupling: Floats,
    angle: Floats,
    speed: Floats,
) -> None:
    """Write angles and speeds (T, J).

    Args:
        t_s: (T,)
        clock: (5,) the pattern's phase at time 0; its frequency's goal, the difference to it, slope
            and half gain.
        goal: (rows, J)
        left: (rows, J) to the goal.
        slope: (rows, J)
        h: half of the gain.
        phase_error: (J,) phases of the oscillators less the pattern's.
        coupling: (J,) how fast they change.
        angle: out.
        speed: out.

    """
    harmonics = (len(goal) - 2) // 2
    state = np.empty((2, *goal.shape))
    work = np.empty((5, len(phase_error)))
    for i in range(len(t_s)):
        _evaluate(
            t_s[i],
            harmonics,
            clock,
            goal,
            left,
            slope,
            h,
            phase_error,
            coupling,
            state,
            work,
            angle[i],
            speed[i],
        )


@compiled(f"int64({_ROW}, {_ROWS}, {_ROWS}, {_ROWS}, float64, float64)")
def _relevant_harmonics(
    clock: Floats, goal: Floats, left: Floats, slope: Floats, h: float, negligible: float
) -> int:
    """Harmonics that matter: those above them add less than ``negligible`` to any acceleration."""
    turning = 0.0
    for j in range(goal.shape[1]):
        turning = max(turning, abs(slope[0, j]) + h * abs(left[0, j]))
    turning += abs(clock[1]) + abs(clock[2]) + abs(clock[3]) / (2.0 * clock[4])
    harmonics = (len(goal) - 2) // 2
    added = 0.0
    for k in range(harmonics, 0, -1):
        most = 0.0
        for j in range(goal.shape[1]):
            size = 0.0
            for row in (1 + k, 1 + k + harmonics):
                size += abs(goal[row, j]) + abs(left[row, j]) + abs(slope[row, j]) / (2.0 * h)
            most = max(most, size)
        added += most * (k * turning) ** 2
        if added > negligible:
            return k
    return 0


@compiled(
    f"float64({_INPUT_TYPES}, float64[::1], float64[::1], float64, float64[::1], float64[::1])"
)
def peak_share(
    t_s: Floats,
    clock: Floats,
    goal: Floats,
    left: Floats,
    slope: Floats,
    h: float,
    phase_error: Floats,
    coupling: Floats,
    speed_limit: Floats,
    acceleration_limit: Floats,
    enough: float,
    fast: Floats,
    hard: Floats,
) -> float:
    """Largest share of the limits (J,); ends where it is above ``enough``.

    Raises ``fast`` and ``hard`` (J,) to the largest speeds and accelerations; times are even.
    """
    count = len(fast)
    harmonics = _relevant_harmonics(
        clock, goal, left, slope, h, NEGLIGIBLE * acceleration_limit.min()
    )
    state = np.empty((2, *goal.shape))
    work = np.empty((5, count))
    rows = np.zeros((2, count))
    angle = np.empty(count)
    step = t_s[1] - t_s[0]
    over = 0.0
    for i in range(len(t_s)):
        speed = rows[i % 2]
        before = rows[1 - i % 2]
        _evaluate(
            t_s[i],
            harmonics,
            clock,
            goal,
            left,
            slope,
            h,
            phase_error,
            coupling,
            state,
            work,
            angle,
            speed,
        )
        for j in range(count):
            fast[j] = max(fast[j], abs(speed[j]))
            over = max(over, fast[j] / speed_limit[j])
            if i > 0:
                hard[j] = max(hard[j], abs(speed[j] - before[j]) / step)
                over = max(over, hard[j] / acceleration_limit[j])
        if over > enough:
            break
    return over


@compiled(f"void({_ROW}, float64, {_ROW})")
def coupling_rates(phase_error: Floats, coupling_per_s: float, coupling: Floats) -> None:
    """Write the coupling (J,) of neighbours along the body."""
    for j in range(len(phase_error)):
        coupling[j] = 0.0
    for j in range(len(phase_error) - 1):
        between = coupling_per_s * np.sin(phase_error[j + 1] - phase_error[j])
        coupling[j] += between
        coupling[j + 1] -= between
