"""Every phase with every command and every event: the whole table, spelled out a second time and compared."""

from __future__ import annotations

import pytest

from rcilab.core.state import RobotMode
from rcilab.makers.rokae.controller.state_machine import (
    ANYTIME,
    GROUNDED,
    POWER_OFF,
    QUERIES,
    REMEDIES,
    TABLE,
    Action,
    Event,
    Phase,
    When,
    as_text,
    transition,
)
from rcilab.makers.rokae.wire import CommandCode, StopStatus

# Rows: what happens. Columns: where. A cell: the phase afterwards ("=" is the same), and the status that is answered.
PHASES = "OFF IDLE STARTING MOVING STOPPING GUIDING REFLEX CUT_OFF USER_STOPPED RECOVERING".split()
MATRIX = """
START_MOVE   =,3 STARTING,0 =,3 =,3 =,3 =,3 =,6 =,6 =,7 =,3
STOP_MOVE    =,0 =,0 IDLE,0 STOPPING,0 =,0 =,0 =,0 =,0 =,0 =,0
START_DRAG   =,1 GUIDING,0 =,1 =,1 =,1 =,1 =,1 =,1 =,1 =,1
STOP_DRAG    =,0 =,0 =,0 =,0 =,0 IDLE,0 =,0 =,0 =,0 =,0
SET_MOTOR_POWER IDLE,0 =,0 =,0 =,0 =,0 =,0 =,0 =,1 =,1 =,0
AUTOMATIC_ERROR_RECOVERY =,0 =,0 =,1 =,1 =,1 =,1 RECOVERING,0 OFF,0 =,4 =,1
REBOOT_ROBOT =,0 OFF,0 =,1 =,1 =,1 =,1 OFF,0 OFF,0 =,0 =,1
GROUNDED     =,0 =,0 =,1 =,1 =,1 =,1 =,1 =,1 =,1 =,1
REMEDIES     =,0 =,0 =,1 =,1 =,1 =,1 =,0 =,0 =,1 =,1
ANYTIME      =,0 =,0 =,0 =,0 =,0 =,0 =,0 =,0 =,0 =,0
QUERIES      =,- =,- =,- =,- =,- =,- =,- =,- =,- =,-
MODES_SHOWN  = = MOVING = = = = = = =
FAULT        = REFLEX REFLEX REFLEX REFLEX REFLEX REFLEX = = REFLEX
JOINT_LIMIT  = CUT_OFF CUT_OFF CUT_OFF CUT_OFF CUT_OFF CUT_OFF CUT_OFF = CUT_OFF
AT_REST      = = = = IDLE = = = = =
RECOVERED    = = = = = = = = = IDLE
CLIENT_LOST  = = IDLE STOPPING STOPPING IDLE = = = =
SAFETY_STOP  USER_STOPPED USER_STOPPED USER_STOPPED USER_STOPPED USER_STOPPED USER_STOPPED USER_STOPPED USER_STOPPED = USER_STOPPED
SAFETY_RELEASE = = = = = = = = OFF =
"""  # noqa: E501
GROUPS = {"GROUNDED": GROUNDED, "REMEDIES": REMEDIES, "ANYTIME": ANYTIME, "QUERIES": QUERIES}


def expected() -> dict[tuple[Phase, CommandCode | Event], tuple[Phase, str]]:
    cells: dict[tuple[Phase, CommandCode | Event], tuple[Phase, str]] = {}
    for line in MATRIX.strip().splitlines():
        name, *entries = line.split()
        events = [Event[name]] if name in Event.__members__ else GROUPS.get(name) or [CommandCode[name]]
        for phase_name, entry in zip(PHASES, entries, strict=True):
            after, _, status = entry.partition(",")
            phase = Phase[phase_name]
            for event in events:
                cells[phase, event] = (phase if after == "=" else Phase[after], status.strip("-"))
    return cells


EXPECTED = expected()


def test_the_table_holds_every_pair() -> None:
    assert set(TABLE) == {(phase, trigger) for phase in Phase for trigger in (*CommandCode, *Event)} == set(EXPECTED)
    assert [phase.name for phase in Phase] == PHASES
    assert len(as_text().splitlines()) == 10 * (25 + 8)


@pytest.mark.parametrize("pair", list(EXPECTED), ids=lambda pair: f"{pair[0].name}-{pair[1].name}")
def test_each_pair_leads_where_it_should_and_answers_what_it_should(pair) -> None:
    cell = transition(*pair)
    status = "" if cell.status is None else str(int(cell.status))
    assert (cell.phase, status) == EXPECTED[pair]


@pytest.mark.parametrize("phase", Phase)
def test_stop_move_succeeds_everywhere_and_at_rest_unless_a_hand_leads_the_arm(phase: Phase) -> None:
    cell = transition(phase, CommandCode.STOP_MOVE)
    when = When.NOW if phase is Phase.GUIDING else When.AT_REST
    assert (cell.status, cell.when) == (StopStatus.SUCCESS, when)


@pytest.mark.parametrize("phase", Phase)
def test_power_off_is_obeyed_everywhere(phase: Phase) -> None:
    cell = POWER_OFF[phase]
    assert cell.status == 0
    assert cell.phase is (phase if phase is Phase.USER_STOPPED else Phase.OFF)


def test_whatever_leaves_a_motion_hides_its_modes_and_forgets_or_drains_its_commands() -> None:
    """Before the modes are shown, what stops the arm shows them with the bit: the vendor's client waits for them."""
    cells = [*TABLE.items(), *(((phase, None), cell) for phase, cell in POWER_OFF.items())]
    for (phase, _), cell in cells:
        if phase in (Phase.STARTING, Phase.MOVING) and cell.phase not in (Phase.STARTING, Phase.MOVING):
            is_surprise = phase is Phase.STARTING and Action.SET_FAULTS in cell.actions
            assert (Action.REVEAL_MODES if is_surprise else Action.HIDE_MODES) in cell.actions
            assert {Action.DISCARD, Action.DRAIN} & {*cell.actions}


def test_modes_that_were_revealed_are_hidden_by_all_that_leads_on() -> None:
    for (_, trigger), cell in TABLE.items():
        is_stop = trigger is CommandCode.STOP_MOVE
        if is_stop or Action.CLEAR_FAULTS in cell.actions:
            assert Action.HIDE_MODES in cell.actions


def test_what_is_queued_is_played_no_longer_than_the_stop_takes() -> None:
    cells = [*TABLE.items(), *(((phase, None), cell) for phase, cell in POWER_OFF.items())]
    for (phase, _), cell in cells:
        if phase is Phase.STOPPING and cell.phase is not Phase.STOPPING:
            assert Action.DISCARD in cell.actions


def test_only_the_delay_after_start_move_leads_into_a_motion() -> None:
    into = {(phase, trigger) for (phase, trigger), cell in TABLE.items() if cell.phase is Phase.MOVING != phase}
    assert into == {(Phase.STARTING, Event.MODES_SHOWN)}


def test_faults_are_cleared_only_by_recovery_power_and_reboot() -> None:
    clearing = {trigger for (_, trigger), cell in TABLE.items() if Action.CLEAR_FAULTS in cell.actions}
    assert clearing == {
        Event.RECOVERED,
        CommandCode.SET_MOTOR_POWER,
        CommandCode.REBOOT_ROBOT,
        CommandCode.AUTOMATIC_ERROR_RECOVERY,
    }


def test_each_phase_reports_a_robot_mode() -> None:
    modes = {phase.name: phase.robot_mode for phase in Phase}
    assert modes["MOVING"] is modes["STOPPING"] is RobotMode.MOVE
    assert modes["STARTING"] is modes["IDLE"] is RobotMode.IDLE
    assert set(modes.values()) == set(RobotMode)
