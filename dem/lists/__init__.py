"""The lists of the model: Signs, actions, hypotheses, predictions, goals, and trial counts."""
