"""`python -m sandbox` is the command `sandbox`."""

import gc
import signal

gc.set_threshold(100_000)  # imports make that many objects, and all stay: searching them took a tenth of `compare`
ctrl_c = signal.getsignal(signal.SIGINT)
if ctrl_c is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C during imports ends the program without a traceback

from sandbox.cli import main  # noqa: E402

signal.signal(signal.SIGINT, ctrl_c)

if __name__ == "__main__":
    main()
