"""The window in which a person plays; the only package that imports pygame (extra ``play``).

==============  ==============================================================
screen          the window: opened, listened to, painted, in time
controls        what keys, buttons and sticks ask for
painting        draws a picture
picture         the contents of the window at one frame; needs no pygame
==============  ==============================================================
"""

import os

# read when pygame is imported; standard output is the command's
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
