"""Copies of the fork server: what they are handed, how they end, and what becomes of them without it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import ExitStack

import pytest

from rcilab.control_process.fork_server import fork_server_pid
from rcilab.control_process.launch import start_controller
from rcilab.control_process.managed_process import ManagedProcess
from rcilab.core.errors import ConnectionLostError
from tests.waiting import wait_for

SOON = 20.0


@pytest.fixture
def run():
    """Runs a line of Python in a copy; the standard library's stopwatch takes it, and does so once."""
    with ExitStack() as afterwards:

        def begin(line: str, **options) -> ManagedProcess:
            child = ManagedProcess("timeit", ["-n", "1", "-r", "1", line], "a line of Python", **options)
            afterwards.callback(child.end)
            return child

        yield begin


def test_a_copy_has_its_own_session_name_output_and_is_our_fork_servers_child(run):
    child = run("import os, sys; print(os.getppid(), os.getsid(0) == os.getpid()); print('oh', file=sys.stderr)")
    assert child.wait(SOON)
    assert child.exit_description == "exit code 0"
    assert child.read_output().startswith(f"{fork_server_pid()} True\n")
    assert child.stderr_tail == "oh"
    with open("/proc/self/comm", encoding="ascii") as ours:
        assert ours.read() != "rcilab timeit\n"


def test_a_copy_is_called_after_what_it_runs(run):
    assert run("print(open('/proc/self/comm').read())").wait(SOON)
    child = run("print(open('/proc/self/comm').read())")
    assert child.wait(SOON)
    assert child.read_output().startswith("rcilab timeit\n")


def test_a_copy_works_in_our_environment_and_folder_as_they_are_now(run, monkeypatch, tmp_path):
    fork_server_pid()
    monkeypatch.setenv("OF_TODAY", "gr\udcfcn")  # No UTF-8, as a path may be.
    monkeypatch.delenv("HOME", raising=False)
    monkeypatch.chdir(tmp_path)
    child = run("import os; print(ascii(os.environ['OF_TODAY']), 'HOME' in os.environ, os.getcwd())")
    assert child.wait(SOON)
    assert child.read_output().splitlines()[0] == rf"'gr\udcfcn' False {tmp_path}"


def test_a_copy_is_handed_the_files_that_belong_to_it_under_their_numbers_and_no_other(run):
    reader, writer = os.pipe()
    try:
        open_ones = "[n for n in range(999) if os.path.exists(f'/dev/fd/{n}')]"
        child = run(f"import os; print(os.write({writer}, b'hello'), {open_ones})", descriptors=[writer])
        assert child.wait(SOON)
        assert child.read_output().splitlines()[0] == f"5 {sorted([0, 1, 2, writer])}"
        assert os.read(reader, 100) == b"hello"
    finally:
        os.close(reader)
        os.close(writer)


@pytest.mark.parametrize(
    ("line", "how"),
    [
        ("import os; os._exit(3)", "exit code 3"),
        ("1 / 0", "exit code 1"),
        ("import os; os.kill(os.getpid(), 9)", "signal 9 (SIGKILL)"),
        ("import os; os.abort()", "signal 6 (SIGABRT)"),
    ],
)
def test_it_is_known_how_a_copy_ended(run, line, how):
    child = run(line)
    assert child.wait(SOON)
    assert child.exit_description == how
    child.end()
    assert child.exit_description == how
    assert not child.is_alive


def test_what_goes_wrong_in_a_copy_is_in_its_last_words(run):
    child = run("1 / 0")
    assert child.wait(SOON)
    assert child.stderr_tail.endswith("ZeroDivisionError: division by zero")
    with pytest.raises(ConnectionLostError, match=r"did not start \(exit code 2\): rcilab: unknown robot 'none'"):
        start_controller("none")


def test_a_copy_is_asked_to_end_even_before_it_exists(run):
    child = run("import time; time.sleep(60.0)")
    child.end(timeout=SOON)
    assert child.exit_description == "signal 15 (SIGTERM)"


def test_a_fork_server_that_does_not_answer_is_replaced(run):
    stuck = fork_server_pid()
    os.kill(stuck, signal.SIGSTOP)
    child = run("pass")
    assert not child.wait(0.1)
    assert child.pid is None
    child.end(timeout=0.1)
    assert not child.is_alive
    assert child.exit_description == "exit status unknown"
    assert run("pass").wait(SOON)
    assert fork_server_pid() != stuck


def test_without_their_fork_server_copies_end_and_the_next_one_has_another():
    controller = start_controller("xMatePro7")
    try:
        first = fork_server_pid()
        os.kill(first, signal.SIGKILL)
        assert controller.wait(SOON)
        assert controller.exit_description == "exit status unknown"
        following = start_controller("xMatePro7")
        following.end()
        assert following.exit_description == "exit code 0"
        assert fork_server_pid() != first
    finally:
        controller.end()


FORK = """
import os
from rcilab.control_process.fork_server import fork_server_pid
from rcilab.control_process.launch import start_controller
controller = start_controller("xMatePro7")
pid = os.fork()
if pid == 0:
    ours = fork_server_pid()
    start_controller("xMatePro7").end()
    os._exit(ours == controller.pid)
ended = os.waitpid(pid, 0)[1]
print(ended, controller.is_alive)
controller.end()
print(controller.exit_description)
"""


def test_a_fork_of_this_process_has_a_fork_server_of_its_own_and_leaves_ours_alone():
    done = subprocess.run([sys.executable, "-c", FORK], capture_output=True, text=True, check=True, timeout=60.0)
    assert done.stdout.split("\n") == ["0 True", "exit code 0", ""]


def test_many_come_and_go_at_once_and_no_file_stays_open(run):
    run("pass").wait(SOON)
    before = set(os.listdir("/proc/self/fd"))
    children = [run(f"import os; os._exit({number})") for number in range(20)]
    for number, child in enumerate(children):
        assert child.wait(SOON)
        assert child.exit_description == f"exit code {number}"
        child.end()
    assert set(os.listdir("/proc/self/fd")) <= before
    server = f"/proc/{fork_server_pid()}/fd"
    wait_for(lambda: len(os.listdir(server)) < 10)


MANY = """
import os, resource
hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
resource.setrlimit(resource.RLIMIT_NOFILE, (1300, hard))
files = [os.open("/dev/null", os.O_RDONLY) for _ in range(1100)]
from rcilab.control_process.launch import start_controller
controller = start_controller("xMatePro7")
controller.end()
print(controller.exit_description)
"""


def test_a_program_with_many_open_files_starts_and_ends_a_controller():
    done = subprocess.run([sys.executable, "-c", MANY], capture_output=True, text=True, check=False, timeout=60.0)
    assert (done.stdout, done.stderr) == ("exit code 0\n", "")


NO_MORE = """
import os, resource
hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
resource.setrlimit(resource.RLIMIT_NOFILE, (100, hard))
from rcilab.control_process.fork_server import fork, fork_server_pid
from rcilab.control_process.managed_process import ManagedProcess

def end_one():
    child = ManagedProcess("timeit", ["-n", "1", "-r", "1", "pass"], "a line of Python")
    child.wait(20.0)
    child.end()
    return child.exit_description

end_one()
pid, files = fork_server_pid(), []
try:
    while True:
        files.append(os.open("/dev/null", os.O_RDONLY))
except OSError:
    os.close(files.pop())
for _ in range(5):
    try:
        fork(print, [0])
    except OSError as error:
        print(error.strerror)
    os.close(files.pop())
for file in files:
    os.close(file)
print(end_one(), fork_server_pid() == pid)
"""


def test_the_fork_server_survives_a_process_that_has_no_file_left():
    done = subprocess.run([sys.executable, "-c", NO_MORE], capture_output=True, text=True, check=True, timeout=60.0)
    assert done.stdout == "Too many open files\n" * 5 + "exit code 0 True\n"
    assert done.stderr == ""


LAST = """
import atexit

def finish():
    print(controller.is_alive)
    controller.end()

atexit.register(finish)  # What is registered first is called last.
from rcilab.control_process.launch import start_controller
controller = start_controller("xMatePro7")
"""


def test_at_the_interpreters_end_there_are_no_complaints_and_what_is_done_last_still_has_its_processes():
    command = [sys.executable, "-X", "dev", "-c", LAST]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60.0)
    assert (done.stdout, done.stderr) == ("True\n", "")


def test_interrupts_reach_neither_the_fork_server_nor_a_copy(run):
    os.kill(fork_server_pid(), signal.SIGINT)
    child = run("import os; os.kill(os.getpid(), 2); print('still here')")
    assert child.wait(SOON)
    assert (child.exit_description, child.read_output().splitlines()[0]) == ("exit code 0", "still here")


UNGUARDED = """
print("once")
import rcilab
with rcilab.simulate(rcilab.load_model("xMatePro7")) as robot:
    print(robot.state.q.shape)
"""


@pytest.mark.parametrize("how", ["script", "-c", "stdin"])
def test_a_script_without_a_guard_is_not_run_a_second_time(how, tmp_path):
    file = tmp_path / "script.py"
    file.write_text(UNGUARDED)
    command = {"script": [os.fspath(file)], "-c": ["-c", UNGUARDED], "stdin": ["-"]}[how]
    done = subprocess.run(
        [sys.executable, *command], input=UNGUARDED, capture_output=True, text=True, check=True, timeout=60.0
    )
    assert (done.stdout, done.stderr) == ("once\n(7,)\n", "")


REMOVED = """
import os, tempfile
folder = tempfile.mkdtemp()
os.chdir(folder)
os.rmdir(folder)
from rcilab.control_process.launch import start_controller
controller = start_controller("xMatePro7")
controller.end()
print(controller.exit_description)
"""


def test_a_removed_working_folder_is_no_obstacle():
    done = subprocess.run([sys.executable, "-c", REMOVED], capture_output=True, text=True, check=True, timeout=60.0)
    assert (done.stdout, done.stderr) == ("exit code 0\n", "")


REAPED = """
import os, signal
from rcilab.control_process.fork_server import fork_server_pid
from rcilab.control_process.launch import start_controller
pid = fork_server_pid()
os.kill(pid, signal.SIGKILL)
os.waitpid(pid, 0)
controller = start_controller("xMatePro7")
controller.end()
print(controller.exit_description)
"""


def test_a_fork_server_that_the_users_code_has_reaped_is_replaced():
    done = subprocess.run([sys.executable, "-c", REAPED], capture_output=True, text=True, check=True, timeout=60.0)
    assert (done.stdout, done.stderr) == ("exit code 0\n", "")


POOL = """
import multiprocessing

def move(_):
    import rcilab
    with rcilab.simulate(rcilab.load_model("xMatePro7")) as robot:
        return robot.state.q.shape

if __name__ == "__main__":
    for method in ("forkserver", "fork"):
        with multiprocessing.get_context(method).Pool(1) as pool:
            print(pool.map(move, [0]))
"""


def test_the_users_own_processes_can_simulate_whichever_way_they_start(tmp_path):
    file = tmp_path / "script.py"
    file.write_text(POOL)
    done = subprocess.run([sys.executable, os.fspath(file)], capture_output=True, text=True, check=True, timeout=90.0)
    assert (done.stdout, done.stderr) == ("[(7,)]\n[(7,)]\n", "")
