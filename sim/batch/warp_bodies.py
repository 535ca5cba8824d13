"""``BatchBodies`` on MuJoCo-Warp, on a GPU or the CPU, in single precision."""

from collections.abc import Callable
from typing import Any

import mujoco
import mujoco_warp
import numpy as np
import warp

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.batch import kernels
from snakewalk.sim.batch.bodies import BatchBodies
from snakewalk.sim.physics.mechanics import PhysicsError

CONTACTS = 5
"""Contacts that are allocated for each link, on average: two with the floor, others with links."""
ITERATIONS = 8
"""Most iterations of the solver. The CPU device launches all of them; Newton's method needs two or
three for these contacts (ours)."""
_NO_LIMIT_A = 1e9
"""Current limit of a motor without one."""
_INPUTS = (
    "torque_on",
    "goal_rad",
    "p_gain_per_rad",
    "pwm_limit",
    "supply_v",
    "current_limit_a",
)
"""Arrays of the drive, in the order of the kernel's arguments."""


class WarpBodies(BatchBodies):
    """Bodies on a Warp device; ``device`` None is the first GPU, else the CPU.

    Raises:
        InputError: the robot's gears or the world are not supported, or the device does not exist.

    """

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        count: int,
        step_s: float | None = None,
        device: str | None = None,
    ) -> None:
        super().__init__(robot, world, count, step_s)
        self.device = _device(device)
        """Warp's device."""
        self._state: _DeviceState | None = None

    def run(self, steps: int) -> None:
        """Advance all worlds under the present drive, and read their state back.

        Raises:
            PhysicsError: a state diverged.

        """
        if self._state is None:
            self._state = _DeviceState(self)
        state = self._state
        with warp.ScopedDevice(self.device):
            if self._placed.any():
                state.upload(self.qpos, self.qvel, self._load, self._before)
                state.forget(self._placed, self.energies_j, self.totals)
                self._placed[:] = False
            state.set_drive(self)
            for _ in range(steps):
                state.step()
            state.download(self)
        self._load, self._before = state.memory()
        if not np.isfinite(self.qpos).all():
            bad = int(np.flatnonzero(~np.isfinite(self.qpos).all(axis=1))[0])
            raise PhysicsError(f"the physics of world {bad} diverged")


def device_name(name: str | None) -> str:
    """Return Warp's own name of a device, such as ``cpu``; None is the default device.

    Raises:
        InputError: it does not exist.

    """
    return str(_device(name))


def _device(name: str | None) -> Any:
    warp.config.quiet = True
    warp.init()
    try:
        return warp.get_device(name)
    except ValueError as error:
        valid = ", ".join(str(device) for device in warp.get_devices())
        raise InputError(f"device {name}: {error}; valid: {valid}") from None


class _DeviceState:
    """Arrays on the device, and one step of all worlds."""

    def __init__(self, bodies: WarpBodies) -> None:
        self.device = bodies.device
        mechanics = bodies.template.mechanics
        robot = bodies.template.robot
        model = mechanics.model
        worlds = bodies.count
        joints = robot.joint_count
        links = joints + 1
        most = CONTACTS * links
        with warp.ScopedDevice(self.device):
            self.model = mujoco_warp.put_model(model)
            self.model.opt.iterations = min(self.model.opt.iterations, ITERATIONS)
            self.data = mujoco_warp.make_data(
                model, nworld=worlds, nconmax=most, njmax=most + 2 * joints
            )
            self._constants(bodies, model)
            self.drive = {name: warp.zeros((worlds, joints), dtype=float) for name in _INPUTS}
            self.speed, self.current, self.torque, self.pwm = (
                warp.zeros((worlds, joints), dtype=float) for _ in range(4)
            )
            self.velocity, self.spin, self.push, self.twist, self.before = (
                warp.zeros((worlds, links), dtype=warp.vec3) for _ in range(5)
            )
            self.depth, self.load = (warp.zeros((worlds, links), dtype=float) for _ in range(2))
            self.still = warp.zeros(worlds, dtype=float)
            self.mu = warp.zeros((worlds, 4), dtype=float)
            self.energies = warp.zeros((4, worlds, joints), dtype=warp.float64)
            self.totals = warp.zeros((worlds, 2), dtype=warp.float64)
        self.spine = mechanics.spine_links
        self.radius_m = mechanics.radius_m
        self.step_s = bodies.step_s
        self._graph: Any = None

    def _constants(self, bodies: WarpBodies, model: mujoco.MjModel) -> None:
        mechanics = bodies.template.mechanics
        self.parents = warp.array(model.body_parentid, dtype=int)
        self.bodies = warp.array(model.geom_bodyid, dtype=int)
        self.roles = warp.array(mechanics.contact_role, dtype=int)
        self.mass_kg = warp.array(mechanics.link_mass_kg, dtype=float)
        motor = (
            bodies.motors.resistance_ohm,
            bodies.motors.torque_constant_n_m_a,
            bodies.motors.back_emf_v_s,
            mechanics.gears[2],
        )
        self.motor = warp.array(np.stack(motor), dtype=float)

    def upload(self, qpos: Floats, qvel: Floats, load: Floats, before: Floats) -> None:
        self.data.qpos.assign(qpos)
        self.data.qvel.assign(qvel)
        self.load.assign(load)
        self.before.assign(before)

    def forget(self, rows: Bools, energies_j: Floats, totals: Floats) -> None:
        """Set the energies, and clear the warm start of some worlds (W,)."""
        self.energies.assign(energies_j)
        self.totals.assign(totals)
        start = self.data.qacc_warmstart.numpy()
        start[rows] = 0.0
        self.data.qacc_warmstart.assign(start)

    def set_drive(self, bodies: WarpBodies) -> None:
        for name, values in self.drive.items():
            values.assign(np.minimum(getattr(bodies, name), _NO_LIMIT_A))
        self.mu.assign(bodies.friction)

    def step(self) -> None:
        """Advance all worlds by a step; on a GPU by a captured graph."""
        if not self.device.is_cuda:
            self._launch_step()
            return
        if self._graph is None:
            self._launch_step()  # loads the kernels; a capture cannot
            with warp.ScopedCapture() as capture:
                self._launch_step()
            self._graph = capture.graph
            return
        warp.capture_launch(self._graph)

    def _launch_step(self) -> None:
        m, d = self.model, self.data
        worlds, joints = self.speed.shape
        mujoco_warp.step1(m, d)
        launch: Callable[..., None] = warp.launch
        launch(
            kernels.turn_motors,
            (worlds, joints),
            inputs=[d.qpos, d.qvel, *self.drive.values(), self.motor],
            outputs=[self.speed, self.current, self.torque, self.pwm, d.qfrc_applied],
        )
        launch(
            kernels.move_links,
            worlds,
            inputs=[
                d.xipos,
                d.xmat,
                d.xaxis,
                d.qvel,
                self.parents,
                self.spine,
                self.radius_m,
                self.step_s,
            ],
            outputs=[
                self.before,
                self.velocity,
                self.spin,
                self.depth,
                self.push,
                self.twist,
                self.still,
            ],
        )
        contacts = d.contact
        contact_count = d.contact.dist.shape[0]
        which = [d.nacon, contacts.worldid, contacts.geom]
        about = [self.roles, self.bodies]
        launch(
            kernels.add_depths,
            contact_count,
            inputs=[*which, contacts.dist, *about],
            outputs=[self.depth],
        )
        launch(
            kernels.rub,
            contact_count,
            inputs=[
                *which,
                contacts.dist,
                contacts.pos,
                contacts.frame,
                *about,
                d.xipos,
                d.xmat,
                self.velocity,
                self.spin,
                self.depth,
                self.load,
                self.mass_kg,
                self.still,
                self.mu,
                self.step_s,
            ],
            outputs=[self.push, self.twist, self.totals],
        )
        launch(
            kernels.collect,
            worlds,
            inputs=[d.xipos, d.xmat, d.xanchor, d.xaxis, self.parents],
            outputs=[self.push, self.twist, d.qfrc_applied],
        )
        mujoco_warp.step2(m, d)
        launch(
            kernels.settle,
            (worlds, joints),
            inputs=[d.qvel, self.speed, self.current, self.torque, self.motor, self.step_s],
            outputs=[self.energies],
        )
        self.load.zero_()
        launch(
            kernels.weigh,
            contact_count,
            inputs=[*which, contacts.efc_address, d.efc.force, *about],
            outputs=[self.load],
        )

    def download(self, bodies: WarpBodies) -> None:
        bodies.qpos[:], bodies.qvel[:] = self.data.qpos.numpy(), self.data.qvel.numpy()
        bodies.current_a[:], bodies.pwm[:] = self.current.numpy(), self.pwm.numpy()
        bodies.energies_j[:], bodies.totals[:] = self.energies.numpy(), self.totals.numpy()

    def memory(self) -> tuple[Floats, Floats]:
        """Loads of the links, and their centres, of the last step."""
        return self.load.numpy().astype(float), self.before.numpy().astype(float)
