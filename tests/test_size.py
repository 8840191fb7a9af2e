"""The core's size: all that a recording needs on its way from bytes to a policy.

Lines count that have something on them, docstrings and comments among them. A capability that needs more of
them raises :data:`MOST` in the same commit and says why, after looking for what it makes unnecessary. It was
22,000 before habits were part of the knowledge, a league wrote datasets of LeRobot, and tables and logs had the
options which a team logs; what these made unnecessary is gone, and 47 more are left. Reading
football always apart takes 22: its own room of time and memory, and a start that runs no script again. Options have a bound of
their own: the executors, which once lay with the arena, their stage, and what rebuilds a team from them.

Logs as other programs write them took 155 more: their order, the holes in their numbers, chunks of several
frames, and a match that no metadata describe. Directions of attack that a source tells took 4.

Tables as people have them took 23 more: periods, parts of a pitch, a score that is nobody's. What finds facts that
tables leave unsaid, and other words for columns, lie beside the core (pipeline/importers/forms).

A recording may have several matches, and a match a shoot-out: 38. Of one that shows no course of play nothing is
learned: 37. What SSL's referee and trackers tell lies beside the core, but for the 14 lines that put it into tables.

A role that nothing pays may keep what it usually does: 11 more, in the selection and its setting.

Logs of rcssserver in JSON, and several logs in a file, took 128; that their damage costs little time, and absurd
numbers in topics no match, 15.

A worker that runs from a checkout which is not installed took 11.

Options of robots that drive otherwise than those of our arena took 4, and 136 of options: motors and bodies are
measured in the recording, for nothing else tells them.

A look at a league of any size took 220: of matches whose rows are in closed parts nothing is read, and where no folder
has changed nothing is looked at. The parts themselves lie beside the core. That a run tells where its clock goes took 26.

One more match took 79: grams are counted by compiled code in one pass, in a quarter of the time. Mends to other work of
that day (parts that stay, records in a command's own process, doubts about tables) took 16.

Compiling takes half the time of a first match with 66 more: two forms of a compiled function, and loops in place of
what is long to compile.

A table whose rows are frame after frame is not sorted, nor are its numbers looked through for commas: 16, for half of
an import's time.

That a run ends with a copy, made of as many matches as that takes, and says so or why not, took 55; 67 of options.

What needs no compiled code stands in a module of its own, so that a replay loads none: 5.

A path that a user names is read in one place, which knows homes: 18.

That receipts say which trees weighed clues of measured robots took 8.

A wrong key of settings is answered with the one that was meant, in its table or another: 20.

A catalogue that moves with its folder, and is made in memory where nothing can be written, took 43.

The limits of a process are read at the door to the system: 7.

That few matches start no processes, and that libraries have the threads of the place, took 43.

Analysts' tables lie beside the core, but for their settings and their entries in the lists of stages and tables: 49.

Behaviours that went with worse chances stand beside the others, with how sure they are among so many, and in an order
for people: 75.

A stage that people are told and nothing is learned from, and a table that is a view of others, took 41; what they
tell lies beside the core.

V has the level of a league's own goals from the first match on: 23.

That a copy stands until a third of its poses is new and says of which matches it is, and that what it takes is done by
the processes of a run, took 29; 88 of options.

What cannot be read is not absent: 145. What is damaged is told from what the system refuses, answers go on without it
and say so, versions list what they lack, a receipt comes back from its log; three ways to read a cache became one.

That a push is no kick where another may have kicked took 2.

That an export removes what one that was killed has left in a folder of the user's took 2.

That a kick-off's first touch is no shot, and that the passes are the tried ones that arrive, took 15.

That the newest match is the last by its day, told by its times or its file's name, and not by the alphabet, took 20,
and 2 of options. That a team of another league has no copy took 2 of options.

That nobody waits for a pipe in the place of a file, and that the receipt of another output is damage, took 26; files
of ours are opened in one place.

That a 2D log's stamina is a table took 22: some lines are kept, of JSON, too, and the table is in the lists of tables.
Its reader and schema lie beside the core, and its rows take the way of what SSL's referee tells.

That a look keeps no receipts took 61: 37 MiB for 1,000 matches in place of 122.

That a query names the file that it may not open took 9; the check is that of who makes the catalogue.
That true is no number in settings, and a path with a NUL none, took 14.
That a receipt which is damaged in a bucket's copy alone is brought anew took 16.
That of two looks at once the older one's catalogue does not stay took 55, with a file of /proc, a disk's clock, a Ctrl-C into polars' types
and a Dask worker that is killed before it has begun.
That a catalogue to which another program has written, or which it holds, changes no answer, and that a table of another
version is said, took 36.
That restarts of tables without states are found from the ball took 217: before, play went on through penalties.
That a disk may not touch the times of folders took 5.

That numbers of settings have bounds, and text is no number, took 25; a score that is no whole number 5.

That a run with nothing new after another one asks no output took 77: at 10,000 matches 4.6 s of CPU in place of 18.

That the longer of two copies of a log stays, both cut off, took 5; an empty path, and a file without a beginning, 10.
What was forgotten while it was read is told from what is damaged: 9.

That the knowledge reads decisions in pieces, and that a run looks for damage with one list of files, took 27; that
decisions and occasions take less memory, by digests in blocks and names as numbers, 15.

That a clock that was ahead hides no run, and a recording that is written over is read again, took 7; that no password
of a URL is shown 5; that sockets of what is read apart leave no folder, and need no short path, 19; that
a half of a recording that was taken for the whole is named 29.
"""

from conftest import ROOT

MOST, MOST_OF_OPTIONS = 24_233, 1_795

#: Files of each room of the core, as patterns under the project's folder.
CORE = {
    "base": ("pipeline/__init__.py", "pipeline/settings.py", "pipeline/base/**/*.py"),
    "numbers": ("pipeline/numbers/**/*.py",),
    "game": ("pipeline/game/**/*.py",),
    "schemas": ("schemas/**/*.py", "schemas/**/*.msg"),
    "log": ("pipeline/matches/**/*.py",),
    "readers of tables and rcg": (
        "pipeline/importers/*.py", "pipeline/importers/tracking/**/*.py", "pipeline/importers/rcg/**/*.py"),
    "store": ("pipeline/store/**/*.py",),
    "stages": (
        *(f"pipeline/stages/{noun}/**/*.py" for noun in (
            "sides", "trajectories", "situations", "options", "events", "values", "sequences", "behaviours", "policies")),
        "pipeline/stages/goals.py", "pipeline/stages/decisions.py", "pipeline/stages/knowledge.py"),
    "state": ("pipeline/state/**/*.py",),
    "engine": ("pipeline/engine/**/*.py",),
    "face": ("pipeline/face/**/*.py",),
}
#: Files of these rooms that no recording needs: of buckets, of clusters, of large leagues, of matches that are played, of plans.
BESIDE = (
    "pipeline/store/buckets.py", "pipeline/store/mirrors.py", "pipeline/store/copy_index.py", "pipeline/store/parts.py",
    "pipeline/store/thinning.py", "pipeline/engine/thinning.py",
    "pipeline/engine/placement/cluster.py",
    *(f"pipeline/engine/{name}.py" for name in ("games", "season", "record", "evaluations", "paradigms", "starts", "teams", "planning")),
    "pipeline/face/environments.py", "pipeline/importers/rcg/stamina.py", "schemas/ssl.py", "schemas/analysis.py", "schemas/acts.py",
)


#: Files of options, which are not counted with their rooms.
OPTIONS = (
    "pipeline/game/tactics/executors/**/*.py", "pipeline/stages/options/**/*.py",
    "pipeline/engine/habits.py", "pipeline/engine/imitations.py", "schemas/options.py")


def sizes() -> dict[str, int]:
    """Lines with something on them, by room."""
    beside = {ROOT / name for name in BESIDE}
    assert all(path.exists() for path in beside)
    options = {path for pattern in OPTIONS for path in ROOT.glob(pattern)}
    files = {room: {path for pattern in patterns for path in ROOT.glob(pattern)} - beside - options
             for room, patterns in CORE.items()} | {"options": options}
    return {room: sum(bool(line.strip()) for path in paths for line in path.read_text().splitlines())
            for room, paths in files.items()}


def test_core():
    """The core fits; each of its rooms is there."""
    found = sizes()
    assert all(found.values()), found
    assert found.pop("options") <= MOST_OF_OPTIONS
    assert sum(found.values()) <= MOST, "\n".join(f"{lines:6,} {room}" for room, lines in found.items())
