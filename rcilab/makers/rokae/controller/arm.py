"""The arm as the controller has it: where it is told to be, what drives it, and what its sensors say."""

from __future__ import annotations

from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.makers.rokae.controller.actuator import Actuator, ControlLaw
from rcilab.makers.rokae.controller.measured_state import MeasuredStateMonitor
from rcilab.makers.rokae.controller.reporter import CycleSignals
from rcilab.makers.rokae.controller.settings import Settings
from rcilab.model.robot_model import RobotModel
from rcilab.sim.plant import Measurement, Plant, Setpoint
from rcilab.sim.reference_trajectory import ReferenceTrajectory
from rcilab.sim.tool_kinematics import ToolKinematics

STANDSTILL = 1e-4  # [rad/s] Below it every joint stands, 0.006 deg/s; a choice.
SETTLE_LIMIT = 300  # [cycles] How long one waits for an arm that something keeps from where it was told; a choice.


class Arm:
    """Commanded motion, plant and sensors, moved together one cycle at a time. Owned by the controller's cycle.

    Attributes:
        model: The arm with the tool and load that were set.
        plant: What moves.
        commanded: The commanded joint angles.
        tool_c: The tool on them.
        watch: The sensors.
        yielded_as: The law under which the arm yielded last, until commands have moved it on its servos; None: none.

    Args:
        model: The arm.
        plant: What moves.
        settings: What the client has set.
    """

    def __init__(self, model: RobotModel, plant: Plant, settings: Settings) -> None:
        self.model = model
        self.plant = plant
        measured = plant.reset(model.home)
        q = measured.q.tolist()
        self.commanded = ReferenceTrajectory(model.limits.joint, q)
        self.tool_c = ToolKinematics(model, q)
        self.watch = MeasuredStateMonitor(model, measured)
        self.actuator = Actuator(model, settings)
        self._tool_version = self.commanded.version
        self._law = ControlLaw.BRAKED
        self.yielded_as: ControlLaw | None = None
        self._dq_before = measured.dq
        self._standing = 0
        self._setpoint: Setpoint | None = None

    @property
    def stands(self) -> bool:
        """Whether it was told to stay where it is, and its joints have come to a standstill."""
        return self.commanded.is_at_rest and (self._standing > SETTLE_LIMIT or self._is_slow())

    @property
    def may_be_braked(self) -> bool:
        """Whether it was told to stay where it is and does: servos settle, and a yielding arm moves in any case."""
        may_rest = self.commanded.is_at_rest and not self._law.yields
        return may_rest and (self._standing > SETTLE_LIMIT or self.watch.measured.q.tolist() == self.commanded.q)

    def has_settled(self, law: ControlLaw) -> bool:
        """Returns whether nothing here counts time any more, and the law is the one it has stood under."""
        return self._standing > SETTLE_LIMIT and law is self._law

    def reset(self, q: JointVector) -> None:
        """Puts the resting arm somewhere else."""
        measured = self.plant.reset(readonly_copy(q))
        self.commanded.place(measured.q.tolist())
        self.tool_c.place(self.commanded.q)
        self._tool_version = self.commanded.version
        self._dq_before = measured.dq
        self.watch.configure(self.model, measured)

    def configure(self, settings: Settings) -> None:
        """Takes new settings; another tool or load only at rest."""
        tool, load = settings.T_flange_tool, settings.load
        if tool is not self.model.T_flange_tool or load is not self.model.load:
            self.model = self.model.with_tool(tool).with_load(load)
            self.plant.configure(self.model)
            measured = self.plant.reset(self.watch.measured.q)
            self.tool_c = ToolKinematics(self.model, self.commanded.q)
            self._dq_before = measured.dq
            self.watch.configure(self.model, measured)
        self.actuator.configure(self.model, settings)

    def move(self, law: ControlLaw, tau: list[float] | None, *, has_moved: bool) -> None:
        """Lives through one millisecond: the reference goes on, the plant moves, the sensors are read.

        Args:
            law: How the reference becomes a setpoint. When an arm that yielded is not to yield any more, the
                reference starts anew from where the arm is and how it moves.
            tau: Commanded torques, [N m]; None when none are commanded.
            has_moved: Whether the commanded angles are those of this cycle already; otherwise they come to rest.
        """
        commanded, last = self.commanded, self.watch.measured
        if self._law.yields and not law.yields:
            ddq: list[float] = ((last.dq - self._dq_before) / CYCLE_TIME).tolist()
            commanded.join(last.q.tolist(), last.dq.tolist(), ddq)
        if has_moved and not law.yields:
            self.yielded_as = None
        if not (law.leads or commanded.is_at_rest or has_moved):
            commanded.come_to_rest()
        if not law.leads:
            self._move_tool()
        self._setpoint = self.actuator.setpoint(law, commanded, self.tool_c, last, tau)
        self._take(law, self.plant.step(self._setpoint))

    def stay(self) -> bool:
        """Lives through one millisecond of an arm that stands still; returns whether it still does.

        Only after a cycle whose readings were those of the one before, and `has_settled`: then `move` would come to the
        setpoint of that cycle, and to the same readings, unless the plant measures something else.
        """
        assert self._setpoint is not None
        measured = self.plant.step(self._setpoint)
        if measured is self.watch.measured:
            return True
        self._take(self._law, measured)
        return False

    def read(self, tau: list[float] | None) -> CycleSignals:
        """Returns what this cycle came to; `tau` are commanded torques, [N m], or None."""
        watch = self.watch
        return CycleSignals(self.commanded, self.tool_c, watch.measured, watch.tool, tau, watch.tau_ext, watch.wrench)

    def _take(self, law: ControlLaw, measured: Measurement) -> None:
        """Takes what the plant has come to in this cycle."""
        commanded, last = self.commanded, self.watch.measured
        if law.leads:
            commanded.move(measured.q.tolist())
            self._move_tool()
        elif law is ControlLaw.BRAKED and measured.q.tolist() != commanded.q:
            commanded.place(measured.q.tolist())
            self._move_tool()
        self._law, self._dq_before = law, last.dq
        if law.yields:
            self.yielded_as = law
        self._standing = self._standing + 1 if commanded.is_at_rest else 0
        self.watch.observe(measured, commanded, self.tool_c)

    def _is_slow(self) -> bool:
        speeds: list[float] = self.watch.measured.dq.tolist()
        return -STANDSTILL < min(speeds) and max(speeds) < STANDSTILL

    def _move_tool(self) -> None:
        commanded, tool = self.commanded, self.tool_c
        if commanded.version != self._tool_version or not tool.is_at_rest:
            q, dq, _ = commanded.arrays
            tool.update(commanded.q, self.model.rigid_body.tool_motion(q, dq))
            self._tool_version = commanded.version
