"""Sets that follow the situation: one box around every vehicle and moment, whose place and size are learned."""
