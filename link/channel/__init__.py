"""What happens to frames between the endpoints: queue, transmitter, chance and outages."""
