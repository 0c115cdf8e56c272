"""The command `pocketsplat`, also as `python -m pocketsplat`."""

from __future__ import annotations

import os
import signal
import sys
import sysconfig

from pocketsplat._native import run_command


def main() -> None:
    """Runs the command line and ends the process with its exit code."""
    # The command answers Ctrl-C itself: training saves what there is.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    code = run_command(_program(), sys.argv[1:])
    sys.stdout.flush()
    # Not `sys.exit`: nothing of Python's is left to do, and threads of the command may still wait.
    os._exit(code)


def _program() -> str:
    """The script that starts the command again: this one, or the one that was installed with the package."""
    this = os.path.abspath(sys.argv[0])
    if os.path.basename(this) == "pocketsplat" and os.path.exists(this):
        return this
    return os.path.join(sysconfig.get_path("scripts"), "pocketsplat")


if __name__ == "__main__":
    main()
