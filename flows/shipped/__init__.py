"""Files that come with Pitchlore and are not code: the notebooks, and the tables of our studies."""

from importlib.resources import files
from pathlib import Path
from typing import Literal

#: Where a checkout keeps them. A wheel has each in a folder of its name beside this module.
_IN_CHECKOUT = {"notebooks": "notebooks", "studies": "data/studies"}


def shipped(name: Literal["notebooks", "studies"]) -> Path:
    """Folder of the shipped files of this name."""
    here = Path(str(files(__name__))).resolve()  # a checkout reaches it by a link
    in_wheel = here / name
    return in_wheel if in_wheel.is_dir() else here.parents[1] / _IN_CHECKOUT[name]
