"""Programs with franky, each of which returns what it saw. They run in a process of their own.

franky and pylibfranka both register libfranka's types with pybind11, so that the second of them cannot be imported.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import franky
import numpy as np

FACTOR = 0.14  # Of franky's limits, which are the Panda's: with more, poses accelerate joint 4 beyond the FR3's bound.


def open_robot(host: str) -> franky.Robot:
    return franky.Robot(host, realtime_config=franky.RealtimeConfig.Ignore, relative_dynamics_factor=FACTOR)


def angles(robot: franky.Robot) -> np.ndarray:
    return np.array(robot.current_joint_state.position)


def pose(robot: franky.Robot) -> np.ndarray:
    return np.array(robot.current_cartesian_state.pose.end_effector_pose.matrix)


def place(robot: franky.Robot) -> np.ndarray:
    return pose(robot)[:3, 3]


def run_for(robot: franky.Robot, motion: Any, seconds: float) -> None:
    """Runs a motion that does not end by itself, and stops it."""
    robot.move(motion, asynchronous=True)
    time.sleep(seconds)
    robot.stop()
    try:
        robot.join_motion()
    except franky.ControlException as error:
        if "preempted" not in str(error):
            raise


def joint_waypoints(host: str, goals: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Returns where the arm was after each motion."""
    robot, found = open_robot(host), []
    for goal in goals:
        robot.move(franky.JointWaypointMotion([franky.JointWaypoint(goal)]))
        found.append(angles(robot))
    return found


def joint_velocities(host: str, rates: Sequence[Sequence[float]], hold: int) -> list[np.ndarray]:
    """Returns the displacements of the joints; `hold` is in milliseconds."""
    robot, found = open_robot(host), []
    for rate in rates:
        before = angles(robot)
        waypoint = franky.JointVelocityWaypoint(rate, hold_target_duration=franky.Duration(hold))
        robot.move(franky.JointVelocityWaypointMotion([waypoint]))
        found.append(angles(robot) - before)
    return found


def poses(host: str, steps: Sequence[Sequence[float]]) -> list[np.ndarray]:
    """Moves the tool to the start plus each step, in base; returns the displacements from the start."""
    robot, found = open_robot(host), []
    start = pose(robot)
    for step in steps:
        goal = start.copy()
        goal[:3, 3] += step
        robot.move(franky.CartesianMotion(franky.Affine(goal), franky.ReferenceType.Absolute))
        found.append(pose(robot) - start)
    return found


def tool_velocities(host: str, rates: Sequence[Sequence[float]], hold: int) -> list[np.ndarray]:
    """Returns the displacements of the tool."""
    robot, found = open_robot(host), []
    for rate in rates:
        before = place(robot)
        waypoint = franky.CartesianVelocityWaypoint(franky.Twist(rate), hold_target_duration=franky.Duration(hold))
        robot.move(franky.CartesianVelocityWaypointMotion([waypoint]))
        found.append(place(robot) - before)
    return found


def joint_impedance(host: str, goal: np.ndarray) -> np.ndarray:
    robot = open_robot(host)
    run_for(robot, franky.JointImpedanceMotion(goal), 1.0)
    return angles(robot)


def cartesian_impedance(host: str, step: Sequence[float]) -> np.ndarray:
    """Returns how far the tool is from the start plus a step."""
    robot = open_robot(host)
    goal = pose(robot)
    goal[:3, 3] += step
    run_for(robot, franky.CartesianImpedanceMotion(franky.Affine(goal)), 1.0)
    return pose(robot) - goal


def posture(host: str, step: np.ndarray, stiffness: np.ndarray | float, seconds: float) -> dict[str, np.ndarray]:
    """Holds the tool and pulls the joints towards the start plus a step."""
    robot = open_robot(host)
    q, T = angles(robot), pose(robot)
    task = franky.PostureTask(q + step, stiffness)
    motion = franky.CartesianImpedanceMotion(franky.Affine(T), posture_task=task)
    gains = np.array(motion.get_nullspace_gains().posture_stiffness)
    run_for(robot, motion, seconds)
    return {"joints": angles(robot) - q, "tool": pose(robot) - T, "gains": gains}


def joint_tracker(host: str, goal: np.ndarray) -> np.ndarray:
    robot = open_robot(host)
    with franky.JointImpedanceTracker(robot, period=0.01) as tracker:
        tracker.set_target(goal)
        for _ in range(100):
            assert tracker.tick()
    return angles(robot)


def cartesian_tracker(host: str, step: Sequence[float]) -> np.ndarray:
    """Returns how far the tool is from the start plus a step."""
    robot = open_robot(host)
    goal = pose(robot)
    goal[:3, 3] += step
    with franky.CartesianImpedanceTracker(robot, period=0.01) as tracker:
        tracker.set_target(franky.Affine(goal))
        for _ in range(100):
            assert tracker.tick()
    return pose(robot) - goal


def torques(host: str, torque: np.ndarray) -> dict[str, np.ndarray]:
    """Renews a torque for a second; the time-out is longer than a busy machine is late."""
    robot = open_robot(host)
    q = angles(robot)
    motion = franky.SimpleTorqueMotion(signal_timeout=1.0)
    robot.move(motion, asynchronous=True)
    for _ in range(60):
        motion.set_torque(torque)
        time.sleep(0.01)
    held = np.array(motion.get_torque())
    robot.move(franky.TorqueStopMotion(), asynchronous=True)
    robot.join_motion()
    return {"joints": angles(robot) - q, "held": held}


def held_torque(host: str, torque: np.ndarray) -> np.ndarray:
    """Returns the displacements of the joints by a torque that is given once."""
    robot = open_robot(host)
    q = angles(robot)
    robot.move(franky.SimpleTorqueMotion(initial_torque=torque, signal_timeout=None), asynchronous=True)
    time.sleep(0.6)
    robot.move(franky.TorqueStopMotion(), asynchronous=True)
    robot.join_motion()
    return angles(robot) - q


def forgotten_torque(host: str) -> str:
    """Returns the name of the error of torques that are not renewed."""
    robot = open_robot(host)
    robot.move(franky.SimpleTorqueMotion(), asynchronous=True)
    try:
        robot.join_motion()
    except franky.TorqueSignalTimeoutException as error:
        return type(error).__name__
    return ""


def callbacks(host: str, hold: int) -> np.ndarray:
    """Returns time and duration of each cycle of a motion, as its callback has them, shape (N, 2), [ms]."""
    robot, rows = open_robot(host), []

    def callback(_state: Any, step: Any, since_start: Any, _time: Any, _signal: Any) -> None:
        rows.append((since_start.to_msec(), step.to_msec()))

    waypoint = franky.JointVelocityWaypoint([0.01] + [0.0] * 6, hold_target_duration=franky.Duration(hold))
    motion = franky.JointVelocityWaypointMotion([waypoint])
    motion.register_callback(callback)
    robot.move(motion)
    count = -1
    while len(rows) != count:  # They are called in a thread of their own.
        count = len(rows)
        time.sleep(0.2)
    return np.array(rows)


def reused_motion(host: str, near: np.ndarray, home: np.ndarray) -> list[str]:
    """Returns the errors of a motion that is run again, at standstill and instead of another one."""
    robot, errors = open_robot(host), []
    used = franky.JointWaypointMotion([franky.JointWaypoint(near)])
    robot.move(used)
    other = franky.JointWaypointMotion([franky.JointWaypoint(home)])
    for is_moving in (False, True):
        if is_moving:
            robot.move(other, asynchronous=True)
        try:
            robot.move(used, asynchronous=is_moving)
        except franky.MotionReuseException as error:
            errors.append(type(error).__name__)
    robot.join_motion()
    robot.move(franky.JointWaypointMotion([franky.JointWaypoint(near)]))
    return errors


def hand_homing(host: str) -> tuple[bool, float, float, float]:
    """Returns the answer, the width before and after, and the largest."""
    hand = franky.Gripper(host)
    before = hand.width
    return hand.homing(), before, hand.width, hand.max_width


def hand_widths(host: str, widths: Sequence[float]) -> list[tuple[bool, float]]:
    hand = franky.Gripper(host)
    return [(hand.move(width, 0.1), hand.width) for width in widths]


def hand_grasp(host: str, width: float, outer: float) -> tuple[str, bool]:
    """Returns the outcome of a grasp from open fingers, and whether they hold something."""
    hand = franky.Gripper(host)
    hand.move(0.08, 0.1)
    try:
        outcome = str(hand.grasp(width, 0.1, 10.0, epsilon_inner=0.005, epsilon_outer=outer))
    except franky.CommandException as error:
        outcome = type(error).__name__
    return outcome, hand.is_grasped


def hand_stop(host: str) -> tuple[bool, bool]:
    hand = franky.Gripper(host)
    return hand.stop(), hand.is_grasped
