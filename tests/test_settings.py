"""Settings: what a TOML file may say, and how its errors are reported."""

from typing import get_args

import pytest
from annotated_types import Ge, Gt, Le, Lt
from pydantic import ValidationError

from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.settings import RoundSettings, RunSettings, Settings, parse_settings
from pitchlore.pipeline.stages.seasons.settings import SeasonSettings


def test_defaults():
    """A setting that is not given has its default."""
    assert parse_settings(b"", where="s.toml") == RunSettings()
    assert RunSettings.model_validate(RunSettings().model_dump()) == RunSettings(), "defaults keep to the bounds"
    said = parse_settings(b"[policies]\nsweeps = 3\n[knowledge]\nstate_key = 'ego19'", where="s.toml")
    assert said.policies.sweeps == 3
    assert said.policies.discount == Settings().policies.discount
    assert said.knowledge.state_keys == ("ego19", "self6", "role0")


@pytest.mark.parametrize(("text", "said"), [
    (b"policies = 3", "policies: "),
    (b"[policies]\nsweep = 3", "policies.sweep: there is no such key (did you mean sweeps?). Mend it; "),
    (b"alpha = 3", "alpha: there is no such key (did you mean grams.alpha?). Mend it; "),
    (b"[sides]\nxyz = 3", "sides.xyz: there is no such key, only watch, teams, kind, pools. Mend it; "),
    (b"[policies]\nsweeps = 0", "policies.sweeps: input should be greater than or equal to 1"),
    (b"[policies]\nstep_size = true", "policies.step_size: true does not fit"),
    (b"[policies]\nsweeps = '3'", 'policies.sweeps: "3" does not fit'),
    (b"[grams]\nwatched_s = '1'", 'grams.watched_s: "1" does not fit'),
    (b"[situations]\nrandom_longest_s = 1e-308",
     "situations.random_longest_s: input should be greater than or equal to 0.001"),
    (b"[models]\nblock_s = 1e30", "models.block_s: input should be less than or equal to 86400"),
    (b"[policies]\nstep_size = nan", "policies.step_size: input should be a finite number"),
    (b"[[behaviours.rounds]]\nn = 5\nrows = 1\ncolumns = 1\nactivation = 0.1", "behaviours.rounds.0.n: "),
    (b"[policies\n", "is not TOML (Expected ']'"),
    (b"\xff\xfe", "is not TOML ('utf-8' codec"),
    (b"[policies]\nsweeps = " + b"1" * 5_000, "is not TOML (Exceeds the limit"),
    (b"[imports]\nmegabytes = 0x" + b"f" * 5_000, "imports.megabytes: "),
    (b"[imports]\nseconds = 1e300", "imports.seconds: input should be less than or equal to 86400"),
])
def test_errors(text, said):
    """An error is one line that names the file and the key."""
    with pytest.raises(BadSettings) as caught:
        parse_settings(text, where="club.toml")
    assert str(caught.value).startswith(f"club.toml: {said}")
    assert "\n" not in str(caught.value)


def test_byte_order_mark():
    """A file that begins with the mark that some editors write is read."""
    assert parse_settings(b"\xef\xbb\xbf[policies]\nsweeps = 3", where="club.toml").policies.sweeps == 3


@pytest.mark.parametrize(("said", "keys"), [
    ("", ("full36", "self6", "role0")), ("state_key = 'self6'", ("self6", "role0")), ("state_key = 'role0'", ("role0",)),
    ("backoff = []", ("full36",)), ("backoff = ['team19', 'self9', 'role0']", ("full36", "team19", "self9", "role0")),
])
def test_backoff(said, keys):
    """The keys to back off to are taken in order; if none are named, those of self6 and role0 that are coarser."""
    assert parse_settings(f"[knowledge]\n{said}".encode(), where="s.toml").knowledge.state_keys == keys


@pytest.mark.parametrize(("state_key", "backoff"), [
    ("self9", ["team19"]), ("team19", ["ego19"]), ("full36", ["self6", "self9"]), ("full36", ["full36"]),
    ("full36", ["self9", "self9"]),
])
def test_backoff_refused(state_key, backoff):
    """A key to back off to that is not coarser than the one before is refused."""
    text = f"[knowledge]\nstate_key = '{state_key}'\nbackoff = {backoff}"
    with pytest.raises(BadSettings, match=rf"knowledge: each key of backoff must be coarser .*{backoff[-1]}\)"):
        parse_settings(text.encode(), where="s.toml")


@pytest.mark.parametrize(("watch", "why"), [
    ([], "at least 1 item"), (["away", "away"], r"a team is named twice \(it is: away, away\)"), (["us"], "watch.0: "),
])
def test_watch(watch, why):
    """Sides are one or both, each named once."""
    with pytest.raises(BadSettings, match=why):
        parse_settings(f"[sides]\nwatch = {watch}".encode(), where="s.toml")
    both = parse_settings(b"[sides]\nwatch = ['away', 'home']", where="s.toml")
    assert both.sides.watch == ("away", "home")


def rounds(*lengths: int) -> bytes:
    if not lengths:
        return b"[behaviours]\nrounds = []"
    return b"".join(b"[[behaviours.rounds]]\nn = %d\nrows = 2\ncolumns = 2\nactivation = 0.1\n" % n for n in lengths)


@pytest.mark.parametrize("lengths", [(4, 3, 2, 1), (3, 1), (2,)])
def test_rounds_fall(lengths):
    """Rounds are taken if their n falls from one to the next."""
    chosen = parse_settings(rounds(*lengths), where="s.toml").behaviours.rounds
    assert chosen == tuple(RoundSettings(n=n, rows=2, columns=2, activation=0.1) for n in lengths)


@pytest.mark.parametrize(("lengths", "found"), [
    ((), "none"), ((1, 2), "1, 2"), ((3, 3), "3, 3"), ((4, 2, 3), "4, 2, 3"),
])
def test_rounds_refused(lengths, found):
    """Rounds are refused if their n does not fall, or if there are none."""
    with pytest.raises(BadSettings, match=rf"behaviours\.rounds: there must be a round, and n must fall .*{found}\)"):
        parse_settings(rounds(*lengths), where="s.toml")


@pytest.mark.parametrize("given", [
    {"trajectories": {"window_samples": 2**63 - 1}}, {"models": {"seed": -1}}, {"behaviours": {"seed": -1}},
    {"knowledge": {"habits": {"seed": -5}}}, {"behaviours": {"seed": 2**32}}])
def test_numbers_that_a_library_breaks_on(given):
    """Seeds that a generator refuses, and windows that no memory holds, are refused before any work."""
    with pytest.raises(ValidationError):
        Settings.model_validate(given)


@pytest.mark.parametrize("root", [RunSettings, SeasonSettings, MatchSettings])
def test_numbers_are_bounded(root):
    """Every number of a settings file has a least and a greatest value, so that no work by it is endless."""
    def numbers(model, table=""):
        for name, field in model.model_fields.items():
            kinds = [field.annotation, *get_args(field.annotation)]
            for kind in kinds:
                if isinstance(kind, type) and issubclass(kind, Frozen):
                    yield from numbers(kind, f"{table}{name}.")
            if {int, float} & {getattr(kind, "__origin__", kind) for kind in kinds}:
                inner = [each for kind in kinds for each in getattr(kind, "__metadata__", ())]
                yield f"{table}{name}", [*field.metadata, *(bound for each in inner for bound in each.metadata)]

    found = dict(numbers(root))
    assert len(found) > 15
    assert [name for name, bounds in found.items() if not (
        any(isinstance(bound, Ge | Gt) for bound in bounds) and any(isinstance(bound, Le | Lt) for bound in bounds))] == []
