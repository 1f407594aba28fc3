"""The driver for simulators and cars that others wrote: plain states in, commands out, and a trace of what happened."""
