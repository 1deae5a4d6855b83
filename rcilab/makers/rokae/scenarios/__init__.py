"""The twenty faults of the RCI, each provoked by the shortest stream of commands, or a push, that raises it."""

from __future__ import annotations

from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.scenarios.command_faults import COMMAND_SCENARIOS
from rcilab.makers.rokae.scenarios.measured_faults import MEASURED_SCENARIOS
from rcilab.makers.scenario import FaultScenario


def _order(scenario: FaultScenario) -> tuple[int, bool]:
    """Order of scenarios: measured values follow commanded ones of the same quantity."""
    name = scenario.fault.name.removeprefix("ACTUAL_").removeprefix("COMMAND_")
    first = min(fault for fault in Fault if fault.name.endswith(name))
    return int(first), scenario.fault.name.startswith("ACTUAL_")


SCENARIOS = tuple(sorted((*COMMAND_SCENARIOS, *MEASURED_SCENARIOS), key=_order))
"""Every fault once, in display order."""
