"""A bench of independent shafts: enough mechanics to serve and test the bus without MuJoCo."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.motor import Gearbox


class BenchPlant:
    """J shafts with inertia and friction, semi-implicit Euler; a ``sim.plant.Plant``.

    Viscous damping and back-EMF are taken implicitly, and dry friction never reverses a shaft, so
    that any step size is stable and a shaft without drive comes to rest exactly. A ``gear`` (of all
    shafts, or one or none each) brings its own inertia, added, and its own friction, in place of
    ``viscous_n_m_s`` and ``dry_n_m``.
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
        bare = Gearbox(0.0, dry_n_m, viscous_n_m_s, 0.0, 1.0, 0.0, 0.0)
        if isinstance(gear, Sequence):
            gear = Gearbox.columns([each or bare for each in gear]) if any(gear) else None
        self._gear = gear or bare
        self._inertia = inertia_kg_m2 + self._gear.armature_kg_m2
        self._viscous = self._gear.viscous_n_m_s
        self._is_bare = gear is None
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

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        """Step to the last whole step at or before ``until_s``."""
        last = int(np.floor(until_s / self._step_s + 1e-9))
        while self._steps < last:
            self._one_step(drive)
            self._steps += 1

    def _one_step(self, drive: ServoDrive) -> None:
        h, q, w = self._step_s, self._position, self._velocity
        on = drive.torque_on
        pwm = drive.p_gain_per_rad * (drive.goal_rad - q)
        drive.pwm[:] = _within(pwm, drive.pwm_limit) * on
        stiff = on * drive.torque_constant_n_m_a / drive.resistance_ohm
        limit = drive.current_limit_a
        amps = (drive.pwm * drive.supply_v - drive.back_emf_v_s * w) / drive.resistance_ohm * on
        limited = np.abs(amps) > limit
        load = self._load(q) if self._load is not None else 0.0
        push = np.where(
            limited,
            _within(amps, limit) * drive.torque_constant_n_m_a,
            stiff * drive.pwm * drive.supply_v,
        )
        damping = self._viscous + np.where(limited, 0.0, stiff * drive.back_emf_v_s)
        free = (self._inertia * w + h * (push + load)) / (self._inertia + h * damping)
        brake = h * self._friction(push - damping * w, load) / (self._inertia + h * damping)
        w[:] = np.sign(free) * np.maximum(np.abs(free) - brake, 0.0)
        q += h * w
        amps = (drive.pwm * drive.supply_v - drive.back_emf_v_s * w) / drive.resistance_ohm * on
        drive.current_a[:] = _within(amps, limit)
        drive.torque_n_m[:] = drive.current_a * drive.torque_constant_n_m_a
        heat_j = h * drive.resistance_ohm * drive.current_a**2
        input_j = heat_j + h * drive.back_emf_v_s * w * drive.current_a
        drive.drawn_j[:] += np.maximum(input_j, 0.0)
        drive.returned_j[:] -= np.minimum(input_j, 0.0)
        drive.heat_j[:] += heat_j
        drive.work_j[:] += h * drive.torque_n_m * w

    def _friction(self, motor_n_m: Floats, load_n_m: ArrayLike) -> Floats | float:
        if self._is_bare:
            return self._gear.dry_n_m
        return self._gear.friction_n_m(self._velocity, motor_n_m, np.asarray(load_n_m))


def _within(value: Floats, limit: Floats) -> Floats:
    return np.minimum(np.maximum(value, -limit), limit)
