"""Is there a core that does nothing else, at full speed, with a good clock, and does it belong to us?"""

from __future__ import annotations

from rcilab.diagnostics.doctor.finding import Finding
from rcilab.diagnostics.doctor.system import System
from rcilab.realtime.cpu_latency import DEVICE, awake_cores

FEWEST_CORES = 2
"""One for the 1 kHz loops, one for the page and the browser."""
SPARE_CORES = 4
"""From so many on, one can be given away to the control process alone."""

_CPU = "/sys/devices/system/cpu"
_CLOCK = "/sys/devices/system/clocksource/clocksource0"
_FAST_CLOCKS = ("tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter", "riscv_clocksource")
"""Read without a system call; others cost about a microsecond a look and can jump."""


def check_cores(cores: int) -> Finding:
    """Are there enough cores for a loop and a page at a time?"""
    if cores < FEWEST_CORES:
        return Finding("cores", "note", str(cores), f"{FEWEST_CORES} keep the page out of the 1 kHz loop's way")
    return Finding("cores", "ok", str(cores))


def check_isolation(cores: int, system: System) -> Finding:
    """Is a core kept free of everything that is not sent there?"""
    name, isolated = "isolated cores", system.read(f"{_CPU}/isolated")
    if isolated.text is None:
        return Finding(name, "note", f"unknown: {isolated.problem}")
    if isolated.text:
        first = isolated.text.replace("-", ",").partition(",")[0]
        return Finding(name, "ok", f"{isolated.text}; use them with taskset, such as: taskset -c {first} rcilab run …")
    if cores < SPARE_CORES:
        return Finding(name, "ok", f"no isolated core, and with {cores} cores none to spare")
    last = cores - 1
    advice = (
        f"for a real arm boot with isolcpus={last} nohz_full={last} rcu_nocbs={last} (/etc/default/grub, then sudo "
        f"update-grub), and start with taskset -c {last} rcilab run …"
    )
    return Finding(name, "note", "none", advice)


def check_governor(system: System) -> Finding:
    """Do the cores run at full speed, or do they have to wake up first?"""
    name, slow, count = "CPU governor", set[str](), 0
    for path in system.find(_CPU, "cpu[0-9]*/cpufreq/scaling_governor"):
        governor = system.read(path).text
        count += governor is not None
        if governor is not None and governor != "performance":
            slow.add(governor)
    if not count:
        return Finding(name, "ok", "none: this machine's clock frequency is not ours to choose")
    if slow:
        advice = f"echo performance | sudo tee {_CPU}/cpu*/cpufreq/scaling_governor"
        return Finding(name, "note", f"{' and '.join(sorted(slow))}: the first cycles after a pause run slowly", advice)
    return Finding(name, "ok", "performance")


def check_sleep(system: System) -> Finding:
    """May a motion keep the cores awake between its cycles?"""
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
    return Finding(name, "note", f"{DEVICE} is not ours to use: cores that fall asleep wake up late", advice)


def check_clock(system: System) -> Finding:
    """Is the clock that every cycle looks at a fast one?"""
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
        else "the kernel found this machine's faster clocks unreliable: look at dmesg | grep -i clocksource"
    )
    return Finding(name, "note", f"{current.text}: slow to read", advice)


def check_hypervisor(system: System) -> Finding:
    """Do the cores belong to us, or does a hypervisor lend them?"""
    name, cpuinfo = "hypervisor", system.read("/proc/cpuinfo")
    if cpuinfo.text is None:
        return Finding(name, "note", f"unknown: {cpuinfo.problem}")
    ticks = read_ticks(system)
    share = f"{ticks[0] / ticks[1]:.2%} of the cores' time since boot" if ticks and ticks[1] else "an unknown share"
    is_lent = any(line.startswith("flags") and " hypervisor" in line for line in cpuinfo.text.splitlines())
    is_lent = is_lent or system.has("/sys/hypervisor/type")
    if not is_lent and not (ticks and ticks[0]):
        return Finding(name, "ok", "none")
    return Finding(
        name,
        "note",
        f"this is a virtual machine; others took {share}",
        "good for the virtual controller; for a real arm use a machine of its own, or pin its virtual cores",
        {"stolen_percent": 100.0 * ticks[0] / ticks[1]} if ticks and ticks[1] else {},
    )


def read_ticks(system: System) -> tuple[int, int] | None:
    """Returns for how many ticks (1/100 s) the hypervisor held our cores so far, and of how many; None if unknown."""
    line = (system.read("/proc/stat").text or "").partition("\n")[0].split()
    # proc(5): cpu user nice system idle iowait irq softirq steal guest guest_nice; guest time is part of user time.
    if len(line) < 9 or line[0] != "cpu" or not all(word.isdecimal() for word in line[1:9]):
        return None
    return int(line[8]), sum(map(int, line[1:9]))
