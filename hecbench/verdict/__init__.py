"""What a person can act on: which answer to use, how wrong it may be, why, and what would make it better.

Pure logic on estimates and the findings of `check`; nothing of the truth enters.
"""

from hecbench.verdict.judge import TOLERANCE_MM as TOLERANCE_MM
from hecbench.verdict.judge import judge as judge
from hecbench.verdict.result import Expected as Expected
from hecbench.verdict.result import Grade as Grade
from hecbench.verdict.result import Verdict as Verdict
from hecbench.verdict.result import load as load
