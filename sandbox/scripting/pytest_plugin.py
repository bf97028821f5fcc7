"""A plugin of pytest: the fixture `sandbox_compare` measures an engine in a test, and fails it beyond limits.

pytest loads it wherever the sandbox is installed, so it imports the rest of the sandbox only where a test uses it.
"""

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from sandbox.engines import Engines
    from sandbox.scripting.arguments import AnyInputs, AnyScene
    from sandbox.scripting.comparison_result import Comparison


class SandboxCompare:
    """Compares engines with a reference, and fails the test if one exceeds a limit: what the fixture returns."""

    def __call__(
        self,
        scene: "AnyScene",
        engines: "Engines",
        *,
        max_gap: float | None = None,
        max_drift: float | None = None,
        max_energy_error: float | None = None,
        against: str = "exact",
        seconds: float | None = None,
        seed: int | None = None,
        rate: int | None = None,
        inputs: "AnyInputs" = (),
    ) -> "Comparison":
        """Return the comparison of engines with the reference, if they keep within the limits.

        scene, engines, seconds, seed, rate, inputs: as in `sandbox.compare`; against: the reference, which need not be
        among the engines; max_gap: px, of any ball at any time; max_drift: of the energy, as a fraction;
        max_energy_error: from the reference's energy, as a fraction. Fails the test if an engine fails or exceeds a
        limit, with the causes and the figures.
        Raises SandboxError if an argument is wrong, Refused if an engine cannot run the scene.
        """
        __tracebackhide__ = True  # the line of the test is what matters
        from sandbox.engines import named  # noqa: PLC0415
        from sandbox.scripting.calls import compare  # noqa: PLC0415

        tested = named(engines)
        together = tested | {against: against}
        comparison = compare(scene, together, against=against, seconds=seconds, seed=seed, rate=rate, inputs=inputs)
        for error in comparison.failed.values():
            pytest.fail(f"{error}\n{error.details}")
        checks = comparison.exceeded(max_gap, max_drift, max_energy_error)
        if exceeded := [message for engine, message in checks if engine in tested]:
            pytest.fail("\n".join([*exceeded, "", comparison.table()]))
        return comparison


@pytest.fixture(scope="session")
def sandbox_compare() -> SandboxCompare:
    """Return a function that compares engines with the exact reference, and fails the test beyond limits."""
    return SandboxCompare()
