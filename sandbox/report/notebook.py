"""How a notebook shows a comparison: as its report. Importing this module turns that on.

The report imports comparisons, so a comparison cannot import the report.
"""

import html

from sandbox.analysis.comparison import Comparison


def iframe(comparison: Comparison) -> str:
    """Return the report in a frame of its own, from which no style or script leaks into the notebook."""
    from sandbox.report.comparison import page  # noqa: PLC0415  (Bokeh is slow to import)

    return (
        f'<iframe title="Comparison" sandbox="allow-scripts" srcdoc="{html.escape(page(comparison))}" '
        'style="width: 100%; height: 56rem; border: 1px solid #ccc"></iframe>'
    )


Comparison.notebook_html = iframe
