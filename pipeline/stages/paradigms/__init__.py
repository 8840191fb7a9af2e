"""The paper's comparison of paradigms: learners in games, and the verdicts on their results."""
