"""Names and texts that try to command a terminal, a spreadsheet, a shell or a page, and scenes that contain them."""

import json
import os
import unicodedata
from pathlib import Path
from typing import Final

from sandbox.scene.files import parse
from sandbox.scene.model import Scene

TERMINAL_TEXTS: Final = {
    "colour": "\x1b[31mred",
    "bell": "a\x07b",
    "backspace": "a\b\bb",
    "over": "first\rsecond",
    "lines": "a\nmine.toml: 1 ball, no errors",
    "c1": "a\x9b31mb",
    "override": "a\u202eb",
    "isolate": "a\u2066b",
    "separator": "a\u2028b",
    "unseen": "a\u200bb",
}
NAMES: Final = TERMINAL_TEXTS | {
    "no-utf-8": os.fsdecode(b"\xff"),
    "markup": "[red]a [link=file:b]c [[balls]]",
    "emoji": ":smile:",
    "sum": "=1+1",
    "plus": "+1",
    "minus": "-1",
    "at": "@SUM(1)",
    "option": "--out=x",
    "shell": "$(touch ran); touch `ran` ~ ! 'a' \"b\" && touch ran",
    "html": "<img src=x onerror='globalThis.ran = 1'>",
    "tex": r"$$\href{javascript:globalThis.ran=1}{a}$$",
}
PAGE_TEXTS: Final = (
    r"$$\href{javascript:globalThis.ran=1}{a}$$ \(b\) \[c\]",
    "</script></title></pre><script>globalThis.ran = 1</script><!--",
    "<img src=x onerror='globalThis.ran = 1'><style>*{background:url(http://a.example)}</style>",
    "\"><svg onload='globalThis.ran = 1'> {{ 7 * 7 }} &lt;b&gt;",
)
SCENE: Final = """seconds = 0.1
[arena]
size = [200, 100]
[[balls]]
radius = 20
position = [50, 50]
velocity = [-300, 0]
[[expect]]
at = 0
momentum = [-300, 0]
tolerance = 1
because = "It flies."
"""


def controls_in(text: str) -> set[str]:
    """Return the characters of an output that a terminal would obey instead of showing them."""
    return {letter for letter in text if unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Zl", "Zp")} - {"\n"}


def scene_files(text: str = SCENE) -> list[str]:
    """Write a scene file under each hostile name into the current folder; return the files' names."""
    for name in NAMES.values():
        Path(f"{name}.toml").write_text(text)
    return [f"{name}.toml" for name in NAMES.values()]


def hostile_scene(title: str = "", about: str = "", because: str = "It flies.", name: str = "mine") -> Scene:
    """Parse a scene with the given texts, from a file with the given name."""
    title, about, because = (json.dumps(text, ensure_ascii=False) for text in (title, about, because))
    rest = SCENE.replace('"It flies."', because)
    return parse(f"title = {title}\nabout = {about}\n{rest}", f"{name}.toml")
