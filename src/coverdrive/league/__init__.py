"""The league: who drives best where, on equal seeds."""
