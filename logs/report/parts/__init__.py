"""The parts of a view, each gathered from the messages of some topics; see `Gatherer`."""
