"""How situations are recognised: rules as text, the scene as signals, conditions, occurrences."""
