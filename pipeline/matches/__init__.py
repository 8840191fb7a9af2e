"""Match logs as MCAP: the recorder and the reader, beside each other.

This is the only package that imports mcap or touches a log's bytes. Both sides move whole chunks between
bytes and numpy arrays; no loop runs over messages. A CRC covers every byte that is written, and every CRC
is checked on reading. Damaged parts are reported and left out; whole parts are kept.

==============  ==============================================================
recorder        writes a match
reader          reads a match, damaged ones included
mcap_writer     writes an MCAP file: chunks as they fill, then the summary
mcap_file       finds an MCAP file's parts, and keeps the whole ones
description     the metadata record: facts and flaws of the match
channels        the channels and their definitions
inbox           messages that were read, sorted by topic, as tables
cdr             payloads: samples, events, decisions, commands, heights, options to bytes and back
messages        message records in batches: heads and tails
chunks          chunks: sealed with their indexes, opened and checked
records         records as bytes: found, walked over, encoded
holes           holes in numbers that count up
table           the row of a match in the table Matches
==============  ==============================================================
"""

from pitchlore.pipeline.matches.mcap_file import MAX_LOG_BYTES
from pitchlore.pipeline.matches.mcap_writer import CHUNK_BYTES, LEVEL
from pitchlore.pipeline.matches.reader import read
from pitchlore.pipeline.matches.recorder import Recorder, packed, write
from pitchlore.pipeline.matches.table import row

__all__ = ["CHUNK_BYTES", "LEVEL", "MAX_LOG_BYTES", "Recorder", "packed", "read", "row", "write"]
