"""What happens to frames between the endpoints: transmit queue, random impairments, outages."""
