"""The noun sequences: situations one after the other, and what players decided and saw."""
