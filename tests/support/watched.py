"""Controllers: one whose views and wheels are kept, one that plays by a script."""

import numpy as np

from pitchlore.pipeline.arena.match.controllers import Controller


class Watched(Controller):
    """Keeps what a player is shown, ``shown``, and what it commands, ``wheels``, frame by frame."""

    def __init__(self, inner):
        self.inner, self.shown, self.wheels = inner, [], []

    def restarted(self, frame, lead):
        self.inner.restarted(frame, lead)

    def think(self, frame, view, wheels):
        self.shown.append(view.copy())
        wheels[:] = np.nan  # each has to be written at each frame
        self.inner.think(frame, view, wheels)
        self.wheels.append(wheels.copy())

    def stopped(self, frame, reward):
        self.inner.stopped(frame, reward)

    def decided(self):
        return self.inner.decided()


class Replayed(Controller):
    """Turns the wheels by a script: float64 [frames, N, 2]."""

    def __init__(self, script):
        self.script = script

    def think(self, frame, view, wheels):
        wheels[:] = self.script[frame]
