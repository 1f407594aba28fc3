"""Files of recorded traffic go in; out come `Recording` objects on one road each, in SI units and lanes, checked.

`read` asks the formats, whose tracks find their road and become recordings. Door: `read`, `recording` and `summary`;
`checks` and `map_tracks` are what a reader of your own needs.
"""
