"""VSSReferee's commands by the messages of the package V3SProtoComm: lines of JSON in, lines of JSON out.

``{"foul": …, "teamcolor": …, "foulQuadrant": …, "timestamp": …, "gameHalf": …}`` (names, as protobuf's JSON has them)
gives ``{"hex": …}``, and ``{"hex": …}`` gives the names.
"""

import json
import sys

from google.protobuf.json_format import MessageToDict, ParseDict
from V3SProtoComm.core.comm.protocols.vssref_command_pb2 import VSSRef_Command

for line in sys.stdin:
    asked = json.loads(line)
    if "hex" in asked:
        reported = MessageToDict(VSSRef_Command.FromString(bytes.fromhex(asked["hex"])), including_default_value_fields=True)
    else:
        reported = {"hex": ParseDict(asked, VSSRef_Command()).SerializeToString().hex()}
    print(json.dumps(reported))
