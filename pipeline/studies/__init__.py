"""Studies: seasons, paradigms, evaluations, and how their claims are judged."""
