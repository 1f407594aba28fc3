"""Everything that was found goes in; out comes one page that needs no network, with drives to replay.

Door: `page`.
"""
