"""What crosses between two Zenoh domains: samples, queries with replies, liveliness tokens."""
