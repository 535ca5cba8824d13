"""A bench of independent shafts: mechanics for the bus without MuJoCo."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.backlash import (
    BACKLASH,
    LEAST_ROTOR_KG_M2,
    SPEED,
    turn_with_backlash,
)
from snakewalk.sim.servo.motor import Gearbox, friction_n_m

_READ = readonly_array(layout="C")


class BenchPlant:
    """J shafts with inertia and friction, semi-implicit Euler; a ``sim.plant.Plant``.

    Viscous damping and back-EMF are implicit, and dry friction never reverses a shaft: any step
    size is stable, and a shaft without drive comes to rest exactly. A ``gear`` (of all shafts, or
    one or None each) adds its inertia, and its friction replaces ``viscous_n_m_s`` and ``dry_n_m``.
    """

    def __init__(
        self,
        joints: int,
        *,
        inertia_kg_m2: float = 2e-3,
        viscous_n_m_s: float = 0.0,
        dry_n_m: float = 0.05,
        step_s: float = 1e-3,
        load_n_m: Callable[[Floats], Floats] | None = None,
        start_rad: ArrayLike = 0.0,
        gear: Gearbox | Sequence[Gearbox | None] | None = None,
    ) -> None:
        self._step_s = step_s
        self._steps = 0
        bare = Gearbox(0.0, dry_n_m, viscous_n_m_s, 0.0, 1.0, 0.0, 0.0, 0.0)
        gears = [gear] * joints if isinstance(gear, Gearbox) or gear is None else list(gear)
        self._gear = Gearbox.columns([gearbox or bare for gearbox in gears]).rows()
        self._shaft_kg_m2 = inertia_kg_m2
        self._gear[0] += inertia_kg_m2
        self._play = np.zeros((3, joints))
        self._constant_load = np.zeros(joints)
        self._load = load_n_m
        self._position = np.full(joints, start_rad, dtype=np.float64)
        self._velocity = np.zeros(joints)

    @property
    def time_s(self) -> float:
        """Time of the last whole step."""
        return self._steps * self._step_s

    @property
    def position_rad(self) -> Floats:
        """(J,) shaft angles; a live view."""
        return self._position

    @property
    def velocity_rad_s(self) -> Floats:
        """(J,) shaft speeds; a live view."""
        return self._velocity

    def set_load(self, joints: Sequence[int], load_n_m: float) -> None:
        """Put a constant load on shafts; without effect if the load is a function."""
        self._constant_load[list(joints)] = load_n_m

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        """Step to the last whole step at or before ``until_s``."""
        last = int(np.floor(until_s / self._step_s + 1e-9))
        while self._steps < last:
            steps = last - self._steps
            load_n_m = self._constant_load
            if self._load is not None:  # it may change with every step
                steps = 1
                load_n_m = np.asarray(self._load(self._position), dtype=np.float64)
            shafts = (load_n_m, self._gear, self._play, self._position, self._velocity)
            _step(steps, self._step_s, self._shaft_kg_m2, *shafts, *drive.columns())
            self._steps += steps


@compiled("float64(float64, float64)")
def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


@compiled(
    f"void(int64, float64, float64, {_READ}, {readonly_array(dimensions=2, layout='C')},"
    " float64[:, ::1], float64[::1], float64[::1],"
    f" {', '.join([_READ] * 9)}, {', '.join(['float64[::1]'] * 7)})"
)
def _step(
    steps: int,
    h: float,
    shaft_kg_m2: float,
    load_n_m: Floats,
    gear: Floats,
    play: Floats,
    position: Floats,
    velocity: Floats,
    torque_on: Floats,
    goal_rad: Floats,
    p_gain_per_rad: Floats,
    pwm_limit: Floats,
    supply_v: Floats,
    resistance_ohm: Floats,
    torque_constant_n_m_a: Floats,
    back_emf_v_s: Floats,
    current_limit_a: Floats,
    current_a: Floats,
    torque_n_m: Floats,
    pwm: Floats,
    drawn_j: Floats,
    returned_j: Floats,
    heat_j: Floats,
    work_j: Floats,
) -> None:
    """Make ``steps`` steps of ``h`` under a constant load; then the columns of a drive in order.

    ``gear`` (13, J): the fields of ``Gearbox``, with ``shaft_kg_m2`` added to the rotor's inertia.
    ``play`` (3, J): state of the backlash.
    """
    for k in range(len(position)):
        inertia = gear[0, k]
        viscous = gear[2, k]
        on = torque_on[k]
        ohm = resistance_ohm[k]
        load = load_n_m[k]
        stiff = on * torque_constant_n_m_a[k] / ohm
        rotor_kg_m2 = max(inertia - shaft_kg_m2, LEAST_ROTOR_KG_M2)
        has_play = gear[BACKLASH, k] > 0.0
        for _ in range(steps):
            q, w = position[k], velocity[k]
            motor_rad_s = play[SPEED, k] if has_play else w
            share = _clamp(p_gain_per_rad[k] * (goal_rad[k] - q), pwm_limit[k]) * on
            amps = (share * supply_v[k] - back_emf_v_s[k] * motor_rad_s) / ohm * on
            if abs(amps) > current_limit_a[k]:
                push = _clamp(amps, current_limit_a[k]) * torque_constant_n_m_a[k]
                damping = viscous
            else:
                push = stiff * share * supply_v[k]
                damping = viscous + stiff * back_emf_v_s[k]
            free = (inertia * w + h * (push + load)) / (inertia + h * damping)
            motor = push - (damping - viscous) * w
            friction = friction_n_m(gear[:, k], w, motor, load)
            brake = h * friction / (inertia + h * damping)
            before = w
            w = np.sign(free) * max(abs(free) - brake, 0.0)
            more = 0.0
            turned = w
            if has_play:
                w, more = turn_with_backlash(
                    gear[:, k],
                    play[:, k],
                    h,
                    shaft_kg_m2,
                    rotor_kg_m2,
                    before,
                    w,
                    push,
                    damping,
                    load,
                )
                turned = play[SPEED, k]
            velocity[k] = w
            position[k] = q + h * (w + more) if has_play else q + h * w
            amps = (share * supply_v[k] - back_emf_v_s[k] * turned) / ohm * on
            amps = _clamp(amps, current_limit_a[k])
            pwm[k], current_a[k] = share, amps
            torque_n_m[k] = amps * torque_constant_n_m_a[k]
            lost_j = h * ohm * amps**2
            input_j = lost_j + h * back_emf_v_s[k] * turned * amps
            drawn_j[k] += max(input_j, 0.0)
            returned_j[k] -= min(input_j, 0.0)
            heat_j[k] += lost_j
            work_j[k] += h * torque_n_m[k] * turned
