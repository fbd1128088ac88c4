"""What was so at a moment, and why: for `farside why`."""
