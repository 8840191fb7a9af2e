"""Tables of others' forms: facts that they leave unsaid are found, and said.

=========  ====================================================================
periods    time that begins anew each half
absent     numbers that stand for "not seen"
origin     places that are not counted from the pitch's centre, or not in metres
angles     the unit of headings
=========  ====================================================================

Each module takes and gives a table, or refuses it; none of them knows a file or a match.
"""
