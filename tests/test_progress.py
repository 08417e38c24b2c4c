"""What `encode` says on a terminal while it works."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import re
import struct
import subprocess
import termios
from pathlib import Path

from command_line import COMMAND
from small_arrays import write_array


def on_a_terminal(*arguments: str | Path) -> tuple[str, str]:
    """(standard output, what the terminal got) of a command."""
    terminal, end = pty.openpty()
    fcntl.ioctl(end, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 120, 0, 0))
    command = [*COMMAND, *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=end, text=True) as process:
        os.close(end)
        shown = b""
        try:
            while piece := os.read(terminal, 65536):
                shown += piece
        except OSError:  # Linux ends a terminal so
            pass
        os.close(terminal)
        output = process.communicate()[0]
    assert process.returncode == 0, shown
    return output, shown.decode()


def test_encode_says_what_it_does_and_keeps_json_and_quiet_as_they_are(tmp_path: Path) -> None:
    folder, out = write_array(tmp_path / "in", frames=3), tmp_path / "out.mcap"
    options = ("encode", folder, out, "-y", "--matcher", "sgbm")
    output, shown = on_a_terminal(*options, "--json")
    assert isinstance(json.loads(output), dict)
    before, _, after = shown.partition("find the range of disparities")
    assert "encode:" not in before
    assert "0/3, ? left" in after
    assert re.search(r" [12]/3, \d\d:\d\d left", after)
    output, shown = on_a_terminal(*options, "--quiet")
    assert not output
    assert all(line.startswith("mvcodec: warning: ") for line in shown.splitlines()), shown
