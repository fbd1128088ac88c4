"""What rides on the channel: messages as sealed frames, reliable transfer, the store."""
