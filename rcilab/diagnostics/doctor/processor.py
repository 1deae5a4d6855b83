"""Checks of the processor: cores, isolation, clock frequency, sleep states, clock source, hypervisor."""

from __future__ import annotations

from rcilab.diagnostics.doctor.finding import Finding
from rcilab.diagnostics.doctor.system import System
from rcilab.realtime.cpu_latency import DEVICE, awake_cores

FEWEST_CORES = 2
"""One for the 1 kHz loops, one for the page and the browser."""
SPARE_CORES = 4
"""From this number on, one core can be reserved for the control process."""

_CPU = "/sys/devices/system/cpu"
_CLOCK = "/sys/devices/system/clocksource/clocksource0"
_FAST_CLOCKS = ("tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter", "riscv_clocksource")
"""Read without a system call; reading others takes about a microsecond, and they can jump."""


def check_cores(cores: int) -> Finding:
    """Are there enough cores for a loop and a page?"""
    if cores < FEWEST_CORES:
        return Finding("cores", "note", str(cores), f"with {FEWEST_CORES} the page does not delay the 1 kHz loop")
    return Finding("cores", "ok", str(cores))


def check_isolation(cores: int, system: System) -> Finding:
    """Is a core reserved for processes that are assigned to it?"""
    name, isolated = "isolated cores", system.read(f"{_CPU}/isolated")
    if isolated.text is None:
        return Finding(name, "note", f"unknown: {isolated.problem}")
    if isolated.text:
        first = isolated.text.replace("-", ",").partition(",")[0]
        return Finding(name, "ok", f"{isolated.text}; use them with taskset, such as: taskset -c {first} rcilab run …")
    if cores < SPARE_CORES:
        return Finding(name, "ok", f"no isolated core; {cores} cores are too few for one")
    last = cores - 1
    advice = (
        f"for a real arm boot with isolcpus={last} nohz_full={last} rcu_nocbs={last} (/etc/default/grub, then sudo "
        f"update-grub), and start with taskset -c {last} rcilab run …"
    )
    return Finding(name, "note", "none", advice)


def check_governor(system: System) -> Finding:
    """Do the cores run at full speed at all times?"""
    name, slow, count = "CPU governor", set[str](), 0
    for path in system.find(_CPU, "cpu[0-9]*/cpufreq/scaling_governor"):
        governor = system.read(path).text
        count += governor is not None
        if governor is not None and governor != "performance":
            slow.add(governor)
    if not count:
        return Finding(name, "ok", "none: the clock frequency of this machine cannot be selected")
    if slow:
        advice = f"echo performance | sudo tee {_CPU}/cpu*/cpufreq/scaling_governor"
        return Finding(name, "note", f"{' and '.join(sorted(slow))}: the first cycles after a pause run slowly", advice)
    return Finding(name, "ok", "performance")


def check_sleep(system: System) -> Finding:
    """Can a motion keep the cores awake between its cycles?"""
    name = "sleeping cores"
    if not system.has(DEVICE):
        return Finding(name, "note", f"this kernel has no {DEVICE}", "boot with idle=poll for a real arm")
    with awake_cores() as is_permitted:
        pass
    if is_permitted:
        return Finding(name, "ok", "kept awake while something moves")
    advice = (
        """echo 'KERNEL=="cpu_dma_latency", GROUP="realtime", MODE="0660"' | sudo tee """
        "/etc/udev/rules.d/99-realtime.rules, sudo groupadd -f realtime, sudo usermod -aG realtime $USER, and reboot"
    )
    return Finding(name, "note", f"no permission for {DEVICE}: sleeping cores wake up late", advice)


def check_clock(system: System) -> Finding:
    """Is the clock that every cycle reads a fast one?"""
    name, current = "clock source", system.read(f"{_CLOCK}/current_clocksource")
    if current.text is None:
        return Finding(name, "note", f"unknown: {current.problem}")
    if current.text in _FAST_CLOCKS:
        return Finding(name, "ok", current.text)
    available = (system.read(f"{_CLOCK}/available_clocksource").text or "").split()
    better = next((clock for clock in _FAST_CLOCKS if clock in available), None)
    advice = (
        f"boot with clocksource={better}, or, for now, echo {better} | sudo tee {_CLOCK}/current_clocksource"
        if better
        else "the kernel found this machine's faster clocks unreliable: check dmesg | grep -i clocksource"
    )
    return Finding(name, "note", f"{current.text}: slow to read", advice)


def check_hypervisor(system: System) -> Finding:
    """Does a hypervisor share the cores with other machines?"""
    name, cpuinfo = "hypervisor", system.read("/proc/cpuinfo")
    if cpuinfo.text is None:
        return Finding(name, "note", f"unknown: {cpuinfo.problem}")
    ticks = read_ticks(system)
    share = f"{ticks[0] / ticks[1]:.2%} of the cores' time since boot" if ticks and ticks[1] else "an unknown share"
    is_shared = any(line.startswith("flags") and " hypervisor" in line for line in cpuinfo.text.splitlines())
    is_shared = is_shared or system.has("/sys/hypervisor/type")
    if not is_shared and not (ticks and ticks[0]):
        return Finding(name, "ok", "none")
    return Finding(
        name,
        "note",
        f"this is a virtual machine; others took {share}",
        "good for the virtual controller; for a real arm use a dedicated machine, or pin its virtual cores",
        {"stolen_percent": 100.0 * ticks[0] / ticks[1]} if ticks and ticks[1] else {},
    )


def read_ticks(system: System) -> tuple[int, int] | None:
    """Returns the ticks (1/100 s) taken by the hypervisor since boot, and all ticks; None if unknown."""
    line = (system.read("/proc/stat").text or "").partition("\n")[0].split()
    # proc(5): cpu user nice system idle iowait irq softirq steal guest guest_nice; guest time is part of user time.
    if len(line) < 9 or line[0] != "cpu" or not all(word.isdecimal() for word in line[1:9]):
        return None
    return int(line[8]), sum(map(int, line[1:9]))
