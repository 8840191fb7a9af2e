"""Sessions with a match that is being played: a person plays, a team drives robots, a league is recorded.

===========  =========================================================
person       a person's match in the window
human        the games of a season that a person plays now
watching     the packets of a match, recorded as they arrive
showing      a match that is being watched, in a window
driving      a team drives robots that another program simulates
simulating   the arena is a simulator for others' programs
===========  =========================================================
"""
