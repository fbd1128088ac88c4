"""The three nodes of a run, moved together: in one process, or in one each over Zenoh."""
