"""Files that come with Pitchlore and are not code: the notebooks, and the tables of our studies."""

from __future__ import annotations

from pathlib import Path

#: The package in a wheel, the checkout otherwise, which the package is linked from.
_ROOT = Path(__file__).resolve().parents[2]


def studies() -> Path:
    """Folder with the tables of our studies, which come with Pitchlore; each study has a folder in it.

    Returns:
        A folder with ``paradigms/`` (section 5 of the paper) and ``seasons/`` (sections 4 and 6): CSV files.

    Examples:
        >>> (pitchlore.studies() / "seasons" / "games.csv").is_file()
        True
    """
    return _shipped("studies", "data/studies")


def notebooks() -> Path:
    """Folder with the notebooks."""
    return _shipped("notebooks", "notebooks")


def _shipped(name: str, in_checkout: str) -> Path:
    in_wheel = _ROOT / "shipped" / name
    return in_wheel if in_wheel.is_dir() else _ROOT / in_checkout
