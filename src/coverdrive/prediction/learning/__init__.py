"""What a network learns from and how: affordances, labels, inputs, losses, training (paper §2.2 to §3.1)."""
