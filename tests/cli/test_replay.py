"""`rcilab replay FILE` opens the page on a run, or says in one line why not."""

from __future__ import annotations

from rcilab.cli import main, replay
from tests.recording.runs import some_run


def test_a_run_is_opened_and_nothing_else_is(monkeypatch, tmp_path, capsys):
    opened = []
    monkeypatch.setattr(replay, "serve", lambda config, browser: opened.append((config, browser)) or 0)
    some_run().save(tmp_path / "a.rcirun")
    assert main(["replay", str(tmp_path / "a.rcirun"), "--no-browser", "--port", "0"]) == 0
    ((config, browser),) = opened
    assert config.replay.cycles.tobytes() == some_run().cycles.tobytes()
    assert (config.port, browser) == (0, False)
    assert "a.rcirun: <Run" in capsys.readouterr().out


def test_a_file_that_is_none_is_one_line(tmp_path, capsys):
    assert main(["replay", str(tmp_path / "none.rcirun")]) == 2
    assert "does not exist" in capsys.readouterr().err
    (tmp_path / "a.rcirun").write_bytes(b"nothing")
    assert main(["replay", str(tmp_path / "a.rcirun")]) == 2
    assert "rcilab did not write it" in capsys.readouterr().err
