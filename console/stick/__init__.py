"""The stick: it tells what the ground finds of an action before that action is ordered."""
