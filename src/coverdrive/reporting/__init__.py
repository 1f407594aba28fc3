"""What was found goes in; out comes what a person looks at: page, figures, tables, pictures and videos of drives.

Door: `report`, `contents` and `claim`.
"""
