"""The study of labels: what people saw on film beside what the recogniser says (data/studies/labels)."""
