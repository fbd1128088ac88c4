"""A log, or a run in progress, served to Foxglove over its WebSocket."""
