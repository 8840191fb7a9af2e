"""A recorded match as the packets of a league that would have been sent while it was played."""

from support import vsss_messages

from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import channels
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.schemas import AWAY, HOME

#: Frames between a kick-off and the words "game on".
KICKOFF = 12


def vsss_packets_of(match: MatchLog, seconds: float, begin_ns: int) -> list[Packet]:
    """FIRASim's and VSSReferee's packets of a match: home is blue, positions only."""
    vision, referee = channels("vsss")["vision"], channels("vsss")["referee"]
    said = {"goal": vsss_messages.STOP, "fault": vsss_messages.STOP, "half": vsss_messages.STOP,
            "kick-off": vsss_messages.KICKOFF}
    events = match.referee.select("t_ns", "event", "score_home", "score_away").rows()
    found, score, game_on = [], (0, 0), -1
    frames = match.frames
    for i, t_ns in enumerate(frames.t_ns.tolist()):
        if t_ns > seconds * 1e9:
            break
        now = begin_ns + t_ns
        while events and events[0][0] <= t_ns:
            _, event, home, away = events.pop(0)
            score = (home or 0, away or 0)
            found.append(Packet(referee, now, vsss_messages.command(said[event])))
            game_on = i + KICKOFF if event == "kick-off" else -1
        if i == game_on:
            found.append(Packet(referee, now, vsss_messages.command(vsss_messages.GAME_ON)))
        rows = frames.robots[frames.offsets[i]:frames.offsets[i + 1]]
        teams = [[(int(row["id"]), float(row["x"]), float(row["y"]), float(row["theta"])) for row in rows[rows["team"] == team]]
                 for team in (AWAY, HOME)]
        ball = (float(frames.ball[i]["x"]), float(frames.ball[i]["y"]))
        content = vsss_messages.environment(i, ball if ball[0] == ball[0] else None, *teams, goals=score)
        found.append(Packet(vision, now, content))
    return found
