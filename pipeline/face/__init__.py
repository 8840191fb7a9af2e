"""The face: what ``import pitchlore`` shows. It says how the house is used, and holds no rule of its own."""
