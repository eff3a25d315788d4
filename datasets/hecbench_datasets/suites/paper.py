"""The suite `paper`: the studies of DRHeC's publication, in the scenes of the suite `synthetic`.

Each level names the solvers that it is meant for; `--solver` asks for others. The renderer of the scenes is the
solvers' own: the levels show convergence, not accuracy.

- `LP`, `MP`, `HP` (Table I): the methods, those of DRHeC in both variants, and render_gn. One view of LP is also the
  first column of the studies of views, wrong geometry and appearance.
- `lambda_cen`, `lambda_area`, `threshold` (Tables VI to VIII): DRHeC with five values each. The publication mixes
  LP and MP in unknown shares; here even items are LP's, odd ones MP's, in the order of their own suites.
- `views_3`, `views_5`: more views of the scenes of LP.
- `mismatch_1`, `mismatch_3`, `mismatch_5`: wrong geometry in the scenes of LP.
- `gain` and the other levels of changed appearance: with and without the translator `part_colours`.
"""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import SuiteSpec
from hecbench_datasets.suites import synthetic

ABLATIONS = {
    "lambda_cen": ("0", "0.1", "0.01", "0.001", "0.0001"),
    "lambda_area": ("0", "0.1", "0.01", "0.001", "0.0001"),
    "threshold": ("0", "0.2", "0.25", "0.3", "0.5"),
}
"""Option of drhec and its values in the publication."""

VARIANTS = ("resolved", "literal")
_APPEARANCE = (*synthetic.CHANGES, "colours", "joint_noise")
LEVELS = (*synthetic.START_RANGES_M, *ABLATIONS, *synthetic.VIEWS, *synthetic.MISMATCH, *_APPEARANCE)

_TABLE_ONE = (
    "easyhec",
    "easyhecpp",
    "ipe",
    *(name if variant == "resolved" else f"{name}[variant={variant}]"
      for name in ("drhec_rgb", "drhec_rgbc", "drhec") for variant in VARIANTS),
    "render_gn",
)  # fmt: skip
_ONE_OF_EACH = ("easyhec", "ipe", "drhec", "render_gn")


def solvers(level: str) -> tuple[str, ...]:
    """The solvers that a level is meant for."""
    if level in synthetic.START_RANGES_M:
        return _TABLE_ONE
    if level in ABLATIONS:
        settings = (f"{level}={value}" for value in ABLATIONS[level])
        return tuple(
            f"drhec[{setting}]" if variant == "resolved" else f"drhec[{setting},variant={variant}]"
            for setting in settings
            for variant in VARIANTS
        )
    if level in _APPEARANCE:
        return (*_ONE_OF_EACH, "drhec[translator=part_colours]")
    return _ONE_OF_EACH


def make(level: str, index: int, seed: int) -> Recording:
    """One item; it depends on nothing but the three numbers."""
    if level in ABLATIONS:
        return synthetic.make(("LP", "MP")[index % 2], index // 2, seed)
    return synthetic.make(level, index, seed)


def facts(level: str, index: int, seed: int) -> dict[str, float]:
    """What the scene's own suite tells about it."""
    return {} if level in ABLATIONS else synthetic.facts(level, index, seed)


@hookimpl
def hecbench_suites() -> Iterable[SuiteSpec]:
    yield SuiteSpec(
        name="paper",
        summary="the studies of DRHeC's publication: starts, losses, thresholds, views, wrong geometry, appearance",
        levels=LEVELS,
        default_samples=50,
        make=make,
        solvers=solvers,
        facts=facts,
    )
