"""Checks of the kernel: preemption, SCHED_FIFO, locked memory, real-time throttling."""

from __future__ import annotations

import re

from rcilab.diagnostics.doctor.finding import Finding
from rcilab.diagnostics.doctor.system import System

_REAL_TIME_KERNEL = (
    "good for the virtual controller; for a real arm install a PREEMPT_RT kernel (RCI manual 2.2; Debian: sudo apt-get "
    "install linux-image-rt-$(dpkg --print-architecture); Ubuntu: sudo pro enable realtime-kernel) and reboot"
)
_FULL_PREEMPTION = (
    "boot with preempt=full on the kernel's command line (/etc/default/grub, then sudo update-grub), or, until the "
    "next boot, echo full | sudo tee /sys/kernel/debug/sched/preempt"
)
_USER_LIMITS = (
    "add '@realtime - rtprio 99' and '@realtime - memlock unlimited' to /etc/security/limits.conf, then sudo groupadd "
    "-f realtime, sudo usermod -aG realtime $USER, and log in again"
)
_RUNTIME = "kernel.sched_rt_runtime_us"
_UNTHROTTLED = f"sudo sysctl -w {_RUNTIME}=-1 (a loop that never waits then stops its core; 950000 is the default)"
_CONTAINER = "docker run --cap-add SYS_NICE --cap-add IPC_LOCK --ulimit rtprio=99 --ulimit memlock=-1"
_DEBUG_FILE = "/sys/kernel/debug/sched/preempt"
_VENDOR_FILE = "/sys/kernel/realtime"  # RCI manual 2.2
_BUILT_MODES = {  # Options of a kernel with PREEMPT_DYNAMIC, and their default modes.
    "CONFIG_PREEMPT_NONE": "none",
    "CONFIG_PREEMPT_VOLUNTARY": "voluntary",
    "CONFIG_PREEMPT": "full",
    "CONFIG_PREEMPT_LAZY": "lazy",
}


def check_kernel(system: System) -> Finding:
    """Is this a PREEMPT_RT kernel?"""
    release = system.read("/proc/sys/kernel/osrelease").text or "of unknown release"
    if _is_realtime(system):
        return Finding("kernel", "ok", f"Linux {release}, PREEMPT_RT")
    return Finding("kernel", "note", f"Linux {release}, not PREEMPT_RT", _REAL_TIME_KERNEL)


def check_preemption(system: System) -> Finding:
    """Can a real-time loop preempt the kernel's work for another process?"""
    name, version = "preemption", system.read("/proc/sys/kernel/version")
    if _is_realtime(system):
        return Finding(name, "ok", "full (PREEMPT_RT)")
    if version.text is None:
        return Finding(name, "note", f"unknown: {version.problem}")
    if "PREEMPT_DYNAMIC" not in version.text:
        if "PREEMPT" in version.text:
            return Finding(name, "ok", "full (PREEMPT)")
        return Finding(name, "note", "the kernel was built without it", _REAL_TIME_KERNEL.partition("; ")[2])
    mode, source = _dynamic_mode(system)
    if mode is None:
        return Finding(name, "note", f"PREEMPT_DYNAMIC in an unknown mode: {source}", f"to be sure, {_FULL_PREEMPTION}")
    if mode == "full":
        return Finding(name, "ok", f"preempt=full, {source}")
    return Finding(name, "note", f"preempt={mode}, {source}", _FULL_PREEMPTION)


def check_fifo(granted: bool, system: System) -> Finding:
    """Can the control loop run with priority over all other processes on a core?

    Args:
        granted: Whether a process of rcilab got SCHED_FIFO.
        system: Source of the reason if not.
    """
    if granted:
        return Finding("SCHED_FIFO", "ok", "permitted")
    limit, problem = _limit(system, "Max realtime priority")
    if limit == "0":
        reason, advice = "this user's rtprio limit is 0", f"{_USER_LIMITS}; in a container: {_CONTAINER}"
    elif limit is not None and limit.isdecimal():
        reason, advice = f"this user's rtprio limit is {limit}", _USER_LIMITS
    elif limit is not None:
        reason = f"although this user's rtprio limit is {limit}"
        advice = f"a control group or a container withholds it: {_CONTAINER}"
    else:
        reason, advice = problem, f"{_USER_LIMITS}; in a container: {_CONTAINER}"
    return Finding("SCHED_FIFO", "note", f"not permitted ({reason}): cycles can be late on a busy machine", advice)


def check_memory_lock(granted: bool, system: System) -> Finding:
    """Can the memory of a loop be locked?

    Args:
        granted: Whether a process of rcilab could lock its memory.
        system: Source of the reason if not.
    """
    if granted:
        return Finding("locked memory", "ok", "permitted")
    limit, problem = _limit(system, "Max locked memory")
    reason = (
        problem if limit is None else f"this user's memlock limit is {limit}" + (" bytes" if limit.isdecimal() else "")
    )
    return Finding(
        "locked memory",
        "note",
        f"not permitted ({reason}): a cycle can wait for the disk",
        f"{_USER_LIMITS}; in a container: {_CONTAINER}",
    )


def check_vendor_library(fifo: bool, system: System) -> Finding:
    """Can the vendor's client library start on this machine? It needs a file and the highest priority.

    Args:
        fifo: Whether a process of rcilab got SCHED_FIFO.
        system: Source of the file.
    """
    name = "vendor's library"
    if system.read(_VENDOR_FILE).text != "1":
        return Finding(
            name,
            "note",
            f"{_VENDOR_FILE} does not contain 1: programs that use it end with an error, unless they are built "
            "with enforce_realtime = false",
            "for such a program alone: sudo unshare -m sh -c 'mount -t tmpfs none /sys/kernel; echo 1 > "
            f"{_VENDOR_FILE}; exec ./program'",
        )
    if not fifo:
        return Finding(
            name, "note", "needs SCHED_FIFO 99, else it ends with an error", f"run as root, or {_USER_LIMITS}"
        )
    return Finding(name, "ok", "its requirements are met")


def check_throttling(system: System) -> Finding:
    """Does the kernel give real-time loops enough of every period? One arm needs less than half of a core.

    Beyond the share the kernel stops all loops of the core until the period ends. Four arms on two cores reach it.
    """
    name = "real-time share"
    runtime, period = (system.read(f"/proc/sys/kernel/sched_rt_{part}_us") for part in ("runtime", "period"))
    if runtime.text is None or period.text is None:
        return Finding(name, "note", f"unknown: {runtime.problem or period.problem}")
    try:
        share = int(runtime.text) / int(period.text)
    except (ValueError, ZeroDivisionError):
        return Finding(name, "note", f"unknown: sched_rt_runtime_us is {runtime.text!r} of {period.text!r}")
    if share < 0.0:
        return Finding(name, "ok", "not throttled")
    if share < 0.5:
        advice = f"sudo sysctl -w {_RUNTIME}=950000"
        return Finding(name, "note", f"real-time loops get {share:.0%} of a core at most", advice)
    if share >= 1.0:
        return Finding(name, "ok", "not throttled")
    pause = 1e-3 * (int(period.text) - int(runtime.text))
    return Finding(
        name,
        "ok",
        f"real-time loops get up to {share:.0%} of a core, then pause for up to {pause:.0f} ms",
        f"for several arms on few cores, if cycles are late: {_UNTHROTTLED}",
    )


def _is_realtime(system: System) -> bool:
    version = system.read("/proc/sys/kernel/version").text or ""
    # Kernels before 5.3 have "PREEMPT RT". The file of manual 2.2 proves nothing: users create it for the library.
    return bool(re.search(r"PREEMPT[_ ]RT\b", version))


def _dynamic_mode(system: System) -> tuple[str | None, str]:
    """Returns the mode of a PREEMPT_DYNAMIC kernel and its source; without a mode, the reason."""
    running = system.read(_DEBUG_FILE)
    chosen = re.search(r"\((\w+)\)", running.text or "")  # Such as: none voluntary (full) lazy
    if chosen:
        return chosen[1], "now in force"
    problem = running.problem or f"{_DEBUG_FILE} contains {running.text!r}"
    booted = re.search(r"(?:^|\s)preempt=(\w+)", system.read("/proc/cmdline").text or "")
    if booted:
        return booted[1], f"as booted ({problem})"
    release = system.read("/proc/sys/kernel/osrelease").text
    for path in ("/proc/config.gz", f"/boot/config-{release}"):
        options = set((system.read(path).text or "").splitlines())
        for option, mode in _BUILT_MODES.items():
            if f"{option}=y" in options:
                return mode, f"as built ({problem})"
    return None, problem


def _limit(system: System, name: str) -> tuple[str | None, str]:
    """Returns a soft limit as proc(5) prints it, or None and the reason."""
    limits = system.read("/proc/self/limits")
    for line in (limits.text or "").splitlines():
        if line.startswith(name):
            return line.removeprefix(name).split()[0], ""
    return None, limits.problem or f"/proc/self/limits has no {name!r}"
