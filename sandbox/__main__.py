"""`python -m sandbox` is the command `sandbox`."""

import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C during imports ends the program without a traceback

from sandbox.cli import main

if __name__ == "__main__":
    main()
