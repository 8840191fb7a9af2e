"""Studies: seasons, paradigms, evaluations, and the verdicts on their claims."""
