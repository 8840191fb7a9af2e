"""The command line: `pitchlore`. Commands are loaded only when they are called."""

from __future__ import annotations

import os
import sys
import traceback

from cyclopts import App, CycloptsError

from pipeline import __version__
from pipeline.errors import PitchloreError, in_one_line

app = App(
    name="pitchlore",
    version=__version__,
    help="Recorded robot-soccer matches in; situations, behaviours, knowledge and a trained policy out.",
    suppress_keyboard_interrupt=False,  # main says what it leaves
)

PLAY = """Play a match yourself, at the keyboard or with a gamepad; it is logged like any other.

You drive one robot, the one with the ring; the others of your team play the rules of static. Who leaves
before the final whistle keeps the match so far.

Keys: arrows or WASD drive, Space full speed (alone: ahead; with left or right: the spin that hits the
ball), Tab next robot, E the one nearest to the ball, P pause, Esc leave.

Gamepad (an Xbox pad's names): left stick or cross drive, A full speed, X or right shoulder next robot,
B nearest, Start pause, Back leave.
"""
#: Where each command is, what it does, and an example; they are imported when they are called.
COMMANDS = (
    (
        "import", "recordings:import_files",
        "Import recordings: tracking tables (Parquet, CSV), RoboCup 2D logs (.rcg), our own logs (.mcap).",
        "pitchlore import derby.csv --map our-camera.toml",
    ),
    (
        "record", "play:record_matches",
        "Play matches between teams in the simulator and log them.",
        "pitchlore record --home static --away random --seed 7 --matches 3",
    ),
    (
        "season", "season:season",
        "Play seasons: play, watch the adversary, learn, play again.",
        "pitchlore season --settings paper --seasons 5",
    ),
    (
        "evaluate", "evaluations:evaluations",
        "Measure a policy, a season's apprentice or a scripted team: matches in pairs, 95 % intervals.",
        "pitchlore evaluate --policy best-static-1 --against static --matches 200",
    ),
    (
        "play", "human:play",
        PLAY,
        "pitchlore play --against static --minutes 2",
    ),
    (
        "run", "recordings:run",
        "Bring every stage up to date with what is new: the inbox, all matches, knowledge, policy.",
        "pitchlore run --settings club.toml",
    ),
    (
        "train", "recordings:train", "Train the next policy version on the newest knowledge.",
        "pitchlore train --settings longer.toml",
    ),
    (
        "serve", "recordings:serve",
        "Stay and run everything new on a schedule; needs a Prefect server (PREFECT_API_URL).",
        'pitchlore serve --cron "0 6 * * 1"',
    ),
    (
        "sql", "look:sql", "Ask the catalogue in SQL (DuckDB's), read-only.",
        'pitchlore sql "select name, count(*) n from situations group by all order by n desc"',
    ),
    (
        "notebooks", "notebooks:notebooks",
        "Copy the notebooks that come along into a folder, and open them in JupyterLab.",
        "pitchlore notebooks --data league",
    ),
    (
        "situations", "look:situations",
        "Print the rules of the 31 situations, or the fuzzy terms they are made of.",
        "pitchlore situations --terms --kind ssl",
    ),
    (
        "paradigms", "paradigms:paradigms",
        "Play the paper's three games with its learners and their peers, and judge its claims.",
        "pitchlore paradigms --figure 5 --runs 2000",
    ),
    (
        "report", "report:report",
        "Report on all seasons: Table 3 and Figures 8 to 10 beside the paper's, claims with verdicts, plots.",
        "pitchlore report --export data/studies/seasons",
    ),
    (
        "quarantine", "upkeep:quarantine", "List what could not be taken, by which stage and why.",
        "pitchlore quarantine --clear",
    ),
    (
        "forget", "upkeep:forget",
        "Remove a match and all that was made of it; knowledge and policies keep what they learned.",
        "pitchlore forget derby-1f2e3d4c5b6a",
    ),
    (
        "prune", "upkeep:prune",
        "Remove the files of earlier settings or code that nothing refers to any more.",
        "pitchlore prune",
    ),
    (
        "replay", "look:replay",
        "Write a match as one web page: the pitch, the situations, the goals; or some seconds as a GIF.",
        "pitchlore replay rsim-vss-3v3 --gif derby.gif --from 60 --seconds 20",
    ),
    (
        "commentary", "look:commentary",
        "Tell a match: goals and what led to them, chances, restarts, who has the ball; and its numbers.",
        "pitchlore commentary rsim-vss-3v3 --goals",
    ),
)
for name, target, meaning, example in COMMANDS:
    app.command(f"flows.commands.{target}", name=name, help=meaning, help_epilogue=f"Example: {example}")
app.command("flows.commands.knowledge:app", name="kb",
            help="List, show, compare and verify the versions of the knowledge.")


def main(arguments: list[str] | None = None) -> None:
    """Run a command; exit code 0 only on success, errors in one line."""
    words = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in words
    _quiet_prefect(debug)
    try:
        app(words, exit_on_error=False, print_error=False)
    except CycloptsError as error:
        command = " ".join(("pitchlore", *(error.command_chain or ())))
        _fail(f"{' '.join(str(error).split())} See `{command} --help`.", 1)
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
        _fail(_unforeseen(error), 1)


def _unforeseen(error: Exception) -> str:
    """One line on an error that is not ours; a value that no settings take was given by whoever called."""
    from pydantic import ValidationError  # noqa: PLC0415 (only what fails waits for it)

    from pipeline.settings import unfit  # noqa: PLC0415

    if isinstance(error, ValidationError):
        return str(unfit(error, error.title, "Mend the option or the file that says so"))
    return f"Unexpected {in_one_line(error)}. Run again with --debug and report what it says."


def _fail(line: str, code: int) -> None:
    print(f"pitchlore: {line}", file=sys.stderr)  # noqa: T201 (this is the command line)
    sys.exit(code)


def _quiet_prefect(debug: bool) -> None:
    """Let Prefect run embedded, unless its user has set it up otherwise, and speak only when asked."""
    for name, value in (
        ("PREFECT_SERVER_ALLOW_EPHEMERAL_MODE", "true"),
        ("PREFECT_SERVER_ANALYTICS_ENABLED", "false"),
        ("PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS", "120"),  # a busy machine is no failure
        ("PREFECT_LOGGING_LEVEL", "INFO" if debug else "CRITICAL"),
        ("PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW", "ignore"),
    ):
        os.environ.setdefault(name, value)
