"""The worked example of the seed, its figure 1: computed and drawn."""
