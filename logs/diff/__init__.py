"""Where two runs part: their records in lockstep, their missions and their outcomes."""
