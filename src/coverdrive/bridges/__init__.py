"""Other people's worlds and interfaces, each an extra of its own."""
