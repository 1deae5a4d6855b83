"""The fault lab: every fault of a maker's arms, provoked for real on a private virtual controller.

    from rcilab.app import fault_lab
    print(fault_lab.FaultTable(rcilab.load_model("xMatePro7")))
    demo = fault_lab.provoke("kCommandJointVelocityLimitsViolation", "xMatePro7")
    print(demo)                                     # What was sent, why it is a fault, the remedy, the recovery.
    with fault_lab.FaultLab("xMatePro7") as lab:       # Several faults on one controller.
        demos = [lab.provoke(fault) for fault in lab.faults]

The commands are sent by the real client to a controller without any other client.
"""

from __future__ import annotations

from rcilab.app.fault_lab.fault_demo import FaultDemo
from rcilab.app.fault_lab.lab import FaultLab
from rcilab.app.fault_lab.table import FaultTable
from rcilab.core.fault import FaultCode
from rcilab.makers.scenario import FaultScenario, Group

__all__ = ["FaultDemo", "FaultLab", "FaultScenario", "FaultTable", "Group", "provoke"]


def provoke(fault: FaultCode | str, model: str) -> FaultDemo:
    """Provokes one fault on a private virtual controller and returns what it reported.

    Args:
        fault: A fault, or its name as the manual prints it.
        model: Name of the arm.

    Raises:
        InvalidValueError: There is no such fault; the message lists the valid ones.
        UsageError: This arm cannot have this fault.
    """
    with FaultLab(model) as lab:
        return lab.provoke(fault)
