"""What shows a run in Foxglove, Lichtblick and Rerun without configuration."""
