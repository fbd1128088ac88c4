"""The worked example of the seed's figure 1, computed and drawn."""
