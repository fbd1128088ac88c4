"""A mission as a `gymnasium` environment; needs the extra `gymnasium`. See `docs/gymnasium.md`."""
