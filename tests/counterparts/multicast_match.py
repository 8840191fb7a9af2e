"""Watches VSSS's own groups in a network of its own, while it sends forty frames to them. Prints what came."""

import json
import socket
import sys
import time
from pathlib import Path
from threading import Thread

from support.vsss_messages import environment

from pitchlore.pipeline.importers.packets.streams import LEAGUES
from pitchlore.pipeline.sessions.watching import watch
from pitchlore.pipeline.store import Store

SENT = 40


def send(_: dict[str, str]) -> None:
    """Send to the group of vision, from a thread."""
    vision = LEAGUES["vsss"][0]

    def go() -> None:
        mouth = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        for step in range(SENT):
            mouth.sendto(environment(step, (0.1, 0.0)), (vision.group, vision.port))
            time.sleep(0.01)

    Thread(target=go).start()


done = watch(Store(Path(sys.argv[1])), "vsss", LEAGUES["vsss"], interface="127.0.0.1", seconds=1.5, listening=send)
print(json.dumps({"packets": done.packets, "sent": SENT}))
