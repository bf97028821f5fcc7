"""The window shows files with hostile names as text, and saves only into the current folder."""

from pathlib import Path

import pygame
import pytest
from hostile import NAMES, controls_in, scene_files
from pygame.event import Event

from sandbox.run.inputs import Start
from sandbox.scene.files import load
from sandbox.view.controls import Action
from sandbox.view.window import Window


@pytest.mark.wide
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
        assert window.scenes.error.startswith("none-")
        window.frame(0)
        window.do(Action.ESCAPE)
        window.on_event(Event(pygame.DROPFILE, file=file))
        assert window.scene.file == Path(file)
        assert Start(scene=window.scene.name, seed=0, rate=60).model_dump_json()
        window.frame(0)
        for action in (Action.SAVE_SCENE, Action.SAVE_PICTURE, Action.RECORD, Action.RECORD):
            window.do(action)
            assert window.notice.text.startswith("saved ") or action == Action.RECORD
            window.frame(0.1 if action == Action.RECORD else 0)
    window.scenes.open_picker()
    window.frame(0)
    assert window.scenes.picker
    picked = {entry.file.name: entry.name for entry in window.scenes.picker.found}
    assert set(names) <= set(picked)
    assert "[[balls]].toml" not in picked
    assert not controls_in("".join(picked.values()))
    new = {*tmp_path.rglob("*")} - before
    assert {file.parent for file in new} == {inside}
    assert {file.suffix for file in new} == {".toml", ".png", ".gif"}
    assert len(new) == 3 * len(opened)
