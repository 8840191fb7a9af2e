"""The command line: `pitchlore`. Commands are loaded only when they are called."""

from __future__ import annotations

import os
import sys
import traceback

from cyclopts import App

from pipeline import __version__
from pipeline.errors import PitchloreError

app = App(
    name="pitchlore",
    version=__version__,
    help="Recorded robot-soccer matches in; situations, behaviours, knowledge and a trained policy out.",
)
app.command("flows.commands.recordings:import_files", name="import")
app.command("flows.commands.recordings:run", name="run")
app.command("flows.commands.recordings:train", name="train")
app.command("flows.commands.recordings:serve", name="serve")
app.command("flows.commands.knowledge:app", name="kb")
app.command("flows.commands.look:sql", name="sql")
app.command("flows.commands.look:situations", name="situations")
app.command("flows.commands.look:replay", name="replay")


def main(arguments: list[str] | None = None) -> None:
    """Run a command; exit code 0 only on success, errors in one line."""
    words = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in words
    _quiet_prefect(debug)
    try:
        app(words)
    except PitchloreError as error:
        if debug:
            traceback.print_exc()
        _fail(str(error), 1)
    except KeyboardInterrupt:
        _fail("Stopped. What was finished is kept; run the command again to go on.", 130)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except Exception as error:
        if debug:
            traceback.print_exc()
        what = f"Unexpected {type(error).__name__}: {error}"
        _fail(f"{what}. Run again with --debug and report what it says.", 1)


def _fail(line: str, code: int) -> None:
    print(f"pitchlore: {line}", file=sys.stderr)  # noqa: T201 (this is the command line)
    sys.exit(code)


def _quiet_prefect(debug: bool) -> None:
    """Let Prefect run embedded, unless its user has set it up otherwise, and speak only when asked."""
    for name, value in (
        ("PREFECT_SERVER_ALLOW_EPHEMERAL_MODE", "true"),
        ("PREFECT_SERVER_ANALYTICS_ENABLED", "false"),
        ("PREFECT_LOGGING_LEVEL", "INFO" if debug else "CRITICAL"),
        ("PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW", "ignore"),
    ):
        os.environ.setdefault(name, value)
