"""The command `seixo`."""

from __future__ import annotations

import signal
import sys


def main() -> int:
    """Runs the program with the arguments of this process; returns its exit code."""
    from ._native import main as program

    # The program has its own way to end on Ctrl-C, with its state saved; Python's would come on top.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    return program(["seixo", *sys.argv[1:]])
