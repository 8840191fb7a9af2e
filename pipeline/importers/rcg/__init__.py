"""RoboCup 2D text logs (rcssserver's ULG4, ULG5 and ULG6).

The grammar is that of rcssserver's ``serializermonitor.cpp``. The server's axes have y down and
angles in degrees clockwise, and its velocities are metres a cycle; here y is up, angles are
radians counter-clockwise and velocities metres a second. The left team attacks +x throughout:
rcssserver never changes sides, not even at half-time (``Stadium::callHalfTime``).

``lines`` parses a log, ``players`` makes samples and commands of its show lines, ``events`` makes events of
its playmodes and scores, and ``reading`` makes the match.
"""
