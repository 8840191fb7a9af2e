"""Receipts as an earlier version of Pitchlore wrote them: changed, and without a checksum of themselves."""

import json
from pathlib import Path
from typing import Any


def receipt_at(path: Path) -> dict[str, Any]:
    """The content of a receipt."""
    said: dict[str, Any] = json.loads(path.read_text())
    said.pop("checksum", None)
    return said


def put_receipt(path: Path, content: dict[str, Any], **changes: Any) -> None:
    """Write a receipt, changed."""
    path.write_text(json.dumps(content | changes))
