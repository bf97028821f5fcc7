"""Files are replaced atomically: whole, or not at all."""

import errno
from pathlib import Path

import pytest

from sandbox.errors import SandboxError
from sandbox.files import whole_file


def fail_halfway(path: Path, error: BaseException) -> None:
    with whole_file(path) as file:
        file.write(b"half of")
        file.flush()
        raise error


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()], ids=repr)
def test_a_failed_write_leaves_the_old_file_or_none(tmp_path: Path, error: BaseException) -> None:
    path = tmp_path / "file.json"
    expected = SandboxError if isinstance(error, OSError) else type(error)
    for old in (None, b"old content"):
        if old:
            path.write_bytes(old)
        with pytest.raises(expected) as caught:
            fail_halfway(path, error)
        if isinstance(error, OSError):
            assert str(caught.value) == f"{path}: cannot be written: No space left on device"
        assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == ({"file.json": old} if old else {})


def test_a_file_is_replaced_only_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    path.write_bytes(b"old content")
    with whole_file(path) as file:
        file.write(b"new content")
        file.flush()
        assert path.read_bytes() == b"old content"
    assert path.read_bytes() == b"new content"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "why"),
    [
        pytest.param("missing/figures.csv", "No such file or directory", id="no-folder"),
        pytest.param("file/figures.csv", "Not a directory", id="file-instead-of-folder"),
        pytest.param("folder.csv", "Is a directory", id="folder"),
        pytest.param("x" * 300 + ".csv", "File name too long", id="name-too-long"),
    ],
)
def test_a_path_that_cannot_be_written_is_rejected(tmp_path: Path, name: str, why: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder.csv").mkdir()
    path = tmp_path / name
    with pytest.raises(SandboxError) as caught:
        fail_halfway(path, AssertionError("opened"))
    assert str(caught.value) == f"{path}: cannot be written: {why}"
    assert {file.name for file in tmp_path.iterdir()} == {"file", "folder.csv"}
