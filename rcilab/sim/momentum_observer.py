"""External forces on the arm, estimated from its own sensors and model: the generalised-momentum observer.

The residual r of De Luca and Mattone (2003), dr/dt = K (tau_ext - r), needs no acceleration sensor. In discrete time
it is a first-order low-pass filter of the unmodelled torque: M (dq - dq_before)/h + C dq + g - tau.

Signs: tau_ext and the wrench are exerted by the environment on the arm. A hand that presses the tool down gives a
negative z force. The wrench is the one at the tool that explains tau_ext best; if the force acts on another link,
tau_ext is correct and the wrench is not.
"""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import Array, JointVector, make_readonly, readonly_copy, scalar
from rcilab.core.clock import CYCLE_TIME
from rcilab.model.robot_model import RobotModel
from rcilab.sim.plant import Measurement

BANDWIDTH = 200.0  # [rad/s] of the residual: time constant of 5 ms for a push
_CYCLE = scalar(CYCLE_TIME)  # [s]
_SHARE = BANDWIDTH * CYCLE_TIME / (1.0 + BANDWIDTH * CYCLE_TIME)  # of the difference, in one cycle
_GAIN = scalar(_SHARE)
_SMALLEST_TORQUE = 1e-6  # [N m] A smaller residual is rounding and set to zero.
_DAMPING = 2.5e-5 * np.eye(6)  # [m^2, rad^2] keeps the wrench finite at a singularity


class MomentumObserver:
    """Estimates external torques cycle by cycle. Owned by the virtual arm.

    Args:
        model: The controller's model of the arm: a load that was not set appears as an external torque.
    """

    def __init__(self, model: RobotModel) -> None:
        self._body = model.rigid_body
        self._zeros = readonly_copy(np.zeros(model.n))
        self._no_force = (self._zeros, readonly_copy(np.zeros(6)))
        self._last: Measurement | None = None
        self._is_static = True
        self._result = self._no_force
        self._raw = self._zeros

    def reset(self, measured: Measurement) -> None:
        """Resets the estimate for a stationary arm."""
        self._last, self._is_static = measured, True
        self._raw = self._unmodelled_torque(measured, self._zeros)
        self._result = self._estimate(self._raw, measured)

    def step(self, measured: Measurement) -> tuple[JointVector, Array]:
        """Returns external joint torques, shape (n,), [N m], and the wrench on the tool, base axes, shape (6,).

        The wrench refers to the tool's origin, force first, [N, N m]. Both arrays are read-only; they are the same
        objects as long as nothing changes.
        """
        last = self._last
        if last is None:
            self.reset(measured)
            return self._result
        if measured is not last:
            self._raw = self._unmodelled_torque(measured, (measured.dq - last.dq) / _CYCLE)
            self._last, self._is_static = measured, False
        elif not self._is_static:  # The same measurement again: its velocity has not changed.
            self._raw = self._unmodelled_torque(measured, self._zeros)
            self._is_static = True
        tau_ext = self._result[0]
        if tau_ext is self._raw:
            return self._result
        step = _GAIN * (self._raw - tau_ext)
        has_converged = _is_tiny(step, _SHARE * _SMALLEST_TORQUE)
        self._result = self._estimate(self._raw if has_converged else make_readonly(tau_ext + step), measured)
        return self._result

    def _unmodelled_torque(self, measured: Measurement, ddq: JointVector) -> JointVector:
        raw = self._body.full_torque(measured.q, measured.dq, ddq)
        raw -= measured.tau
        return self._zeros if _is_tiny(raw, _SMALLEST_TORQUE) else make_readonly(raw)

    def _estimate(self, tau_ext: JointVector, measured: Measurement) -> tuple[JointVector, Array]:
        if tau_ext is self._zeros:
            return self._no_force
        J = self._body.tool_terms(measured.q, measured.dq).jacobian
        return tau_ext, make_readonly(self._body.tool_solver.solve(J.dot(J.T) + _DAMPING, J.dot(tau_ext)))


def _is_tiny(vector: Array, bound: float) -> bool:
    values = vector.tolist()
    return -bound < values[0] < bound and -bound < min(values) and max(values) < bound  # The first decides most cases.
