"""The trajectory basis: an ε-cover of all segments, how it is searched, and how small any could be (paper §2.1)."""
