"""Places in the grid world, as its states; a position is (row, column), counted from 1."""

#: Actions by number.
UP, DOWN, LEFT, RIGHT, STAY = range(5)


def cell(position):
    row, column = position
    return 5 * (row - 1) + (column - 1)


def state_of(first, second):
    """State in which the two agents are at these positions."""
    return 25 * cell(first) + cell(second)


def positions(state):
    """Positions of the two agents in a state."""
    first, second = divmod(int(state), 25)
    return (first // 5 + 1, first % 5 + 1), (second // 5 + 1, second % 5 + 1)
