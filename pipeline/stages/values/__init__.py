"""Values: how likely a team is to score soon, and what situations change of it.

V of a moment is the probability that a team scores within the horizon and before play stops, minus the
probability that its adversary does. It is the state value of VAEP (Decroos et al. 2019, "Actions speak
louder than goals") for moments instead of actions: VAEP looks at the next ten actions, V at the next
seconds, and at the bodies instead of the last three actions.

==============  ==============================================================
moments         features of a moment, and whether the team scores soon
models          the models of one group of matches: logistic and boosting, cross-fitted, calibrated
trees           scikit-learn's boosted trees as arrays
worths          V at moments, and what situations change of it
==============  ==============================================================
"""
