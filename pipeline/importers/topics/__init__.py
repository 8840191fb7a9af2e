"""Recordings of other programs' topics: MCAP of ROS 2 (CDR), JSON and protobuf.

So rosbag2 and Foxglove write. ``settings`` has the table ``[[topics]]`` of a map, which says which topic is
what, ``decoding`` turns messages into values, ``bodies`` finds the bodies in a value, ``sampling`` chooses
the samples, and ``reading`` makes the match. This room is the door to the decoders of the extra ``ros``,
which are loaded only when they are used.
"""
