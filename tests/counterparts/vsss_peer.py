"""The package vsss-client, as its users use it: it sees a match for some seconds, and drives blue's robots.

``python vsss_peer.py VISION_PORT COMMAND_PORT SECONDS``; prints what it saw of its robots, first and last.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

from vsss_client import Command, FIRASim, Team

vision, commands, seconds = sys.argv[1:]
with tempfile.TemporaryDirectory() as folder:
    config = Path(folder) / "config.ini"
    config.write_text(f"[FIRA]\nvision_address=127.0.0.1\nvision_port={vision}\n"
                      f"command_address=127.0.0.1\ncommand_port={commands}\n")
    simulator = FIRASim(str(config))
simulator.vision_sock.settimeout(10.0)
print("ready", flush=True)
frames = []
until = time.monotonic() + float(seconds)
while time.monotonic() < until:
    environment = simulator.env()
    frame = environment.frame
    frames.append({"step": environment.step, "ball": [frame.ball.x, frame.ball.y],
                   "blue": [[robot.robot_id, robot.x, robot.y] for robot in frame.robots_blue],
                   "yellow": len(frame.robots_yellow),
                   "field": [environment.field.length, environment.field.width]})
    simulator.send_command([Command(Team.BLUE, number, 20.0, 20.0) for number in range(3)])
print(json.dumps([frames[0], frames[-1], len(frames)]))
