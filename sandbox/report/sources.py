"""How a page is made again: the scene's file, and whether its text makes the scene."""

from sandbox.scene.files import parse
from sandbox.scene.model import Scene


def scene_file(scene: Scene) -> str:
    """Return the name of a scene's file as an argument of a command, which must not look like an option."""
    file = f"{scene.name}.toml"
    return f"./{file}" if file.startswith("-") else file


def equals_its_text(scene: Scene) -> bool:
    """Return whether a scene equals its text, apart from seed, rate and seconds, which commands set."""
    if not scene.source:
        return False
    read = parse(scene.source, scene.name).changed(seed=scene.seed, rate=scene.rate, seconds=scene.seconds)
    return read.model_dump() == scene.model_dump()


def seconds_text(seconds: float) -> str:
    """Return a time (s) as one writes it in a command: 2 and not 2.0."""
    return repr(float(seconds)).removesuffix(".0")
