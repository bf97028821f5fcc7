"""`python -m sandbox` is the command `sandbox`."""

import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # while modules are imported there is nothing to undo, nor to tell

from sandbox.cli import main

if __name__ == "__main__":
    main()
