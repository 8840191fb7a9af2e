"""Robots' driving at a view: what wheels a situation's executor commands, and what it needs for that.

============  ==============================================================
executors     a controller for each situation of Table 1
goalkeeping   a goalkeeper on its line, where the ball will cross it
ball          possession, the ball's way, driving that moves it
steering      wheel speeds toward a direction, a place or a pose
roles         goalkeeper, midfield and striker by distance to the own goal
geometry      lengths, directions and speeds in a view
measures      lengths, speeds and times of pitch, robots and clock
splitmix      random numbers for compiled functions
============  ==============================================================
"""
