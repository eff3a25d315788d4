"""What `check` finds in a recording whose robot poses were read the wrong way round."""

from dataclasses import replace

from hecbench import diagnose, registry, se3
from hecbench.specs import Kind, SuiteSpec

good = registry.load().get(Kind.SUITE, "markers", SuiteSpec).make("board_2m", 1, 0)
inverted = replace(good, base_T_flange=se3.inverse(good.base_T_flange))
for recording in (good, inverted):
    findings = diagnose.check(recording)
    serious = [finding for finding in findings if finding.severity == "critical"]
    print(f"{len(findings)} findings, {len(serious)} critical")
    for finding in serious:
        print(f"  {finding.summary}\n  -> {finding.action}")
