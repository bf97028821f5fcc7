"""One ball among walls at any angle in `exact`: none hangs, neither inside walls at the start nor outside."""

import pytest
from walls_at_random import play, scene_at_random

pytestmark = pytest.mark.slow

INSIDE, FREE = 1_500, 3_000  # scenes


@pytest.mark.parametrize(("may_overlap", "count"), [(True, INSIDE), (False, FREE)], ids=["inside", "free"])
def test_no_ball_hangs(may_overlap: bool, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(count):
        with monkeypatch.context() as patch:
            play(scene_at_random(seed, may_overlap=may_overlap), patch)
