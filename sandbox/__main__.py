"""`python -m sandbox` is the command `sandbox`."""

import gc
import signal

gc.set_threshold(100_000)  # imports make that many objects, and all stay: searching them took a tenth of `compare`
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C during imports ends the program without a traceback

from sandbox.cli import main  # noqa: E402

if __name__ == "__main__":
    main()
