# SPDX-License-Identifier: Apache-2.0
"""Commands at a pseudo-terminal, as a person sees them."""
import fcntl
import os
import pty
import struct
import termios


def start(test, command, folder, columns=80):
    """Process id and file descriptor of the terminal; `test` is skipped where there are none."""
    try:
        pid, terminal = pty.fork()
    except OSError as error:
        test.skipTest(f"no pseudo-terminals here: {error}")
    if pid == 0:
        fcntl.ioctl(2, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        os.chdir(folder)
        os.execv(command[0], command)
    return pid, terminal


def finish(pid, terminal):
    """Waits for the end; what was shown, and the exit code."""
    shown = b""
    while True:
        try:
            part = os.read(terminal, 4096)
        except OSError:  # how Linux tells that nobody has the terminal open any more
            break
        if not part:
            break
        shown += part
    os.close(terminal)
    return shown.decode(), os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
