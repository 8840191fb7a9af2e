"""How robots act: steering, the executors of all situations, and the teams that are made of them.

==============  ==============================================================
teams           the teams of fixed rules behind one call: static, human_like, moving_randomly
learned         the team that plays a policy, laid out as a playbook
executors       each situation of Table 1 as something that a robot can do
goalkeeping     to stand on the goal line where the ball will cross it
ball            who has the ball, where it will be, driving that moves it
steering        wheel speeds toward a direction, a place or a pose
roles           who is goalkeeper, midfield and striker
geometry        lengths, directions and speeds in a view
measures        pitch, robots and clock as players reckon with them
splitmix            random numbers for compiled functions
==============  ==============================================================
"""
