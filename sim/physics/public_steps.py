"""The steps of a plant through MuJoCo's public interface: slower than compiled, same bits.

``step_forces`` computes the forces; contacts and constraint forces are copied from MuJoCo in every
step.
"""

import mujoco
import numpy as np

from snakewalk.drivers.compiling import compiled_when_called
from snakewalk.sim.physics.friction import make_lanes
from snakewalk.sim.physics.mechanics import Mechanics
from snakewalk.sim.physics.step_forces import apply_forces, has_friction, settle
from snakewalk.sim.physics.step_state import (
    Body,
    Chain,
    ContactFields,
    Contacts,
    Gears,
    Geoms,
    Law,
    Links,
    Motors,
    Shafts,
    State,
)
from snakewalk.sim.plant import ServoDrive

_FIELD_PLACES = ContactFields(size=9, dist=0, place=1, normal=4, geom=14, row=16)
"""Fields of a copied contact; geoms and row are integers in its last two words."""

_apply = compiled_when_called(apply_forces)

_settle = compiled_when_called(settle)


class PublicSteps:
    """Drive, friction and MuJoCo's step, with Python between them."""

    def __init__(self, mechanics: Mechanics) -> None:
        self._mechanics = mechanics
        model = mechanics.model
        data = mechanics.data
        links = mechanics.joint_count + 1
        self._state = State(data.qpos, data.qvel, data.qfrc_applied)
        self._chain = Chain(data.xipos, data.xmat, data.xanchor, data.xaxis, model.body_parentid)
        self._links = Links(
            np.zeros((links, 3)),
            np.zeros((links, 3)),
            np.zeros((links, 6)),
            np.zeros(links),
            mechanics.before_m,
            mechanics.load_n,
            mechanics.link_mass_kg,
            mechanics.water,
        )
        self._geoms = Geoms(model.geom_bodyid, mechanics.contact_role)
        self._gears = Gears(
            mechanics.gears,
            model.dof_frictionloss,
            data.qfrc_bias,
            data.qfrc_constraint,
            mechanics.rotor,
            model.dof_armature,
        )
        self._rubs = has_friction(mechanics.gears)
        self._work = np.zeros((2, links - 1))
        self._lanes = make_lanes(2 * mechanics.joint_count)

    def run(self, steps: int, drive: ServoDrive) -> float:
        """Advance ``steps`` steps; return MuJoCo's time."""
        mechanics = self._mechanics
        data = self._mechanics.data
        body = self._body()
        shafts = Shafts(Motors(*drive.columns()), self._gears, self._work)
        for _ in range(steps):
            mechanics.planes.lay(data)
            mujoco.mj_step1(mechanics.model, data)
            contacts = self._contacts()
            _apply(body, shafts, contacts, self._lanes)
            mujoco.mj_step2(mechanics.model, data)
            _settle(
                body,
                shafts,
                contacts,
                np.ascontiguousarray(self._mechanics.data.efc_force),
                self._rubs,
            )
        return float(data.time)

    def _body(self) -> Body:
        m = self._mechanics
        law = Law(m.mu, float(m.radius_m), m.step_s, m.spine_links)
        return Body(self._state, self._chain, self._links, self._geoms, law, m.totals)

    def _contacts(self) -> Contacts:
        contact = self._mechanics.data.contact
        count = len(contact.dist)
        reals = np.zeros((count, _FIELD_PLACES.size))
        reals[:, _FIELD_PLACES.dist], reals[:, 1:4], reals[:, 4:7] = (
            contact.dist,
            contact.pos,
            contact.frame[:, :3],
        )
        integers = reals.view(np.int32)
        integers[:, _FIELD_PLACES.geom : _FIELD_PLACES.geom + 2] = contact.geom
        integers[:, _FIELD_PLACES.row] = contact.efc_address
        if count > len(self._lanes[1]):
            self._lanes = make_lanes(count)
        return Contacts(reals.ravel(), integers.ravel(), count, _FIELD_PLACES)
