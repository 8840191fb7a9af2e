"""The paper's comparison of paradigms: learners played in games, and what their results show."""
