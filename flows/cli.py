"""The command line: `pitchlore`. Commands are loaded only when they are called."""

from __future__ import annotations

import atexit
import errno
import logging
import os
import shlex
import sys
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple, NoReturn

from pitchlore.flows import left_out
from pitchlore.flows.surroundings import check_surroundings, speak_utf8
from pitchlore.pipeline.base.errors import PitchloreError, in_one_line, not_readable
from pitchlore.pipeline.base.software import __version__
from pitchlore.pipeline.base.text import printable
from pitchlore.pipeline.engine.child import collect_rarely, hold_threads, hush, library_threads
from pitchlore.pipeline.engine.interrupt import interruptible

if TYPE_CHECKING:
    from cyclopts import App

#: Pitchlore in one sentence, as README, the site and the package say it, too.
ABOUT = ("Pitchlore reads recorded robot-soccer matches, shows what went with winning and losing, "
         "and trains a team.")

#: Most characters of a line on words that no command takes.
_CHARACTERS = 500

PLAY = """Play a match yourself, with the keyboard or a gamepad. It is logged like any other match.

You drive the robot with the ring. The other robots of your team play as the team static does. If you leave
before the final whistle, the match so far is kept.

Keys: arrows or WASD drive. Space is full speed: alone straight ahead, with left or right a spin that hits
the ball. Tab takes the next robot, E the robot nearest to the ball, P pauses, Esc leaves.

Gamepad (names of an Xbox pad): left stick or cross drive, A is full speed, X or right shoulder takes the
next robot, B the nearest, Start pauses, Back leaves.
"""


class Command(NamedTuple):
    """A command of the command line.

    Attributes:
        name: words to type; the second word of two is a command of a group.
        target: module in flows.commands and function, imported when the command is called.
        help: effect, in a sentence or more.
        example: a whole line that can be typed.
    """

    name: str
    target: str
    help: str
    example: str


#: Commands that are asked for by two words.
GROUPS = {
    "kb": "List, show, compare and verify the versions of the knowledge.",
    "policy": "Show what a policy holds.",
    "server": "Keep a Prefect server for the data folder. Later commands find and use it.",
}

#: Commands by the part of the help that lists them. Commands of two words stand where the first of their
#: group does.
PANELS = {
    "Start": (
        Command(
            "demo", "demo:demo",
            "Take a recording and three played matches through every stage, and show the results.",
            "pitchlore demo derby.csv",
        ),
        Command(
            "import", "import_:import_files",
            "Import recordings of matches, as logs or tracking tables.",
            "pitchlore import derby.csv --map our-camera.toml",
        ),
        Command(
            "run", "run:run",
            "Bring everything up to date: import the inbox, run every stage, emit knowledge, train a policy.",
            "pitchlore run --settings club.toml",
        ),
        Command(
            "watch", "watch:watch_match",
            "Record the match that is being played, by the packets of a league's cameras and referee.",
            "pitchlore watch ssl --interface 192.168.1.20",
        ),
        Command(
            "serve", "serve:serve",
            "Call `run` on a schedule, until Ctrl-C; brings a Prefect server if there is none.",
            'pitchlore serve --cron "0 6 * * 1"',
        ),
    ),
    "Look": (
        Command(
            "scout", "scout:scout",
            "Write pages on teams, matches and behaviours, with clips; they open from disk.",
            "pitchlore scout --open",
        ),
        Command(
            "replay", "replay:replay",
            "Write a match as a web page with pitch, situations and goals, or a part of it as a GIF.",
            "pitchlore replay rsim-vss-3v3 --gif derby.gif --from 60 --seconds 20",
        ),
        Command(
            "commentary", "commentary:commentary",
            "Tell a match in words: goals and how they came about, chances, restarts, possession, numbers.",
            "pitchlore commentary rsim-vss-3v3 --goals",
        ),
        Command(
            "sql", "sql:sql",
            "Query the catalogue in DuckDB's SQL, read-only.",
            'pitchlore sql "select name, count(*) n from situations group by all order by n desc"',
        ),
        Command(
            "export", "export:export",
            "Write a match as CSV or Parquet, for kloppy and floodlight, for Foxglove or Rerun.",
            "pitchlore export rsim-vss-3v3 --to rerun",
        ),
        Command(
            "notebooks", "notebooks:notebooks",
            "Copy Pitchlore's notebooks into a folder, and open them in JupyterLab.",
            "pitchlore notebooks --data league",
        ),
        Command(
            "situations", "situations:situations",
            "Print the rules of all situations, or their fuzzy terms.",
            "pitchlore situations --terms --kind ssl",
        ),
        Command(
            "kb list", "kb:list_versions",
            "List the versions of the knowledge.",
            "pitchlore kb list",
        ),
        Command(
            "kb show", "kb:show",
            "Show the behaviours of a version, the newest by default.",
            "pitchlore kb show 3",
        ),
        Command(
            "kb diff", "kb:diff",
            "Show what changed from one version to another, the newest by default.",
            "pitchlore kb diff 1 2",
        ),
        Command(
            "policy show", "policy:show",
            "Show the states of a policy in words, the newest by default, and how sure it is in each.",
            "pitchlore policy show --role striker --unsure",
        ),
        Command(
            "report", "report:report",
            "Write a report on all seasons: the paper's tables, figures and claims beside ours.",
            "pitchlore report --export season-report",
        ),
    ),
    "Play": (
        Command(
            "play", "play:play",
            PLAY,
            "pitchlore play --against static --minutes 2",
        ),
        Command(
            "record", "record:record_matches",
            "Play matches in the simulator and log them.",
            "pitchlore record --home static --away random --seed 7 --matches 3",
        ),
        Command(
            "evaluate", "evaluate:evaluate_team",
            "Measure a team by many matches: pairs of one seed with sides swapped, and 95 % intervals.",
            "pitchlore evaluate --policy best-static-1 --against static --matches 200",
        ),
        Command(
            "train", "train:train",
            "Train the next policy version on the newest knowledge.",
            "pitchlore train --settings longer.toml",
        ),
        Command(
            "imitate", "imitate:imitate",
            "Rebuild a team from its recordings; it plays as imitated:TEAM.",
            'pitchlore imitate "FC Portugal"',
        ),
        Command(
            "season", "season:season",
            "Play seasons: in each game play, watch the opponent, and learn for the next game.",
            "pitchlore season --settings paper --seasons 5",
        ),
        Command(
            "drive", "drive:drive_robots",
            "Let a team drive robots that another program simulates, until Ctrl-C.",
            "pitchlore drive --team best-in-games-static-101 --as blue --protocol vsss",
        ),
        Command(
            "minari", "minari:minari",
            "Write the decisions of matches as a Minari dataset, for offline learners.",
            "pitchlore minari derby/decisions-v0 rsim-vss-3v3",
        ),
        Command(
            "paradigms", "paradigms:paradigms",
            "Play the paper's three games with its learners and with others, and judge its claims.",
            "pitchlore paradigms --figure 5 --runs 2000",
        ),
    ),
    "Maintain": (
        Command(
            "runs", "runs:runs",
            "List the last runs: start, length, what was made, failures, cost.",
            "pitchlore runs --last 5",
        ),
        Command(
            "quarantine", "quarantine:quarantine",
            "List the quarantine: recordings and matches that a stage refused, and the reasons.",
            "pitchlore quarantine --clear",
        ),
        Command(
            "forget", "forget:forget",
            "Remove a match and all that was made from it, but for knowledge and policies.",
            "pitchlore forget derby-1f2e3d4c5b6a",
        ),
        Command(
            "verify", "verify:verify",
            "Check every byte of the data folder, and restore damaged files from a backup.",
            "pitchlore verify --restore-from /mnt/backup/league",
        ),
        Command(
            "prune", "prune:prune",
            "Remove superseded files: those that no receipt names any more.",
            "pitchlore prune",
        ),
        Command(
            "kb verify", "kb:verify",
            "Check every file of every version (or of one) against its SHA-256, or restore it from a backup.",
            "pitchlore kb verify --restore-from /mnt/backup/league",
        ),
        Command(
            "server start", "server:start",
            "Start the data folder's Prefect server, and print the address of its pages.",
            "pitchlore server start",
        ),
        Command(
            "server stop", "server:stop", "Stop the data folder's Prefect server.", "pitchlore server stop",
        ),
        Command(
            "server status", "server:status",
            "Say whether the data folder's Prefect server runs, and where.",
            "pitchlore server status",
        ),
    ),
}
COMMANDS = tuple(command for panel in PANELS.values() for command in panel)


def command_line() -> App:
    """The command line of all commands."""
    from cyclopts import App, Group  # noqa: PLC0415 (see _call)

    app = App(
        name="pitchlore",
        version=__version__,
        help=ABOUT,
        suppress_keyboard_interrupt=False,  # see pipeline.engine.interrupt
        result_action="return_value",  # else it exits, before the output is flushed
    )
    rest = Group("Options", sort_key=len(PANELS))
    for flag in ("--help", "--version"):
        app[flag].group = rest
    groups: dict[str, App] = {}
    for place, (title, commands) in enumerate(PANELS.items()):
        panel = Group(title, sort_key=place)
        for command in commands:
            rank = COMMANDS.index(command)
            first, _, second = command.name.partition(" ")
            if second and first not in groups:
                groups[first] = App(name=first, help=GROUPS[first], group=panel, sort_key=rank)
                app.command(groups[first])
            (groups[first] if second else app).command(
                f"pitchlore.flows.commands.{command.target}", name=second or first, help=command.help,
                help_epilogue=f"Example: {command.example}", group=None if second else panel, sort_key=rank)
    return app


def script() -> None:
    """Run the command of the command line, and leave without unwinding the threads that still run.

    Some are Prefect's. If such a thread is in compiled code when Python unwinds it, the process aborts.
    """
    speak_utf8()
    collect_rarely()
    code = 1

    def leave() -> None:
        with suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)

    atexit.register(leave)  # before all others: it is called last
    try:
        main()
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else int(error.code is not None)
        raise


def main(arguments: list[str] | None = None) -> None:
    """Run a command, and exit: 0 on success, 3 if damaged files were left out, else 1 and a line."""
    words = sys.argv[1:] if arguments is None else arguments
    _open_streams()
    try:
        check_surroundings(words)
    except PitchloreError as error:
        _fail(str(error))
    hold_threads(library_threads(words))
    os.environ["PYTHONSAFEPATH"] = "1"  # processes of ours load no modules of the working directory
    left_out.begin()
    with interruptible() as interrupted:
        _call(words, interrupted, debug="--debug" in words)
    sys.exit(left_out.exit_code())


def _open_streams() -> None:
    """Let standard streams that are closed lead nowhere, so that no file of ours gets their numbers."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, open(number, "r" if name == "stdin" else "w"))  # noqa: SIM115, PTH123 (stays open)


def _call(words: list[str], interrupted: Callable[[], bool], *, debug: bool) -> None:
    from cyclopts import CycloptsError, UnusedCliTokensError  # noqa: PLC0415 (Ctrl-C is heard before anything slow is loaded)

    _quiet_prefect(debug)
    _show_notices()
    try:
        with warnings.catch_warnings():
            if not debug and not sys.warnoptions:
                warnings.simplefilter("ignore")
            command_line()(words, exit_on_error=False, print_error=False)
            sys.stdout.flush()
    except CycloptsError as error:
        command = " ".join(("pitchlore", *(error.command_chain or ())))
        said = " ".join(str(error).split())
        if isinstance(error, UnusedCliTokensError) and error.unused_tokens:
            said = _too_many(command, error.unused_tokens)
        _fail(f"{printable(said, _CHARACTERS)} See `{command} --help`.")
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except Exception as error:
        if interrupted():
            return
        if debug:
            traceback.print_exc()
        _fail(str(error) if isinstance(error, PitchloreError) else _unforeseen(error))


def _too_many(command: str, words: list[str]) -> str:
    """A sentence on words that a command does not take; a file or folder among them is to be imported."""
    file = next((word for word in words if not word.startswith("-") and os.path.exists(word)), None)  # noqa: PTH110 (Path raises at long ones)
    if file is not None:
        return f"`{command}` takes no files: `pitchlore import {shlex.quote(file)}` first."
    return f"`{command}` does not take the word{'s' * (len(words) > 1)} {', '.join(words)}."


def _unforeseen(error: Exception) -> str:
    """One line on an error that is not ours. A value that settings refuse came from the user."""
    if isinstance(error, OSError) and error.filename is None and error.errno in (errno.ENOSPC, errno.EBADF):
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # so that Python does not try again at its end
        return f"standard output: cannot be written ({error.strerror}). Free space or name another."
    if isinstance(error, OSError) and error.filename is not None and error.errno is not None:
        return str(not_readable(os.fsdecode(error.filename), error, "Look what is there, then call it again"))
    if isinstance(error, UnicodeEncodeError):
        return (f"standard output: its encoding {error.encoding} has no {error.object[error.start]!a}. "
                "Set PYTHONIOENCODING=utf-8, or ask with --json.")
    if isinstance(error, BlockingIOError) or "can't start new thread" in str(error):
        return f"no more processes or threads may be started ({in_one_line(error)}). Allow more: ulimit -u."
    if any(words in str(error) for words in ("no locator available", "determine home directory")):
        return ("this user has no home in which compiled functions and other caches can be kept "
                f"({in_one_line(error)}). Set HOME or XDG_CACHE_HOME to a folder in which you may write.")
    if isinstance(error, OverflowError | MemoryError):
        return f"a number is too large, or memory too small ({in_one_line(error)}). Give smaller numbers."
    if type(error).__name__ == "SettingsError":
        return (f"Prefect's settings cannot be read ({in_one_line(error)}). Mend its profile, or what is in "
                "this folder: prefect.toml, pyproject.toml or .env.")
    from pydantic import ValidationError  # noqa: PLC0415 (only what fails waits for it)

    from pitchlore.pipeline.base.toml import unfit  # noqa: PLC0415

    if isinstance(error, ValidationError):
        return str(unfit(error, error.title, "Mend the option or the file that gives it"))
    return f"Unexpected {in_one_line(error)}. Run again with --debug and report what it says."


def _fail(line: str) -> NoReturn:
    print(f"pitchlore: {line}", file=sys.stderr)  # noqa: T201 (this is the command line)
    sys.exit(1)


class _Notices(logging.Handler):
    """Writes to what is standard error at that moment."""

    def emit(self, record: logging.LogRecord) -> None:
        print(self.format(record), file=sys.stderr)  # noqa: T201 (this is the command line)


def _show_notices() -> None:
    """Write to standard error what the store says while it waits."""
    notices = logging.getLogger("pitchlore")
    if not notices.handlers:
        shown = _Notices()
        shown.setFormatter(logging.Formatter("pitchlore: %(message)s"))
        notices.addHandler(shown)
        notices.propagate = False


def _quiet_prefect(debug: bool) -> None:
    """Let Prefect speak only when asked, unless its user has set it up otherwise."""
    for name, value in (
        ("PREFECT_SERVER_ANALYTICS_ENABLED", "false"),
        ("DO_NOT_TRACK", "1"),
        ("PREFECT_LOGGING_LEVEL", "INFO" if debug else "CRITICAL"),
        ("PREFECT_INTERNAL_LOGGING_LEVEL", "WARNING" if debug else "CRITICAL"),
        ("PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW", "ignore"),
    ):
        os.environ.setdefault(name, value)
    if not debug:
        hush()
