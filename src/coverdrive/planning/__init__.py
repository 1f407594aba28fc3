"""Planning the ego's motion against every predicted path (paper §4)."""
