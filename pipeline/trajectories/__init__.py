"""The noun trajectories: logs as one table of bodies, cleaned, with velocities and roles."""
