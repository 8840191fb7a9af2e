"""Field numbers of the messages in SSL logs.

They are facts, from two public sources each, which agree:

- detection, geometry (2014 and legacy) and their wrapper: the descriptors of the Python package sslclient
  1.1.2 (MIT), and the league's vision protocol as RoboCup-SSL/ssl-game-controller keeps it
  (``proto/vision/ssl_vision_*.proto`` at 66253dd);
- legacy geometry: sslclient 1.1.2, and ER-Force's framework (``src/protobuf/ssl_geometry.proto`` at 6b63036);
- tracked frames: ssl-game-controller (``proto/tracker/ssl_vision_*_tracked.proto`` at 671c293), and
  ER-Force's framework (``src/protobuf/ssl_vision_detection_tracked.proto`` at abe6334);
- referee: ssl-game-controller (``proto/state/ssl_gc_referee_message.proto`` at 671c293), and ER-Force's
  framework (``src/protobuf/ssl_referee.proto`` at 2adfccd), which also has the messages of 2013 to 2018.

Only the fields that are read are named. Lengths are millimetres and times seconds unless said otherwise.
"""

from __future__ import annotations

# wrapper of a vision packet
WRAPPER_DETECTION, WRAPPER_GEOMETRY = 1, 2

# detection frame of one camera; t_capture, t_sent: Unix time, double
FRAME_NUMBER, FRAME_CAPTURE, FRAME_SENT, FRAME_CAMERA = 1, 2, 3, 4
FRAME_BALLS, FRAME_YELLOW, FRAME_BLUE = 5, 6, 7

# detected ball: confidence in [0, 1]
BALL_CONFIDENCE, BALL_X, BALL_Y = 1, 3, 4

# detected robot: confidence in [0, 1], orientation in radians
ROBOT_CONFIDENCE, ROBOT_ID, ROBOT_X, ROBOT_Y, ROBOT_ORIENTATION = 1, 2, 3, 4, 5

# geometry
GEOMETRY_FIELD = 1
#: Field size since 2014.
SIZE_LENGTH, SIZE_WIDTH, SIZE_GOAL_WIDTH, SIZE_GOAL_DEPTH = 1, 2, 3, 4
#: Field size before; its first field is the width of a line.
LEGACY_LINE, LEGACY_LENGTH, LEGACY_WIDTH = 1, 2, 3
LEGACY_GOAL_WIDTH, LEGACY_GOAL_DEPTH = 6, 7

# wrapper of a tracker's packet
TRACKER_UUID, TRACKER_NAME, TRACKER_FRAME = 1, 2, 3

# tracked frame: metres, m/s, radians; the first ball is the primary one
TRACKED_NUMBER, TRACKED_TIME, TRACKED_BALLS, TRACKED_ROBOTS = 1, 2, 3, 4
TRACKED_BALL_PLACE, TRACKED_BALL_SPEED, TRACKED_BALL_VISIBILITY = 1, 2, 3
TRACKED_ROBOT_ID, TRACKED_ROBOT_PLACE, TRACKED_ROBOT_ORIENTATION = 1, 2, 3
TRACKED_ROBOT_SPEED, TRACKED_ROBOT_TURN, TRACKED_ROBOT_VISIBILITY = 4, 5, 6
VECTOR_X, VECTOR_Y = 1, 2
#: Robot's number and its team: 1 yellow, 2 blue.
ID_NUMBER, ID_TEAM = 1, 2
ID_YELLOW, ID_BLUE = 1, 2

# referee: stage and command are enumerations, see ``commands``
REFEREE_STAGE, REFEREE_COMMAND, REFEREE_COUNTER = 2, 4, 5
#: Time left of the stage, microseconds, a signed varint in zigzag; negative when the stage lasts longer.
REFEREE_TIME_LEFT = 3
REFEREE_YELLOW, REFEREE_BLUE = 7, 8
REFEREE_BLUE_ON_POSITIVE, REFEREE_SOURCE = 10, 18
TEAM_NAME, TEAM_SCORE, TEAM_RED_CARDS, TEAM_YELLOW_CARDS = 1, 2, 3, 5
