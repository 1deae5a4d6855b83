"""The fault gallery: each of the twenty faults, really provoked on a private virtual controller.

    from rcilab.app import fault_lab
    print(fault_lab.FAULTS)
    exhibit = fault_lab.provoke("kCommandJointVelocityLimitsViolation")
    print(exhibit)                                     # what was sent, why it is a fault, what to do, how to leave it
    with fault_lab.FaultLab("xMatePro7") as booth:          # several on one controller
        exhibits = [booth.provoke(fault) for fault in fault_lab.FAULTS]

Nothing is made up: real commands go through the real client to a controller that nobody else is connected to.
"""

from __future__ import annotations

from rcilab.app.fault_lab.fault_demo import FaultDemo
from rcilab.app.fault_lab.lab import FaultLab
from rcilab.app.fault_lab.scenario import GROUPS, FaultScenario, Group
from rcilab.app.fault_lab.table import FAULTS, FaultTable
from rcilab.makers.rokae.faults import Fault

__all__ = ["FAULTS", "GROUPS", "FaultDemo", "FaultLab", "FaultScenario", "FaultTable", "Group", "provoke"]


def provoke(fault: Fault | str, model: str = "xMatePro7") -> FaultDemo:
    """Provokes one fault on a private virtual controller and returns what it reported.

    Args:
        fault: A fault, or its name as the manual prints it.
        model: Name of the arm.

    Raises:
        InvalidValueError: There is no such fault; the message lists those that exist.
        UsageError: This arm cannot have this fault.
    """
    with FaultLab(model) as booth:
        return booth.provoke(fault)
