"""Trajectories: a log as one table of bodies, cleaned, with velocities and roles."""
