"""RoboCup 2D logs (rcssserver's ULG4, ULG5 and ULG6, and its JSON).

The grammar is that of rcssserver's ``serializermonitor.cpp``. The server's axes have y down and
angles in degrees clockwise, and its velocities are metres a cycle; here y is up, angles are
radians counter-clockwise and velocities metres a second. The left team attacks +x throughout:
rcssserver never changes sides, not even at half-time (``Stadium::callHalfTime``).

``json_lines`` says a JSON log in the words of a text log, ``lines`` parses that, ``players`` makes samples
and commands of its show lines, ``stamina`` reads stamina in some of them, ``events`` makes events of its
playmodes and scores, and ``reading`` makes the match.
"""
