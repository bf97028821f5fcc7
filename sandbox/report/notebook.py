"""How a notebook shows a comparison: as its report, in a frame. One output has Bokeh's script for all.

A frame asks the notebook's page for the script, and the first output answers. It is packed, so that every output stays
under 1 MB, and no output needs a network.
"""

import base64
import gzip
import sys
from functools import partial
from html import escape
from typing import Any, Final

from sandbox.analysis.comparison import Comparison
from sandbox.report.comparison_page import page
from sandbox.report.html import bokeh_script
from sandbox.report.tables import print_comparison
from sandbox.text import DEFAULT_WIDTH, text_of

MAX_FRAME_BYTES: Final = 530_000  # with the script, an output stays under 1 MB
PROVIDER: Final = """<script>
(() => {
  const packed = Uint8Array.from(atob("%s"), (c) => c.charCodeAt(0));
  const text = new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  addEventListener("message", async ({ data, source }) => {
    if (data === "sandbox: send Bokeh") source.postMessage(await text, "*");
  });
})();
</script>"""

Execution = tuple[str | None, int | None]  # of a cell: the cell's id, if the notebook sends it, and the count

_provider: Execution | None = None  # whose output has the script


def html_of(comparison: Comparison) -> str:
    """Return the report in a frame, from which no style or script leaks; before the first one, Bokeh's script.

    If the report is too large, return the text of the command line.
    """
    global _provider  # noqa: PLW0603  (a notebook's outputs share a page, as its cells share a process)
    frame = _frame(comparison)
    if len(frame) > MAX_FRAME_BYTES:
        text = text_of(partial(print_comparison, comparison), DEFAULT_WIDTH)
        return f"<pre>{escape(text)}</pre><p>The report is too large for a notebook; <code>report</code> writes it.</p>"
    now = _execution()
    is_rerun = _provider is not None and now[0] == _provider[0] is not None and now != _provider
    if _provider is None or is_rerun:  # the output of a cell that runs again is replaced
        _provider = now
        return PROVIDER % base64.b64encode(gzip.compress(bokeh_script().encode(), mtime=0)).decode() + frame
    return frame


def _frame(comparison: Comparison) -> str:
    quoted = page(comparison, in_notebook=True).replace("&", "&amp;").replace("'", "&#39;")
    return (
        f'<iframe title="Comparison" sandbox="allow-scripts" srcdoc=\'{quoted}\' '
        'style="width: 100%; height: 56rem; border: 1px solid #ccc"></iframe>'
    )


def _execution() -> Execution:
    """Return the execution of a cell that IPython is in."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    request: dict[str, Any] = getattr(shell, "get_parent", dict)()
    return request.get("metadata", {}).get("cellId"), getattr(shell, "execution_count", None)
