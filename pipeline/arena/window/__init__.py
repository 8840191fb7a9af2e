"""The window in which a person plays; the only package that imports pygame (extra ``play``).

==============  ==============================================================
screen          the window: opened, listened to, painted, in time
controls        what keys, buttons and sticks ask for
painting        what it shows at one frame, and a picture of it; needs no pygame
==============  ==============================================================
"""

import os

# read when pygame is imported; standard output is the command's
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
