"""How robots act: steering, the executors of all situations, and the teams that are made of them."""
