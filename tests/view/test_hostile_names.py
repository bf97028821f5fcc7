"""The window shows files with hostile names as text, and saves only into the current folder."""

from pathlib import Path

import pygame
import pytest
from hostile import NAMES, controls_in, scene_files
from pygame.event import Event

from sandbox.run.inputs import Start
from sandbox.scene.files import load
from sandbox.view.window import Window


def test_the_window_shows_any_name_and_saves_into_its_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    inside = tmp_path / "inside"
    inside.mkdir()
    monkeypatch.chdir(inside)
    Path("[[balls]].toml").mkdir()
    names = scene_files()
    window = Window(load(Path(names[0])), ["article"])
    before = {*tmp_path.rglob("*")}
    opened = [f"{NAMES[key]}.toml" for key in ("colour", "lines", "override", "no-utf-8", "option", "html")]
    for file in opened:
        window.on_event(Event(pygame.DROPFILE, file=f"none-{file}"))
        assert window.shelf.mistake.startswith("none-")
        window.frame(0)
        window.escape()
        window.on_event(Event(pygame.DROPFILE, file=file))
        assert window.scene.file == Path(file)
        assert Start(scene=window.scene.name, seed=0, rate=60).model_dump_json()
        window.frame(0)
        for act in (window.save_scene, window.save_picture, window.record, window.record):
            act()
            assert window.notice[0].startswith("saved ") or act == window.record
            window.frame(0)
    window.shelf.pick()
    window.frame(0)
    assert window.shelf.picker
    picked = {entry.file.name: entry.name for entry in window.shelf.picker.found}
    assert set(names) <= set(picked)
    assert "[[balls]].toml" not in picked
    assert not controls_in("".join(picked.values()))
    new = {*tmp_path.rglob("*")} - before
    assert {file.parent for file in new} == {inside}
    assert {file.suffix for file in new} == {".toml", ".png", ".gif"}
    assert len(new) == 3 * len(opened)
