"""Teams, made of the tactics of ``pipeline.game.tactics``.

==============  ==============================================================
table           TEAMS: an entry for each team, with its script
static          fixed roles and rules; on these build human_like, pressing and counter
human_like      one robot is driven as by a person
pressing        a high press
counter         a deep block, then passes forward
moving_randomly random movements
constant        teams whose robots take one behaviour again and again, and the best of them
panel           the opponents that every team is measured against
people          settings of the person of a human-like team
learned         the team that plays a policy, laid out as a policy_table
clock           when a team that plays a policy decides
appraising      the team that looks: trees appraise its actions at what robots see
predicting      bodies as they are now, for a team whose camera is late
chosen          a team whose robots carry out what somebody chooses
==============  ==============================================================
"""
