"""Words for the columns of tables, in English and Portuguese: what a user may have meant."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Sequence
from difflib import get_close_matches

#: Our columns and other words for them; Portuguese without its accents. A word of two columns is of neither:
#: "time" is a time in English and a team in Portuguese, and is offered for the time alone, after "tempo".
WORDS_OF = {
    "frame": "frame frames framenumber frameid quadro quadros cycle ciclo tick step passo nr",
    "t": "t tempo time timestamp times seconds secs sec s ms instante segundos milliseconds us ns stamp",
    "period": "period periodid periodo half halfid tempodejogo meiotempo",
    "segment": "segment segmento",
    "team": "team teamname teamid side club squad colour color equipe lado clube cor who",
    "player": "player playerid id robot robotid robo number no agent jogador jogadorid numero agente",
    "x": "x px posx xpos positionx posicaox xm xcm xmm",
    "y": "y py posy ypos positiony posicaoy ym ycm ymm",
    "heading": "heading theta th angle yaw orientation dir direction angulo orientacao direcao rumo",
    "vx": "vx velx xvel velocityx velocidadex",
    "vy": "vy vely yvel velocityy velocidadey",
    "omega": "omega w vw vtheta angularvelocity velocidadeangular",
    "option": "option opcao",
    "score_home": "scorehome homescore goalshome golscasa placarcasa",
    "score_away": "scoreaway awayscore goalsaway golsfora placarfora",
    "game_state": "gamestate state playmode command referee estado estadojogo comando arbitro",
}
WORDS = {word: column for column, words in WORDS_OF.items() for word in words.split()}
#: Words for the ball.
BALLS = ("ball", "bola", "balon", "pelota", "booru")
#: Words for the home team and for the away team.
HOMES = {"home", "hometeam", "casa", "local", "mandante", "heim", "hoomu", "homu", "l", "left", "esquerda"}
AWAYS = {"away", "awayteam", "fora", "visitante", "gast", "auswaerts", "awei", "r", "right", "direita"}

#: Columns of a file that are looked at.
_AT_MOST = 1000


def bare(name: str) -> str:
    """A name in lower-case letters and digits, without accents, blanks and signs."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]", "", plain)


def meant(column: str, wanted: str, found: Sequence[str], taken: Collection[str] = ()) -> str | None:
    """The file's column that a user may have meant by one that is missing; None if nothing is near.

    Args:
        column: ours.
        wanted: its name in the map.
        found: the file's columns.
        taken: names among them that are read as other columns.
    """
    some = found[:_AT_MOST]
    free = {bare(name): name for name in reversed(some) if name not in taken and bare(name)}
    named = [word for word in WORDS_OF.get(column, "").split() if word in free]
    if named:
        return free[named[0]]
    for name in free.values():  # team_name, robot id, x [m]
        parts = [bare(part) for part in re.split(r"[^0-9A-Za-zÀ-ÿ]+", name)]
        if any(WORDS.get(part) == column and len(part) > 1 for part in parts):
            return name
    near = [name for name in free if WORDS.get(name, column) == column]
    close = get_close_matches(bare(wanted), near, 1, 0.75)
    return free[close[0]] if close else None
