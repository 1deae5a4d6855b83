"""`rcilab controller --record FOLDER`: the process that writes the motions of the controller's client.

It is a process of its own, so that files and checks cannot delay a cycle:
`python -m rcilab.cli.motion_recorder FOLDER DESCRIPTOR FORMAT`, with the inherited descriptor of the record and the
format of the log. It ends when its standard input does, after it has written what is there.
"""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import cast

from rcilab.core.cycle_ring import CycleRing
from rcilab.core.errors import InvalidValueError, RcilabError, UsageError
from rcilab.recording.client_recorder import ClientRecorder
from rcilab.sim.log_entry import LogEntry, LogFormat

_SILENT_WAIT = 1.0  # [s]
_END_TIMEOUT = 60.0  # [s] For the report on a long motion.
_PERIOD = 0.1  # [s] Between two looks at the record.
_NICENESS = 10  # The client's program and the controller come first.


def show_entry(form: LogFormat, cycle: Callable[[], int]) -> Callable[[str, str], None]:
    """Returns a function that writes an entry (kind, text) of the log to stderr.

    Args:
        form: Format of the log.
        cycle: Returns the number of the last state.
    """

    def show(kind: str, text: str) -> None:
        entry = LogEntry(kind=kind, text=text, cycle=cycle(), wall=time.time())
        with suppress(OSError):  # The files are written, also if the log is not read.
            sys.stderr.write(f"{entry.written(form)}\n")  # At once: the controller's own lines may come in between.
            sys.stderr.flush()

    return show


@contextmanager
def recorder_process(folder: Path, ring: CycleRing, form: LogFormat, cycle: Callable[[], int]) -> Iterator[None]:
    """Records while it is entered; then waits until everything is written.

    Args:
        folder: Destination; created if it does not exist.
        ring: The controller's record of all cycles.
        form: Format of the log.
        cycle: Returns the number of the last state.

    Raises:
        InvalidValueError: The folder cannot be written to.
        UsageError: The process cannot be started.
    """
    _require_writable(folder)
    command = [sys.executable, "-P", "-m", "rcilab.cli.motion_recorder", os.fspath(folder), str(ring.descriptor), form]
    # In a session of its own: a signal to the terminal's processes ends the controller, which then ends this one.
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        pass_fds=(ring.descriptor,),
        start_new_session=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    show, ending = show_entry(form, cycle), threading.Event()

    def watch() -> None:
        status = process.wait()
        if not ending.is_set():
            text = f"the recorder (process {process.pid}) ended with status {status}: motions are not recorded any more"
            show("not_recorded", text)

    try:
        if not process.stdout.readline():
            raise UsageError(f"the recorder could not be started (status {process.wait()}); its output is above")
        threading.Thread(target=watch, name="recorder", daemon=True).start()
        yield
    finally:
        ending.set()
        process.stdin.close()
        process.stdout.close()
        _await_end(process, show, folder)


def _await_end(process: subprocess.Popen[bytes], show: Callable[[str, str], None], folder: Path) -> None:
    """Waits until the recorder has written everything; Ctrl-C ends it at once."""
    try:
        process.wait(_SILENT_WAIT)
        return
    except subprocess.TimeoutExpired:
        previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        text = f"waiting for the recorder (process {process.pid}) and its last report; Ctrl-C ends without them"
        show("recorder_waits", text)
        process.wait(_END_TIMEOUT)
    except (subprocess.TimeoutExpired, KeyboardInterrupt):
        process.kill()
        text = f"the recorder was ended before its last report; cycles that it had not yet written to {folder} are lost"
        show("not_recorded", text)
    finally:
        signal.signal(signal.SIGINT, previous)


def main(arguments: Sequence[str]) -> int:
    """Records until standard input ends."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # The end of the controller ends it, once everything is written.
    os.nice(_NICENESS)
    folder, ring, form = Path(arguments[0]), CycleRing(int(arguments[1])), cast("LogFormat", arguments[2])
    reader = ring.open_reader()

    def cycle() -> int:
        row = reader.newest()
        return 0 if row is None else int(row["message_id"][0])

    show = show_entry(form, cycle)
    recorder = ClientRecorder(folder, ring, show)
    print("ready", flush=True)
    is_open = True
    while is_open:
        is_open = not select.select([sys.stdin], [], [], _PERIOD)[0] or bool(os.read(0, 1))
        try:
            recorder.poll()
        except RcilabError as error:
            show("not_recorded", str(error))
    recorder.close()
    return 0


def _require_writable(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except FileExistsError as error:
        raise InvalidValueError("record", os.fspath(folder), "is not a folder; choose another") from error
    except OSError as error:
        raise InvalidValueError(
            "record", os.fspath(folder), f"is not a folder that can be written to: {error.strerror}; choose another"
        ) from error


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
