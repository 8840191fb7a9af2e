"""The study of teams from recordings runs: copies, controls, one table; what was done is not done again."""

from concurrent.futures import ThreadPoolExecutor

from from_recordings import study


def test_table(tmp_path, monkeypatch):
    """A constant team is recorded; what is learned from it, and its controls, play static."""
    monkeypatch.setattr(study, "workers", lambda: ThreadPoolExecutor(1))
    small = study.Study(tmp_path / "data", recorded=(1,), pairs=2, seconds=20.0)
    table = study.main(small, tmp_path, teams=("best-constant",))
    assert table["team"].to_list() == [
        "itself", "copy", "copy, noisy camera", "recognised codes, Sarsa", "copy, clues shuffled"]
    assert table["recordings"].to_list() == [0, 1, 1, 1, 1]
    assert table["matches"].unique().to_list() == [4]
    assert study.main(small, tmp_path, teams=("best-constant",)).equals(table)
