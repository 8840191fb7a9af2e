"""A controller for each situation of Table 1, by its code.

An action is begun with :func:`start` and carried on with :func:`act`, frame by frame, until its final
condition holds or its time is up.

==============  ==============================================================
actions         controller, aim and time limit of each code; the memory of an action
beginnings      ``start``: the aim, and the distance at which the action is over
acting          ``act``: a frame of it, by the controller of its code
with_ball       controllers of 001, 011, 021, 022 and 023
to_ball         controllers of 044, 045 and 047
to_things       controllers of 033, 034, 046, 088 to 174, but 108
endings         when it is over; of each code the condition in words
==============  ==============================================================

067, 068, 184, 194 and to face something (057, 078, 108) are a line each in ``acting``.
"""

from pipeline.arena.teams.executors.acting import act
from pipeline.arena.teams.executors.actions import ACTION, CODES, LIMIT_S
from pipeline.arena.teams.executors.beginnings import start

__all__ = ["ACTION", "CODES", "LIMIT_S", "act", "start"]
