"""Tables I, IV and V of docs/paper.md, from docs/data/campaigns.json (`store_figures.py`)."""

from hecbench.report import paper
from hecbench.report.maskless import RIGHT_DEG, RIGHT_MM
from hecbench.report.scores import SUCCESSES
from hecbench.report.trials import PAPER_PCT
from hecbench.storage.trial_record import TASKS

LIMIT = "{:g} mm and {:g} rad".format(*SUCCESSES[0])


def percent(rate):
    """A share with its interval, percent."""
    low, high = (100 * end for end in rate["interval"])
    return f"{rate['successes']} of {rate['n']}, {100 * rate['successes'] / rate['n']:.0f} [{low:.0f}, {high:.0f}] %"


def mean(found):
    return "-" if found is None else "{:.3g} [{:.3g}, {:.3g}]".format(*found["mean"])


def median(found):
    return "-" if found is None else "{:.3g} [{:.3g}, {:.3g}]".format(*found["median"])


def table_one(found):
    """Rows of the start levels, the paper's DRHeC above ours; and the claim."""
    lines = [f"| level | whose | n | mean mm | median mm | largest mm | within {LIMIT} |", "|" + "---|" * 7]
    for level in paper.LEVELS:
        theirs = paper.TABLE_ONE[level]["DRHeC"]
        lines.append(
            f"| {level} | paper, DRHeC | {paper.RUNS_PER_LEVEL} | {theirs.mean_mm} | not said | {theirs.largest_mm} | "
            "not said |"
        )
        for name, ours in found.items():
            if name.startswith(f"{level}, "):
                off = ours["base_in_camera_mm"]
                lines.append(
                    f"| | `{name.partition(', ')[2]}` | {ours['near']['n']} | {mean(off)} | {median(off)} | "
                    f"{off['largest']:.3g} | {percent(ours['near'])} |"
                )
    return ["## Table I: from starts that are off", "", *lines, "", claim(found), ""]


def claim(found):
    """At how many of the start levels `render_gn` is better than the paper's method."""
    ours = {level: found[name] for level in paper.LEVELS if (name := f"{level}, render_gn") in found}
    if not ours:
        return "`render_gn` was not run."
    better = sum(
        row["base_in_camera_mm"]["mean"][2] < paper.TABLE_ONE[level]["DRHeC"].mean_mm
        for level, row in ours.items()
    )
    said = "at every level" if better == len(paper.LEVELS) else f"at {better} of {len(paper.LEVELS)} levels"
    return (
        f"The mean of `render_gn` lies below that of DRHeC {said}, its whole interval included. Both are drawn by the "
        "method's own renderer: they show convergence, not accuracy."
    )


def methods_of(found, robot):
    """The methods with trials of an arm."""
    return {name.split(", ")[2] for name in found if name.startswith(f"{robot}, ")}


def trial_rows(found, robot, kind):
    """A row for each method: ours, the paper's percent beside it."""
    for method in sorted(methods_of(found, robot)):
        cells = []
        for place, task in enumerate(TASKS):
            ours = found.get(f"{robot}, {task}, {method}")
            theirs = PAPER_PCT.get(robot, {}).get(method)
            cells += ["-" if ours is None else percent(ours["success"])]
            cells += ["-" if theirs is None else f"{theirs[place]:g} %"]
        yield f"| `{method}` | {kind} | {' | '.join(cells)} |"


def trial_table(robot, title, campaigns):
    """Grasps and insertions of all campaigns of an arm, then the paper's rows that have none of ours."""
    lines = ["| method | from | grasp | paper | insertion | paper |", "|" + "---|" * 6]
    shown = set()
    for kind, found in campaigns.items():
        lines += trial_rows(found, robot, kind)
        shown |= methods_of(found, robot)
    for method, (grasp, insertion) in PAPER_PCT[robot].items():
        if method not in shown:
            lines.append(f"| `{method}` | | not run | {grasp:g} % | not run | {insertion:g} % |")
    return [f"## {title}", "", *lines, ""]


def photographs(found):
    """What calibrations from photographs came to."""
    lines = ["| solver | answered | right | wrong | camera centre, median mm | seconds |", "|" + "---|" * 6]
    for name, ours in found.items():
        lines.append(
            f"| `{name.partition(', ')[2]}` | {percent(ours['answered'])} | {percent(ours['right'])} | {ours['wrong']} "
            f"| {median(ours['camera_centre_mm'])} | {ours['seconds_median']:.3g} |"
        )
    head = (
        "Ten photographs of 640x480 px from each of 18 cameras, with noise of 5 of 255, shadows and clutter, without "
        f"masks. Right is below {RIGHT_MM:g} mm and {RIGHT_DEG:g} deg; a wrong answer is worse than none."
    )
    return ["## From photographs", "", head, "", *lines, ""]


def sections(data):
    """What docs/data/campaigns.json holds, as lines of the page."""
    found = {name: campaign["figures"] for name, campaign in data.items()}
    lines = table_one(found["table one"]) if "table one" in found else []
    if "photographs" in found:
        lines += photographs(found["photographs"])
    campaigns = {
        "tags": found.get("marker trials", {}),
        "photographs": found.get("photographs trials", {}),
    }
    if any(campaigns.values()):
        lines += trial_table("ur5e", "Table IV: grasps and insertions, UR5e", campaigns)
        lines += [
            "Ours are of the virtual lab: an exact arm, the workpiece seen exactly, 2 mm clearance. The paper's are of "
            "a real arm and real photographs. A calibration without an answer counts as failed trials.",
            "",
        ]
    return lines
