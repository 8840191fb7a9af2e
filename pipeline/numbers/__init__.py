"""Numbers: arrays, exact sums, estimates, statistics, trees."""
