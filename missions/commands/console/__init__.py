"""The command `farside console`: a run with a person at the ground station."""
