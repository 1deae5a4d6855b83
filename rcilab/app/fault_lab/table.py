"""The faults of a maker's arms that the fault lab can provoke."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rcilab.core.fault import FaultCode
from rcilab.i18n.translator import Message, message
from rcilab.makers.maker import maker_of
from rcilab.makers.scenario import GROUPS, FaultScenario, Group
from rcilab.model.robot_model import RobotModel


class FaultTable(Mapping[FaultCode, FaultScenario]):
    """Scenarios by fault; `print` shows them as a table.

    Args:
        model: The arm; an arm without a virtual controller has no scenarios.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        maker = maker_of(model)
        scenarios = () if maker is None else maker.scenarios(model)
        self._scenarios = {scenario.fault: scenario for scenario in scenarios}

    def __getitem__(self, fault: FaultCode) -> FaultScenario:
        return self._scenarios[fault]

    def __iter__(self) -> Iterator[FaultCode]:
        return iter(self._scenarios)

    def __len__(self) -> int:
        return len(self._scenarios)

    def obstacle(self, fault: FaultCode | None) -> Message | None:
        """Returns why a fault cannot be provoked on this arm; None if it can."""
        if fault is None or fault not in self:
            return message("learn.no_scenario" if self else "learn.no_scenarios", model=self._model.name)
        if self[fault].needs_elbow and not self._model.redundancy:
            return message("learn.no_elbow", model=self._model.name)
        return None

    @property
    def groups(self) -> tuple[Group, ...]:
        """The groups that have scenarios, in display order."""
        return tuple(group for group in GROUPS if self.group(group))

    def group(self, group: Group) -> tuple[FaultScenario, ...]:
        """Returns the scenarios of a group, in display order."""
        return tuple(scenario for scenario in self.values() if scenario.group == group)

    def __str__(self) -> str:
        return "\n".join(
            f"{group}\n"
            + "\n".join(f"  {found.fault.value:2} {found.fault.manual_name}" for found in self.group(group))
            for group in self.groups
        )

    def __repr__(self) -> str:
        return f"<FaultTable of {len(self)} faults: print it, or fault_lab.provoke(name)>"
