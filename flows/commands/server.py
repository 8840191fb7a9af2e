"""The commands server start, stop and status: the Prefect server that a data folder keeps."""

from __future__ import annotations

import sys
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from pitchlore.flows.commands.common import DEFAULTS, Common, Json
from pitchlore.flows.commands.printing import console, print_json
from pitchlore.flows.server import Keeper

Port = Annotated[int, Parameter(validator=Number(gte=0, lte=65_535))]


def start(*, port: Port = 0, json: Json = False, common: Common = DEFAULTS) -> None:
    """Start the data folder's server unless it runs, and print its address.

    Args:
        port: Port on 127.0.0.1; 0 takes a free one.
        json: Print JSON.
        common: Options of every command.
    """
    record, new = Keeper(common.store.root).start(port)
    if json:
        print_json({"running": True, "new": new, "ui": record.ui, "api": record.api, "pid": record.pid})
        return
    console().print(f"{'started' if new else 'runs already'}: {record.ui}", soft_wrap=True)
    console().print("All commands that make something use it from now on", soft_wrap=True)


def stop(*, common: Common = DEFAULTS) -> None:
    """Stop the data folder's server, and wait until it has ended.

    Args:
        common: Options of every command.
    """
    record = Keeper(common.existing.root).stop()
    console().print("no server runs" if record is None else f"stopped: {record.ui}", soft_wrap=True)


def status(*, json: Json = False, common: Common = DEFAULTS) -> None:
    """Print whether the data folder's server runs; exit code 1 if it does not.

    Args:
        json: Print JSON.
        common: Options of every command.
    """
    keeper = Keeper(common.existing.root)
    record = keeper.look()
    running = record is not None and record.answers
    if json:
        where = {"ui": record.ui, "api": record.api, "pid": record.pid} if running and record else {}
        print_json({"running": running, **where})
    elif running and record:
        console().print(f"runs: {record.ui} (process {record.pid})", soft_wrap=True)
    elif record:
        console().print(f"the server has died (process {record.pid}); its log is {keeper.log}",
                        soft_wrap=True)
    else:
        console().print("no server runs: `pitchlore server start` starts one", soft_wrap=True)
    sys.exit(0 if running else 1)
