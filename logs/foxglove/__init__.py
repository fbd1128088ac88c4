"""Pictures of a run for Foxglove, Lichtblick and Rerun, beside the topics of Farside's own."""
