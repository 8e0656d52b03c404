"""What a script has finished, kept so that the same command goes on after a stop."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from microsurf.files import whole_file

LATEST = Path(__file__).parents[1] / "reports" / "latest"


def once(path: Path, make: Callable[[], Any]) -> Any:
    """Return what ``make`` returns, as JSON has it: made now, or by an earlier call."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        content = make()
        with whole_file(path) as temporary:
            temporary.write_text(json.dumps(content), encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))
