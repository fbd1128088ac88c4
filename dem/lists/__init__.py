"""The lists of the model: Signs, actions and hypotheses, goals, and counts of trials."""
