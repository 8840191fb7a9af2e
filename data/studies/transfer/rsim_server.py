"""The simulator rSim (rc-robosim 1.2), a step at a time, for a program that asks for it.

It needs a Python with robosim. On stdin come lines of JSON: ``{"place": [ball, blue, yellow]}`` with the
ball's x, y, vx, vy (m, m/s) and each robot's x, y and theta (m, degrees), or ``{"wheels": [[left, right],
...]}`` (rad/s), blue's robots first. To each it answers with a line: rSim's state.
"""

import json
import sys

import numpy as np
import robosim

robots, step_ms = (int(word) for word in sys.argv[1:])
spread = [[-0.2 * i, 0.0, 0.0] for i in range(1, robots + 1)]
simulator = robosim.VSS(
    0, robots, robots, step_ms, [0.0] * 4, spread, [[-x, y, theta] for x, y, theta in spread])
print(json.dumps({key: float(value) for key, value in simulator.get_field_params().items()}), flush=True)
for line in sys.stdin:
    asked = json.loads(line)
    if "place" in asked:
        simulator.reset(*(np.array(part, dtype=np.float64) for part in asked["place"]))
    else:
        simulator.step(np.array(asked["wheels"], dtype=np.float64))
    print(json.dumps(np.asarray(simulator.get_state()).tolist()), flush=True)
