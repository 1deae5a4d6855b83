"""The gallery's wall: every fault with its recipe, in wire order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rcilab.app.fault_lab.command_faults import COMMAND_RECIPES
from rcilab.app.fault_lab.measured_faults import ARM_RECIPES
from rcilab.app.fault_lab.scenario import GROUPS, FaultScenario, Group
from rcilab.makers.rokae.faults import Fault


class FaultTable(Mapping[Fault, FaultScenario]):
    """Recipes by fault; `print` shows it as a table."""

    def __init__(self, *recipes: FaultScenario) -> None:
        self._recipes = {recipe.fault: recipe for recipe in sorted(recipes, key=lambda recipe: recipe.fault)}

    def __getitem__(self, fault: Fault) -> FaultScenario:
        return self._recipes[fault]

    def __iter__(self) -> Iterator[Fault]:
        return iter(self._recipes)

    def __len__(self) -> int:
        return len(self._recipes)

    def group(self, group: Group) -> tuple[FaultScenario, ...]:
        """Returns the recipes of a group, in wire order."""
        return tuple(recipe for recipe in self.values() if recipe.group == group)

    def __str__(self) -> str:
        return "\n".join(
            f"{group}\n"
            + "\n".join(f"  {recipe.fault.value:2} {recipe.fault.manual_name}" for recipe in self.group(group))
            for group in GROUPS
        )

    def __repr__(self) -> str:
        return f"<FaultTable of {len(self)} faults: print it, or fault_lab.provoke(name)>"


FAULTS = FaultTable(*COMMAND_RECIPES, *ARM_RECIPES)
