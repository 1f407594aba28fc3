"""Planning the own car's motion against every predicted path (paper §4). CasADi is used only here."""
