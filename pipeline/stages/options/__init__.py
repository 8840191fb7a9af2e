"""Options: what each robot did from one decision to the next, recovered from motion alone.

An option has an executor (``pipeline.game.tactics.executors``), which says what wheels it commands at a
view. From a recorded state all executors are run for a window of a fifth of a second, and compared with
what the robot did (inverse dynamics). Away from other bodies that is exact. A robot that touches something
moves as the contact makes it: there, how much more probable its motion is with one option than with another
is what boosted trees have learned from matches of our arena between teams that deal options at random.

==============  ==============================================================
commands        wheels of all options for each robot and sample
windows         windows of a robot's motion, and the features of each option in them
likelihood      the trees that come with the package
habits          habits of a team, and options by motion and habits together
recover         the tables options and clues
==============  ==============================================================
"""
