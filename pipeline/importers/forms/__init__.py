"""Tables of others' forms: facts that they leave unsaid are found, and said; maps that are known already.

=========  ====================================================================
plan       how a table is read: its columns by their names, other words, or a map
naming     other words for columns, and the units at their ends (words.toml)
clocks     times that are dates, durations, or count samples
periods    time that begins anew each half
absent     numbers that stand for "not seen"
origin     places that are not counted from the pitch's centre, or not in metres
angles     the unit of headings
presets    maps of forms that are known, by name (presets.toml)
together   tables of one match in several files
offer      maps for tables that were refused
unread     files that are met beside recordings, and are not read by themselves
=========  ====================================================================

Each module but the last takes and gives a table, or refuses it; none of them knows a file or a match.
"""
