"""JSON files of figures, each under its name, with the command, commit and date that they come from."""

import json
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path


def command():
    """The one that this script was started by."""
    return " ".join(["python", f"benchmarks/{Path(sys.argv[0]).name}", *sys.argv[1:]])


def version():
    """Of the code, and today's date."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True
    )
    return {"commit": commit.stdout.strip(), "date": datetime.now(UTC).date().isoformat()}


def replace(path, figures):
    """Write figures by name; those that a file has of other names stay."""
    known = json.loads(path.read_text()) if path.exists() else {}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(known | figures, indent=1) + "\n")
